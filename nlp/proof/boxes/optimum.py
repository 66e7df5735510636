"""Rule of the optimum of a form: boxes are closed by their bounds, contracted or bisected."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....models import FloatArray
from ..checker.tree import Node, node_bytes
from ..statement.standard_form import StandardForm
from .engine import COLLAPSED, Engine, Examination, Verdict
from .incumbent import PointKeeper
from .search import SMALL, WHOLE, Boxes, Order, Rule, Search, Verdicts
from .tree import TreeRecord, halves_of, keys_of

#: Widths, in parts of the whole box, below which a box is not bisected: one without a finite bound, which is taken to
#: hold a point without a value, and others.
LEAST_WIDTHS = 2.0**-16, 2.0**-40


def optimum_search(
    form: StandardForm, engine: Callable[[], Engine], incumbent: PointKeeper, recorder: TreeRecord | None = None
) -> Search[OptimumRule]:
    """Return the search of the box of a form: see :class:`OptimumRule`."""
    root = Boxes(form.lower[None], form.upper[None], np.array([np.inf]), np.array([WHOLE]), ())
    return Search(
        OptimumRule(form, engine, incumbent, recorder),
        root,
        whole=form.upper - form.lower,
        least=LEAST_WIDTHS,
        order=Order.LARGEST_CHUNK,
    )


class OptimumRule(Rule[tuple[()]]):
    """Rule of the maximum of a form.

    Args:
        form: the form.
        engine: returns the engine that examines boxes. It takes seconds for long expressions, and so is built by the
            first step, which can be stopped.
        incumbent: the best point known, which the search improves.
        recorder: records the search's tree for a proof.

    Attributes:
        incumbent: the best point known.
    """

    def __init__(
        self,
        form: StandardForm,
        engine: Callable[[], Engine],
        incumbent: PointKeeper,
        recorder: TreeRecord | None = None,
    ) -> None:
        self.form, self.incumbent = form, incumbent
        self._build, self._recorder = engine, recorder
        self._engine: Engine | None = None
        self.block = 1
        self._turn, self._closed = 0, -math.inf

    def close(self) -> None:
        """Stop the engine."""
        if self._engine is not None:
            self._engine.close()

    def fault(self, small: Sequence[Boxes[tuple[()]]]) -> str:
        """Return the reason for stopping at boxes without a finite bound, with the place of the first; else empty."""
        return reason_without_bound(self.form, small)

    def examine(self, boxes: Boxes[tuple[()]]) -> Verdicts[tuple[()]]:
        """Return bounds of boxes, and improve the incumbent."""
        ends = np.ascontiguousarray(boxes.lower.T), np.ascontiguousarray(boxes.upper.T)
        engine = self._engine = self._engine or self._build()
        self.block = engine.block
        found = engine.examine(*ends, self.target)
        self._turn += 1
        self._improve(found)
        closed = found.verdict == Verdict.BOUNDED
        if closed.any():
            self._closed = max(self._closed, float(found.bound[closed].max()))
            if self._recorder is not None:
                # A checker with other arithmetic needs the room up to the threshold to show these boxes again.
                self._closed = max(self._closed, self.target)
        if self._closed < self.target and self._is_contracted_by_value(found):
            self._closed = self.target
        # Most boxes of a block may be closed: only the open ones are looked at here, since this is no work for threads.
        rest = np.flatnonzero(found.verdict == Verdict.OPEN)
        lower, upper = found.lower[:, rest].T, found.upper[:, rest].T
        # A box that collapsed to one that cannot be bisected, such as a corner, has not been examined as that box yet.
        moved = ((lower != boxes.lower[rest]) | (upper != boxes.upper[rest])).any(axis=1)
        left = Boxes(lower, upper, np.fmin(found.bound[rest], boxes.bound[rest]), found.split[rest].astype(np.intp), ())
        return Verdicts(left, self._closed, len(boxes.split), moved, reasons=(found, rest))

    def record(self, boxes: Boxes[tuple[()]], found: Verdicts[tuple[()]], split: NDArray[np.intp]) -> None:
        """Record a block of boxes; a contraction closes the part cut off."""
        if self._recorder is None:
            return
        (examined, rest), left = found.reasons, found.left
        keys, moved = keys_of(boxes.lower, boxes.upper), keys_of(left.lower, left.upper)
        _, halves = halves_of(left.lower, left.upper, np.maximum(split, 0))
        parts = {k: halves[j] if split[j] >= 0 else (moved[j],) for j, k in enumerate(rest) if split[j] != SMALL}
        for k, key in enumerate(keys):
            if k in parts or examined.verdict[k] != Verdict.OPEN:
                text = _node_of(examined, k, boxes.upper[k], len(self.form.functions))
                cut = node_bytes(Node.HALF, int(examined.split[k])) if len(parts.get(k, ())) == 2 else b""
                self._recorder.add(key, text + cut, *parts.get(k, ()))

    def _improve(self, found: Examination) -> None:
        """Improve the incumbent from the best centre of a block, or from the centre of the box with the largest bound.

        The latter costs more, and is tried at turns 1, 2, 4, 8 and so on.
        """
        best = int(np.argmax(found.value))
        if found.value[best] > self.incumbent.value:
            self.incumbent.consider(found.centre[:, best])
        if self._turn & (self._turn - 1) == 0:
            self.incumbent.improve_near(found.centre[:, int(np.argmax(np.nan_to_num(found.bound, posinf=-math.inf)))])

    def _is_contracted_by_value(self, found: Examination) -> bool:
        """Return whether a contraction excluded points because of their value, which is at most the threshold."""
        # A box that is closed by its bound needs no contraction. The bound of a proof keeps the distance from what its
        # checker must show.
        count, rest = len(self.form.functions), (found.verdict != Verdict.BOUNDED) | (self._recorder is not None)
        return any(
            # Numbers from 0 to count - 1, in one comparison: negative ones are large without a sign.
            bool(((why.view(np.uint32) < count) & rest).any())
            for why in (found.cut_lower, found.cut_upper)
        )


def reason_without_bound(form: StandardForm, small: Sequence[Boxes[Any]]) -> str:
    """Return the reason for stopping at boxes of which one has no finite bound; empty where all have one."""
    for boxes in small:
        which = int(np.argmin(np.isfinite(boxes.bound)))
        if not np.isfinite(boxes.bound[which]):
            point = 0.5 * (boxes.lower[which] + boxes.upper[which])
            at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(form.names, point, strict=True))
            return f"the expressions have no finite bound near {at}, as where a limb has zero length"
    return ""


def _node_of(found: Examination, k: int, upper: FloatArray, functions: int) -> bytes:
    """Return the bytes of box number ``k``, with upper ends (n,), up to those of a bisection or of its parts."""
    verdict, reason = int(found.verdict[k]), int(found.reason[k])
    if verdict == Verdict.BOUNDED:
        return bytes([Node.BOUNDED])
    if verdict in (Verdict.INFEASIBLE, Verdict.MONOTONE):
        return node_bytes(Node.INFEASIBLE if verdict == Verdict.INFEASIBLE else Node.MONOTONE, reason)
    only = [reason] if verdict == Verdict.EMPTIED else range(len(upper))
    return b"".join(_contraction(found, k, i, float(upper[i]), functions) for i in only)


def _contraction(found: Examination, k: int, i: int, upper: float, functions: int) -> bytes:
    """Return the nodes of the contraction of box number ``k`` along variable ``i``."""
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
    """Return the reason for cutting a part off, from the number of the expression that excludes it."""
    return bytes([Node.BOUNDED]) if why < functions else node_bytes(Node.INFEASIBLE, why)
