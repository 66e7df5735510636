"""Branch and bound for the optimum of a form: boxes are closed by their bounds, contracted or bisected."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....models import FloatArray
from ..checker.tree import Node, node_bytes
from ..statement.standard_form import StandardForm
from .engine import BLOCK, COLLAPSED, BoxState, Engine, Examination
from .incumbent import Incumbent, LimbPoint
from .search import SMALL, WHOLE, Boxes, BoxResults, Order, Rule, Search
from .tree import TreeRecord, halves_of, keys_of

#: Relative widths below which a box is not bisected. The first is for boxes without a finite bound, where functions
#: are probably undefined at a point; the second for boxes with a finite bound.
LEAST_WIDTHS = 2.0**-16, 2.0**-40


def optimum_search(
    form: StandardForm, incumbent: Incumbent | LimbPoint, jobs: int | None, recorder: TreeRecord | None
) -> Search[OptimumRule]:
    """Return the search of the box of a form: see :class:`OptimumRule`."""
    root = Boxes(form.lower[None], form.upper[None], np.array([np.inf]), np.array([WHOLE]), ())
    rule = OptimumRule(form, incumbent, jobs, recorder)
    return Search(rule, root, whole=form.upper - form.lower, least=LEAST_WIDTHS, order=Order.LARGEST_CHUNK)


class OptimumRule(Rule[tuple[()]]):
    """Rule for the maximum of a form.

    Args:
        form: the form.
        incumbent: best known point, which the search improves.
        jobs: number of threads.
        recorder: recorder of the search tree for a proof; a recorded search uses no tangents to squares.

    Attributes:
        incumbent: best known point.
    """

    block = BLOCK

    def __init__(
        self, form: StandardForm, incumbent: Incumbent | LimbPoint, jobs: int | None, recorder: TreeRecord | None
    ) -> None:
        self.names, self.incumbent = form.names, incumbent
        self._form, self._jobs, self._recorder = form, jobs, recorder
        self._functions, self._turn = len(form.functions), 0

    @cached_property
    def _engine(self) -> Engine:
        """The engine, created in the first step of the search because the set-up for long expressions takes seconds."""
        return Engine(self._form, self._jobs, tangents=self._recorder is None)

    def examine(self, boxes: Boxes[tuple[()]]) -> BoxResults[tuple[()]]:
        """Return bounds of boxes, and improve the incumbent."""
        found = self._engine.examine(boxes.lower.T, boxes.upper.T, self.target)
        self._turn += 1
        self._improve(found)
        bounded = found.verdict == BoxState.BOUNDED
        closed = float(found.bound[bounded].max(initial=-math.inf))
        # The checker has another arithmetic, and needs a margin up to the threshold to prove these boxes.
        if (bounded.any() and self._recorder is not None) or self._is_contracted_by_value(found):
            closed = max(closed, self.target)
        # Most boxes of a block may be closed. Only open boxes are processed here, in one thread.
        rest = np.flatnonzero(found.verdict == BoxState.OPEN)
        lower, upper = found.lower[:, rest].T, found.upper[:, rest].T
        # A box that collapsed to a box that cannot be bisected, such as a corner, must be examined again.
        moved = ((lower != boxes.lower[rest]) | (upper != boxes.upper[rest])).any(axis=1)
        left = Boxes(lower, upper, np.fmin(found.bound[rest], boxes.bound[rest]), found.split[rest].astype(np.intp), ())
        return BoxResults(left, closed, len(boxes.split), moved, reasons=(found, rest))

    def record(self, boxes: Boxes[tuple[()]], found: BoxResults[tuple[()]], split: NDArray[np.intp]) -> None:
        """Record a block of examined boxes for a proof. A contraction closes the part of a box that is cut off."""
        if self._recorder is None:
            return
        (examined, rest), left = found.reasons, found.left
        keys, moved = keys_of(boxes.lower, boxes.upper), keys_of(left.lower, left.upper)
        _, halves = halves_of(left.lower, left.upper, np.maximum(split, 0))
        parts = {k: halves[j] if split[j] >= 0 else (moved[j],) for j, k in enumerate(rest) if split[j] != SMALL}
        for k, key in enumerate(keys):
            if k in parts or examined.verdict[k] != BoxState.OPEN:
                text = _node_of(examined, k, boxes.upper[k], self._functions)
                cut = node_bytes(Node.HALF, int(examined.split[k])) if len(parts.get(k, ())) == 2 else b""
                self._recorder.add(key, text + cut, *parts.get(k, ()))

    def _improve(self, found: Examination) -> None:
        """Improve the incumbent from the best centre of a block, or from the centre of the box with the largest bound.

        The second attempt takes longer, and is made in steps 1, 2, 4, 8 and so on.
        """
        best = int(np.argmax(found.value))
        if found.value[best] > self.incumbent.value:
            self.incumbent.consider(found.centre[:, best])
        if self._turn & (self._turn - 1) == 0:
            self.incumbent.improve_near(found.centre[:, int(np.argmax(np.nan_to_num(found.bound, posinf=-math.inf)))])

    def _is_contracted_by_value(self, found: Examination) -> bool:
        """Return whether a contraction excluded points with values of at most the threshold."""
        # A box that is closed by its bound needs no contraction, except for a proof, whose checker needs the margin.
        count, rest = self._functions, (found.verdict != BoxState.BOUNDED) | (self._recorder is not None)
        return any(
            # One comparison for 0 <= why < count: negative values are large as unsigned integers.
            bool(((why.view(np.uint32) < count) & rest).any())
            for why in (found.cut_lower, found.cut_upper)
        )


def _node_of(found: Examination, k: int, upper: FloatArray, functions: int) -> bytes:
    """Return the bytes of the proof's node for box ``k``, without its bisection and sub-boxes.

    ``upper`` (n,) has the upper ends of the box.
    """
    verdict, reason = int(found.verdict[k]), int(found.reason[k])
    if verdict == BoxState.BOUNDED:
        return bytes([Node.BOUNDED])
    if verdict in (BoxState.INFEASIBLE, BoxState.MONOTONE):
        return node_bytes(Node.INFEASIBLE if verdict == BoxState.INFEASIBLE else Node.MONOTONE, reason)
    only = [reason] if verdict == BoxState.EMPTIED else range(len(upper))
    return b"".join(_contraction(found, k, i, float(upper[i]), functions) for i in only)


def _contraction(found: Examination, k: int, i: int, upper: float, functions: int) -> bytes:
    """Return the bytes of the proof's nodes for the contraction of box ``k`` along variable ``i``."""
    below, above = int(found.cut_lower[i, k]), int(found.cut_upper[i, k])
    low, high = float(found.lower[i, k]), float(found.upper[i, k])
    if COLLAPSED in (below, above):
        return node_bytes(Node.FACE_UPPER if below == COLLAPSED else Node.FACE_LOWER, i)
    text = b""
    if below >= 0:
        text += node_bytes(Node.BELOW, i, value=low) + _reason(below, functions)
    if above >= 0 and not (below >= 0 and low > upper):
        text += node_bytes(Node.ABOVE, i, value=high) + _reason(above, functions)
    return text


def _reason(why: int, functions: int) -> bytes:
    """Return the bytes that state why a part of a box is cut off, from the index of the expression that excludes it."""
    return bytes([Node.BOUNDED]) if why < functions else node_bytes(Node.INFEASIBLE, why)
