"""Bounds of the distance between two legs over boxes of poses; legs are line segments between their joint centres.

For a unit vector n, the distance of two segments is at least the smallest ``n.(x - y)`` over their end points x and y:
a plane normal to n separates them. With n between the nearest points at the middle of a box, the bound differs from the
distance by a term of second order in the width of the box.

Within a joint-centre tolerance, every point of a leg may be off by the tolerance, so the distance is smaller by at most
twice the tolerance.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from .....models.arrays import FloatArray, values_at
from ...enclosure.forms import Forms
from ...statement.fixed_robot import Legs
from ..robot.pose_box import polynomial_rotation
from ..robot.posed_robot import Problem, steepest
from .bound_search import Bounds, Number

#: Outward shift of a bound, relative to the sum of the absolute values of all terms, for rounding.
_ROUNDING = 1e-13
#: Threshold below which lines count as parallel; the computed distance is then slightly too large.
_PARALLEL = 1e-12


class Clearance(Number):
    """Distance between two straight legs.

    The bounds use forms of 13 expressions: the end points of both legs, times the scale s of a rotation; and s.

    Args:
        problem: the robot.
        legs: joint centres of the legs, with the tolerance.
        places: indices of the two legs.
    """

    def __init__(self, problem: Problem, legs: Legs, places: Sequence[int]) -> None:
        y = problem.box.symbols(problem.z)
        turned, scale = polynomial_rotation(problem.box, y[3:])
        pairs = [(SX(legs.base[k].tolist()), SX(legs.platform[k].tolist())) for k in places]
        ends = [end for base, arm in pairs for end in (scale * base, scale * y[:3] + turned @ arm)]
        scaled = ca.densify(ca.vertcat(*ends))
        super().__init__(problem, ca.vertcat(scaled, scale))
        self._ends = ca.Function("ends", [problem.z[: len(problem.free)]], [scaled / scale])
        self._legs, self._places, self._nearer = legs, places, 2 * legs.tolerance

    def values(self, z: FloatArray) -> FloatArray:
        """Return the distances (P, 1) at points (P, n)."""
        distances = np.linalg.norm(self.between(z), axis=1, keepdims=True)
        return np.asarray(np.maximum(distances - self._nearer, 0.0))

    def between(self, z: FloatArray) -> FloatArray:
        """Return the vectors (P, 3) from the nearest point of the second leg to the nearest point of the first."""
        return _between(values_at(self._ends, z[:, : len(self.problem.free)])[0][:, :, 0])

    def worst(self, y: FloatArray) -> FloatArray | None:
        """Return the joint-centre errors (m, 3) with the nearest legs at a pose (6,); None for the nominal robot."""
        if not self._nearer:
            return None
        between = self.between(y[None, list(self.problem.free)])
        signs = np.zeros(len(self._legs.base))
        signs[list(self._places)] = -1.0, 1.0
        both = np.concatenate([between, between @ self.problem.box.pose(y).rotation])
        errors = steepest(signs[:, None, None] * both, self._legs.tolerance).reshape(-1, 3)
        # If the full errors would move the legs through each other, smaller errors make the legs touch.
        return min(1.0, float(np.linalg.norm(between)) / self._nearer) * errors

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        ends, moved, rest, (least_scale, rest_of_scale), rounding = _ends_over(forms)
        between = _between(ends.reshape(-1, 12))
        size = np.linalg.norm(between, axis=1, keepdims=True)
        n = np.divide(between, size * (1 + 1e-15), out=np.zeros_like(between), where=size > 0)
        bounds, falls = [], []
        for one, other in itertools.product((0, 1), (2, 3)):
            # n.(x - y) times the scale, minus its middle times the scale.
            along = np.einsum("bk,bkt->bt", n, moved[:, one] - moved[:, other])
            middle = (n * (ends[:, one] - ends[:, other])).sum(axis=1)
            fall = np.abs(along).sum(axis=1) + (np.abs(n) * (rest[:, one] + rest[:, other])).sum(axis=1)
            bounds.append(middle - (fall + np.abs(middle) * rest_of_scale) / least_scale)
            falls.append(np.abs(along))
        least = np.argmin(bounds, axis=0)
        every = np.arange(len(least))
        bound = np.maximum(np.array(bounds)[least, every] - rounding - self._nearer, 0.0)
        shares = np.nan_to_num(_shares(np.array(falls)[least, every], count))
        return Bounds(np.where(np.isfinite(bound), bound, 0.0)[:, None], shares[:, None])

    def most(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return upper bounds (B,) of the nominal robot's distance over boxes (B, n); infinite with open loops."""
        if self.examiner.second is None:
            return np.full(len(lower), np.inf)
        forms = self.examiner.second.second(lower.T, upper.T)
        ends, moved, rest, (least_scale, rest_of_scale), rounding = _ends_over(forms)
        rest += np.abs(ends) * rest_of_scale[:, None, None]
        farthest = np.linalg.norm(np.abs(moved).sum(axis=3) + rest, axis=2) / least_scale[:, None]
        found = np.linalg.norm(_between(ends.reshape(-1, 12)), axis=1) + rounding
        found += farthest.reshape(-1, 2, 2).max(axis=2).sum(axis=1)
        return np.where(np.isfinite(found), found, np.inf)


def _ends_over(forms: Forms) -> tuple[FloatArray, FloatArray, FloatArray, tuple[FloatArray, FloatArray], FloatArray]:
    """Return the ends of two legs over B boxes.

    Args:
        forms: forms of the entries of a clearance.

    Returns:
        (B, 4, 3) ends m at the middles of the boxes; for ``s (x - m)``, with the ends x and the scale s, (B, 4, 3, t)
        terms and (B, 4, 3) remainders; (B,) smallest values and (B,) remainders of the scale; (B,) rounding errors of
        computed distances, infinite where no form is known.
    """
    known = np.isfinite(forms.c).all(axis=1) & np.isfinite(forms.r).all(axis=1)
    c, a, r = (np.where(known.reshape(-1, *[1] * (each.ndim - 1)), each, 1.0) for each in forms)
    ends, shape = c[:, :12] / c[:, 12:], (len(c), 4, 3)
    moved = (a[:, :12] - ends[:, :, None] * a[:, 12:]).reshape(*shape, -1)
    # The scale of a rotation is at least 1.
    least = np.maximum(1.0, (c[:, 12] - np.abs(a[:, 12]).sum(axis=1) - r[:, 12]) * (1 - _ROUNDING))
    terms = 4 * _ROUNDING * (np.abs(c) + np.abs(a).sum(axis=2) + r).sum(axis=1)
    rest, rounding = r[:, :12].reshape(shape), np.where(known, terms, np.inf)
    return ends.reshape(shape), moved, rest, (least, r[:, 12]), rounding


def _shares(falls: FloatArray, count: int) -> FloatArray:
    """Return the share (B, f) of each coordinate in terms (B, t): its linear term, and half of each of its products."""
    shares, pairs = falls[:, :count].copy(), itertools.combinations_with_replacement(range(count), 2)
    for k, (i, j) in zip(range(count, falls.shape[1]), pairs, strict=False):
        shares[:, [i, j]] += 0.5 * falls[:, [k]] * (2 if i == j else 1)
    return shares


def _between(ends: FloatArray) -> FloatArray:
    """Return the vectors (K, 3) between the nearest points of two segments (K, 12), from the second to the first."""
    p, end, q, other = ends.reshape(-1, 4, 3).transpose(1, 0, 2)
    d, e, r = end - p, other - q, p - q
    a, b, c = (d * d).sum(axis=1), (d * e).sum(axis=1), (e * e).sum(axis=1)
    f, g = (d * r).sum(axis=1), (e * r).sum(axis=1)
    with np.errstate(all="ignore"):
        s = np.clip((b * g - f * c) / (a * c - b * b + _PARALLEL * a * c), 0, 1)
        t = np.clip((b * s + g) / c, 0, 1)
        s = np.clip((b * t - f) / a, 0, 1)
    return np.asarray(r + s[:, None] * d - t[:, None] * e)
