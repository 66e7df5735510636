"""Interval slopes of many expressions as middles and radii, and the rounding of products of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ......models import FloatArray
from ...slopes import Slope
from ..ballslopes import UNIT

#: Part of itself by which a sum of nonnegative products moves outwards: more than the rounding of fewer than 400 terms.
UP = 1 + 1024 * UNIT
#: Rounding of a product of matrices with fewer than 400 terms, in parts of the product of sizes.
PRODUCT = 512 * UNIT


class Balls(NamedTuple):
    """R expressions over B boxes: ``v(z) in c + sum_k s_k (z_k - c_k) + [-e, e]``.

    Attributes:
        c: (B, R) middles at the centres.
        e: (B, R) radii over the boxes.
        s: (B, R, n) middles of the slopes.
    """

    c: FloatArray
    e: FloatArray
    s: FloatArray

    def part(self, which: slice) -> Balls:
        """Return those of some of the expressions."""
        return Balls(self.c[:, which], self.e[:, which], self.s[:, which])


def balls(values: list[Slope], h: FloatArray) -> Balls:
    """Return interval slopes as middles and radii.

    Args:
        values: R slopes.
        h: (B, n) half widths of the boxes, rounded up.
    """
    (B, n), count = h.shape, len(values)
    c, e, s = np.zeros((B, count)), np.zeros((B, count)), np.zeros((B, count, n))
    with np.errstate(all="ignore"):
        for k, value in enumerate(values):
            c[:, k], off = middle_and_radius(*value.C)
            middle, radius = middle_and_radius(*value.S)
            s[:, k] = middle.T
            e[:, k] = (off + (radius.T * h).sum(axis=1)) * UP
    return Balls(c, e, s)


def middle_and_radius(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a middle and a radius that hold an interval."""
    middle = 0.5 * low + 0.5 * high
    return middle, np.nextafter(np.maximum(high - middle, middle - low), np.inf)


def half_widths(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return half widths (B, n), rounded up, of boxes (n, B) about the centres of the slopes' arithmetic."""
    centre = np.clip(0.5 * (lower + upper), lower, upper)
    return np.asarray(np.nextafter(np.maximum(upper - centre, centre - lower), np.inf).T)


def off_identity(C: FloatArray, M: FloatArray) -> FloatArray:
    """Return sizes of ``I - C M``, but for the rounding of the product."""
    return np.asarray(np.abs(np.eye(C.shape[-2]) - C @ M) * (1 + 2 * UNIT) + 2 * UNIT)
