"""The test of a sparse matrix over boxes: whether it has full column rank at every closed point.

With forms of the entries, in which the dependent coordinates are replaced by their relation to the independent ones,
``M = M0 + sum_v M_v e_v + [-R, R]``. For any matrix C, here a pseudo-inverse of M0,

    |I - C M| <= |I - C M0| + sum_v |C M_v| + |C| R  entry by entry;

the parts of the three errors of a joint centre, a vector of at most unit length, count together as that of a vector.
Where the right side has a spectral radius below 1, C M has an inverse, and M full column rank.

A matrix whose null space has d dimensions at almost all poses gets d further rows, a basis of the null space at the
middle of the box: full column rank then means that it has no more dimensions anywhere in the box.

Errors of joint centres change polynomial entries, such as those of rows of straight legs, entry by entry: with g_j the
derivative of an entry by the error of centre j, and H its second derivatives by all errors, the entry of a machine
within the tolerance t differs from that of the design by at most ``t sum_j |g_j| + t^2 / 2 sum |H|``. The first
derivatives are bounded over each box, the second ones once over the workspace and all errors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser, Forms
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from .krawczyk import ROUNDING, are_contractions, by_centres

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Operations of polynomials.
_POLYNOMIAL = (
    *(ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER, ca.OP_ASSIGN),
    *(ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE),
)


class Tested(NamedTuple):
    """Results for B boxes.

    Attributes:
        is_regular: (B,) whether the rank is proved to be full.
        shares: (B, f) share of each independent coordinate in the bound.
        smallest: (B,) smallest singular value at the middle as a part of the largest: a computed number.
        signs: (B,) sign of the determinant of a square matrix at the middle: a computed number; 0 for other matrices.
            Where the rank is proved, it is that at every pose of the box.
    """

    is_regular: NDArray[np.bool_]
    shares: FloatArray
    smallest: FloatArray
    signs: NDArray[np.int32]


class RankTest:
    """The test of a matrix.

    Args:
        matrix: the matrix.
        z: (n, 1) symbols of the coordinates.
        start: (n,) a closed point, at which rows and columns are scaled.

    Attributes:
        entries: (E, 1) what is not constant.
        sign: of the determinant of a square matrix at the start; 0 for other matrices.
    """

    def __init__(self, matrix: RankMatrix, z: SX, start: FloatArray) -> None:
        self.nullity, whole = matrix.nullity, matrix.matrix
        values = ca.Function("start", [z], [ca.densify(whole)])(start).full()
        self.sign = int(self._signs(values[None])[0])
        sizes = np.linalg.norm(values, axis=1)
        # A power of two, so that scaling rounds nothing.
        scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        self._constant = np.zeros(whole.shape)
        places, entries = [], []
        for k, place in enumerate(zip(*whole.sparsity().get_triplet(), strict=True)):
            entry = whole.nz[k]
            if entry.is_constant():
                self._constant[place] = float(entry)
            else:
                places.append(place)
                entries.append(entry)
        self.entries: SX = ca.vertcat(SX(0, 1), *entries)
        self._constant *= scale[:, None]
        at = np.array(places, dtype=np.int32).reshape(-1, 2)
        self._at, self._scale = tuple(at.T), np.ascontiguousarray(scale[at[:, 0]])
        self._head = (*whole.shape, matrix.nullity, (at, self._scale, self._constant))

    def examine_second(
        self, encloser: Encloser, lower: FloatArray, upper: FloatArray, change: FloatArray | None = None
    ) -> Tested:
        """Return the verdict on boxes from forms of second order of the entries.

        Args:
            encloser: of the entries.
            lower: (n, B) lower ends of the coordinates.
            upper: (n, B) upper ends.
            change: (E, B) by how much the entries may be off in other machines; None for the design alone.
        """
        n, count = lower.shape
        regular, signs = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
        shares, smallest = np.empty((n, count)), np.empty(count)
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        found = (*ends, regular, shares, smallest, signs, change)
        encloser.module.rank(n, encloser.tape.head, self._head, found, count)
        return Tested(regular.astype(bool), shares.T, smallest, signs)

    def unknown(self, count: int, f: int) -> Tested:
        """Return the results for boxes of which nothing is known."""
        nothing = np.zeros(count, dtype=np.int32)
        return Tested(nothing.astype(bool), np.zeros((count, f)), np.full(count, np.inf), nothing)

    def examine(self, forms: Forms, f: int) -> Tested:
        """Return the verdict on boxes from forms of first order of the entries, whose first f terms are no errors."""
        M0, M, R = self.matrices(forms)
        columns = M0.shape[2]
        _, values, right = np.linalg.svd(M0, full_matrices=True)
        rank = columns - self.nullity
        signs = self._signs(M0)
        if self.nullity:
            extra = right[:, rank:]
            M0 = np.concatenate([M0, extra], axis=1)
            M = np.concatenate([M, np.zeros((*M.shape[:2], *extra.shape[1:]))], axis=2)
            R = np.concatenate([R, np.zeros_like(extra)], axis=1)
        with np.errstate(all="ignore"):
            smallest = (
                np.nan_to_num(values[:, rank - 1] / values[:, 0]) if values.shape[1] >= rank else np.zeros(len(M0))
            )
            C = np.linalg.pinv(M0, rcond=1e-14)
            size = np.abs(C)
            products = C[:, None] @ M
            linear = np.abs(products[:, :f])
            B = np.abs(C @ M0 - np.eye(columns)) + linear.sum(axis=1) + size @ R
            B += by_centres(products[:, f:].transpose(0, 2, 3, 1))
            # Products of fewer than 400 terms, and a sum.
            B += ROUNDING * (size @ (np.abs(M0) + np.abs(M).sum(axis=1)))
            is_regular, v = are_contractions(np.where(np.isfinite(B), B, np.inf) * (1 + ROUNDING))
            shares = (linear * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
        return Tested(is_regular, np.nan_to_num(shares), smallest, signs)

    def matrices(self, forms: Forms) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return middles (B, m, c), linear parts (B, t, m, c), and rests from forms of the entries with t terms.

        Where one is not finite, the rest is infinite, and the others are 0.
        """
        (middle, slope, rest), (rows, columns) = forms, self._at
        M0 = np.broadcast_to(self._constant, (len(middle), *self._constant.shape)).copy()
        R, M = np.zeros_like(M0), np.zeros((len(middle), slope.shape[2], *self._constant.shape))
        M0[:, rows, columns] += middle * self._scale
        R[:, rows, columns] = rest * self._scale
        M[:, :, rows, columns] = (slope * self._scale[:, None]).transpose(0, 2, 1)
        known = np.asarray(np.isfinite(M0).all(axis=(1, 2)) & np.isfinite(R).all(axis=(1, 2)))
        known &= np.isfinite(M).all(axis=(1, 2, 3))
        M0[~known], M[~known], R[~known] = 0.0, 0.0, np.inf
        return M0, M, R

    def _signs(self, matrices: FloatArray) -> NDArray[np.int32]:
        """Return the signs (B,) of the determinants of square matrices (B, m, c); 0 for others."""
        is_square = matrices.shape[1] == matrices.shape[2] and not self.nullity
        return (np.linalg.slogdet(matrices)[0] if is_square else np.zeros(len(matrices))).astype(np.int32)


def is_polynomial(entries: SX, coordinates: SX) -> bool:
    """Return whether entries (E, 1) are polynomials in coordinates (n, 1)."""
    function = ca.Function("entries", [coordinates], [entries])
    constant: set[int] = set()  # work places, which are used again
    for k in range(function.n_instructions()):
        op, to, places = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if op not in _POLYNOMIAL and not (op == ca.OP_DIV and places[1] in constant):
            return False
        if op != ca.OP_OUTPUT:
            (constant.add if op == ca.OP_CONST else constant.discard)(to[0])
    return True


class EntryChange:
    """Largest changes of entries over boxes of poses.

    Args:
        family: all machines; none of their coordinates follows from others.
        entries: (E, 1) polynomials in their coordinates.

    Attributes:
        exact: (E, 1) the entries of the design, in the coordinates of the pose alone.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, family: Problem, entries: SX) -> None:
        errors, count = family.errors, int(entries.numel())
        at_zero = SX.zeros(errors.numel())
        self.exact: SX = ca.substitute(entries, errors, at_zero)
        self._tolerance = family.tolerance
        first, of_entry, of_error = _slopes(entries, errors)
        # One sum for each entry and centre.
        self._sums, self._of_sum = np.unique(of_entry * len(family.names) + of_error // 3, return_inverse=True)
        self._sums //= len(family.names)
        self._slopes = Encloser(family.problem.z, ca.substitute(first, errors, at_zero))
        second, of_slope, _ = _slopes(first, errors)
        box, free, off = family.box, list(family.free), np.full(errors.numel(), family.tolerance)
        ends = np.append(box.lower[free], -off), np.append(box.upper[free], off)
        (sizes,) = Encloser(family.z, second)(*(each[:, None] for each in ends)).sizes
        self._bend = 0.5 * self._tolerance**2 * np.bincount(of_entry[of_slope], sizes, count)

    def over(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return bounds (E, B) over boxes with ends (n, B)."""
        sizes = self._slopes(lower, upper).sizes.T
        squares = np.zeros((len(self._sums), lower.shape[1]))
        np.add.at(squares, self._of_sum, sizes * sizes)
        found = np.repeat(self._bend[:, None], lower.shape[1], axis=1)
        np.add.at(found, self._sums, self._tolerance * np.sqrt(squares))
        return np.ascontiguousarray(found * _OUTWARDS)


def _slopes(expressions: SX, errors: SX) -> tuple[SX, NDArray[np.int64], NDArray[np.int64]]:
    """Return the derivatives by errors that are not 0, with the indices of the expression and of the error of each."""
    found = ca.jacobian(expressions, errors)
    rows, columns = (np.array(each, dtype=np.int64) for each in found.sparsity().get_triplet())
    return ca.vertcat(SX(0, 1), *[found.nz[k] for k in range(found.nnz())]), rows, columns
