"""Limits on the motion of any joint of a robot given joint by joint: ranges from home, and cones.

An angle is measured from home, within half a turn to either side. Where it is an unknown ``q`` of the program, the
limit is on ``q``. Otherwise its sine s and cosine c, times one positive number r, follow from the displacements of the
two bodies of the joint. The constraint is then on

    sin(q/2) = s / sqrt(2 r (r + c)),    r = sqrt(s^2 + c^2)

which grows with the angle from -1 to 1. It is smooth except at half a turn, where the angle itself jumps.

A cone of a universal or spherical joint is limited by the cosine of the angle between a link that ends at the joint and
an axis that is fixed in the body on the other side of the joint.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, NamedTuple, Self

import casadi as ca
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension, Model
from ....models.legs import angle_between
from ....models.limbjoints import JointCone as Cone
from ....models.limbjoints import JointCoordinate, LimbJoint
from ...errors import CaseError, listing
from ...units import Units
from ..table import Table, Vector
from ..toml import TomlValue
from .constraint import LENGTH, BoundedConstraint, Reading, between
from .interval import IntervalTable, two_sided
from .joints import COSINE_OF_ANGLE, HALF_ANGLE, Triple, check_axis, triple, unit_axes
from .limit import Limit, LimitedCase, NumberRange, PosedRobot, Ranges, TableField, Written

#: Keys of a table that limit one of several coordinates of a joint.
PARTS = ("first", "second", "angle", "stroke")
#: So many joints are listed in a message.
_LISTED = 12


class JointTable(IntervalTable):
    """The motion of a joint from home."""

    first: IntervalTable | None = Field(default=None, description="angle of a universal joint's first axis")
    second: IntervalTable | None = Field(default=None, description="angle of its second axis")
    angle: IntervalTable | None = Field(default=None, description="angle of a cylindrical joint")
    stroke: IntervalTable | None = Field(default=None, description="displacement of a cylindrical joint")
    cone: FiniteFloat | None = Field(
        default=None, description="half angle of the cone of a universal or spherical joint"
    )
    axis: Vector | None = Field(default=None, description="axis of the cone at home; the link's direction if left out")


class StatedMotion(NamedTuple):
    """A range or a cone as a case file states it: the joint, the part of its table, and the table."""

    joint: str
    part: str
    table: JointTable


class LimitOnJoint(Limit[StatedMotion], abc.ABC):
    """A limit on all joints that one text names."""

    joint: str
    needs_joints: ClassVar[bool] = True

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limits of this type that a case file states.

        Raises:
            CaseError: a table of a joint contradicts itself.
        """
        for joint, table in (getattr(limits, "joint", None) or {}).items():
            for part in cls.stated(joint, table):
                yield cls.from_table(Written(f"joint.{joint}", StatedMotion(joint, part, table), limits, model, units))

    @classmethod
    @abc.abstractmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the parts of a joint's table that are limits of this type.

        Raises:
            CaseError: the table contradicts itself.
        """

    def joints(self, model: Model) -> list[LimbJoint]:
        """Return the joints that are meant.

        Raises:
            CaseError: the robot has no such joint.
        """
        found = [each for each in model.joints if each.is_called(self.joint)]
        if not found:
            raise CaseError(f"limits.joint.{self.joint}", f"is no joint of {model.name!r}; it has {_known(model)}")
        return found


def _known(model: Model) -> str:
    """Return the names and labels of a robot's joints for a sentence."""
    names = list(dict.fromkeys(each.name for each in model.joints if each.name))
    labels = [each.label for each in model.joints]
    several = [f"and {len(labels) - _LISTED} more"] if len(labels) > _LISTED else []
    return listing([*names, *labels[:_LISTED], *several])


def _angle_from_half_sine(value: float) -> float:
    """Return the angle whose half has a sine."""
    return 2 * math.asin(min(max(value, -1.0), 1.0))


def _slope_of_half_sine(value: float) -> float:
    """Return the derivative of ``sin(angle/2)`` at a value of it."""
    return math.sqrt(max(1 - value * value, 0.0)) / 2


def _half_sine(angle: SX) -> SX:
    """Return ``sin(angle/2)``, which does not fall beyond half a turn."""
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
    """Smallest and largest coordinate of a joint from home, at every pose: its angle, or the displacement of a slide.

    Attributes:
        joint: name of the joint in the robot file, which means that joint of every limb; limb and name, ``"2:slide"``;
            or limb and place from the base on, ``"2:3"``.
        part: the coordinate of a joint that has two: ``"first"`` or ``"second"`` of a universal joint, ``"angle"`` or
            ``"stroke"`` of a cylindrical joint; empty for other joints.
        min: smallest value, radians or length; None where there is none.
        max: largest value; None where there is none.
    """

    joint: str
    part: str = ""
    _: KW_ONLY
    min: float | None = None
    max: float | None = None

    key: ClassVar[str] = "joint"
    table: ClassVar[Any] = dict[str, JointTable]
    description: ClassVar[str] = "motion of joints from home, by name, or by limb and place as in 2:3"

    @classmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the parts of a joint's table that state ranges.

        Raises:
            CaseError: the table has neither a range nor a cone.
        """
        parts = [part for part in PARTS if getattr(table, part) is not None]
        whole = [""] if table.min is not None or table.max is not None else []
        if not parts and not whole and table.cone is None:
            raise CaseError(f"limits.joint.{joint}", f"must have min, max, {', '.join(PARTS)} or cone")
        return [*whole, *parts]

    @classmethod
    def from_table(cls, written: Written[StatedMotion]) -> Self:
        """Return the limit that a case file writes."""
        joint, part, table = written.value
        # An unknown joint has no dimension, and is refused when the case is checked.
        known = [each for each in written.model.joints if each.is_called(joint)]
        dimensions = (one.dimension for each in known for one in each.coordinates if one.part == part)
        allowed = NumberRange(next(dimensions, Dimension.LENGTH))
        interval = getattr(table, part) if part else table
        return cls(joint, part, **written.numbers(two_sided(allowed), interval))

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit."""
        (interval,) = super().to_keys(model, units).values()
        return {self.key: {self.joint: {self.part: interval} if self.part else interval}}

    def ranges(self, model: Model) -> Ranges:
        """Return the range of both numbers.

        Raises:
            CaseError: there is no such joint, a joint lacks the coordinate, or it is an angle of one joint and a length
                of another.
        """
        key = f"limits.{self.name}"
        found = {_coordinate(each, self.part, key).dimension for each in self.joints(model)}
        if len(found) > 1:
            raise CaseError(key, "means joints that turn and joints that slide; name one of them by limb and place")
        dimension = found.pop()
        largest = math.pi if dimension is Dimension.ANGLE else math.inf
        return two_sided(NumberRange(dimension, above=-math.inf, most=largest, least=-largest))

    @property
    def name(self) -> str:
        """Dotted key of this limit in ``[limits]``."""
        return f"joint.{self.joint}{f'.{self.part}' if self.part else ''}"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the coordinate of each joint, or the sine of half of its angle."""
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
        part: name of the coordinate; empty for the only one.
        key: dotted key of the limit, for messages.

    Raises:
        CaseError: the joint has no such coordinate, or it is not known.
    """
    names = _names(joint)
    if part not in names:
        whose = f"joint {joint.label} is of type {joint.type}"
        if not names:
            raise CaseError(key, f"{whose}, which may have only cone")
        allowed = "min and max" if names == ("",) else f"{names[0]} and {names[1]}, each with min and max"
        raise CaseError(key, f"{whose}, which may have {allowed}{', and cone' if joint.type == 'U' else ''}")
    for each in joint.coordinates:
        if each.part == part:
            return each
    raise CaseError(key, f"the motion of joint {joint.label} is not known: {joint.unknown}")


def _names(joint: LimbJoint) -> Sequence[str]:
    """Return the names of a joint's coordinates, which follow from its type."""
    return {"U": ("first", "second"), "C": ("angle", "stroke"), "S": ()}.get(joint.type, ("",))


@dataclass(frozen=True)
class JointCone(LimitOnJoint):
    """Largest angle between a link and an axis on the other side of its universal or spherical joint, at every pose.

    Attributes:
        joint: as for :class:`JointMotion`.
        max: half angle of the cone, radians, above 0 and at most half a turn.
        axis: direction of the axis at home, for the limb that the robot file writes: it turns with the copies of the
            limb. None for the direction of the link at home.
    """

    joint: str
    max: float
    axis: Triple | None = None

    key: ClassVar[str] = "joint.cone"
    description: ClassVar[str] = "cones of universal and spherical joints"

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return nothing: the key is that of :class:`JointMotion`."""
        return {}

    @classmethod
    def stated(cls, joint: str, table: JointTable) -> list[str]:
        """Return the part of a joint's table that states a cone.

        Raises:
            CaseError: the table has an axis without a cone.
        """
        if table.axis is not None and table.cone is None:
            raise CaseError(f"limits.joint.{joint}.axis", "means nothing without cone")
        return [] if table.cone is None else ["cone"]

    @classmethod
    def from_table(cls, written: Written[StatedMotion]) -> Self:
        """Return the limit that a case file writes."""
        joint, _, table = written.value
        largest = written.internal(table.cone or 0.0, Dimension.ANGLE)
        if table.axis is None:
            return cls(joint, largest)
        return cls(joint, largest, triple(table.axis))

    def angles(self, model: Model) -> Mapping[str, float | None]:  # noqa: ARG002 - angles need no robot
        """Return the cone's half angle."""
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
        """Refuse an unknown joint, one without a cone, an angle out of its range, and an axis without direction.

        Raises:
            CaseError: in the words of a case file.
        """
        for joint in self.joints(case.model):
            if joint.cone is None:
                reason = joint.unknown if joint.type in ("U", "S") else "a cone is for joints U and S"
                raise CaseError(f"limits.{self.name}", f"joint {joint.label} ({joint.type}) has none: {reason}")
        case.check_number(self.name, self.max, HALF_ANGLE)
        if self.axis is not None:
            check_axis(f"limits.joint.{self.joint}.axis", self.axis)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return minus the cosine of the angle of each joint."""
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
        """Return the current unit axis (3, 1) of a joint's cone."""
        if self.axis is None:
            return cone.other @ cone.home
        (unit,) = unit_axes((self.axis,), 1)
        return cone.other @ (SX(cone.turn.tolist()) @ SX(unit.tolist()))
