"""Limits on the motion of any joint of a robot given joint by joint: ranges from home.

An angle is measured from home, within half a turn to either side. Where it is an unknown ``q`` of the program, it is
limited as it is. Otherwise its sine s and cosine c, times one positive number r, follow from the displacements of the
two bodies of the joint. The constraint is then on

    sin(q/2) = s / sqrt(2 r (r + c)),    r = sqrt(s^2 + c^2)

which grows with the angle from -1 to 1. It is smooth except at half a turn, where the angle itself jumps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Self

import casadi as ca
from casadi import SX

from ....models import Dimension, Model
from ....models.limbjoints import JointCoordinate, LimbJoint
from ...errors import CaseError
from ...units import Units
from ..toml import TomlValue
from .constraint import LENGTH, BoundedConstraint, Reading, between
from .joint_table import PARTS, JointTable, LimitOnJoint, StatedMotion
from .limit import LimitedCase, PosedRobot, Written


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
        interval = getattr(table, part) if part else table
        found = cls(joint, part, min=interval.min, max=interval.max)
        # An unknown joint has no dimension, and is refused when the case is checked.
        known = [each for each in written.model.joints if each.is_called(joint)]
        dimension = next((one.dimension for each in known for one in each.coordinates if one.part == part), None)
        ends = (None if end is None else written.internal(end, dimension or Dimension.LENGTH) for end in found.ends)
        smallest, largest = ends
        return cls(joint, part, min=smallest, max=largest)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit."""
        dimension = self._dimension(model)
        ends = zip(("min", "max"), self.ends, strict=True)
        interval: dict[str, TomlValue] = {k: units.written(v, dimension) for k, v in ends if v is not None}
        return {self.key: {self.joint: {self.part: interval} if self.part else interval}}

    @property
    def name(self) -> str:
        """Dotted key of this limit in ``[limits]``."""
        return f"joint.{self.joint}{f'.{self.part}' if self.part else ''}"

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Smallest and largest value."""
        return self.min, self.max

    def check(self, case: LimitedCase) -> None:
        """Refuse an unknown joint, a coordinate that a joint lacks, and numbers out of range or crossed.

        Raises:
            CaseError: in the words of a case file.
        """
        key = f"limits.{self.name}"
        for joint in self.joints(case.model):
            _coordinate(joint, self.part, key)
        dimension = self._dimension(case.model)
        if self.min is None and self.max is None:
            raise CaseError(key, "must have min, max, or both")
        largest = math.pi if dimension is Dimension.ANGLE else math.inf
        for end, value in (("min", self.min), ("max", self.max)):
            case.check_number(f"{self.name}.{end}", value, dimension, above=-math.inf, most=largest)
            if value is not None and value < -largest:
                fault = f"must be at least {case.units.text(-largest, dimension)}"
                raise CaseError(f"{key}.{end}", fault, case.units.shown(value, dimension))
        if self.min is not None and self.max is not None and not self.min < self.max:
            fault = f"must be below max = {case.units.text(self.max, dimension)}"
            raise CaseError(f"{key}.min", fault, case.units.shown(self.min, dimension))

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

    def _dimension(self, model: Model) -> Dimension:
        """Return the dimension of the coordinate.

        Raises:
            CaseError: it is an angle of one joint and a length of another.
        """
        key = f"limits.{self.name}"
        found = {_coordinate(each, self.part, key).dimension for each in self.joints(model)}
        if len(found) > 1:
            raise CaseError(key, "means joints that turn and joints that slide; name one of them by limb and place")
        return found.pop()


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
