"""Limits on the distance between legs, and between links of limbs, as line segments between joint centres.

The squared distance ``d^2`` of the points ``p + s d`` and ``q + t e`` is a convex quadratic in s and t, and its minimum
over ``0 <= s, t <= 1`` is found in closed form by three clampings: the best s for the lines, the best t for this s, the
best s for this t (V. J. Lumelsky, *On fast computation of distance between line segments*, Information Processing
Letters 21 (1985); C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9). Because the minimum is over a
fixed set, its derivative with respect to the segments' ends is that of the quadratic at the nearest points (Danskin):
the result is exact, and once continuously differentiable wherever the nearest points are unique, which is everywhere
but for parallel segments. The second derivatives jump where a nearest point comes to an end of its segment.

The constraint is on ``1 - (1 - d^2/D^2)^3`` for d below D, which is twice the limit, and on 1 beyond. This function
grows with d, is smooth to second order, and does not depend on segments that are far apart: where such segments happen
to be parallel, second derivatives of their distance are not finite.
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
from .constraint import BoundedConstraint, Call, Form, Reading, between
from .interval import LowerLimit
from .limit import PosedRobot

#: Largest limit to which a constraint can be changed, divided by the distance D beyond which it is 1: closer to D, the
#: slope falls below an eighth of the slope at the original limit.
_MOST = 0.9
#: Regularisation of the division for parallel lines, relative to the squared lengths. The next two clampings correct
#: the error in s: the squared distance is too large by at most a quarter of this fraction of a leg's squared length.
_PARALLEL = 1e-10


@dataclass(frozen=True)
class LegClearance(LowerLimit):
    """Smallest distance between two legs, as line segments between their joint centres."""

    key: ClassVar[str] = "leg_clearance"
    description: ClassVar[str] = "smallest distance between two legs, as line segments between joint centres"
    needs_legs: ClassVar[bool] = True

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the distance of each pair of legs."""
        for one, other in itertools.combinations(pose.robot.legs, 2):
            name = f"leg_clearance limbs {one.name} and {other.name}{pose.where}"
            yield _apart(name, (one.base, one.span), (other.base, other.span), self.key, self.min)


@dataclass(frozen=True)
class LinkClearance(LowerLimit):
    """Smallest distance between two links of limbs without a common joint, as line segments between joint centres."""

    key: ClassVar[str] = "link_clearance"
    description: ClassVar[str] = "smallest distance between two links of limbs without a common joint, as line segments"
    needs_joints: ClassVar[bool] = True

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the distance of each pair of links."""
        for one, other in itertools.combinations(pose.robot.links, 2):
            if not one.ends & other.ends:
                name = f"{self.key} links {one.name} and {other.name}{pose.where}"
                yield _apart(name, (one.start, one.span), (other.start, other.span), self.key, self.min)


def _apart(name: str, one: tuple[SX, SX], other: tuple[SX, SX], key: str, least: float) -> BoundedConstraint:
    """Return the constraint on the distance of two segments.

    Args:
        name: name of the constraint.
        one: start and span (3, 1) of the first segment, length.
        other: start and span (3, 1) of the second segment, length.
        key: key of the limit.
        least: smallest allowed distance, length.
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
    """Return the derivative of :func:`_near` with respect to the distance, at a value of :func:`_near`."""
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


def squared_distance(p: SX, d: SX, q: SX, e: SX) -> SX:
    """Return the squared distance (1, 1) between the segments from p to p + d and from q to q + e.

    Args:
        p: (3, 1) start of the first segment, length.
        d: (3, 1) vector from start to end of the first segment, not 0.
        q: (3, 1) start of the second segment.
        e: (3, 1) vector from start to end of the second segment, not 0.
    """
    r = p - q
    a, b, c = ca.sumsqr(d), ca.dot(d, e), ca.sumsqr(e)
    f, g = ca.dot(d, r), ca.dot(e, r)
    s = _clamped((b * g - f * c) / (a * c - b * b + _PARALLEL * a * c))
    t = _clamped((b * s + g) / c)
    s = _clamped((b * t - f) / a)
    return ca.sumsqr(r + s * d - t * e)


def _clamped(value: SX) -> SX:
    return ca.fmax(0, ca.fmin(1, value))
