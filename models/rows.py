"""Ranks of matrices that vary: independent rows, and groups of columns with independent spans."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative length below which the remainder of a row is zero, so that the row is dependent: rounding leaves 1e-14.
DEPENDENT = 1e-8
#: Relative size below which singular values are zero: at worst, a closed loop is known to the root of rounding.
RANK_TOLERANCE = 1e-7
#: Tolerance on products of unit vectors, and on the dependence of columns. Independent columns, with singular values
#: above ``RANK_TOLERANCE``, depend by at most 1e-16 over the smallest one.
_SAME = 1e-9


class ColumnGroup(NamedTuple):
    """Indices of columns of a matrix, and the rank that these columns add to the preceding groups."""

    columns: tuple[int, ...]
    rank: int


def rank_of(values: NDArray[np.floating[Any]], scale: float | None = None) -> int:
    """Return the number of nonzero singular values, relative to the largest or to a given scale."""
    reference = float(values.max(initial=0.0)) if scale is None else scale
    return int(np.count_nonzero(values > RANK_TOLERANCE * reference))


def independent_rows(jacobians: Sequence[FloatArray]) -> tuple[int, ...]:
    """Return the indices of independent rows, in order.

    Each matrix gives a set, by pivoted orthogonalisation. Of the largest sets, the set with the largest smallest
    singular value over all matrices is returned.

    Args:
        jacobians: (c, n) each, at least one: the same rows at different points.
    """
    sets = {tuple(sorted(_pivoted(each))) for each in jacobians}
    most = max(map(len, sets))

    def worst(rows: tuple[int, ...]) -> float:
        values = [np.linalg.svd(each[list(rows)], compute_uv=False) for each in jacobians]
        return min((float(each[-1] / each[0]) if each[0] else 0.0 for each in values if each.size), default=1.0)

    return max(sorted(each for each in sets if len(each) == most), key=worst)


def _pivoted(jacobian: FloatArray) -> list[int]:
    """Return the indices of rows in the order of pivoted modified Gram-Schmidt."""
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
    """Return groups of columns with ranks that add up at every point where the varying matrix has its full rank.

    First come rotations with axes at constant angles to each other, one by one: such columns are independent
    everywhere. Then come the smallest groups that depend on no column outside this group and the preceding groups.
    Each group keeps its rank where the whole matrix does, so that the choice of columns causes no singularity. Columns
    that are zero are in the first group: there are more of them where the loops of their joints are singular.

    Args:
        matrices: (size, n) each: the same columns at different points, velocities and, if the size is 6, rotations,
            both with magnitudes of about 1.
        rank: rank of the matrix; points with another rank are ignored.

    Returns:
        Groups of columns; empty if they are not known, or there would be only one.
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
    for _ in rest:  # columns that are connected through others
        joined = joined @ joined | joined
    sets = dict.fromkeys(tuple(np.flatnonzero(row).tolist()) for row in joined if row.any())
    groups = [ColumnGroup((k,), 1) for k in first]
    groups += [ColumnGroup(tuple(rest[k] for k in own), max(_rank(each[:, own]) for each in beyond)) for own in sets]
    if sum(each.rank for each in groups) != rank:
        return ()
    zero = tuple(k for k in rest if not any(k in each.columns for each in groups))
    if any(unit[k][:, zero].any() for k in regular):
        return ()  # columns in the span of several rotations belong to no single one
    groups[0] = ColumnGroup((*groups[0].columns, *zero), groups[0].rank)
    return tuple(groups) if len(groups) > 1 else ()


def _fixed_rotations(matrices: Sequence[FloatArray]) -> list[int]:
    """Return the indices of the largest set of independent rotations at constant angles among columns (6, n)."""
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
    """Return the dependence (n, n) of columns on each other: absolute entries of the projector on the row space."""
    right = np.linalg.svd(columns, full_matrices=False)[2][: _rank(columns)]
    return np.asarray(np.abs(right.T @ right))
