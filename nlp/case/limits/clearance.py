"""A limit on the distance between legs, as line segments between their joints.

The squared distance ``d^2`` of two segments is exact (:mod:`screwsynth.nlp.case.limits.segments`). The constraint is on
``1 - (1 - d^2/D^2)^3`` for d below D, which is twice the limit, and on 1 beyond. This function grows with d, is smooth
to second order, and does not depend on legs that are far apart: where such legs happen to be parallel, second
derivatives of their distance are not finite.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import casadi as ca
from casadi import SX

from ....models import Dimension
from .constraint import BoundedConstraint, Reading, between
from .form import Call, Form
from .interval import LowerLimit
from .limit import PosedRobot
from .segments import squared_distance

#: Largest distance that a constraint can be for, in parts of the distance D beyond which it is 1: closer to D its slope
#: falls below an eighth of the slope at the limit that it was made for.
_MOST = 0.9


@dataclass(frozen=True)
class LegClearance(LowerLimit):
    """Smallest distance between two legs, as line segments between their joints."""

    key: ClassVar[str] = "leg_clearance"
    description: ClassVar[str] = "between legs as line segments"
    needs_legs: ClassVar[bool] = True

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return a smooth function of the distance of each pair of legs, with the distance itself."""
        for one, other in itertools.combinations(pose.robot.legs, 2):
            name = f"leg_clearance limbs {one.name} and {other.name}{pose.where}"
            yield apart(name, (one.base, one.span), (other.base, other.span), self.key, self.min)


def apart(name: str, one: tuple[SX, SX], other: tuple[SX, SX], key: str, least: float) -> BoundedConstraint:
    """Return the constraint on the distance of two segments.

    Args:
        name: of the constraint.
        one: start and span (3, 1) of the first segment, length.
        other: of the second.
        key: of the limit.
        least: smallest distance.
    """
    far, ends = 4 * least**2, ca.vertcat(*one, *other)
    near = Call(Form(_near_of_segments, (far,)), ends)
    return between(name, near, _reading(far), key, lower=least, exact=ca.sqrt(_squared_of_segments(ends)))


def _squared_of_segments(ends: SX) -> SX:
    """Return the squared distance (1, 1) of two segments from the start and the span of each, (12, 1)."""
    return squared_distance(ends[:3], ends[3:6], ends[6:9], ends[9:])


def _near_of_segments(ends: SX, far: float) -> SX:
    """Return :func:`_near` of the distance of two segments from the start and the span of each, (12, 1)."""
    return _near(_squared_of_segments(ends), far)


def _near(squared: SX, far: float) -> SX:
    """Return ``1 - (1 - d^2/D^2)^3`` from the squared distances (1, 1) ``d^2`` and ``D^2``, and 1 beyond."""
    return 1 - ca.fmax(0, 1 - squared / far) ** 3


def _bound(far: float, distance: SX) -> SX:
    """Return :func:`_near` of a distance (1, 1)."""
    return _near(distance * distance, far)


def _distance(far: float, value: float) -> float:
    """Return the distance from a value of :func:`_near`."""
    return math.sqrt(far * (1 - max(1 - max(value, 0.0), 0.0) ** (1 / 3)))


def _slope(far: float, value: float) -> float:
    """Return the derivative of :func:`_near` with respect to the distance, at a value of it."""
    return float(6 * max(1 - value, 0.0) ** (2 / 3) * _distance(far, value) / far)


def _reading(far: float) -> Reading:
    """Return the reading of :func:`_near` as the distance."""
    return Reading(
        Dimension.LENGTH,
        from_value=partial(_distance, far),
        slope=partial(_slope, far),
        to_value=partial(_bound, far),
        above=0.0,
        most=_MOST * math.sqrt(far),
    )
