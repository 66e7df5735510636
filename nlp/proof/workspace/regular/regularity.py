"""Examination of boxes of poses: whether the rows of six legs have full rank at every pose of a box.

Let ``J(y)`` be the rows of :mod:`.rows`, and ``C`` the inverse of their mean. All poses of a box are regular if

    B >= |I - C J(y)|  entry by entry over the box   has a spectral radius below 1:

then so has ``I - C J(y)``, and ``C J(y)`` has an inverse. A positive vector ``v`` with ``B v < v`` proves this
(Collatz and Wielandt); a few steps of the power method look for it. Any matrix may stand for C, so that its rounding
does not matter.

Sources: A. Neumaier, *Interval Methods for Systems of Equations*, 1990, Sections 3.7 and 4.1; J. Rohn, *Sufficient
conditions for regularity and singularity of interval matrices*, SIAM J. Matrix Anal. Appl. 20 (1998).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .....models import FloatArray
from .....models.arrays import first_largest
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox
from .rows import FIRST, SECOND, TERMS, expand

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Unit by which ends and half widths move outwards: several roundings.
_ULP = 2.0**-51
#: Steps of the power method. The vector need not be exact.
_POWERS = 12


class Rank(enum.IntEnum):
    """Verdict on a box. The numbers are those of ``_workspace.c``."""

    OPEN = 0
    REGULAR = 1
    OUTSIDE = 2  # no pose of the workspace is in it


@dataclass(frozen=True, eq=False)
class RankExamination:
    """Results for B boxes.

    Attributes:
        verdict: (B,) :class:`Rank`.
        split: (B,) the coordinate to bisect next.
        sign: (B,) sign of the determinant of the rows at the centre, 0 where the centre is no pose of the workspace, or
            the sign is not known. It is a computed number and no proof.
        lower, upper: (B, 6) the boxes, contracted to the poses of the workspace.
    """

    verdict: NDArray[np.int32]
    split: NDArray[np.int32]
    sign: NDArray[np.int32]
    lower: FloatArray
    upper: FloatArray


class NumpyRankEngine:
    """Examination in NumPy."""

    name = "numpy"
    #: Number of boxes examined at once: their numbers fit into a processor's cache.
    block = 256

    def __init__(self, legs: Legs, box: PoseBox) -> None:
        self._legs, self._box = legs, box

    def examine(self, lower: FloatArray, upper: FloatArray) -> RankExamination:
        """Examine boxes (B, 6)."""
        lower, upper, outside = self._box.contracted(lower, upper)
        centre = 0.5 * lower + 0.5 * upper
        half = np.maximum(upper - centre, centre - lower) * (1 + _ULP)
        terms, rest = expand(self._legs, self._box, centre, half)
        inside = (centre[:, 3:] ** 2).sum(axis=1) <= self._box.ball
        with np.errstate(all="ignore"):
            sign = np.where(inside, np.sign(np.linalg.det(terms[:, :, 0])), 0.0)
        factor = np.concatenate([np.ones((len(centre), 1)), half, half[:, 3 + FIRST] * half[:, 3 + SECOND]], axis=1)
        factor = np.concatenate([factor, (half[:, 3:, None] * half[:, None, :3]).reshape(-1, 9)], axis=1)
        # The square of a coordinate is half its largest value, plus or minus as much.
        squares = 7 + np.flatnonzero(FIRST == SECOND)
        factor[:, squares] *= 0.5
        terms[:, :, 0] += np.einsum("bt,blti->bli", factor[:, squares], terms[:, :, squares])
        verdict = np.where(outside, Rank.OUTSIDE, Rank.OPEN).astype(np.int32)
        C = _inverses(terms[:, :, 0])
        # Twists and positions have lengths beside angles: in these units nothing depends on the case's unit of length.
        units = np.repeat([self._legs.length, 1.0], 3)
        with np.errstate(all="ignore"):
            product = (C @ terms.reshape(len(centre), 6, TERMS * 6)).reshape(len(centre), 6, TERMS, 6)
            B = np.abs(product[:, :, 0] - np.eye(6)) + np.abs(C) @ rest
            B += np.einsum("bt,bitj->bij", factor[:, 1:], np.abs(product[:, :, 1:]))
            proved, v = _contractions(B * (1 + 64 * _ULP), units)
            verdict[proved & ~outside] = Rank.REGULAR
            spread = half * (np.abs(product[:, :, 1:7]) * v[:, None, None, :] / v[:, :, None, None]).sum(axis=(1, 3))
        known = np.isfinite(spread).all(axis=1)
        split = first_largest(np.where(known[:, None], np.nan_to_num(spread), half / units)).astype(np.int32)
        return RankExamination(verdict, split, sign.astype(np.int32), lower, upper)


def _inverses(matrices: FloatArray) -> FloatArray:
    """Return the inverses of matrices (B, 6, 6); NaN for those that have none."""
    try:
        return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
    except np.linalg.LinAlgError:
        found = np.full_like(matrices, np.nan)
        for k, matrix in enumerate(matrices):
            try:
                found[k] = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                continue
        return found


def _contractions(B: FloatArray, units: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which nonnegative matrices (B, 6, 6) are proved to have a spectral radius below 1, and vectors (B, 6).

    Args:
        B: the matrices.
        units: (6,) sizes of the vectors' components.
    """
    v = np.broadcast_to(units, B.shape[:2]).copy()
    proved = np.zeros(len(B), dtype=bool)
    active = np.asarray(np.isfinite(B).all(axis=(1, 2)), dtype=bool)
    v[~active] = np.nan
    for _ in range(_POWERS):
        rows = np.flatnonzero(active)
        if not rows.size:
            break
        w = (B[rows] @ v[rows, :, None])[:, :, 0]
        ratio = w / v[rows]
        done, hopeless = ratio.max(axis=1) < 1 - 64 * _ULP, ratio.min(axis=1) >= 1
        proved[rows[done]] = True
        active[rows[done | hopeless]] = False
        left = ~(done | hopeless)
        v[rows[left]] = w[left] / (w[left] / units).sum(axis=1, keepdims=True) + 1e-12 * v[rows[left]]
    return proved, v
