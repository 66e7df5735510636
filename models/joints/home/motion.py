"""Displacements of bodies and screws of joints as symbols.

A twist is the angular velocity, then the velocity at the world origin. Joint coordinates are 0 at home, where the robot
is described.
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
    """Displacement of a body in the world frame: a point ``x`` goes to ``R (x - origin) + image``.

    With the centre of rotation as origin, coordinates cancel in differences of points: products of such displacements
    are much shorter expressions than with a translation of the world's origin.

    Attributes:
        rotation: (3, 3) ``R``.
        origin: (3, 1) reference point, length.
        image: (3, 1) displaced reference point, length.
    """

    rotation: SX
    origin: SX
    image: SX

    @classmethod
    def none(cls) -> Motion:
        """Return the identity displacement."""
        return cls(SX.eye(3), SX.zeros(3), SX.zeros(3))

    def after(self, first: Motion) -> Motion:
        """Return the product of two displacements: first ``first``, then this displacement."""
        if first.rotation.is_eye():
            # A translation moves only the origin: the product then rotates one sum of vectors, not two vectors.
            return Motion(self.rotation, self.origin - (first.image - first.origin), self.image)
        return Motion(self.rotation @ first.rotation, first.origin, self.point(first.image))

    def inverse(self) -> Motion:
        """Return the inverse displacement."""
        return Motion(self.rotation.T, self.image, self.origin)

    def point(self, point: SX) -> SX:
        """Return the displaced point (3, 1)."""
        return self.rotation @ (point - self.origin) + self.image


class AxisKind(enum.Enum):
    """Kind of a joint axis with one coordinate."""

    ROTATION = "rotation"
    TRANSLATION = "translation"
    PARALLELOGRAM = "parallelogram"


@dataclass(frozen=True, eq=False)
class JointAxis:
    """Joint axis with one coordinate, at home.

    Attributes:
        kind: rotation (with a pitch for a helical joint), translation, or translation of a parallelogram.
        axis: (3, 1) unit vector along the axis.
        point: (3, 1) point of the axis, length.
        actuated: True if an actuator drives the joint.
        pitch: (1, 1) translation along the axis per radian, length.
        rod: (3, 1) rod of a parallelogram, from its base side to its platform side, length.
    """

    kind: AxisKind
    axis: SX
    point: SX
    actuated: bool = False
    pitch: SX = field(default_factory=lambda: SX(0))
    rod: SX = field(default_factory=lambda: SX.zeros(3))

    @property
    def dimension(self) -> Dimension:
        """Dimension of the travel: angle, or length for a slide or a parallelogram."""
        return Dimension.ANGLE if self.kind is AxisKind.ROTATION else Dimension.LENGTH

    def motion(self, value: SX) -> Motion:
        """Return the displacement for a coordinate: an angle in radians, or a length."""
        if self.kind is AxisKind.TRANSLATION:
            return Motion(SX.eye(3), SX.zeros(3), value * self.axis)
        turn = rotation_about(self.axis, value)
        if self.kind is AxisKind.PARALLELOGRAM:
            return Motion(SX.eye(3), SX.zeros(3), turn @ self.rod - self.rod)
        return Motion(turn, self.point, self.point + self.pitch * value * self.axis)

    def travel(self, value: SX) -> SX:
        """Return the travel (1, 1) from home, whose rate belongs to the unit screw: angle in radians, or length.

        The coordinate of a parallelogram is the angle of its rods; its travel is that of its platform side along the
        circle.
        """
        return value * ca.norm_2(self.rod) if self.kind is AxisKind.PARALLELOGRAM else value

    def screw(self, value: SX, at: Motion) -> SX:
        """Return the current unit screw (6, 1).

        For a parallelogram, this is the translation of its platform side with unit velocity.

        Args:
            value: coordinate of the joint.
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
        """Return the current direction (3, 1) of the axis from the current screw (6, 1).

        For a parallelogram, this is the direction of its motion.
        """
        return screw[:3] if self.kind is AxisKind.ROTATION else screw[3:]

    @property
    def is_hinge(self) -> bool:
        """True for a rotation without a pitch."""
        return self.kind is AxisKind.ROTATION and bool(self.pitch.is_zero())


def rotation_about(axis: SX, angle: SX) -> SX:
    """Return the rotation matrix (3, 3) about a unit axis (3, 1): ``I + sin q [a] + (1 - cos q)(a a' - I)``."""
    return SX.eye(3) + ca.sin(angle) * ca.skew(axis) + (1 - ca.cos(angle)) * (axis @ axis.T - SX.eye(3))
