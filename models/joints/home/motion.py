"""Displacements of bodies and screws of joints as symbols.

A twist has its angular velocity first, then the velocity at the world origin. A joint's variable is 0 at home, where
the robot is described.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...parts import Dimension

#: Unit vectors (3, 1) along x, y and z.
UNIT_VECTORS = (SX([1, 0, 0]), SX([0, 1, 0]), SX([0, 0, 1]))


class Motion(NamedTuple):
    """A displacement of a body in the world frame: a point ``x`` goes to ``R (x - origin) + image``.

    With the centre of a turn as origin, differences of points appear in which coordinates cancel: expressions of such
    displacements one after the other are much shorter than with a translation of the world's origin.

    Attributes:
        rotation: (3, 3) ``R``.
        origin: (3, 1) a point, length.
        image: (3, 1) where this point goes, length.
    """

    rotation: SX
    origin: SX
    image: SX

    @classmethod
    def none(cls) -> Motion:
        """Return the displacement that leaves every point in its place."""
        return cls(SX.eye(3), SX.zeros(3), SX.zeros(3))

    def after(self, first: Motion) -> Motion:
        """Return this displacement after another one, which comes first."""
        if first.rotation.is_eye():
            # A translation moves the origin alone: this rotation then turns one sum of vectors, and not two vectors.
            return Motion(self.rotation, self.origin - (first.image - first.origin), self.image)
        return Motion(self.rotation @ first.rotation, first.origin, self.point(first.image))

    def inverse(self) -> Motion:
        """Return the displacement back."""
        return Motion(self.rotation.T, self.image, self.origin)

    def point(self, point: SX) -> SX:
        """Return where a point (3, 1) goes."""
        return self.rotation @ (point - self.origin) + self.image


class AxisKind(enum.Enum):
    """Kind of a joint with one variable."""

    ROTATION = "rotation"
    TRANSLATION = "translation"
    PARALLELOGRAM = "parallelogram"


@dataclass(frozen=True, eq=False)
class JointAxis:
    """A joint with one variable, at home.

    Attributes:
        kind: rotation (with a pitch, for a helical joint), translation, or the translation of a parallelogram.
        axis: (3, 1) unit vector.
        point: (3, 1) a point of the axis, length.
        actuated: whether an actuator drives it.
        pitch: (1, 1) translation along the axis per radian, length.
        rod: (3, 1) a parallelogram's rod, from its base side to its platform side, length.
    """

    kind: AxisKind
    axis: SX
    point: SX
    actuated: bool = False
    pitch: SX = field(default_factory=lambda: SX(0))
    rod: SX = field(default_factory=lambda: SX.zeros(3))

    @property
    def dimension(self) -> Dimension:
        """Dimension of its way from home: angle, or length of a slide or a parallelogram."""
        return Dimension.ANGLE if self.kind is AxisKind.ROTATION else Dimension.LENGTH

    def motion(self, value: SX) -> Motion:
        """Return the displacement at a value of the variable: an angle in radians, or a length."""
        if self.kind is AxisKind.TRANSLATION:
            return Motion(SX.eye(3), SX.zeros(3), value * self.axis)
        turn = rotation_about(self.axis, value)
        if self.kind is AxisKind.PARALLELOGRAM:
            return Motion(SX.eye(3), SX.zeros(3), turn @ self.rod - self.rod)
        return Motion(turn, self.point, self.point + self.pitch * value * self.axis)

    def way(self, value: SX) -> SX:
        """Return the way (1, 1) from home whose rate goes with the unit screw: an angle in radians, or a length.

        A parallelogram's variable is the angle of its rods; its way is that of its platform side along the circle.
        """
        return value * ca.norm_2(self.rod) if self.kind is AxisKind.PARALLELOGRAM else value

    def screw(self, value: SX, at: Motion) -> SX:
        """Return the current unit screw (6, 1).

        A parallelogram's is the translation of its platform side, of length 1.

        Args:
            value: of the variable.
            at: displacement of the body on either side of the joint.
        """
        if self.kind is AxisKind.TRANSLATION:
            return ca.vertcat(SX.zeros(3), at.rotation @ self.axis)
        if self.kind is AxisKind.PARALLELOGRAM:
            velocity = ca.cross(self.axis, rotation_about(self.axis, value) @ self.rod) / ca.norm_2(self.rod)
            return ca.vertcat(SX.zeros(3), at.rotation @ velocity)
        direction = at.rotation @ self.axis
        return ca.vertcat(direction, ca.cross(at.point(self.point), direction) + self.pitch * direction)

    def direction(self, screw: SX) -> SX:
        """Return its current direction (3, 1) from its current screw (6, 1): that of the motion for a parallelogram."""
        return screw[:3] if self.kind is AxisKind.ROTATION else screw[3:]

    @property
    def is_hinge(self) -> bool:
        """Whether it is a rotation without a pitch."""
        return self.kind is AxisKind.ROTATION and bool(self.pitch.is_zero())


def rotation_about(axis: SX, angle: SX) -> SX:
    """Return the rotation matrix (3, 3) about a unit axis (3, 1): ``I + sin q [a] + (1 - cos q)(a a' - I)``."""
    return SX.eye(3) + ca.sin(angle) * ca.skew(axis) + (1 - ca.cos(angle)) * (axis @ axis.T - SX.eye(3))
