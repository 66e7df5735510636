"""A limit on the distance between the links of a robot given joint by joint, as segments between centres of joints.

The constraint is that of :mod:`screwsynth.nlp.case.limits.clearance` on each pair of links that share no joint.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from .clearance import apart
from .constraint import BoundedConstraint
from .interval import LowerLimit
from .limit import PosedRobot


@dataclass(frozen=True)
class LinkClearance(LowerLimit):
    """Smallest distance between two links of limbs that share no joint, as segments between centres of joints."""

    key: ClassVar[str] = "link_clearance"
    description: ClassVar[str] = "between links of limbs that share no joint, as line segments"
    needs_joints: ClassVar[bool] = True

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return a smooth function of the distance of each pair of links."""
        for one, other in itertools.combinations(pose.robot.links, 2):
            if not one.ends & other.ends:
                name = f"{self.key} links {one.name} and {other.name}{pose.where}"
                yield apart(name, (one.start, one.span), (other.start, other.span), self.key, self.min)
