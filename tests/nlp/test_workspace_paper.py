"""Proofs of workspaces on paper: what the checker accepts, and that it rejects everything that was tampered with."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, edited, output_of, refusal_of, saved, unbroken, unpacked
from hexapods import (
    HEXAPOD,
    case_of_legs,
    clearance,
    hexapod_text,
    random_legs,
    random_workspace,
    subject_of,
    values_of,
)
from workspace_cases import alone, changed, claim, exact_rows, on_paper, rejected, stating, turned

from screwsynth.models import FloatArray, three_upu
from screwsynth.nlp import Case, Free, Judgement, Outcome, Task, TurnKind, Turns, Workspace, judge_workspace
from screwsynth.nlp.program.layout import robot_length
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.checker.fractions import tangent_ends
from screwsynth.nlp.proof.checker.packed import digest_of, packed_text
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, read_proof
from screwsynth.nlp.proof.checker.tree import Node, node_bytes
from screwsynth.nlp.proof.checker.workspace import check
from screwsynth.nlp.proof.checker.workspace.forms import contraction
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot
from screwsynth.nlp.proof.checker.workspace.number_claims import (
    ClearanceClaim,
    ErrorClaim,
    LegInverse,
    SingularClaim,
    are_positive,
    whole_errors,
)
from screwsynth.nlp.proof.checker.workspace.pose_boxes import BoxClaim, PoseRoot, pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import RankClaim, rank_claim
from screwsynth.nlp.proof.statement.fixed_robot import Legs, legs_of
from screwsynth.nlp.proof.workspace.numbers.bound_search import Number
from screwsynth.nlp.proof.workspace.numbers.jacobian_numbers import WorstError
from screwsynth.nlp.proof.workspace.numbers.pose_error import PoseErrors, with_rest
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem

#: The machine of LinuxCNC's hexapod kinematics, with a limit of every kind.
TEXT = (
    hexapod_text(1, 5)
    + """[limits]
leg_length = { min = 17, max = 44 }
actuator = { stroke_max = 30, dead_length = 0.1 }
platform_joint_angle = { max = 60, about = "home" }
leg_clearance = { min = 0.5 }
smallest_singular_value = { min = 0.25, length = 11.5 }
condition_number = { max = 8, length = 11.5 }
home = { position = [0, 0, 20] }
[workspace]
position = [{ min = -2, max = 2 }, 0.5, { min = 18, max = 21 }]
rotation = { roll = 3, pitch = { min = -5, max = 9 } }
"""
)
LEG_ERROR = 0.008


def case_of(text: str = TEXT) -> Case:
    return case_from(text, "machine")


@pytest.fixture(scope="module")
def judged() -> tuple[Judgement, ProofRecord]:
    record = ProofRecord()
    # Lengths of legs are asked for once more, without their limit.
    found = judge_workspace(case_of(), quantities=["leg_length"], gap=0.05, leg_error=LEG_ERROR, record=record)
    return found, record


@pytest.fixture(scope="module")
def proof(judged: tuple[Judgement, ProofRecord]) -> Proof:
    return proof_of(*judged, TEXT, quantities=["leg_length"], leg_error=LEG_ERROR)


@pytest.fixture(scope="module")
def robot() -> Legs:
    return legs_of(case_of(TEXT.replace("x3 = 1", "x3 = 0")))


def refused(proof: Proof, *edits: tuple[str, str]) -> str:
    """The reason for which a proof is rejected, of the machine's case or with words of it replaced."""
    return rejected(proof, case_of(edited(TEXT, *edits)))


def random_boxes(root: PoseRoot, count: int, width: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    lower = rng.uniform(root.lower, root.upper, (count, 6))
    upper = np.minimum(lower + (root.upper - root.lower) * rng.uniform(0, width, (count, 6)), root.upper)
    return lower, upper


def test_a_proof_with_every_kind_of_claim_holds(proof: Proof, judged: tuple[Judgement, ProofRecord]) -> None:
    assert not proof.unproved
    again = read_proof(proof.as_text(), "again")
    assert unpacked(again) == proof
    checked = check.check_workspace_proof(again, case_of(), leg_error=LEG_ERROR)
    assert len(checked.claims) == len(proof.claims)
    assert {each.reason for each in proof.claims} == {"regular", "program", "boxes", "lengths"}
    bounds = {(each.name, each.sense): each.bound for each in checked.claims}
    assert bounds["smallest_singular_value", "min"] == 0.25
    limits = {(each.name, each.sense): each.limit for each in checked.claims}
    assert limits["leg_length limb 1-", "max"] == pytest.approx(44)
    assert limits["actuator.stroke_max limb 1-", "max"] == 30
    assert bounds["position error", "max"] is not None
    for each in judged[0].extremes:
        bound = bounds[each.name, each.sense.value]
        sign = 1.0 if each.sense.value == "max" else -1.0
        assert sign * bound >= sign * each.reached - 1e-9 * abs(each.reached)


def test_an_error_without_the_other_one_is_not_on_paper(judged: tuple[Judgement, ProofRecord]) -> None:
    found, record = judged
    names = ["position error", "rotation error"]
    for name in names:
        opened = [replace(each, outcome=Outcome.OPEN) if each.name == name else each for each in found.extremes]
        proof = proof_of(replace(found, verdicts=(*found.ranks, *opened)), record, TEXT, leg_error=LEG_ERROR)
        assert sorted(each.name for each in proof.unproved) == names
        assert not any(each.name in names for each in proof.claims)


@pytest.mark.parametrize(
    ("name", "sense", "factor"),
    [
        ("smallest_singular_value", "min", 4.5),
        ("condition_number", "max", 0.18),
        ("position error", "max", 0.7),
        ("F", "max", 0.9),
        ("leg_length limb 1-", "min", 1.2),
        ("leg_clearance limbs 1- and 1+", "min", 9.0),
    ],
)
def test_another_bound_is_rejected(proof: Proof, name: str, sense: str, factor: float) -> None:
    needed = (name, "rotation error") if name == "position error" else (name,)
    bound = factor * claim(proof, name, sense).bound
    assert name in refused(alone(changed(proof, name, sense, bound=bound), *needed))


def test_a_bound_that_does_not_keep_the_limit_is_rejected(proof: Proof) -> None:
    assert "does not satisfy" in refused(changed(alone(proof, "condition_number"), "condition_number", bound=9.0))
    proof = alone(proof, "leg_length limb 1-", "actuator.stroke_max limb 1-")
    for edit in (("max = 44", "max = 30"), ("stroke_max = 30", "stroke_max = 2")):
        assert "does not satisfy" in refused(proof, edit)


def test_other_trees_are_rejected(proof: Proof) -> None:
    proof = alone(proof, "regular", "position error", "rotation error")
    tree = node_bytes(Node.CUT, 0, value=0.0) + bytes([Node.BOUNDED] * 2)
    for name, other, fault in (
        ("position error", tree[:-1], "ends"),
        ("position error", tree + tree[-1:], "additional data after its last box"),
        ("position error", node_bytes(Node.CUT, 0, value=4.0) + tree[10:], "outside this box"),
        ("regular", b"\x07", "where only CUT, BOUNDED or OUTSIDE is allowed"),
        ("regular", bytes([Node.CUT, 6]) + bytes(8), "refers to variable 6"),
        ("regular", bytes([Node.OUTSIDE]), "not outside"),
    ):
        assert fault in refused(changed(proof, name, tree=other))


def test_a_proof_is_for_its_case_only(proof: Proof) -> None:
    assert "another workspace" in refused(proof, ("max = 9 }", "max = 9.5 }"))
    assert "other joint centres" in refused(proof, ("11.543", "11.544"))
    assert "its expressions or bounds differ" in refused(alone(proof, "F"), ("axis = [0, 0, 1]", "axis = [0, 1, 1]"))
    assert "lacks the claim regular" in refused(replace(proof, claims=proof.claims[1:]))
    assert "exactly once" in refused(replace(proof, claims=(*proof.claims, proof.claims[0])))
    assert "leg_clearance" in refused(proof, ("leg_clearance = { min = 0.5 }", ""))
    assert "cannot be proved by the reason" in refused(
        changed(alone(proof, "condition_number"), "condition_number", reason="lengths")
    )
    assert "quantity" in refused(stating(proof, quantities=("none",)))


def test_a_leaf_across_a_singular_pose_is_rejected(robot: Legs) -> None:
    """40 degrees about any axis: singular. So is every tree that claims otherwise."""
    root = pose_root(turned(TurnKind.ANY_AXIS, 40))
    for tree in (bytes([Node.BOUNDED]), node_bytes(Node.CUT, 0, value=0.5) + bytes([Node.BOUNDED] * 2)):
        with pytest.raises(ProofError, match="could not be proved"):
            root.show_on_leaves(rank(root, robot), tree)


def rank(root: PoseRoot, robot: Legs) -> RankClaim:
    return rank_claim(case_of_legs(robot), HEXAPOD, root, "regular")


def posed(root: PoseRoot, robot: Legs) -> PosedRobot:
    return PosedRobot(case_of_legs(robot), HEXAPOD, root)


@pytest.mark.parametrize("tolerance", ["", "[tolerance]\njoint_centre = 0.5\n"])
def test_a_refuted_workspace_carries_two_poses(tolerance: str) -> None:
    """Of the design, whatever the errors of other machines: these may have determinants of either sign there."""
    text = TEXT.replace("x3 = 1", "x3 = 0")
    text = text[: text.index("[limits]")] + tolerance + "[workspace]\n"
    text += "position = [{min=-5,max=5}, {min=-5,max=5}, {min=15,max=25}]"
    text += "\nrotation = {angle={min=-40,max=40}}\n"
    case = case_of(text)
    given = on_paper(case, text, with_limits=False)[1]
    (found,) = check.check_workspace_proof(given, case).claims
    assert found.is_refuted
    missing = {"no search for this claim was made", "the claim needs bounds of leg lengths, which are not proved"}
    assert {each.reason for each in given.unproved} <= missing
    first, second = claim(given, "regular").sides
    for sides, fault in (
        ((first, first), "opposite signs"),
        ((first, (9.0, *second[1:])), "outside the workspace"),
        ((first,), "must state two poses"),
    ):
        assert fault in rejected(changed(given, "regular", sides=sides), case)


def test_the_commands_write_and_check_proofs(cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "proof.json"
    # The strokes are longer than allowed: these claims have no proof.
    left_out = ("condition_number", "smallest_singular_value", "platform_joint_angle", "leg_clearance", "home =")
    lines = edited(TEXT, ("stroke_max = 30", "stroke_max = 2")).splitlines()
    text = "\n".join(line for line in lines if not line.startswith(left_out))
    file = saved(tmp_path / "machine.toml", text)
    code, _, err = cli("workspace", str(file), "--gap", "0.1", "--proof", str(target))
    assert code == 1
    missing = "no proof: actuator.stroke_max limb 1- max: refuted"
    assert missing in err
    for arguments in ((str(target),), (str(target), str(file))):
        out = unbroken(output_of(cli("verify-proof", *arguments, "--all")))
        assert re.match(r"PROOF VALID for \d+ of \d+ claims; \d+ refuted\n", out)
        assert "regular: J has full rank at every pose" in out
        assert missing in out
    saved(file, edited(text, ("min = -2, max = 2", "min = -2, max = 3")))
    code, _, err = cli("verify-proof", str(target), str(file))
    assert (code, err) == (1, "rejected: the proof is for another workspace than that of this case\n")
    content = json.loads(target.read_text(encoding="utf-8"))
    nodes = bytes([Node.OUTSIDE])
    content["claims"][0]["tree"] = packed_text(nodes)
    refusal_of(cli("verify-proof", str(saved(target, json.dumps(content)))), "is damaged")
    content["claims"][0]["digest"] = digest_of(nodes)
    code, _, err = cli("verify-proof", str(saved(target, json.dumps(content))))
    assert (code, err[:17]) == (1, "rejected: regular")
    refusal_of(cli("verify-proof", str(saved(target, json.dumps(content | {"claims": [{}]})))))
    refusal_of(cli("workspace", str(file), "--proof", "-", "--json", "-"), "standard output")


def test_random_machines_are_accepted() -> None:
    rng = np.random.default_rng(5)
    accepted = 0
    while accepted < 12:
        machine = random_legs(rng)
        workspace = random_workspace(rng, list(TurnKind)[accepted % 3], float(rng.uniform(0.1, 0.3)))
        record = TreeRecord()
        problem = build_problem(case_of_legs(machine), HEXAPOD, pose_box(workspace))
        found = prove_rank(problem, problem.locked, most_boxes=3000, recorder=record)
        if found.outcome is not Outcome.PROVED:
            continue
        root = pose_root(workspace)
        tree = record.tree(with_open=True)
        root.show_on_leaves(rank(root, machine), tree)
        # The checker need not find the cuts again: those of the search are in the tree, 10 bytes and a leaf each.
        # Halves that surely fail are divided without a look, so that there may be more cuts than boxes tell.
        cuts, rest = divmod(len(tree) - 1, 11)
        assert not rest
        assert cuts >= found.boxes // 2
        accepted += 1


def test_a_robot_is_not_regular_by_the_rounding_of_its_constants() -> None:
    """Trap: three couples about one line, in constants that are 1e-16 in the place of 0, have full rank."""
    model, place = three_upu(axes="snu"), (0.0, 0.0, Free(45.0, 55.0))
    case = Case(model, {"base_radius": 50.0, "platform_radius": 25.0}, [0, 0, 50], [Task([0, 0, 0, 0, 0, 1])])
    angles = (0.0, Free(-0.1, 0.3), Free(-0.2, 0.2))
    still, *turning = (Workspace(place, Turns(TurnKind.AXIS, (each,), (1, 0, 0))) for each in angles)
    problem = build_problem(case, model, pose_box(still))
    assert prove_rank(problem, problem.locked, most_boxes=1).outcome is not Outcome.PROVED
    root = pose_root(still)
    with pytest.raises(ProofError, match="could not be proved"):
        root.show_on_leaves(rank_claim(case, model, root, "regular"), bytes([Node.BOUNDED]))
    # The couples alone are a matrix of their own, and lose their rank where the platform is level, also in the middle.
    for each in turning:
        problem = build_problem(case, model, pose_box(each))
        assert prove_rank(problem, problem.unactuated).outcome is Outcome.REFUTED
        root = pose_root(each)
        with pytest.raises(ProofError, match="could not be proved"):
            root.show_on_leaves(rank_claim(case, model, root, "constraints regular"), bytes([Node.BOUNDED]))


@pytest.mark.parametrize("kind", list(TurnKind))
def test_forms_hold_exact_rows(robot: Legs, kind: TurnKind) -> None:
    rng = np.random.default_rng(7)
    workspace = turned(kind, 50)
    root = pose_root(workspace)
    lower, upper = random_boxes(root, 12, 0.3, rng)
    lower[6:], upper[6:] = lower[6:], lower[6:] + (upper[6:] - lower[6:]) * 1e-13
    claim = rank(root, robot)
    M, A, E = claim._matrices(claim.closed(lower, upper))
    case, free = case_of_legs(robot), list(np.flatnonzero(root.upper > root.lower))
    length = robot_length(case)
    rounded, bent = 0, 0
    for k in range(12):
        e = rng.uniform(-1, 1, 6) if k % 2 else np.sign(rng.normal(size=6))
        y = 0.5 * (lower[k] + upper[k]) + 0.5 * (upper[k] - lower[k]) * e
        y = np.clip(y, lower[k], upper[k])
        exact = exact_rows(robot, kind, workspace.turns.axis, [Fraction(float(each)) for each in y])
        for i, j in np.ndindex(6, 6):
            number = exact[i][j] if j < 3 else exact[i][j] / Fraction(length)
            middle = Fraction(float(M[k, i, j]))
            for a, end, low, high in zip(A[k, :, i, j], y[free], lower[k, free], upper[k, free], strict=True):
                e = (2 * Fraction(float(end)) - Fraction(low) - Fraction(high)) / Fraction(high - low)
                middle += Fraction(float(a)) * e
            off = float(abs(number - middle))
            assert off <= E[k, i, j]
            rounded += k >= 6 and off > 0
            bent += k < 6 and off > 0.25 * E[k, i, j]
    # Without rounding, or with rests a quarter as wide, the forms would not hold the rows: the test can fail.
    assert rounded
    assert bent


def test_tangents_lie_between_fractions() -> None:
    for angle in (0.0, 1e-9, -0.3, 1.0, math.radians(150), -math.radians(150)):
        low, high = tangent_ends(angle)
        assert low <= high
        assert float(high - low) <= 1e-20 * (1 + abs(float(high)))
        assert float(low) == pytest.approx(math.tan(angle / 2), rel=1e-15, abs=1e-300)


@pytest.mark.parametrize("kind", list(TurnKind))
def test_the_root_holds_the_searched_box(kind: TurnKind) -> None:
    workspace = replace(turned(kind, 33), position=(1.5, Free(-1.0, 2.0), 20.0))
    root, box = pose_root(workspace), pose_box(workspace)
    np.testing.assert_allclose(root.lower, box.lower, rtol=1e-14, atol=0)
    np.testing.assert_allclose(root.upper, box.upper, rtol=1e-14, atol=0)
    inside = 0.999 * box.random(200, np.random.default_rng(1)) + 0.001 * 0.5 * (box.lower + box.upper)
    assert all(root.holds(y) for y in inside)
    assert not root.holds(np.where(box.upper > box.lower, box.upper * (1 + 1e-9), box.upper))
    # A box in a corner of the cube around the ball is outside, and contraction loses no pose.
    if kind is TurnKind.ANY_AXIS:
        corner = np.concatenate([box.lower[:3], 0.9 * box.upper[3:]])[None]
        assert not root.contracted(corner, np.maximum(corner, box.upper[None]))[2].any()
        lower, upper = random_boxes(root, 300, 0.5, np.random.default_rng(2))
        low, high, _ = root.contracted(lower, upper)
        points = box.random(3000, np.random.default_rng(3))
        held = ((points[:, None] >= lower) & (points[:, None] <= upper)).all(axis=2)
        kept = ((points[:, None] >= low) & (points[:, None] <= high)).all(axis=2)
        assert (kept == held).all()
        assert (low > lower).any()
        # Points just within the ball, in fractions: two components of nearly its size leave little for the third.
        assert root.inner_ball is not None
        for angle in np.linspace(0.1, 1.4, 50):
            a, b = (math.sqrt(root.ball * (1 - 1e-9)) * each for each in (math.cos(angle), math.sin(angle)))
            c = math.sqrt(root.inner_ball - Fraction(a) ** 2 - Fraction(b) ** 2) * (1 - 1e-15)
            low, high = (np.array([[1.5, 0, 20, a, b, end]]) for end in (0, 1))
            assert root.contracted(low, high)[1][0, 5] >= c


@pytest.mark.parametrize("kind", list(TurnKind))
def test_claims_are_shown_of_boxes_where_they_hold_and_of_no_other(robot: Legs, kind: TurnKind) -> None:
    """Boxes against the values of the search's numbers at samples, which the check does not use."""
    rng = np.random.default_rng(4)
    workspace = turned(kind, 20)
    root, box = pose_root(workspace), pose_box(workspace)
    lower, upper = random_boxes(root, 120, 0.03, rng)
    points = lower + rng.uniform(0, 1, (30, 120, 6)).round(1) * (upper - lower)
    flat = points.reshape(-1, 6)
    subject = subject_of(robot, box)
    numbers: list[tuple[Number, float, float]] = [
        (subject.spectrum(11.5, is_condition=False), 1.0, 0.9),
        (subject.spectrum(11.5, is_condition=True), -1.0, 2.0),
        (WorstError(subject.problem, is_rotation=False), -1.0, 2.0),
        (clearance(robot, box, 0, 2), 1.0, 15.0),
    ]
    legs = posed(root, robot)
    claims: list[BoxClaim] = [
        SingularClaim(legs, 11.5, 0.9, is_condition=False),
        SingularClaim(legs, 11.5, 2.0, is_condition=True),
        ErrorClaim(legs, 2.0, is_rotation=False),
        ClearanceClaim(legs, (0, 2), 15.0),
    ]
    for (number, sign, bound), each in zip(numbers, claims, strict=True):
        least = values_of(number, flat).reshape(30, 120).min(axis=0)
        holds = each.attempt(lower, upper).holds
        assert not holds[least < sign * bound].any()
        # Most boxes on which the number is 6 % better than claimed are shown at once.
        good = least > sign * bound + 0.06 * bound
        assert good.any()
        assert holds[good].mean() > 0.8
    # A distance that is the claimed one up to rounding is no counterexample.
    (distance,) = values_of(numbers[3][0], lower[:1])
    for off, is_wrong in ((-1e-9, False), (1e-9, False), (1e-3, True)):
        assert ClearanceClaim(legs, (0, 2), distance * (1 + off)).attempt(lower[:1], lower[:1]).is_wrong == is_wrong


def test_inverses_hold_those_at_samples(robot: Legs) -> None:
    rng = np.random.default_rng(8)
    root = pose_root(turned(TurnKind.ANY_AXIS, 20))
    lower, upper = random_boxes(root, 60, 0.1, rng)
    legs = posed(root, robot)
    (P, T, rest), known, _, _ = LegInverse(legs, legs.length).inverse(lower, upper)
    length = legs.length
    assert known.mean() > 0.5
    tight = 0
    for _ in range(10):
        e = np.round(rng.uniform(-1, 1, (60, 6)))
        y = 0.5 * (lower + upper) + 0.5 * (upper - lower) * e
        rows = np.array([exact_rows(robot, TurnKind.ANY_AXIS, (), list(map(Fraction, each))) for each in y.tolist()])
        rows = rows.astype(float) / [1, 1, 1, length, length, length]
        exact = np.linalg.inv(rows / np.linalg.norm(rows[:, :, :3], axis=2, keepdims=True))
        off = np.abs(exact - P - np.einsum("bkij,bk->bij", T, e))
        assert (off <= rest + 1e-12)[known].all()
        tight += int((off > 0.05 * rest)[known].any())
    assert tight


def test_matrices_and_errors_of_second_order() -> None:
    rng = np.random.default_rng(9)
    M = rng.normal(size=(300, 6, 6))
    M = M @ M.transpose(0, 2, 1) - rng.uniform(0, 0.3, (300, 1, 1)) * np.eye(6)
    least = np.linalg.eigvalsh(M)[:, 0]
    assert (are_positive(M) == (least > 1e-11)).all()
    assert 50 < (least > 0).sum() < 250
    B = rng.uniform(0, 0.3, (300, 6, 6))
    radius = np.abs(np.linalg.eigvals(B)).max(axis=1)
    holds, _ = contraction(B)
    assert (holds == (radius < 1)).mean() > 0.95
    assert not holds[radius >= 1].any()
    first = PoseErrors(0.02, 0.003)
    ours = whole_errors(2.5, 0.375, 0.008, 20.0, 11.5)
    assert ours == pytest.approx(tuple(with_rest(first, 0.008, 20.0, 11.5)), rel=1e-5)
    assert ours[0] > 0.02
    assert whole_errors(2.5, 0.375, 8.0, 20.0, 11.5) == (math.inf, math.inf)


def test_signs_of_determinants_are_those_of_rotation_matrices(robot: Legs) -> None:
    rng = np.random.default_rng(6)
    for kind in TurnKind:
        box, claim = pose_box(turned(kind, 60)), rank(pose_root(turned(kind, 60)), robot)
        points = box.random(20, rng)
        for y, sign in zip(points, claim._signs_at(points), strict=True):
            pose = box.pose(y)
            arm = robot.platform @ pose.rotation.T
            span = pose.position + arm - robot.base
            value = np.linalg.det(np.hstack([span, np.cross(arm, span)]))
            assert sign == np.sign(value)


def test_the_check_loads_nothing_of_the_search() -> None:
    """Loaded in an interpreter of its own: the statement and the checker, and no engine and no search."""
    room = "screwsynth.nlp.proof."
    script = "import sys, screwsynth.nlp.proof.checker.workspace.check\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.removeprefix(room).split(".")[0] for name in run.stdout.split() if name.startswith(room)}
    assert loaded == {"statement", "checker"}


def test_leaves_that_are_no_boxes_of_the_workspace_count_for_nothing(robot: Legs) -> None:
    root = pose_root(turned(TurnKind.ANY_AXIS, 20))
    far = np.concatenate([root.lower[:3], 0.9 * root.upper[3:]])
    whole = replace(root, lower=far, upper=np.maximum(far, root.upper))
    assert whole.show_on_leaves(rank(root, robot), bytes([Node.OUTSIDE])) == (1, 0)
