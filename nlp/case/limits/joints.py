"""Limits on the angles of passive joints of legs: cones about mounting axes.

With the unit mounting axis ``n`` and the leg ``d`` from its base joint to its platform joint, both in the world frame,
the angle between them is limited by its cosine, ``-n . d / |d| <= -cos(max)``.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias

import casadi as ca
from casadi import SX
from pydantic import (
    Discriminator,
    Field,
    FiniteFloat,
    Tag,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from ....models import Dimension, FloatArray, Model, RobotInstance, frozen_array, matrix_from_axis_angle
from ....models.legs import angle_between
from ...errors import CaseError
from ...units import Units
from ..table import Table, Vector, fault_of
from ..toml import TomlValue
from .constraint import BoundedConstraint, Call, Form, Reading, between
from .limit import Limit, LimitedCase, Measures, NumberRange, PosedRobot, TableField, Written

#: Three numbers.
Triple: TypeAlias = tuple[float, float, float]
#: Allowed range of the half angle of a cone.
HALF_ANGLE = NumberRange(Dimension.ANGLE, most=math.pi)


def _angle(value: float) -> float:
    """Return the angle from minus its cosine."""
    return math.acos(min(max(-value, -1.0), 1.0))


def _slope(value: float) -> float:
    """Return the derivative of ``-cos(angle)`` with respect to the angle, at a value of ``-cos(angle)``."""
    return math.sqrt(max(1 - value * value, 0.0))


def _minus_cosine(angle: SX) -> SX:
    return -ca.cos(angle)


def _minus_cosine_of_leg(axis_and_span: SX) -> SX:
    """Return minus the cosine (1, 1) of the angle between a unit axis and the span of a leg, stacked (6, 1)."""
    axis, span = axis_and_span[:3], axis_and_span[3:]
    return -(ca.dot(axis, span) / ca.norm_2(span))


def _turned(direction: SX, rotation: SX, plate: str) -> SX:
    """Return a direction (3, 1) of a plate's frame in the world frame: rotated (3, 3) only for the platform."""
    return rotation @ direction if plate == "platform" else direction


def _minus_cosine_from_home(inputs: SX, plate: str) -> SX:
    """Return minus the cosine (1, 1) of the angle between a leg and its direction at the mounting pose.

    Args:
        inputs: (30, 1) rotation by columns and position at the mounting pose, platform joint, base joint, rotation by
            columns and span at the pose.
        plate: plate of the joint, ``base`` or ``platform``.
    """
    R, p, platform, base = ca.reshape(inputs[:9], 3, 3), inputs[9:12], inputs[12:15], inputs[15:18]
    span = p + R @ platform - base
    axis = _turned(_turned(span / ca.norm_2(span), R.T, plate), ca.reshape(inputs[18:27], 3, 3), plate)
    return _minus_cosine_of_leg(ca.vertcat(axis, inputs[27:]))


#: Reading of ``-cos(angle)`` as the angle.
COSINE_OF_ANGLE = Reading(
    Dimension.ANGLE, from_value=_angle, slope=_slope, to_value=_minus_cosine, above=0.0, most=math.pi
)


def _word(value: object, handler: ValidatorFunctionWrapHandler) -> object:
    """Return a word for mounting axes; for other texts, raise an error with all allowed forms."""
    try:
        return handler(value)
    except ValidationError:
        raise fault_of("", "must be 'normal' or 'home', a list of 3 numbers, or a list of such lists") from None


def _kind_of_axes(value: object) -> str:
    if not isinstance(value, list):
        return "<word>"
    return "<lists>" if value and isinstance(value[0], list) else "<list>"


Axes = Annotated[
    Annotated[Literal["normal", "home"], WrapValidator(_word), Tag("<word>")]
    | Annotated[Vector, Tag("<list>")]
    | Annotated[list[Vector], Tag("<lists>")],
    Discriminator(_kind_of_axes),
]


class ConeTable(Table):
    """Cone of a passive joint."""

    max: FiniteFloat = Field(description="largest angle between leg and mounting axis: the half angle of the cone")
    about: Axes = Field(
        default="normal",
        description="mounting axes: normal (z axis of base or platform), home (direction of the leg at limits.home), "
        "a direction in the frame of base or platform, or a list with one direction for each leg",
    )


@dataclass(frozen=True)
class MountingPose:
    """Mounting pose, at which each leg is on the axis of its joint cones.

    Attributes:
        position: (3,) origin of the platform frame in the world frame, length.
        axis: (3,) axis of rotation, of any length but zero.
        angle: angle of rotation, radians.
    """

    position: Triple
    axis: Triple = (0.0, 0.0, 1.0)
    angle: float = 0.0


class HomeTable(Table):
    """Mounting pose, at which each leg is on the axis of its joint cones."""

    position: Vector = Field(description="origin of the platform frame in the world frame")
    axis: Vector = Field(default=list(MountingPose.axis), description="axis of rotation in the world frame")
    angle: FiniteFloat = Field(default=MountingPose.angle, description="angle of rotation about the axis")


NumberOrCone = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[ConeTable, Tag("<range>")],
    Discriminator(lambda value: "<range>" if isinstance(value, dict | ConeTable) else "<number>"),
]


@dataclass(frozen=True)
class JointAngle(Limit[float | ConeTable], abc.ABC):
    """Cones of the passive joints of base or platform: largest angle between a leg and its mounting axis.

    Attributes:
        max: half angle of the cone, radians, above 0 and at most half a turn.
        about: mounting axes, pointing from base to platform: None for the z axis of base or platform; a
            :class:`MountingPose` for the direction of each leg at this pose; or one direction in the frame of base or
            platform for all joints, or one for each.
        plate: plate of the joints, ``base`` or ``platform``.
    """

    max: float
    about: MountingPose | tuple[Triple, ...] | None = None

    plate: ClassVar[Literal["base", "platform"]]
    table: ClassVar[Any] = NumberOrCone
    needs_legs: ClassVar[bool] = True

    @classmethod
    def from_table(cls, written: Written[float | ConeTable]) -> Self:
        """Return the limit of a case file.

        Raises:
            CaseError: the cones are about ``limits.home``, which is missing.
        """
        if not isinstance(written.value, ConeTable):
            return cls(written.internal(written.value, Dimension.ANGLE))
        largest = written.internal(written.value.max, Dimension.ANGLE)
        match written.value.about:
            case "normal":
                return cls(largest)
            case "home":
                home = _home(written.limits)
                if home is None:
                    raise CaseError("limits.home", f'is missing: limits.{cls.key} with about = "home" needs it')
                angle = written.internal(home.angle, Dimension.ANGLE)
                return cls(largest, MountingPose(triple(home.position), triple(home.axis), angle))
            case axes:
                rows = [row for row in axes if isinstance(row, list)]
                flat = [part for part in axes if not isinstance(part, list)]
                return cls(largest, tuple(triple(row) for row in rows or [flat]))

    def angles(self, model: Model) -> Mapping[str, float | None]:  # noqa: ARG002 - angles need no robot
        """Return the half angle of the cones, and the angle of the mounting pose."""
        found: dict[str, float | None] = {f"{self.key}.max": self.max}
        return {**found, "home.angle": self.about.angle} if isinstance(self.about, MountingPose) else found

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - angles need no robot
        """Return the keys of ``[limits]`` that state this limit, with the mounting pose."""
        largest = units.written(self.max, Dimension.ANGLE)
        if self.about is None:
            return {self.key: largest}
        if isinstance(self.about, MountingPose):
            home = self.about
            angle = units.written(home.angle, Dimension.ANGLE)
            table: TomlValue = {"position": home.position, "axis": home.axis, "angle": angle}
            return {self.key: {"max": largest, "about": "home"}, "home": table}
        return {self.key: {"max": largest, "about": self.about[0] if len(self.about) == 1 else self.about}}

    def check(self, case: LimitedCase) -> None:
        """Check half angle and mounting axes.

        Raises:
            CaseError: the angle is outside of its range, an axis is zero, or there is not one axis for each leg.
        """
        case.check_number(f"{self.key}.max", self.max, HALF_ANGLE)
        if self.about is None:
            return
        key, legs = f"limits.{self.key}.about", len(case.model.legs)
        axes: Sequence[Triple] = [self.about.axis] if isinstance(self.about, MountingPose) else self.about
        if len(axes) not in (1, legs):
            raise CaseError(key, f"must be one direction, or one for each of the {legs} legs, got {len(axes)}")
        for axis in axes:
            check_axis(key, axis)
        home = self.about
        if isinstance(home, MountingPose) and not all(map(math.isfinite, (*home.position, home.angle))):
            raise CaseError(key, "position and angle of the mounting pose must be finite")

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether a robot has legs and is not given joint by joint; the latter use ``limits.joint``."""
        return super().is_for(model) and not model.joints

    @property
    def reference(self) -> str:
        """Name of the mounting axes."""
        if self.about is None:
            return "normal"
        return "home" if isinstance(self.about, MountingPose) else "axis"

    def measures(self, robot: RobotInstance) -> Measures | None:
        """Return the angle of each joint; None for the default axes, for which the model has this quantity."""
        if self.about is None or not robot.legs:
            return None
        angles = [
            angle_between(_turned(axis, robot.rotation, self.plate), leg.span)
            for leg, axis in zip(robot.legs, self._mounting_axes(robot), strict=True)
        ]
        return Measures(tuple(leg.name for leg in robot.legs), ca.vertcat(*angles), Dimension.ANGLE)

    def cones(self, robot: RobotInstance) -> list[SX]:
        """Return the centre and the unit axis (6, 1) of each joint's cone in the world frame."""
        rows = zip(robot.legs, self._mounting_axes(robot), strict=True)
        # The axis points into the cone: from base to platform at the base, and from the platform to the base there.
        if self.plate == "base":
            return [ca.vertcat(leg.base, axis) for leg, axis in rows]
        R, p = robot.rotation, robot.position
        return [ca.vertcat(p + R @ leg.platform, -(R @ axis)) for leg, axis in rows]

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the cosine of each joint's angle."""
        robot = pose.robot
        for leg, axis in zip(robot.legs, self._mounting_axes(robot), strict=True):
            if isinstance(self.about, MountingPose):
                R, p = self._home_pose(self.about)
                form = Form(_minus_cosine_from_home, (self.plate,))
                inputs = ca.veccat(R, p, leg.platform, leg.base, robot.rotation, leg.span)
            else:
                form = Form(_minus_cosine_of_leg)
                inputs = ca.vertcat(_turned(axis, robot.rotation, self.plate), leg.span)
            name = f"{self.key} limb {leg.name}{pose.where}"
            yield between(name, Call(form, inputs), COSINE_OF_ANGLE, self.key, upper=self.max)

    def _mounting_axes(self, robot: RobotInstance) -> list[SX]:
        """Return the unit mounting axis (3, 1) of each joint in the frame of its plate."""
        if self.about is None:
            return [SX([0, 0, 1])] * len(robot.legs)
        if isinstance(self.about, MountingPose):
            R, p = self._home_pose(self.about)
            spans = [p + R @ leg.platform - leg.base for leg in robot.legs]
            return [_turned(span / ca.norm_2(span), R.T, self.plate) for span in spans]
        return [SX(axis.tolist()) for axis in unit_axes(self.about, len(robot.legs))]

    @staticmethod
    def _home_pose(home: MountingPose) -> tuple[SX, SX]:
        """Return the rotation (3, 3) and the position (3, 1) of a mounting pose."""
        (axis,) = unit_axes((home.axis,), 1)
        return matrix_from_axis_angle(SX(axis.tolist()), SX(home.angle)), SX(list(home.position))


@dataclass(frozen=True)
class BaseJointAngle(JointAngle):
    """Largest angle between each leg and the mounting axis of its base joint."""

    key: ClassVar[str] = "base_joint_angle"
    description: ClassVar[str] = "largest angle between each leg and the mounting axis of its base joint"
    plate: ClassVar[Literal["base", "platform"]] = "base"


@dataclass(frozen=True)
class PlatformJointAngle(JointAngle):
    """Largest angle between each leg and the mounting axis of its platform joint."""

    key: ClassVar[str] = "platform_joint_angle"
    description: ClassVar[str] = "largest angle between each leg and the mounting axis of its platform joint"
    plate: ClassVar[Literal["base", "platform"]] = "platform"

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the key of this limit, and the key of the mounting pose for both joint angles."""
        about = 'mounting pose for joint angles with about = "home"'
        return {**super().fields(), "home": TableField(HomeTable | None, Field(default=None, description=about))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the limit of a case file.

        Raises:
            CaseError: a mounting pose is stated without cones about it, or cones about it without a mounting pose.
        """
        cones = [getattr(limits, kind.key) for kind in (BaseJointAngle, PlatformJointAngle)]
        about = [cone.about for cone in cones if isinstance(cone, ConeTable)]
        if _home(limits) is not None and "home" not in about:
            raise CaseError("limits.home", 'has no effect: write about = "home" in a joint angle, or remove it')
        yield from super().read(limits, model, units)


def _home(limits: Table) -> HomeTable | None:
    """Return the mounting pose of a table ``[limits]``; None without one."""
    home = getattr(limits, "home", None)
    return home if isinstance(home, HomeTable) else None


def unit_axes(axes: tuple[Triple, ...], count: int) -> FloatArray:
    """Return unit axes (count, 3) from a single axis for all joints, or one for each."""
    rows = [[part / math.hypot(*axis) for part in axis] for axis in axes]
    return frozen_array(rows if len(rows) == count else rows * count, (count, 3))


def check_axis(key: str, axis: Triple) -> None:
    """Refuse an axis that is zero or not finite; the first argument is its dotted key."""
    if len(axis) != 3 or not all(map(math.isfinite, axis)) or not any(axis):
        raise CaseError(key, "must be three finite numbers that are not all zero", list(axis))


def triple(values: Sequence[float]) -> Triple:
    """Return three numbers as a tuple of floats."""
    x, y, z = (float(value) for value in values)
    return x, y, z
