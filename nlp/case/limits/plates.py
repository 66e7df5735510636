"""Limits on the joint centres of base and platform: spacing, radius, and ratio of radii.

Distances are limited by their squares. The radius of a joint is its distance from the z axis of its plate, which is the
base or the platform; the radius of a plate is the root mean square of the radii of its joints.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension
from ..table import Table
from .constraint import SQUARED_LENGTH, SQUARED_NUMBER, BoundedConstraint, Call, Form, between
from .interval import IntervalLimit, LimitTable, LowerLimit, two_sided
from .limit import Design, Limit, NumberRange, Plate, Ranges


def _squared_distance(points: SX) -> SX:
    """Return the squared distance (1, 1) of two points, stacked (6, 1)."""
    return ca.sumsqr(points[:3] - points[3:])


@dataclass(frozen=True)
class JointSpacing(LowerLimit):
    """Smallest distance between two joint centres of the base, or of the platform."""

    key: ClassVar[str] = "joint_spacing"
    description: ClassVar[str] = "smallest distance between two joint centres of the base, or of the platform"
    needs_legs: ClassVar[bool] = True

    def on_plate(self, plate: Plate) -> Iterator[BoundedConstraint]:
        """Return the constraint on the squared distance of each pair of joints."""
        for one, other in itertools.combinations(plate.joints, 2):
            name = f"joint_spacing {plate.name} joints {one.name} and {other.name}"
            apart = Call(Form(_squared_distance), ca.vertcat(one.centre, other.centre))
            yield between(name, apart, SQUARED_LENGTH, "joint_spacing", lower=self.min)


class FootprintTable(LimitTable):
    """Largest distance of joint centres from the z axis of base or platform."""

    base: FiniteFloat | None = Field(
        default=None, description="largest distance of the base joints from the z axis of the base"
    )
    platform: FiniteFloat | None = Field(
        default=None, description="largest distance of the platform joints from the z axis of the platform"
    )


@dataclass(frozen=True)
class Footprint(Limit[FootprintTable]):
    """Largest distance of joint centres from the z axis of base or platform.

    Attributes:
        base: largest distance of the base joints, length; None for no limit.
        platform: largest distance of the platform joints, length; None for no limit.
    """

    base: float | None = None
    platform: float | None = None

    key: ClassVar[str] = "footprint"
    table: ClassVar[type[Table]] = FootprintTable
    description: ClassVar[str] = "largest distance of joint centres from the z axis of base and platform"
    numbers: ClassVar[Ranges] = {"base": NumberRange(), "platform": NumberRange()}
    needs_legs: ClassVar[bool] = True

    def on_plate(self, plate: Plate) -> Iterator[BoundedConstraint]:
        """Return the constraint on the squared radius of each joint."""
        largest = self.base if plate.name == "base" else self.platform
        if largest is None:
            return
        for joint in plate.joints:
            radius, keys = Call(Form(ca.sumsqr), joint.centre[:2]), ("", f"footprint.{plate.name}")
            yield between(f"footprint {plate.name} joint {joint.name}", radius, SQUARED_LENGTH, keys, upper=largest)


@dataclass(frozen=True)
class RadiusRatio(IntervalLimit):
    """Smallest and largest ratio of the platform radius to the base radius."""

    key: ClassVar[str] = "radius_ratio"
    description: ClassVar[str] = "ratio of platform radius to base radius, root mean squares over the joints"
    numbers: ClassVar[Ranges] = two_sided(NumberRange(Dimension.NUMBER))
    needs_legs: ClassVar[bool] = True

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return the constraint on the squared ratio."""
        legs = design.robots[0].legs
        platform, base = (
            sum((ca.sumsqr(joint[:2]) for joint in joints), SX(0))
            for joints in ([leg.platform for leg in legs], [leg.base for leg in legs])
        )
        yield between("radius_ratio", platform / base, SQUARED_NUMBER, "radius_ratio", lower=self.min, upper=self.max)
