"""Circular arcs and helices in a plane of two axes: centre, radius and angle, by the rules of LinuxCNC.

If the distances of both ends from the centre differ by rounding, the radius changes linearly with the angle. An angle
is positive from the plane's first axis to its second.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

from numpy.polynomial.legendre import leggauss

from ...models import FloatArray

#: Both axes of a plane, then the axis of a helix, by the code of the plane: 0, 1, 2 for x, y, z.
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
#: Largest relative difference of the radii of both ends.
_SPIRAL = 0.001
#: Relative excess of a chord over the programmed diameter, and angle, that count as rounding.
_TINY = 1e-12
#: Gauss-Legendre nodes, between 0 and 1, and weights for lengths of arcs: exact except for rounding if the radius is
#: constant.
_NODES = [(float(node + 1) / 2, float(weight) / 2) for node, weight in zip(*leggauss(5), strict=True)]
#: Number, or array with a number for each arc.
_Numbers = TypeVar("_Numbers", float, FloatArray)


class ArcError(Exception):
    """Error of an impossible arc; the message gives the reason."""


class Tolerances(NamedTuple):
    """Tolerances on the end points of arcs, length.

    Attributes:
        radius: smallest radius, and largest excess of half a chord over the radius.
        spiral: largest difference of the distances of both end points from the centre, for any radius.
        closed: largest distance between start and end of a full circle.
    """

    radius: float
    spiral: float
    closed: float

    def times(self, scale: float) -> Tolerances:
        """Return the tolerances times a factor, which converts them to another unit."""
        return Tolerances(self.radius * scale, self.spiral * scale, self.closed * scale)


#: Tolerances in the unit of a program, by the code of this unit.
TOLERANCES = {
    20: Tolerances(5e-5, 0.002 * math.sqrt(2), 1e-8),
    21: Tolerances(5e-5 * 25.4, 0.02 * math.sqrt(2), 1e-8),
}


class Arc(NamedTuple):
    """Arc in a plane, from a start angle.

    Attributes:
        first, second: coordinates of the centre along the plane's axes.
        radius: radius at the start.
        growth: change of the radius from start to end.
        angle: angle of the start, radians.
        sweep: signed angle from start to end, radians.
    """

    first: float
    second: float
    radius: float
    growth: float
    angle: float
    sweep: float


Point = tuple[float, float]


def arc_about(centre: Point, start: Point, end: Point, turns: int, tolerances: Tolerances) -> Arc:
    """Return the arc with a given centre.

    Args:
        centre: coordinates in the plane.
        start: first point.
        end: last point; equal to the first for a full circle.
        turns: number of turns, including a partial last turn; negative for clockwise.
        tolerances: tolerances in the unit of the coordinates.

    Raises:
        ArcError: an end is at the centre, or the ends are at different distances from it.
    """
    from_start, from_end = (start[0] - centre[0], start[1] - centre[1]), (end[0] - centre[0], end[1] - centre[1])
    radius, last = math.hypot(*from_start), math.hypot(*from_end)
    if min(radius, last) < tolerances.radius:
        raise ArcError("the centre of the arc coincides with its start or end")
    gap = abs(last - radius)
    if gap > 100 * tolerances.spiral or (gap > tolerances.spiral and gap > _SPIRAL * max(radius, last)):
        raise ArcError(
            f"start and end of the arc are {radius:.7g} and {last:.7g} from its centre; "
            f"these distances may differ by at most "
            f"{max(tolerances.spiral, min(100 * tolerances.spiral, _SPIRAL * max(radius, last))):.3g}"
        )
    angle = math.atan2(from_start[1], from_start[0])
    sense = math.copysign(1, turns)
    sweep = sense * (math.atan2(from_end[1], from_end[0]) - angle)
    if math.dist(start, end) <= tolerances.closed:
        sweep = math.tau
    elif sweep <= _TINY:
        sweep += math.tau
    return Arc(*centre, radius, last - radius, angle, sense * (sweep + (abs(turns) - 1) * math.tau))


def centre_of_radius(radius: float, start: Point, end: Point, is_clockwise: bool, tolerances: Tolerances) -> Point:
    """Return the centre of an arc given by its radius.

    Args:
        radius: positive for at most half a turn, negative for more.
        start: first point.
        end: last point.
        is_clockwise: True for a clockwise arc.
        tolerances: tolerances in the unit of the coordinates.

    Raises:
        ArcError: the ends coincide, or are farther apart than two radii.
    """
    chord = (end[0] - start[0], end[1] - start[1])
    length, size = math.hypot(*chord), abs(radius)
    if length <= tolerances.closed:
        raise ArcError(
            "an arc with R must not end at its start, because this does not determine its centre; give I, J, K instead"
        )
    if length / 2 - size > tolerances.radius:
        raise ArcError(f"start and end of the arc are {length:.7g} apart, more than two radii of {size:.7g}")
    height = 0.0 if length / 2 > size * (1 - _TINY) else math.sqrt((size - length / 2) * (size + length / 2))
    # The centre is to the right of the chord of a clockwise arc of less than half a turn.
    height = (-height if is_clockwise == (radius > 0) else height) / length
    return (start[0] + chord[0] / 2 - height * chord[1], start[1] + chord[1] / 2 + height * chord[0])


def arc_length(radius: _Numbers, growth: _Numbers, sweep: _Numbers, rise: _Numbers) -> _Numbers:
    """Return the length of an arc or a helix; arguments may be arrays.

    Args:
        radius: radius at the start.
        growth: change of the radius from start to end.
        sweep: angle from start to end, radians.
        rise: advance along the axis.
    """
    length = 0 * radius
    for node, weight in _NODES:
        around = (radius + node * growth) * sweep
        length = length + weight * (around * around + growth * growth + rise * rise) ** 0.5
    return length
