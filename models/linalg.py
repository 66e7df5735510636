"""Linear algebra beyond NumPy: block-wise, damped and non-negative least squares; reduced echelon form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .arrays import FloatArray, first_largest

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative size of an entry of a basis below which it is a rounding error.
_NEGLIGIBLE = 1e-9
#: Sum of rows and columns from which on a matrix is split into blocks.
_LARGE = 160


def least_squares(A: FloatArray, b: FloatArray, rcond: float | None = None, damping: float = 0.0) -> FloatArray:
    """Return the least-norm minimiser (k,) of ``|A y - b|^2 + damping |y|^2``; a large A is solved block by block.

    Args:
        A: (n, k) matrix, possibly rank deficient.
        b: (n,) vector.
        rcond: relative size, in a block, below which singular values count as zero; None for rounding.
        damping: damping factor, at least 0.
    """
    found = np.zeros(A.shape[1])
    for rows, columns in _blocks(A):
        block = A[np.ix_(rows, columns)]
        if not damping:
            found[columns] = np.linalg.lstsq(block, b[rows], rcond=rcond)[0]
            continue
        left, values, right = np.linalg.svd(block, full_matrices=False)
        weights = values / (values**2 + damping)
        weights[values <= (rcond or 0.0) * values.max(initial=0.0)] = 0.0
        found[columns] = right.T @ (weights * (left.T @ b[rows]))
    return found


def nonnegative_least_squares(A: FloatArray, b: FloatArray) -> FloatArray:
    """Return ``argmin |A y - b|`` over ``y >= 0``, (k,); a large A is solved block by block.

    Args:
        A: (n, k) matrix, possibly rank deficient.
        b: (n,) vector.
    """
    found = np.zeros(A.shape[1])
    for rows, columns in _blocks(A):
        found[columns] = _nonnegative(A[np.ix_(rows, columns)], b[rows])
    return found


def _blocks(A: FloatArray) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return the row and column indices of the diagonal blocks of a matrix.

    A small matrix is one block, because splitting would take longer than it saves.
    """
    n, k = A.shape
    if n + k < _LARGE:
        return [(np.arange(n), np.arange(k))]
    filled = A != 0
    columns = np.arange(k)
    while True:
        # Each row takes the least label of its columns, and each column that of its rows.
        rows = np.where(filled, columns, k).min(axis=1, initial=k)
        following = np.minimum(columns, np.where(filled, rows[:, None], k).min(axis=0, initial=k))
        if np.array_equal(following, columns):
            break
        columns = following
    return [(np.flatnonzero(rows == number), np.flatnonzero(columns == number)) for number in np.unique(columns)]


def _nonnegative(A: FloatArray, b: FloatArray) -> FloatArray:
    """Return ``argmin |A y - b|`` over ``y >= 0``, (k,).

    The method is the active-set method of C. L. Lawson and R. J. Hanson, *Solving Least Squares Problems*, 1974,
    chapter 23.

    Args:
        A: (n, k) matrix, possibly rank deficient.
        b: (n,) vector.
    """
    k = A.shape[1]
    # In most cases the columns are independent and the unconstrained solution is not negative.
    whole, _, rank, _ = np.linalg.lstsq(A, b, rcond=None)
    if rank == k and whole.min(initial=0.0) >= 0:
        return np.asarray(whole, dtype=np.float64)
    y, passive = np.zeros(k), np.zeros(k, dtype=bool)
    tolerance = 1e-14 * max(1.0, float(np.linalg.norm(b)))
    for _ in range(3 * k + 3):
        drive = A.T @ (b - A @ y)
        drive[passive] = -np.inf
        if passive.all() or drive.max() <= tolerance:
            break
        passive[int(np.argmax(drive))] = True
        while True:
            trial = np.zeros(k)
            trial[passive] = np.linalg.lstsq(A[:, passive], b, rcond=None)[0]
            blocked = passive & (trial <= 0)
            if not blocked.any():
                break
            step = float(np.min(y[blocked] / np.maximum(y[blocked] - trial[blocked], 1e-300)))
            y = y + step * (trial - y)
            passive &= y > 1e-15
            y[~passive] = 0.0
        y = trial
    return y


def echelon_basis(vectors: FloatArray) -> FloatArray:
    """Return a sparse basis of the span of vectors, by Gauss-Jordan elimination.

    Args:
        vectors: (k, n) rows, k >= 1, none of them nearly zero.

    Returns:
        (rank, n) rows in reduced echelon form, each with its largest entry 1 and with rounding errors set to 0.
    """
    rows = vectors.copy()
    done = 0
    for _ in range(len(rows)):
        rest = np.abs(rows[done:])
        if rest.max() <= _NEGLIGIBLE:
            break
        # The first of equally large entries, so that rounding does not choose.
        i, j = divmod(int(first_largest(rest.ravel())), rows.shape[1])
        rows[[done, done + i]] = rows[[done + i, done]]
        rows[done] /= rows[done, j]
        for other in range(len(rows)):
            if other != done:
                rows[other] -= rows[other, j] * rows[done]
        done += 1
    rows = rows[:done]
    rows = np.array([row / row[first_largest(np.abs(row))] for row in rows]).reshape(done, vectors.shape[1])
    return np.where(np.abs(rows) > _NEGLIGIBLE, rows, 0.0)
