"""Bounds of the singular values of J over boxes of poses: J with unit rows, moments divided by a length.

The smallest singular value is 1 over the largest of the inverse, which is affine in the coordinates but for a rest
(:mod:`.inverse`). The norm ``(tr (P P')^m)^(1/2m)`` is convex in P, not below the largest singular value and close to
it, so that its largest value over the affine part is that at a corner of a box. The largest singular value of J itself
is bounded likewise: over a box every entry is ``c + a.e + [-r, r]`` with ``|e_i| <= 1``, the rows of
:mod:`..regular.rows` divided by the length of their force. The Frobenius norm of a rest bounds what it adds.

Errors of joint centres up to t change J by a matrix whose Frobenius norm bounds the change of every singular value
(H. Weyl). With l the shortest length of a leg of any machine, the unit force of a leg changes by at most
``h = 2 t / l``, and its moment about the platform's origin by ``|a| h + t``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from ...statement.machine import JointErrors, Legs
from ..regular.inverse import CORNERS, Inverse, inverse_over
from ..regular.rows import LegRows, rows_at
from ..robot.pose_box import PoseBox
from ..tolerance.leg_errors import change_of_rows, worst_rows
from .bound_search import Bounds

#: Part of its size by which a computed eigenvalue is moved outwards: rounding of products and of LAPACK.
_ROUNDING = 1e-12
#: Squarings in the norm of an inverse: its m is 2 to this power. Two equal singular values make it 2 % too large.
_SQUARINGS = 4


class _Affine(NamedTuple):
    """Numbers over boxes: centres (...), coefficients (..., 6) of the coordinates, and bounds (...) of the rest."""

    c: FloatArray
    a: FloatArray
    r: FloatArray

    @property
    def spread(self) -> FloatArray:
        """Largest distance from the centre."""
        return np.asarray(np.abs(self.a).sum(axis=-1) + self.r)


class SingularValues:
    """Smallest singular value, or minus the condition number, of J over a workspace.

    With a tolerance of the legs the bounds are those of all machines within it, and values those of the machine that is
    worst to first order at each point.

    Args:
        legs: joint centres.
        box: the poses.
        length: by which moments about the platform's origin are divided.
        is_condition: whether minus the condition number is meant, whose smallest value is that of the worst pose.
        shortest: no leg of any machine is shorter over the workspace; used with a tolerance alone.
    """

    def __init__(self, legs: Legs, box: PoseBox, length: float, *, is_condition: bool, shortest: float = 0.0) -> None:
        self._box, self._length, self._is_condition = box, length, is_condition
        self._built, self._legs = legs, legs._replace(tolerance=0.0)
        self._rows = LegRows(legs, box)
        self._change = change_of_rows(legs, length, shortest)

    def values(self, points: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, 6)."""
        with np.errstate(all="ignore"):
            if self._change:
                return self._of(worst_rows(self._built, self._box, points, self._length, self._is_condition)[0])
            return self._of(rows_at(self._legs, self._box, points))

    def errors(self, y: FloatArray) -> JointErrors:
        """Return the errors of the machine that is worst at a point (6,) to first order."""
        _, base, platform = worst_rows(self._built, self._box, y[None], self._length, self._is_condition)
        return JointErrors(base[0], platform[0])

    def _of(self, rows: FloatArray) -> FloatArray:
        """Return the values (K,) of rows (K, 6, 6) of any length."""
        J = rows / np.linalg.norm(rows[:, :, :3], axis=2, keepdims=True)
        J[:, :, 3:] /= self._length
        values = np.linalg.svd(np.nan_to_num(J), compute_uv=False)
        return np.asarray(-values[:, 0] / values[:, -1] if self._is_condition else values[:, -1])

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""
        with np.errstate(all="ignore"):
            J = self._unit_rows(lower, upper)
            inverse = inverse_over(self._rows, lower, upper)
            norm = _norm_of_inverse(inverse, self._length)
            if self._change:
                # The largest singular value may be larger, and the smallest one smaller, by the change of J.
                least = np.maximum(1 / norm - self._change, 0.0)
                found = -(_largest(J) + self._change) / least if self._is_condition else least
            else:
                found = -_largest(J) * norm if self._is_condition else 1 / norm
        bound = np.where(np.isnan(found), -np.inf, found)
        return Bounds(bound if self._is_condition else np.maximum(bound, 0.0), inverse.shares)

    def _unit_rows(self, lower: FloatArray, upper: FloatArray) -> _Affine:
        """Return J, (B, 6, 6)."""
        rows = _Affine(*self._rows.over(lower, upper))
        force = _Affine(rows.c[:, :, :3], rows.a[:, :, :3], rows.r[:, :, :3])
        square = (force.c**2).sum(axis=2)
        slope = 2 * (force.c[..., None] * force.a).sum(axis=2)
        left = (2 * np.abs(force.c) * force.r + force.spread**2).sum(axis=2) + _ROUNDING * square
        size = np.abs(slope).sum(axis=2) + left
        least = square - size
        inverse = 1 / np.sqrt(square)
        # q^(-1/2) = q0^(-1/2) - 1/2 q0^(-3/2) dq + 3/8 q^(-5/2) dq^2, with q between least and q0 + size.
        bend = np.where(least > 0, 0.375 * least**-2.5, np.inf)
        factor_of = _Affine(
            inverse,
            -0.5 * (inverse**3)[..., None] * slope,
            0.5 * inverse**3 * left + bend * size**2 + _ROUNDING * inverse,
        )
        unit = _product(rows, _Affine(factor_of.c[..., None], factor_of.a[..., None, :], factor_of.r[..., None]))
        scale = np.array([1.0, 1.0, 1.0, *[1 / self._length] * 3])
        return _Affine(unit.c * scale, unit.a * scale[:, None], unit.r * scale)


def _product(one: _Affine, other: _Affine) -> _Affine:
    """Return the product of numbers."""
    c = one.c * other.c
    rest = np.abs(one.c) * other.r + np.abs(other.c) * one.r + one.spread * other.spread
    a = one.c[..., None] * other.a + other.c[..., None] * one.a
    return _Affine(c, a, rest + _ROUNDING * (np.abs(c) + np.abs(a).sum(axis=-1)))


def _norm_of_inverse(inverse: Inverse, length: float) -> FloatArray:
    """Return an upper bound (B,) of the largest singular value of the inverse of J, moments divided by a length."""
    scale = np.array([1.0, 1.0, 1.0, length, length, length])[:, None]
    corners = inverse.at_corners(slice(0, 6)) * scale
    square = corners @ corners.transpose(0, 1, 3, 2)
    trace = np.trace(square, axis1=2, axis2=3)
    power = square / trace[:, :, None, None]
    for _ in range(_SQUARINGS):
        power = power @ power
    # A norm of Schatten: convex, and not below the largest singular value.
    norm = np.sqrt(trace) * np.trace(power, axis1=2, axis2=3) ** (0.5 / 2**_SQUARINGS)
    return np.asarray(norm.max(axis=1) * (1 + _ROUNDING) + _norm(inverse.rest * scale))


def _largest(J: _Affine) -> FloatArray:
    """Return an upper bound (B,) of the largest singular value."""
    corners = J.c[:, None] + np.einsum("bilk,sk->bsil", J.a, CORNERS)
    known = np.isfinite(corners).all(axis=(1, 2, 3))
    values = np.linalg.svd(np.nan_to_num(corners), compute_uv=False).max(axis=(1, 2))
    return np.where(known, values * (1 + _ROUNDING) + _norm(J.r), np.inf)


def _norm(r: FloatArray) -> FloatArray:
    """Return the Frobenius norms (B,) of matrices (B, 6, 6), not below their exact values."""
    return np.asarray(np.sqrt((r * r).sum(axis=(1, 2))) * (1 + _ROUNDING))
