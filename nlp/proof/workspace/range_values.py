"""Ranges of the coordinates of a pose: each coordinate, each pair, and the claims that end the ranges."""

from typing import Annotated, Any

from ....models import Dimension
from ...case.task import Sense
from ...evidence.state import WorkspacePose
from ...system.jsonvalues import Absent, Hidden, JsonObject, Key, Known, Mark, Measure, Shown
from ...units import Units
from .verdict import Outcome


class RangeStop(JsonObject):
    """Claim that is not proved at a pose, or on the motion to this pose.

    Attributes:
        name: name of the claim.
        outcome: outcome of the claim: refuted at the pose, or open on the motion to this pose.
        key: dotted key, below ``limits``, of the limit in the case; absent for a rank.
        unit: unit of the limit, empty for a plain number; absent for a rank.
        sense: whether the limit is a smallest or a largest value; absent for a rank.
        limit: the limit; absent for a rank.
        value: value of the limited quantity at the pose; null if it is not known, and for a rank.
        pose: the pose; null if none is known.
        reason: reason for an open outcome, or how a singular pose was computed; absent without a reason.
        dimension: length, angle, or another dimension of the limited quantity; angles are in radians.
    """

    name: str
    outcome: Outcome
    key: Absent[str]
    unit: Absent[str]
    sense: Absent[Sense]
    limit: Annotated[float | None, Mark.ABSENT, Measure.NUMBER]
    value: Annotated[Known, Measure.NUMBER]
    pose: WorkspacePose | None
    reason: Absent[str]
    dimension: Hidden[Dimension] = Dimension.NUMBER

    @classmethod
    def of(cls, row: object, units: Units | None = None, /, **given: Any) -> "RangeStop":  # noqa: ANN401 - as fields
        """Return a copy, as :meth:`.JsonObject.of` does; the unit of a plain number stays an empty text."""
        return super().of(row, units, **{"unit": getattr(row, "unit", None), **given})


class RangeEnd(JsonObject):
    """An end of a proved range.

    Attributes:
        value: end of the range; all claims are proved from the start pose to this value.
        failed: known value beyond the end, and nearest to it, at which a claim is not proved; absent if the end is the
            end of the requested range.
        stop: claim that is not proved at ``failed``; absent without ``failed``.
        dimension: length or angle; angles are in radians.
    """

    value: Shown
    failed: Annotated[float | None, Mark.ABSENT, Measure.NUMBER]
    stop: Annotated[RangeStop | None, Mark.ABSENT, Key("limited_by")]
    dimension: Hidden[Dimension] = Dimension.NUMBER


class AxisRange(JsonObject):
    """Free travel along one coordinate of the pose.

    Attributes:
        axis: name of the coordinate: ``x``, ``y``, ``z``, ``roll``, ``pitch`` or ``yaw``.
        unit: unit of the values in the case.
        at: value of the coordinate at the pose.
        lower: the lower end of the proved range about the pose.
        upper: the upper end of the range.
        dimension: length or angle; angles are in radians.
    """

    axis: str
    unit: str
    at: Shown
    lower: RangeEnd
    upper: RangeEnd
    dimension: Hidden[Dimension] = Dimension.NUMBER


class PairRange(JsonObject):
    """Free travel along two coordinates together.

    Attributes:
        axes: names of the two coordinates.
        factor: scale factor, at most 1, of the box of both ranges about the pose in which all claims are proved.
        failed: smallest known scale factor at which a claim is not proved; absent if the whole box is proved.
        stop: claim that is not proved at ``failed``; absent without ``failed``.
    """

    axes: tuple[str, ...]
    factor: float
    failed: Absent[float]
    stop: Annotated[RangeStop | None, Mark.ABSENT, Key("limited_by")]
