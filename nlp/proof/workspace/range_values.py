"""Ranges of the coordinates of a pose, of each alone and of each two at once, with the claims that end them."""

from typing import Annotated, Any

from ....models import Dimension
from ...case.task import Sense
from ...evidence.state import WorkspacePose
from ...system.jsonvalues import Absent, Hidden, JsonObject, Key, Known, Mark, Measure, Shown
from ...units import Units
from .verdict import Outcome


class RangeStop(JsonObject):
    """A claim that is not proved at a pose, or on the way to it.

    Attributes:
        name: name of the claim.
        outcome: outcome of the claim: refuted at the pose, or open on the way to it.
        key: dotted key, below ``limits``, of the limit in the case; absent of a rank.
        unit: unit of the limit, empty for a plain number; absent of a rank.
        sense: kind of the limit, a smallest or a largest value; absent of a rank.
        limit: the limit; absent of a rank.
        value: value of the number at the pose; null where it is not known, and of a rank.
        pose: the pose; null where none is known.
        reason: reason for an open outcome, or how a singular pose was found; absent without one.
        dimension: dimension of the number, in radians for an angle.
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
        value: value up to which everything is proved.
        failed: the first value known beyond it at which not everything is; absent at the end of the largest range.
        stop: the claim that fails there; absent with ``failed``.
        dimension: dimension of the coordinate, in radians for an angle.
    """

    value: Shown
    failed: Annotated[float | None, Mark.ABSENT, Measure.NUMBER]
    stop: Annotated[RangeStop | None, Mark.ABSENT, Key("limited_by")]
    dimension: Hidden[Dimension] = Dimension.NUMBER


class AxisRange(JsonObject):
    """How far a coordinate can move alone.

    Attributes:
        axis: name of the coordinate: ``x``, ``y``, ``z``, ``roll``, ``pitch`` or ``yaw``.
        unit: unit of the values in the case.
        at: value at the pose.
        lower: the lower end of the proved range about the pose.
        upper: the upper end of the range.
        dimension: dimension of the coordinate, in radians for an angle.
    """

    axis: str
    unit: str
    at: Shown
    lower: RangeEnd
    upper: RangeEnd
    dimension: Hidden[Dimension] = Dimension.NUMBER


class PairRange(JsonObject):
    """How far two coordinates can move at once.

    Attributes:
        axes: names of both.
        factor: factor of their ranges for which everything is proved in the box of both, about the pose; at most 1.
        failed: the smallest factor known at which not everything is; absent where the whole box is proved.
        stop: the claim that fails there; absent with ``failed``.
    """

    axes: tuple[str, ...]
    factor: float
    failed: Absent[float]
    stop: Annotated[RangeStop | None, Mark.ABSENT, Key("limited_by")]
