"""Proofs on paper of robots that are not six straight legs: what the check accepts, and what it must not."""

import math
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import case_from

from screwsynth.models import FloatArray
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free, Task, TurnKind, Turns, Workspace, build_model, judge_workspace
from screwsynth.nlp.proof.checker.proof_file import (
    Premises,
    Proof,
    ProofClaim,
    ProofError,
    Unproved,
    read_proof,
    workspace_numbers,
)
from screwsynth.nlp.proof.checker.tree import Node, node_bytes
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.pose_boxes import _PoseRule, pose_root, show_on_leaves
from screwsynth.nlp.proof.checker.workspace.ranks import rank_claim
from screwsynth.nlp.proof.checker.workspace.statement import robot_claims
from screwsynth.nlp.proof.statement.machine import workspace_of_case
from screwsynth.nlp.proof.workspace.paper_record import PaperRecord
from screwsynth.nlp.proof.workspace.proof_writer import paper_of
from screwsynth.nlp.proof.workspace.ranks.singular_pose import SingularPose
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem

CASES = Path(__file__).parents[2] / "cases"
OTHERS = [f"stewart_{k} =" for k in range(2, 7)]


def reachy_text(factor: float) -> str:
    """Reachy Mini's head over a part of its documented rotations."""
    text = (CASES / "reachy-mini-envelope.toml").read_text(encoding="utf-8").replace("robots/", f"{CASES}/robots/")
    for end in (40, 65):
        text = text.replace(f"min = -{end}, max = {end} }}", f"min = {-factor * end}, max = {factor * end} }}")
    return text


def gallery_case(name: str, part: float, degrees: float, seed: int | None = None) -> Case:
    """A robot of the gallery about its home, with its typical dimensions or random ones near them."""
    model = build_model(name)
    rng = np.random.default_rng(seed)
    factors = {item.name: 1.0 if seed is None else rng.uniform(0.95, 1.05) for item in model.parameters}
    values = {item.name: item.typical[0] * factors[item.name] for item in model.parameters}
    size = max(abs(each) for each in (*model.home, *values.values()))
    angle = math.radians(degrees)
    place = [Free(each - part * size, each + part * size) for each in model.home]
    workspace = Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3))
    return Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])], workspace=workspace)


def proof_of(case: Case, text: str = "", *, with_objective: bool = False) -> Proof:
    """The proof, without F, which takes longest."""
    record = PaperRecord()
    judged = judge_workspace(case, gap=0.1, with_objective=with_objective, paper=record)
    return read_proof(paper_of(judged, record, text).as_text(), "again")


def claim(proof: Proof, name: str) -> ProofClaim:
    return next(each for each in proof.claims if each.name == name)


def changed(proof: Proof, name: str, **values: object) -> Proof:
    """The proof of one claim alone, tampered with."""
    own = replace(claim(proof, name), **values)  # type: ignore[arg-type]
    others = tuple(
        Unproved(*key, "left out") for each in proof.claims if (key := (each.name, each.sense)) != (name, own.sense)
    )
    return replace(proof, claims=(own,), unproved=(*proof.unproved, *others))


def rejected(proof: Proof, case: Case) -> str:
    with pytest.raises(ProofError) as caught:
        check_workspace_proof(proof, case)
    return str(caught.value)


def one_motor(text: str) -> str:
    """The text with the limits of the first motor alone."""
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith(tuple(OTHERS)))


def reachy_case(text: str) -> Case:
    return case_from(text, "head")


@pytest.fixture(scope="module")
def reachy() -> tuple[Case, Proof]:
    text = one_motor(reachy_text(0.45))
    return reachy_case(text), proof_of(reachy_case(text), text)


def test_reachy_mini_is_on_paper(reachy: tuple[Case, Proof]) -> None:
    case, proof = reachy
    assert {(each.name, each.reason) for each in proof.unproved} == {("F", "it was not judged")}
    checked = check_workspace_proof(proof, case)
    names = [each.name for each in checked.claims]
    assert names[0] == "regular"
    assert [name for name in names if name.startswith("reach limb")] == [f"reach limb stewart_{k}" for k in range(1, 7)]
    assert sum(name.startswith("joint.stewart") for name in names) == 2
    assert all(each.limit is not None and each.bound is not None for each in checked.claims[1:])


def test_reachy_mini_tampered_with_is_rejected(reachy: tuple[Case, Proof]) -> None:
    case, proof = reachy
    tree = claim(proof, "regular").unpacked()
    assert "ends" in rejected(changed(proof, "regular", tree=tree[:-1]), case)
    assert "not outside" in rejected(changed(proof, "regular", tree=bytes([Node.OUTSIDE])), case)
    moved = node_bytes(Node.CUT, tree[1], value=2.0) + tree[10:]
    assert "outside of it" in rejected(changed(proof, "regular", tree=moved), case)
    assert "no two poses" in rejected(changed(proof, "regular", reason="singular"), case)
    bound = claim(proof, "reach limb stewart_1").bound
    assert bound is not None
    # Programs maximise: a reach of at least b is a bound of -b.
    assert "reach limb stewart_1" in rejected(changed(proof, "reach limb stewart_1", bound=bound - 0.2), case)
    # A limit on a motor alone has the loops as conditions: the closed forms need the reach of all limbs.
    assert "other expressions" in rejected(changed(proof, "joint.stewart_1 joint stewart_1:1"), case)
    other = reachy_case(one_motor(reachy_text(0.45)).replace("rc = 0.062", "rc = 0.060"))
    assert "other expressions" in rejected(changed(proof, "reach limb stewart_1"), other)


@pytest.mark.slow
def test_reachy_mini_is_on_paper_for_most_of_its_documented_rotations() -> None:
    text = reachy_text(0.6)
    proof = proof_of(reachy_case(text), text, with_objective=True)
    assert not proof.unproved
    assert len(check_workspace_proof(proof, reachy_case(text)).claims) == 21


def boxes_about(y: FloatArray, half: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Boxes of many sizes with a point of theirs at y."""
    width = half * 10.0 ** rng.uniform(-6, -0.3, (100, 1)) * rng.uniform(0.2, 1, (100, 6))
    share = rng.uniform(0.05, 0.95, (100, 6))
    return y - share * width, y + (1 - share) * width


@pytest.mark.parametrize(
    ("name", "part", "degrees", "seed"),
    [("6-rus", 0.1, 40, 2), pytest.param("6-ups", 0.4, 70, 1, marks=pytest.mark.soak)],
)
def test_no_box_with_a_singular_pose_is_shown_to_be_regular(name: str, part: float, degrees: float, seed: int) -> None:
    """The pose is one that Newton's method finds to 1e-10, in a robot with random dimensions."""
    case = gallery_case(name, part, degrees, seed)
    assert case.workspace is not None
    root, box = pose_root(workspace_of_case(case)), pose_box(workspace_of_case(case))
    problem = build_problem(case, closed_form(case.model).model, box)
    newton, rng = SingularPose(problem, problem.locked), np.random.default_rng(seed)
    tried = (newton.search(each) for each in box.random(200, rng))
    y = next(each for each in tried if each is not None)
    shown = rank_claim(case, closed_form(case.model).model, root, "regular")
    half = 0.5 * (root.upper - root.lower)
    assert not shown.attempt(*boxes_about(y, half, rng)).holds.any()
    home = 0.5 * (root.lower + root.upper)
    assert shown.attempt(*boxes_about(home, 0.1 * half, rng)).holds.mean() > 0.5


@pytest.mark.parametrize(
    ("name", "part", "degrees", "seed"),
    [("3-rps", 0.3, 60, 1), pytest.param("planar-3-rrr", 0.3, 60, 2, marks=pytest.mark.soak)],
)
def test_no_box_with_a_singular_closed_pose_is_shown(name: str, part: float, degrees: float, seed: int) -> None:
    case = gallery_case(name, part, degrees, seed)
    assert case.workspace is not None
    root, box = pose_root(workspace_of_case(case)), pose_box(workspace_of_case(case))
    problem = build_problem(case, closed_form(case.model).model, box)
    newton, rng = SingularPose(problem, problem.locked), np.random.default_rng(seed)
    shown = rank_claim(case, closed_form(case.model).model, root, "regular")
    half = 0.5 * (root.upper - root.lower)
    assert shown.attempt(*boxes_about(problem.pose_of(problem.start), 0.05 * half, rng)).holds.mean() > 0.5
    points = np.broadcast_to(problem.start, (60, len(problem.start))).copy()
    points[:, list(problem.independent)] += 0.3 * half[list(problem.independent)] * rng.uniform(-1, 1, (60, 3))
    z = next(each for each in (newton.search(each) for each in points) if each is not None)
    # The assembly that is singular there, and no other.
    shown.assembly.start = z
    assert not shown.attempt(*boxes_about(problem.pose_of(z), half, rng)).holds.any()


@pytest.mark.parametrize("name", ["3-rps", "tricept"])
def test_closed_loops_are_where_they_are_shown_to_be(name: str) -> None:
    case = gallery_case(name, 0.1, 20, 4)
    assert case.workspace is not None
    root = pose_root(workspace_of_case(case))
    assembly = rank_claim(case, closed_form(case.model).model, root, "regular").assembly
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
    record = PaperRecord()
    proof = paper_of(judge_workspace(case, with_limits=False, paper=record), record, "")
    checked = check_workspace_proof(read_proof(proof.as_text(), "again"), case)
    assert [each.name for each in checked.claims] == ["regular", "constraints regular"]
    tree = claim(proof, "regular").unpacked()
    assert "ends" in rejected(changed(proof, "regular", tree=tree[:-1]), case)
    assert "not outside" in rejected(changed(proof, "constraints regular", tree=bytes([Node.OUTSIDE])), case)


def test_boxes_with_another_assembly_do_not_belong_together() -> None:
    case = gallery_case("3-rps", 0.03, 6)
    assert case.workspace is not None
    root = pose_root(workspace_of_case(case))
    shown = rank_claim(case, closed_form(case.model).model, root, "regular")
    tree = node_bytes(Node.CUT, 2, value=0.5 * (root.lower[2] + root.upper[2])) + bytes([Node.BOUNDED] * 2)
    show_on_leaves(shown, root, tree)
    shown.finish()
    (whole,) = shown._shown
    shown.assembly.refuse_apart(whole)
    lower, upper = whole.lower.copy(), whole.upper.copy()
    D = shown.assembly.dependent
    lower[0, D], upper[0, D] = lower[0, D] + 0.5, upper[0, D] + 0.5
    with pytest.raises(ProofError, match="same assembly"):
        shown.assembly.refuse_apart(whole._replace(lower=lower, upper=upper))


def test_the_tree_of_another_workspace_does_not_hide_a_singular_pose(
    reachy: tuple[Case, Proof], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, proof = reachy
    case = reachy_case(one_motor(reachy_text(1.0)))
    assert case.workspace is not None
    monkeypatch.setattr(_PoseRule, "most_pieces", 100)
    assert isinstance(proof.premises, Premises)
    other = changed(proof, "regular")
    other = replace(other, premises=replace(proof.premises, workspace=workspace_numbers(case.workspace)))
    # All claims about limits are named, and none is proved.
    assert "could not be shown" in rejected(other, case)


def test_forms_hold_the_entries_and_could_be_no_smaller() -> None:
    case = gallery_case("6-rus", 0.1, 20)
    assert case.workspace is not None
    root = pose_root(workspace_of_case(case))
    entries = rank_claim(case, closed_form(case.model).model, root, "regular")._entries
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
    record = PaperRecord()
    proof = paper_of(judge_workspace(case, with_limits=False, paper=record), record, "")
    (found,) = check_workspace_proof(proof, case).claims
    assert found.is_refuted
    first, second = claim(proof, "regular").sides
    assert "opposite signs" in rejected(changed(proof, "regular", sides=(first, first)), case)
    assert "not one of the workspace" in rejected(changed(proof, "regular", sides=(first, (99.0, *second[1:]))), case)
    small = gallery_case("6-ups", 0.02, 5, 1)
    assert small.workspace is not None
    assert isinstance(proof.premises, Premises)
    other = replace(proof, premises=replace(proof.premises, workspace=workspace_numbers(small.workspace)))
    assert "not one of the workspace" in rejected(other, small)


@pytest.mark.parametrize(
    ("name", "reached", "words"),
    [
        ("6-sps", True, ""),
        ("6-rus", True, "the assembly of home"),
        ("6-rus", False, "every assembly"),
        ("planar-3-prr", True, "every assembly in which limbs in closed form are as at home"),
        ("3-rps", True, "every assembly"),
    ],
)
def test_claims_name_the_assemblies_of_their_numbers(name: str, reached: bool, words: str) -> None:
    case = gallery_case(name, 0.02, 3)
    assert case.workspace is not None
    limbs = {f"reach limb {k}" for k in range(1, 7)} if reached else set()
    found = robot_claims(case, case.workspace, limbs)
    assert found.numbers_at == words
    # Unknowns that are still variables may have any value; those in closed form have home's.
    unknowns = [k for at_pose in found.layout.places.unknowns for k in at_pose]
    assert len(unknowns) == {"6-sps": 0, "6-rus": 0 if reached else 6, "planar-3-prr": 5, "3-rps": 6}[name]
