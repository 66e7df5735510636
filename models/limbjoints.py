"""Joints and links of a robot given joint by joint, for limits and pictures: motions from home, and segments.

The coordinates of a joint are 0 at home: angle of a rotation, displacement of a prismatic joint. Where the loop of a
limb is opened, the angle is not an unknown of the program: its sine and cosine follow from the displacements of the two
bodies that the joint connects.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

from .arrays import FloatArray
from .parts import Dimension
from .values import dataclass


@dataclass(frozen=True, eq=False)
class JointCoordinate:
    """Coordinate of a joint, 0 at home.

    Attributes:
        part: name of the coordinate within the joint, such as ``first``; empty if it is the only coordinate.
        dimension: dimension of the coordinate: angle or length.
        value: (1, 1) coordinate in radians or length; or sine of the angle times a positive factor.
        cosine: (1, 1) cosine of the angle times the same factor; None if ``value`` is the coordinate itself.
    """

    part: str
    dimension: Dimension
    value: SX
    cosine: SX | None = None

    @property
    def measured(self) -> SX:
        """Coordinate (1, 1); an angle within half a turn."""
        return self.value if self.cosine is None else ca.atan2(self.value, self.cosine)


@dataclass(frozen=True, eq=False)
class JointCone:
    """Directions that define the cone angle of a universal or spherical joint.

    Attributes:
        link: (3, 1) current unit direction, from the base to the platform, of a link that ends at the joint.
        home: (3, 1) direction of this link at home.
        other: (3, 3) rotation from home of the body on the other side of the joint.
        turn: (3, 3) rotation of this limb relative to the limb that the robot file describes.
    """

    link: SX
    home: SX
    other: SX
    turn: FloatArray


@dataclass(frozen=True, eq=False)
class LimbJoint:
    """Joint of a limb as in the robot file.

    Attributes:
        label: limb and place of the joint from the base on, such as ``2:3``.
        name: name of the joint in the robot file; empty for none.
        limb: name of the limb.
        type: letter of the joint type: ``R, P, H, C, U, S`` or ``Pa``.
        coordinates: coordinates of the joint from home, from the base side on; empty for a spherical joint, and if the
            coordinates are not known.
        cone: directions of a universal or spherical joint; None for other joints, and if the directions are not known.
        unknown: reason why coordinates or cone are not known, as a clause; empty if both are known.
    """

    label: str
    name: str
    limb: str
    type: str
    coordinates: tuple[JointCoordinate, ...] = ()
    cone: JointCone | None = None
    unknown: str = ""

    def is_called(self, joint: str) -> bool:
        """Return True if a limit on ``joint`` refers to this joint: by label, name, or limb and name (``2:ball``)."""
        path = self.label.rpartition(":")[0]
        return joint == self.label or (
            self.name != "" and joint in {self.name, f"{path}:{self.name}", f"{self.limb}:{self.name}"}
        )


@dataclass(frozen=True, eq=False)
class LimbLink:
    """Link of a limb: segment between the centres of two joints.

    Attributes:
        name: labels of the joints at both ends, such as ``1:2 to 1:3``.
        ends: positions of both joints; two links with a common position share a joint.
        start: (3, 1) current position of the joint nearer the base, length.
        span: (3, 1) vector to the other joint.
    """

    name: str
    ends: frozenset[str]
    start: SX
    span: SX
