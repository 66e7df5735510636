"""Rows of six legs over boxes of poses, in the arithmetic of the check.

With ``R`` the rotation, ``s`` the square of its quaternion's size, and ``u = s R a``, the row of a leg from b on the
base to a on the platform is ``(s (p - b) + u, u x (p - b))``: the leg's vector and its moment about the platform's
origin, times s. Both ``s R`` and ``s`` are sums of few monomials: products of components of the quaternion, or of
``1 - t^2``, ``2 t`` and ``1 + t^2`` of each of three tangents.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from .ballslopes import BallSlopes, concatenated, coordinates
from .poseroot import PoseRoot

#: Indices after a component, and before it, of a vector.
AFTER, BEFORE = [1, 2, 0], [2, 0, 1]


class Joints(NamedTuple):
    """Joint centres (6, 3) of six legs: in the base, and in the platform frame."""

    base: FloatArray
    platform: FloatArray


class BallRows(NamedTuple):
    """Rows over B boxes.

    Attributes:
        scale: (B,) s.
        position: (B, 3) p.
        arm: (B, 6, 3) u.
        rows: (B, 6, 6) force, then moment.
    """

    scale: BallSlopes
    position: BallSlopes
    arm: BallSlopes
    rows: BallSlopes


def ball_rows(root: PoseRoot, joints: Joints, lower: FloatArray, upper: FloatArray) -> BallRows:
    """Return the rows over boxes (B, 6)."""
    y = coordinates(lower, upper)
    monomials, weights = _of_tangents(y) if root.kind is TurnKind.ROLL_PITCH_YAW else _of_quaternion(root, y)
    # Weights are 0, 1 or 2 with a sign, one of each entry of the rotation's rows: their products with a are exact.
    arms = np.einsum("ijt,lj->lit", weights[:9].reshape(3, 3, -1), joints.platform).reshape(18, -1)
    found = monomials.combined(np.concatenate([arms, weights[9:]]))
    scale, arm = found[:, 18], _shaped(found[:, :18])
    span = y[:, None, :3].plus(-joints.base)
    force = scale[:, None, None] * span + arm
    moment = arm[:, :, AFTER] * span[:, :, BEFORE] - arm[:, :, BEFORE] * span[:, :, AFTER]
    return BallRows(scale, y[:, :3], arm, concatenated([force, moment], axis=2))


def _shaped(arms: BallSlopes) -> BallSlopes:
    """Return numbers (B, 18) as (B, 6, 3)."""
    count = len(arms.c)
    c, ce = (each.reshape(count, 6, 3) for each in (arms.c, arms.ce))
    s, se = (each.reshape(count, 6, 3, 6) for each in (arms.s, arms.se))
    return BallSlopes(c, ce, s, se, arms.h)


def _ones(y: BallSlopes) -> BallSlopes:
    """Return the number 1 (B, 1)."""
    count = len(y.c)
    return BallSlopes(np.ones((count, 1)), np.zeros((count, 1)), np.zeros((count, 1, 6)), np.zeros((count, 1, 6)), y.h)


def _of_quaternion(root: PoseRoot, y: BallSlopes) -> tuple[BallSlopes, FloatArray]:
    """Return ten products of the quaternion (1, r), and the weights (10, 10) of the entries of s R, and of s."""
    r = y[:, 3:6] if root.kind is TurnKind.ANY_AXIS else y[:, 3:4].times(root.axis)
    products = r[:, [0, 1, 2, 0, 0, 1]] * r[:, [0, 1, 2, 1, 2, 2]]
    monomials = concatenated([_ones(y), r, products], axis=1)
    square = {(0, 0): 4, (1, 1): 5, (2, 2): 6, (0, 1): 7, (0, 2): 8, (1, 2): 9}
    weights = np.zeros((10, 10))
    for i in range(3):
        weights[4 * i, 0] = 1
        for k in range(3):
            weights[4 * i, 4 + k] = 1 if k == i else -1
        j, k = AFTER[i], BEFORE[i]
        mixed = square[min(i, j), max(i, j)]
        # 2 r r' and twice the cross product with r.
        weights[3 * i + j, mixed] = weights[3 * j + i, mixed] = 2
        weights[3 * j + i, 1 + k], weights[3 * i + j, 1 + k] = 2, -2
    weights[9, [0, 4, 5, 6]] = 1
    return monomials, weights


def _of_tangents(y: BallSlopes) -> tuple[BallSlopes, FloatArray]:
    """Return 27 products of ``1 - t^2``, ``2 t`` and ``1 + t^2``, and their weights (10, 27) in s Rz Ry Rx and in s."""
    t = y[:, 3:6]
    square, one = t * t, _ones(y)
    turns = []
    for k in range(3):
        bend = square[:, k : k + 1]
        turns.append(concatenated([one - bend, t[:, k : k + 1].times(np.array([2.0])), one + bend], axis=1))
    roll, pitch, yaw = turns
    monomials = _flat((yaw[:, :, None, None] * pitch[:, None, :, None]) * roll[:, None, None, :])
    # A rotation about one axis: its entries as cosine, sine or 1, each with a sign.
    single = np.zeros((3, 3, 3, 3))
    for about in range(3):
        i, j = AFTER[about], BEFORE[about]
        single[about, i, i, 0] = single[about, j, j, 0] = single[about, about, about, 2] = 1
        single[about, j, i, 1], single[about, i, j, 1] = 1, -1
    entries = np.einsum("ija,jkb,klc->ilabc", single[2], single[1], single[0]).reshape(9, 27)
    return monomials, np.concatenate([entries, np.eye(27)[26:]])


def _flat(products: BallSlopes) -> BallSlopes:
    """Return numbers (B, 3, 3, 3) as (B, 27)."""
    count = len(products.c)
    c, ce = (each.reshape(count, 27) for each in (products.c, products.ce))
    s, se = (each.reshape(count, 27, 6) for each in (products.s, products.se))
    return BallSlopes(c, ce, s, se, products.h)


#: Signs (64, 6) of the coordinates at the corners of a box.
CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))
