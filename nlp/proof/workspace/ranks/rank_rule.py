"""Test whether a sparse matrix has full column rank at every point with closed loops of a box.

With forms of the entries, in which the dependent coordinates are replaced by their relation to the independent ones,
``M = M0 + sum_v M_v e_v + [-R, R]``; second-order forms also have products of two coordinates. For any matrix C, here a
left inverse of M0,

    |I - C M| <= |I - C M0| + sum_v |C M_v| + |C| R  entry by entry;

with the three errors of each joint centre bounded as one vector of norm at most 1. If the right side has a spectral
radius below 1, C M is regular, and M has full column rank.

If a matrix has a null space of dimension d at almost all poses, d rows are added: a basis of the null space at the
centre of the box. Full column rank then means that the null space has d dimensions everywhere in the box.

Joint-centre errors change polynomial entries, such as entries of rows of straight legs, one by one: let g_j be the
derivative of an entry with respect to the error of centre j, and H its second derivatives with respect to all errors.
The entry of a robot within the tolerance t differs from the entry of the nominal robot by at most
``t sum_j |g_j| + t^2 / 2 sum |H|``. First derivatives are bounded over each box, second derivatives once over the
workspace and all errors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.engine import kernel
from ...enclosure.forms import Encloser, Forms
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from .krawczyk import ROUNDING

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Error of entries relative to the norm of their row: a constant that should be 0 may be rounding error.
_CONSTANTS = 1e-13
#: Outward factor of the bound of a change, for rounding.
_OUTWARDS = 1 + 1e-12
#: Operations that keep an expression a polynomial.
_POLYNOMIAL = (
    *(ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER, ca.OP_ASSIGN),
    *(ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE),
)


class Tested(NamedTuple):
    """Results of a test over B boxes.

    Attributes:
        is_regular: (B,) whether full rank is proved.
        shares: (B, f) share of each independent coordinate in the overestimation of the bound.
        smallest: (B,) computed smallest singular value at the centre of the box, relative to the largest; infinite if
            unknown.
        signs: (B,) computed sign of the determinant of a square matrix at the centre of the box; 0 for other matrices.
            If full rank is proved, the sign is the same at every pose of the box.
    """

    is_regular: NDArray[np.bool_]
    shares: FloatArray
    smallest: FloatArray
    signs: NDArray[np.int32]


def not_regular(shares: FloatArray, smallest: FloatArray) -> Tested:
    """Return the results for boxes without a proof of full rank."""
    signs = np.zeros(len(smallest), dtype=np.int32)
    return Tested(signs.astype(bool), shares, smallest, signs)


class RankTest:
    """Test of the rank of a matrix.

    Args:
        matrix: the matrix.
        z: (n, 1) symbols of the coordinates.
        start: (n,) point with closed loops, at which rows and columns are scaled.

    Attributes:
        entries: (E, 1) entries that are not constant.
        sign: sign of the determinant of a square matrix at the start; 0 for other matrices.
        unknown: value of ``smallest`` for a box without a result.
    """

    unknown: FloatArray = np.array(np.inf)

    def __init__(self, matrix: RankMatrix, z: SX, start: FloatArray) -> None:
        whole = matrix.matrix
        values = ca.Function("start", [z], [ca.densify(whole)])(start).full()
        is_square = whole.shape[0] == whole.shape[1] and not matrix.nullity
        self.sign = int(np.linalg.slogdet(values)[0]) if is_square else 0
        sizes = np.linalg.norm(values, axis=1)
        # Powers of two make scaling exact.
        scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        constant, self._off = np.zeros(whole.shape), np.zeros((whole.shape[0] + matrix.nullity, whole.shape[1]))
        places, entries = [], []
        for k, place in enumerate(zip(*whole.sparsity().get_triplet(), strict=True)):
            entry = whole.nz[k]
            self._off[place] = 0.0 if entry.is_zero() else _CONSTANTS
            if entry.is_constant():
                constant[place] = float(entry)
            else:
                places.append(place)
                entries.append(entry)
        self.entries: SX = ca.vertcat(SX(0, 1), *entries)
        at = np.array(places, dtype=np.int32).reshape(-1, 2)
        self._nullity, self._at, self._constant = matrix.nullity, at, constant * scale[:, None]
        self._scale = np.ascontiguousarray(scale[at[:, 0]])
        self._head = (whole.shape[0] + matrix.nullity, whole.shape[1], len(at), (at, self._scale))

    def examine(self, forms: Forms, f: int, errors: int) -> Tested:
        """Return the results for boxes from forms of the entries; see :class:`~.loop_boxes.Test`."""
        count, terms, (rows, columns, *_) = len(forms.c), forms.a.shape[2], self._head
        if rows < columns:  # singular at every pose
            return not_regular(np.zeros((count, f)), np.zeros(count))
        is_known = np.asarray((np.isfinite(forms.c) & np.isfinite(forms.r)).all(axis=1))
        M0 = self._middles(np.where(is_known[:, None], forms.c, 0.0))
        with np.errstate(all="ignore"):
            C, signs = _left_inverses(M0)
            off = np.abs(C @ M0 - np.eye(columns)) + ROUNDING * np.eye(columns)
            off += np.abs(C) @ (ROUNDING * np.abs(M0) + self._off)
        off[~is_known] = np.inf
        regular, shares = np.empty(count, dtype=np.int32), np.zeros((f, count))
        given = (C, off, forms.a.transpose(1, 2, 0), forms.r.T)
        arrays = (*(np.ascontiguousarray(each) for each in given), regular, shares)
        kernel().rank(self._head, (terms, f, errors), arrays, count)
        # Frobenius norms make it smaller than the singular value, at most by the factor of the number of columns.
        smallest = 1 / (np.linalg.norm(M0, axis=(1, 2)) * np.linalg.norm(C, axis=(1, 2)))
        signs = signs if not self._nullity else np.zeros_like(signs)
        return Tested(regular.astype(bool), shares.T, np.where(is_known, np.nan_to_num(smallest), np.inf), signs)

    def _middles(self, entries: FloatArray) -> FloatArray:
        """Return scaled matrices (B, m, c) from entries (B, E), with a basis of their null spaces as last rows."""
        shape = (len(entries), *self._constant.shape)
        found = np.array(np.broadcast_to(self._constant, shape))
        found[:, self._at[:, 0], self._at[:, 1]] = entries * self._scale
        if not self._nullity:
            return found
        missed = np.linalg.svd(found, full_matrices=True)[2][:, -self._nullity :]
        return np.concatenate([found, missed], axis=1)


def _left_inverses(matrices: FloatArray) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return left inverses (B, c, m) of matrices (B, m, c), and signs (B,) of determinants; 0 if not square.

    The inverses are NaN for matrices without full column rank.
    """
    is_square = matrices.shape[1] == matrices.shape[2]
    Q, R = (None, matrices) if is_square else np.linalg.qr(matrices)
    signs = np.sign(np.linalg.det(R)).astype(np.int32)
    found: FloatArray = np.full(matrices.transpose(0, 2, 1).shape, np.nan)
    good = signs != 0
    inverse = np.linalg.inv(R[good])
    found[good] = inverse if Q is None else inverse @ Q[good].transpose(0, 2, 1)
    return found, signs if is_square else np.zeros_like(signs)


def is_polynomial(entries: SX, coordinates: SX) -> bool:
    """Return whether entries (E, 1) are polynomials in coordinates (n, 1)."""
    function = ca.Function("entries", [coordinates], [entries])
    constant: set[int] = set()  # work registers, which are reused
    for k in range(function.n_instructions()):
        op, to, places = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if op not in _POLYNOMIAL and not (op == ca.OP_DIV and places[1] in constant):
            return False
        if op != ca.OP_OUTPUT:
            (constant.add if op == ca.OP_CONST else constant.discard)(to[0])
    return True


class EntryChange:
    """Largest changes of matrix entries due to joint-centre errors, over boxes of poses.

    Args:
        family: robots within the tolerance, without dependent coordinates.
        entries: (E, 1) polynomials in the coordinates of the family.

    Attributes:
        exact: (E, 1) entries of the nominal robot, in the coordinates of the pose.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """

    def __init__(self, family: Problem, entries: SX) -> None:
        errors, count = family.errors, int(entries.numel())
        at_zero = SX.zeros(errors.numel())
        self.exact: SX = ca.substitute(entries, errors, at_zero)
        self._tolerance = family.tolerance
        first, of_entry, of_error = _slopes(entries, errors)
        # One sum for each pair of entry and centre.
        self._sums, self._of_sum = np.unique(of_entry * len(family.names) + of_error // 3, return_inverse=True)
        self._sums //= len(family.names)
        self._slopes = Encloser(family.problem.z, ca.substitute(first, errors, at_zero))
        second, of_slope, _ = _slopes(first, errors)
        box, free, off = family.box, list(family.free), np.full(errors.numel(), family.tolerance)
        ends = np.append(box.lower[free], -off), np.append(box.upper[free], off)
        (sizes,) = Encloser(family.z, second)(*(each[:, None] for each in ends)).sizes
        self._bend = 0.5 * self._tolerance**2 * np.bincount(of_entry[of_slope], sizes, count)

    def over(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return bounds (E, B) of the changes of the entries over boxes with ends (n, B)."""
        sizes = self._slopes(lower, upper).sizes.T
        squares = np.zeros((len(self._sums), lower.shape[1]))
        np.add.at(squares, self._of_sum, sizes * sizes)
        found = np.repeat(self._bend[:, None], lower.shape[1], axis=1)
        np.add.at(found, self._sums, self._tolerance * np.sqrt(squares))
        return np.asarray(found * _OUTWARDS)


def _slopes(expressions: SX, errors: SX) -> tuple[SX, NDArray[np.int64], NDArray[np.int64]]:
    """Return the nonzero derivatives with respect to joint-centre errors, and the indices of expressions and errors."""
    found = ca.jacobian(expressions, errors)
    rows, columns = (np.array(each, dtype=np.int64) for each in found.sparsity().get_triplet())
    return ca.vertcat(SX(0, 1), *[found.nz[k] for k in range(found.nnz())]), rows, columns
