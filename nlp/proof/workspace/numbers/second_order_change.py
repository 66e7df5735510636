"""Bounds of the second-order change of quantities due to joint-centre errors, over a whole workspace.

For a quantity g with second derivatives H with respect to the errors e, evaluated at some errors between 0 and e,

    |g(e) - g(0) - g'(0) e| <= 1/2 sum_jk |H_jk| |e_j| |e_k|,

where H_jk is the block (3, 3) of centres j and k, and |H_jk| its Frobenius norm. The blocks are bounded over boxes of
poses and all errors within the tolerance; the boxes with the largest bounds are bisected. Groups of centres without
common blocks, such as different limbs in F, are bounded separately.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.arrays import first_largest
from ...boxes.search import WHOLE, Boxes, BoxResults, Order, Rule, Search, some
from ...enclosure.forms import Encloser
from ..ranks.loop_boxes import LoopBoxes, contracted_boxes, whole_workspace
from ..robot.posed_robot import Problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of boxes examined at once, and largest number of boxes.
_BLOCK, _MOST = 128, 4096
#: The search ends if the bound is at most this fraction of the first-order change, or this multiple of a known value.
_SHARE, _NEAR = 0.02, 1.2
#: Outward factor of a bound, for rounding and for the check of a proof.
_OUTWARDS = 1.02


def second_order_change(family: Problem, expression: SX, first: float) -> float:
    """Return a bound of the change of an expression beyond first order; infinite without a bound.

    Args:
        family: robots within the tolerance, without dependent coordinates.
        expression: (1, 1) smooth expression of the coordinates of the family.
        first: size of the first-order change at some pose; a much smaller bound is sufficient.

    Raises:
        UncoveredError: the expression has an operation without an interval rule.
    """
    H = ca.hessian(expression, family.errors)[0]
    groups = _groups(H, len(family.names))
    return sum((_change(_ChangeRule(family, H, each), _SHARE * first / len(groups)) for each in groups), 0.0)


def _groups(H: SX, count: int) -> list[list[int]]:
    """Return groups of joint centres that share no block of the second derivatives H (3 m, 3 m)."""
    rows, columns = (np.array(each, dtype=int) // 3 for each in H.sparsity().get_triplet())
    group = np.arange(count)
    for i, j in set(zip(rows.tolist(), columns.tolist(), strict=True)):
        group[group == group[i]] = group[j]
    own = {int(group[i]) for i in rows}
    return [np.flatnonzero(group == each).tolist() for each in sorted(own)]


def _change(rule: _ChangeRule, enough: float) -> float:
    """Search all boxes of a rule; return a bound of its change. A bound of at most ``enough`` ends the search."""
    lower, upper = rule.whole.lower, rule.whole.upper
    root = Boxes(lower, upper, np.array([math.inf]), np.array([WHOLE]), np.zeros(1))
    search = Search(rule, root, whole=(upper - lower)[0], least=(0.0, 0.0), order=Order.LARGEST)
    while search.is_open and search.boxes < _MOST:
        worst = search.state.waiting[-1][2]
        k = int(np.argmax(worst.bound))
        if worst.bound[k] <= max(enough, _NEAR * worst.more[k]):
            break
        search.step(-math.inf)
    return max(search.bound, 0.0)


class _ChangeRule(Rule[FloatArray]):
    """Rule of branch and bound for the change due to errors of some joint centres.

    Boxes store the change at their centres.

    Args:
        family: robots within the tolerance.
        H: (3 m, 3 m) second derivatives with respect to all errors.
        centres: indices of the k centres; the second derivatives of these depend on no other errors.

    Attributes:
        whole: the workspace.
    """

    block = _BLOCK

    def __init__(self, family: Problem, H: SX, centres: list[int]) -> None:
        self._problem, self._tolerance, self.whole = family.problem, family.tolerance, whole_workspace(family.problem)
        places = [3 * j + k for j in centres for k in range(3)]
        lower, self._count = ca.tril(H[places, places]), len(centres)
        self._encloser = Encloser(
            ca.vertcat(self._problem.z, family.errors[places]), ca.vertcat(*[lower.nz[k] for k in range(lower.nnz())])
        )
        rows, columns = (np.array(each, dtype=int) for each in lower.sparsity().get_triplet())
        self._block: NDArray[np.int64] = rows // 3 * self._count + columns // 3
        # Symmetric blocks on the diagonal: an entry below the diagonal counts twice.
        self._times = np.where((rows != columns) & (rows // 3 == columns // 3), 2.0, 1.0)

    def examine(self, boxes: Boxes[FloatArray]) -> BoxResults[FloatArray]:
        """Bound the change over boxes."""
        known = np.ones(len(boxes.split), dtype=bool)
        now, kept = contracted_boxes(self._problem, LoopBoxes(boxes.lower, boxes.upper, boxes.lower, known))
        now = some(now, kept)
        errors = np.full((len(now.lower), 3 * self._count), self._tolerance)
        forms = self._encloser(np.hstack([now.lower, -errors]).T, np.hstack([now.upper, errors]).T)
        with np.errstate(all="ignore"):
            found = self._changes(forms.sizes)
        width = (self.whole.upper - self.whole.lower)[0]
        split = first_largest((now.upper - now.lower) / np.where(width > 0, width, np.inf))
        bound, middles = np.where(np.isfinite(found), found, np.inf), np.nan_to_num(self._changes(np.abs(forms.c)))
        return BoxResults(Boxes(now.lower, now.upper, bound, split, middles), -math.inf, len(split))

    def _changes(self, sizes: FloatArray) -> FloatArray:
        """Return the changes (B,) from absolute values (B, R) of the entries: sums of the norms of all blocks."""
        total = np.zeros((len(sizes), self._count**2))
        for k, block in enumerate(self._block):
            total[:, block] += self._times[k] * sizes[:, k] ** 2
        norms = np.sqrt(total).reshape(-1, self._count, self._count)
        # Blocks above the diagonal equal blocks below it.
        norm = 2 * norms.sum(axis=(1, 2)) - np.trace(norms, axis1=1, axis2=2)
        return np.asarray(0.5 * self._tolerance**2 * _OUTWARDS * norm)
