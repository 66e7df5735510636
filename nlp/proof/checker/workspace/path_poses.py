"""Poses along a path as polynomials of the parameter, over pieces of its segments.

A place on a path of N segments is one number from 0 to N: the index k of a segment plus the parameter s from 0 to 1
along it. The pose is an expression of s and of the segment's data, enclosed by :mod:`..polynomials` like all other
expressions. Positions are on lines, or ``centre + (r + s g) (cos, sin)(a + s w)`` on arcs. Rotations are

* roll, pitch and yaw, as tangents of half angles that change linearly;
* or a quaternion of any size: the product of those of three angles that change linearly; or of a rotation about a fixed
  axis by twice h between unit quaternions q_0 and q_1, with ``sinc x = sin x / x``

      (1 - s) sinc((1 - s) h) q_0 + s sinc(s h) q_1 = (sin h / h) times a unit quaternion.

A frame rotates positions, and multiplies quaternions from the left. A turn about the tool's axis, by an angle that
changes linearly, multiplies them from the right. An arc may miss the knots at its ends: the gap is
part of the remainder of a piece that reaches such an end.

Dimensions that change along the path are linear in s, and follow the pose.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, reduce

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from .....models.arrays import values_at
from ....path.arcs import PLANES
from ....path.options import Between
from ....path.orientation import ORDERS, Order
from ....path.path import ProgrammedPath
from ..arithmetic import PolynomialArithmetic
from ..polynomials import Polynomial, settled
from .pose_boxes import POSITION

#: Largest roll, pitch or yaw for which tangents of half angles are coordinates, radians.
_LARGEST = math.radians(149)
#: Terms of the series of ``sin x / x`` up to a right angle, and a bound of its remainder and of rounding.
_TERMS, _SERIES = 12, 4e-15
#: Rounding of half an angle computed from two unit quaternions.
_HALF = 1e-14
#: Error of the components of a unit vector in doubles, with the factors around it.
_AXIS = 2.0**-50
#: Number of data of an arc.
_ARC = 6
#: Number of places on each segment, and on the first turn of an arc with several turns, for the ranges of coordinates.
_SAMPLES = 9


class PathPoses:
    """Pose coordinates along a path, as polynomials over pieces of its segments.

    Args:
        path: path with at least one segment.

    Attributes:
        is_tangents: If true, rotations are roll, pitch and yaw; otherwise quaternions.
        settings: names of the d dimensions that change along the path: components of the robot's parameters.
        of_pose: number of coordinates of the pose, 6 or 7; d dimensions follow.
        varying: (v,) indices of the coordinates that are not constant along the path.
        constant: (6 + d,) or (7 + d,) values of the constant coordinates; 0 for varying ones.
    """

    def __init__(self, path: ProgrammedPath) -> None:
        self._path, angles, frame = path, path.knots[:, 3:], path.frame
        self._is_slerp = path.between is Between.SLERP
        # A tool that never turns is left out, as are angles that are 0 along the whole path.
        self._tool = None if path.tool is None or not path.tool.angles.any() else path.tool
        is_direct = frame is None and self._tool is None and not self._is_slerp and path.order == ORDERS["rpy"]
        self.is_tangents = bool(is_direct and np.abs(angles).max() < _LARGEST)
        # Angles that are 0 along the whole path make components of quaternions exactly 0.
        self._turning = [bool(angles[:, k].any()) for k in range(3)]
        self.settings = path.settings.names
        dimensions = np.zeros((len(path) + 1, 0)) if path.settings.values is None else path.settings.values
        self._dimensions: FloatArray = dimensions
        self._numbers = self._segment_numbers()
        self._functions: dict[int, ca.Function] = {}
        self._arithmetics: dict[int, PolynomialArithmetic] = {}
        places = {code: k for k, code in enumerate(PLANES)}
        self._plane: NDArray[np.intp] = np.full(len(path), -1)
        self._plane[path.arc_segments] = [places[code] for code in path.planes.tolist()]
        pose = self._pose(-1, SX.sym("s"), SX.sym("numbers", len(self._numbers[0])))[0]
        turn_in_plane = {axis for code in set(path.planes.tolist()) for axis in PLANES[code][:2]}
        knots = path.knots
        moves = [frame is not None or k in turn_in_plane or bool(np.ptp(knots[:, k])) for k in range(POSITION)]
        self.of_pose = pose.numel() - len(self.settings)
        turns = [not each.is_zero() for each in ca.vertsplit(pose)[POSITION : self.of_pose]]
        resets = [bool(each) for each in np.ptp(dimensions, axis=0)]
        self.varying = [k for k, each in enumerate(moves + turns + resets) if each]
        self.constant = np.zeros(pose.numel())
        self.constant[:POSITION] = np.where(moves, 0.0, knots[0, :POSITION])
        self.constant[self.of_pose :] = np.where(resets, 0.0, dimensions[0])

    def __len__(self) -> int:
        """Number of segments."""
        return len(self._path)

    def _segment_numbers(self) -> tuple[FloatArray, FloatArray]:
        """Return the data (m, N) of the segments, with their error bounds."""
        path = self._path
        arcs = np.zeros((_ARC, len(path)))
        arcs[:, path.arc_segments] = path.arcs.T
        positions = [path.knots[:-1, :3].T, path.knots[1:, :3].T, arcs]
        turns, off = [path.knots[:-1, 3:].T, path.knots[1:, 3:].T], list[FloatArray]()
        if self._is_slerp:
            *turns, rest = self._quaternions()
            off = [rest]
        frame = path.frame
        place = np.zeros(6) if frame is None else np.concatenate([frame.origin, frame.angles])
        placed = np.broadcast_to(place[:, None], (6, len(path)))
        exact = np.zeros((sum(map(len, positions)), len(path)))
        further = [] if self._tool is None else [self._tool.angles[None, :-1], self._tool.angles[None, 1:]]
        further += [self._dimensions[:-1].T, self._dimensions[1:].T]
        return np.concatenate([*positions, *turns, placed, *further]), np.concatenate(
            [exact, *(off or [np.zeros((6, len(path)))]), np.zeros(placed.shape), *map(np.zeros_like, further)]
        )

    def _quaternions(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the unit quaternions (4, N) at both ends of rotations, half their angles (1, N), and error bounds.

        Of the two quaternions of the second rotation, the one nearer to the first is used.
        """
        angles = SX.sym("angles", 3)
        own = ca.vertcat(*_product_of_angles([angles[k] * on for k, on in enumerate(self._turning)], self._path.order))
        arithmetic = PolynomialArithmetic(ca.Function("quaternion", [angles], [ca.densify(own)]))
        at = self._path.knots[:, 3:].T
        found = arithmetic(at, at)
        count = at.shape[1]
        q = np.stack([np.broadcast_to(each.V.mean(axis=0), (count,)) for each in found])
        off = np.stack([np.broadcast_to(each.V[1] - each.V[0], (count,)) for each in found])
        first, last = q[:, :-1], q[:, 1:]
        last = np.where((first * last).sum(axis=0) < 0, -last, last)
        rest = np.concatenate([off[:, :-1], off[:, 1:]])
        # With a and b the norms of difference and sum, h = 2 atan(a / b) and a^2 + b^2 = 4: h has the errors of both.
        half = 2 * np.arctan2(*(np.linalg.norm(each, axis=0) for each in (last - first, last + first)))
        off_half = 2 * np.abs(rest).sum(axis=0) + _HALF
        return first, last, half[None], np.concatenate([rest, off_half[None]])

    def _pose(self, plane: int, s: SX, numbers: SX) -> tuple[SX, SX]:
        """Return the coordinates (c, 1) of a segment: the pose in the world, and the dimensions that change.

        Also return the gaps (2, 1) between the arc and the knots at its ends.

        Args:
            plane: index of the arc's plane; -1 for a line.
            s: (1, 1) parameter along the segment.
            numbers: (m, 1) data of the segment.
        """
        parts = iter(ca.vertsplit(numbers))

        def take(count: int) -> list[SX]:
            return [next(parts) for _ in range(count)]

        start, end = take(3), take(3)
        first, second, radius, growth, angle, sweep = take(_ARC)
        position, gaps = [a + s * (b - a) for a, b in zip(start, end, strict=True)], SX(2, 1)
        if plane >= 0:
            axes = list(PLANES.values())[plane]
            centre = (first, second)

            def on_arc(at: SX) -> list[SX]:
                size, turned = radius + at * growth, angle + at * sweep
                return [c + size * wave(turned) for c, wave in zip(centre, (ca.cos, ca.sin), strict=True)]

            for k, each in zip(axes, on_arc(s), strict=False):
                position[k] = each
            ends = (on_arc(SX(0)), start), (on_arc(SX(1)), end)
            gaps = ca.vertcat(*[sum(ca.fabs(p - knot[k]) for p, k in zip(at, axes, strict=False)) for at, knot in ends])
        turns = self._turn(s, take(9 if self._is_slerp else 6))
        frame, place = self._path.frame, take(6)
        if frame is not None:
            about = [each if on else SX(0) for each, on in zip(place[3:], frame.angles.tolist(), strict=True)]
            quaternion = _product_of_angles(about, ORDERS["rpy"])
            turned = _rotation(quaternion) @ ca.vertcat(*position)
            position = [each + origin for each, origin in zip(ca.vertsplit(turned), place[:3], strict=True)]
            turns = _product(quaternion, turns)
        if self._tool is not None:
            first, last = take(2)
            half = 0.5 * (first + s * (last - first))
            # Components that are zero stay exactly zero.
            about = [SX(each) * ca.sin(half) if each else SX(0) for each in self._tool.axis.tolist()]
            turns = _product(turns, [ca.cos(half), *about])
        dimensions = zip(take(len(self.settings)), take(len(self.settings)), strict=True)
        return ca.vertcat(*position, *turns, *[a + s * (b - a) for a, b in dimensions]), gaps

    def _turn(self, s: SX, numbers: Sequence[SX]) -> list[SX]:
        """Return the coordinates of a segment's rotation in the path's frame, from the segment's data."""
        if self._is_slerp:
            q_0, q_1, half = numbers[:4], numbers[4:8], numbers[8]
            weights = [(1 - s) * _sine_ratio((1 - s) * half), s * _sine_ratio(s * half)]
            pattern = _product_of_angles([SX.sym("a") if on else SX(0) for on in self._turning], self._path.order)
            both = zip(q_0, q_1, pattern, strict=True)
            return [SX(0) if zero.is_zero() else weights[0] * a + weights[1] * b for a, b, zero in both]
        ends = zip(numbers[:3], numbers[3:], self._turning, strict=True)
        angles = [a + s * (b - a) if on else SX(0) for a, b, on in ends]
        if self.is_tangents:
            return [ca.tan(0.5 * each) for each in angles]
        return _product_of_angles(angles, self._path.order)

    def _function(self, plane: int) -> ca.Function:
        """Return the function from parameter and data to the varying coordinates, their derivatives, and gaps."""
        if plane not in self._functions:
            s, numbers = SX.sym("s"), SX.sym("numbers", len(self._numbers[0]))
            pose, gaps = self._pose(plane, s, numbers)
            pose = pose[self.varying, :]
            every = ca.vertcat(pose, ca.jacobian(pose, s), gaps)
            self._functions[plane] = ca.Function("pose", [ca.vertcat(s, numbers)], ca.cse([ca.densify(every)]))
        return self._functions[plane]

    def _arithmetic(self, plane: int) -> PolynomialArithmetic:
        """Return the polynomial arithmetic of :meth:`_function`."""
        if plane not in self._arithmetics:
            self._arithmetics[plane] = PolynomialArithmetic(self._function(plane))
        return self._arithmetics[plane]

    @np.errstate(all="ignore")
    def over(self, lower: FloatArray, upper: FloatArray) -> tuple[list[Polynomial], list[Polynomial]]:
        """Return the varying coordinates over pieces, and their derivatives with respect to the parameter.

        Both are NaN where a piece does not belong to a single segment.

        Args:
            lower: (B,) places where pieces begin.
            upper: (B,) places where pieces end.
        """
        k = self.segments(lower, upper)
        # Both differences are exact: the operands are close to each other, or one of them is 0.
        ends = lower - k, upper - k
        count, B = len(self.varying), len(k)
        P, s, V = np.zeros((2 * count, 3, B)), np.zeros((2 * count, B)), np.zeros((2 * count, 2, B))
        for plane in np.unique(self._plane[k]).tolist():
            rows = np.flatnonzero(self._plane[k] == plane)
            low, high = (each[rows][None] for each in ends)
            given = [_number(*each) for each in zip(*(each[:, k[rows]] for each in self._numbers), strict=True)]
            *found, at_start, at_end = self._arithmetic(plane)(low, high, given)
            gap = np.maximum((low <= 0) * at_start.V[1], (high >= 1) * at_end.V[1])[0]
            for j, each in enumerate(found):
                P[j][:, rows], s[j, rows], V[j][:, rows] = each.spread((0,)), each.s, each.V
                off = self._off(self.varying[j % count], k[rows])
                if j < count:
                    off = off + gap
                s[j, rows] += off
                V[j][:, rows] += [[-1.0], [1.0]] * off
        s[:, ~((ends[0] >= 0) & (ends[1] <= 1))] = np.nan
        every = [settled((0,), *each) for each in zip(P, s, V, strict=True)]
        return every[:count], every[count:]

    def _off(self, coordinate: int, segments: NDArray[np.intp]) -> FloatArray:
        """Return errors (B,) of a coordinate, or of its derivative, that its expression does not contain.

        They are errors of a rotation: of the series, and of the tool's axis.
        """
        return (_SERIES * self._is_slerp + self._tool_off[segments]) * (POSITION <= coordinate < self.of_pose)

    @cached_property
    def _tool_off(self) -> FloatArray:
        """Errors (N,) of quaternions and their derivatives by the rounding of the tool's axis; 0 for an exact axis."""
        tool, path = self._tool, self._path
        if tool is None or set(np.abs(tool.axis).tolist()) <= {0.0, 1.0}:
            return np.zeros(len(path))
        rates = np.abs(np.diff(path.knots[:, 3:], axis=0)).sum(axis=1) + np.abs(np.diff(tool.angles))
        return np.asarray(_AXIS * (1 + rates))

    def segments(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.intp]:
        """Return the segments (B,) of pieces, by their middles; a knot belongs to the segment that begins there.

        NaN stands for loops that cannot be closed, and belongs to the first segment.
        """
        return np.clip(np.floor(np.nan_to_num(0.5 * lower + 0.5 * upper)), 0, len(self) - 1).astype(np.intp)

    def inverse_seconds(self, segments: NDArray[np.intp]) -> Polynomial:
        """Return the inverse durations of segments (B,).

        A segment without a known time has 0, like a platform at rest.
        """
        seconds = self._path.durations[segments]
        known = np.isfinite(seconds)
        inverse = np.where(known, 1 / np.where(known, seconds, 1.0), 0.0)
        return _number(inverse, np.spacing(inverse) * known)

    def at(self, along: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return varying coordinates (P, v), and derivatives with respect to the parameter, at places (P,)."""
        k, count = self.segments(along, along), len(self.varying)
        found = np.zeros((len(along), 2 * count))
        for plane in np.unique(self._plane[k]).tolist():
            rows = np.flatnonzero(self._plane[k] == plane)
            inputs = np.column_stack([along[rows] - k[rows], self._numbers[0][:, k[rows]].T])
            found[rows] = values_at(self._function(plane), inputs)[0][:, : 2 * count, 0]
        return found[:, :count], found[:, count:]

    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Return the ends (c,) of all coordinates along the path, computed in doubles."""
        lower, upper = self.constant.copy(), self.constant.copy()
        part = np.ones(len(self))
        # Equal parts of several turns may all end at the same point.
        part[self._path.arc_segments] = math.tau / np.maximum(np.abs(self._path.arcs[:, 5]), math.tau)
        parts = part[:, None] * np.linspace(0, 1, _SAMPLES)
        # The end of a segment is the beginning of the next one.
        values = self.at(np.append((np.arange(len(self))[:, None] + parts[:, :-1]).ravel(), len(self)))[0]
        lower[self.varying], upper[self.varying] = values.min(axis=0), values.max(axis=0)
        return lower, upper


def _number(value: FloatArray, off: FloatArray) -> Polynomial:
    """Return values (B,) with their error bounds as constant polynomials."""
    V = np.stack([value - off, value + off])
    return settled((), value[None], off, np.where(off > 0, np.nextafter(V, [[-np.inf], [np.inf]]), V), 0.0)


def _product(left: Sequence[SX], right: Sequence[SX]) -> list[SX]:
    """Return the product of two quaternions: the rotation on the right acts first."""
    (a, b, c, d), (e, f, g, h) = left, right
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]


def _product_of_angles(angles: Sequence[SX], order: Order) -> list[SX]:
    """Return the unit quaternion of three angles in a given order."""

    def about(axis: int) -> list[SX]:
        """Return the unit quaternion of the angle about one axis."""
        found = [SX(0)] * 4
        found[0], found[1 + axis] = ca.cos(0.5 * angles[axis]), ca.sin(0.5 * angles[axis])
        return found

    return reduce(_product, [about(axis) for axis in order])


def _rotation(quaternion: Sequence[SX]) -> SX:
    """Return the rotation (3, 3) of a unit quaternion."""
    w, v = quaternion[0], ca.vertcat(*quaternion[1:])
    return (w * w - ca.sumsqr(v)) * SX.eye(3) + 2 * v @ v.T + 2 * w * ca.skew(v)


def _sine_ratio(x: SX) -> SX:
    """Return ``sin x / x`` up to a right angle, by its series."""
    square, found = x * x, SX(1)
    for k in range(_TERMS, 0, -1):
        found = 1 - square / (2 * k * (2 * k + 1)) * found
    return found
