"""Joints and links of a robot given joint by joint, as limits and pictures read them: motions from home, and segments.

A joint's coordinates are 0 at home: the angle of a rotation, and the displacement of a slide. Where the loop of a limb
is opened, the angle is no unknown of the program, and follows from the displacements of the two bodies of the joint. It
is then given by its sine and cosine.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

from .arrays import FloatArray
from .parts import Dimension
from .values import dataclass


@dataclass(frozen=True, eq=False)
class JointCoordinate:
    """A coordinate of a joint, from home.

    Attributes:
        part: name among the joint's coordinates, such as ``first``; empty for the only one.
        dimension: angle or length.
        value: (1, 1) the coordinate itself, radians or length; or the sine of the angle, times a positive number.
        cosine: (1, 1) its cosine, times the same number; None where ``value`` is the coordinate itself.
    """

    part: str
    dimension: Dimension
    value: SX
    cosine: SX | None = None

    @property
    def measured(self) -> SX:
        """The coordinate itself (1, 1), an angle within half a turn."""
        return self.value if self.cosine is None else ca.atan2(self.value, self.cosine)


@dataclass(frozen=True, eq=False)
class JointCone:
    """The directions between which the cone of a universal or spherical joint is measured.

    Attributes:
        link: (3, 1) current unit direction of a link that ends at the joint, from the base to the platform.
        home: (3, 1) the same at home.
        other: (3, 3) rotation from home of the body on the other side of the joint.
        turn: (3, 3) rotation of the limb from the one that the robot file writes.
    """

    link: SX
    home: SX
    other: SX
    turn: FloatArray


@dataclass(frozen=True, eq=False)
class LimbJoint:
    """A joint of a limb, as the robot file writes it.

    Attributes:
        label: limb and place of the joint from the base on, such as ``2:3``.
        name: that the robot file gives it; empty for none.
        limb: name of the limb.
        type: its letter, ``R, P, H, C, U, S`` or ``Pa``.
        coordinates: its coordinates from home, the base side first; none of a spherical joint, and none where they are
            not known.
        cone: directions of a universal or spherical joint; None for other joints, and where they are not known.
        unknown: reason why coordinates or cone are not known, as a clause; empty where they are.
    """

    label: str
    name: str
    limb: str
    type: str
    coordinates: tuple[JointCoordinate, ...] = ()
    cone: JointCone | None = None
    unknown: str = ""

    def is_called(self, joint: str) -> bool:
        """Return whether a limit on ``joint`` means this one: its label, its name, or limb and name, ``2:ball``."""
        path = self.label.rpartition(":")[0]
        return joint == self.label or (
            self.name != "" and joint in {self.name, f"{path}:{self.name}", f"{self.limb}:{self.name}"}
        )


@dataclass(frozen=True, eq=False)
class LimbLink:
    """A link of a limb as the segment between the centres of two joints.

    Attributes:
        name: labels of the joints at its ends, such as ``1:2 to 1:3``.
        ends: the joints' places; two links with a place in common share a joint.
        start: (3, 1) current place of the joint nearer the base, length.
        span: (3, 1) vector to the other joint.
    """

    name: str
    ends: frozenset[str]
    start: SX
    span: SX
