"""How far a platform can move from a pose, as a result."""

import math
from typing import TYPE_CHECKING, Any

from ...models import Dimension
from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector6, finite_or_none
from ..units import Units
from .parts import HeadData, VersionsData
from .point import head_data, versions
from .verdicts import WorkspacePose, pose_data

if TYPE_CHECKING:
    from ..proof.workspace.axis_ranges import AxisRanges, RangeEnd, RangeStop


class StopData(JsonObject):
    """A claim that is not proved at a pose, or on the way to it.

    Attributes:
        name: the claim.
        outcome: refuted at the pose, or open on the way to it.
        key: dotted key, below ``limits``, of the limit in the case; absent of a rank.
        unit: of the limit; absent of a rank.
        sense: whether the number is below a smallest or above a largest value; absent of a rank.
        limit: the limit; absent of a rank.
        value: of the number at the pose; null where it is not known, and of a rank.
        pose: the pose; null where none is known.
        reason: why the claim is open, or how a singular pose was found; absent without one.
    """

    name: str
    outcome: Outcome
    key: Absent[str]
    unit: Absent[str]
    sense: Absent[Sense]
    limit: Absent[float]
    value: float | None
    pose: WorkspacePose | None
    reason: Absent[str]


class RangeEndData(JsonObject):
    """An end of a proved range.

    Attributes:
        value: everything is proved up to it.
        failed: the first value known beyond it at which not everything is; absent at the end of the largest range.
        limited_by: what fails there; absent with ``failed``.
    """

    value: float
    failed: Absent[float]
    limited_by: Absent[StopData]


class AxisData(JsonObject):
    """How far a coordinate can move alone.

    Attributes:
        axis: ``x``, ``y``, ``z``, ``roll``, ``pitch`` or ``yaw``.
        unit: of its values.
        at: its value at the pose.
        lower: the lower end of the proved range about the pose.
        upper: the upper end.
    """

    axis: str
    unit: str
    at: float
    lower: RangeEndData
    upper: RangeEndData


class PairData(JsonObject):
    """How far two coordinates can move at once.

    Attributes:
        axes: both.
        factor: everything is proved in the box of their ranges times this factor, about the pose.
        failed: the smallest factor known at which not everything is; absent where the whole box is proved.
        limited_by: what fails there; absent with ``failed``.
    """

    axes: tuple[str, ...]
    factor: float
    failed: Absent[float]
    limited_by: Absent[StopData]


class AxisRangesResult(JsonObject):
    """Result of asking how far a platform can move from a pose.

    Attributes:
        head: the case.
        proved: whether everything is proved at the pose, and a range about it of a coordinate.
        pose: position, and roll, pitch and yaw.
        largest: length and angle by which coordinates were moved at most.
        faults: what is not proved at the pose itself.
        axes: the independent coordinates alone.
        pairs: each two of them.
        not_alone: coordinates that the robot cannot choose: they follow from the others, and move with them.
        reason: why the work ended before all axes and pairs were judged; absent otherwise.
        versions: of the programs.
    """

    head: Inline[HeadData]
    proved: bool
    pose: Vector6
    largest: tuple[float, ...]
    faults: tuple[StopData, ...]
    axes: tuple[AxisData, ...]
    pairs: tuple[PairData, ...]
    not_alone: tuple[str, ...]
    reason: Absent[str]
    versions: VersionsData


def axis_ranges_result(found: "AxisRanges") -> AxisRangesResult:
    """Return the ranges as a result."""
    units = found.case.units
    kinds = (*[Dimension.LENGTH] * 3, *[Dimension.ANGLE] * 3)
    moves = any(each.lower.value < each.upper.value for each in found.axes)
    return AxisRangesResult(
        head=head_data(found.case),
        proved=not found.stops and moves,
        pose=tuple(units.shown(float(value), kind) for value, kind in zip(found.start, kinds, strict=True)),
        largest=tuple(units.shown(most, kind) for most, kind in zip(found.most, kinds[2:4], strict=True)),
        faults=tuple(_stop_data(each, units) for each in found.stops),
        axes=tuple(
            AxisData(
                axis=each.axis,
                unit=units.label(each.dimension),
                at=units.shown(each.at, each.dimension),
                lower=_end_data(each.lower, each.dimension, units),
                upper=_end_data(each.upper, each.dimension, units),
            )
            for each in found.axes
        ),
        pairs=tuple(
            PairData(
                axes=each.axes,
                factor=each.factor,
                failed=each.failed,
                limited_by=None if each.stop is None else _stop_data(each.stop, units),
            )
            for each in found.pairs
        ),
        not_alone=found.others,
        reason=found.reason or None,
        versions=versions(),
    )


def _end_data(end: "RangeEnd", dimension: Dimension, units: Units) -> RangeEndData:
    """Return an end in a case's units."""
    return RangeEndData(
        value=units.shown(end.value, dimension),
        failed=None if end.failed is None else units.shown(end.failed, dimension),
        limited_by=None if end.stop is None else _stop_data(end.stop, units),
    )


def _stop_data(stop: "RangeStop", units: Units) -> StopData:
    """Return a claim in a case's units."""
    each, number_of = stop.extreme, dict[str, Any](key=None, unit=None, sense=None, limit=None, value=None)
    if each is not None:
        number_of = {
            "key": each.key,
            "unit": units.label(each.dimension),
            "sense": each.sense,
            "limit": None if each.limit is None else units.shown(each.limit, each.dimension),
            "value": finite_or_none(units.shown(stop.value, each.dimension)) if math.isfinite(stop.value) else None,
        }
    return StopData(
        name=stop.name,
        outcome=stop.outcome,
        pose=None if stop.pose is None else pose_data(stop.pose, units),
        reason=stop.reason or None,
        **number_of,
    )
