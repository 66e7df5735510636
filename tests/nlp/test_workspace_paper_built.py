"""Proofs on paper about every machine within a tolerance: what the checker accepts, and what it must reject."""

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from hexapods import hexapod_text

import screwsynth.cases
from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.checker.proof_file import ProofClaim, ProofError, Unproved, WorkspaceProof, read_proof
from screwsynth.nlp.proof.checker.workspace import check
from screwsynth.nlp.proof.checker.workspace.ballrows import Joints, ball_rows
from screwsynth.nlp.proof.checker.workspace.built import rules
from screwsynth.nlp.proof.checker.workspace.built.changes import change_of_jacobian, change_of_rows
from screwsynth.nlp.proof.checker.workspace.built.statement import BuiltNumbers, with_further
from screwsynth.nlp.proof.checker.workspace.poseroot import pose_root
from screwsynth.nlp.proof.checker.workspace.rankclaim import RankClaim
from screwsynth.nlp.proof.checker.workspace.singularclaim import SingularClaim
from screwsynth.nlp.proof.statement.claims import claims_of
from screwsynth.nlp.proof.statement.machine import Legs, legs_of, workspace_of_case
from screwsynth.nlp.proof.statement.posed_layout import extreme_program, posed_layout
from screwsynth.nlp.proof.workspace.judge import Judgement, judge_workspace
from screwsynth.nlp.proof.workspace.numbers.searched import Subject, asked_spectra_extremes
from screwsynth.nlp.proof.workspace.proof_record import PaperRecord
from screwsynth.nlp.proof.workspace.proof_writer import paper_of
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.tolerance.legs.claims import built_claims
from screwsynth.nlp.proof.workspace.verdict import Outcome

Run = Callable[..., tuple[int, str, str]]
TOLERANCE, LENGTH, LEG_ERROR = 0.02, 11.5, 0.004
#: A limit of every kind that errors of joint centres change; the triangle inequality does not decide that on strokes.
TEXT = (
    hexapod_text(4, 5, "")
    + """[tolerance]
joint_centre = 0.02
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
leg_length = { min = 10, max = 60 }
actuator = { stroke_max = STROKE, dead_length = 1 }
base_joint_angle = { max = 30, about = "home" }
home = { position = [0, 0, 20] }
joint_spacing = { min = 1 }
footprint = { base = 40, platform = 20 }
radius_ratio = { min = 0.1, max = 0.9 }
leg_clearance = { min = 0.5 }
smallest_singular_value = { min = 0.5, length = 11.5 }
condition_number = { max = 10, length = 11.5 }
rate_share = { max = 0.9 }
actuator_rate = { max = 60 }
custom = ["x1 - 2*x2 >= 0"]
[workspace]
position = [0.3, { min = -0.3, max = 0.3 }, 20]
rotation = { axis = [0.6, 0, 0.8], angle = { min = -2, max = 2 } }
""".replace("STROKE", "0.93")
)
ASKED = ("platform_joint_angle", "smallest_singular_value", "condition_number")


def case_of(text: str = TEXT) -> Case:
    return case_from_tables(tomllib.loads(text), name="machine", source="machine.toml")


def written(text: str = TEXT, quantities: tuple[str, ...] = ASKED, **options: Any) -> tuple[Judgement, WorkspaceProof]:  # noqa: ANN401
    record = PaperRecord()
    judged = judge_workspace(case_of(text), quantities=quantities, gap=0.02, jobs=1, paper=record, **options)
    leg_error = options.get("leg_error", 0.0)
    return judged, paper_of(judged, record, text, quantities=quantities, leg_error=leg_error)


@pytest.fixture(scope="module")
def both() -> tuple[Judgement, WorkspaceProof]:
    return written(leg_error=LEG_ERROR)


@pytest.fixture(scope="module")
def proof(both: tuple[Judgement, WorkspaceProof]) -> WorkspaceProof:
    return both[1]


def rejected(proof: WorkspaceProof, text: str = TEXT) -> str:
    with pytest.raises(ProofError) as caught:
        check.check_workspace_proof(proof, case_of(text), leg_error=proof.leg_error)
    return str(caught.value)


def claim(proof: WorkspaceProof, name: str, sense: str = "") -> ProofClaim:
    return next(each for each in (*proof.claims, *proof.lemmas) if (each.name, each.sense) == (name, sense))


def changed(proof: WorkspaceProof, name: str, sense: str, **values: Any) -> WorkspaceProof:  # noqa: ANN401
    """The proof with other values in one of its claims, or lemmas."""
    old = claim(proof, name, sense)
    claims, lemmas = (
        tuple(replace(each, **values) if each is old else each for each in part)
        for part in (proof.claims, proof.lemmas)
    )
    return replace(proof, claims=claims, lemmas=lemmas)


def alone(proof: WorkspaceProof, *names: str) -> WorkspaceProof:
    """The proof with these claims alone; it says of the others that they have none."""
    kept = tuple(each for each in proof.claims if each.name in names)
    others = (Unproved(each.name, each.sense, "left out") for each in proof.claims if each.name not in names)
    return replace(proof, claims=kept, unproved=(*proof.unproved, *others))


def test_claims_of_every_kind_about_every_machine_hold(both: tuple[Judgement, WorkspaceProof]) -> None:
    judged, proof = both
    assert judged.is_proved
    assert not proof.unproved
    assert proof.tolerance == TOLERANCE
    assert read_proof(proof.as_text(), "again") == proof
    # Of one leg, or of one pair of legs, and one stroke that takes lengths of one machine.
    strokes = [each.name for each in proof.claims if each.reason == "one machine"]
    others = ("1+", "2-", "2+", "3-", "3+")
    kept = {each.name for each in proof.claims if not any(f" {leg}" in each.name for leg in others)}
    some = alone(proof, *kept, strokes[0], "leg_clearance limbs 1- and 2+", "joint_spacing base joints 1- and 1+")
    checked = check.check_workspace_proof(some, case_of(), leg_error=some.leg_error)
    assert len(checked.claims) == len(some.claims)
    # No machine that the search found is beyond a bound that the check shows, and the bounds are those of the search.
    extremes = {(each.name, each.sense.value): each for each in reversed(judged.extremes)}
    kinds = set()
    for each in checked.claims:
        if each.bound is None:
            continue
        kinds.add(each.name.partition(" ")[0])
        name = each.name.removesuffix(" with the characteristic length")
        extreme = extremes[each.name, each.sense] if name == each.name else judged.extremes[-4]
        sign = 1.0 if each.sense == "max" else -1.0
        assert sign * (each.bound - extreme.reached) >= -1e-9 * abs(each.bound), each.name
        if claim(proof, each.name, each.sense).reason in ("program", "one machine"):
            assert sign * (each.bound - extreme.bound) <= 1e-9 * abs(extreme.bound), each.name
    angles = {"base_joint_angle", "platform_joint_angle"}
    rates = {"F", "rate_share", "actuator_rate", "condition_number", "smallest_singular_value", "position", "rotation"}
    plates = {"joint_spacing", "footprint", "radius_ratio", "leg_clearance", "leg_length", "custom:"}
    assert kinds == {*angles, *rates, *plates, "actuator.stroke_max", "actuator.dead_length"}


def rejections(proof: WorkspaceProof, text: str = TEXT) -> Callable[..., str]:
    """The check of one claim after the other, with other values in it: a function that returns why it is rejected."""
    checker = check._Checker(proof, case_of(text), proof.leg_error)
    expected = {each.key: each for each in checker.expected}

    def reject(name: str, sense: str, **values: Any) -> str:  # noqa: ANN401
        with pytest.raises(ProofError) as caught:
            checker.check(expected[name, sense], replace(claim(proof, name, sense), **values))
        return str(caught.value)

    return reject


def test_another_tolerance_is_rejected(proof: WorkspaceProof) -> None:
    larger = TEXT.replace("joint_centre = 0.02", "joint_centre = 0.06")
    without = TEXT.replace("[tolerance]\njoint_centre = 0.02\n", "")
    for text in (larger, TEXT.replace("joint_centre = 0.02", "joint_centre = 0.01"), without):
        assert "within another tolerance" in rejected(proof, text)
    # Another number in the file is no way around: bounds are those of the machines of the case.
    longest = claim(proof, "leg_length limb 2-", "max").bound
    assert longest is not None
    # The limit holds for machines within 0.05, and not within 0.06.
    larger = larger.replace("max = 60 }", f"max = {math.sqrt(longest) + 0.1} }}", 1)
    reject = rejections(replace(proof, tolerance=0.06), larger)
    assert "does not keep" in reject("leg_length limb 2-", "max")
    for name in ("F", "rate_share limb 1-", "base_joint_angle limb 1-", "actuator.stroke_max limb 2+", "radius_ratio"):
        assert "other expressions" in reject(name, "max")
    reject = rejections(replace(proof, tolerance=0.0), without)
    assert "other expressions" in reject("F", "max")
    assert "about the exact machine" in reject("actuator.stroke_max limb 2+", "max")


def value_of(name: str, sense: str, number: float) -> float:
    """The bound in a file that reads as a number."""
    sign = 1.0 if sense == "max" else -1.0
    kind = name.partition(" ")[0]
    if kind == "leg_length":
        number = (number - sign * 2 * TOLERANCE) ** 2
    elif kind == "base_joint_angle":
        number = -math.cos(number)
    elif kind == "actuator_rate":
        number = number**2
    return number if kind == "leg_clearance" else sign * number


def test_bounds_that_a_machine_violates_are_rejected(both: tuple[Judgement, WorkspaceProof]) -> None:
    """The search knows a machine within the tolerance that is beyond each of these bounds by a millionth."""
    judged, proof = both
    reject = rejections(proof)
    known = {(each.name, each.sense.value): each.reached for each in reversed(judged.extremes)}
    for name, sense in (
        ("leg_length limb 1-", "min"),
        ("base_joint_angle limb 1-", "max"),
        ("platform_joint_angle limb 1-", "min"),
        ("F", "max"),
        ("actuator_rate actuator 2+", "max"),
        ("leg_clearance limbs 1- and 1+", "min"),
    ):
        reached, sign = known[name, sense], 1.0 if sense == "max" else -1.0
        fault = reject(name, sense, bound=value_of(name, sense, reached - sign * 1e-6 * abs(reached)))
        assert "could not be shown" in fault or "is wrong" in fault, name


def test_other_lemmas_and_directions_are_rejected(proof: WorkspaceProof) -> None:
    first, *others = proof.lemmas
    assert first.name.startswith("exact leg_length")
    assert first.bound is not None
    better = replace(first, bound=first.bound * 1.05)
    assert first.name in rejected(replace(proof, lemmas=(better, *others)))
    reject, name = rejections(proof), "actuator.stroke_max limb 2+"
    stroke = claim(proof, name, "max")
    turned = (stroke.sides[0], (0.0, 0.6, 0.8))
    assert "other expressions" in reject(name, "max", sides=turned)
    assert "no two directions" in reject(name, "max", sides=turned[:1])
    assert "no reason" in reject("F", "max", reason="one machine")
    reject = rejections(replace(proof, lemmas=tuple(each for each in others if not each.name.startswith(name))))
    assert "no length of legs" in reject("F", "max")
    assert "no length of legs" in reject(name, "max")


def test_further_claims_are_those_of_the_search(both: tuple[Judgement, WorkspaceProof]) -> None:
    """Limits that are the same number of the exact machine are one claim about it, and several about others."""
    case = case_of()
    layout, workspace, robot = posed_layout(case, both[0].workspace), both[0].workspace, legs_of(case)
    assert robot is not None
    missing = ("rate_share limb 2+", "base_joint_angle limb 3-")
    claims = [each for each in claims_of(layout, ["base_joint_angle"]) if not (each.key and each.name in missing)]
    ours = [(each.name, each.sense, each.key) for each in with_further(layout, claims)]
    assert ours == [(each.name, each.sense, each.key) for each in built_claims(layout, workspace, robot, claims, 15.0)]
    assert len(ours) == len(claims) + len(missing)


def test_rules_are_those_of_their_claims() -> None:
    """With two tasks and a tolerance near 0 every number of all machines is that of its claim, in check and search."""
    second = '[[task]]\nname = "turn"\nsense = "max"\naxis = [2, 1, 1]\npoint = [0, 1, 2]\npitch = 1\n[limits]'
    case = case_of(TEXT.replace("joint_centre = 0.02", "joint_centre = 1e-9").replace("[limits]", second))
    workspace, robot = workspace_of_case(case), legs_of(case)
    assert robot is not None
    layout = posed_layout(case, workspace)
    # At one pose the dead length of a leg is no claim of its own: the limit is on all poses.
    found = with_further(layout, claims_of(layout, ASKED[:1]))
    claims = [each for each in found if not each.name.startswith("actuator.dead_length")]
    numbers = BuiltNumbers(layout, rules.Machines(robot, layout.robots[0], 20.0, 21.0))
    ours = [numbers.of(each).expression for each in claims]
    searched = built_claims(layout, workspace, robot, claims, 20.0)
    theirs = [
        each.expression if each.worst is None or each.worst.expression is None else each.worst.expression
        for each in searched
    ]
    nlp = extreme_program(layout, claims[0].expression, claims[0].sense)
    values = ca.vertcat(*[each.expression for each in claims], *ours, *theirs)
    function = ca.Function("values", [nlp.program.x, nlp.program.p], [values])
    for start in ((0.2, 0.02), (-0.1, -0.03)):
        exact, own, other = np.array(function(start, nlp.arguments)).reshape(3, -1)
        np.testing.assert_allclose(own, exact, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(other, exact, rtol=1e-6, atol=1e-6)
    assert len(claims) == len({(each.name, each.sense, each.key) for each in claims}) > 60


class Machine:
    """A random hexapod at a random pose of a workspace, and machines within a tolerance of it."""

    WORKSPACE = Workspace(
        (Free(-3.0, 3.0), Free(-3.0, 3.0), Free(9.0, 15.0)), Turns(TurnKind.ANY_AXIS, (Free(-0.4, 0.4),))
    )

    def __init__(self, seed: int, tolerance: float, count: int) -> None:
        rng = np.random.default_rng(seed)
        base, platform = (
            np.column_stack([rng.uniform(-size, size, (6, 2)), rng.uniform(-1, 1, 6)]) for size in (10.0, 6.0)
        )
        self.exact, box = Legs(base, platform, tolerance), pose_box(self.WORKSPACE)
        self.y = box.random(1, rng)[0]
        pose = box.pose(self.y)
        self.position, self.rotation = pose.position, pose.rotation
        errors = rng.normal(size=(2, count, 6, 3))
        errors *= tolerance / np.linalg.norm(errors, axis=3, keepdims=True)
        # Every second machine has opposite errors at both joints of a leg.
        errors[0, ::2] = -errors[1, ::2]
        self.base = np.concatenate([base[None], base + errors[0]])
        self.arm = np.concatenate([platform[None] @ self.rotation.T, platform @ self.rotation.T + errors[1]])
        self.d = self.position + self.arm - self.base
        self.length = np.linalg.norm(self.d, axis=2)
        self.n = self.d / self.length[..., None]
        self.J = np.concatenate([self.n, np.cross(self.arm, self.n)], axis=2)

    def rates(self, twist: FloatArray) -> FloatArray:
        return np.asarray(((twist[3:] + np.cross(twist[:3], self.base)) * self.n).sum(axis=2))

    def instance(self, twist: FloatArray) -> Any:  # noqa: ANN401 - what the rules read of a robot
        exact = self.exact
        legs = [
            SimpleNamespace(base=SX(b.tolist()), span=SX(d.tolist()))
            for b, d in zip(exact.base, self.d[0], strict=True)
        ]
        rates = self.rates(twist)[0]
        F = [SX(float((rates**2).sum()))]
        return SimpleNamespace(legs=legs, rotation=SX(self.rotation.tolist()), rates=SX(rates.tolist()), F=F)


def number(expression: SX) -> float:
    return float(ca.evalf(expression))


def test_rules_hold_for_random_machines_and_are_nearly_reached() -> None:
    """Of ten random hexapods. A bound that is tighter by a fifth of its change would be violated by a machine: legs are
    independent, so that the worst of each leg are those of one machine."""
    rng, t, parts = np.random.default_rng(1), 0.05, []
    for seed in range(10):
        some, twist = Machine(seed, t, 3000), rng.normal(size=6) * (1, 1, 1, 5, 5, 5)
        far = float(np.linalg.norm(some.position))
        machines = rules.Machines(some.exact, some.instance(twist), 0.99 * float(some.length[0].min()), far)
        rates, squares = rules.task_rates(machines, twist.tolist(), 0), some.rates(twist) ** 2
        low, high = squares.min(axis=0), squares.max(axis=0)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = np.arccos(np.clip(some.n @ axis, -1, 1))
        found = [
            (number(rates.total(1.0)), high.sum(), squares[0].sum()),
            (-number(rates.total(-1.0)), -low.sum(), -squares[0].sum()),
        ]
        for i in range(6):
            others = low.sum() - low[i]
            world = SX(axis.tolist())
            found += [
                (number(rates.share(i)), high[i] / (high[i] + others), squares[0, i] / squares[0].sum()),
                (number(rates.square(i)), high[i], squares[0, i]),
                (number(rules.minus_cosine(machines, i, world)), -np.cos(angle[:, i].max()), -np.cos(angle[0, i])),
                (number(rules.angle(machines, i, world, 1.0)), angle[:, i].max(), angle[0, i]),
                (-number(rules.angle(machines, i, world, -1.0)), -angle[:, i].min(), -angle[0, i]),
            ]
        parts.append(found)
    bound, worst, exact = np.array(parts).transpose(2, 0, 1)
    assert (bound >= worst).all()
    assert np.median((worst - exact) / (bound - exact), axis=0).min() > 0.8


def test_lengths_of_one_machine_hold_at_two_poses() -> None:
    t, checked = 0.05, 0
    for seed in range(12):
        some = Machine(seed, t, 2000)
        twist = np.ones(6)
        # The same machines at a second pose: turned by 0.1 about an axis, and moved.
        c, s = math.cos(0.1), math.sin(0.1)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        d = some.position + (0.5, -0.3, 0.8) + some.arm @ turn.T - some.base
        length = np.linalg.norm(d, axis=2)
        shortest = 0.99 * float(min(some.length[0].min(), length[0].min()))
        here, there = some.instance(twist), some.instance(twist)
        there.rotation = SX((turn @ some.rotation).tolist())
        for leg, span in zip(there.legs, d[0], strict=True):
            leg.span = SX(span.tolist())
        here, there = (rules.Machines(some.exact, each, shortest, 20.0) for each in (here, there))
        n = d[0] / length[0][:, None]
        for i in range(6):
            base = 0.5 * (some.n[0, i] + n[i])
            platform = 0.5 * (some.n[0, i] @ some.rotation + n[i] @ turn @ some.rotation)
            most = number(rules.length_beside(there, i, 1.0, base, platform))
            least = number(rules.length_beside(here, i, -1.0, base, platform))
            stroke = length[:, i] - some.length[:, i]
            assert stroke.max() <= most - least
            # The triangle inequality would allow for 4 t.
            checked += most - least < stroke[0] + 2 * t
    assert checked > 60


def test_changes_of_rows_hold_those_of_machines() -> None:
    rng = np.random.default_rng(3)
    for kind in TurnKind:
        angle = Free(-0.5, 0.5)
        turns = Turns(kind, (angle,) * (3 if kind is TurnKind.ROLL_PITCH_YAW else 1), (0.6, 0.0, 0.8))
        root = pose_root(replace(Machine.WORKSPACE, turns=turns))
        some, t = Machine(5, 0.3, 1), 0.3
        joints = Joints(some.exact.base, some.exact.platform)
        lower = rng.uniform(root.lower, root.upper, (40, 6))
        upper = np.minimum(lower + 1e-3 * (root.upper - root.lower), root.upper)
        bound = change_of_rows(ball_rows(root, joints, lower, upper), joints, t)
        y = lower + rng.uniform(size=lower.shape) * (upper - lower)
        exact, most = ball_rows(root, joints, y, y).rows.c, np.zeros_like(bound)
        for _ in range(40):
            e, f = rng.normal(size=(2, 6, 3))
            e, f = (t * each / np.linalg.norm(each, axis=1, keepdims=True) for each in (e, f))
            moved = ball_rows(root, Joints(joints.base + e, joints.platform + f), y, y).rows.c
            most = np.maximum(most, np.abs(moved - exact))
        assert (most <= bound * (1 + 1e-9)).all()
        # A bound that is smaller by three tenths would not hold: the test can fail.
        assert ((most > 0.7 * bound).any(axis=0)).all()


def test_no_claim_is_shown_where_a_machine_violates_it() -> None:
    root, t, shown, regular, singular = pose_root(Machine.WORKSPACE), 0.1, 0, 0, 0
    for seed in range(30):
        some = Machine(seed, t, 800)
        joints, at = Joints(some.exact.base, some.exact.platform), (some.y[None], some.y[None])
        values = np.linalg.svd(some.J / [1, 1, 1, LENGTH, LENGTH, LENGTH], compute_uv=False)
        least, condition = values[:, -1], values[:, 0] / values[:, -1]
        change = change_of_jacobian(joints, t, LENGTH, 0.999 * float(some.length[0].min()))

        def holds(bound: float, *, is_condition: bool) -> bool:
            one = SingularClaim(root, joints, LENGTH, bound, is_condition=is_condition, change=change)  # noqa: B023
            return bool(one.attempt(*at).holds[0])  # noqa: B023

        assert not holds(least.min() * (1 + 1e-6), is_condition=False)
        assert not holds(condition.max() * (1 - 1e-6), is_condition=True)
        if least[0] > 1.5 * change:
            shown += 1
            assert holds(least[0] - 1.01 * change, is_condition=False)
            assert holds((values[0, 0] + change) / (least[0] - change) * 1.02, is_condition=True)
        signs = np.sign(np.linalg.det(some.J))
        is_singular = bool((signs != signs[0]).any())
        is_regular = bool(RankClaim(root, joints, t).attempt(*at).holds[0])
        assert not (is_regular and is_singular)
        # Without the errors' part it would be claimed of machines, some of which are singular: the test can fail.
        assert RankClaim(root, joints).attempt(*at).holds[0]
        regular, singular = regular + is_regular, singular + is_singular
    assert min(shown, regular, singular) > 4


def test_a_singular_machine_within_the_tolerance_is_on_paper() -> None:
    head = TEXT[: TEXT.index("[limits]")].replace("joint_centre = 0.02", "joint_centre = 0.8")
    text = head + "[workspace]\nposition = [{min=-5,max=5}, {min=-5,max=5}, {min=15,max=25}]\n"
    text += "rotation = {angle={min=-30,max=30}}\n"
    judged, given = written(text, (), with_limits=False)
    assert judged.regularity.errors is not None
    (found,) = check.check_workspace_proof(
        read_proof(given.as_text(), "again"), case_of(text), leg_error=given.leg_error
    ).claims
    assert found.is_refuted
    assert found.by_machine
    pose, *machine = claim(given, "regular").sides
    exact = [tuple(each) for each in given.legs]
    for sides, fault in (
        ((pose, *exact), "same sign"),
        ((pose, *(tuple(2.0 * part for part in each) for each in machine)), "more than the tolerance"),
        ((tuple(9.0 for _ in pose), *machine), "not one of the workspace"),
        ((pose, *machine[1:]), "no pose and machine"),
    ):
        assert fault in rejected(changed(given, "regular", "", sides=sides), text)
    smaller = text.replace("joint_centre = 0.8", "joint_centre = 0.1")
    assert "more than the tolerance" in rejected(replace(given, tolerance=0.1), smaller)


def test_the_commands_say_which_machines_a_proof_is_about(cli: Run, tmp_path: Path) -> None:
    file, target = tmp_path / "machine.toml", tmp_path / "proof.json"
    head, _, tail = TEXT.partition("actuator =")
    file.write_text(head + tail[tail.index("[workspace]") :], encoding="utf-8")
    code, out, err = cli("workspace", str(file), "--gap", "0.3", "--proof", str(target))
    assert (code, err) == (0, ""), out
    code, out, err = cli("verify-proof", str(target), str(file))
    assert code == 0, err
    assert "for every machine whose joint centres are off by at most 0.02 in" in out
    content = json.loads(target.read_text(encoding="utf-8"))
    content["case"] = content["case"].replace("joint_centre = 0.02", "joint_centre = 0.002")
    target.write_text(json.dumps(content), encoding="utf-8")
    code, _, err = cli("verify-proof", str(target))
    assert code == 1
    assert err.startswith("rejected: the proof is for machines within another tolerance")


def test_asked_singular_values_of_the_exact_machine_are_on_paper() -> None:
    head, _, tail = TEXT.replace("[tolerance]\njoint_centre = 0.02\n", "").partition("actuator =")
    text = head + tail[tail.index("[workspace]") :]
    judged, given = written(text, ASKED[1:], with_objective=False)
    reject = rejections(given, text)
    for name, sense, extreme in zip(ASKED[1:], ("min", "max"), judged.extremes[-2:], strict=True):
        checked = check.check_workspace_proof(alone(given, name), case_of(text), leg_error=given.leg_error).claims[0]
        assert (checked.name, checked.sense) == (name, sense) == (extreme.name, extreme.sense.value)
        assert checked.bound == pytest.approx(extreme.bound, rel=1e-5)
        assert "wrong" in reject(name, sense, bound=extreme.reached * (1.01 if sense == "min" else 0.99))
    # Without a length of legs above the errors nothing is known of other machines, and none of the two is proved.
    case = case_of()
    subject = Subject(case, case.model, pose_box(judged.workspace), legs_of(case))
    for extreme in asked_spectra_extremes(subject, ASKED[1:], gap=0.1):
        assert (extreme.outcome, "too large" in extreme.reason) == (Outcome.OPEN, True)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "gap"), [("hexapod-linuxcnc", "0.02"), ("hexapod-workspace", "0.01")])
def test_shipped_workspaces_of_machines_as_they_are_built_are_accepted(
    cli: Run, tmp_path: Path, name: str, gap: str
) -> None:
    case, result, target = tmp_path / "case.toml", tmp_path / "result.json", tmp_path / "proof.json"
    text = (Path(screwsynth.cases.__file__).parent / f"{name}.toml").read_text(encoding="utf-8")
    case.write_text(text.replace("[[task]]", "[tolerance]\njoint_centre = 0.002\n\n[[task]]"), encoding="utf-8")
    of: tuple[str, ...] = ()
    if name == "hexapod-workspace":
        code, _, err = cli("solve", str(case), "--starts", "4", "--json", str(result))
        assert (code, err) == (0, "")
        of = ("--of", str(result))
    code, _, err = cli("workspace", str(case), *of, "--gap", gap, "--time", "200", "--proof", str(target))
    assert (code, err) == (0, "")
    code, out, err = cli("verify-proof", str(target))
    assert code == 0, err
    assert "not on paper" not in out
