"""Proof that loops over a box close at exactly one point for all values of the independent coordinates.

Over a box, let ``e_I`` be the independent and ``e_D`` the dependent coordinates, scaled to -1 to 1. The loop equations
are ``0 = g + A_I e_I + A_D e_D + [-r, r]``. For a matrix Y near the inverse of A_D, a closed point of the box has

    e_D = off - T e_I + [-rho, rho],      off = -Y g,    T = Y A_I,    rho >= |I - Y A_D| 1 + |Y| r.

If the right side lies inside the box for every e_I, the map ``e_D - Y g`` has a fixed point in the box (Brouwer), and
this is a closed point. If moreover ``|I - Y J_D|`` has a spectral radius below 1 for the derivatives over the box, the
point is unique, as ``Y (g(z) - g(z'))`` is not 0 for two points with the same e_I. The closed point is then a
continuous function of e_I.

Newton's method computes approximate closed points; the criterion above on a small box about each one proves the exact
point. Source: R. Krawczyk,
*Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken*, Computing 4 (1969).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models.arrays import FloatArray
from .....models.rows import independent_rows
from ..polynomials import middles
from ..proof_file import ProofError
from .forms import PRODUCT, UP, AffineMatrix, Forms, inverses, off_identity
from .motion_matrix import PosedRobot
from .pose_boxes import box_words

#: Largest residual of a closed loop. Equations are scaled to values of about 1, and Newton's method ends at rounding
#: errors.
_CLOSED = 1e-10
#: Largest residual of the other equations of a loop; in another assembly mode their residual is about 0.1.
_OTHER = 1e-6
#: Largest number of Newton steps, steps on a path between closed points, and steps from home to another pose.
_STEPS, _WAY, _FROM_HOME = 12, 8, 40
#: Fraction of the largest singular value below which singular values count as zero.
_ZERO = 1e-9
#: Number of points about the start at which dependent equations are identified, and distance of these points relative
#: to the workspace.
_POINTS, _SPREAD, _SEED = 4, 0.5, 1
#: Factor by which widths of dependent coordinates grow, and number of attempts.
_WIDER, _ATTEMPTS = 1.2, 4
#: Smallest and largest half width of a dependent coordinate, relative to the scale of the coordinate.
_LEAST, _MOST = 1e-9, 1.0
#: Number of pairs of boxes that are compared at once, and number of box bounds in a search for touching boxes.
_BLOCK, _ENDS = 512, 2**22


class LoopPoints:
    """Newton's method for closed points: points that satisfy selected loop equations (k, 1) of a robot."""

    def __init__(self, robot: PosedRobot, equations: SX) -> None:
        self._size, self._values, self._slopes = robot.size, robot.function(equations), robot.slopes(equations)
        self._count = int(equations.numel())

    def at(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return left sides (B, k) at points (B, n), and derivatives (B, k, n) with respect to scaled coordinates."""
        (g,) = self._values(z)
        return g[:, :, 0], self._slopes(z) * self._size

    @np.errstate(all="ignore")
    def closed(
        self,
        z: FloatArray,
        moving: Sequence[int],
        to: FloatArray | None = None,
        steps: int = 1,
        zero: float | None = None,
    ) -> FloatArray:
        """Return closed points (B, n) at the ends of paths along which the left sides decrease to 0.

        The result is NaN where a path fails.

        Args:
            z: (B, n) points where the paths begin.
            moving: indices of the coordinates that Newton's method computes from the other coordinates.
            to: (B, f) final values of the other coordinates; None keeps the values of these coordinates.
            steps: number of steps of the path.
            zero: threshold for zero singular values, see :func:`.forms.inverses`; None if the equations determine
                ``moving``.
        """
        z, others = z.copy(), [k for k in range(z.shape[1]) if k not in moving]
        to = z[:, others] if to is None else to
        if not self._count:
            # Every point is closed.
            z[:, others] = to
            return z
        first, way = self.at(z)[0], to - z[:, others]
        size = np.abs(first).max(axis=1, initial=0.0)
        for k in range(1, steps + 1):
            left = 1 - k / steps
            z[:, others] = to - left * way
            for _ in range(2 if left else _STEPS):
                g, J = self.at(z)
                g = g - left * first
                if not np.nanmax(np.abs(g), initial=0.0) > 1e-3 * _CLOSED:
                    break
                z[:, moving] -= self._size[moving] * (inverses(J[:, :, moving], zero) @ g[:, :, None])[:, :, 0]
            # At a fold the left sides cannot decrease further: steps beyond it may end in any assembly mode.
            off = np.abs(self.at(z)[0] - left * first).max(axis=1, initial=0.0)
            z[(size > _CLOSED) & ~(off <= size / steps)] = np.nan
        z[~(np.abs(self.at(z)[0]).max(axis=1, initial=0.0) <= _CLOSED)] = np.nan
        return z


def start_of(robot: PosedRobot) -> FloatArray:
    """Return a closed point (n,) in the home assembly mode at or near the workspace centre.

    The proof is refused without a closed point.
    """
    points, centre, n = LoopPoints(robot, robot.equations), robot.centre[None], len(robot.centre)
    unknowns = list(range(len(robot.free), n))
    # Derivatives of dependent equations are rounding errors and must not cause a step.
    is_closed = np.abs(points.at(centre)[0]).max(initial=0.0) <= _CLOSED
    # Pose coordinates move only if the unknowns cannot close the loops.
    for moving in [unknowns] * bool(unknowns) + [list(range(n))]:
        (found,) = centre if is_closed else points.closed(centre, moving, steps=_FROM_HOME, zero=_ZERO)
        if is_home(robot, found):
            return np.asarray(found)
    raise ProofError("found no solution of the loop equations in the home assembly mode at the workspace centre")


def is_home(robot: PosedRobot, z: FloatArray) -> bool:
    """Return whether a closed point (n,) satisfies all loop equations in the home working mode; False for NaN."""
    loops, signs = robot.function(robot.loops, robot.signs)(z[None])
    return bool(np.isfinite(z).all() and (np.abs(loops) <= _OTHER).all() and (signs > 0).all())


def needed_equations(robot: PosedRobot, start: FloatArray) -> list[int]:
    """Return the indices of independent loop equations, chosen by their rank at a few closed points."""
    if not robot.equations.numel():
        return []
    points, count, n = LoopPoints(robot, robot.equations), len(robot.free), len(start)
    z = np.repeat(start[None], _POINTS, axis=0)
    z[:, :count] += _SPREAD * robot.size[:count] * np.random.default_rng(_SEED).uniform(-1, 1, (_POINTS, count))
    near = points.closed(z, list(range(count, n)), zero=_ZERO)
    near = np.where(np.isfinite(near), near, points.closed(z, list(range(n)), zero=_ZERO))
    slopes = points.at(np.concatenate([start[None], near[np.isfinite(near).all(axis=1)]]))[1]
    return sorted(independent_rows(list(slopes))) if (np.abs(slopes) > _ZERO).any() else []


@dataclass(frozen=True, eq=False)
class Enclosed:
    """Bounds of the closed points over B boxes of the independent coordinates.

    Attributes:
        lower, upper: (B, n) bounds of all coordinates; NaN without a proved closed point.
        off, T, rho: (B, k), (B, k, f) and (B, k) coefficients of the dependent coordinates, see the module's head.
        near: (B, n) computed closed points at the centres.
        shares: (B, f) influence of each independent coordinate on the dependent coordinates.
        is_known: (B,) whether each value of the independent coordinates provably has exactly one closed point.
    """

    lower: FloatArray
    upper: FloatArray
    off: FloatArray
    T: FloatArray
    rho: FloatArray
    near: FloatArray
    shares: FloatArray
    is_known: NDArray[np.bool_]

    def only(self, which: NDArray[np.bool_]) -> Enclosed:
        """Return the closed points over some boxes."""
        return Enclosed(*(each[which] for each in vars(self).values()))

    def boxes(self, which: NDArray[np.bool_]) -> ClosedBoxes:
        """Return some boxes with their computed closed points, to test whether they are in one assembly mode."""
        return ClosedBoxes(self.lower[which], self.upper[which], self.near[which])


class ClosedBoxes(NamedTuple):
    """B boxes that contain exactly one closed point for each value of the independent coordinates.

    Attributes:
        lower, upper: (B, n) bounds of all coordinates.
        near: (B, n) computed closed points at the centres.
    """

    lower: FloatArray
    upper: FloatArray
    near: FloatArray


class Assembly:
    """Closed points of a robot that k independent equations connect continuously with a start point (n,).

    Raises:
        UncoveredError: an equation has an operation without a rule.
        ProofError: the equations do not determine an unknown, or are singular at the start.
    """

    def __init__(self, robot: PosedRobot, equations: SX, start: FloatArray) -> None:
        self._robot, self._size, self._count = robot, robot.size, int(equations.numel())
        self.points = LoopPoints(robot, equations)
        self.dependent = self._determined(start) if self._count else []
        self.independent = [k for k in range(len(start)) if k not in self.dependent]
        # The dependent pose coordinates of the start may lie outside a narrow box.
        (middle,) = self.moved(start[None], robot.centre[None][:, self.independent])
        self.start = middle if is_home(robot, middle) else start
        columns = ca.jacobian(equations, robot.z)[:, self.dependent]
        self._arithmetic = robot.forms(ca.vertcat(SX(0, 1), equations, ca.vec(ca.densify(columns))))

    def _determined(self, start: FloatArray) -> list[int]:
        """Return the indices of the dependent coordinates: dependent coordinates of the pose, and all unknowns."""
        poses, count = len(self._robot.free), self._count
        unknowns = list(range(poses, len(start) - self._robot.errors))
        if count < len(unknowns):
            raise ProofError("the pose does not determine every joint coordinate")
        J, chosen = self.points.at(start[None])[1][0], [*self._robot.dependent, *unknowns]
        values = np.linalg.svd(J[:, chosen], compute_uv=False) if len(chosen) == count else np.zeros(1)
        if not values.min(initial=1.0) > _ZERO * values.max(initial=0.0):
            raise ProofError("the loop equations are singular at the workspace centre")
        return chosen

    def moved(self, z: FloatArray, to: FloatArray) -> FloatArray:
        """Return the closed points (B, n) at other independent coordinates (B, f), on paths from closed points."""
        return self.points.closed(z, self.dependent, to=to, steps=_WAY)

    def near(self, to: FloatArray) -> FloatArray:
        """Return closed points (B, n) at independent coordinates (B, f), on paths from the start."""
        return self.moved(np.broadcast_to(self.start, (len(to), len(self.start))), to)

    def followed(self, forms: Forms, closed: Enclosed) -> Forms:
        """Return forms in the independent coordinates only: bounds of closed points replace the dependent ones."""
        dependent, slopes = forms.a[:, :, self.dependent], forms.a[:, :, self.independent]
        size, most = np.abs(dependent), np.abs(closed.off) + np.abs(closed.T).sum(axis=2)
        terms = np.abs(forms.c) + np.abs(slopes).sum(axis=2) + (size @ most[:, :, None])[:, :, 0]
        rest = (forms.r + (size @ closed.rho[:, :, None])[:, :, 0] + PRODUCT * terms) * UP
        middle = forms.c + (dependent @ closed.off[:, :, None])[:, :, 0]
        return Forms(middle, slopes - dependent @ closed.T, rest)

    @np.errstate(all="ignore")
    def enclosed(self, lower: FloatArray, upper: FloatArray, near: FloatArray | None = None) -> Enclosed:
        """Enclose the points with closed loops over boxes of independent coordinates (B, f).

        ``near`` has approximate points (B, n) with closed loops at the centres of the boxes. If it is left out, these
        points are followed from the start point.
        """
        if near is None:
            near = self.near(middles(lower, upper)[0])
        free, D, size = self.independent, self.dependent, self._size
        (B, f), k = lower.shape, self._count
        low, high = np.full_like(near, np.nan), np.full_like(near, np.nan)
        low[:, free], high[:, free] = lower, upper
        relation = np.zeros((B, k)), np.zeros((B, k, f)), np.zeros((B, k))
        found = Enclosed(low, high, *relation, near, np.zeros((B, f)), np.full(B, not k))
        if not k:
            return found
        J = self.points.at(near)[1]
        moved = np.abs(inverses(J[:, :, D]) @ J[:, :, free]) * (0.5 * (upper - lower) / size[free])[:, None]
        found.shares[:] = moved.sum(axis=1)
        width = size[D] * np.maximum(_WIDER * moved.sum(axis=2), _LEAST)
        for _ in range(_ATTEMPTS):
            rows = np.flatnonzero(~found.is_known & (width <= _MOST * size[D]).all(axis=1))
            if rows.size:
                z = near[rows][:, D]
                low[rows[:, None], D], high[rows[:, None], D] = z - width[rows], z + width[rows]
                width[rows] = self._show(found, rows)
        missing = np.flatnonzero(~found.is_known)[:, None]
        low[missing, D] = high[missing, D] = np.nan
        return found

    def _show(self, found: Enclosed, rows: NDArray[np.int64]) -> FloatArray:
        """Store the proved closed points over some boxes; return widths (N, k) to try for the remaining boxes."""
        free, D, k = self.independent, self.dependent, self._count
        low, high = found.lower[rows], found.upper[rows]
        values = self._arithmetic(low, high)
        g = values.forms(slice(0, k))
        Y = inverses(g.a[:, :, D])
        size = np.abs(Y)
        off, T = -(Y @ g.c[:, :, None])[:, :, 0], Y @ g.a[:, :, free]
        terms = g.r + PRODUCT * (np.abs(g.c) + np.abs(g.a).sum(axis=2))
        rho = ((size @ terms[:, :, None])[:, :, 0] + off_identity(Y, g.a[:, :, D]).sum(axis=2)) * UP
        reach = (np.abs(off) + np.abs(T).sum(axis=2) + rho) * UP
        centre, radius = (each[:, D] for each in middles(low, high))
        # Derivatives column by column, for coordinates from -1 to 1.
        least, most = (
            end.reshape(k, k, -1).transpose(2, 1, 0) * radius[:, None] for end in values.ends(slice(k, None))
        )
        J = 0.5 * (least + most)
        single, _, _ = AffineMatrix(J, np.zeros((len(J), 0, k, k)), 0.5 * (most - least)).contracted(Y)
        # Because of rounding, one bound may be nearer to the centre than the other bound.
        room = np.nextafter(np.minimum(high[:, D] - centre, centre - low[:, D]), 0.0)
        good = np.asarray((reach * radius * UP < room).all(axis=1) & single & np.isfinite(reach).all(axis=1))
        kept = rows[good]
        found.off[kept], found.T[kept], found.rho[kept] = off[good], T[good], rho[good]
        found.is_known[kept] = True
        return np.asarray(np.maximum(_WIDER * reach * radius, _LEAST * self._size[D]))

    def holds(self, boxes: ClosedBoxes, which: NDArray[np.int64], near: FloatArray) -> NDArray[np.bool_]:
        """Return whether each box contains a given closed point (N, n), by a proof in a small box about the point."""
        D, at = self.dependent, near[:, self.independent]
        small = self.enclosed(at, at, near)
        # The affine relation gives a narrower range: for a constant coordinate, the boxes are not wider than the small
        # box.
        centre, radius = (each[:, D] for each in middles(small.lower, small.upper))
        off, rest = radius * small.off, radius * (np.abs(small.T).sum(axis=2) + small.rho) * UP
        rest += PRODUCT * (np.abs(centre) + np.abs(off) + rest)
        low, high = centre + off - rest, centre + off + rest
        inside = (low >= boxes.lower[which][:, D]) & (high <= boxes.upper[which][:, D])
        return np.asarray(small.is_known & inside.all(axis=1))

    def refuse_apart(self, boxes: ClosedBoxes) -> None:
        """Refuse boxes whose closed loops are not proved to belong to the assembly mode of the start.

        Over each box the closed point changes continuously. Two boxes with a common value of the independent
        coordinates are tied if a small box with a proved closed point lies inside both: both then have the same closed
        point there. A chain of such ties must connect every box with the box of the start.
        """
        lower, upper = boxes.lower[:, self.independent], boxes.upper[:, self.independent]
        start = np.broadcast_to(self.start, boxes.near.shape)
        at = start[:, self.independent]
        is_reached = ((lower <= at) & (at <= upper)).all(axis=1) & self.holds(boxes, np.arange(len(lower)), start)
        border = np.flatnonzero(is_reached)
        rows = max(_ENDS // max(lower.size, 1), 1)
        while border.size:
            before = is_reached.copy()
            for first in range(0, len(border), rows):
                some = border[first : first + rows, None]
                touches = ((lower[some] <= upper) & (upper[some] >= lower)).all(axis=2) & ~is_reached
                self._reach(boxes, is_reached, border[first : first + rows], np.argwhere(touches))
            border = np.flatnonzero(is_reached & ~before)
        if not is_reached.all():
            box = box_words(lower[~is_reached][0], upper[~is_reached][0])
            raise ProofError(
                f"in the box {box}, it is not proved that the joints are in the assembly mode of the workspace centre"
            )

    def _reach(
        self, boxes: ClosedBoxes, is_reached: NDArray[np.bool_], border: NDArray[np.intp], pairs: NDArray[np.intp]
    ) -> None:
        """Mark boxes that are tied to a touching box of ``border``, in place.

        Each of the pairs has an index in ``border``, and the index of a touching box.
        """
        lower, upper = boxes.lower[:, self.independent], boxes.upper[:, self.independent]
        for begin in range(0, len(pairs), _BLOCK):
            block = pairs[begin : begin + _BLOCK]
            first, second = block[~is_reached[block[:, 1]]].T
            first = border[first]
            common = middles(np.maximum(lower[first], lower[second]), np.minimum(upper[first], upper[second]))
            near = self.moved(boxes.near[first], common[0])
            tied = self.holds(boxes, first, near) & self.holds(boxes, second, near)
            is_reached[second[tied]] = True
