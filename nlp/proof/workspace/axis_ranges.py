"""Free travel from a pose along each coordinate, and along each pair, up to the first limit.

A coordinate moves along a path of one segment, which is judged as a tool path. If a point is known that refutes a
claim, the next trial range ends just before this point; otherwise the range is bisected. So every point of the range
is proved, and just beyond its end a claim is refuted or open. A pair of coordinates moves in a box about the pose, a
scaled copy of the ranges of both.
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
from .edge_samples import EdgeSamples
from .judge import judge_workspace
from .judgement import Judgement
from .local_coordinates import AXES, box_about, local_coordinates
from .path_judge import judge_path
from .range_values import AxisRange, PairRange, RangeEnd, RangeStop
from .robot.pose_box import pose_box
from .robot.posed_robot import NotJudgedError, build_problem
from .verdict import Outcome, Verdict

_T = TypeVar("_T")
#: Default time limit of all judgements, in seconds; largest part of the time for one judgement, so that a shorter range
#: is judged if it does not end; largest part of a judgement's time for one search.
TIME_LIMIT, _EACH, _PART = 120.0, 1 / 32, 0.5
#: Default of the largest rotation from the pose, and largest angle of a pose.
LARGEST_ANGLE, _WIDEST = math.radians(90), math.radians(148)
#: Accuracy of an end, relative to the largest range: if the first point that refutes a claim is computed, if the range
#: is bisected, and if a limit concerns the whole range; accuracy of a pair, relative to the ranges.
TOLERANCE, HALVED, _WHOLE, PAIRED = 1e-6, 1e-4, 1e-3, 0.01
#: Gap of quantities, of which only the outcome matters; relative motion that counts as none; and number of accuracies
#: that make a short step.
_GAP, _STILL, _SHORT = 0.5, 1e-12, 10


@dataclass(frozen=True, eq=False)
class AxisRanges:
    """Free travel of a platform from a pose.

    Attributes:
        case: the case, its dimensions fixed.
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians.
        most: largest displacement of a coordinate: a length, and an angle in radians.
        stops: claims that are not proved at the pose itself. If there are any, no ranges are computed.
        axes: ranges of the independent coordinates.
        pairs: ranges of pairs of independent coordinates.
        others: names of the dependent coordinates.
        reason: reason why the work ended before all axes and pairs were judged; otherwise empty.
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
    """Largest proved fraction of a range, smallest fraction that is not proved, and the claim that fails there."""

    proved: float
    failed: float | None
    stop: RangeStop | None


class _Failed(NamedTuple):
    """Smallest known fraction of a range that is not proved.

    Attributes:
        part: fraction of the largest range.
        stop: claim that is not proved for this fraction.
        is_first: whether the claim is proved for every smaller fraction.
    """

    part: float
    stop: RangeStop
    is_first: bool = False


#: Function that judges a fraction of the largest range; None if this range is proved.
_Judge = Callable[[float], _Failed | None]


@one_call
def axis_ranges(
    case: Case,
    start: Sequence[float] | None = None,
    *,
    axes: Sequence[str] = AXES,
    most: tuple[float, float] | None = None,
    with_pairs: bool = True,
    time_limit: float | None = TIME_LIMIT,
    progress: Callable[[str], None] | None = None,
) -> AxisRanges:
    """Prove the free travel from a pose along each coordinate, and along each pair, up to the first limit.

    Args:
        case: case with fixed dimensions; tasks and workspace are not used.
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians; the case's first pose if left out.
        axes: names of the requested coordinates; dependent coordinates are left out.
        most: largest displacement of a coordinate: a length, and an angle in radians; if left out, the size of the
            robot and 90 degrees.
        with_pairs: If true, also prove the travel along pairs of coordinates.
        time_limit: seconds for all judgements together; None for no limit.
        progress: function that is called with the name of the next step.

    Raises:
        CaseError: a dimension of the robot is free, or the pose does not determine its driven joints.
        InputError: the pose is free or not valid, a coordinate's name is unknown, or a largest motion is not positive.
    """
    check_determined_joints(case.model, "path", case.source)
    here = _of_case(case) if start is None else np.array(start, dtype=np.float64)
    _check(here, axes)
    # The workspace has no effect here, but a judgement needs one.
    case = replace(case, workspace=box_about(here, {0: (here[0] - 1.0, here[0] + 1.0)}))
    case.fixed_parameters("a range is judged with fixed dimensions")
    case.require_motion()
    most = (robot_size(case, here[:3].tolist()), LARGEST_ANGLE) if most is None else most
    if not all(0 < each < math.inf for each in most):
        raise InputError("the largest displacements, a length and an angle, must be positive and finite")
    report = progress or (lambda _: None)
    with within(time_limit, _EACH):
        report("the pose")
        alone, others = local_coordinates(case, here, most[0])
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
        pairs, samples = [], _samples(case, here, found) if with_pairs else None
        for one, other in _until_requested(itertools.combinations(found if with_pairs else (), 2)):
            report(f"{one.axis} and {other.axis}")
            pairs.append(_pair(case, here, samples, one, other))
        reason = why_stopped() if is_requested() else ""
        return replace(nothing, axes=tuple(found), pairs=tuple(pairs), reason=reason)


def _until_requested(items: Iterable[_T]) -> Iterator[_T]:
    """Yield items until an interrupt or a time limit requests a stop."""
    return itertools.takewhile(lambda _: not is_requested(), items)


def _check(start: FloatArray, axes: Sequence[str]) -> None:
    """Check a pose and names of coordinates.

    Raises:
        InputError: the pose is not valid, or a coordinate's name is unknown.
    """
    if start.shape != (6,) or not np.isfinite(start).all():
        raise InputError("the pose must be six finite numbers: x, y, z, roll, pitch, yaw")
    for name, value in zip(AXES[3:], start[3:].tolist(), strict=True):
        if abs(value) >= _WIDEST:
            most = f"{math.degrees(_WIDEST):g}"
            raise InputError(f"{name} = {math.degrees(value):g} deg: must be above -{most} and below {most} degrees")
    for name in axes:
        if name not in AXES:
            raise InputError(f"axis {name!r}: no such coordinate; {nearest(name, AXES)}")


def _of_case(case: Case) -> FloatArray:
    """Return the coordinates (6,) of a case's first pose.

    Raises:
        InputError: a coordinate of the pose is free.
    """
    axis, values = case.axis, (*case.position, case.rotation.angle)
    fixed = [each for each in values if not isinstance(each, Free)]
    if len(fixed) < len(values) or axis is None:
        name = case.source or case.name
        raise InputError(
            f"{name}: pose: has free coordinates, but ranges start at one fixed pose: give this pose with --start"
        )
    half = fixed[3] / 2
    turn = roll_pitch_yaw(np.array([[math.cos(half), *(math.sin(half) * axis)]]))[0]
    # Adding zero removes negative zeros.
    return np.array([*fixed[:3], *turn]) + 0.0


def _range(case: Case, start: FloatArray, k: int, most: float, *, has_whole: bool) -> AxisRange:
    """Return the free travel along one coordinate.

    Args:
        case: the robot with fixed dimensions.
        start: (6,) the pose.
        k: index of the coordinate.
        most: largest motion, length or radians.
        has_whole: whether limits on strokes need the leg lengths over the whole range.
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
    """Return samples of limits within all ranges; None for a robot with loops without closed forms."""
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
    """Return the free travel along two coordinates together, as a fraction of their ranges."""
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
    """Return the largest proved fraction of a range, to a tolerance; the search starts at a guess."""
    failed: float | None = None
    stop: RangeStop | None = None
    proved = 0.0
    # The two first parts are on both sides of the guess, within the tolerance.
    step = 0.8 * tolerance
    part = 1.0 if guess >= 1 else max(guess - 0.5 * step, 0.5 * guess)
    while True:
        first, before = judge(part), failed
        if first is None:
            proved = part
        elif not (is_requested() and first.stop.outcome is Outcome.OPEN and failed is not None):
            # A known failed claim is kept, because a stopped judgement is no evidence.
            failed, stop = first.part, first.stop
        # All claims may hold up to just before a known refuting point. Short steps would take too many judgements.
        is_sharp = first is not None and first.is_first and (before is None or before - first.part > _SHORT * TOLERANCE)
        least = TOLERANCE if is_sharp else tolerance
        if part == proved == 1 or (failed is not None and failed - proved <= least):
            return _Found(proved, failed, stop)
        if is_requested():
            # The range between the proved part and the failed part was not judged.
            stop = None if stop is None else RangeStop.of(stop, outcome=Outcome.OPEN, reason=why_stopped())
            return _Found(proved, failed, stop)
        if failed is None:
            part, step = min(part + step, 1.0), 8 * step
        elif is_sharp:
            part = max(failed - 0.5 * TOLERANCE, 0.5 * (proved + failed))
        else:
            part = 0.5 * (proved + failed)


def _judged(case: Case, start: FloatArray, *ends: FloatArray) -> Judgement:
    """Judge a robot on straight motions from a pose to other poses in turn."""
    count = len(ends)
    path = ProgrammedPath(
        "the pose", np.stack([start, *ends]), np.ones(count, dtype=np.int32),
        np.full(count, Kind.LINE, dtype=np.uint8), np.full(count, np.nan), np.zeros((0, 6)),
        np.zeros(0, dtype=np.uint8), ORDERS["rpy"], Between.ANGLES,
    )  # fmt: skip
    with one_search():
        return judge_path(case, path, gap=_GAP, time_limit=None, limits_only=True)


def _failures(judged: Judgement) -> Iterator[_Failed]:
    """Yield the claims that are not proved, in the order of the parts of the path at which they fail.

    At the same place a refuted claim comes before an open claim. Claims about several points, and claims about boxes,
    count as failing at the end of the path.
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
    """Return whether the limit of a verdict concerns several poses together, such as a stroke."""
    return each.key.startswith(f"{Actuator.key}.")
