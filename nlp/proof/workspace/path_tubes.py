"""Proved distance of the platform from its path while actuators move linearly between two points of the path.

Let s be the parameter of a piece of the path, from 0 to h. Linear interpolation of an actuator coordinate ``q_k``
differs from ``q_k(s)`` by ``theta q_k''`` at some point of the piece, with ``theta = s (h - s) / 2 <= h^2 / 8`` for
all k, and by the errors of the two interpolated values.

**Theorem.** Let X be the independent coordinates of the pose, and ``X(s)`` the piece. Let B be a box that contains the
piece and all poses within V of it, coordinate by coordinate. Let the loops close for every pose in B at exactly one
point of a box of passive joint coordinates, so that q is a function of X. Let ``|q_X^-1 e| < V`` at every point of B
for all ``e = theta y + d``, where y is in a box that contains ``q''`` over the piece, and d in a box that contains the
errors of the interpolated values. Then actuators that move linearly between the coordinates at the ends move the
platform along a curve within V of the piece: at every s, its pose X^ is within V of ``X(s)``.

*Proof.* At s let e be the interpolated coordinates minus ``q(X(s))``. The solution of ``dX/dt = q_X(X)^-1 e`` from
``X(s)`` moves by less than ``t V`` while it is in B, so it does not leave B before t = 1, where ``q = q(X(s)) + e``.
This end X^ depends continuously on s, as e does, and at the ends of the piece e is 0 except for rounding. So the X^ are
one continuous motion of the robot with these coordinates, and the only one, as q_X is regular in B.

Columns of ``q_X^-1`` are columns of Z in ``(L_z, q_z) Z = (0, 1)`` with the loop equations L and all coordinates z, so
robots with loops need no special case. Derivatives along the path follow as in :mod:`.numbers.path_speeds`, with one
more differentiation.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ..enclosure.forms import Encloser
from .numbers.expressions import Expressions
from .numbers.quadratic_forms import Quadratics, solved
from .ranks.krawczyk import ROUNDING
from .ranks.loop_boxes import Examiner, LoopBoxes
from .robot.path_cover import PathCover
from .robot.posed_robot import Problem


class Tubes:
    """A robot near pieces of a path: bounds of derivatives of its actuator coordinates, and of its motions.

    Args:
        problem: the robot with all six coordinates of the pose, some of them possibly dependent.
        coordinates: (a, 1) actuator coordinates.
        cover: boxes of the path.
    """

    def __init__(self, problem: Problem, coordinates: SX, cover: PathCover) -> None:
        self._problem, self._cover, z = problem, cover, problem.z
        self._own, self._D = list(problem.independent), list(problem.dependent)
        f, k, n = len(self._own), len(self._D), z.numel()
        self._examiner = Examiner(problem, Expressions(problem, coordinates))
        w, a, d, v = SX.sym("w", f), SX.sym("a", f), SX.sym("d", k), SX.sym("v", n)
        # Derivatives of the tangents of half angles.
        halves = [0.5 * (1 + z[j] ** 2) if j >= 3 else SX(1) for j in self._own]
        first = [half * w[i] for i, half in enumerate(halves)]
        second = [
            half * a[i] + (z[j] * half * w[i] ** 2 if j >= 3 else 0)
            for i, (j, half) in enumerate(zip(self._own, halves, strict=True))
        ]
        along = SX(n, 1)
        along[self._own], along[self._D] = ca.vertcat(SX(0, 1), *first), d
        every = ca.vertcat(problem.equations, coordinates)
        slopes = ca.jacobian(every, z)
        bend = ca.substitute(ca.jtimes(ca.jtimes(every, z, v), z, v), v, along)
        bend += slopes[:, self._own] @ ca.vertcat(SX(0, 1), *second)
        of_path = slopes[:k, self._own] @ ca.vertcat(SX(0, 1), *first)
        self._slopes = _Matrices(z, [slopes])
        self._rates = _Matrices(ca.vertcat(z, w), [slopes[:k, self._D], of_path])
        whole = ca.vertcat(z, w, a, d)
        self._bends = _Matrices(whole, [slopes[:k, self._D], slopes[k:, self._D], bend[:k], bend[k:]])
        self._values = _Matrices(z, [coordinates])

    def boxes(self, pieces: FloatArray, near: FloatArray, room: FloatArray | float = 0.0) -> LoopBoxes:
        """Return boxes that contain pieces (B, 3) with a margin (B, f), and their dependent coordinates."""
        ends = np.full((2, len(pieces), len(self._problem.start)), np.nan)
        ends[:, :, :6] = self._cover.boxes(pieces)
        ends[:, :, self._D] = np.nan
        ends[0][:, self._own] -= room
        ends[1][:, self._own] += room
        boxes = LoopBoxes(ends[0], ends[1], near, np.full(len(pieces), not self._D))
        return self._examiner.examine(boxes).boxes if self._D else boxes

    def bends(self, pieces: FloatArray, boxes: LoopBoxes) -> tuple[FloatArray, FloatArray]:
        """Return middles and half widths (B, a) of the second derivatives of actuator coordinates along pieces.

        They are infinite or NaN where no bound is known.
        """
        slow, fast = (each[:, self._own] for each in self._cover.derivatives(pieces))
        lower, upper = np.hstack([boxes.lower, slow]), np.hstack([boxes.upper, fast])
        if self._D:
            L_D, L_t = self._rates.over(lower, upper)
            middle, half = _middles(solved(L_D, L_t).times(-1.0))
            low, high = middle - half, middle + half
        else:
            low = high = np.zeros((len(pieces), 0))
        least, most = (each[:, self._own] for each in self._cover.derivatives(pieces, 2))
        L_D, q_D, of_loops, found = self._bends.over(np.hstack([lower, least, low]), np.hstack([upper, most, high]))
        if self._D:
            found = found.plus(q_D.matmul(solved(L_D, of_loops)).times(-1.0))
        return _middles(found)

    def moved(self, boxes: LoopBoxes, middle: FloatArray, half: FloatArray) -> FloatArray:
        """Return the largest displacements (B, n) of the coordinates for changes of the actuator coordinates.

        Args:
            boxes: boxes in which the coordinates move.
            middle: (B, a) middles of the changes, which any factor from 0 to 1 may scale.
            half: (B, a) half widths of the changes.
        """
        (slopes,) = self._slopes.over(boxes.lower, boxes.upper)
        (n, a), terms, count = (slopes.c.shape[0], half.shape[1]), slopes.a.shape[2], len(half)
        right = np.tile(np.eye(n)[:, n - a :, None], (1, 1, count))
        found = solved(slopes, _constant(right, terms))
        along = found.matmul(_constant(middle.T[:, None], terms)).size[:, 0].T
        return np.asarray((along + np.einsum("nab,ba->bn", found.size, half)) * (1 + ROUNDING))

    def values(self, boxes: LoopBoxes) -> tuple[FloatArray, FloatArray]:
        """Return the lower and upper ends (B, a) of the actuator coordinates over boxes."""
        (found,) = self._values.over(boxes.lower, boxes.upper)
        middle, half = _middles(found)
        return middle - half, middle + half


class _Matrices:
    """Forms of matrices over boxes.

    Args:
        z: (n, 1) coordinates.
        matrices: matrices of expressions.
    """

    def __init__(self, z: SX, matrices: list[SX]) -> None:
        self._shapes = [each.shape for each in matrices]
        self._encloser = Encloser(z, ca.vertcat(SX(0, 1), *[ca.vec(ca.densify(each)) for each in matrices]))

    def over(self, lower: FloatArray, upper: FloatArray) -> list[Quadratics]:
        """Return forms of the matrices over boxes with ends (B, n); NaN where no form is known."""
        known = np.asarray(np.isfinite(lower + upper).all(axis=1))
        low, high = (np.where(known[:, None], each, 0.0) for each in (lower, upper))
        forms = self._encloser(low.T, high.T)
        forms = forms._replace(r=np.where(known[:, None], forms.r, np.inf))
        ends = np.cumsum([0, *(rows * columns for rows, columns in self._shapes)]).tolist()
        return [
            Quadratics.of(forms.part(slice(begin, end)), lower.shape[1], 0, shape)
            for begin, end, shape in zip(ends, ends[1:], self._shapes, strict=False)
        ]


def _constant(values: FloatArray, terms: int) -> Quadratics:
    """Return constant matrices (n, m, B) as forms with a number of terms."""
    n, m, count = values.shape
    return Quadratics(values, np.zeros((n, m, terms, count)), np.zeros((n, m, 0, count)), np.zeros(values.shape))


def _middles(column: Quadratics) -> tuple[FloatArray, FloatArray]:
    """Return the middles and half widths (B, n) of a column (n, 1)."""
    half = column.varying + column.r + 2 * ROUNDING * column.size
    return column.c[:, 0].T, half[:, 0].T
