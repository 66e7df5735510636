"""Largest error of the platform's pose over a workspace, for every machine within its tolerances.

A leg's length changes by at most ``eps = leg error + 2 joint error`` when its joint centres and its length are in
error, at every pose: by the triangle inequality. To first order the platform's origin and its rotation are off by
``J^-1 d`` with ``|d_i| <= eps``, and the largest size is met where every ``d_i`` is eps or -eps.

Over a box ``J^-1`` is ``C - C (J - J0) C + ...``: its part of first order is affine in the coordinates, sizes are
convex, and so largest at a corner of the box. With ``B >= |C (J - J0)|`` the terms of higher order are at most ``B^2
(I - B)^-1 |C|``.

For the rest of the pose error, let the error found be P eps in position and Q eps in rotation. By Taylor's formula the
lengths at the true pose differ from those to first order by at most

    r = ((p + a w)^2 / l + a w^2) / 2,      p = P (eps + r),  w = Q (eps + r),

with l the shortest length of a leg on the way and a the largest distance of a joint from the platform's origin. The
machine comes continuously from the one without errors, and so its errors are those of the smallest such r.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from .boundsearch import Bounds
from .machine import LEGS, Legs
from .posebox import PoseBox
from .rows import FIRST, SECOND, expand

#: Part of its size by which a computed bound is moved outwards: rounding.
_ROUNDING = 1e-10
#: Signs (64, 6) of the coordinates at the corners of a box, and (6, 32) of the errors of legs: a pair of opposite
#: signs has one size.
_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))
_ERRORS = _CORNERS[:32].T
#: Steps in the search of the smallest r.
_STEPS = 200
#: Steps of Newton's method for a pose whose errors are small.
_NEWTON = 8


class WorstError:
    """Minus the largest error of the pose to first order, for unit errors of legs: its smallest value is the worst.

    Args:
        legs: joint centres.
        box: the poses.
        is_rotation: whether the rotation is meant, and not the position of the platform's origin.
    """

    def __init__(self, legs: Legs, box: PoseBox, *, is_rotation: bool) -> None:
        self._legs, self._box = legs, box
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    def values(self, points: FloatArray) -> FloatArray:
        """Return minus the error (K,) at points (K, 6)."""
        return np.asarray(-np.linalg.norm(self.responses(points) @ _ERRORS, axis=1).max(axis=1))

    def worst(self, y: FloatArray) -> FloatArray:
        """Return the signs (6,) of the errors of legs that are worst at a point (6,)."""
        sizes = np.linalg.norm(self.responses(y[None])[0] @ _ERRORS, axis=0)
        return np.asarray(_ERRORS[:, int(np.argmax(sizes))])

    def responses(self, points: FloatArray) -> FloatArray:
        """Return the rows (K, 3, 6) of the inverses of J with unit rows."""
        rows = expand(self._legs, self._box, points, np.zeros_like(points)).terms[:, :, 0]
        lengths = np.linalg.norm(rows[:, :, :3], axis=2)
        with np.errstate(all="ignore"):
            return np.asarray(_inverses(rows)[:, self._part] * lengths[:, None, :])

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""
        centre = 0.5 * lower + 0.5 * upper
        half = np.maximum(upper - centre, centre - lower) * (1 + 2.0**-51)
        terms, rest = expand(self._legs, self._box, centre, half)
        mixed = (half[:, 3:, None] * half[:, None, :3]).reshape(-1, 9)
        factor = np.concatenate([half[:, 3 + FIRST] * half[:, 3 + SECOND], mixed], axis=1)
        with np.errstate(all="ignore"):
            C = _inverses(terms[:, :, 0])
            slopes = np.einsum("bij,bjkl->bkil", C, terms[:, :, 1:7]) * half[:, :, None, None]
            second = np.abs(C) @ (rest + np.einsum("bt,blti->bli", factor, np.abs(terms[:, :, 7:])))
            second += _ROUNDING * (np.abs(C) @ np.abs(terms[:, :, 0]))
            B = np.abs(slopes).sum(axis=1) + second
            # |J^-1| <= X with (I - B) X >= |C|.
            X = np.linalg.solve(np.where(np.isfinite(B), np.eye(LEGS) - B, np.eye(LEGS)), np.abs(C)) * (1 + 1e-6)
            is_bound = (X >= 0).all(axis=(1, 2)) & (np.abs(C) <= X - B @ X).all(axis=(1, 2))
            further = (second + B @ B) @ X
            force = terms[:, :, 0, :3]
            size = np.linalg.norm(force, axis=2)
            moved = terms[:, :, 1:7, :3] * half[:, None, :, None]
            left = (rest[:, :, :3] + np.einsum("bt,blti->bli", factor, np.abs(terms[:, :, 7:, :3]))).sum(axis=2)
            far = np.linalg.norm(np.abs(moved).sum(axis=2), axis=2) + left
            # |f + g| <= |f| + f.g / |f| + |g|^2 / 2|f|, and |J^-1| times a length.
            slope = np.einsum("bli,blki->blk", force / size[:, :, None], moved)
            off = left + far**2 / (2 * size) + _ROUNDING * size
            part = self._part
            fixed = C[:, part] * size[:, None, :]
            linear = -np.einsum("bkij,bjl->bkil", slopes, C)[:, :, part] * size[:, None, None, :]
            linear += C[:, None, part] * slope.transpose(0, 2, 1)[:, :, None, :]
            most = np.abs(C)[:, part] * off[:, None, :] + further[:, part] * (size + far)[:, None, :]
            most += np.abs(slopes).sum(axis=1)[:, part] @ np.abs(C) * far[:, None, :]
            corners = fixed[:, None] + np.einsum("bkil,ck->bcil", linear, _CORNERS)
            worst = np.linalg.norm(corners @ _ERRORS, axis=2).max(axis=(1, 2))
            worst += np.linalg.norm(most.sum(axis=2), axis=1)
        bound = np.where(is_bound & np.isfinite(worst), -worst * (1 + _ROUNDING), -np.inf)
        return Bounds(bound, np.nan_to_num((slopes**2).sum(axis=(2, 3))))


class PoseErrors(NamedTuple):
    """Largest errors of a platform's pose: of its origin's position, length, and of its rotation, radians."""

    position: float
    rotation: float


def with_rest(first: PoseErrors, eps: float, shortest: float, reach: float) -> PoseErrors:
    """Return bounds of the whole errors from bounds to first order.

    Args:
        first: bounds to first order, for errors of legs of at most eps.
        eps: largest error of a leg, length.
        shortest: shortest length of a leg over the workspace.
        reach: largest distance of a joint from the platform's origin.

    Returns:
        Infinite errors where no bound is found: errors are then too large for the machine.
    """
    r = 0.0
    for _ in range(_STEPS):
        grown = (eps + r) / eps * (1 + _ROUNDING)
        position, rotation = first.position * grown, first.rotation * grown
        along = position + reach * rotation
        if not along < shortest:
            break
        needed = 0.5 * (along**2 / (shortest - along) + reach * rotation**2) * (1 + _ROUNDING)
        if needed <= r:
            return PoseErrors(position, rotation)
        r = needed * (1 + 1e-6)
    return PoseErrors(math.inf, math.inf)


def _inverses(matrices: FloatArray) -> FloatArray:
    """Return the inverses of matrices (B, 6, 6); NaN for singular ones."""
    good = np.isfinite(matrices).all(axis=(1, 2)) & (np.linalg.det(np.nan_to_num(matrices)) != 0)
    found: FloatArray = np.full_like(matrices, np.nan)
    found[good] = np.linalg.inv(matrices[good])
    return found


def displaced(legs: Legs, box: PoseBox, y: FloatArray, errors: FloatArray) -> PoseErrors:
    """Return the errors of the pose of a machine whose legs are longer by given lengths, by Newton's method.

    Args:
        legs: joint centres.
        box: the poses.
        y: (6,) the pose without errors.
        errors: (6,) of the lengths of the legs.
    """
    pose = box.pose(y)
    wanted = np.linalg.norm(pose.position + legs.platform @ pose.rotation.T - legs.base, axis=1) + errors
    position, rotation = np.array(pose.position), np.array(pose.rotation)
    for _ in range(_NEWTON):
        arm = legs.platform @ rotation.T
        span = position + arm - legs.base
        lengths = np.linalg.norm(span, axis=1)
        unit = span / lengths[:, None]
        step = np.linalg.solve(np.hstack([unit, np.cross(arm, unit)]), wanted - lengths)
        position = position + step[:3]
        rotation = _turned(step[3:]) @ rotation
    turned = rotation @ pose.rotation.T
    sine = np.linalg.norm([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    angle = math.atan2(float(sine), (float(np.trace(turned)) - 1) / 2)
    return PoseErrors(float(np.linalg.norm(position - pose.position)), angle)


def _turned(w: FloatArray) -> FloatArray:
    """Return the rotation matrix of a rotation vector (3,)."""
    angle = float(np.linalg.norm(w))
    if angle == 0:
        return np.eye(3)
    x, y, z = w / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)
