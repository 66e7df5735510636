"""Independent rows of a matrix that varies: one choice that is independent at several points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .arrays import FloatArray

#: Rows that are left with less than this part of the longest depend on the others: rounding leaves 1e-14.
DEPENDENT = 1e-8


def independent_rows(jacobians: Sequence[FloatArray]) -> tuple[int, ...]:
    """Return the indices of independent rows, in order.

    Each matrix gives a set, by pivoted orthogonalisation. Of the largest sets it is the one whose smallest singular
    value over all matrices is largest.

    Args:
        jacobians: (c, n) each: the same rows at different points, one or more.
    """
    sets = {tuple(sorted(_pivoted(each))) for each in jacobians}
    most = max(map(len, sets))

    def worst(rows: tuple[int, ...]) -> float:
        values = [np.linalg.svd(each[list(rows)], compute_uv=False) for each in jacobians]
        return min((float(each[-1] / each[0]) for each in values if each.size), default=1.0)

    return max(sorted(each for each in sets if len(each) == most), key=worst)


def _pivoted(jacobian: FloatArray) -> list[int]:
    """Return the indices of rows in the order of modified Gram-Schmidt with the longest remaining row first."""
    left = jacobian.copy()
    order: list[int] = []
    longest = 0.0
    for _ in range(min(left.shape)):
        lengths = np.linalg.norm(left, axis=1)
        k = int(np.argmax(lengths))
        longest = longest or float(lengths[k])
        if not lengths[k] > DEPENDENT * longest:
            break
        order.append(k)
        unit = left[k] / lengths[k]
        left = left - np.outer(left @ unit, unit)
    return order
