"""The claims that the smallest singular value of J is at least, or its condition number at most, a number.

J has unit rows, moments divided by a length L. The smallest singular value is at least t where the inverse, which is
affine in the coordinates but for a rest (:mod:`.inverserows`), is of a norm of at most 1 / t: a convex function, so
that the corners of a box decide. With A the rows whose force is multiplied by L, and D the diagonal matrix of the
squares of the sizes of the forces, the largest singular value is at most t where

    K = (t L)^2 D - A A'      is positive semidefinite.

K is affine too but for a rest. It is first multiplied by a matrix W near the inverse of its factor of Cholesky's at the
centre, from both sides. A condition number is at most k where the smallest singular value is at least t and the largest
at most k t, for any t.

With a tolerance on joint centres every singular value changes by at most a number (:mod:`.built.changes`), so that the
smallest is claimed to be larger by it, and the largest to be smaller by it.
"""

from __future__ import annotations

import itertools

import numpy as np

from .....models import FloatArray
from .ballrows import CORNERS, Joints, ball_rows
from .ballslopes import UNIT, UP, BallSlopes
from .inverserows import inverse_rows
from .pieces import WRONG, Attempt
from .poseroot import PoseRoot
from .positive import are_positive, inverses
from .rankclaim import PRODUCT

#: Pairs of rows of a symmetric matrix, and their places in it.
_PAIRS = np.array(list(itertools.combinations_with_replacement(range(6), 2)))
_PLACES = np.zeros((6, 6), dtype=int)
_PLACES[_PAIRS[:, 0], _PAIRS[:, 1]] = _PLACES[_PAIRS[:, 1], _PAIRS[:, 0]] = np.arange(len(_PAIRS))


class SingularClaim:
    """A claim about singular values.

    Args:
        root: the whole box.
        joints: joint centres.
        length: L.
        bound: the smallest singular value, or the condition number, that is claimed.
        is_condition: whether the condition number is meant.
        change: by how much a singular value changes in the machines that are meant.
    """

    def __init__(
        self, root: PoseRoot, joints: Joints, length: float, bound: float, *, is_condition: bool, change: float = 0.0
    ) -> None:
        self._root, self._joints, self._length, self._change = root, joints, length, change
        self._bound, self._is_condition = bound, is_condition

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        rows = ball_rows(self._root, self._joints, lower, upper).rows
        if not self._is_condition:
            return self._of_inverse(rows, np.full(len(lower), self._with_change(self._bound)))
        A = rows.times(np.array([*[self._length] * 3, 1.0, 1.0, 1.0]))
        gram = (A[:, _PAIRS[:, 0]] * A[:, _PAIRS[:, 1]]).sum(2)
        forces = rows[:, :, :3]
        squares = (forces * forces).sum(2)
        with np.errstate(all="ignore"):
            unit = A.c / np.sqrt(squares.c)[..., None]
            values = np.linalg.svd(np.nan_to_num(unit), compute_uv=False)
            low, high = values[:, -1] / self._length, values[:, 0] / self._length
            # The smallest singular value changes more: most of the room between the two is left to it.
            least = (high + self._change) / self._bound
            t = least * np.sqrt(np.sqrt((low - self._change) / least))
            largest = (t * self._bound * (1 - 4 * UNIT) - self._change) * (1 - 4 * UNIT)
            most = (np.maximum(largest, 0.0) * self._length) ** 2 * (1 - 16 * UNIT)
        one, other = self._of_inverse(rows, self._with_change(t)), _positive(_difference(gram, squares, most))
        shares = one.shares + np.where(other.holds, 0.0, 1.0)[:, None] * other.shares
        return Attempt(one.holds & other.holds, shares, high > low * self._bound * (1 + WRONG))

    def _with_change(self, t: FloatArray | float) -> FloatArray | float:
        """Return the smallest singular value of the exact machine that one of t in all others needs."""
        return (t + self._change) * (1 + 4 * UNIT) if self._change else t

    def _of_inverse(self, rows: BallSlopes, t: FloatArray | float) -> Attempt:
        """Try to show that the smallest singular value is at least t, one number or (B,)."""
        found = inverse_rows(rows)
        scale = np.array([1.0, 1.0, 1.0, *[self._length] * 3])[:, None]
        with np.errstate(all="ignore"):
            rest = found.rest * scale
            off = np.sqrt((rest * rest).sum(axis=(1, 2))) * UP
            room = (1 - 8 * UNIT) / t - off
            corners = found.at_corners(slice(0, 6)) * scale
            square = corners @ corners.transpose(0, 1, 3, 2)
            # Scaling and the product round by a part of the square of the Frobenius norm.
            rounding = 8 * PRODUCT * np.trace(square, axis1=2, axis2=3)
            free = (room * room * (1 - 8 * UNIT))[:, None] - rounding
            holds = found.known & (room > 0) & are_positive(free[..., None, None] * np.eye(6) - square).all(axis=1)
            moved = np.abs(found.T * scale[..., None]).sum(axis=(1, 2))
            shares = moved + found.shares * rest.sum(axis=(1, 2))[:, None]
            at_centre = np.linalg.norm(np.nan_to_num(found.P0 * scale), 2, axis=(1, 2))
            is_wrong = found.known & (at_centre * (t - self._change) > 1 + WRONG)
        return Attempt(np.asarray(holds), shares, np.asarray(is_wrong))


def _difference(gram: BallSlopes, squares: BallSlopes, factor: FloatArray) -> BallSlopes:
    """Return ``factor D - A A'``, (B, 21)."""
    scaled = squares.times(factor[:, None])
    diagonal = _PLACES[np.arange(6), np.arange(6)]
    c, ce, s, se = gram.c.copy(), gram.ce.copy(), gram.s.copy(), gram.se.copy()
    part = gram[:, diagonal] - scaled
    c[:, diagonal], ce[:, diagonal], s[:, diagonal], se[:, diagonal] = part.c, part.ce, part.s, part.se
    return BallSlopes(-c, ce, -s, se, gram.h)


def _positive(K: BallSlopes) -> Attempt:
    """Try to show that symmetric matrices (B, 21) are positive definite."""
    count, h = len(K.c), K.h
    with np.errstate(all="ignore"):
        c = K.c[:, _PLACES]
        radius = K.ce + PRODUCT * np.abs(K.c) + ((K.se + PRODUCT * np.abs(K.s)) @ h[:, :, None])[..., 0]
        radius = radius[:, _PLACES]
        good = are_positive(c)
        factor = np.linalg.cholesky(np.where(good[:, None, None], c, np.eye(6)))
        W = inverses(factor)
        slopes = np.moveaxis(K.s[:, _PLACES], 3, 1)
        T = W[:, None] @ slopes @ W.transpose(0, 2, 1)[:, None]
        centre = W @ c @ W.transpose(0, 2, 1)
        size = np.abs(W)
        # Two products round: each entry by a part of the product of sizes.
        sizes = np.abs(c) + (np.abs(K.s[:, _PLACES]) @ h[:, None, :, None])[..., 0]
        rest = size @ (radius + 4 * PRODUCT * sizes) @ size.transpose(0, 2, 1) * UP
        off = rest.sum(axis=2).max(axis=1)
        used = (h > 0).any(axis=0)
        corners = CORNERS[(CORNERS[:, ~used] == 1).all(axis=1)]
        change = np.einsum("ck,bkij->bcij", corners, h[:, :, None, None] * T, optimize=True)
        M = centre[:, None] + change
        M = 0.5 * (M + M.transpose(0, 1, 3, 2))
        # The sum of seven matrices rounds too.
        off = (
            off + 16 * UNIT * (np.abs(centre) + np.abs(h[:, :, None, None] * T).sum(axis=1)).sum(axis=2).max(axis=1)
        ) * UP
        M -= off[:, None, None, None] * np.eye(6)
        holds = good & np.asarray(are_positive(M)).all(axis=1)
        shares = h * np.abs(T).sum(axis=(2, 3))
    return Attempt(holds, shares.reshape(count, 6))
