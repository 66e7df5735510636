"""Limits on the cones of universal and spherical joints of a robot given joint by joint.

A cone is limited by the cosine of the angle between a link that ends at the joint and an axis that is fixed in the body
on the other side of the joint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca
from casadi import SX

from ....models import Dimension, Model
from ....models.limbjoints import JointCone as Cone
from ...errors import CaseError
from ...units import Units
from ..toml import TomlValue
from .constraint import BoundedConstraint, bounded
from .joint_table import JointTable, LimitOnJoint, StatedMotion
from .joints import COSINE_OF_ANGLE, Triple
from .limit import LimitedCase, PosedRobot, TableField, Written


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
        x, y, z = (float(part) for part in table.axis)
        return cls(joint, largest, (x, y, z))

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
        case.check_number(self.name, self.max, Dimension.ANGLE, most=math.pi)
        axis = self.axis
        if axis is not None and (len(axis) != 3 or not all(map(math.isfinite, axis)) or not any(axis)):
            key = f"limits.joint.{self.joint}.axis"
            raise CaseError(key, "must be three finite numbers that are not all zero", list(axis))

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return minus the cosine of the angle of each joint."""
        for joint in pose.robot.joints:
            if joint.is_called(self.joint) and joint.cone is not None:
                axis, link = self._axis(joint.cone), joint.cone.link
                yield bounded(
                    f"{self.name} joint {joint.label}{pose.where}",
                    -ca.dot(axis, link),
                    COSINE_OF_ANGLE,
                    ("", self.name),
                    upper=self.max,
                    # The arc tangent is accurate for a link along the axis, where the arc cosine is not.
                    exact=ca.atan2(ca.norm_2(ca.cross(axis, link)), ca.dot(axis, link)),
                )

    def _axis(self, cone: Cone) -> SX:
        """Return the current unit axis (3, 1) of a joint's cone."""
        if self.axis is None:
            return cone.other @ cone.home
        unit = [part / math.hypot(*self.axis) for part in self.axis]
        return cone.other @ (SX(cone.turn.tolist()) @ SX(unit))
