"""Proofs on paper of robots that are not six straight legs: what the check accepts, and what it must not."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from screwsynth.models import FloatArray
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free, Task
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.certificate.paper.proof import ProofError
from screwsynth.nlp.workspace.general.problem import build_problem
from screwsynth.nlp.workspace.general.singularpose import SingularPose
from screwsynth.nlp.workspace.judge import judge_workspace
from screwsynth.nlp.workspace.paper.anyrobot.motionclaim import MotionClaim, balls
from screwsynth.nlp.workspace.paper.anyrobot.rankofrobot import rank_claim
from screwsynth.nlp.workspace.paper.check import check_paper
from screwsynth.nlp.workspace.paper.document import PaperClaim, PaperProof, Unproved, read_paper
from screwsynth.nlp.workspace.paper.poseroot import pose_root
from screwsynth.nlp.workspace.paper.record import PaperRecord
from screwsynth.nlp.workspace.paper.tree import PoseNode, split_bytes
from screwsynth.nlp.workspace.paper.written import paper_of
from screwsynth.nlp.workspace.posebox import pose_box

CASES = Path(__file__).parents[2] / "cases"


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


def proof_of(case: Case, text: str = "", *, with_objective: bool = False) -> PaperProof:
    """The proof, without F, which takes longest."""
    record = PaperRecord()
    judged = judge_workspace(case, gap=0.1, with_objective=with_objective, paper=record)
    return read_paper(paper_of(judged, record, text).as_text(), "again")


def claim(proof: PaperProof, name: str) -> PaperClaim:
    return next(each for each in proof.claims if each.name == name)


def changed(proof: PaperProof, name: str, **values: object) -> PaperProof:
    """The proof of one claim alone, tampered with."""
    own = replace(claim(proof, name), **values)  # type: ignore[arg-type]
    others = tuple(
        Unproved(*key, "left out") for each in proof.claims if (key := (each.name, each.sense)) != (name, own.sense)
    )
    return replace(proof, claims=(own,), unproved=(*proof.unproved, *others))


def rejected(proof: PaperProof, case: Case) -> str:
    with pytest.raises(ProofError) as caught:
        check_paper(proof, case)
    return str(caught.value)


def reachy_case(text: str) -> Case:
    return case_from_tables(tomllib.loads(text), name="head", source="head.toml")


@pytest.fixture(scope="module")
def reachy() -> tuple[Case, PaperProof]:
    text = reachy_text(0.3)
    return reachy_case(text), proof_of(reachy_case(text), text)


def test_reachy_mini_is_on_paper(reachy: tuple[Case, PaperProof]) -> None:
    case, proof = reachy
    assert {(each.name, each.reason) for each in proof.unproved} == {("F", "it was not judged")}
    checked = check_paper(proof, case)
    names = [each.name for each in checked.claims]
    assert names[0] == "regular"
    assert [name for name in names if name.startswith("reach limb")] == [f"reach limb stewart_{k}" for k in range(1, 7)]
    assert sum(name.startswith("joint.stewart") for name in names) == 12
    assert all(each.limit is not None and each.bound is not None for each in checked.claims[1:])


def test_reachy_mini_tampered_with_is_rejected(reachy: tuple[Case, PaperProof]) -> None:
    case, proof = reachy
    tree = claim(proof, "regular").tree
    assert "ends" in rejected(changed(proof, "regular", tree=tree[:-1]), case)
    assert "goes on" in rejected(changed(proof, "regular", tree=tree + bytes([PoseNode.CLOSED])), case)
    assert "not outside" in rejected(changed(proof, "regular", tree=bytes([PoseNode.OUTSIDE])), case)
    moved = split_bytes(tree[1], 2.0) + tree[10:]
    assert "outside of it" in rejected(changed(proof, "regular", tree=moved), case)
    assert "no reason" in rejected(changed(proof, "regular", reason="boxes"), case)
    assert "no two poses" in rejected(changed(proof, "regular", reason="singular"), case)
    bound = claim(proof, "reach limb stewart_1").bound
    assert bound is not None
    # Programs maximise: a reach of at least b is a bound of -b.
    assert "reach limb stewart_1" in rejected(changed(proof, "reach limb stewart_1", bound=bound - 0.2), case)
    # A limit on a motor alone has the loops as conditions: the closed forms need the reach of all limbs.
    assert "other expressions" in rejected(changed(proof, "joint.stewart_1 joint stewart_1:1"), case)
    other = reachy_case(reachy_text(0.3).replace("rc = 0.062", "rc = 0.060"))
    assert "other expressions" in rejected(changed(proof, "reach limb stewart_1"), other)


@pytest.mark.slow
def test_reachy_mini_is_on_paper_for_most_of_its_documented_rotations() -> None:
    text = reachy_text(0.6)
    proof = proof_of(reachy_case(text), text, with_objective=True)
    assert not proof.unproved
    assert len(check_paper(proof, reachy_case(text)).claims) == 21


def boxes_about(y: FloatArray, half: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Boxes of many sizes with a point of theirs at y."""
    width = half * 10.0 ** rng.uniform(-6, -0.3, (300, 1)) * rng.uniform(0.2, 1, (300, 6))
    share = rng.uniform(0.05, 0.95, (300, 6))
    return y - share * width, y + (1 - share) * width


@pytest.mark.parametrize(
    ("name", "part", "degrees", "seed"), [("6-ups", 0.4, 70, 1), ("6-rus", 0.1, 40, 2), ("6-pus", 0.4, 70, 3)]
)
def test_no_box_with_a_singular_pose_is_shown_to_be_regular(name: str, part: float, degrees: float, seed: int) -> None:
    """The pose is one that Newton's method finds to 1e-10, in a robot with random dimensions."""
    case = gallery_case(name, part, degrees, seed)
    assert case.workspace is not None
    root, box = pose_root(case.workspace), pose_box(case.workspace)
    problem = build_problem(case, closed_form(case.model).model, box)
    newton, rng = SingularPose(problem, problem.locked), np.random.default_rng(seed)
    tried = (newton.search(each) for each in box.random(200, rng))
    y = next(each for each in tried if each is not None)
    shown = rank_claim(case, root, "regular")
    half = 0.5 * (root.upper - root.lower)
    assert not shown.attempt(*boxes_about(y, half, rng)).holds.any()
    home = 0.5 * (root.lower + root.upper)
    assert shown.attempt(*boxes_about(home, 0.1 * half, rng)).holds.mean() > 0.5


def test_balls_hold_the_entries_and_could_be_no_smaller() -> None:
    case = gallery_case("6-rus", 0.1, 20)
    assert case.workspace is not None
    root = pose_root(case.workspace)
    shown = rank_claim(case, root, "regular")
    assert isinstance(shown, MotionClaim)
    rng = np.random.default_rng(3)
    lower, upper = boxes_about(0.5 * (root.lower + root.upper), 0.5 * (root.upper - root.lower), rng)
    h = 0.5 * (upper - lower) * (1 + 1e-12)
    function = shown._entries._function
    c, e, s = balls(shown._entries(lower.T, upper.T), shown._count, h)
    centre, off = 0.5 * (lower + upper), h * rng.choice([-1.0, 1.0], h.shape) * (1 - 1e-9)
    values = function(ca.DM((centre + off).T)).full().reshape(shown._count, len(h), order="F").T
    missed = np.abs(values - c - np.einsum("brn,bn->br", s, off))
    known = np.isfinite(e).all(axis=1)
    assert known.mean() > 0.8
    assert (missed <= e + 1e-12 * (1 + np.abs(values)))[known].all()
    assert (missed > 0.05 * e + 1e-12)[known].any()
