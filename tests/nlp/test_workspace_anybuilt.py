"""Machines as they are built of robots that are not six straight legs: bounds beside sampled machines.

Sampled machines are computed from geometry alone: from joint centres, cranks, rods and hinges, and not from the
project's models.
"""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import jsonschema
import numpy as np
import pytest
from builders import Run, case_file, case_from, output_of, refusal_of, soaked
from hexapods import singular_part
from path_cases import turns_of
from workspace_cases import ROBOTS, box_of, on_paper, problem_of, rank_of, root_of, tables_of, written

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, CaseError, Outcome, Sense, build_model, json_data, judge_workspace
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.enclosure.forms import Forms
from screwsynth.nlp.proof.statement.fixed_robot import Legs, joint_centres
from screwsynth.nlp.proof.statement.tolerance import built_model, is_smooth
from screwsynth.nlp.proof.workspace.numbers import expressions
from screwsynth.nlp.proof.workspace.numbers import within_tolerance as tolerance
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal, smallest_values
from screwsynth.nlp.proof.workspace.numbers.extremes import NumberSearch
from screwsynth.nlp.proof.workspace.numbers.within_tolerance import RobotsWithinTolerance
from screwsynth.nlp.proof.workspace.ranks import rank_rule as rank
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner, LoopBoxes
from screwsynth.nlp.proof.workspace.ranks.singular_pose import SingularPose
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.results.workspace import workspace_of

TWIST_AXIS, TWIST_POINT, PITCH = np.array([1.0, 2.0, 6.0]), np.array([0.3, 0.1, 1.2]), 0.1
#: Number of sampled machines, and of them with errors along the derivatives of the number.
COUNT, STEEP = 20_000, 256


def machines(case: Case) -> RobotsWithinTolerance:
    closed = closed_form(case.model)
    return RobotsWithinTolerance(case, closed, problem_of(case))


def turned(a: FloatArray, angles: FloatArray) -> FloatArray:
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * a[0] - s * a[1], s * a[0] + c * a[1], np.full_like(c, a[2])], axis=-1)


OMEGA = TWIST_AXIS / np.linalg.norm(TWIST_AXIS)


def velocity(points: FloatArray) -> FloatArray:
    return PITCH * OMEGA + np.cross(OMEGA, points - TWIST_POINT)


def three_upu(y: FloatArray, errors: FloatArray) -> FloatArray:
    """Limbs between circles, with the first upper axes radial; each with a force along it and a couple."""
    R, p = turns_of(y[:, 3:]), y[:, :3]
    radial = turned(np.array([1.0, 0.0, 0.0]), np.arange(3) * 2 * math.pi / 3)
    base, platform = radial + errors[:, ::2], 0.6 * radial + errors[:, 1::2]
    d = p[:, None] + np.einsum("kij,klj->kli", R, platform) - base
    length = np.linalg.norm(d, axis=2)
    n, u = d / length[:, :, None], np.einsum("kij,lj->kli", R, radial)
    couple = n - u * (u * n).sum(axis=2, keepdims=True)
    couple /= np.linalg.norm(couple, axis=2, keepdims=True)
    rates = (velocity(base) * n).sum(axis=2)
    F = (rates**2).sum(axis=1) + ((0.5 * couple @ OMEGA) ** 2).sum(axis=1)
    return np.stack([length[:, 1], np.arccos(n[:, 0, 2]), np.abs(rates[:, 2]), F], axis=1)


def six_rus(y: FloatArray, errors: FloatArray) -> FloatArray:
    """Cranks about hinges, each with a rod to the platform; centres of a limb: hinge, crank's end, ball."""
    R, p = turns_of(y[:, 3:]), y[:, :3]
    home = np.array([0.0, 0.0, 1.1])
    angles, F = [], np.zeros(len(y))
    for i in range(6):
        side, turn = (-1.0 if i < 3 else 1.0), np.array([(i % 3) * 2 * math.pi / 3])
        half, out, lift = math.radians(20), math.radians(43), math.radians(35)
        b = np.array([math.cos(half), side * math.sin(half), 0.0])
        e = b + 0.35 * np.array([math.cos(lift), 0.0, math.sin(lift)])
        a = np.array([0.6 * math.cos(out), side * 0.6 * math.sin(out), 1.1])
        B, E, A = (turned(each, turn)[0] + errors[:, 3 * i + k] for k, each in enumerate((b, e, a)))
        axis = turned(np.array([0.0, 1.0, 0.0]), turn)[0]
        crank, rod = E - B, np.linalg.norm(A - E, axis=1)
        along = axis * (crank @ axis)[:, None]
        x, z = crank - along, np.cross(axis, crank)
        ball = p + np.einsum("kij,kj->ki", R, A - home)
        g = ball - B - along
        # |g - x cos q - z sin q| is the rod's length; the branch is that of q = 0 at home.
        c, s = (x * g).sum(axis=1), (z * g).sum(axis=1)
        k = ((g * g).sum(axis=1) + (x * x).sum(axis=1) - rod**2) / 2
        middle, reach = np.arctan2(s, c), np.arccos(k / np.hypot(c, s))
        q = np.stack([middle - reach, middle + reach])
        q = np.where(np.abs(q[0]) < np.abs(q[1]), q[0], q[1])
        n = (g - x * np.cos(q)[:, None] - z * np.sin(q)[:, None]) / rod[:, None]
        F += (velocity(ball) * n).sum(axis=1) ** 2
        angles.append(q)
    return np.stack([angles[0], angles[4], F], axis=1)


def three_rps(y: FloatArray, errors: FloatArray) -> FloatArray:
    """Hinges, slides and balls: x, y and yaw follow. A limb resists all motions of its ball but that of its hinge."""
    turns = np.arange(3) * 2 * math.pi / 3
    B0, A0 = turned(np.array([1.0, 0.0, 0.0]), turns), turned(np.array([0.6, 0.0, 1.1]), turns)
    axis, home = turned(np.array([0.0, 1.0, 0.0]), turns), np.array([0.0, 0.0, 1.1])
    # The error along a hinge's axis does not matter.
    B = B0 + errors[:, ::2] - axis * (errors[:, ::2] * axis).sum(axis=2, keepdims=True)
    A = A0 + errors[:, 1::2]
    offset = ((A - B) * axis).sum(axis=2)
    y = y.copy()
    y[:, [0, 1, 5]] = 0.0
    for _ in range(8):
        R = turns_of(y[:, 3:])
        arm = np.einsum("kij,klj->kli", R, A - home)
        residual = ((y[:, None, :3] + arm - B) * axis).sum(axis=2) - offset
        spun = np.cross(np.array([0.0, 0.0, 1.0]), arm)
        slopes = np.stack(
            [np.tile(axis[:, 0], (len(y), 1)), np.tile(axis[:, 1], (len(y), 1)), (spun * axis).sum(axis=2)], axis=2
        )
        y[:, [0, 1, 5]] -= np.linalg.solve(slopes, residual[:, :, None])[:, :, 0]
    assert np.abs(residual).max() < 1e-12
    ball = y[:, None, :3] + arm
    span, at_home = ball - B, A - B
    way = np.cross(axis, span)
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    w = velocity(ball)
    F = ((w * w).sum(axis=2) - (w * way).sum(axis=2) ** 2).sum(axis=1)
    # The slide keeps the direction of the design in the turned limb, and its distance from the hinge's axis.
    slide = (A0 - B0) / np.linalg.norm(A0 - B0, axis=1, keepdims=True)
    across = np.cross(axis, slide)
    apart = (at_home * across).sum(axis=2)
    radius = (span * span).sum(axis=2) - offset**2
    length = np.sqrt(radius - apart**2) - (at_home * slide).sum(axis=2)
    return np.stack([length[:, 0], length[:, 1], F], axis=1)


class Sampled(NamedTuple):
    """Numbers (K, names) of robots, from poses (K, 6) of position, roll, pitch and yaw, and errors (K, centres, 3)."""

    values: Callable[[FloatArray, FloatArray], FloatArray]
    centres: int
    names: tuple[str, ...]


SAMPLED = {
    "3-rps": Sampled(three_rps, 6, ("actuator_length limb 1", "actuator_length limb 2", "F")),
    "6-rus": Sampled(six_rus, 18, ("actuator_angle limb 1", "actuator_angle limb 5", "F")),
    "three-upu": Sampled(
        three_upu, 6, ("leg_length limb 2", "base_joint_angle limb 1", "actuator_rate actuator 3", "F")
    ),
}


def samples(robot: Sampled, box: PoseBox, tolerance: float, more: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return numbers of machines at poses, and of the design at these poses, (K, numbers) each.

    Half of the poses are at ends of their ranges, and some (P, 6) are given. Errors are random, and at the given and
    some other poses along the derivatives.
    """
    rng = np.random.default_rng(0)
    lower, upper = (np.concatenate([end[:3], 2 * np.arctan(end[3:])]) for end in (box.lower, box.upper))
    y = rng.uniform(lower, upper, (COUNT, 6))
    ends = np.where(rng.uniform(size=y.shape) < 0.5, lower, upper)
    y[::2] = np.where(rng.uniform(size=y.shape) < 0.8, ends, y)[::2]
    y[:64] = lower + np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T * (upper - lower)
    y[64 : 64 + len(more), :3] = more[:, :3]
    y[64 : 64 + len(more), 3:] = 2 * np.arctan(more[:, 3:])
    errors = rng.normal(size=(COUNT, robot.centres, 3))
    errors *= tolerance / np.linalg.norm(errors, axis=2, keepdims=True)
    at = np.tile(y[:STEEP], (3 * robot.centres, 1))
    small = np.repeat(np.eye(3 * robot.centres), STEEP, axis=0).reshape(len(at), -1, 3) * 1e-6
    slopes = (robot.values(at, small) - robot.values(at, -small)) / 2e-6
    slopes = slopes.reshape(robot.centres, 3, STEEP, -1)
    rows = [(y, errors)]
    for k in range(slopes.shape[3]):
        along = slopes[..., k].transpose(2, 0, 1)
        along = tolerance * along / np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-12)
        rows += [(y[:STEEP], along), (y[:STEEP], -along)]
    y, errors = (np.concatenate(each) for each in zip(*rows, strict=True))
    return robot.values(y, errors), robot.values(y, np.zeros_like(errors))


def ratios(name: str, gap: float = 1e-4, only: tuple[str, ...] | None = None) -> dict[tuple[str, Sense], float]:
    """Return the change that is proved in parts of the largest sampled one; below 1 where a sample is outside."""
    case, robot = case_from(tables_of(name)), SAMPLED[name]
    found = machines(case)
    every = found.symbols.claims([each.name for each in found.built.model.quantities])[1]
    bounds = [found.extreme(each, NumberSearch(gap, 1)) for each in every if each.name in (only or robot.names)]
    box = found.family.problem.box
    poses = np.array([box.coordinates(each.pose) for each in bounds if each.pose is not None])
    built, exact = samples(robot, box, found.family.tolerance, poses)
    result = {}
    for each in bounds:
        k, sign = robot.names.index(each.name), 1.0 if each.sense is Sense.MAX else -1.0
        design = (sign * exact[:, k]).max()
        result[each.name, each.sense] = (sign * each.bound - design) / ((sign * built[:, k]).max() - design)
    return result


@pytest.mark.parametrize("name", soaked(["three-upu", "3-rps", "6-rus"], ["three-upu", "3-rps"]))
def test_no_sampled_machine_is_outside_of_the_bounds_which_are_near_to_the_worst(name: str) -> None:
    only = {"3-rps": ("actuator_length limb 2", "F"), "6-rus": ("actuator_angle limb 5", "F")}.get(name)
    found = ratios(name, 5e-4 if only else 1e-4, only)
    assert len(found) >= 4
    assert min(found.values()) >= 1.0, found
    assert max(found.values()) <= 1.5, found


def test_terms_of_errors_that_are_too_small_are_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    spread = expressions.by_centres
    monkeypatch.setattr(tolerance, "_OUTWARDS", 0.8)
    monkeypatch.setattr(expressions, "by_centres", lambda slopes: 0.8 * spread(slopes))
    for name, number in (("three-upu", "leg_length limb 2"), ("3-rps", "actuator_length limb 1")):
        assert max(ratios(name, 1e-5, (number,)).values()) < 1.0


def test_errors_that_do_not_matter_are_zero_without_a_sign() -> None:
    family = machines(case_from(tables_of("3-rps"))).family
    free = family.z[family.problem.independent[0]]
    (found,) = smallest_values(expressions.Expressions(family, free - family.errors[2]), [Goal(part=0.1)])
    errors = family.errors_of(found.at).vectors
    assert errors[0, 2] == pytest.approx(1e-3, rel=1e-9)
    assert np.count_nonzero(errors) == 1
    assert not np.signbit(errors).any()


def wrong_boxes(name: str, tolerance: float) -> tuple[int, int]:
    """Count boxes that are said to be regular for all machines, and those of them in which a machine says otherwise.

    With C a pseudo-inverse of the matrix of the design at the middle of a box, the determinant of C M is positive for
    every machine in a box that is regular for the reason of the search.
    """
    family = machines(replace(case_from(tables_of(name)), joint_centre_tolerance=tolerance)).family
    problem, rng = family.problem, np.random.default_rng(0)
    examiner = Examiner(family, rank.RankTest(family.locked, family.z, family.start))
    own, n, count = list(problem.independent), len(problem.start), 64
    middle = problem.box.random(count, rng)[:, list(problem.free)][:, own]
    lower, upper = np.full((2, count, len(family.start)), tolerance)
    lower[:, n:] = -tolerance
    lower[:, :n] = upper[:, :n] = np.nan
    half = rng.uniform(0, 0.3, (count, 1)) * problem.size[own]
    lower[:, own], upper[:, own] = middle - half, middle + half
    cells = LoopBoxes(lower, upper, np.tile(family.start, (count, 1)), np.full(count, not problem.dependent))
    found = examiner.examine(cells)
    loops, newton = family.loops, SingularPose(family, family.locked)
    M = ca.Function("M", [family.z], [ca.densify(family.locked.matrix)])
    wrong = 0
    for k in np.flatnonzero(found.is_regular):
        z = found.boxes.centre[k].copy()
        design = loops.all_closed(z[:, None], problem.dependent)[:, 0]
        assert np.isfinite(design).all()
        C = np.linalg.pinv(M(design).full())
        slopes = newton.slopes(design)
        steep = -slopes[n:].reshape(-1, 3)
        for errors in (steep, *rng.normal(size=(3, *steep.shape))):
            z[n:] = (tolerance * errors / np.maximum(np.linalg.norm(errors, axis=1, keepdims=True), 1e-12)).ravel()
            machine = loops.all_closed(z[:, None], problem.dependent)[:, 0]
            wrong += bool(np.isfinite(machine).all()) and not float(np.linalg.det(C @ M(machine).full())) > 0
    return int(found.is_regular.sum()), wrong


def test_no_box_is_regular_for_all_machines_in_which_one_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("3-rps", "6-ups"):
        boxes, wrong = wrong_boxes(name, 0.01)
        assert boxes >= 32
        assert not wrong
    # Without the part of the errors boxes are said to be regular in which a machine is not.
    examine = rank.RankTest.examine

    def without(self: rank.RankTest, forms: Forms, f: int, errors: int) -> rank.Tested:
        known = forms.a.shape[2] - errors
        return examine(self, Forms(forms.c, forms.a[:, :, :known], np.zeros_like(forms.r)), f, 0)

    monkeypatch.setattr(rank.RankTest, "examine", without)
    assert wrong_boxes("6-ups", 0.4)[1]


def wrongly_shown(name: str, tolerance: float, covered: float) -> tuple[int, int]:
    """As :func:`wrong_boxes` of the boxes that the check shows for machines within another tolerance."""
    case = replace(case_from(tables_of(name)), joint_centre_tolerance=tolerance)
    root, built, rng = root_of(case), built_model(case.model), np.random.default_rng(0)
    claim = rank_of(case, covered, built)
    centre, half = rng.uniform(root.lower, root.upper, (32, 6)), rng.uniform(0, 0.15, (32, 1))
    lower = np.maximum(centre - half * (root.upper - root.lower), root.lower)
    upper = np.minimum(centre + half * (root.upper - root.lower), root.upper)
    good, assembly, wrong = claim.attempt(lower, upper).holds, claim.assembly, 0

    def matrices(z: FloatArray) -> FloatArray:
        at = z[:, assembly.independent]
        return np.asarray(claim._matrices(assembly.enclosed(at, at, z))[0])

    rows = np.flatnonzero(good)
    if rows.size:
        design = claim.closed(lower[rows], upper[rows]).near
        C = np.linalg.pinv(matrices(design))
        for _ in range(8):
            errors = rng.normal(size=(len(rows), len(built.names), 3))
            errors *= tolerance / np.linalg.norm(errors, axis=2, keepdims=True)
            y = rng.uniform(lower[rows], upper[rows])[:, claim.free]
            machine = assembly.moved(design, np.hstack([y, errors.reshape(len(rows), -1)]))
            assert np.isfinite(machine).all()
            wrong += int((np.linalg.det(C @ matrices(machine)) <= 0).sum())
    return len(rows), wrong


def test_no_box_is_shown_to_be_regular_for_all_machines_in_which_one_is_not() -> None:
    for name, t in (("3-rps", 0.01), ("6-ups", 0.005)):
        boxes, wrong = wrongly_shown(name, t, t)
        assert boxes >= 16, name
        assert not wrong
    # Of smaller errors more is shown than holds for these machines.
    assert wrongly_shown("6-ups", 0.4, 1e-6)[1]


def test_ranks_and_numbers_of_machines_are_on_paper() -> None:
    """A robot with closed forms has all claims on paper, and one with loops that are followed."""
    for name, count in (("6-rus", 9), ("3-rps", 10)):
        case = case_from(tables_of(name, 0.01, 1e-4, 0.5, 1e-5), name)
        judged, proof = on_paper(case, gap=0.3, jobs=1)
        assert judged.is_proved
        checked = check_workspace_proof(proof, case)
        assert len(checked.claims) == count, [each.name for each in checked.claims]
        assert {"all robots within the tolerance" in each.reason for each in proof.unproved} <= {True}
        extremes = {(each.name, each.sense.value): each for each in judged.extremes}
        for each in checked.claims:
            if each.bound is not None:
                sign = 1.0 if each.sense == "max" else -1.0
                assert sign * (each.bound - extremes[each.name, each.sense].reached) >= 0, each.name


def test_a_limit_that_one_machine_violates_is_refuted_by_it() -> None:
    largest = 0.0694
    case = case_from(tables_of("3-rps", limits={"joint": {"1:2": {"max": largest}}}), "3-rps")
    finer = judge_workspace(replace(case, joint_centre_tolerance=1e-6), gap=0.05, with_objective=False)
    assert finer.is_proved
    judged = judge_workspace(case, quantities=["smallest_singular_value"], gap=0.05, with_objective=False)
    (found,) = (each for each in judged.extremes if each.key and not each.key.startswith("workspace."))
    assert judged.is_regular
    assert found.outcome is Outcome.REFUTED
    assert found.pose is not None
    errors = found.errors.vectors
    assert np.linalg.norm(errors, axis=1).max() <= 1e-3
    assert found.errors.names == ("1:1", "1:3", "2:1", "2:3", "3:1", "3:3")
    y = box_of(case).coordinates(found.pose)
    y[3:] = 2 * np.arctan(y[3:])
    value = three_rps(y[None], errors[None])[0, 0]
    assert value > largest
    assert value == pytest.approx(found.reached, abs=1e-9)
    data = json_data(workspace_of(judged))
    jsonschema.validate(json.loads(json.dumps(data)), result_schema())
    assert '"joint": "1:1"' in json.dumps(data)


@pytest.mark.parametrize("asked", ["smallest_singular_value", "condition_number"])
def test_singular_values_of_couples_have_the_characteristic_length(asked: str) -> None:
    """Rows are force and couple of each limb; a couple counts as the case says, not as 1."""
    limit = {"max": 9} if asked[0] == "c" else {"min": 0.1}
    limits = {"actuator_rate": {"max": 5}, asked: limit | {"length": 0.4}}
    tables = tables_of("three-upu", limits=limits, tolerance=0)
    tables["robot"]["axes"] = "tsai"
    case = case_from(tables)
    judged = judge_workspace(case, with_objective=False, gap=0.1)
    (found,) = (each for each in judged.extremes if each.name == asked)
    assert found.pose is not None
    third = 2 * np.pi / 3 * np.arange(3)
    radial = np.stack([np.cos(third), np.sin(third), 0 * third], axis=1)
    arms, u = (each @ found.pose.rotation.T for each in (0.6 * radial, np.cross([0, 0, 1.0], radial)))
    s = found.pose.position + arms - radial
    s /= np.linalg.norm(s, axis=1)[:, None]
    couples = s - u * (u * s).sum(axis=1)[:, None]
    couples *= 0.5 / np.linalg.norm(couples, axis=1)[:, None]
    J = np.block([[s, np.cross(arms, s) / 0.4], [np.zeros((3, 3)), couples / 0.4]])
    values = np.linalg.svd(J, compute_uv=False)
    assert found.reached == pytest.approx(values[0] / values[-1] if asked[0] == "c" else values[-1], rel=1e-9)


def test_a_machine_far_off_is_singular() -> None:
    robot = {"model": "6-ups", "parameters": ROBOTS["6-ups"] | {"h": 0.8}}
    case = case_from(tables_of("6-ups", tolerance=0.2, robot=robot, height=0.8))
    judged, proof = written(case, with_limits=False)
    found = judged.regularity
    assert found.outcome is Outcome.REFUTED
    assert np.linalg.norm(found.errors.vectors, axis=1).max() <= 0.2
    (checked,) = check_workspace_proof(proof, case).claims
    assert checked.is_refuted
    turns, side = 2 * math.pi / 3 * (np.arange(6) % 3), np.repeat([-1.0, 1.0], 3)
    plates = []
    for radius, half in ((1.0, math.radians(60)), (0.45, math.radians(5))):
        angles = turns + side * half
        plates.append(radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1))
    robot = Legs(plates[0] + found.errors.vectors[::2], plates[1] + found.errors.vectors[1::2])
    assert singular_part(robot, found.pose) < 1e-8


def test_what_is_not_covered_is_open_with_the_reason() -> None:
    def typical(name: str, unit: Callable[[float], float] = float) -> dict[str, Any]:
        return {
            "model": name,
            "parameters": {each.name: unit(each.typical[0]) for each in build_model(name).parameters},
        }

    tables = tables_of("3-rps", robot=typical("spherical-3-rrr", math.degrees), pose={"position": [0, 0, 0]})
    tables["workspace"]["position"] = [0, 0, 0]
    judged = judge_workspace(case_from(tables, "spherical"), with_objective=False)
    assert judged.regularity.outcome is Outcome.OPEN
    assert "remove degrees of freedom" in judged.regularity.reason
    assert judged.extremes
    assert all(each.outcome is Outcome.OPEN for each in judged.extremes)
    assert all("remove degrees of freedom" in each.reason for each in judged.extremes)
    # With errors a Delta that is held without rotation would have to turn.
    delta = tables_of("3-rps", turn=0, robot=typical("delta"), height=build_model("delta").home[2])
    delta["workspace"]["position"][2] = build_model("delta").home[2]
    found = judge_workspace(case_from(delta, "delta"), with_limits=False).regularity
    assert found.outcome is Outcome.OPEN
    assert "does not reach the poses" in found.reason
    del tables["workspace"]
    with pytest.raises(CaseError, match=r"tolerance.joint_centre: is not supported for the robot 'spherical-3-rrr'"):
        case_from(tables, "spherical")


def test_clearance_and_strokes_of_three_legs_hold_for_every_machine() -> None:
    """The distance of two legs, and a stroke, against machines with random errors at random poses."""
    limits = {"leg_clearance": {"min": 0.01}, "actuator": {"stroke_max": 0.5}, "actuator_rate": {"max": 5}}
    case = case_from(tables_of("three-upu", limits=limits))
    bounds = []
    for each in (case, replace(case, joint_centre_tolerance=None)):
        judged = judge_workspace(each, with_objective=False)
        found = {one.name: one for one in judged.extremes if one.key.startswith(("leg_clearance", "actuator."))}
        assert len(found) == 6
        assert {one.outcome for one in found.values()} == {Outcome.PROVED}
        bounds.append(found)
        robot, box, rng = joint_centres(each), box_of(each), np.random.default_rng(3)
        points = box.random(300, rng)
        for _ in range(20):
            errors = [rng.normal(size=(3, 3)) for _ in range(2)]
            errors = [robot.tolerance * part / np.linalg.norm(part, axis=1, keepdims=True) for part in errors]
            base, platform = robot.base + errors[0], robot.platform + errors[1]
            ends = points[:, None, :3] + np.einsum("kij,lj->kli", box.rotations(points), platform)
            lengths = np.linalg.norm(ends - base, axis=2)
            share = np.linspace(0, 1, 11)[:, None, None]
            along = base + share[..., None] * (ends - base)
            for i, j in ((0, 1), (0, 2), (1, 2)):
                apart = np.linalg.norm(along[:, None, :, i] - along[None, :, :, j], axis=3).min()
                assert found[f"leg_clearance limbs {i + 1} and {j + 1}"].bound <= apart
            for i, stroke in enumerate(np.ptp(lengths, axis=0)):
                assert stroke <= found[f"actuator.stroke_max limb {i + 1}"].bound
    built, exact = bounds
    assert all(built[name].bound > exact[name].bound for name in exact if name.startswith("actuator"))


def test_a_page_says_where_the_worst_pose_is_that_of_another_machine(cli: Run, tmp_path: Path) -> None:
    """Numbers of the pose that follow from others are the machine's: the design's loops do not close there."""
    case, page, drawn = case_file(tmp_path, tables_of("3-rps")), tmp_path / "page.html", tmp_path / "robot.png"
    output_of(cli("workspace", str(case), "--gap", "0.1", "--html", str(page)))
    words = "the worst pose was found for joint centres displaced within the tolerance, and the nominal robot does not"
    words += " reach this pose"
    assert f"No picture: {words}." in page.read_text(encoding="utf-8")
    refusal_of(cli("workspace", str(case), "--gap", "0.1", "--plot-pose", str(drawn)), words)
    assert not drawn.exists()


def test_derivatives_bound_no_number_that_jumps() -> None:
    """The angle of a vector jumps by a turn, where its derivatives are smooth, unless its sine is a length."""
    x = ca.SX.sym("x", 2)
    assert is_smooth(ca.atan2(ca.norm_2(x), x[0]) / x[1])
    assert not any(map(is_smooth, (ca.atan2(x[0], x[1]), ca.fabs(x[0]), ca.fmax(x[0], x[1]), ca.floor(x[0]))))
