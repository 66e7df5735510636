"""Proofs of forces, speeds and powers of actuators: accepted as written, and rejected where a bound is too good."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import soaked, turn_about
from hexapods import case_of_legs
from test_workspace_claims import at_home

from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, Unproved, read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.closed_loops import Assembly
from screwsynth.nlp.proof.statement.machine import Legs, workspace_of_case
from screwsynth.nlp.proof.workspace.judge import Judgement
from screwsynth.nlp.proof.workspace.numbers.extremes import Extreme
from screwsynth.nlp.proof.workspace.numbers.machines import Machines
from screwsynth.nlp.proof.workspace.numbers.searched import Subject, motor_extremes
from screwsynth.nlp.proof.workspace.paper_record import PaperRecord
from screwsynth.nlp.proof.workspace.proof_writer import paper_of
from screwsynth.nlp.proof.workspace.ranks.ranks import not_judged
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem
from screwsynth.nlp.proof.workspace.verdict import Outcome

CUT = Load("cut", (3.0, 1.0, -10.0), point=(0.0, 0.1, 0.1), any_force=2.0, any_moment=0.1)
LOADING = Loading((CUT,), Motion(1.0, 0.5))


def robot_of(name: str) -> Case:
    """A robot over a small box: six straight legs, with or without a tolerance, or one of the gallery."""
    about, along = Turns(TurnKind.AXIS, (Free(-0.05, 0.05),), (0.0, 0.6, 0.8)), Free(0.98, 1.02)
    if not name.startswith("legs"):
        case = replace(at_home(name, part=0.006, degrees=1), loading=LOADING)
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


def proof_of(case: Case) -> tuple[dict[tuple[str, str], Extreme], Proof]:
    """The numbers of actuators alone, and their proof as its file has it."""
    record, closed = PaperRecord(), closed_form(case.model)
    workspace = workspace_of_case(case)
    box = pose_box(workspace)
    meant = build_problem(case, closed.model, box)
    if case.joint_centre_tolerance:
        meant = Machines(case, closed, meant).family
    found = tuple(motor_extremes(Subject(case, closed.model, meant), paper=record))
    judged = Judgement(case, workspace, not_judged(box, "not asked for"), found)
    proof = read_proof(paper_of(judged, record, "").as_text(), "again")
    return {(each.name, each.sense.value): each for each in found}, proof


@pytest.mark.parametrize("name", soaked(["legs", "legs with a tolerance", "delta", "3-rps"], ["legs", "3-rps"]))
def test_a_proof_is_accepted_and_one_with_a_bound_that_a_pose_exceeds_is_not(name: str) -> None:
    """Six freedoms and three; rows of legs and passive joints; closed forms and loops that are followed."""
    case = robot_of(name)
    motors, proof = proof_of(case)
    assert len(motors) == 5 * (3 if name in ("delta", "3-rps") else 6)
    assert all(each.outcome is Outcome.PROVED for each in motors.values())
    checked = {(each.name, each.sense): each.bound for each in check_workspace_proof(proof, case).claims}
    assert checked.keys() == motors.keys()
    for key, each in motors.items():
        bound = checked[key]
        assert bound is not None
        # The check's bound is wider by a part of the gap.
        assert 0 <= each.sense.sign * (bound - each.bound) <= 0.26 * abs(each.bound - each.reached) + 1e-5 * abs(bound)
    of_one = [(key, each) for key, each in motors.items() if each.motor is not None and each.motor.place == 1]
    for key, each in of_one if name == "legs" else of_one[::2]:
        if each.reached:
            # A little less than the value at a pose of the workspace; a power of 0 is that of a force of one sign.
            with_less = altered(proof, key, each.reached - each.sense.sign * 1e-4 * abs(each.reached))
            with pytest.raises(ProofError, match="could not be shown"):
                check_workspace_proof(with_less, case)


def altered(proof: Proof, key: tuple[str, str], bound: float) -> Proof:
    """The proof of one claim alone, with another bound."""
    (claim,) = (each for each in proof.claims if (each.name, each.sense) == key)
    others = [Unproved(each.name, each.sense, "") for each in proof.claims if each is not claim]
    return replace(proof, claims=(replace(claim, bound=bound),), unproved=(*proof.unproved, *others))


def test_a_proof_for_other_loads_or_motions_is_rejected() -> None:
    """What a number rests on is the case's: the file has nothing of it."""
    case = robot_of("legs")
    proof = proof_of(case)[1]
    for part in ({"force": (3.0, 1.0, -11.0)}, {"point": (0.0, -0.2, 0.1)}, {"any_force": 3.0}, {"any_moment": 0.4}):
        with pytest.raises(ProofError, match=r"actuator_force .* could not be shown"):
            check_workspace_proof(proof, replace(case, loading=LOADING._replace(loads=(replace(CUT, **part),))))
    for motion in (Motion(1.1, 0.5), Motion(1.0, 0.7)):
        with pytest.raises(ProofError, match=r"actuator_speed .* could not be shown"):
            check_workspace_proof(proof, replace(case, loading=LOADING._replace(motion=motion)))


def test_numbers_under_a_load_are_not_those_under_another() -> None:
    """Their trees are the same, and so would be their bounds."""
    small = {"force": (0.3, 0.1, -1.0), "any_force": 0.2, "any_moment": 0.01}
    case = replace(robot_of("legs"), loading=Loading((replace(CUT, name="light", **small), CUT)))
    proof = proof_of(case)[1]
    light = [each for each in proof.claims if each.name.startswith("actuator_force") and each.name.endswith("light")]
    assert len(light) == 12
    heavy = tuple(replace(each, name=each.name.replace("light", "cut")) for each in light)
    assert {each.name for each in heavy} < {each.name for each in proof.claims}
    check_workspace_proof(proof, case)
    others = tuple(each for each in proof.claims if (each.name, each.sense) not in {(h.name, h.sense) for h in heavy})
    with pytest.raises(ProofError, match=r"actuator_force .* cut.* could not be shown"):
        check_workspace_proof(replace(proof, claims=(*others, *heavy)), case)


def test_boxes_of_numbers_are_of_one_assembly(monkeypatch: pytest.MonkeyPatch) -> None:
    case = robot_of("3-rps")
    proof = proof_of(case)[1]

    def apart(*_: object) -> None:
        raise ProofError("the same assembly")

    monkeypatch.setattr(Assembly, "refuse_apart", apart)
    with pytest.raises(ProofError, match="the same assembly"):
        check_workspace_proof(proof, case)
