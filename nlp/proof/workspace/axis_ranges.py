"""How far each coordinate of a pose can move alone, and each two together, before the first limit.

A coordinate moves along a path of one segment, which is judged as a programmed path is. The first point known that
refutes a claim tells where to judge next: just before it, and else half-way. So each end is proved, and just beyond it
a claim is refuted, or stays open. Two coordinates move within a box about the pose, a part of the ranges of both.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np

from ....models import Dimension, FloatArray
from ....models.joints.model.closedform import closed_form
from ...case.case import Case
from ...case.checks import check_determined_joints
from ...case.limits.legs import Actuator
from ...case.pose import Free
from ...errors import InputError, nearest
from ...evidence.dependent import robot_size
from ...evidence.state import WorkspacePose
from ...interruption import is_requested, one_call, one_search, why_stopped, within
from ...path.options import Between
from ...path.orientation import ORDERS, roll_pitch_yaw
from ...path.path import Kind, ProgrammedPath
from .alone import AXES, box_about, coordinates_alone
from .edge_samples import EdgeSamples
from .judge import judge_workspace
from .judgement import Judgement
from .path_judge import judge_path
from .range_values import AxisRange, PairRange, RangeEnd, RangeStop
from .robot.pose_box import pose_box
from .robot.posed_robot import NotJudgedError, build_problem
from .verdict import Outcome, Verdict

_T = TypeVar("_T")
#: Seconds for all judgements where the caller does not say; the part of the time that one takes at most, so that a
#: shorter motion is tried where it does not end, and that a search takes of it.
TIME_LIMIT, _EACH, _PART = 120.0, 1 / 32, 0.5
#: Largest angle moved by, where none is asked for, and largest angle of a pose.
LARGEST_ANGLE, _WIDEST = math.radians(90), math.radians(148)
#: Accuracy of an end, as a part of the largest range, where the first point that refutes its claim is computed, and of
#: another one; of a range that a limit over all of it cuts, and of two coordinates together, as a part of their ranges.
TOLERANCE, HALVED, _WHOLE, PAIRED = 1e-6, 1e-4, 1e-3, 0.01
#: Gap of numbers, of which verdicts alone are asked for, a motion that is none, as a part of the largest
#: one, and parts of an accuracy that are a short step.
_GAP, _STILL, _SHORT = 0.5, 1e-12, 10


@dataclass(frozen=True, eq=False)
class AxisRanges:
    """How far a platform can move from a pose.

    Attributes:
        case: the case, its dimensions fixed.
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians.
        most: largest length and angle, radians, that a coordinate is moved by.
        stops: claims that are not proved at the pose itself; the ranges are empty where there are any.
        axes: ranges of the independent coordinates alone.
        pairs: of each two of them.
        others: coordinates that follow from these, and move with them.
        reason: why the work ended before all axes and pairs were judged; else empty.
    """

    case: Case
    start: FloatArray
    most: tuple[float, float]
    stops: tuple[RangeStop, ...]
    axes: tuple[AxisRange, ...] = ()
    pairs: tuple[PairRange, ...] = ()
    others: tuple[str, ...] = ()
    reason: str = ""


class _Found(NamedTuple):
    """A part of the largest range that is proved, one that is not, and the claim that fails at that."""

    proved: float
    failed: float | None
    stop: RangeStop | None


class _Failed(NamedTuple):
    """The first part known of a range that is not proved, its claim, and whether that is where it fails first."""

    part: float
    stop: RangeStop
    is_first: bool = False


#: Judges a part of the largest range: None where it is proved.
_Judge = Callable[[float], _Failed | None]


@one_call
def axis_ranges(
    case: Case,
    start: Sequence[float] | None = None,
    *,
    axes: Sequence[str] = AXES,
    most: tuple[float, float] | None = None,
    time_limit: float | None = TIME_LIMIT,
    progress: Callable[[str], None] | None = None,
) -> AxisRanges:
    """Prove how far each coordinate of a pose can move alone, and each two together, before the first limit.

    Args:
        case: with fixed dimensions; its tasks and its workspace are not used.
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians; the case's first pose if left out.
        axes: names of the coordinates that are asked for; those that the platform cannot change are left out.
        most: largest length and angle, radians, that a coordinate is moved by; the size of the robot, and a right angle
            if left out.
        time_limit: seconds for all judgements.
        progress: called with what is done next.

    Raises:
        CaseError: a dimension of the robot is free, or the pose does not determine its driven joints.
        InputError: the pose is free or none, no coordinate has a name, or the largest ranges are not positive.
    """
    check_determined_joints(case.model, "path", case.source)
    here = _of_case(case) if start is None else np.array(start, dtype=np.float64)
    _check(here, axes)
    # The workspace says nothing here, but a judged machine has one.
    case = replace(case, workspace=box_about(here, {0: (here[0] - 1.0, here[0] + 1.0)}))
    case.fixed_parameters("a range is judged with fixed dimensions")
    case.require_motion()
    most = (robot_size(case, here[:3].tolist()), LARGEST_ANGLE) if most is None else most
    if not all(0 < each < math.inf for each in most):
        raise InputError("the largest length and angle to move by must be positive and finite")
    report = progress or (lambda _: None)
    with within(time_limit, _EACH):
        report("the pose")
        alone, others = coordinates_alone(case, here, most[0])
        nothing = AxisRanges(case, here, most, (), others=tuple(AXES[k] for k in others))
        if not alone:
            return nothing
        # A path has a motion.
        near = here.copy()
        near[alone[0]] += _STILL * most[alone[0] // 3]
        with within(None, _PART):
            judged = _judged(case, here, near)
        if not judged.is_proved:
            return replace(nothing, stops=tuple(each.stop for each in _failures(judged)))
        has_whole, found = any(_is_over_poses(each) for each in judged.extremes), list[AxisRange]()
        for k in _until_requested(k for k in alone if AXES[k] in axes):
            report(AXES[k])
            found.append(_range(case, here, k, most[k // 3], has_whole=has_whole))
        pairs, samples = [], _samples(case, here, found)
        for one, other in _until_requested(itertools.combinations(found, 2)):
            report(f"{one.axis} and {other.axis}")
            pairs.append(_pair(case, here, samples, one, other))
        reason = why_stopped() if is_requested() else ""
        return replace(nothing, axes=tuple(found), pairs=tuple(pairs), reason=reason)


def _until_requested(items: Iterable[_T]) -> Iterator[_T]:
    """Return items until the work is to stop."""
    return itertools.takewhile(lambda _: not is_requested(), items)


def _check(start: FloatArray, axes: Sequence[str]) -> None:
    """Refuse what is no pose, and names of no coordinates.

    Raises:
        InputError: it is refused.
    """
    if start.shape != (6,) or not np.isfinite(start).all():
        raise InputError("the pose must be six finite numbers: x, y, z, roll, pitch, yaw")
    for name, value in zip(AXES[3:], start[3:].tolist(), strict=True):
        if abs(value) >= _WIDEST:
            raise InputError(f"{name} = {math.degrees(value):g} deg: must be within {math.degrees(_WIDEST):g} degrees")
    for name in axes:
        if name not in AXES:
            raise InputError(f"axis {name!r}: no such coordinate; {nearest(name, AXES)}")


def _of_case(case: Case) -> FloatArray:
    """Return the coordinates (6,) of a case's first pose.

    Raises:
        InputError: a number of the pose is free.
    """
    axis, values = case.axis, (*case.position, case.rotation.angle)
    fixed = [each for each in values if not isinstance(each, Free)]
    if len(fixed) < len(values) or axis is None:
        name = case.source or case.name
        raise InputError(f"{name}: pose: has free numbers, and ranges are about one pose: state it with --start")
    half = fixed[3] / 2
    turn = roll_pitch_yaw(np.array([[math.cos(half), *(math.sin(half) * axis)]]))[0]
    # A sum with zero has no negative zero.
    return np.array([*fixed[:3], *turn]) + 0.0


def _range(case: Case, start: FloatArray, k: int, most: float, *, has_whole: bool) -> AxisRange:
    """Return how far a coordinate can move alone.

    Args:
        case: the machine.
        start: (6,) the pose.
        k: index of the coordinate.
        most: largest motion.
        has_whole: whether limits on strokes need the lengths over the whole range.
    """
    ways = [-most, most] if k < 3 else [max(-most, -_WIDEST - start[k]), min(most, _WIDEST - start[k])]

    def at(part: float, way: float) -> FloatArray:
        moved = start.copy()
        moved[k] += part * way
        return moved

    def one_way(way: float, part: float) -> _Failed | None:
        judged = _judged(case, start, at(part, way))
        if judged.is_proved:
            return None
        first = next(_failures(judged))
        return first._replace(part=first.part * part)

    ends = [_largest(partial(one_way, way), HALVED) for way in ways]
    if has_whole:

        def whole(part: float) -> _Failed | None:
            judged = _judged(case, start, *(at(part * each.proved, way) for each, way in zip(ends, ways, strict=True)))
            return None if judged.is_proved else _Failed(part, next(_failures(judged)).stop)

        both = _largest(whole, _WHOLE)
        if both.failed is not None:
            ends = [_Found(both.proved * e.proved, both.failed * e.proved, both.stop) for e in ends]
    dimension = Dimension.LENGTH if k < 3 else Dimension.ANGLE
    lower, upper = (
        RangeEnd(
            value=float(at(each.proved, way)[k]),
            failed=None if each.failed is None else float(at(each.failed, way)[k]),
            stop=each.stop,
            dimension=dimension,
        )
        for each, way in zip(ends, ways, strict=True)
    )
    unit = case.units.label(dimension)
    return AxisRange(axis=AXES[k], unit=unit, at=float(start[k]), lower=lower, upper=upper, dimension=dimension)


def _samples(case: Case, start: FloatArray, ranges: Sequence[AxisRange]) -> EdgeSamples | None:
    """Return measurements at poses within all ranges; None of a robot with loops that are no formulas."""
    ends = {AXES.index(each.axis): (each.lower.value, each.upper.value) for each in ranges}
    ends = {k: (low, high) for k, (low, high) in ends.items() if low < high}
    if len(ends) < 2:
        return None
    try:
        problem = build_problem(case, closed_form(case.model).model, pose_box(box_about(start, ends)))
        return None if problem.dependent else EdgeSamples(case, start, problem)
    except NotJudgedError:
        return None


def _pair(case: Case, start: FloatArray, samples: EdgeSamples | None, *ranges: AxisRange) -> PairRange:
    """Return how far two coordinates can move at once, as a part of their ranges."""
    one, other = ranges

    def judge(part: float) -> _Failed | None:
        ends = {
            AXES.index(each.axis): tuple(each.at + part * (end.value - each.at) for end in (each.lower, each.upper))
            for each in ranges
        }
        box = box_about(start, {k: (low, high) for k, (low, high) in ends.items() if low < high})
        with one_search():
            judged = judge_workspace(case, workspace=box, time_limit=None, with_objective=False, until_fault=True)
        return None if judged.is_proved else _Failed(part, next(_failures(judged)).stop)

    if any(each.lower.value == each.upper.value for each in ranges):
        return PairRange(axes=(one.axis, other.axis), factor=0.0, failed=None, stop=None)
    guess = 1.0
    if samples is not None:
        moves = np.zeros((2, 2, 6))
        for each, move in zip(ranges, moves, strict=True):
            move[:, AXES.index(each.axis)] = each.lower.value - each.at, each.upper.value - each.at
        guess = samples.first(moves)
    found = _largest(judge, PAIRED, guess)
    return PairRange(axes=(one.axis, other.axis), factor=found.proved, failed=found.failed, stop=found.stop)


def _largest(judge: _Judge, tolerance: float, guess: float = 1.0) -> _Found:
    """Return the largest part of a range that is proved, to a tolerance, looking next to a guess of it first."""
    failed: float | None = None
    stop: RangeStop | None = None
    proved = 0.0
    # Both sides of the guess lie within the tolerance.
    step = 0.8 * tolerance
    part = 1.0 if guess >= 1 else max(guess - 0.5 * step, 0.5 * guess)
    while True:
        first, before = judge(part), failed
        if first is None:
            proved = part
        elif not (is_requested() and first.stop.outcome is Outcome.OPEN and failed is not None):
            # A judgement that was stopped says nothing where a claim is known to fail.
            failed, stop = first.part, first.stop
        # Just before a point that is known to refute, claims may hold all the way; steps must not be short, though.
        is_sharp = first is not None and first.is_first and (before is None or before - first.part > _SHORT * TOLERANCE)
        least = TOLERANCE if is_sharp else tolerance
        if part == proved == 1 or (failed is not None and failed - proved <= least):
            return _Found(proved, failed, stop)
        if is_requested():
            # Between what is proved and what fails nothing is known.
            stop = None if stop is None else RangeStop.of(stop, outcome=Outcome.OPEN, reason=why_stopped())
            return _Found(proved, failed, stop)
        if failed is None:
            part, step = min(part + step, 1.0), 8 * step
        elif is_sharp:
            part = max(failed - 0.5 * TOLERANCE, 0.5 * (proved + failed))
        else:
            part = 0.5 * (proved + failed)


def _judged(case: Case, start: FloatArray, *ends: FloatArray) -> Judgement:
    """Judge a machine on lines from a pose to others, one after the other."""
    count = len(ends)
    path = ProgrammedPath(
        "the pose", np.stack([start, *ends]), np.ones(count, dtype=np.int32),
        np.full(count, Kind.LINE, dtype=np.uint8), np.full(count, np.nan), np.zeros((0, 6)),
        np.zeros(0, dtype=np.uint8), ORDERS["rpy"], Between.ANGLES,
    )  # fmt: skip
    with one_search():
        return judge_path(case, path, gap=_GAP, time_limit=None, limits_alone=True)


def _failures(judged: Judgement) -> Iterator[_Failed]:
    """Yield the claims that are not proved, with the part of the path at which each fails, the first one first.

    A refuted claim comes before an open one at the same place. Of claims over several points, and of boxes, the place
    is the end.
    """
    found = []
    for each in (verdict for verdict in judged.verdicts if verdict.fails):
        fault, value, pose = each.first_fault, each.reached, each.pose
        if fault is not None:
            _, value, pose = fault
        stop = RangeStop.of(
            each,
            unit=None if each.is_rank else judged.case.units.label(each.dimension),
            sense=None if each.is_rank else each.sense,
            value=math.nan if each.is_rank else value,
            pose=None if pose is None else WorkspacePose.of(pose),
        )
        part = 1.0 if fault is None or _is_over_poses(each) else fault.place.parameter
        is_first = fault is not None and (part < 1 or each.is_rank or each.fault is not None)
        found.append(_Failed(part, stop, is_first=is_first))
    yield from sorted(found, key=lambda each: (each.part, each.stop.outcome is not Outcome.REFUTED))


def _is_over_poses(each: Verdict) -> bool:
    """Return whether a limit is about several poses at once, such as that on a stroke."""
    return each.key.startswith(f"{Actuator.key}.")
