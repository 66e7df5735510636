"""Free travel of a platform from a pose as a result."""

from typing import TYPE_CHECKING

from ...models import Dimension
from ..proof.workspace.range_values import AxisRange, PairRange, RangeStop
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector6
from .parts import HeadData, VersionsData
from .point import head_data, versions

if TYPE_CHECKING:
    from ..proof.workspace.axis_ranges import AxisRanges


class AxisRangesResult(JsonObject):
    """Free travel from a pose along each coordinate, and along each pair of coordinates, up to the first limit.

    Attributes:
        head: the case.
        proved: If true, all claims are proved at the pose, and a coordinate has a proved range.
        pose: position, and roll, pitch and yaw.
        largest: largest travel in the search, length and angle.
        faults: claims that are not proved at the pose itself.
        axes: range of each independent coordinate while the other independent coordinates keep their values.
        pairs: ranges of the pairs of independent coordinates.
        not_alone: names of the dependent coordinates, which move with the independent coordinates.
        reason: reason for the end of the search before all axes and pairs were examined; absent otherwise.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    proved: bool
    pose: Vector6
    largest: tuple[float, ...]
    faults: tuple[RangeStop, ...]
    axes: tuple[AxisRange, ...]
    pairs: tuple[PairRange, ...]
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
        faults=RangeStop.of_each(found.stops, units),
        axes=AxisRange.of_each(found.axes, units),
        pairs=PairRange.of_each(found.pairs, units),
        not_alone=found.others,
        reason=found.reason or None,
        versions=versions(),
    )
