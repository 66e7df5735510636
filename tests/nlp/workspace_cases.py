"""What tests of workspaces share: cases over boxes of poses, their proofs on paper, and other proofs made of these."""

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from builders import case_tables, ends, turn_about
from hexapods import case_of_legs

from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Judgement, Task, TurnKind, Turns, Workspace, build_model, judge_workspace
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.proof.checker.proof_file import Premises, Proof, ProofClaim, ProofError, Unproved, read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.pose_boxes import PoseRoot, pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import RankClaim, rank_claim
from screwsynth.nlp.proof.statement.fixed_robot import Legs, workspace_of_case
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import Problem, build_problem

#: Positions of a workspace of LinuxCNC's hexapod.
POSITION = (Free(-5.0, 5.0), Free(-5.0, 5.0), Free(15.0, 25.0))


#: Three legs that follow from each other's loops, over a small box about home.
TRIPOD = """
[robot]
model = "3-rps"
parameters = { rb = 1, rp = 0.6, h = 1.1 }
[pose]
position = [0, 0, 1.1]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[workspace]
position = [{ min = -0.01, max = 0.01 }, { min = -0.01, max = 0.01 }, { min = 1.1, max = 1.11 }]
rotation = { roll = { min = -1, max = 1 }, pitch = { min = -1, max = 1 }, yaw = { min = -1, max = 1 } }
"""


#: Dimensions of robots.
ROBOTS = {
    "3-rps": {"rb": 1.0, "rp": 0.6, "h": 1.1},
    "6-rus": {"rb": 1.0, "rp": 0.6, "base_half": 20, "platform_half": 43, "crank": 0.35, "lift": 35, "h": 1.1},
    "6-ups": {"rb": 1.0, "rp": 0.45, "base_half": 60, "platform_half": 5, "h": 1.1},
    "three-upu": {"base_radius": 1.0, "platform_radius": 0.6},
}


#: A load, and the motion of cases about actuators.
CUT = Load("cut", (3.0, 1.0, -10.0), point=(0.0, 0.1, 0.1), any_force=2.0, any_moment=0.1)
LOADING = Loading((CUT,), Motion(1.0, 0.5))


def tables_of(
    name: str, sides: float = 0.05, rise: float = 0.02, turn: float = 5.0, tolerance: float = 1e-3, **tables: object
) -> dict[str, Any]:
    """Tables of a robot over a box about home, by its half sides, half its height and angles."""
    height = tables.pop("height", 1.1)
    about = {name: ends(turn) for name in ("roll", "pitch", "yaw")}
    place = {"position": [ends(sides), ends(sides), ends(rise, height)]}
    task = {"sense": "max", "axis": [1, 2, 6], "point": [0.3, 0.1, 1.2], "pitch": 0.1}
    given = {
        "units": {"length": "m"}, "pose": {"position": [0, 0, height]},
        "tolerance": {"joint_centre": tolerance} if tolerance else None,
        "task": [task], "workspace": place | ({"rotation": about} if turn else {}),
        "limits": {"actuator_rate": {"max": 5}} if name == "three-upu" else None,
    }  # fmt: skip
    couples = {"axes": "snu", "characteristic_length": 0.5} if name == "three-upu" else {}
    return case_tables({"model": name, "parameters": ROBOTS[name]} | couples, **given | tables)


def turned(kind: TurnKind, degrees: float) -> Workspace:
    """The hexapod's positions with rotations up to an angle: about any axis, about one, or by roll, pitch and yaw."""
    angle = Free(-math.radians(degrees), math.radians(degrees))
    return Workspace(POSITION, Turns(kind, (angle,) * (3 if kind is TurnKind.ROLL_PITCH_YAW else 1), (0.6, 0.0, 0.8)))


def gallery_case(name: str, part: float = 0.02, degrees: float = 5.0, seed: int | None = None) -> Case:
    """A robot of the gallery about its home, with its typical dimensions or random ones near them."""
    model = build_model(name)
    rng = np.random.default_rng(seed)
    factors = {item.name: 1.0 if seed is None else rng.uniform(0.95, 1.05) for item in model.parameters}
    values = {item.name: item.typical[0] * factors[item.name] for item in model.parameters}
    size, angle = max(abs(each) for each in (*model.home, *values.values())), math.radians(degrees)
    place = [Free(each - part * size, each + part * size) for each in model.home]
    workspace = Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3))
    return Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])], workspace=workspace)


def robot_of(name: str) -> Case:
    """A robot over a small box: six straight legs, with or without a tolerance, or one of the gallery."""
    about, along = Turns(TurnKind.AXIS, (Free(-0.05, 0.05),), (0.0, 0.6, 0.8)), Free(0.98, 1.02)
    if not name.startswith("legs"):
        case = replace(gallery_case(name, 0.006, 1), loading=LOADING)
        still = Workspace(workspace_of_case(case).position, Turns(TurnKind.AXIS, (0.0,)))
        return replace(case, workspace=still) if name == "delta" else case
    angles = np.radians([-5, 5, 115, 125, 235, 245])
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)
    platform = 0.5 * np.roll(ring, 1, axis=0) @ turn_about([0, 0, 1], math.radians(-60)).T
    if name.endswith("tolerance"):
        case = case_of_legs(Legs(ring, platform, 1e-3))
        return replace(case, loading=LOADING, workspace=Workspace([0.02, 0.0, along], about))
    turns = Turns(TurnKind.ANY_AXIS, (Free(-0.1, 0.1),))
    return replace(case_of_legs(Legs(ring, platform)), loading=LOADING, workspace=Workspace([0.02, 0.0, along], turns))


def exact_rows(robot: Legs, kind: TurnKind, axis: Sequence[float], y: Sequence[Fraction]) -> list[list[Fraction]]:
    """The rows of six legs at a point of the search, times a scale, from quaternions in fractions."""
    one, (a, b, c) = Fraction(1), (*y[3:], Fraction(0), Fraction(0))[:3]
    if kind is TurnKind.ANY_AXIS:
        w, i, j, k = one, a, b, c
    elif kind is TurnKind.AXIS:
        w, i, j, k = one, *(Fraction(each) * a for each in axis)
    else:
        # The product of the quaternions of yaw, pitch and roll.
        w, i, j, k = one + a * b * c, a - b * c, b + a * c, c - a * b
    scale = w * w + i * i + j * j + k * k
    turn = (
        (w * w + i * i - j * j - k * k, 2 * (i * j - w * k), 2 * (i * k + w * j)),
        (2 * (i * j + w * k), w * w - i * i + j * j - k * k, 2 * (j * k - w * i)),
        (2 * (i * k - w * j), 2 * (j * k + w * i), w * w - i * i - j * j + k * k),
    )
    rows = []
    for base, platform in zip(robot.base.tolist(), robot.platform.tolist(), strict=True):
        d = [each - Fraction(b) for each, b in zip(y[:3], base, strict=True)]
        u = [sum((r * Fraction(x) for r, x in zip(row, platform, strict=True)), Fraction(0)) for row in turn]
        moment = [u[1] * d[2] - u[2] * d[1], u[2] * d[0] - u[0] * d[2], u[0] * d[1] - u[1] * d[0]]
        rows.append([*(scale * part + each for part, each in zip(d, u, strict=True)), *moment])
    return rows


def box_of(case: Case) -> PoseBox:
    """The box of a case's workspace, as the search has it."""
    return pose_box(workspace_of_case(case))


def root_of(case: Case) -> PoseRoot:
    """The box of a case's workspace, as the check has it."""
    return pose_root(workspace_of_case(case))


def problem_of(case: Case) -> Problem:
    """The robot over a case's workspace, its unknowns in closed form where they have one."""
    return build_problem(case, closed_form(case.model).model, box_of(case))


def rank_of(case: Case, *given: Any) -> RankClaim:  # noqa: ANN401 - a tolerance, and a robot with errors
    """The claim that a robot is regular over a case's workspace, as the check has it."""
    return rank_claim(case, closed_form(case.model).model, root_of(case), "regular", *given)


def written(
    case: Case, text: str = "", *, quantities: tuple[str, ...] = (), leg_error: float = 0.0, **options: object
) -> tuple[Judgement, Proof]:
    record, asked = ProofRecord(), {"quantities": quantities, "leg_error": leg_error}
    judged = judge_workspace(case, record=record, **asked, **options)
    return judged, proof_of(judged, record, text, **asked)


def on_paper(case: Case, text: str = "", **options: object) -> tuple[Judgement, Proof]:
    """A judgement and its proof, as its file is read."""
    judged, proof = written(case, text, **options)
    return judged, read_proof(proof.as_text(), "again")


def stated(proof: Proof) -> Premises:
    assert isinstance(proof.premises, Premises)
    return proof.premises


def stating(proof: Proof, **values: object) -> Proof:
    return replace(proof, premises=replace(stated(proof), **values))


def claim(proof: Proof, name: str, sense: str | None = None) -> ProofClaim:
    """The first claim or lemma of this name, and sense if one is given."""
    every = (*proof.claims, *proof.lemmas)
    return next(each for each in every if each.name == name and sense in (None, each.sense))


def altered(given: ProofClaim, **values: object) -> ProofClaim:
    """The claim with other values; a tree takes the place of the one in its file."""
    return replace(given, **({"packed": None} if "tree" in values else {}) | values)


def changed(proof: Proof, name: str, sense: str | None = None, **values: object) -> Proof:
    """The proof with other values in one of its claims, or lemmas."""
    old = claim(proof, name, sense)
    claims, lemmas = (
        tuple(altered(each, **values) if each is old else each for each in part)
        for part in (proof.claims, proof.lemmas)
    )
    return replace(proof, claims=claims, lemmas=lemmas)


def alone(proof: Proof, *names: str) -> Proof:
    """The proof with the claims of these names alone; it says of the others that they have none."""
    kept = tuple(each for each in proof.claims if each.name in names)
    others = (Unproved(each.name, each.sense, "left out") for each in proof.claims if each.name not in names)
    return replace(proof, claims=kept, unproved=(*proof.unproved, *others))


def only(proof: Proof, name: str, sense: str | None = None, **values: object) -> Proof:
    """The proof with one claim alone, and other values in it."""
    own = claim(proof, name, sense)
    others = (Unproved(each.name, each.sense, "left out") for each in proof.claims if each is not own)
    return replace(proof, claims=(altered(own, **values),), unproved=(*proof.unproved, *others))


def rejected(proof: Proof, case: Case) -> str:
    with pytest.raises(ProofError) as caught:
        check_workspace_proof(proof, case, leg_error=stated(proof).leg_error)
    return str(caught.value)
