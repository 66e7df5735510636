"""Workspaces of machines as they are built: every claim, for every machine within a tolerance on joint centres."""

import itertools
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from builders import Run, case_from, edited, saved, soaked
from hexapods import EVERY_LIMIT, bounds_of, clearance, singular_part, smallest, subject_of, values_of
from workspace_cases import box_of, problem_of, turned

from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Limits, Outcome, RateShare, Sense, judge_workspace, load_case, load_result, solve
from screwsynth.nlp.case.limits.joints import JointAngle
from screwsynth.nlp.case.limits.legs import Actuator, LegLength
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.interruption import within
from screwsynth.nlp.proof.statement.claims import claims_of
from screwsynth.nlp.proof.statement.fixed_robot import Legs, legs_of, workspace_of_case
from screwsynth.nlp.proof.statement.posed_layout import posed_layout
from screwsynth.nlp.proof.statement.tolerance import built_model
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal, Number
from screwsynth.nlp.proof.workspace.numbers.extremes import NumberSearch, prove_extreme
from screwsynth.nlp.proof.workspace.numbers.pose_error import pose_errors
from screwsynth.nlp.proof.workspace.numbers.strokes import _better
from screwsynth.nlp.proof.workspace.numbers.within_tolerance import RobotsWithinTolerance
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examined, Examiner, LoopBoxes
from screwsynth.nlp.proof.workspace.ranks.rank_rule import RankTest
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import Problem, build_problem, family_of
from screwsynth.nlp.proof.workspace.verdict import Verdict
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.results.workspace import WorkspaceResult

HOME = np.array([0.0, 0.0, 20.0])
TOLERANCE = 0.02
LENGTH = 11.5


@pytest.fixture(scope="module")
def case() -> Case:
    return case_from(EVERY_LIMIT, "built")


class Machines:
    """Machines within a tolerance, each at a pose of a box: random ones, and every second with errors at their largest.

    Those have errors along or across the legs, or along axes, and are at faces and corners of the box.
    """

    def __init__(self, robot: Legs, box: PoseBox, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        points = box.random(count, rng)
        ends = np.where(rng.uniform(size=points.shape) < 0.5, box.upper, box.lower)
        points[::2] = box.clipped(np.where(rng.uniform(size=points.shape) < 0.9, ends, points)[::2])
        self.turn = box.rotations(points)
        self.position = points[:, :3]
        span = self.position[:, None] + np.einsum("kij,lj->kli", self.turn, robot.platform) - robot.base
        unit = span / np.linalg.norm(span, axis=2, keepdims=True)
        errors = rng.normal(size=(2, count, 6, 3))
        errors /= np.linalg.norm(errors, axis=3, keepdims=True)
        errors[:, 1::2] *= rng.uniform(size=(2, count // 2, 6, 1)) ** (1 / 3)
        # Opposite errors of both ends, along the leg or across it.
        sign = rng.choice([-1.0, 1.0], (count, 6, 1))
        across = np.cross(unit, errors[0])
        across /= np.linalg.norm(across, axis=2, keepdims=True)
        kind = rng.integers(4, size=(count, 1, 1))
        moved = np.where(kind == 0, sign * unit, np.where(kind == 1, across, errors[0]))
        errors[0, ::2], errors[1, ::2] = -moved[::2], moved[::2]
        errors *= robot.tolerance
        self.base = robot.base + errors[0]
        self.platform = robot.platform + np.einsum("kji,klj->kli", self.turn, errors[1])
        self.arm = np.einsum("kij,klj->kli", self.turn, self.platform)
        self.d = self.position[:, None] + self.arm - self.base
        self.length = np.linalg.norm(self.d, axis=2)
        self.n = self.d / self.length[:, :, None]
        self.J = np.concatenate([self.n, np.cross(self.arm, self.n)], axis=2)

    def clearance(self, i: int, j: int) -> FloatArray:
        """Distances (K,) of two legs as segments, the least of those between a point of one and the other's ends and
        of the lines where they cross."""
        p, q, d, e = self.base[:, i], self.base[:, j], self.d[:, i], self.d[:, j]
        found = np.full(len(p), np.inf)
        for a, b, c in ((p, q, e), (p + d, q, e), (q, p, d), (q + e, p, d)):
            t = np.clip(((a - b) * c).sum(axis=1) / (c * c).sum(axis=1), 0, 1)
            found = np.minimum(found, np.linalg.norm(a - b - t[:, None] * c, axis=1))
        normal = np.cross(d, e)
        system = np.stack([d, -e, normal], axis=2)
        s, t, _ = np.linalg.solve(system, (q - p)[:, :, None])[:, :, 0].T
        lines = np.abs((normal * (q - p)).sum(axis=1)) / np.linalg.norm(normal, axis=1)
        inside = (s > 0) & (s < 1) & (t > 0) & (t < 1)
        return np.where(inside, np.minimum(found, lines), found)


def angles(d: FloatArray, axes: FloatArray) -> FloatArray:
    """Angles (K, 6) of vectors (K, 6, 3) to axes (K, 6, 3) or (6, 3)."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(axes, d), axis=2), (axes * d).sum(axis=2)))


def numbers(case: Case, robot: Legs, machines: Machines) -> Iterator[tuple[str, FloatArray]]:
    """Each number that is judged, by the name of its claims, of machines (K,)."""
    names = [leg.name for leg in case.model.legs]
    home = HOME + robot.platform - robot.base
    home /= np.linalg.norm(home, axis=1, keepdims=True)
    twist = np.asarray(case.tasks[0].twist)
    squares = ((twist[3:] + np.cross(twist[:3], machines.base)) * machines.n).sum(axis=2) ** 2
    F = squares.sum(axis=1)
    base = angles(machines.d, np.tile([0.0, 0.0, 1.0], (6, 1)))
    platform = angles(machines.d, np.einsum("kij,lj->kli", machines.turn, home))
    for i, name in enumerate(names):
        yield f"leg_length limb {name}", machines.length[:, i]
        yield f"base_joint_angle limb {name}", base[:, i]
        yield f"platform_joint_angle limb {name}", platform[:, i]
        yield f"rate_share limb {name}", squares[:, i] / F
        yield f"actuator_rate actuator {name}", np.sqrt(squares[:, i])
        yield f"footprint base joint {name}", np.linalg.norm(machines.base[:, i, :2], axis=1)
        yield f"footprint platform joint {name}", np.linalg.norm(machines.platform[:, i, :2], axis=1)
    for i, j in itertools.combinations(range(6), 2):
        one, other = names[i], names[j]
        for plate in ("base", "platform"):
            centres = getattr(machines, plate)
            apart = np.linalg.norm(centres[:, i] - centres[:, j], axis=1)
            yield f"joint_spacing {plate} joints {one} and {other}", apart
    for i, j in ((0, 1), (0, 2), (1, 4)):
        yield f"leg_clearance limbs {names[i]} and {names[j]}", machines.clearance(i, j)
    yield "F", F
    radii = [np.linalg.norm(plate[..., :2], axis=(1, 2)) for plate in (machines.platform, machines.base)]
    yield "radius_ratio", radii[0] / radii[1]


def built(robot: Legs, errors: FloatArray) -> Legs:
    """The machine with errors (12, 3) of the joints on the base and on the platform, leg by leg."""
    return Legs(robot.base + errors[::2], robot.platform + errors[1::2])


def beyond(each: Verdict, values: FloatArray) -> float:
    """Distance of the worst of some values beyond a proven bound; negative within it."""
    return float(values.max() - each.bound if each.sense is Sense.MAX else each.bound - values.min())


@pytest.fixture(scope="module")
def machines(case: Case) -> Machines:
    return Machines(legs_of(case), box_of(case), 30_000)


def test_no_machine_within_the_tolerance_is_outside_of_a_proven_bound(case: Case, machines: Machines) -> None:
    sampled, seen = dict(numbers(case, legs_of(case), machines)), set()
    every = RobotsWithinTolerance(case, closed_form(case.model), problem_of(case))
    picked = [name for name in sampled if " 1-" in name or " 2+" in name or " " not in name]
    claims = [each for each in every.symbols.claims(["base_joint_angle"])[1] if each.name in picked]
    for each in (every.extreme(claim, NumberSearch(jobs=1)) for claim in claims):
        seen.add((each.name.partition(" ")[0], each.key == ""))
        assert beyond(each, sampled[each.name]) <= 0, each.name
        # Proven bounds are near: a hundredth of the largest number of the exact machine, with the gap.
        assert beyond(each, sampled[each.name]) > -0.03 * np.abs(sampled[each.name]).max(), each.name
        # The errors that come with a value are those of a machine within the tolerance which has that value.
        assert each.pose is not None
        assert np.linalg.norm(each.errors.vectors, axis=1).max() <= TOLERANCE
        assert beyond(each, np.array([each.reached])) <= 1e-9 * abs(each.reached), each.name
    assert len(seen) == 10
    determinants = np.linalg.det(machines.J)
    assert (determinants > 0).all() or (determinants < 0).all()
    assert judge_workspace(case, with_limits=False).regularity.outcome is Outcome.PROVED


def test_bounds_of_clearances_and_singular_values_hold_for_every_machine(case: Case, machines: Machines) -> None:
    robot, box = legs_of(case), box_of(case)
    values = np.linalg.svd(machines.J[:20_000] / [1, 1, 1, LENGTH, LENGTH, LENGTH], compute_uv=False)
    subject = subject_of(robot, box, 15.0)
    spectra = [subject.spectrum(LENGTH, is_condition=is_condition) for is_condition in (False, True)]
    checks: list[tuple[Number, FloatArray]] = [
        (clearance(robot, box, 0, 1), machines.clearance(0, 1)),
        (clearance(robot, box, 0, 2), machines.clearance(0, 2)),
        (spectra[0], values[:, -1]),
        (spectra[1], -values[:, 0] / values[:, -1]),
    ]
    rng = np.random.default_rng(1)
    for number, sampled in checks:
        assert bounds_of(number, box.lower[None], box.upper[None])[0] <= sampled.min()
        # At a point the bound and the value of the worst machine differ by the rest, and by the 2 % of the norm.
        points = box.random(50, rng)
        at, exact = bounds_of(number, points, points), values_of(number, points)
        assert (at <= exact + 1e-12).all()
        assert (at >= exact - 0.05 * np.abs(exact)).all()
    for number in spectra:
        assert np.linalg.norm(number.worst(points[0]), axis=1).max() <= TOLERANCE
    # Of machines at one pose none that is met by chance is as bad as the worst one.
    for y in points[:5]:
        J = Machines(robot, replace(box, lower=y, upper=y), 200).J / [1, 1, 1, LENGTH, LENGTH, LENGTH]
        assert (values_of(spectra[0], y[None]) <= np.linalg.svd(J, compute_uv=False)[:, -1]).all()
        assert (values_of(spectra[1], y[None]) <= -np.linalg.cond(J)).all()


def test_legs_that_errors_could_move_through_each_other_touch(case: Case) -> None:
    robot, box = legs_of(case), box_of(case)
    for y in box.random(5, np.random.default_rng(3)):
        wide = robot._replace(tolerance=float(values_of(clearance(robot, box, 0, 1), y[None])[0]))
        assert values_of(clearance(wide, box, 0, 1), y[None])[0] == 0
        touching = built(wide, clearance(wide, box, 0, 1).worst(y))
        assert values_of(clearance(touching, box, 0, 1), y[None])[0] < 1e-9 * wide.tolerance


def test_errors_of_a_machine_that_is_singular_at_every_pose_have_no_value(case: Case) -> None:
    """Joints of base and platform at the same azimuths: Newton's method finds no pose of a machine with errors."""
    robot = legs_of(case)
    similar, box = Legs(robot.base, 0.5 * robot.base), pose_box(Workspace((0.0, 0.0, Free(19.0, 21.0)), Turns()))
    with within(2.0):
        found = list(pose_errors(subject_of(similar, box, 10.0), 1e-3))
    for each in found:
        assert each.outcome is Outcome.OPEN
        assert (each.bound, each.pose) == (math.inf, None)
        assert math.isnan(each.reached)


@pytest.mark.parametrize("kind", list(TurnKind))
def test_boxes_are_regular_for_machines_within_the_tolerance(case: Case, kind: TurnKind) -> None:
    rng = np.random.default_rng(2)
    box, robot = pose_box(turned(kind, 45)), legs_of(case)._replace(tolerance=0.3)
    lower = box.random(300, rng)
    upper = np.minimum(lower + (box.upper - box.lower) * rng.uniform(0, 0.05, (300, 1)), box.upper)
    exact = build_problem(case, case.model, box)
    family = family_of(case, built_model(case.model), exact, robot.tolerance)

    def examined(meant: Problem) -> Examined:
        cells = LoopBoxes(lower, upper, 0.5 * (lower + upper), np.ones(len(lower), dtype=bool))
        return Examiner(meant, RankTest(meant.locked, meant.z, meant.start)).examine(cells)

    found, changed = examined(family), 0
    for k in np.flatnonzero(examined(exact).is_regular):
        signs = np.sign(np.linalg.det(Machines(robot, replace(box, lower=lower[k], upper=upper[k]), 60, seed=int(k)).J))
        if found.is_regular[k]:
            assert (signs == signs[0]).all()
        changed += (signs != signs[0]).any()
    # Without the tolerance boxes would be called regular that are not so for every machine: the test can fail. About
    # one axis no pose of this machine is near a singular one.
    assert changed or kind is TurnKind.AXIS
    assert found.is_regular.any()
    # Errors are moved into the tolerance along themselves, those within it nowhere.
    far = np.tile(family.start, (20, 1))
    far[:, family.of_errors] += rng.normal(0, robot.tolerance / 2, (20, 36))
    before, after = (z[:, family.of_errors].reshape(20, 12, 3) for z in (far, family.within(far)))
    shrunk = np.minimum(1, robot.tolerance / np.linalg.norm(before, axis=2, keepdims=True))
    np.testing.assert_allclose(after, shrunk * before, rtol=1e-9)
    assert 0 < (shrunk < 1).mean() < 1


def test_a_machine_within_the_tolerance_that_is_singular_refutes(case: Case) -> None:
    workspace, robot = turned(TurnKind.ANY_AXIS, 30), legs_of(case)
    box = pose_box(workspace)
    exact, found = (
        judge_workspace(replace(case, joint_centre_tolerance=t), workspace=workspace, with_limits=False).regularity
        for t in (None, 0.8)
    )
    assert exact.outcome is Outcome.PROVED
    assert found.outcome is Outcome.REFUTED
    assert np.linalg.norm(found.errors.vectors, axis=1).max() <= 0.8
    assert box.holds(box.coordinates(found.pose))
    assert singular_part(built(robot, found.errors.vectors), found.pose) < 1e-12


def test_closed_forms_of_the_worst_machine(case: Case) -> None:
    robot, tolerance = legs_of(case), TOLERANCE
    kept = [each for each in case.limits if isinstance(each, LegLength | JointAngle)]
    judged = judge_workspace(replace(on_a_line(case), limits=Limits(*kept)), gap=1e-6, with_objective=False)
    by_name = {(each.name, each.sense): each for each in judged.extremes if each.limit is not None}
    for i, leg in enumerate(case.model.legs):
        spans = [np.array([0.0, 0.0, z]) + robot.platform[i] - robot.base[i] for z in (18.0, 20.0)]
        short, long = (float(np.linalg.norm(each)) for each in spans)
        tilt = math.acos(18.0 / short)
        home = spans[1] / long
        swing = math.acos(min(float(home @ spans[0]) / short, 1.0))
        expected = {
            (f"leg_length limb {leg.name}", Sense.MIN): short - 2 * tolerance,
            (f"leg_length limb {leg.name}", Sense.MAX): long + 2 * tolerance,
            (f"base_joint_angle limb {leg.name}", Sense.MAX): tilt + math.asin(2 * tolerance / short),
            (f"platform_joint_angle limb {leg.name}", Sense.MAX): swing + math.asin(2 * tolerance / short),
        }
        for key, value in expected.items():
            sign = 1 if key[1] is Sense.MAX else -1
            assert 0 <= sign * (by_name[key].bound - value) < 1e-4, key
            assert by_name[key].reached == pytest.approx(value, abs=1e-6), key


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", soaked([TOLERANCE, 0.2], [0.2]))
def test_every_claim_holds_for_a_hundred_thousand_machines(case: Case, tolerance: float) -> None:
    # Shares of rates take longest, and are judged for the smaller tolerance.
    kept = [each for each in case.limits if tolerance == TOLERANCE or not isinstance(each, RateShare)]
    built = replace(case, joint_centre_tolerance=tolerance, limits=Limits(*kept))
    judged = judge_workspace(built, gap=1e-3 if tolerance == TOLERANCE else 5e-2, quantities=["base_joint_angle"])
    # Errors of the pose of the larger tolerance are too large for a bound of their terms of second order.
    left = [each for each in judged.extremes if each.outcome is not Outcome.PROVED]
    assert all(each.name.endswith(" error") for each in left), [(each.name, each.reason) for each in left]
    assert not left or tolerance > TOLERANCE
    robot = legs_of(built)
    machines = Machines(robot, pose_box(judged.workspace), 100_000)
    sampled = dict(numbers(built, robot, machines))
    values = np.linalg.svd(machines.J / [1, 1, 1, LENGTH, LENGTH, LENGTH], compute_uv=False)
    sampled["smallest_singular_value"], sampled["condition_number"] = values[:, -1], values[:, 0] / values[:, -1]
    determinants = np.linalg.det(machines.J)
    assert (determinants > 0).all() or (determinants < 0).all()
    for each in judged.extremes:
        if each.name in sampled:
            assert beyond(each, sampled[each.name]) <= 0, each.name
        else:
            others = ("actuator.", "leg_clearance ", "position error", "rotation error", "custom: ")
            assert each.name.startswith(others), each.name


def test_strokes_are_those_of_one_machine_at_two_poses(case: Case) -> None:
    """Bounds of strokes against random machines, each at many poses."""
    # The triangle inequality does not decide this limit on a stroke, nor this dead length.
    moved = replace(case, limits=Limits(Actuator(stroke_max=5.85, dead_length=20.4)))
    judged = judge_workspace(moved, with_objective=False)
    robot, box = legs_of(case), pose_box(judged.workspace)
    strokes = [each for each in judged.extremes if each.key == "actuator.stroke_max"]
    rng = np.random.default_rng(3)
    corners = box.clipped(np.where(rng.uniform(size=(200, 6)) < 0.5, box.upper, box.lower))
    turn = box.rotations(corners)
    errors = rng.normal(size=(2, 300, 6, 3))
    errors *= TOLERANCE / np.linalg.norm(errors, axis=3, keepdims=True)
    arms = np.einsum("kij,mlj->kmli", turn, robot.platform + errors[0])
    lengths = np.linalg.norm(corners[:, None, None, :3] + arms - robot.base - errors[1], axis=3)
    stroke = np.ptp(lengths, axis=0).max(axis=0)
    for each, sampled in zip(strokes, stroke, strict=True):
        assert max(sampled, each.reached) <= each.bound < 1.03 * each.reached
    dead = [each for each in judged.extremes if each.key == "actuator.dead_length" and each.boxes == 0]
    least = (2 * lengths.min(axis=0) - lengths.max(axis=0)).min(axis=0)
    for each, sampled in zip(dead, least, strict=True):
        assert min(sampled, each.reached) >= each.bound > 0.99 * each.reached
    assert judged.is_proved, [(each.name, each.bound, each.reached, each.reason) for each in judged.extremes]


def on_a_line(case: Case) -> Case:
    """The case with positions on a line, and no rotation: lengths of legs are largest and smallest at its ends."""
    return replace(case, workspace=Workspace((0.0, 0.0, Free(18.0, 20.0)), Turns(TurnKind.AXIS, (0.0,))))


def test_a_limit_is_refined_until_it_is_decided_whatever_the_gap_is(case: Case) -> None:
    exact = on_a_line(replace(case, joint_centre_tolerance=None))
    robot = legs_of(exact)
    ends = [np.linalg.norm(np.array([0.0, 0.0, z]) + robot.platform - robot.base, axis=1) for z in (18.0, 20.0)]
    stroke, longest = float((ends[1] - ends[0]).max()), float(ends[1].max())
    # The last one's lengths have room: it is the limit on strokes that has their values found more finely.
    nearest = ((1 + 2e-6, 0.0), (1 + 1e-10, 0.0), (1 - 2e-6, 0.0), (1 - 2e-6, 9.0))
    for near, room in nearest:
        outcome = Outcome.PROVED if near > 1 else Outcome.REFUTED
        limits = Limits(LegLength(min=10.0, max=longest * near + room), Actuator(stroke_max=stroke * near))
        judged = judge_workspace(replace(exact, limits=limits), gap=0.05, with_objective=False)
        limited = [each for each in judged.extremes if each.key in ("leg_length.max", "actuator.stroke_max")]
        assert {outcome} <= {each.outcome for each in limited} <= {outcome, Outcome.PROVED}
    for each in judged.extremes:
        tight = replace(each, bound=each.bound - 0.001 * each.sense.sign)
        assert {_better(each, tight).bound, _better(tight, each).bound} == {tight.bound}
    # The searches that are not those of certificates go on too, and end at a value that meets its limit.
    box = box_of(case)
    number = clearance(robot, box, 0, 1)
    least = smallest(number, Goal(1e-4)).value
    for limit, slack in ((least - 1e-6, 0.0), (least + 1e-10, 1e-9)):
        found = smallest(number, Goal(1.0, limit=limit, slack=slack), time_limit=20)
        assert found.bound >= limit - slack, found


def test_the_command_shows_the_machine_that_refutes(cli: Run, tmp_path: Path) -> None:
    head, _, tail = edited(EVERY_LIMIT, ("min = 10, max = 60", "min = 10, max = 32")).partition("actuator =")
    file, target = saved(tmp_path / "built.toml", head + tail[tail.index("[workspace]") :]), tmp_path / "result.json"
    code, shown, _ = cli("workspace", str(file), "--gap", "0.01", "--all", "--json", str(target))
    assert code == 1, shown
    result = load_result(target)
    jsonschema.validate(json.loads(target.read_text(encoding="utf-8")), result_schema())
    assert isinstance(result, WorkspaceResult)
    assert result.joint_centre == TOLERANCE
    refuted = [each for each in result.extremes if each.outcome is Outcome.REFUTED]
    assert refuted
    for each in refuted:
        assert max(np.linalg.norm(each.machine.base, axis=1)) == pytest.approx(TOLERANCE)
    places = [shown.index(each) for each in ("verdict", "limits with the smallest margin", "limits over all poses")]
    assert places == sorted(places)
    assert "covers every robot whose joint centres are off by at most 0.02 in" in shown
    assert f"robot within the tolerance that violates: {refuted[0].name}" in shown
    assert "see it with" in shown


def test_robots_without_a_rule_stay_open(case: Case) -> None:
    layout = posed_layout(case, workspace_of_case(case))
    claim = replace(claims_of(layout)[-1], uncovered="not covered")
    found = prove_extreme(layout, claim)
    assert (found.outcome, found.reason) == (Outcome.OPEN, "not covered")
    assert not math.isfinite(found.bound)
    # The exact machine is one of those within the tolerance: it refutes.
    refuted = prove_extreme(layout, replace(claim, limit=1.0, key="F.max"))
    assert refuted.outcome is Outcome.REFUTED


@pytest.mark.slow
def test_a_design_is_found_that_keeps_its_limits_for_every_machine() -> None:
    case = replace(load_case("hexapod-workspace"), joint_centre_tolerance=0.002)
    solution = solve(case, starts=4)
    proof = solution.workspace
    assert proof.is_proved
    assert solution.F < 422.402
    robot = legs_of(proof.judgement.case)
    machines = Machines(robot, pose_box(proof.judgement.workspace), 100_000)
    assert machines.length.min() >= 20
    assert machines.length.max() <= 38
    assert np.linalg.norm(machines.base[:, 0] - machines.base[:, 1], axis=1).min() >= 4


def test_what_takes_the_limits_at_the_stated_pose_says_so(cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "certificate.json"
    code, out, err = cli("certify", "hexapod-workspace", "--time", "1", "--starts", "1", "--json", str(target))
    assert code in (0, 1)
    result = json.loads(target.read_text(encoding="utf-8"))
    notice = "the limits are evaluated only at the stated pose, not over the workspace"
    assert result["notice"] == notice
    jsonschema.validate(result, result_schema())
    assert notice in " ".join((out + err).split())
    assert load_case("hexapod-machining").stated_pose_notice == ""
