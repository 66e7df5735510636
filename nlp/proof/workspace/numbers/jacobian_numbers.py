"""Bounds of singular values and of the first-order pose error over boxes of poses, from left inverses of J.

The rows of J are rows of A divided by norms l; :class:`.ScaledRows` scales the rows so that A is nearly a polynomial
of the coordinates. Let C be a pseudo-inverse of A at the middle of a box, where l is 1. Then ``(C A)^-1 C diag(l)`` is
a left inverse of J, and with ``C A = I + E`` and ``|E| <= B``, entry by entry,

    (I + E)^-1 C = C - E C + ...,    where the terms of higher order are at most  B^2 (I - B)^-1 |C|.

The first-order part in the coordinates is kept exactly, so a convex function of it is largest at a corner of the box.

The smallest singular value of J is at least 1 over the norm of any left inverse. The norm ``(tr (P P')^n)^(1/2n)`` is
convex in P, not below the largest singular value and close to it. The largest singular value of J itself is bounded
likewise, from forms of its entries. The Frobenius norm of a remainder bounds its effect.

Joint-centre errors are additional terms of the rows. For six straight legs and errors up to t, J changes by a matrix
with a Frobenius norm that bounds the change of every singular value (H. Weyl). With a lower bound l of all leg lengths,
the unit force of a leg changes by at most ``h = 2 t / l``, and its moment about the platform's origin by
``|a| h + t``.

Leg-length errors d of six legs move the platform, to first order, by ``J^-1 d``. For ``|d_i| <= 1`` the position error
and the rotation error are largest with every ``d_i`` equal to 1 or -1.
"""

from __future__ import annotations

import itertools
import math
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models.arrays import FloatArray, values_at
from ....evidence.closed_loops import inverses
from ...enclosure.forms import Forms
from ...statement.fixed_robot import LEGS, Legs
from ..ranks.krawczyk import bounds_of_inverses, by_centres
from ..robot.posed_robot import Problem
from .bound_search import Bounds, Number

#: Relative rounding error of computed quantities, from products and LAPACK.
ROUNDING = 1e-10
#: Outward factor of the bound of a change, for rounding.
_OUTWARDS = 1 + 1e-12
#: Relative singular value of the middle matrix that counts as zero.
_ZERO = 1e-14
#: Squarings in the norm of an inverse: n is 2 to this power. Two equal singular values make the norm 0.04 % too large.
_SQUARINGS = 10
#: Signs (6, 32) of leg-length errors: opposite signs give the same pose error.
_ERRORS = np.array(list(itertools.product((-1.0, 1.0), repeat=LEGS)))[: 2 ** (LEGS - 1)].T


class _Rows(NamedTuple):
    """Rows A and norms l of J over B boxes, scaled so that the middle of each norm is 1.

    Attributes:
        A: (B, m, 6) middles.
        terms: (B, t, m, 6) coefficients of terms e with ``|e| <= 1``: f coordinates, then products of two coordinates,
            then joint-centre errors.
        rest: (B, m, 6) remainders.
        bend, slack: (B, t, m) coefficients and (B, m) remainders of the norms.
        coordinates, errors: number f of coordinates, and number of terms that are joint-centre errors.
    """

    A: FloatArray
    terms: FloatArray
    rest: FloatArray
    bend: FloatArray
    slack: FloatArray
    coordinates: int
    errors: int

    def spread(self, linear: FloatArray) -> FloatArray:
        """Return the largest absolute values (B, ...) of linear parts (B, t, ...).

        The three errors of a joint centre are one vector.
        """
        t = linear.shape[1] - self.errors
        return np.asarray(np.abs(linear[:, :t]).sum(axis=1) + by_centres(np.moveaxis(linear[:, t:], 1, -1)))


class _RowsNumber(Number):
    """Base class of quantities that are bounded from the rows of J.

    Args:
        problem: the nominal robot, or all robots within the tolerance.
        length: length that divides moments about the platform's origin.
        family: robots for which values at points are computed; if None, the robots of the problem.
    """

    def __init__(self, problem: Problem, length: float, family: Problem | None = None) -> None:
        scaled, of = problem.posed.scaled, family or problem
        super().__init__(problem, ca.vertcat(ca.vec(ca.densify(scaled.rows)), scaled.sizes))
        self._scale = np.array([1.0, 1.0, 1.0, *[problem.length / length] * 3])
        self._jacobian = ca.Function("J", [of.z], [ca.densify(of.posed.scaled.jacobian)])

    def jacobian(self, z: FloatArray) -> FloatArray:
        """Return J (P, m, 6) at points (P, n) of the family."""
        return np.asarray(values_at(self._jacobian, z)[0] * self._scale)

    def rows(self, forms: Forms, count: int) -> _Rows:
        """Return rows and norms of J over boxes.

        ``forms`` has the forms of the rows, column by column, followed by those of their norms.
        """
        m = self.problem.posed.scaled.rows.shape[0]
        c, a, r = forms.part(slice(0, 7 * m))
        (B, _, t), sizes = a.shape, c[:, 6 * m :]
        with np.errstate(all="ignore"):
            unit = 1 / np.where(sizes > 0, sizes, np.nan)
            A = c[:, : 6 * m].reshape(B, 6, m).transpose(0, 2, 1) * self._scale * unit[:, :, None]
            terms = a[:, : 6 * m].reshape(B, 6, m, t).transpose(0, 3, 2, 1) * self._scale * unit[:, None, :, None]
            rest = r[:, : 6 * m].reshape(B, 6, m).transpose(0, 2, 1) * self._scale * unit[:, :, None]
            bend, slack = a[:, 6 * m :].transpose(0, 2, 1) * unit[:, None], r[:, 6 * m :] * unit
        slack = slack * (1 + ROUNDING) + ROUNDING
        return _Rows(A, terms, rest * (1 + ROUNDING), bend, slack, count, len(self.problem.of_errors))


class SingularValues(_RowsNumber):
    """Smallest singular value of J, or its negative condition number.

    With joint-centre errors, values are taken with the errors that are worst to first order at each point: a singular
    value with singular vectors u and v is ``u . J v``; the entries of J give its derivatives with respect to the
    errors.

    Args:
        problem: the nominal robot, or all robots within the tolerance, where J depends on the joint-centre errors, too.
        length: length that divides moments about the platform's origin.
        is_condition: If true, bound the negative condition number; otherwise the smallest singular value.
        family: all robots within the tolerance, if the problem covers only the nominal robot.
        change: largest change of a singular value within the tolerance.
    """

    def __init__(
        self,
        problem: Problem,
        length: float,
        *,
        is_condition: bool,
        family: Problem | None = None,
        change: float = 0.0,
    ) -> None:
        super().__init__(problem, length, family)
        self._is_condition, self._change, self._family = is_condition, change, family
        self._has_six = problem.posed.scaled.rows.shape[0] >= 6
        if is_condition:
            self.entries = ca.vertcat(self.entries, ca.vec(ca.densify(problem.posed.scaled.jacobian)))

    @cached_property
    def _slopes(self) -> ca.Function:
        """Derivatives of ``u . J v`` with respect to joint-centre errors."""
        of = self._family or self.problem
        J = of.posed.scaled.jacobian * ca.repmat(SX(self._scale.tolist()).T, of.posed.scaled.rows.shape[0], 1)
        u, v = SX.sym("u", J.shape[0]), SX.sym("v", J.shape[1])
        return ca.Function("slopes", [of.z, u, v], [ca.densify(ca.gradient(ca.dot(u, J @ v), of.errors))])

    def _worst(self, family: Problem, z: FloatArray) -> FloatArray:
        """Return points of the nominal robot (P, n) with the joint-centre errors that are worst to first order."""
        z = family.exact(z)
        if not self._has_six:
            return z
        u, s, v = np.linalg.svd(np.nan_to_num(self.jacobian(z)))
        slopes = np.zeros((len(z), len(family.of_errors)))
        # log(condition number) = log(largest) - log(smallest singular value).
        for k, weight in ((5, -1.0), (0, 1.0)) if self._is_condition else ((5, -1.0),):
            slopes += weight / s[:, k, None] * values_at(self._slopes, z, u[:, :, k], v[:, k])[0][:, :, 0]
        return family.with_errors(z, slopes)

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, 1) at points (P, n)."""
        J = self.jacobian(z if self._family is None else self._worst(self._family, z))
        known = np.asarray(np.isfinite(J).all(axis=(1, 2)))
        values = np.linalg.svd(np.where(known[:, None, None], J, 0.0), compute_uv=False)
        least = values[:, 5] if self._has_six else np.zeros(len(values))
        # A singular value of 0 is replaced by rounding error, so that the condition number is finite.
        rounding = np.maximum(np.finfo(float).eps * values[:, 0], np.finfo(float).tiny)
        found = -values[:, 0] / np.maximum(least, rounding) if self._is_condition else least
        return np.where(known, found, np.nan)[:, None]

    def worst(self, y: FloatArray) -> FloatArray | None:
        """Return the worst joint-centre errors (m, 3) at a pose (6,), to first order; None for the nominal robot."""
        if self._family is None:
            return None
        robot = self._worst(self._family, y[None, list(self.problem.free)])[0]
        return self._family.errors_of(robot).vectors

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        rows = self.rows(forms, count)
        fixed, linear, rest, shares = _left_inverses(rows)
        with np.errstate(all="ignore"):
            norm = _schatten(_at_corners(fixed, linear)) + _frobenius(rest)
            found = least = np.maximum(1 / norm - self._change, 0.0) if self._change else 1 / norm
            if self._is_condition:
                largest = self._largest(rows, forms.part(slice(7 * rows.A.shape[1], None))) + self._change
                found = -largest / least if self._change else -largest * norm
        floor = -np.inf if self._is_condition else 0.0
        return Bounds(np.where(np.isfinite(found), found, floor)[:, None], shares)

    def _largest(self, rows: _Rows, forms: Forms) -> FloatArray:
        """Return an upper bound (B,) of the largest singular value of J from forms of J, column by column."""
        (B, _, t), scale = forms.a.shape, self._scale[:, None]
        c, r = (each.reshape(B, 6, -1) * scale for each in (forms.c, forms.r))
        a = forms.a.reshape(B, 6, -1, t).transpose(0, 3, 1, 2) * scale
        corners, rest = _at_corners(c, a[:, : rows.coordinates]), r + rows.spread(a[:, rows.coordinates :])
        known = np.asarray(np.isfinite(corners).all(axis=(1, 2, 3)) & np.isfinite(rest).all(axis=(1, 2)))
        values = np.linalg.norm(np.where(known[:, None, None, None], corners, 0.0), ord=2, axis=(2, 3)).max(axis=1)
        return np.where(known, values * (1 + ROUNDING) + _frobenius(rest), np.inf)


def change_of_rows(legs: Legs, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J due to joint-centre errors within the tolerance.

    Args:
        legs: joint centres, with the tolerance.
        length: length that divides moments.
        shortest: lower bound of all leg lengths, length.

    Returns:
        The bound; 0 without a tolerance, infinite if errors may be as large as a leg length.
    """
    t = legs.tolerance
    if not t:
        return 0.0
    if not shortest > 0:
        return math.inf
    turned = 2 * t / shortest
    moments = (np.linalg.norm(legs.platform, axis=1) * turned + t) / length
    return float(np.sqrt((turned**2 + moments**2).sum())) * _OUTWARDS


class WorstError(_RowsNumber):
    """Largest first-order pose error for leg-length errors of at most 1, negated.

    Args:
        problem: robot with six straight legs.
        is_rotation: If true, bound the rotation error; otherwise the position error of the platform's origin.
    """

    def __init__(self, problem: Problem, *, is_rotation: bool) -> None:
        super().__init__(problem, 1.0)
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    def values(self, z: FloatArray) -> FloatArray:
        """Return the negative error (P, 1) at points (P, n)."""
        return np.asarray(-self._sizes(z).max(axis=1, keepdims=True))

    def worst(self, z: FloatArray) -> FloatArray:
        """Return the signs (6,) of the leg-length errors that are worst at a point (n,)."""
        return np.asarray(_ERRORS[:, int(np.argmax(self._sizes(z[None])))])

    def _sizes(self, z: FloatArray) -> FloatArray:
        """Return the pose errors (P, 32) for all signs of leg-length errors."""
        return np.asarray(np.linalg.norm(inverses(self.jacobian(z))[:, self._part] @ _ERRORS, axis=1))

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        fixed, linear, rest, shares = _left_inverses(self.rows(forms, count))
        with np.errstate(all="ignore"):
            corners = _at_corners(fixed[:, self._part], linear[:, :, self._part])
            worst = np.linalg.norm(corners @ _ERRORS, axis=2).max(axis=(1, 2))
            worst += np.linalg.norm(rest[:, self._part].sum(axis=2), axis=1)
        return Bounds(np.where(np.isfinite(worst), -worst * (1 + ROUNDING), -np.inf)[:, None], shares)


def _left_inverses(rows: _Rows) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return left inverses ``fixed + linear.e + [-rest, rest]`` of J over B boxes, with ``|e_i| <= 1``.

    Returns:
        (B, 6, m) fixed: position, then rotation times a length, for unit values of the rows; (B, f, 6, m) linear:
        change with each coordinate over half of the box; (B, 6, m) rest: remainder, infinite without a bound;
        (B, 1, f) shares of the coordinates in the width.
    """
    known = np.asarray(np.isfinite(rows.A).all(axis=(1, 2)) & np.isfinite(rows.terms).all(axis=(1, 2, 3)))
    A = np.where(known[:, None, None], rows.A, np.eye(rows.A.shape[1], 6))
    f, eye = rows.coordinates, np.eye(6)
    with np.errstate(all="ignore"):
        C = np.linalg.pinv(A, rcond=_ZERO)
        size = np.abs(C)
        slopes = C[:, None] @ np.where(known[:, None, None, None], rows.terms, 0.0)
        far = size @ rows.rest + np.abs(C @ A - eye) + ROUNDING * (size @ np.abs(A))
        first = rows.spread(slopes)
        E = first + far
        known &= np.isfinite(E).all(axis=(1, 2))
        E = np.where(known[:, None, None], E, 0.0)
        # |(I + E)^-1 C| <= X.
        X, holds = bounds_of_inverses(E, size)
        known &= holds
        # Rows are divided by 1 + d with |d| <= spread of the norms.
        change = C[:, None] * rows.bend[:, :, None] - slopes @ C[:, None]
        d = rows.spread(rows.bend) + rows.slack
        rest = rows.spread(change[:, f:]) + size * rows.slack[:, None]
        rest += (far @ size + E @ E @ X) * (1 + d)[:, None] + first @ size * d[:, None]
        rest += ROUNDING * (size + rows.spread(change))
    rest = np.where(known[:, None, None] & np.isfinite(rest), rest, np.inf)
    shares = (slopes[:, :f] ** 2).sum(axis=(2, 3))[:, None]
    return C, change[:, :f], rest, shares


def _at_corners(fixed: FloatArray, linear: FloatArray) -> FloatArray:
    """Return matrices (B, 2^f, r, m) at the corners of boxes, from the middles and linear parts (B, f, r, m)."""
    f = linear.shape[1]
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=f))).reshape(2**f, f)
    return np.asarray(fixed[:, None] + np.einsum("sf,bfij->bsij", signs, linear))


def _schatten(matrices: FloatArray) -> FloatArray:
    """Return, for each box, the largest Schatten norm (B,) of its S matrices (B, S, 6, m).

    This norm is convex, and at least the largest singular value.
    """
    power = matrices @ matrices.transpose(0, 1, 3, 2)
    logarithm: FloatArray = np.zeros(power.shape[:2])
    for k in range(_SQUARINGS + 1):
        power = power @ power if k else power
        # Of trace 1 after each squaring, so that no power underflows.
        trace = np.trace(power, axis1=2, axis2=3)
        power = power / trace[:, :, None, None]
        logarithm = 2 * logarithm + np.log(trace)
    norm = np.exp(logarithm / 2 ** (_SQUARINGS + 1))
    return np.asarray(norm.max(axis=1) * (1 + ROUNDING))


def _frobenius(r: FloatArray) -> FloatArray:
    """Return upper bounds (B,) of the Frobenius norms of matrices (B, r, c)."""
    return np.asarray(np.sqrt((r * r).sum(axis=(1, 2))) * (1 + ROUNDING))
