"""Proofs on paper of robots that are not six straight legs, and of motors: what the check accepts, and what not."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from builders import case_from, shipped_tables, soaked
from measures import scaled
from workspace_cases import (
    CUT,
    LOADING,
    box_of,
    claim,
    gallery_case,
    on_paper,
    only,
    problem_of,
    rank_of,
    rejected,
    robot_of,
    root_of,
    stating,
)

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Judgement, Loading, Motion, Outcome, Verdict
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, read_proof, workspace_premise
from screwsynth.nlp.proof.checker.tree import Node, node_bytes
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.closed_loops import Assembly
from screwsynth.nlp.proof.checker.workspace.pose_boxes import _PoseRule
from screwsynth.nlp.proof.checker.workspace.statement import robot_claims
from screwsynth.nlp.proof.statement.claims import REGULAR
from screwsynth.nlp.proof.statement.fixed_robot import workspace_of_case
from screwsynth.nlp.proof.workspace.numbers.searched import Subject, motor_extremes
from screwsynth.nlp.proof.workspace.numbers.within_tolerance import RobotsWithinTolerance
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of as written
from screwsynth.nlp.proof.workspace.ranks.singular_pose import SingularPose
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem
from screwsynth.nlp.proof.workspace.verdict import not_judged

Proved = tuple[Case, Proof]


def reachy_case(factor: float, *, one_motor: bool = True, **parameters: float) -> Case:
    """Reachy Mini's head over a part of its documented rotations, with the limits of its first motor, or of all."""
    tables = shipped_tables("reachy-mini-envelope")
    tables["robot"]["file"] = str(find_case("reachy-mini-envelope").parent / tables["robot"]["file"])
    tables["robot"]["parameters"] |= parameters
    turns = tables["workspace"]["rotation"]
    tables["workspace"]["rotation"] = scaled(turns, factor)
    if one_motor:
        for k in range(2, 7):
            del tables["limits"]["joint"][f"stewart_{k}"]
    return case_from(tables, "head")


@pytest.fixture(scope="module")
def reachy() -> Proved:
    case = reachy_case(0.45)
    return case, on_paper(case, gap=0.1, with_objective=False)[1]


def test_reachy_mini_is_on_paper(reachy: Proved) -> None:
    case, proof = reachy
    assert {(each.name, each.reason) for each in proof.unproved} == {("F", "no search for this claim was made")}
    checked = check_workspace_proof(proof, case)
    names = [each.name for each in checked.claims]
    assert names[0] == "regular"
    assert [name for name in names if name.startswith("reach limb")] == [f"reach limb stewart_{k}" for k in range(1, 7)]
    assert sum(name.startswith("joint.stewart") for name in names) == 2
    assert all(each.limit is not None and each.bound is not None for each in checked.claims[1:])


def test_reachy_mini_tampered_with_is_rejected(reachy: Proved) -> None:
    case, proof = reachy
    tree = claim(proof, "regular").unpacked()
    assert "ends" in rejected(only(proof, "regular", tree=tree[:-1]), case)
    assert "not outside" in rejected(only(proof, "regular", tree=bytes([Node.OUTSIDE])), case)
    moved = node_bytes(Node.CUT, tree[1], value=2.0) + tree[10:]
    assert "outside this box" in rejected(only(proof, "regular", tree=moved), case)
    assert "must state two poses" in rejected(only(proof, "regular", reason="singular"), case)
    bound = claim(proof, "reach limb stewart_1").bound
    # Programs maximise: a reach of at least b is a bound of -b.
    assert "reach limb stewart_1" in rejected(only(proof, "reach limb stewart_1", bound=bound - 0.2), case)
    # A limit on a motor alone has the loops as conditions: the closed forms need the reach of all limbs.
    assert "its expressions or bounds differ" in rejected(only(proof, "joint.stewart_1 joint stewart_1:1"), case)
    assert "its expressions or bounds differ" in rejected(
        only(proof, "reach limb stewart_1"), reachy_case(0.45, rc=0.060)
    )


@pytest.mark.slow
def test_reachy_mini_is_on_paper_for_most_of_its_documented_rotations() -> None:
    case = reachy_case(0.6, one_motor=False)
    proof = on_paper(case, gap=0.1)[1]
    assert not proof.unproved
    assert len(check_workspace_proof(proof, case).claims) == 21


def boxes_about(y: FloatArray, half: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Boxes of many sizes with a point of theirs at y."""
    width = half * 10.0 ** rng.uniform(-6, -0.3, (100, 1)) * rng.uniform(0.2, 1, (100, 6))
    share = rng.uniform(0.05, 0.95, (100, 6))
    return y - share * width, y + (1 - share) * width


@pytest.mark.parametrize(
    ("name", "part", "degrees", "seed"),
    [("6-rus", 0.1, 40, 2), ("3-rps", 0.3, 60, 1), pytest.param("6-ups", 0.4, 70, 1, marks=pytest.mark.soak),
     pytest.param("planar-3-rrr", 0.3, 60, 2, marks=pytest.mark.soak)],
)  # fmt: skip
def test_no_box_with_a_singular_pose_is_shown_to_be_regular(name: str, part: float, degrees: float, seed: int) -> None:
    """The pose is one that Newton's method finds to 1e-10, in a robot with random dimensions."""
    case = gallery_case(name, part, degrees, seed)
    root, problem, shown = root_of(case), problem_of(case), rank_of(case)
    newton, rng = SingularPose(problem, problem.locked), np.random.default_rng(seed)
    half = 0.5 * (root.upper - root.lower)
    if not problem.dependent:
        tried = box_of(case).random(200, rng)
        home, near = 0.5 * (root.lower + root.upper), 0.1
    else:
        home, near, own = problem.pose_of(problem.start), 0.05, list(problem.independent)
        tried = np.broadcast_to(problem.start, (60, len(problem.start))).copy()
        tried[:, own] += 0.3 * half[own] * rng.uniform(-1, 1, (60, 3))
    z = next(each for each in map(newton.search, tried) if each is not None)
    assert shown.attempt(*boxes_about(home, near * half, rng)).holds.mean() > 0.5
    if problem.dependent:
        # The assembly that is singular there, and no other.
        shown.assembly.start = z
    assert not shown.attempt(*boxes_about(problem.pose_of(z) if problem.dependent else z, half, rng)).holds.any()


@pytest.mark.parametrize("name", ["3-rps", "tricept"])
def test_closed_loops_are_where_they_are_shown_to_be(name: str) -> None:
    case = gallery_case(name, 0.1, 20, 4)
    root = root_of(case)
    assembly = rank_of(case).assembly
    own, D = assembly.independent, assembly.dependent
    rng = np.random.default_rng(5)
    half = 0.5 * (root.upper - root.lower)
    boxes = boxes_about(0.5 * (root.lower + root.upper), half, rng)
    lower, upper = (each[:, own] for each in boxes)
    found = assembly.enclosed(lower, upper)
    known = found.is_known
    assert known.mean() > 0.3
    at = lower + rng.choice([0.01, 0.99], lower.shape) * (upper - lower)
    z = assembly.moved(found.near, at)[known][:, D]
    low, high = found.lower[known][:, D], found.upper[known][:, D]
    assert ((low < z) & (z < high)).all()
    moved = (z - 0.5 * (low + high)) / (0.5 * (high - low)) - found.off[known]
    moved += (found.T[known] @ ((at - 0.5 * (lower + upper)) / (0.5 * (upper - lower)))[known][:, :, None])[:, :, 0]
    room = 1e-9 / (high - low)
    assert (np.abs(moved) <= found.rho[known] + room).all()
    # Without the rest the relation would be wrong: the test can fail.
    assert (np.abs(moved) > 0.1 * found.rho[known] + room).any()


def test_robots_with_loops_are_on_paper() -> None:
    case = gallery_case("tricept", 0.02, 5)
    proof = on_paper(case, with_limits=False)[1]
    checked = check_workspace_proof(proof, case)
    assert [each.name for each in checked.claims] == ["regular", "constraints regular"]
    tree = claim(proof, "regular").unpacked()
    assert "ends" in rejected(only(proof, "regular", tree=tree[:-1]), case)
    assert "not outside" in rejected(only(proof, "constraints regular", tree=bytes([Node.OUTSIDE])), case)


def test_boxes_with_another_assembly_do_not_belong_together() -> None:
    case = gallery_case("3-rps", 0.03, 6)
    root = root_of(case)
    shown = rank_of(case)
    tree = node_bytes(Node.CUT, 2, value=0.5 * (root.lower[2] + root.upper[2])) + bytes([Node.BOUNDED] * 2)
    root.show_on_leaves(shown, tree)
    shown.finish()
    (whole,) = shown._shown
    shown.assembly.refuse_apart(whole)
    lower, upper = whole.lower.copy(), whole.upper.copy()
    D = shown.assembly.dependent
    lower[0, D], upper[0, D] = lower[0, D] + 0.5, upper[0, D] + 0.5
    with pytest.raises(ProofError, match="assembly mode of the workspace centre"):
        shown.assembly.refuse_apart(whole._replace(lower=lower, upper=upper))


def test_the_tree_of_another_workspace_does_not_hide_a_singular_pose(
    reachy: Proved, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, proof = reachy
    case = reachy_case(1.0)
    monkeypatch.setattr(_PoseRule, "most_pieces", 100)
    other = stating(only(proof, "regular"), workspace=workspace_premise(case.workspace))
    # All claims about limits are named, and none is proved.
    assert "could not be proved" in rejected(other, case)


def test_forms_hold_the_entries_and_could_be_no_smaller() -> None:
    case = gallery_case("6-rus", 0.1, 20)
    root = root_of(case)
    entries = rank_of(case)._entries
    rng = np.random.default_rng(3)
    lower, upper = boxes_about(0.5 * (root.lower + root.upper), 0.5 * (root.upper - root.lower), rng)
    c, a, r = entries(lower, upper).forms()
    e = rng.choice([-1.0, 1.0], lower.shape) * (1 - 1e-9)
    values = entries.function(ca.DM((0.5 * (lower + upper) + 0.5 * (upper - lower) * e).T)).full().T
    missed = np.abs(values - c - np.einsum("brn,bn->br", a, e))
    known = np.isfinite(r).all(axis=1)
    assert known.mean() > 0.8
    assert (missed <= r + 1e-12 * (1 + np.abs(values)))[known].all()
    assert (missed > 0.05 * r + 1e-12)[known].any()


def test_a_singular_pose_of_a_robot_without_loops_is_on_paper() -> None:
    case = gallery_case("6-ups", 0.4, 70, 1)
    proof = on_paper(case, with_limits=False)[1]
    (found,) = check_workspace_proof(proof, case).claims
    assert found.is_refuted
    first, second = claim(proof, "regular").sides
    assert "opposite signs" in rejected(only(proof, "regular", sides=(first, first)), case)
    assert "outside the workspace" in rejected(only(proof, "regular", sides=(first, (99.0, *second[1:]))), case)
    small = gallery_case("6-ups", 0.02, 5, 1)
    other = stating(proof, workspace=workspace_premise(small.workspace))
    assert "outside the workspace" in rejected(other, small)


@pytest.mark.parametrize(
    ("name", "reached", "words"),
    [
        ("6-sps", True, ""),
        ("6-rus", True, "the home assembly mode"),
        ("6-rus", False, "every assembly mode"),
        ("planar-3-prr", True, "every assembly mode in which limbs with a closed form have the home working mode"),
        ("3-rps", True, "every assembly mode"),
    ],
)
def test_claims_name_the_assemblies_of_their_numbers(name: str, reached: bool, words: str) -> None:
    case = gallery_case(name, 0.02, 3)
    limbs = {f"reach limb {k}" for k in range(1, 7)} if reached else set()
    found = robot_claims(case, case.workspace, limbs)
    assert found.numbers_at == words
    # Unknowns that are still variables may have any value; those in closed form have home's.
    unknowns = [k for at_pose in found.layout.places.unknowns for k in at_pose]
    assert len(unknowns) == {"6-sps": 0, "6-rus": 0 if reached else 6, "planar-3-prr": 5, "3-rps": 6}[name]


@cache
def proof_of(name: str) -> tuple[dict[tuple[str, str], Verdict], Proof]:
    """The numbers of a robot's actuators alone, and their proof as its file has it."""
    return motors_on_paper(robot_of(name))


def motors_on_paper(case: Case) -> tuple[dict[tuple[str, str], Verdict], Proof]:
    record, closed = ProofRecord(), closed_form(case.model)
    box = box_of(case)
    meant = build_problem(case, closed.model, box)
    if case.joint_centre_tolerance:
        meant = RobotsWithinTolerance(case, closed, meant).family
    found = tuple(motor_extremes(Subject(case, closed.model, meant), record=record))
    judged = Judgement(case, workspace_of_case(case), (not_judged(REGULAR, "not requested"), *found))
    proof = read_proof(written(judged, record, "").as_text(), "again")
    return {(each.name, each.sense.value): each for each in found}, proof


@pytest.mark.parametrize("name", soaked(["legs", "legs with a tolerance", "delta", "3-rps"], ["legs", "3-rps"]))
def test_a_proof_is_accepted_and_one_with_a_bound_that_a_pose_exceeds_is_not(name: str) -> None:
    """Six freedoms and three; rows of legs and passive joints; closed forms and loops that are followed."""
    case = robot_of(name)
    motors, proof = proof_of(name)
    assert len(motors) == 5 * (3 if name in ("delta", "3-rps") else 6)
    assert all(each.outcome is Outcome.PROVED for each in motors.values())
    checked = {(each.name, each.sense): each.bound for each in check_workspace_proof(proof, case).claims}
    assert checked.keys() == motors.keys()
    for key, each in motors.items():
        bound = checked[key]
        # The check's bound is wider by a part of the gap.
        assert 0 <= each.sense.sign * (bound - each.bound) <= 0.26 * abs(each.bound - each.reached) + 1e-5 * abs(bound)
    of_one = [(key, each) for key, each in motors.items() if each.motor is not None and each.motor.place == 1]
    for key, each in of_one if name == "legs" else of_one[::2]:
        if each.reached:
            # A little less than the value at a pose of the workspace; a power of 0 is that of a force of one sign.
            with_less = only(proof, *key, bound=each.reached - each.sense.sign * 1e-4 * abs(each.reached))
            with pytest.raises(ProofError, match="could not be proved"):
                check_workspace_proof(with_less, case)


def test_a_proof_for_other_loads_or_motions_is_rejected() -> None:
    """What a number rests on is the case's: the file has nothing of it."""
    case, proof = robot_of("legs"), proof_of("legs")[1]
    for part in ({"force": (3.0, 1.0, -11.0)}, {"point": (0.0, -0.2, 0.1)}, {"any_force": 3.0}, {"any_moment": 0.4}):
        with pytest.raises(ProofError, match=r"actuator_force .* could not be proved"):
            check_workspace_proof(proof, replace(case, loading=LOADING._replace(loads=(replace(CUT, **part),))))
    for motion in (Motion(1.1, 0.5), Motion(1.0, 0.7)):
        with pytest.raises(ProofError, match=r"actuator_speed .* could not be proved"):
            check_workspace_proof(proof, replace(case, loading=LOADING._replace(motion=motion)))


def test_numbers_under_a_load_are_not_those_under_another() -> None:
    """Their trees are the same, and so would be their bounds."""
    small = {"force": (0.3, 0.1, -1.0), "any_force": 0.2, "any_moment": 0.01}
    case = replace(robot_of("legs"), loading=Loading((replace(CUT, name="light", **small), CUT)))
    proof = motors_on_paper(case)[1]
    light = [each for each in proof.claims if each.name.startswith("actuator_force") and each.name.endswith("light")]
    assert len(light) == 12
    heavy = tuple(replace(each, name=each.name.replace("light", "cut")) for each in light)
    assert {each.name for each in heavy} < {each.name for each in proof.claims}
    check_workspace_proof(proof, case)
    others = tuple(each for each in proof.claims if (each.name, each.sense) not in {(h.name, h.sense) for h in heavy})
    with pytest.raises(ProofError, match=r"actuator_force .* cut.* could not be proved"):
        check_workspace_proof(replace(proof, claims=(*others, *heavy)), case)


def test_boxes_of_numbers_are_of_one_assembly(monkeypatch: pytest.MonkeyPatch) -> None:
    case, proof = robot_of("3-rps"), proof_of("3-rps")[1]

    def apart(*_: object) -> None:
        raise ProofError("the same assembly")

    monkeypatch.setattr(Assembly, "refuse_apart", apart)
    with pytest.raises(ProofError, match="the same assembly"):
        check_workspace_proof(proof, case)
