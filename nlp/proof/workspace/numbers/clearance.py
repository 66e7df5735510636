"""Bounds of the distance between two legs over boxes of poses: legs as line segments between their joints.

For a unit vector n the distance of two segments is at least the least of ``n.(x - y)`` over their ends x and y: a plane
normal to n separates them. With n between the nearest points at the centre of a box, the bound differs from the
distance by a term of second order in the width of the box. An end on the platform is ``p + u / s`` with the
polynomials of :mod:`..regular.rows`.

Where every joint centre may be off by a tolerance, so may every point of a leg, and the least distance is smaller by
twice the tolerance: that of two legs that are moved towards each other.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser, SecondForms
from ...statement.machine import LEGS, JointErrors, Legs
from ..robot.pose_box import PoseBox, polynomial_rotation
from ..tolerance.leg_errors import along
from .bound_search import Bounds

#: Part of the sum of the sizes of all terms by which a bound is moved outwards: rounding.
_ROUNDING = 1e-13
#: Places of the squares of the three coordinates of a rotation, after these and among their pairs.
_SQUARES = [3, 6, 8]
#: Part of the squared lengths below which lines count as parallel; the distance found is then too large by little.
_PARALLEL = 1e-12


class Clearance:
    """Distance between two legs over a workspace, the least over all machines within the legs' tolerance.

    Args:
        legs: joint centres.
        box: the poses.
        one, other: indices of the two legs.
    """

    def __init__(self, legs: Legs, box: PoseBox, one: int, other: int) -> None:
        self._box = box
        self._base = legs.base[[one, other]]
        self._platform = legs.platform[[one, other]]
        self._legs, self._pair, self._nearer = legs, (one, other), 2 * legs.tolerance
        turn = SX.sym("turn", 3)
        turned, scale = polynomial_rotation(box, turn)
        self._turns = Encloser(turn, ca.vertcat(ca.vec(turned.T), scale))

    def values(self, points: FloatArray) -> FloatArray:
        """Return the distances (K,) at points (K, 6)."""
        distances = np.linalg.norm(self._between(points), axis=1)
        return np.asarray(np.maximum(distances - self._nearer, 0.0) if self._nearer else distances)

    def errors(self, y: FloatArray) -> JointErrors:
        """Return the errors of the machine whose legs are nearest at a point (6,)."""
        moved, between = np.zeros((LEGS, 3)), self._between(y[None])
        moved[list(self._pair)] = np.array([[-1.0], [1.0]]) * between
        errors = along(self._legs, self._box.pose(y).rotation, moved, moved)
        # Legs that the whole errors would move through each other touch with a part of them.
        part = min(1.0, float(np.linalg.norm(between)) / self._nearer) if self._nearer else 1.0
        return JointErrors(part * errors.base, part * errors.platform)

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""
        centre = 0.5 * lower + 0.5 * upper
        half = np.maximum(upper - centre, centre - lower) * (1 + 2.0**-51)
        between = self._between(centre)
        size = np.linalg.norm(between, axis=1, keepdims=True)
        with np.errstate(all="ignore"):
            n = np.where(size > 0, between / (size * (1 + 1e-15)), 0.0)
        form = self._turns.second(lower[:, 3:].T, upper[:, 3:].T)
        a, b = self._platform, self._base
        # Ends of the first leg less ends of the second: base and base, platform and base, base and platform, both.
        moved = (n * centre[:, :3]).sum(axis=1), (np.abs(n) * half[:, :3]).sum(axis=1)
        far = np.abs(centre[:, :3]).sum(axis=1) + half[:, :3].sum(axis=1) + np.abs(a).sum() + np.abs(b).sum()
        choices = (
            (np.zeros(3), 0, b[0] - b[1]),
            (a[0], 1, -b[1]),
            (-a[1], -1, b[0]),
            (a[0] - a[1], 0, np.zeros(3)),
        )
        found = np.full(len(centre), np.inf)
        for turned, by, fixed in choices:
            least = n @ fixed + by * moved[0] - abs(by) * moved[1] + self._least_turned(n, form, turned)
            found = np.minimum(found, least)
        # How far each coordinate moves an end of a leg.
        arms = np.array([1.0, 1.0, 1.0, *[2 * np.linalg.norm(a, axis=1).max()] * 3])
        most = 2 * (
            np.abs(form.c[:, 9]) + np.abs(form.a[:, 9]).sum(axis=1) + np.abs(form.Q[:, 9]).sum(axis=1) + form.r[:, 9]
        )
        found -= _ROUNDING * most * far
        return Bounds(np.maximum(found - self._nearer if self._nearer else found, 0.0), arms * half)

    def _least_turned(self, n: FloatArray, form: SecondForms, a: FloatArray) -> FloatArray:
        """Return the least of ``n.R a`` over each box, (B,)."""
        c, terms, r = form.c, np.concatenate([form.a, form.Q], axis=2), form.r
        middle, moved, rest = (each[:, :9].reshape(len(n), 3, 3, *each.shape[2:]) for each in (c, terms, r))
        at = np.einsum("bi,bij,j->b", n, middle, a) / c[:, 9]
        # n.u - at s is 0 at the centre; s is at least 1.
        change = np.einsum("bi,bijt,j->bt", n, moved, a) - at[:, None] * terms[:, 9]
        falls = np.abs(change)
        falls[:, _SQUARES] = np.maximum(-change[:, _SQUARES], 0.0)
        left = np.einsum("bi,bij,j->b", np.abs(n), rest, np.abs(a)) + np.abs(at) * r[:, 9]
        least_scale = np.maximum(1.0, c[:, 9] - np.abs(terms[:, 9]).sum(axis=1) - r[:, 9])
        return np.asarray(at - (falls.sum(axis=1) + left) / (least_scale * (1 - 1e-14)))

    def _between(self, points: FloatArray) -> FloatArray:
        """Return the vectors (K, 3) from the nearest point of the second leg to that of the first."""
        ends = points[:, None, :3] + np.einsum("bij,lj->bli", self._box.rotations(points), self._platform)
        d, e = ends[:, 0] - self._base[0], ends[:, 1] - self._base[1]
        r = np.broadcast_to(self._base[0] - self._base[1], d.shape)
        a, b, c = (d * d).sum(axis=1), (d * e).sum(axis=1), (e * e).sum(axis=1)
        f, g = (d * r).sum(axis=1), (e * r).sum(axis=1)
        with np.errstate(all="ignore"):
            s = np.clip((b * g - f * c) / (a * c - b * b + _PARALLEL * a * c), 0, 1)
            t = np.clip((b * s + g) / c, 0, 1)
            s = np.clip((b * t - f) / a, 0, 1)
        return np.asarray(r + s[:, None] * d - t[:, None] * e)
