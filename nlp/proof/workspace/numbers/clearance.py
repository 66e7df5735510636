"""Bounds of the distance between two legs over boxes of poses: legs as line segments between their joints.

For a unit vector n the distance of two segments is at least the least of ``n.(x - y)`` over their ends x and y: a plane
normal to n separates them. With n between the nearest points at the middle of a box, the bound differs from the
distance by a term of second order in the width of the box.

Where every joint centre may be off by a tolerance, so may every point of a leg, and the least distance is smaller by
twice the tolerance: that of two legs that are moved towards each other.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import casadi as ca
import numpy as np

from .....models import FloatArray, Model
from ...enclosure.forms import Forms
from ..robot.posed_robot import PosedModel
from ..robot.tolerance_model import ToleranceModel
from .bound_search import Bounds

#: Part of the sum of the sizes of all terms by which a bound is moved outwards: rounding.
_ROUNDING = 1e-13
#: Part of the squared lengths below which lines count as parallel; the distance found is then too large by little.
_PARALLEL = 1e-12


class Clearance:
    """Distance between two straight legs.

    Args:
        posed: the robot.
        model: its model, with legs.
        places: those of the two legs.
        tolerance: largest error of each of their joint centres, length.

    Attributes:
        entries: (13, 1) ends of the first leg, then of the second, times the scale of a rotation, and the scale.
    """

    def __init__(self, posed: PosedModel, model: Model, places: tuple[int, int], *, tolerance: float = 0.0) -> None:
        self.family: ToleranceModel | None = None
        self._nearer = 2 * tolerance
        R, p = model.pose.rotation, model.pose.position
        ends = ca.vertcat(*[end for k in places for end in (model.legs[k].base, p + R @ model.legs[k].platform)])
        plain, scaled = posed.scaled_points(ends)
        self.entries = ca.densify(ca.vertcat(scaled, posed.scale))
        self._ends = ca.Function("ends", [posed.z], [ca.densify(plain)])

    def values(self, z: FloatArray) -> FloatArray:
        """Return the distances (K,) at points (K, n)."""
        distances = np.linalg.norm(self.between(z), axis=1)
        return np.asarray(np.maximum(distances - self._nearer, 0.0))

    def between(self, z: FloatArray) -> FloatArray:
        """Return the vectors (K, 3) from the nearest point of the second leg to that of the first."""
        return _between(self._ends(z.T).full().T)

    def over(self, forms: Forms, count: int, errors: int) -> Bounds:  # noqa: ARG002 - the tolerance has them
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        at = _EndsOver.of(forms)
        between = _between(at.ends.reshape(-1, 12))
        size = np.linalg.norm(between, axis=1, keepdims=True)
        n = np.divide(between, size * (1 + 1e-15), out=np.zeros_like(between), where=size > 0)
        least, falls = np.full(len(n), np.inf), np.zeros(at.of_scale.shape)
        with np.errstate(all="ignore"):
            for one, other in itertools.product((0, 1), (2, 3)):
                # n.(x - y) times the scale, less its middle times the scale.
                middle = (n * (at.ends[:, one] - at.ends[:, other])).sum(axis=1)
                along = np.einsum("bk,bkt->bt", n, at.terms[:, one] - at.terms[:, other])
                along -= middle[:, None] * at.of_scale
                fall = np.abs(along).sum(axis=1) + np.abs(middle) * at.rest_of_scale
                fall += (np.abs(n) * (at.rest[:, one] + at.rest[:, other])).sum(axis=1)
                bound = middle - fall / at.least_scale
                falls = np.where((bound < least)[:, None], np.abs(along), falls)
                least = np.minimum(least, bound)
        bound = np.maximum(least - at.rounding - self._nearer, 0.0)
        return Bounds(np.where(np.isfinite(bound), bound, 0.0), np.nan_to_num(_shares(falls, count)))

    def most(self, forms: Forms) -> FloatArray:
        """Return upper bounds (B,) of the distance of the design over boxes, from forms of the entries."""
        at = _EndsOver.of(forms)
        moved = np.abs(at.terms - at.ends[..., None] * at.of_scale[:, None, None]).sum(axis=3)
        moved += at.rest + np.abs(at.ends) * at.rest_of_scale[:, None, None]
        farthest = (np.linalg.norm(moved, axis=2) / at.least_scale[:, None]).reshape(-1, 2, 2).max(axis=2).sum(axis=1)
        found = np.linalg.norm(_between(at.ends.reshape(-1, 12)), axis=1) + farthest + at.rounding
        return np.where(np.isfinite(found), found, np.inf)


class _EndsOver(NamedTuple):
    """Ends of two legs over B boxes.

    Attributes:
        ends: (B, 4, 3) in the middle.
        terms, rest: (B, 4, 3, t) and (B, 4, 3) of the ends times the scale.
        of_scale, rest_of_scale, least_scale: (B, t) terms, (B,) rests and (B,) smallest values of the scale.
        rounding: (B,) by which computed distances may be off; infinite where nothing is known.
    """

    ends: FloatArray
    terms: FloatArray
    rest: FloatArray
    of_scale: FloatArray
    rest_of_scale: FloatArray
    least_scale: FloatArray
    rounding: FloatArray

    @classmethod
    def of(cls, forms: Forms) -> _EndsOver:
        """Return the ends from forms of the entries of a clearance."""
        known = np.isfinite(forms.c).all(axis=1) & np.isfinite(forms.r).all(axis=1)
        c, a, r = (np.where(known.reshape(-1, *[1] * (each.ndim - 1)), each, 1.0) for each in forms)
        B, _, t = a.shape
        # The scale of a rotation is at least 1.
        least = np.maximum(1.0, (c[:, 12] - np.abs(a[:, 12]).sum(axis=1) - r[:, 12]) * (1 - _ROUNDING))
        terms = 4 * _ROUNDING * (np.abs(c) + np.abs(a).sum(axis=2) + r).sum(axis=1)
        return cls(
            ends=(c[:, :12] / c[:, 12:]).reshape(B, 4, 3),
            terms=a[:, :12].reshape(B, 4, 3, t),
            rest=r[:, :12].reshape(B, 4, 3),
            of_scale=a[:, 12],
            rest_of_scale=r[:, 12],
            least_scale=least,
            rounding=np.where(known, terms, np.inf),
        )


def _shares(falls: FloatArray, count: int) -> FloatArray:
    """Return the share (B, f) of each coordinate in terms (B, t): its own, and half of each product with it."""
    shares = falls[:, :count].copy()
    for k, (i, j) in enumerate(itertools.combinations_with_replacement(range(count), 2), start=count):
        shares[:, [i, j]] += 0.5 * falls[:, [k]] * (2 if i == j else 1)
    return shares


def _between(ends: FloatArray) -> FloatArray:
    """Return the vectors (K, 3) from the nearest point of the second of two segments (K, 12) to that of the first."""
    p, end, q, other = ends.reshape(-1, 4, 3).transpose(1, 0, 2)
    d, e, r = end - p, other - q, p - q
    a, b, c = (d * d).sum(axis=1), (d * e).sum(axis=1), (e * e).sum(axis=1)
    f, g = (d * r).sum(axis=1), (e * r).sum(axis=1)
    with np.errstate(all="ignore"):
        s = np.clip((b * g - f * c) / (a * c - b * b + _PARALLEL * a * c), 0, 1)
        t = np.clip((b * s + g) / c, 0, 1)
        s = np.clip((b * t - f) / a, 0, 1)
    return np.asarray(r + s[:, None] * d - t[:, None] * e)
