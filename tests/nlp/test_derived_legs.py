"""Straight legs of robots given joint by joint: the same machine by its rows, and NumPy's geometry, agree with them."""

from __future__ import annotations

import copy
import itertools
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, case_of, output_of, refusal_of, saved, soaked, turn_about
from generated import made, needs_compiler, written
from measures import circle_joints, segment_distance

from screwsynth.models import Model, Substitution, robot, stewart_gough
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, Nlp, Status, formulate, judge_workspace, margins_of, result_of, solve
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.formats.solved.mechanism_of import mechanism_of
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of as proof_written
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.starter.text import starter_case

Tables = dict[str, Any]

FREE = {"x1": {"min": 20, "max": 32, "start": 26.5}, "x2": {"min": 8, "max": 15, "start": 11.543}}
FREE |= {"x3": {"min": 0, "max": 20, "start": 4}, "x4": {"min": 0, "max": 25, "start": 9}}
FIXED = {"x1": 26.5, "x2": 11.543, "x3": 5, "x4": 9}
RADIANS = FIXED | {name: math.radians(FIXED[name]) for name in ("x3", "x4")}
TASK = {"sense": "max", "axis": [1, 2, 6], "point": [3, 1, 12], "pitch": 0.1}
MOVES = [{"translation": each} for each in ([0, 0, 0], [3, 0, 0], [0, -3, 2])]
#: A workspace with a translation and a turn, and limits that hold over it.
WORKSPACE = {
    "position": [{"min": -1, "max": 1}, 0, {"min": 19, "max": 21}],
    "rotation": {"axis": [0, 1, 1], "angle": {"min": -4, "max": 4}},
}
HELD: dict[str, Tables] = {"leg_length": {"min": 18, "max": 36}, "leg_clearance": {"min": 3}}
HELD |= {"actuator": {"stroke_max": 9.2, "dead_length": 4}}


def leg(base: str | list[float], platform: str | list[float], axis: object, **slide: object) -> list[Tables]:
    """The joints of a leg: a universal joint, a driven slide, and a spherical joint."""
    return [
        {"type": "U", "at": base, "axes": [[1, 0, 0], [0, 1, 0]]},
        {"type": "P", "at": base, "axis": axis, "actuated": True, **slide},
        {"type": "S", "at": platform},
    ]


def octahedral(axis: str = "A - B") -> Tables:
    """The robot file of a stewart-gough with octahedral layout, joint by joint, with its parameters as dimensions."""
    limbs = []
    for k, (sign, mark) in itertools.product(range(3), (("-", "-"), ("+", "+"))):
        other = "+" if sign == "-" else "-"
        b, a = f"({120 * k}*pi/180 {sign} x3)", f"({120 * k}*pi/180 {sign} pi/3 {other} x4)"
        points = {"B": [f"x1*cos{b}", f"x1*sin{b}", 0], "A": [f"x2*cos{a}", f"x2*sin{a}", "h"]}
        limbs.append({"name": f"{k + 1}{mark}", "points": points, "joints": leg("B", "A", axis)})
    dimensions: Tables = {"x1": {"typical": 26.5}, "x2": {"typical": 11.543}}
    dimensions |= {name: {"kind": "angle", "typical": typical} for name, typical in (("x3", 5), ("x4", 9))}
    dimensions["h"] = {"typical": 20}
    return {"name": "joints", "home": [0, 0, "h"], "dimensions": dimensions, "limb": limbs}


def tables(robot_tables: Tables | None, parameters: Tables, limits: Tables, **more: object) -> Tables:
    """A case about the octahedral robot by its rows, or about one joint by joint."""
    own: Tables = {"model": "stewart-gough", "layout": "octahedral", "parameters": parameters}
    if robot_tables is not None:
        own = {"definition": robot_tables, "parameters": parameters | {"h": 20}}
    found = {"robot": own, "pose": {"position": [0, 0, 20]}, "task": [TASK], "solve": {"starts": 4, "seed": 1}}
    return copy.deepcopy({**found, "limits": limits, **more})


def both(parameters: Tables, limits: Tables, **more: object) -> tuple[Case, Case]:
    """The same case by rows, and joint by joint."""
    rows, joints = (case_from(tables(each, parameters, limits, **more)) for each in (None, octahedral()))
    return rows, joints


def margins(nlp: Nlp, x: Array) -> dict[tuple[str, str], float]:
    """The numbers that limits speak of at a point, by their names and sides."""
    return {(each.name, each.bound): each.value for each in margins_of(nlp, x, optimal=False)}


@pytest.mark.parametrize(
    ("key", "limits", "poses"),
    [
        ("leg_length.max", {"leg_length": {"min": 24, "max": 26}}, 1),
        ("leg_clearance.min", {"leg_clearance": {"min": 3}}, 1),
        ("footprint.base", {"footprint": {"base": 28, "platform": 12.5}}, 1),
        ("joint_spacing.min", {"joint_spacing": {"min": 4}}, 1),
        ("radius_ratio.max", {"radius_ratio": {"max": 0.4}}, 1),
        ("actuator_rate.max", {"actuator_rate": {"max": 15}}, 1),
        ("actuator.stroke_max", {"actuator": {"stroke_max": 4.2}}, 3),
        ("actuator.dead_length", {"actuator": {"dead_length": 28}}, 3),
    ],
)
def test_a_limit_of_legs_leads_both_descriptions_to_one_optimum(key: str, limits: Tables, poses: int) -> None:
    pose = {"position": [0, 0, 20], "displacements": MOVES[:poses]} if poses > 1 else {"position": [0, 0, 20]}
    found = []
    for case in both(FREE, limits, pose=pose):
        solution = solve(case)
        result = result_of(solution)
        assert result.status is Status.OPTIMAL
        assert any(each.active and each.key == key for each in result.margins)
        found.append((result.F, margins(solution.outcomes[0].own.nlp, solution.outcomes[0].x), result.robot.parameters))
    (F, numbers, design), (other_F, other_numbers, other_design) = found
    assert other_F == pytest.approx(F, rel=1e-8)
    assert other_numbers.keys() == numbers.keys()
    for name, value in numbers.items():
        assert other_numbers[name] == pytest.approx(value, rel=1e-6, abs=1e-6), name
    for name in FREE:
        assert other_design[name] == pytest.approx(design[name], rel=1e-5, abs=1e-5)


def test_a_3_upu_by_its_joints_has_the_lengths_of_one_by_its_rows() -> None:
    limits: dict[str, Tables] = {"leg_length": {"min": 0.5, "max": 0.9}, "leg_clearance": {"min": 0.1}}
    limits |= {"footprint": {"base": 0.6, "platform": 0.3}, "joint_spacing": {"min": 0.1}, "radius_ratio": {"max": 0.6}}
    place = {"position": [0.05, -0.03, 0.7]}
    push = {"sense": "max", "axis": [0.1, 0.2, 1], "pitch": math.inf}
    found = []
    for own, parameters in (
        ({"model": "three-upu", "axes": "tsai"}, {"base_radius": 0.57735, "platform_radius": 0.288675}),
        ({"model": "3-upu"}, {"rb": 0.57735, "rp": 0.288675, "h": 0.7}),
    ):
        case = case_of({**own, "parameters": parameters}, pose=place, task=[push], limits=limits)
        result = result_of(solve(case))
        found.append((result.F, {(each.name, each.bound): each.value for each in result.margins}))
    assert found[1][0] == pytest.approx(found[0][0], rel=1e-9)
    assert len(found[0][1]) == 14
    assert found[1][1] == pytest.approx(found[0][1], rel=1e-8)


def hexapod_at(Q: Array, base: Array, arms: Array, home: Array) -> Tables:
    """Six legs between points, turned or mirrored by Q at home, where the platform has the axes of the world."""
    limbs = []
    for b, a in zip(base @ Q.T, (home + arms) @ Q.T, strict=True):
        joints = leg(b.tolist(), a.tolist(), (a - b).tolist())
        joints[0]["axes"] = [(Q[:, k]).tolist() for k in (0, 1)]
        limbs.append({"joints": joints})
    return {"name": "turned", "home": (Q @ home).tolist(), "limb": limbs}


@pytest.mark.parametrize("mirror", [False, True])
def test_lengths_and_distances_do_not_depend_on_the_frame(*, mirror: bool) -> None:
    rng = np.random.default_rng(3)
    base, arms = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.1, "x4": 0.2})
    base, arms = base + rng.uniform(-2, 2, base.shape), arms + rng.uniform(-1, 1, arms.shape)
    home, p, R = np.array([1.0, 2.0, 20.0]), np.array([2.0, 1.0, 21.0]), turn_about([1, 2, 3], 0.2)
    ends = p + arms @ R.T
    Q = turn_about(rng.normal(size=3), 2.0) @ (np.diag([1.0, -1.0, 1.0]) if mirror else np.eye(3))
    turned = Q @ R @ Q.T
    vector = ca.DM(ca.inv_skew(turned - turned.T)).full().ravel() / 2
    case = case_of(
        {"definition": hexapod_at(Q, base, arms, home), "parameters": {}},
        pose={"position": (Q @ p).tolist(), "rotation": {"axis": vector.tolist(), "angle": math.degrees(0.2)}},
        task=[TASK],
        limits={"leg_length": {"max": 1e3}, "leg_clearance": {"min": 1e-3}, "joint_spacing": {"min": 1e-3}},
    )
    nlp = formulate(case)
    values = [each.value for each in margins_of(nlp, nlp.start, optimal=False)]
    lengths = np.linalg.norm(ends - base, axis=1)
    pairs = list(itertools.combinations(range(6), 2))
    apart = [segment_distance(base[i], ends[i], base[j], ends[j]) for i, j in pairs]
    spaced = [float(np.linalg.norm(plate[i] - plate[j])) for plate in (base, arms) for i, j in pairs]
    assert sorted(values) == pytest.approx(sorted([*lengths, *apart, *spaced]), rel=1e-6)


def test_the_legs_of_the_gallery() -> None:
    threes = ("3-upu", "3-rps", "3-spr", "planar-3-rpr", "tricept", "exechon")
    with_legs = {"6-ups": 6, "6-sps": 6, "4-upu": 4} | dict.fromkeys(threes, 3)
    for name in gallery_names():
        model = build_model(name)
        assert len(model.legs) == with_legs.get(name, 0), name
        # A leg is a link of its limb at home, from a joint of the base to one of the platform.
        symbols = Substitution.identity(model).all
        typical = np.array([value for item in model.parameters for value in item.typical])
        home = [typical, np.zeros(len(model.unknowns)), np.eye(3), np.array(model.home)]
        links = {each.name: each for each in model.links}
        for own in model.legs:
            link = links[" to ".join(own.centres)]
            ends = [own.base, model.pose.position + own.platform, link.start, link.start + link.span]
            found = [np.array(each).ravel() for each in ca.Function("ends", symbols, ends)(*home)]
            assert np.array(found[:2]) == pytest.approx(np.array(found[2:]), abs=1e-9), (name, own.name)
    assert "4" not in {leg.name for leg in build_model("tricept").legs}


def with_joints(joints: list[Tables]) -> Model:
    """A 6-UPS with the joints of its last limb replaced."""
    definition = octahedral()
    definition["limb"][5]["joints"] = joints
    return robot(**definition)


UP, SPIN = leg("B", "A", "A - B"), {"type": "R", "at": "A", "axis": "A - B"}
CARDAN = {"type": "U", "at": "A", "axes": [[1, 0, 0], [0, 1, 0]]}
HINGES = [{"type": "R", "at": "B", "axis": axis} for axis in ([1, 0, 0], [0, 1, 0])]
#: Joints of a limb that is a leg, whatever they are called and wherever a hinge is written on its axis.
LEGS = {
    "as written": UP,
    "two hinges through one point": [*HINGES, *UP[1:]],
    "a hinge written elsewhere on its axis": [HINGES[0] | {"at": "B + 7*x"}, *UP[1:]],
    "a slide that is written off the line": [UP[0], UP[1] | {"at": [0, 0, 3]}, UP[2]],
    "against the line": [UP[0], UP[1] | {"axis": "B - A"}, UP[2]],
    "a leg that spins": [*UP[:2], SPIN, CARDAN],
    "the slide beside the platform": [UP[0], UP[1] | {"at": "A"}, UP[2]],
}
#: Joints of a limb that is none.
OTHERS = {
    "a slide that leans": [UP[0], UP[1] | {"axis": "A - B + x"}, UP[2]],
    "a passive slide": [*UP[:2], {"type": "P", "at": "A", "axis": [0, 0, 1]}, CARDAN],
    "a slide on the base": [UP[1], UP[0], UP[2]],
    "a hinge off the line": [HINGES[0] | {"at": "B + 3*y"}, *UP[1:]],
    "a driven hinge and a rod": [HINGES[0] | {"actuated": True}, CARDAN | {"at": [20, -20, 5]}, UP[2]],
}


@pytest.mark.parametrize("kind", LEGS)
def test_a_driven_slide_between_two_centres_is_a_leg(kind: str) -> None:
    model, by_rows = with_joints(LEGS[kind]), stewart_gough(layout="octahedral")
    assert len(model.legs) == 6
    values = [26.5, 11.543, math.radians(5), math.radians(9)]
    for own, other in zip(model.legs, by_rows.legs, strict=True):
        for end in ("base", "platform"):
            found, expected = (
                ca.evalf(
                    ca.substitute(getattr(each, end), ca.vertcat(*[p.symbol for p in m.parameters]), ca.DM(numbers))
                )
                for each, m, numbers in ((own, model, [*values, 20]), (other, by_rows, values))
            )
            assert found.full() == pytest.approx(expected.full(), abs=1e-9)


@pytest.mark.parametrize("kind", OTHERS)
def test_another_limb_is_no_leg(kind: str) -> None:
    assert [leg.name for leg in with_joints(OTHERS[kind]).legs] == ["1-", "1+", "2-", "2+", "3-"]


def poses_of(rng: np.random.Generator, count: int) -> list[tuple[Array, Array]]:
    """Poses of the workspace: position and rotation."""
    x, z, angle = rng.uniform(-1, 1, count), rng.uniform(19, 21, count), np.radians(rng.uniform(-4, 4, count))
    return [(np.array([x[k], 0, z[k]]), turn_about([0, 1, 1], angle[k])) for k in range(count)]


def legs_of(errors: Array, pose: tuple[Array, Array]) -> tuple[Array, Array]:
    """Ends (6, 3) of the legs of a machine with errors (12, 3) of its joint centres, in the world."""
    base, platform = circle_joints(RADIANS)
    p, R = pose
    return base + errors[::2], p + (platform + errors[1::2]) @ R.T


def ends_of(judged: Judgement) -> dict[tuple[str, str], float]:
    """Proven bounds by name and sense."""
    return {(each.name, each.sense.value): each.bound for each in judged.extremes}


@pytest.fixture(scope="module", params=[None, 0.02], ids=["exact", "as built"])
def workspaces(request: pytest.FixtureRequest) -> tuple[float, list[tuple[Case, Judgement, ProofRecord]]]:
    """Both descriptions judged over a workspace, every machine within a tolerance too, with records for a proof."""
    more = {"tolerance": {"joint_centre": request.param}} if request.param else {}
    found = []
    for case in both(FIXED, HELD, workspace=WORKSPACE, **more):
        record = ProofRecord()
        found.append((case, judge_workspace(case, with_objective=False, record=record), record))
    return request.param or 0.0, found


Workspaces = tuple[float, list[tuple[Case, Judgement, ProofRecord]]]


def test_bounds_over_a_workspace_contain_every_machine_and_agree(workspaces: Workspaces) -> None:
    tolerance, ((_, by_rows, _), (_, judged, _)) = workspaces
    bounds, others = ends_of(judged), ends_of(by_rows)
    assert bounds.keys() == others.keys()
    assert judged.is_proved
    for key, bound in bounds.items():
        assert bound == pytest.approx(others[key], rel=2e-3), key
    rng, names = np.random.default_rng(0), ["1-", "1+", "2-", "2+", "3-", "3+"]
    worst = dict.fromkeys(bounds, math.inf)

    def reached(name: str, sense: str, value: float) -> None:
        room = bounds[name, sense] - value if sense == "max" else value - bounds[name, sense]
        assert room >= -1e-9, (name, sense)
        worst[name, sense] = min(worst[name, sense], room)

    for _ in range(20):
        errors = rng.normal(size=(12, 3))
        errors *= tolerance / np.linalg.norm(errors, axis=1, keepdims=True)
        every = [legs_of(errors, pose) for pose in poses_of(rng, 60)]
        lengths = np.array([np.linalg.norm(ends - base, axis=1) for base, ends in every])
        for k, name in enumerate(names):
            short, long = lengths[:, k].min(), lengths[:, k].max()
            reached(f"leg_length limb {name}", "min", short)
            reached(f"leg_length limb {name}", "max", long)
            reached(f"actuator.stroke_max limb {name}", "max", long - short)
            reached(f"actuator.dead_length limb {name}", "min", 2 * short - long)
        for i, j in itertools.combinations(range(6), 2):
            base, ends = every[0]
            apart = segment_distance(base[i], ends[i], base[j], ends[j])
            reached(f"leg_clearance limbs {names[i]} and {names[j]}", "min", apart)
    # Lengths have bounds that are nearly reached: less than the tolerance and a part of the range away.
    assert all(room < 0.5 + 3 * tolerance for (name, _), room in worst.items() if name.startswith("leg_length"))


def proof_of(judged: Judgement, record: ProofRecord) -> Proof:
    """The proof as its file has it."""
    return read_proof(proof_written(judged, record, "").as_text(), "again")


def test_the_proof_on_paper_is_accepted_and_an_altered_one_is_not(workspaces: Workspaces) -> None:
    _, (_, (case, judged, record)) = workspaces
    proof = proof_of(judged, record)
    checked = {(each.name, each.sense): each for each in check_workspace_proof(proof, case).claims}
    named = {each.name for each in proof.claims}
    assert {"leg_length limb 1-", "actuator.stroke_max limb 3+", "leg_clearance limbs 1- and 1+"} <= named
    for each in judged.extremes:
        if each.limit is not None:
            found = checked[each.name, each.sense.value]
            assert found.bound is not None
            assert found.limit == pytest.approx(each.limit)
            # The check has bounds of its own, which keep the limit too.
            kept = found.bound <= each.limit if each.sense.value == "max" else found.bound >= each.limit * (1 - 1e-9)
            assert kept
    for name, factor in (("leg_length limb 1-", 1.1), ("leg_clearance limbs 1- and 1+", 2.0)):
        claims = tuple(
            replace(each, bound=(each.bound or 0.0) * factor) if (each.name, each.sense) == (name, "min") else each
            for each in proof.claims
        )
        with pytest.raises(ProofError):
            check_workspace_proof(replace(proof, claims=claims), case)
    # Another robot, whose base is smaller.
    other = case_from(tables(octahedral(), FIXED | {"x1": 24.0}, HELD, workspace=WORKSPACE))
    with pytest.raises(ProofError):
        check_workspace_proof(proof, other)


TRIPOD = {
    "robot": {"model": "3-rps", "parameters": {"rb": 1, "rp": 0.6, "h": 1.1}},
    "pose": {"position": [0, 0, 1.1]},
    "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
    "limits": {
        "leg_length": {"min": 0.9, "max": 1.5}, "actuator": {"stroke_max": 0.4}, "leg_clearance": {"min": 0.5},
    },
    "workspace": {
        "position": [{"min": -0.025, "max": 0.025}, {"min": -0.025, "max": 0.025}, {"min": 1.075, "max": 1.125}],
        "rotation": {"angle": {"min": -2, "max": 2}},
    },
}  # fmt: skip


def tripod_pose(z: float, turn: Array, errors: Array) -> tuple[Array, Array]:
    """Ends (3, 3) of the legs of a 3-RPS with errors (6, 3): each leg lies in the plane across its hinge.

    The numbers of the pose that the robot has no choice of are found by Newton's method.
    """
    angles = np.radians([0, 120, 240])
    around = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    hinges = np.stack([-np.sin(angles), np.cos(angles), 0 * angles], axis=1)
    base, platform = around + errors[::2], 0.6 * around + errors[1::2]

    def ends(u: Array) -> Array:
        vector = np.array([*turn, u[2]])
        size = float(np.linalg.norm(vector))
        R = turn_about(vector, size) if size else np.eye(3)
        return np.asarray(np.array([u[0], u[1], z]) + platform @ R.T)

    u = np.zeros(3)
    for _ in range(20):
        off = ((ends(u) - base) * hinges).sum(axis=1)
        steps = [ends(u + step) - ends(u - step) for step in 1e-6 * np.eye(3)]
        slopes = np.array([(step * hinges).sum(axis=1) / 2e-6 for step in steps])
        u = u - np.linalg.solve(slopes.T, off)
    assert np.abs(((ends(u) - base) * hinges).sum(axis=1)).max() < 1e-12
    assert np.abs(u[:2]).max() < 0.025
    return base, ends(u)


@pytest.mark.parametrize("tolerance", soaked([0.0, 0.001], [0.001]))
def test_a_robot_with_fewer_freedoms_and_loops(tolerance: float) -> None:
    more = {"tolerance": {"joint_centre": tolerance}} if tolerance else {}
    case, record = case_from({**TRIPOD, **more}), ProofRecord()
    judged = judge_workspace(case, with_objective=False, record=record, gap=0.01)
    # Lengths on paper are of every assembly, in which strokes are longer: these are not on paper.
    checked = check_workspace_proof(proof_of(judged, record), case).claims
    assert "actuator.stroke_max limb 1" not in {each.name for each in checked}
    bounds, outcomes = ends_of(judged), {each.name: each.outcome for each in judged.extremes}
    rng, every = np.random.default_rng(1), []
    errors = rng.normal(size=(6, 3))
    errors *= tolerance / np.linalg.norm(errors, axis=1, keepdims=True)
    for _ in range(200):
        turn = rng.normal(size=2)
        turn *= np.radians(1.9) * rng.uniform() / np.linalg.norm(turn)
        every.append(tripod_pose(rng.uniform(1.075, 1.125), turn, errors))
    lengths = np.array([np.linalg.norm(ends - base, axis=1) for base, ends in every])
    for k in range(3):
        short, long = lengths[:, k].min(), lengths[:, k].max()
        assert bounds[f"leg_length limb {k + 1}", "min"] <= short < long <= bounds[f"leg_length limb {k + 1}", "max"]
        assert long - short <= bounds[f"actuator.stroke_max limb {k + 1}", "max"]
        assert outcomes[f"actuator.stroke_max limb {k + 1}"] is Outcome.PROVED
    base, ends = every[0]
    for i, j in itertools.combinations(range(3), 2):
        name = f"leg_clearance limbs {i + 1} and {j + 1}"
        if tolerance:
            # Poses of other machines are not those of the design: the claim stays open, with the reason.
            (extreme,) = (each for each in judged.extremes if each.name == name)
            assert extreme.outcome is Outcome.OPEN
            assert extreme.reason == "dependent pose coordinates differ between robots within the tolerance"
        else:
            assert outcomes[name] is Outcome.PROVED
            assert bounds[name, "min"] <= segment_distance(base[i], ends[i], base[j], ends[j])


CASE = """
pose.position = [0, 0, { min = 18, max = 22 }]
task = [{ sense = "max", axis = [1, 2, 6], point = [3, 1, 12], pitch = 0.1 }]
[robot]
model = "6-ups"
parameters = { rb = { min = 20, max = 30 }, rp = { min = 8, max = 13 }, base_half = 50, platform_half = 8, h = 20 }
[limits]
leg_length = { min = 24, max = 27 }
actuator = { dead_length = 10 }
leg_clearance = { min = 2 }
footprint = { base = 28, platform = 12 }
joint_spacing = { min = 2 }
[solve]
starts = 4
"""
#: Limits of legs, one of each kind.
OF_LEGS = {"leg_length": "{ max = 30 }", "actuator": "{ stroke_max = 3 }", "leg_clearance": "{ min = 1 }"}
OF_LEGS |= {"footprint": "{ base = 9 }", "joint_spacing": "{ min = 1 }", "radius_ratio": "{ max = 1 }"}


def test_the_command_line_shows_the_lengths_that_are_limited(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "legs.toml", CASE)
    out = output_of(cli("solve", str(path), "--all"))
    assert "leg length" in out
    assert "leg_length.max" in out
    result = json.loads(output_of(cli("solve", str(path), "--json", "-")))
    lengths = result["limited_quantities"]["leg_length"]
    numbers = {each["name"]: each["value"] for each in result["margins"] if each["name"].startswith("leg_length")}
    assert {f"leg_length limb {name}": value for name, value in lengths.items()} == pytest.approx(numbers)
    assert max(lengths.values()) <= 27 * (1 + 1e-9)
    # Lengths from home and between centres differ by the length at home.
    ways = result["quantities"]["actuator_length"]
    assert len({round(lengths[name] - ways[name], 6) for name in lengths}) == 1
    saved(path, CASE.replace("leg_length = { min = 24, max = 27 }\n", ""))
    without = json.loads(output_of(cli("solve", str(path), "--json", "-")))
    assert "limited_quantities" not in without
    assert set(without["quantities"]) == {"actuator_length"}
    assert without["F"] > result["F"]


def test_the_workspace_command_proves_limits_of_legs_on_paper(cli: Run, tmp_path: Path) -> None:
    text = CASE.replace("rb = { min = 20, max = 30 }, rp = { min = 8, max = 13 }", "rb = 28, rp = 12")
    text = text.replace("{ min = 18, max = 22 }]", "20]").replace("max = 27", "max = 34")
    box = "[workspace]\nposition = [0, { min = -0.5, max = 0.5 }, { min = 19, max = 20 }]\n"
    path, proof = saved(tmp_path / "legs.toml", text + box), tmp_path / "legs.proof"
    out = output_of(cli("workspace", str(path), "--proof", str(proof), "--quantity", "leg_length", "--all"))
    assert "actuator.dead_length" in out
    assert output_of(cli("verify-proof", str(proof), str(path)))
    saved(path, (text + box).replace("leg_clearance = { min = 2 }", "leg_clearance = { min = 2.5 }"))
    assert cli("verify-proof", str(proof), str(path))[0] != 0


def test_robots_without_legs_refuse_their_limits_by_name(cli: Run, tmp_path: Path) -> None:
    for robot_name, (key, limit) in itertools.product(("delta", "6-rss"), OF_LEGS.items()):
        text = output_of(cli("new", robot_name)).replace("\n[limits]", f"\n[limits]\n{key} = {limit}\n#")
        path = saved(tmp_path / "case.toml", text)
        refusal_of(cli("solve", str(path)), f"no such limit for the robot '{robot_name}'; allowed: actuator_angle")
    # Cones of the joints of a file's legs are stated by joint.
    path = saved(tmp_path / "case.toml", CASE.replace("[solve]", "base_joint_angle = 30\n[solve]"))
    refusal_of(
        cli("solve", str(path)), "limits.base_joint_angle: no such limit for the robot '6-ups'; allowed: leg_length"
    )


@pytest.mark.parametrize("name", ["6-ups", "3-rps", "planar-3-rpr", "tricept"])
def test_a_starter_states_limits_that_its_robot_keeps_at_home(name: str) -> None:
    text = starter_case(build_model(name))
    assert "base_joint_angle" not in text
    # Pairs of legs of the 6-UPS have one joint in common, and so no clearance.
    assert "leg_length = " in text
    assert ("leg_clearance" in text) == (name != "6-ups")
    nlp = formulate(case_from(text))
    own = margins_of(nlp, nlp.start, optimal=False)
    assert {"leg_length", "condition_number"} <= {each.key.partition(".")[0] for each in own}
    assert not any(each.violated for each in own)


def test_slides_of_exported_legs_have_ranges_from_their_lengths() -> None:
    limits = {"leg_length": {"min": 24, "max": 30}}
    ranges = []
    for definition in (None, octahedral(), octahedral("B - A")):
        turned = {"position": [0.5, 0, 20], "rotation": {"axis": [0, 1, 1], "angle": 5}}
        nlp = formulate(case_from(tables(definition, FIXED, limits, pose=turned)))
        slides = [joint for joint in mechanism_of(nlp, np.zeros(0)).mechanism.joints if joint.kind == "P"]
        ranges.append([joint.range for joint in slides])
    (by_rows, outward, inward) = ([each for each in own if each is not None] for own in ranges)
    assert len(by_rows) == len(outward) == len(inward) == 6
    assert np.array(outward) == pytest.approx(np.array(by_rows))
    # A slide whose axis is against the leg makes it shorter.
    assert -np.array(inward)[:, ::-1] == pytest.approx(np.array(by_rows))
    base, platform = circle_joints(RADIANS)
    lengths = np.linalg.norm([0.5, 0, 20] + platform @ turn_about([0, 1, 1], math.radians(5)).T - base, axis=1)
    assert np.array(by_rows) == pytest.approx(np.stack([24 - lengths, 30 - lengths], axis=1))


@pytest.mark.parametrize("name", ["mjcf", "urdf"])
def test_an_imported_hexapod_has_limits_of_legs(name: str, cli: Run, tmp_path: Path) -> None:
    text = CASE.replace("{ min = 20, max = 30 }", "26.5").replace("{ min = 8, max = 13 }", "11.5")
    text = text.replace("{ min = 18, max = 22 }]", "20]").partition("[limits]")[0]
    path = saved(tmp_path / "given.toml", text)
    output_of(cli("export", str(path), "--format", name, "--out", str(tmp_path / "out")))
    file = tmp_path / "out" / ("robot.xml" if name == "mjcf" else "robot.urdf")
    # As other programs write it, with six digits.
    plain = re.sub(r"-?\d+\.\d{6,}(e-?\d+)?", lambda found: f"{float(found[0]):.6g}", file.read_text())
    file.write_text(plain)
    words = ("--platform", "platform", "--close", "--snap", "0.001", "--out", str(tmp_path / "own.toml"))
    code, _, err = cli("import", str(file), *words)
    assert (code, err) == (0, "")
    limits = "[limits]\nleg_length = { max = 40 }\nleg_clearance = { min = 0.1 }\nactuator = { dead_length = 1 }\n"
    task = "[[task]]\nsense = 'max'\naxis = [0, 0, 1]\npitch = inf\n[pose]\nposition = [0, 0, 20]\n"
    case = saved(tmp_path / "case.toml", f"[robot]\nfile = 'own.toml'\n{task}{limits}")
    found = json.loads(output_of(cli("solve", str(case), "--json", "-")))["limited_quantities"]["leg_length"]
    given = json.loads(output_of(cli("solve", str(saved(path, text + limits)), "--json", "-")))
    expected = given["limited_quantities"]["leg_length"]
    assert sorted(found.values()) == pytest.approx(sorted(expected.values()), rel=1e-5)


@pytest.mark.slow
@needs_compiler
def test_generated_c_has_the_limits_and_the_legs(tmp_path: Path) -> None:
    folder = written(case_from(CASE), tmp_path / "c")
    manifest = json.loads((folder / "manifest.json").read_text())
    keys = {each["key"] for each in manifest["limits"]}
    stated = ("leg_length.max", "actuator.dead_length", "leg_clearance.min", "footprint.base", "joint_spacing.min")
    assert keys >= set(stated)
    assert any("_LEGS 6 " in header.read_text() for header in folder.glob("*.h"))
    assert " 0 failed" in made(folder, "test")
