"""Limits on joint coordinates and on cones of joints, for robots given joint by joint.

Angles are measured from home, up to half a turn to either side. If the angle is a variable ``q`` of the program, the
limit is a bound on ``q``. Otherwise the poses of the two links give its sine s and cosine c, both times a positive
factor, and the constraint is on a function that increases with the angle from -1 to 1, smooth below half a turn:

    sin(q/2) = s / sqrt(2 r (r + c)),    r = sqrt(s^2 + c^2)

A cone of a universal or spherical joint is limited by the cosine of the angle between a link at the joint and an axis
in the link on the other side.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Self

import casadi as ca
from casadi import SX
from pydantic import Field, FiniteFloat, model_validator

from ....models import Dimension, Model
from ....models.legs import angle_between
from ....models.limbjoints import JointCone as Cone
from ....models.limbjoints import JointCoordinate, LimbJoint
from ...errors import CaseError, listing
from ...units import Units
from ..checks import check_rate
from ..pose import MISSING_RATE
from ..table import Table, Vector, fault_of
from ..toml import TomlValue
from .constraint import LENGTH, BoundedConstraint, Reading, between
from .interval import IntervalTable, two_sided
from .joints import COSINE_OF_ANGLE, HALF_ANGLE, Triple, check_axis, triple, unit_axes
from .limit import Limit, LimitedCase, NumberRange, PosedRobot, Ranges, TableField, Written

#: Keys for one of several coordinates of a joint.
PARTS = ("first", "second", "angle", "stroke")
#: Largest number of joints listed in a message.
_LISTED = 12


class JointTable(IntervalTable):
    """Range of a joint coordinate from home, or cone of a joint."""

    per: Literal["path"] | None = Field(
        default=None,
        description="path: a driven joint that the pose does not determine changes along the tool path; with "
        "objective.over = 'path', the same coordinate everywhere if left out",
    )
    rate: float | None = Field(
        default=None, description="largest change per second of a joint with per = 'path'; inf for no limit"
    )
    first: IntervalTable | None = Field(
        default=None, description="range of the angle about the first axis of a universal joint, from home"
    )
    second: IntervalTable | None = Field(
        default=None, description="range of the angle about the second axis of a universal joint, from home"
    )
    angle: IntervalTable | None = Field(
        default=None, description="range of the angle of a cylindrical joint, from home"
    )
    stroke: IntervalTable | None = Field(
        default=None, description="range of the displacement of a cylindrical joint, from home"
    )
    cone: FiniteFloat | None = Field(
        default=None, description="half angle of the cone of a universal or spherical joint"
    )
    axis: Vector | None = Field(
        default=None, description="axis of the cone, in the home configuration; the direction of the link if left out"
    )

    @model_validator(mode="after")
    def _refuse_rate_alone(self) -> JointTable:
        """Refuse a change along the path without range or rate, and a rate without a change along the path."""
        if self.per is None and self.rate is not None:
            raise fault_of("rate", 'has an effect only with per = "path"')
        if self.per is not None and (self.min is None or self.max is None):
            raise fault_of("per", "needs min and max of the joint")
        if self.per is not None and self.rate is None:
            raise fault_of("rate", MISSING_RATE)
        return self


class StatedMotion(NamedTuple):
    """Range or cone in a case file: name of the joint, key within its table (empty for min and max), and the table."""

    joint: str
    part: str
    table: JointTable


class LimitOnJoint(Limit[StatedMotion], abc.ABC):
    """Limit on all joints that a name refers to.

    Attributes:
        joint: name of a joint, see :class:`JointMotion`.
    """

    joint: str
    needs_joints: ClassVar[bool] = True

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type in a case file.

        Raises:
            CaseError: the table of a joint contradicts itself.
        """
        for joint, table in (getattr(limits, "joint", None) or {}).items():
            for part in cls.stated(joint, table):
                yield cls.from_table(Written(f"joint.{joint}", StatedMotion(joint, part, table), limits, model, units))

    @classmethod
    @abc.abstractmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the keys within a joint's table that are limits of this type; an empty key stands for min and max.

        Raises:
            CaseError: the table contradicts itself.
        """

    def joints(self, model: Model) -> list[LimbJoint]:
        """Return the joints to which the name refers.

        Raises:
            CaseError: the robot has no such joint.
        """
        found = [each for each in model.joints if each.is_called(self.joint)]
        if not found:
            fault = f"no such joint of {model.name!r}; allowed: {_known(model)}"
            raise CaseError(f"limits.joint.{self.joint}", fault)
        return found


def _known(model: Model) -> str:
    """Return the names and labels of a robot's joints for a message."""
    names = list(dict.fromkeys(each.name for each in model.joints if each.name))
    labels = [each.label for each in model.joints]
    several = [f"and {len(labels) - _LISTED} more"] if len(labels) > _LISTED else []
    return listing([*names, *labels[:_LISTED], *several])


def _angle_from_half_sine(value: float) -> float:
    """Return the angle from the sine of its half."""
    return 2 * math.asin(min(max(value, -1.0), 1.0))


def _slope_of_half_sine(value: float) -> float:
    """Return the derivative of ``sin(angle/2)`` with respect to the angle, at a value of ``sin(angle/2)``."""
    return math.sqrt(max(1 - value * value, 0.0)) / 2


def _half_sine(angle: SX) -> SX:
    """Return ``sin(angle/2)``, constant beyond half a turn."""
    return ca.sin(ca.fmin(ca.fmax(angle, -ca.pi), ca.pi) / 2)


_HALF_SINE = Reading(
    Dimension.ANGLE,
    from_value=_angle_from_half_sine,
    slope=_slope_of_half_sine,
    to_value=_half_sine,
    above=-math.pi,
    most=math.pi,
)
_ANGLE = Reading(Dimension.ANGLE, above=-math.pi, most=math.pi)


@dataclass(frozen=True)
class JointMotion(LimitOnJoint):
    """Smallest and largest joint coordinate from home, at every pose: angle or displacement.

    Attributes:
        joint: name of the joint in the robot file, for this joint of every limb; or limb and name, such as
            ``"2:slide"``; or limb and number of the joint from the base on, such as ``"2:3"``.
        part: coordinate of a joint with two coordinates: ``"first"`` or ``"second"`` for a universal joint, ``"angle"``
            or ``"stroke"`` for a cylindrical joint; empty for other joints.
        min: smallest allowed coordinate, radians or length; None for no lower limit.
        max: largest allowed coordinate, radians or length; None for no upper limit.
        rate: largest change per second, radians or length, of a driven joint that the pose does not determine and that
            changes along the tool path; infinite for no limit. None for a joint that does not change by itself.
    """

    joint: str
    part: str = ""
    _: KW_ONLY
    min: float | None = None
    max: float | None = None
    rate: float | None = None

    key: ClassVar[str] = "joint"
    table: ClassVar[Any] = dict[str, JointTable]
    description: ClassVar[str] = (
        "ranges and cones of joints: by joint name, for this joint of every limb, or by limb and number, such as 2:3"
    )

    @classmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the keys within a joint's table with a range; an empty key stands for min and max.

        Raises:
            CaseError: the table has neither a range nor a cone.
        """
        parts = [part for part in PARTS if getattr(table, part) is not None]
        whole = [""] if table.min is not None or table.max is not None else []
        if not parts and not whole and table.cone is None:
            raise CaseError(f"limits.joint.{joint}", f"is empty: it must have min, max, {', '.join(PARTS)} or cone")
        return [*whole, *parts]

    @classmethod
    def from_table(cls, written: Written[StatedMotion]) -> Self:
        """Return the limit of a case file."""
        joint, part, table = written.value
        # The check of the case refuses an unknown joint later.
        known = [each for each in written.model.joints if each.is_called(joint)]
        dimensions = (one.dimension for each in known for one in each.coordinates if one.part == part)
        allowed = NumberRange(next(dimensions, Dimension.LENGTH))
        interval = getattr(table, part) if part else table
        rate = None if part or table.rate is None else written.internal(table.rate, allowed.dimension)
        return cls(joint, part, **written.numbers(two_sided(allowed), interval), rate=rate)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit."""
        (interval,) = super().to_keys(model, units).values()
        if self.rate is not None and isinstance(interval, Mapping):
            rate = units.written(self.rate, self.ranges(model)["max"].dimension)
            interval = {**interval, "per": "path", "rate": rate}
        return {self.key: {self.joint: {self.part: interval} if self.part else interval}}

    def ranges(self, model: Model) -> Ranges:
        """Return the allowed ranges of ``min`` and ``max``.

        Raises:
            CaseError: there is no such joint, a joint does not have the coordinate, or the coordinate is an angle for
                one joint and a length for another.
        """
        key = f"limits.{self.name}"
        found = {_coordinate(each, self.part, key).dimension for each in self.joints(model)}
        if len(found) > 1:
            labels = [each.label for each in self.joints(model)]
            fault = "matches both revolute and prismatic joints; name one, such as"
            raise CaseError(key, f'{fault} "{labels[0]}"')
        dimension = found.pop()
        largest = math.pi if dimension is Dimension.ANGLE else math.inf
        return two_sided(NumberRange(dimension, above=-math.inf, most=largest, least=-largest))

    def check(self, case: LimitedCase) -> None:
        """Check range and rate, and that the pose does not determine a joint with a rate.

        Raises:
            CaseError: a value is not allowed, or a joint with a rate is passive or follows from the pose.
        """
        super().check(case)
        if self.rate is None:
            return
        key, model = f"limits.{self.name}", case.model
        check_rate(self.rate, f"{key}.rate", self.ranges(model)["max"].dimension, case.units)
        if self.min is None or self.max is None:
            raise CaseError(f"{key}.per", "needs min and max of the joint", "path")
        free = model.undetermined
        driven = [each.joint for each in model.actuators]
        for joint in self.joints(model):
            if joint.label not in free:
                why = "follows from the pose" if joint.label in driven else "is not actuated"
                allowed = f"allowed: {listing(free)}" if free else "this robot has none"
                fault = f"joint {joint.label} {why}; only actuated joints that the pose does not determine can change"
                raise CaseError(f"{key}.per", f"{fault} along the path; {allowed}", "path")

    @property
    def name(self) -> str:
        """Dotted key of this limit in ``[limits]``."""
        return f"joint.{self.joint}{f'.{self.part}' if self.part else ''}"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the coordinate of each joint, or on the sine of half its angle."""
        for joint in pose.robot.joints:
            if joint.is_called(self.joint):
                coordinate = _coordinate(joint, self.part, f"limits.{self.name}")
                sine, cosine = coordinate.value, coordinate.cosine
                reading = _ANGLE if coordinate.dimension is Dimension.ANGLE else LENGTH
                expression, exact = sine, None
                if cosine is not None:
                    r = ca.sqrt(sine**2 + cosine**2)
                    expression, reading, exact = sine / ca.sqrt(2 * r * (r + cosine)), _HALF_SINE, coordinate.measured
                yield between(
                    f"{self.name} joint {joint.label}{pose.where}",
                    expression,
                    reading,
                    self.name,
                    lower=self.min,
                    upper=self.max,
                    exact=exact,
                )


def _coordinate(joint: LimbJoint, part: str, key: str) -> JointCoordinate:
    """Return a coordinate of a joint.

    Args:
        joint: the joint.
        part: name of the coordinate; empty for a joint with one coordinate.
        key: dotted key of the limit, for messages.

    Raises:
        CaseError: the joint has no such coordinate, or the coordinate cannot be computed.
    """
    names = _names(joint)
    if part not in names:
        kind = f"joint {joint.label} is of type {joint.type}"
        if not names:
            raise CaseError(key, f"{kind}; allowed is only cone")
        allowed = "min and max" if names == ("",) else f"{names[0]} and {names[1]}, each with min and max"
        raise CaseError(key, f"{kind}; allowed are {allowed}{', and cone' if joint.type == 'U' else ''}")
    for each in joint.coordinates:
        if each.part == part:
            return each
    raise CaseError(key, f"the motion of joint {joint.label} is not known: {joint.unknown}")


def _names(joint: LimbJoint) -> Sequence[str]:
    """Return the names of a joint's coordinates, from its type."""
    return {"U": ("first", "second"), "C": ("angle", "stroke"), "S": ()}.get(joint.type, ("",))


@dataclass(frozen=True)
class JointCone(LimitOnJoint):
    """Cone of a universal or spherical joint: largest angle between a link and an axis in the link on the other side.

    Attributes:
        joint: name of the joint, see :class:`JointMotion`.
        max: half angle of the cone, radians, above 0 and at most half a turn.
        axis: (3,) direction of the cone's axis in the home configuration, for the limb in the robot file; it is rotated
            with the copies of the limb. None for the direction of the link at home.
    """

    joint: str
    max: float
    axis: Triple | None = None

    key: ClassVar[str] = "joint.cone"
    description: ClassVar[str] = "half angle of the cone of universal and spherical joints"

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return no key: cones are in the tables of :class:`JointMotion`."""
        return {}

    @classmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the key of the cone if a joint's table has one.

        Raises:
            CaseError: the table has an axis without a cone.
        """
        if table.axis is not None and table.cone is None:
            raise CaseError(f"limits.joint.{joint}.axis", "has no effect without cone; give its half angle too")
        return [] if table.cone is None else ["cone"]

    @classmethod
    def from_table(cls, written: Written[StatedMotion]) -> Self:
        """Return the limit of a case file."""
        joint, _, table = written.value
        largest = written.internal(table.cone or 0.0, Dimension.ANGLE)
        if table.axis is None:
            return cls(joint, largest)
        return cls(joint, largest, triple(table.axis))

    def angles(self, model: Model) -> Mapping[str, float | None]:  # noqa: ARG002 - angles need no robot
        """Return the half angle of the cone."""
        return {self.name: self.max}

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - angles need no robot
        """Return the keys of ``[limits]`` that state this limit."""
        cone: dict[str, TomlValue] = {"cone": units.written(self.max, Dimension.ANGLE)}
        return {"joint": {self.joint: cone if self.axis is None else {**cone, "axis": self.axis}}}

    @property
    def name(self) -> str:
        """Dotted key of this limit in ``[limits]``."""
        return f"joint.{self.joint}.cone"

    def check(self, case: LimitedCase) -> None:
        """Check joint, half angle and axis.

        Raises:
            CaseError: a joint is unknown or cannot have a cone, the angle is outside of its range, or the axis is zero.
        """
        for joint in self.joints(case.model):
            if joint.cone is None:
                reason = joint.unknown if joint.type in ("U", "S") else "cone is allowed only for joints U and S"
                raise CaseError(f"limits.{self.name}", f"joint {joint.label} ({joint.type}) has no cone: {reason}")
        case.check_number(self.name, self.max, HALF_ANGLE)
        if self.axis is not None:
            check_axis(f"limits.joint.{self.joint}.axis", self.axis)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on minus the cosine of the angle of each joint."""
        for joint in pose.robot.joints:
            if joint.is_called(self.joint) and joint.cone is not None:
                axis, link = self._axis(joint.cone), joint.cone.link
                yield between(
                    f"{self.name} joint {joint.label}{pose.where}",
                    -ca.dot(axis, link),
                    COSINE_OF_ANGLE,
                    ("", self.name),
                    upper=self.max,
                    exact=angle_between(axis, link),
                )

    def _axis(self, cone: Cone) -> SX:
        """Return the unit axis (3, 1) of a joint's cone at the pose."""
        if self.axis is None:
            return cone.other @ cone.home
        (unit,) = unit_axes((self.axis,), 1)
        return cone.other @ (SX(cone.turn.tolist()) @ SX(unit.tolist()))
