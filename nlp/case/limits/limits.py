"""What a design must keep to be built: the limits of a case, as values.

Lengths are in the case's unit and angles in radians. Everything is optional; what is left out is no limit. A limit is
checked against the robot once, by :mod:`screwsynth.nlp.case.limits.limitcheck`, in the words of a case file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias

from ....models import FloatArray, frozen_array

#: Three numbers.
Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Interval:
    """A limit with one side or two."""

    min: float | None = None
    max: float | None = None


@dataclass(frozen=True)
class Actuator:
    """A telescoping leg over all poses: ``stroke = longest - shortest``.

    Attributes:
        stroke_max: the largest stroke.
        dead_length: what the leg has beside its stroke when retracted: ``shortest >= dead_length + stroke``.
    """

    stroke_max: float | None = None
    dead_length: float | None = None


@dataclass(frozen=True)
class MountingPose:
    """The pose at which passive joints are mounted straight: position, and ``exp(angle [axis]x)``."""

    position: Triple
    axis: Triple = (0.0, 0.0, 1.0)
    angle: float = 0.0


@dataclass(frozen=True)
class Cone:
    """The cone of a passive joint: how far a leg may lean from the joint's mounting axis.

    Attributes:
        max: half angle, radians, above 0 and at most half a turn.
        about: the mounting axes, pointing the way from base to platform: the plate's normal when None, the leg's own
            direction at a :class:`MountingPose`, one direction in the plate's frame for all joints, or one for each.
    """

    max: float
    about: MountingPose | tuple[Triple, ...] | None = None


@dataclass(frozen=True)
class Footprint:
    """Largest distance of joint centres from their plate's axis, its z axis."""

    base: float | None = None
    platform: float | None = None


@dataclass(frozen=True)
class Homogenised:
    """A limit on J made homogeneous: moments about the platform's origin, divided by a length.

    Attributes:
        limit: the smallest or largest value.
        length: what moments are divided by.
    """

    limit: float
    length: float


@dataclass(frozen=True)
class Limits:
    """The limits of a case.

    Attributes:
        leg_length: of every leg, at every pose.
        actuator: of every leg, over all poses.
        base_joint_angle, platform_joint_angle: cones of the passive joints.
        joint_spacing: smallest distance between two joint centres of one plate.
        footprint: largest radii of the plates.
        radius_ratio: platform's radius over base's, each the root mean square distance of joints from the plate's axis.
        leg_clearance: smallest distance between two legs, as line segments between their joints.
        condition_number: largest ratio of singular values of the homogenised J.
        smallest_singular_value: smallest of them.
        rate_share: largest part of F that one limb carries.
        custom: relations between the case's own numbers, such as ``"x1 - 1.5*x2 >= 0"``.
        quantities: of the model's other named measures, by name.
    """

    leg_length: Interval | None = None
    actuator: Actuator | None = None
    base_joint_angle: Cone | None = None
    platform_joint_angle: Cone | None = None
    joint_spacing: float | None = None
    footprint: Footprint | None = None
    radius_ratio: Interval | None = None
    leg_clearance: float | None = None
    condition_number: Homogenised | None = None
    smallest_singular_value: Homogenised | None = None
    rate_share: float | None = None
    custom: tuple[str, ...] = ()
    quantities: Mapping[str, Interval] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "quantities", MappingProxyType(dict(self.quantities)))

    def __bool__(self) -> bool:
        """Whether there is any limit."""
        return any(getattr(self, name) for name in self.__dataclass_fields__)


def unit_axes(axes: tuple[Triple, ...], count: int) -> FloatArray:
    """(count, 3) unit mounting axes from one for all or one for each."""
    rows = [[part / math.hypot(*axis) for part in axis] for axis in axes]
    return frozen_array(rows if len(rows) == count else rows * count, (count, 3))
