"""Proofs on paper about every machine within a tolerance: what the checker accepts, and what it must reject."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Run, case_file, case_from, case_tables, edited, ends, output_of, saved, soaked, unbroken, unpacked
from casadi import SX
from hexapods import EVERY_LIMIT, HEXAPOD, case_of_legs, random_legs
from workspace_cases import (
    alone,
    changed,
    claim,
    on_paper,
    problem_of,
    rejected,
    root_of,
    stated,
    stating,
    tables_of,
    written,
)

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Judgement, Limits, Outcome, Sense, TurnKind, Turns, UncoveredError, Workspace
from screwsynth.nlp.program.layout import robot_length
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, read_proof
from screwsynth.nlp.proof.checker.workspace import check
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot
from screwsynth.nlp.proof.checker.workspace.number_claims import SecondOrderClaim, SingularClaim, change_of_jacobian
from screwsynth.nlp.proof.checker.workspace.pose_boxes import PoseRoot, pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import RankClaim, rank_claim
from screwsynth.nlp.proof.checker.workspace.statement import RobotsWithinTolerance
from screwsynth.nlp.proof.statement.fixed_robot import Legs
from screwsynth.nlp.proof.statement.tolerance import Directions, length_of_one_robot, second_order_name
from screwsynth.nlp.proof.workspace.numbers.extremes import NumberSearch
from screwsynth.nlp.proof.workspace.numbers.searched import Subject, searched_extremes
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box

TOLERANCE, LENGTH, LEG_ERROR = 0.02, 11.5, 0.004
#: A limit of every kind that errors of joint centres change; the triangle inequality does not decide that on strokes.
TEXT = edited(
    EVERY_LIMIT[: EVERY_LIMIT.index("[workspace]")],
    ("stroke_max = 30", "stroke_max = 0.93"),
    ("base_joint_angle = 80", 'base_joint_angle = { max = 30, about = "home" }'),
    ('platform_joint_angle = { max = 60, about = "home" }\n', ""),
    ("min = 0.1, length", "min = 0.5, length"),
    ("max = 30, length", "max = 10, length"),
)
TEXT += """[workspace]
position = [0.3, { min = -0.3, max = 0.3 }, 20]
rotation = { axis = [0.6, 0, 0.8], angle = { min = -2, max = 2 } }
"""
ASKED = ("platform_joint_angle", "smallest_singular_value", "condition_number")


def case_of(text: str = TEXT) -> Case:
    return case_from(text, "machine")


@pytest.fixture(scope="module")
def both() -> tuple[Judgement, Proof]:
    return written(case_of(), TEXT, quantities=ASKED, leg_error=LEG_ERROR, gap=0.1, jobs=1)


@pytest.fixture(scope="module")
def proof(both: tuple[Judgement, Proof]) -> Proof:
    return both[1]


def test_claims_of_every_kind_about_every_machine_hold(both: tuple[Judgement, Proof]) -> None:
    judged, proof = both
    assert judged.is_proved
    assert not proof.unproved
    assert stated(proof).joint_centre == TOLERANCE
    assert unpacked(read_proof(proof.as_text(), "again")) == proof
    # Of one leg, or of one pair of legs, and one stroke that takes lengths of one machine.
    strokes = [each.name for each in proof.claims if each.reason == "one machine"]
    others = ("1+", "2-", "2+", "3-", "3+")
    kept = {each.name for each in proof.claims if not any(f" {leg}" in each.name for leg in others)}
    # Singular values and errors of the pose rest on the shortest lengths of all legs.
    kept |= {f"leg_length limb {leg}" for leg in others}
    some = alone(proof, *kept, strokes[0], "leg_clearance limbs 1- and 2+", "joint_spacing base joints 1- and 1+")
    checked = check.check_workspace_proof(some, case_of(), leg_error=stated(some).leg_error)
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


def rejections(proof: Proof, text: str = TEXT) -> Callable[..., str]:
    """The check of one claim after the other, with other values in it: a function that returns why it is rejected."""
    checker = check.WorkspaceChecker(proof, case_of(text), stated(proof).leg_error)
    expected = {each.label: each for each in checker.expected}

    def reject(name: str, sense: str, **values: Any) -> str:  # noqa: ANN401
        with pytest.raises(ProofError) as caught:
            checker.check(expected[name, sense], replace(claim(proof, name, sense), **values))
        return str(caught.value)

    return reject


def test_another_tolerance_is_rejected(proof: Proof) -> None:
    larger = TEXT.replace("joint_centre = 0.02", "joint_centre = 0.06")
    without = TEXT.replace("[tolerance]\njoint_centre = 0.02\n", "")
    for text in (larger, TEXT.replace("joint_centre = 0.02", "joint_centre = 0.01"), without):
        assert "another joint-centre tolerance" in rejected(proof, case_of(text))
    # Another number in the file is no way around: bounds are those of the machines of the case.
    longest = claim(proof, "leg_length limb 2-", "max").bound
    reject = rejections(stating(proof, joint_centre=0.06), larger)
    names = ("leg_length limb 2-", "F", "rate_share limb 1-", "base_joint_angle limb 1-", "radius_ratio")
    for name in (*names, "actuator.stroke_max limb 2+"):
        assert "its expressions or bounds differ" in reject(name, "max")
    smaller = TEXT.replace("max = 60 }", f"max = {math.sqrt(longest) - 0.01} }}", 1)
    assert "does not satisfy" in rejections(proof, smaller)("leg_length limb 2-", "max")
    reject = rejections(stating(proof, joint_centre=0.0), without)
    assert "its expressions or bounds differ" in reject("F", "max")
    assert "for robots within a joint-centre tolerance, but the case has no tolerance" in reject(
        "actuator.stroke_max limb 2+", "max"
    )


def value_of(name: str, sense: str, number: float) -> float:
    """The bound in a file that reads as a number."""
    sign = 1.0 if sense == "max" else -1.0
    kind = name.partition(" ")[0]
    if kind in ("leg_length", "actuator_rate"):
        number = number**2
    elif kind == "base_joint_angle":
        number = -math.cos(number)
    return number if kind == "leg_clearance" else sign * number


def test_bounds_that_a_machine_violates_are_rejected(both: tuple[Judgement, Proof]) -> None:
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
        assert "could not be proved" in fault or "is wrong" in fault, name


def test_other_lemmas_and_directions_are_rejected(proof: Proof) -> None:
    name, rest = "actuator.stroke_max limb 2+", claim(proof, second_order_name("F"), "max")
    smaller = replace(rest, bound=0.5 * rest.bound)
    kept = tuple(each for each in proof.lemmas if each is not rest and not each.name.startswith(name))
    assert "its expressions or bounds differ" in rejections(replace(proof, lemmas=(*kept, smaller)))("F", "max")
    reject = rejections(replace(proof, lemmas=kept))
    assert f"the proof lacks the lemma {second_order_name('F')}" in reject("F", "max")
    assert "the proof lacks the lemma" in reject(name, "max")
    reject, stroke = rejections(proof), claim(proof, name, "max")
    turned = (stroke.sides[0], (0.0, 0.6, 0.8))
    assert "its expressions or bounds differ" in reject(name, "max", sides=turned)
    assert "must state two directions" in reject(name, "max", sides=turned[:1])
    assert "cannot be proved by the reason" in reject("F", "max", reason="one machine")
    # Of no leg is a length known.
    assert "has no bound of the leg length" in reject("smallest_singular_value", "min")


def machines_of(case: Case) -> tuple[RobotsWithinTolerance, PoseRoot]:
    return RobotsWithinTolerance(case, closed_form(case.model).model, root_of(case)), root_of(case)


@pytest.mark.parametrize("robot", soaked(["hexapod", "6-rus"], ["hexapod"]))
def test_numbers_hold_for_random_machines_and_are_nearly_reached(robot: str) -> None:
    """What is shown of terms of second order is at least that of random machines, and little more."""
    turns = {"axis": [0.6, 0, 0.8], "angle": ends(2)}
    cranks = tables_of("6-rus", tolerance=1e-4, workspace={"position": [ends(0.02), 0, 1.1], "rotation": turns})
    found, root = machines_of(case_of() if robot == "hexapod" else case_from(cranks))
    rng, t, symbols = np.random.default_rng(1), found.symbols.tolerance, found.symbols
    m, count = len(symbols.built.names), 400
    reaches, claims = symbols.claims(())
    kinds = {each.name.partition(" ")[0] + each.sense.value: each for each in (*reaches, *claims) if found.varies(each)}
    assert len(kinds) == (11 if robot == "hexapod" else 3)
    errors = rng.normal(size=(count, m, 3))
    errors *= t / np.linalg.norm(errors, axis=2, keepdims=True)
    varying = np.flatnonzero(root.upper > root.lower)
    pose = rng.uniform(root.lower, root.upper, (count, 6))[:, varying]
    e, z = SX.sym("e", 3 * m), SX.sym("z", len(varying))
    for each in kinds.values():
        sign = 1.0 if each.sense is Sense.MAX else -1.0
        number, none = symbols.of(each.expression, e, z), SX.zeros(3 * m)
        first = ca.jacobian(number, e)
        function = ca.Function("both", [e, z], [number, ca.densify(first)])
        exact, slopes = (np.array(part) for part in function(np.zeros((3 * m, count)), pose.T))
        slopes = slopes.reshape(count, 3 * m)
        steep = sign * slopes.reshape(count, m, 3)
        steep = t * steep / np.maximum(np.linalg.norm(steep, axis=2, keepdims=True), 1e-300)
        bound = ca.Function("bound", [found.design.table.variables_vector], [found.number(each, 0.0)])
        most, largest = np.array(bound(pose.T)).ravel(), 0.0
        for moved in (errors, steep):
            flat = moved.reshape(count, -1)
            values = np.array(function(flat.T, pose.T)[0]).ravel()
            terms = np.abs(values - exact.ravel() - (slopes * flat).sum(axis=1))
            largest = max(largest, float(terms.max()))
            assert (sign * (most - values) >= -terms - 1e-13 * np.abs(values)).all()
        # To first order the steep machine is the worst one.
        change = np.maximum(sign * (most - exact.ravel()), 1e-300)
        assert (sign * (values - exact.ravel()) / change).max() > 0.95, each.name
        claimed = SecondOrderClaim(found, each.expression, 0.9 * largest)
        assert not claimed.attempt(root.lower[None], root.upper[None]).holds[0]
        points = np.repeat((0.5 * root.lower + 0.5 * root.upper)[None], 2, axis=0)
        assert SecondOrderClaim(found, each.expression, 30 * largest).attempt(*points[:, None]).holds[0], each.name
        assert none.numel() == 3 * m


def test_a_number_with_a_kink_has_no_terms_of_second_order() -> None:
    found, _ = machines_of(case_of())
    (some,) = (each for each in found.symbols.claims(())[1] if (each.name, each.sense) == ("F", Sense.MAX))
    for kink in (ca.fabs(some.expression - 1), ca.fmax(some.expression, 1)):
        with pytest.raises(UncoveredError, match="jump"):
            SecondOrderClaim(found, kink, 1e9)


def test_lengths_of_one_machine_hold_at_two_poses() -> None:
    found, root = machines_of(case_of())
    rng, symbols, t = np.random.default_rng(2), found.symbols, found.symbols.tolerance
    free = np.flatnonzero(root.upper > root.lower)
    poses = rng.uniform(root.lower, root.upper, (2, 6))[:, free]
    errors = rng.normal(size=(2000, 12, 3))
    errors *= t / np.linalg.norm(errors, axis=2, keepdims=True)
    for i, leg in enumerate(symbols.layout.robots[0].legs):
        span = ca.Function("span", [symbols.errors, symbols.pose], [symbols.of(leg.span, symbols.errors, symbols.pose)])
        n = [np.array(span(np.zeros(36), each)).ravel() for each in poses]
        length = [float(np.linalg.norm(each)) for each in n]
        base = 0.5 * (n[0] / length[0] + n[1] / length[1])
        # The rotations are small: one direction serves both frames.
        about = Directions("stroke", base, base)
        bounds = []
        for sense, pose in zip((Sense.MAX, Sense.MIN), poses, strict=True):
            one = length_of_one_robot(symbols, i, sense, about)
            rest = 4 * t**2 / min(length)
            assert SecondOrderClaim(found, one.expression, rest).attempt(root.lower[None], root.upper[None]).holds[0]
            value = ca.Function("value", [found.design.table.variables_vector], [found.number(one, rest)])
            bounds.append(float(value(pose)))
        lengths = [
            np.linalg.norm(np.array(span(errors.reshape(2000, -1).T, np.tile(each[:, None], 2000))), axis=0)
            for each in poses
        ]
        assert (lengths[0] - lengths[1]).max() <= bounds[0] - bounds[1] < length[0] - length[1] + 2 * t


class Machine:
    """A random hexapod at a random pose of a workspace, and machines within a tolerance of it."""

    WORKSPACE = Workspace(
        (Free(-3.0, 3.0), Free(-3.0, 3.0), Free(9.0, 15.0)), Turns(TurnKind.ANY_AXIS, (Free(-0.4, 0.4),))
    )

    def __init__(self, seed: int, tolerance: float, count: int) -> None:
        rng = np.random.default_rng(seed)
        self.exact, box = random_legs(rng, tolerance), pose_box(self.WORKSPACE)
        base, platform, _ = self.exact
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


def regular(legs: Legs, root: PoseRoot, tolerance: float = 0.0) -> RankClaim:
    return rank_claim(case_of_legs(legs), HEXAPOD, root, "regular", tolerance)


def test_changes_of_rows_hold_those_of_machines() -> None:
    rng = np.random.default_rng(3)
    for kind in TurnKind:
        angle = Free(-0.5, 0.5)
        turns = Turns(kind, (angle,) * (3 if kind is TurnKind.ROLL_PITCH_YAW else 1), (0.6, 0.0, 0.8))
        workspace = replace(Machine.WORKSPACE, turns=turns)
        root, box = pose_root(workspace), pose_box(workspace)
        some, t = Machine(5, 0.3, 1), 0.3
        lower = rng.uniform(root.lower, root.upper, (40, 6))
        upper = np.minimum(lower + 1e-3 * (root.upper - root.lower), root.upper)
        claims = [regular(some.exact, root, each) for each in (0.0, t)]
        without, bound = (each._matrices(each.closed(lower, upper)).E for each in claims)
        y = lower + rng.uniform(size=lower.shape) * (upper - lower)
        R, p = box.rotations(y), y[:, :3]
        squares = 1 + y[:, 3:] ** 2
        scale = {TurnKind.AXIS: squares[:, 0], TurnKind.ROLL_PITCH_YAW: squares.prod(axis=1)}
        s = scale.get(kind, squares.sum(axis=1) - 2)[:, None, None]
        case = case_of_legs(some.exact)
        length = robot_length(case)

        def rows(base: FloatArray, arm: FloatArray) -> FloatArray:
            """The rows of machines at the poses, times the scale."""
            d = p[:, None] - base  # noqa: B023
            return np.asarray(s * np.concatenate([d + arm, np.cross(arm, d) / length], axis=2))  # noqa: B023

        arm = some.exact.platform @ R.transpose(0, 2, 1)
        exact, most = rows(some.exact.base, arm), np.zeros_like(bound)
        for _ in range(200):
            e, f = rng.normal(size=(2, 6, 3))
            e, f = (t * each / np.linalg.norm(each, axis=1, keepdims=True) for each in (e, f))
            most = np.maximum(most, np.abs(rows(some.exact.base + e, arm + f) - exact))
        assert (most <= bound * (1 + 1e-9)).all()
        # A bound that is smaller by three tenths would not hold: the test can fail.
        assert ((most > 0.7 * (bound - without)).any(axis=0)).all()


def test_no_claim_is_shown_where_a_machine_violates_it() -> None:
    root, t, shown, kept, singular = pose_root(Machine.WORKSPACE), 0.1, 0, 0, 0
    for seed in range(30):
        some = Machine(seed, t, 800)
        at, robot = (some.y[None], some.y[None]), PosedRobot(case_of_legs(some.exact), HEXAPOD, root)
        values = np.linalg.svd(some.J / [1, 1, 1, LENGTH, LENGTH, LENGTH], compute_uv=False)
        least, condition = values[:, -1], values[:, 0] / values[:, -1]
        change = change_of_jacobian(some.exact, t, LENGTH, 0.999 * float(some.length[0].min()) - 2 * t)

        def holds(bound: float, *, is_condition: bool) -> bool:
            one = SingularClaim(robot, LENGTH, bound, is_condition=is_condition, change=change)  # noqa: B023
            return bool(one.attempt(*at).holds[0])  # noqa: B023

        assert not holds(least.min() * (1 + 1e-6), is_condition=False)
        assert not holds(condition.max() * (1 - 1e-6), is_condition=True)
        if least[0] > 1.5 * change:
            shown += 1
            assert holds(least[0] - 1.01 * change, is_condition=False)
            assert holds((values[0, 0] + change) / (least[0] - change) * 1.02, is_condition=True)
        signs = np.sign(np.linalg.det(some.J))
        is_singular = bool((signs != signs[0]).any())
        is_regular = bool(regular(some.exact, root, t).attempt(*at).holds[0])
        assert not (is_regular and is_singular)
        # Without the errors' part it would be claimed of machines, some of which are singular: the test can fail.
        assert regular(some.exact, root).attempt(*at).holds[0]
        kept, singular = kept + is_regular, singular + is_singular
    assert min(shown, kept, singular) > 4


def test_a_singular_machine_within_the_tolerance_is_on_paper() -> None:
    head = TEXT[: TEXT.index("[limits]")].replace("joint_centre = 0.02", "joint_centre = 0.8")
    text = head + "[workspace]\nposition = [{min=-5,max=5}, {min=-5,max=5}, {min=15,max=25}]\n"
    text += "rotation = {angle={min=-30,max=30}}\n"
    judged, given = on_paper(case_of(text), text, gap=0.02, jobs=1, with_limits=False)
    assert judged.regularity.errors is not None
    (found,) = check.check_workspace_proof(given, case_of(text)).claims
    assert found.is_refuted
    assert found.is_within_tolerance
    design, machine = claim(given, "regular").sides
    assert design == (*machine[:6], *[0.0] * 36)
    for sides, fault in (
        ((design, design), "not have opposite signs"),
        (
            (design, (*machine[:6], *(2.0 * part for part in machine[6:]))),
            "a joint-centre error that the proof states exceeds the tolerance",
        ),
        ((design, (*[9.0] * 6, *machine[6:])), "outside the workspace"),
        ((design, machine[:-3]), "must state two poses"),
        ((design[:6], machine), "must state two poses"),
    ):
        assert fault in rejected(changed(given, "regular", sides=sides), case_of(text))
    smaller = text.replace("joint_centre = 0.8", "joint_centre = 0.1")
    assert "a joint-centre error that the proof states exceeds the tolerance" in rejected(
        stating(given, joint_centre=0.1), case_of(smaller)
    )


def test_the_commands_say_which_machines_a_proof_is_about(cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "proof.json"
    head, _, tail = TEXT.partition("actuator =")
    file = saved(tmp_path / "machine.toml", head + tail[tail.index("[workspace]") :])
    output_of(cli("workspace", str(file), "--gap", "0.3", "--proof", str(target)))
    out = unbroken(output_of(cli("verify-proof", str(target), str(file))))
    assert "for every robot whose joint centres are off by at most 0.02 in" in out
    content = json.loads(target.read_text(encoding="utf-8"))
    content["case"] = edited(content["case"], ("joint_centre = 0.02", "joint_centre = 0.002"))
    code, _, err = cli("verify-proof", str(saved(target, json.dumps(content))))
    assert code == 1
    assert err.startswith("rejected: the proof is for another joint-centre tolerance")


def test_asked_singular_values_of_the_exact_machine_are_on_paper() -> None:
    head, _, tail = TEXT.replace("[tolerance]\njoint_centre = 0.02\n", "").partition("actuator =")
    text = head + tail[tail.index("[workspace]") :]
    judged, given = written(case_of(text), text, quantities=ASKED[1:], gap=0.02, jobs=1, with_objective=False)
    reject = rejections(given, text)
    for name, sense, extreme in zip(ASKED[1:], ("min", "max"), judged.extremes[-2:], strict=True):
        checked = check.check_workspace_proof(alone(given, name), case_of(text)).claims[0]
        assert (checked.name, checked.sense) == (name, sense) == (extreme.name, extreme.sense.value)
        assert checked.bound == pytest.approx(extreme.bound, rel=1e-5)
        assert "could not be proved" in reject(name, sense, bound=extreme.reached * (1.01 if sense == "min" else 0.99))
    # Without a length of legs above the errors nothing is known of other machines, and none of the two is proved.
    case = case_of()
    subject = Subject(case, case.model, problem_of(case))
    for extreme in searched_extremes(
        replace(subject, case=replace(case, limits=Limits())), ASKED[1:], NumberSearch(0.1)
    ):
        assert (extreme.outcome, "too large" in extreme.reason) == (Outcome.OPEN, True)


@pytest.mark.slow
def test_the_shipped_machine_as_it_is_built_is_accepted(cli: Run, tmp_path: Path) -> None:
    case = case_file(tmp_path, case_tables("hexapod-linuxcnc", tolerance={"joint_centre": 0.002}))
    target = tmp_path / "proof.json"
    output_of(cli("workspace", str(case), "--gap", "0.2", "--time", "200", "--proof", str(target)))
    assert "no proof" not in output_of(cli("verify-proof", str(target)))
