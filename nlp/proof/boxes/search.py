"""Search of a box by bisection: the boxes of one form, examined in blocks, closed, contracted or bisected."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ....models import FloatArray
from ..statement.standard_form import StandardForm
from .engines import Engine
from .examination import Examination, Verdict
from .incumbent import PointKeeper
from .open_boxes import BoundedSearch, Boxes
from .proof_writer import ProofWriter

#: Width, in parts of the whole box, below which a box without a finite bound is taken to hold a point without a value.
_SINGULAR_WIDTH = 2.0**-16
#: Width, in parts of the whole box, below which a box is not bisected.
_LEAST_WIDTH = 2.0**-40


class BoxSearch(BoundedSearch[Boxes]):
    """A search of the box of one form.

    Args:
        form: the form.
        engine: returns the engine that examines boxes. It takes seconds for long expressions, and so is built by the
            first step, which can be stopped.
        incumbent: the best point known, which the search improves.
        recorder: records the search's tree for a proof.

    Attributes:
        form: the form.
        incumbent: the best point known.
        boxes: number of boxes examined.
    """

    def __init__(
        self,
        form: StandardForm,
        engine: Callable[[], Engine],
        incumbent: PointKeeper,
        recorder: ProofWriter | None = None,
    ) -> None:
        self.form, self.incumbent = form, incumbent
        self._build, self._recorder = engine, recorder
        self._engine: Engine | None = None
        self._nodes = 1
        root = np.zeros(1, dtype=np.int64)
        super().__init__(Boxes(form.lower[:, None], form.upper[:, None], np.array([np.inf]), root))

    def close(self) -> None:
        """Stop the engine."""
        if self._engine is not None:
            self._engine.close()

    def _step(self, threshold: float) -> None:
        """Examine a block of boxes, and close those whose bounds do not exceed a threshold."""
        engine = self._engine = self._engine or self._build()
        boxes = self._opened.pop(engine.block if self._turn else 1)
        self._turn += 1
        found = engine.examine(boxes.lower, boxes.upper, threshold)
        self._improve(found)
        self._branch(boxes, found, threshold)

    @property
    def fault(self) -> str:
        """Reason for stopping at boxes without a finite bound, with the place of the first; empty without any."""
        undefined = [boxes for boxes in self._undivided if not np.isfinite(boxes.bound).all()]
        if undefined:
            return reason_without_bound(self.form, undefined[0].lower, undefined[0].upper, undefined[0].bound)
        return ""

    def _improve(self, found: Examination) -> None:
        """Improve the incumbent from the best centre of a block, or from the centre of the box with the largest bound.

        The latter costs more, and is tried at turns 1, 2, 4, 8 and so on.
        """
        best = int(np.argmax(found.value))
        if found.value[best] > self.incumbent.value:
            self.incumbent.consider(found.centre[:, best])
        if self._turn & (self._turn - 1) == 0:
            self.incumbent.improve_near(found.centre[:, int(np.argmax(np.nan_to_num(found.bound, posinf=-math.inf)))])

    def _branch(self, boxes: Boxes, found: Examination, threshold: float) -> None:
        """Bisect the open boxes, and account for the others."""
        closed = found.verdict == Verdict.BOUNDED
        if closed.any():
            self._closed_bound = max(self._closed_bound, float(found.bound[closed].max()))
            if self._recorder is not None:
                # A checker with other arithmetic needs the room up to the threshold to show these boxes again.
                self._closed_bound = max(self._closed_bound, threshold)
        if self._closed_bound < threshold and self._is_contracted_by_value(found):
            self._closed_bound = threshold
        self.boxes += boxes.count
        # Most boxes of a block may be closed: only the open ones are looked at here, since this is no work for threads.
        rest = np.flatnonzero(found.verdict == Verdict.OPEN)
        lower, upper, split = found.lower[:, rest], found.upper[:, rest], found.split[rest]
        bound = np.fmin(found.bound[rest], boxes.bound[rest])
        every = np.arange(rest.size)
        low, high = lower[split, every], upper[split, every]
        middle = 0.5 * low + 0.5 * high
        whole = (self.form.upper - self.form.lower)[:, None]
        width = ((upper - lower) / whole).max(axis=0)
        least = np.where(np.isfinite(bound), _LEAST_WIDTH, _SINGULAR_WIDTH)
        small = (width < least) | ~((low < middle) & (middle < high))
        # A box that collapsed to one that cannot be bisected, such as a corner, has not been examined as that box yet.
        at = np.flatnonzero(small)
        moved = ((lower[:, at] != boxes.lower[:, rest[at]]) | (upper[:, at] != boxes.upper[:, rest[at]])).any(axis=0)
        once, done, cut = at[moved], at[~moved], np.flatnonzero(~small)
        first_child = self._nodes + 2 * np.arange(cut.size)
        first_once = self._nodes + 2 * cut.size + np.arange(once.size)
        self._nodes += 2 * cut.size + once.size
        if self._recorder is not None:
            children = np.full(boxes.count, -1, dtype=np.int64)
            children[rest[cut]], children[rest[once]] = first_child, first_once
            middles = np.full(boxes.count, np.nan)
            middles[rest[cut]] = middle[cut]
            self._recorder.record(boxes, found, middles, children)
        if done.size:
            self._undivided.append(Boxes(lower[:, done], upper[:, done], bound[done], boxes.place[rest[done]]))
        if once.size:
            self._opened.push(Boxes(lower[:, once], upper[:, once], bound[once], first_once))
        if at.size:
            lower, upper, bound = lower[:, cut], upper[:, cut], bound[cut]
            split, middle = split[cut], middle[cut]
        halves = np.concatenate([lower, lower], axis=1), np.concatenate([upper, upper], axis=1)
        columns = np.arange(cut.size)
        halves[1][split, columns] = halves[0][split, cut.size + columns] = middle
        self._opened.push(
            Boxes(*halves, np.concatenate([bound, bound]), np.concatenate([first_child, first_child + 1]))
        )

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


def reason_without_bound(form: StandardForm, lower: FloatArray, upper: FloatArray, bound: FloatArray) -> str:
    """Return the reason for stopping at boxes, ends (n, B), of which one has no finite bound (B,)."""
    which = int(np.argmin(np.isfinite(bound)))
    point = 0.5 * (lower[:, which] + upper[:, which])
    at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(form.names, point, strict=True))
    return f"the expressions have no finite bound near {at}, as where a limb has zero length"
