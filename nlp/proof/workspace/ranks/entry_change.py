"""Change of the entries of a matrix by errors of joint centres, entry by entry.

With g_j the derivative of an entry by the error of centre j, and H its second derivatives by all errors, the entry of a
machine within the tolerance t differs from that of the design by at most ``t sum_j |g_j| + t^2 / 2 sum |H|``. The
derivatives of first order are bounded over each box, those of second order once over the whole workspace and all errors
within the tolerance. Entries are polynomials, such as those of the rows of straight legs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser, Forms
from ..robot.tolerance_model import ToleranceModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part of itself by which a bound moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12


#: Operations of polynomials.
_POLYNOMIAL = (
    *(ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_PARAMETER, ca.OP_ASSIGN),
    *(ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE),
)


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
        family: the machines; none of their coordinates follows from others.
        entries: (E, 1) polynomials in their coordinates.

    Attributes:
        exact: (E, 1) the entries of the design, in the coordinates of the pose alone.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, family: ToleranceModel, entries: SX) -> None:
        problem, errors, t = family.problem, family.errors, family.tolerance
        self.exact: SX = _at_zero(entries, errors)
        self._tolerance, self._count = t, int(entries.numel())
        first, of_entry, of_error = _slopes(entries, errors)
        # One sum for each entry and centre.
        self._sums, self._of_sum = np.unique(of_entry * len(family.names) + of_error // 3, return_inverse=True)
        self._sums //= len(family.names)
        self._slopes = Encloser(problem.z, _at_zero(first, errors))
        second, of_slope, _ = _slopes(first, errors)
        box, free = problem.box, list(problem.free)
        lower, upper = (
            np.append(end[free], np.full(errors.numel(), size)) for end, size in ((box.lower, -t), (box.upper, t))
        )
        sizes = _sizes(Encloser(family.coordinates, second)(lower[:, None], upper[:, None]))
        self._bend = 0.5 * t * t * np.bincount(of_entry[of_slope], sizes[0], self._count)

    def over(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return bounds (E, B) over boxes with ends (n, B)."""
        sizes = _sizes(self._slopes(lower, upper)).T
        squares = np.zeros((len(self._sums), lower.shape[1]))
        np.add.at(squares, self._of_sum, sizes * sizes)
        found = np.repeat(self._bend[:, None], lower.shape[1], axis=1)
        np.add.at(found, self._sums, self._tolerance * np.sqrt(squares))
        return np.ascontiguousarray(found * _OUTWARDS)


class _Slopes(NamedTuple):
    """Derivatives (N, 1) by errors that are not 0, with the indices of the expression and of the error of each."""

    values: SX
    of: NDArray[np.int64]
    by: NDArray[np.int64]


def _slopes(expressions: SX, errors: SX) -> _Slopes:
    """Return the derivatives of expressions by errors."""
    found = ca.jacobian(expressions, errors)
    rows, columns = (np.array(each, dtype=np.int64) for each in found.sparsity().get_triplet())
    return _Slopes(ca.vertcat(SX(0, 1), *[found.nz[k] for k in range(found.nnz())]), rows, columns)


def _at_zero(expressions: SX, errors: SX) -> SX:
    """Return expressions of the design."""
    return ca.substitute(expressions, errors, SX.zeros(errors.numel()))


def _sizes(forms: Forms) -> FloatArray:
    """Return bounds (B, R) of the sizes of expressions."""
    return np.asarray(np.abs(forms.c) + np.abs(forms.a).sum(axis=2) + forms.r)
