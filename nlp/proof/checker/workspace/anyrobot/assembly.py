"""Closed loops over boxes: one, and only one, assembly between two ends at every value of the independent coordinates.

With interval slopes of the loop equations, ``0 = g(c) + S_I d_I + S_D d_D`` for the differences d from the centre of a
box of independent coordinates I and dependent ones D. For a matrix Y near the inverse of the middle of S_D, a closed
point of the box has

    d_D = off - T d_I + [-rho, rho],      off = -Y g(c),    T = Y S_I,    rho >= |I - Y S_D| r + rests.

Where the right side is inside of ``[-r, r]`` for every d_I, the map ``d_D - Y g`` has a fixed point there (Brouwer),
and its defect is 0. Where moreover ``|I - Y J_D|`` has a spectral radius below 1 for the derivatives over the box,
there is only one: ``Y (g(z) - g(z'))`` is not 0 for two points with the same d_I. It is a continuous function of d_I.

Source: R. Krawczyk, *Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken*, Computing 4 (1969).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray
from ...slopes import SlopeArithmetic
from ..positive import contraction, inverses
from .interval import PRODUCT, UP, balls, half_widths, middle_and_radius, off_identity
from .looppoints import LoopPoints, dependent_coordinates, is_home
from .posedrobot import PosedRobot

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Factors by which widths of dependent coordinates are made wider, at first and again, and attempts.
_WIDER, _AGAIN, _ATTEMPTS = 1.2, 1.2, 4
#: Smallest and largest half width of a dependent coordinate, in parts of its size.
_LEAST, _MOST = 1e-9, 1.0


class Enclosed(NamedTuple):
    """Closed points over B boxes.

    Attributes:
        lower, upper: (B, n) ends of all coordinates; NaN where nothing is known.
        off: (B, k) of the dependent coordinates at the centre of the others.
        T: (B, k, f) slopes, to be subtracted.
        rho: (B, k) rest.
        near: (B, n) closed points at the centres, computed.
        shares: (B, f) how much each independent coordinate moves the others.
        is_known: (B,) whether there is one closed point, and only one, between the ends at each value of the others.
    """

    lower: FloatArray
    upper: FloatArray
    off: FloatArray
    T: FloatArray
    rho: FloatArray
    near: FloatArray
    shares: FloatArray
    is_known: NDArray[np.bool_]

    def some(self, rows: NDArray[np.int64]) -> Enclosed:
        """Return those over some of the boxes."""
        lower, upper, off, T, rho, near, shares = (each[rows] for each in self[:7])
        return Enclosed(lower, upper, off, T, rho, near, shares, self.is_known[rows])


class Assembly:
    """The closed loops of a robot that change continuously from those at a start.

    Args:
        robot: the robot.
        equations: (k, 1) those that count; none for a robot without loops.
        start: (n,) closed loops.

    Raises:
        UncoveredError: an equation holds an operation without a rule.
        ProofError: the equations leave an unknown free, or are singular at the start.
    """

    def __init__(self, robot: PosedRobot, equations: SX, start: FloatArray) -> None:
        self._size, self._count = robot.size, int(equations.numel())
        self.points = LoopPoints(robot, equations)
        self.dependent = dependent_coordinates(self.points, robot, start, self._count) if self._count else []
        self.independent = [k for k in range(len(start)) if k not in self.dependent]
        # Where numbers of the pose follow from others, the closed loops that were found may be beside a narrow box.
        to = robot.centre[None][:, self.independent]
        (middle,) = self.points.moved(start[None], to, self.independent, self.dependent)
        self.start = middle if is_home(robot, middle) else start
        columns = ca.jacobian(equations, robot.z)
        slopes = [ca.densify(columns[:, j]) for j in self.dependent]
        vector = ca.vertcat(SX(0, 1), equations, *slopes)
        self._arithmetic = SlopeArithmetic(ca.Function("loops", [robot.z], ca.cse([ca.densify(vector)])))

    def near(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return closed points (B, n) at the centres of independent coordinates (B, f), reached from the start."""
        centre = np.clip(0.5 * (lower + upper), lower, upper)
        z = np.broadcast_to(self.start, (len(lower), len(self.start))).copy()
        if not self._count:
            z[:, self.independent] = centre
            return z
        return self.points.moved(z, centre, self.independent, self.dependent)

    def enclosed(self, lower: FloatArray, upper: FloatArray, near: FloatArray) -> Enclosed:
        """Return the closed points over boxes.

        Args:
            lower: (B, f) lower ends of the independent coordinates.
            upper: (B, f) upper ends.
            near: (B, n) closed points at their centres.
        """
        own, D, size = self.independent, self.dependent, self._size
        (B, f), k = lower.shape, self._count
        low, high = np.full_like(near, np.nan), np.full_like(near, np.nan)
        low[:, own], high[:, own] = lower, upper
        found = Enclosed(
            low, high, np.zeros((B, k)), np.zeros((B, k, f)), np.zeros((B, k)), near, np.zeros((B, f)), np.ones(B, bool)
        )
        if not k:
            return found
        found.is_known[:] = False
        with np.errstate(all="ignore"):
            J = self.points.at(near)[1]
            moved = np.abs(inverses(J[:, :, D]) @ J[:, :, own]) * (0.5 * (upper - lower) / size[own])[:, None]
            found.shares[:] = moved.sum(axis=1)
            width = size[D] * np.maximum(_WIDER * moved.sum(axis=2), _LEAST)
            for _ in range(_ATTEMPTS):
                rows = np.flatnonzero(~found.is_known & (width <= _MOST * size[D]).all(axis=1))
                if not rows.size:
                    break
                z = near[rows][:, D]
                low[rows[:, None], D], high[rows[:, None], D] = z - width[rows], z + width[rows]
                width[rows] = self._show(found, rows)
        left = np.flatnonzero(~found.is_known)[:, None]
        low[left, D] = high[left, D] = np.nan
        return found

    def _show(self, found: Enclosed, rows: NDArray[np.int64]) -> FloatArray:
        """Try to show closed points between the ends of some boxes, and return widths that may do.

        Args:
            found: gets what is shown.
            rows: (N,) the boxes.
        """
        own, D, k = self.independent, self.dependent, self._count
        low, high = found.lower[rows].T, found.upper[rows].T
        h = half_widths(low, high)
        values = self._arithmetic(low, high)
        g = balls(values[:k], h)
        A, r = g.s[:, :, D], h[:, D]
        Y = inverses(A)
        size = np.abs(Y)
        off, T = -(Y @ g.c[:, :, None])[:, :, 0], Y @ g.s[:, :, own]
        terms = np.abs(g.c) + (np.abs(g.s) * h[:, None]).sum(axis=2)
        rho = (size @ (g.e + PRODUCT * terms)[:, :, None])[:, :, 0] + (off_identity(Y, A) @ r[:, :, None])[:, :, 0]
        rho = rho * UP
        reach = (np.abs(off) + (np.abs(T) * h[:, None, own]).sum(axis=2) + rho) * UP
        # Derivatives by dependent coordinates are one column after the other.
        ends = [np.array([each.V[side] for each in values[k:]]).reshape(k, k, -1).transpose(2, 1, 0) for side in (0, 1)]
        J, spread = middle_and_radius(ends[0], ends[1])
        defect = off_identity(Y, J) + size @ (spread + PRODUCT * np.abs(J))
        finite = np.asarray(np.isfinite(defect).all(axis=(1, 2)))
        single = contraction(np.where(finite[:, None, None], defect * UP, np.inf)).holds
        # Ends may be nearer to the centre on one side, by rounding.
        centre = np.clip(0.5 * (low + high), low, high)
        room = np.nextafter(np.minimum(high - centre, centre - low), 0.0).T[:, D]
        good = np.asarray((reach < room).all(axis=1) & single & np.isfinite(reach).all(axis=1))
        kept = rows[good]
        found.off[kept], found.T[kept], found.rho[kept] = off[good], T[good], rho[good]
        found.is_known[kept] = True
        return np.asarray(np.maximum(_AGAIN * reach, _LEAST * self._size[D]))
