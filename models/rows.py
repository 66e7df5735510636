"""Ranks: independent rows of a matrix that varies, and groups of columns with independent spans."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Rows that are left with less than this part of the longest depend on the others: rounding leaves 1e-14.
DEPENDENT = 1e-8
#: Singular values below this part of those of unit size are zero: a closed loop is known to the root of rounding at
#: worst.
RANK_TOLERANCE = 1e-7
#: Products of unit vectors that differ by less than this are the same, and columns depend on each other by more: those
#: that are independent, with singular values above ``RANK_TOLERANCE``, do so by 1e-16 over the smallest one at most.
_SAME = 1e-9


class ColumnGroup(NamedTuple):
    """Indices of columns of a matrix, and the rank that they add to that of the groups before."""

    columns: tuple[int, ...]
    rank: int


def rank_of(values: NDArray[np.floating[Any]], scale: float | None = None) -> int:
    """Return the number of singular values that are not zero, measured by the largest one or by a given scale."""
    reference = float(values.max(initial=0.0)) if scale is None else scale
    return int(np.count_nonzero(values > RANK_TOLERANCE * reference))


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
        return min((float(each[-1] / each[0]) if each[0] else 0.0 for each in values if each.size), default=1.0)

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


def column_groups(matrices: Sequence[FloatArray], rank: int) -> tuple[ColumnGroup, ...]:
    """Return groups of the columns of a matrix that varies, whose ranks add up wherever that of the matrix is the same.

    First come rotations whose axes keep their angles to each other, one by one: such columns are independent
    everywhere. Then come the smallest groups that depend on no column of another group, beyond those before. Where the
    whole matrix keeps its rank each of them does, so that nothing is singular at a point for the choice of a column.
    Columns that are zero are in the first group: they are more where the loops that hold their joints are singular.

    Args:
        matrices: (size, n) each, velocities and, where the size is 6, rotations of order 1: the same columns at
            different points.
        rank: of the matrix; other points than those of this rank say nothing.

    Returns:
        The groups; none where they are not known, or there would be one alone.
    """
    unit = [each / np.where((own := np.linalg.norm(each, axis=0)) > _SAME, own, np.inf) for each in matrices]
    regular = [k for k, each in enumerate(unit) if _rank(each) == rank]
    if len(regular) < 2 or not rank:
        return ()
    first = _fixed_rotations([matrices[k] for k in regular])
    rest = [k for k in range(unit[0].shape[1]) if k not in first]
    bases = [np.linalg.qr(unit[k][:, first])[0] for k in regular]
    beyond = [(unit[k] - base @ (base.T @ unit[k]))[:, rest] for k, base in zip(regular, bases, strict=True)]
    joined = np.any([_dependence(each) > _SAME for each in beyond], axis=0)
    for _ in rest:  # columns that are joined through others
        joined = joined @ joined | joined
    sets = dict.fromkeys(tuple(np.flatnonzero(row).tolist()) for row in joined if row.any())
    groups = [ColumnGroup((k,), 1) for k in first]
    groups += [ColumnGroup(tuple(rest[k] for k in own), max(_rank(each[:, own]) for each in beyond)) for own in sets]
    if sum(each.rank for each in groups) != rank:
        return ()
    zero = tuple(k for k in rest if not any(k in each.columns for each in groups))
    if any(unit[k][:, zero].any() for k in regular):
        return ()  # columns in the span of several rotations are in no group with one of them
    groups[0] = ColumnGroup((*groups[0].columns, *zero), groups[0].rank)
    return tuple(groups) if len(groups) > 1 else ()


def _fixed_rotations(matrices: Sequence[FloatArray]) -> list[int]:
    """Return the indices of the most rotations among columns (6, n), independent and always at the same angles."""
    products = np.array([each[3:].T @ each[3:] for each in matrices])
    is_same = np.ptp(products, axis=0) < _SAME
    most: list[int] = []
    for k in range(products.shape[1]):
        own: list[int] = []
        for j in (k, *range(products.shape[1])):
            at = np.ix_([*own, j], [*own, j])
            if is_same[at].all() and np.linalg.eigvalsh(products[0][at])[0] > RANK_TOLERANCE:
                own.append(j)
        most = max(most, sorted(own), key=len)
    return most


def _rank(columns: FloatArray) -> int:
    """Return the rank of columns of at most unit length."""
    return rank_of(np.linalg.svd(columns, compute_uv=False), 1.0)


def _dependence(columns: FloatArray) -> FloatArray:
    """Return how much columns depend on each other, (n, n): the sizes of the projector on the rows."""
    right = np.linalg.svd(columns, full_matrices=False)[2][: _rank(columns)]
    return np.asarray(np.abs(right.T @ right))
