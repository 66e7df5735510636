"""Search of a box by bisection: the boxes of one form, examined in blocks, closed, contracted or bisected."""

from __future__ import annotations

import math

import numpy as np

from ....models import FloatArray
from ..incumbent import PointKeeper
from ..standardform import StandardForm
from .engines import Engine
from .examination import Examination, Verdict
from .openboxes import BoundedSearch, Boxes
from .proofwriter import ProofWriter

#: Width, in parts of the whole box, below which a box without a finite bound is taken to hold a point without a value.
_SINGULAR_WIDTH = 2.0**-16
#: Width, in parts of the whole box, below which a box is not bisected.
_LEAST_WIDTH = 2.0**-40


class BoxSearch(BoundedSearch[Boxes]):
    """A search of the box of one form.

    Args:
        form: the form.
        engine: examines boxes.
        incumbent: the best point known, which the search improves.
        recorder: records the search's tree for a proof.

    Attributes:
        form: the form.
        incumbent: the best point known.
        boxes: number of boxes examined.
    """

    def __init__(
        self, form: StandardForm, engine: Engine, incumbent: PointKeeper, recorder: ProofWriter | None = None
    ) -> None:
        self.form, self.incumbent = form, incumbent
        self._engine, self._recorder = engine, recorder
        self._nodes = 1
        root = np.zeros(1, dtype=np.int64)
        super().__init__(Boxes(form.lower[:, None], form.upper[:, None], np.array([np.inf]), root))

    def close(self) -> None:
        """Stop the engine."""
        self._engine.close()

    def step(self, threshold: float) -> None:
        """Examine a block of boxes, and close those whose bounds do not exceed a threshold."""
        self._current = self._opened.pop(self._engine.block if self._turn else 1)
        self._turn += 1
        found = self._engine.examine(self._current.lower, self._current.upper, threshold)
        self._improve(found)
        self._branch(self._current, found, threshold)
        self._current = None

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
        if self._is_contracted_by_value(found):
            self._closed_bound = max(self._closed_bound, threshold)
        self.boxes += boxes.count
        bound = np.fmin(found.bound, boxes.bound)
        lower, upper, split = found.lower, found.upper, found.split
        every = np.arange(boxes.count)
        low, high = lower[split, every], upper[split, every]
        middle = 0.5 * low + 0.5 * high
        whole = (self.form.upper - self.form.lower)[:, None]
        width = ((upper - lower) / whole).max(axis=0)
        least = np.where(np.isfinite(bound), _LEAST_WIDTH, _SINGULAR_WIDTH)
        is_open = found.verdict == Verdict.OPEN
        small = is_open & ((width < least) | ~((low < middle) & (middle < high)))
        # A box that collapsed to one that cannot be bisected, such as a corner, has not been examined as that box yet.
        again = small & ((lower != boxes.lower) | (upper != boxes.upper)).any(axis=0)
        once, done, cut = (np.flatnonzero(which) for which in (again, small & ~again, is_open & ~small))
        first_child = np.full(boxes.count, -1, dtype=np.int64)
        first_child[cut] = self._nodes + 2 * np.arange(cut.size)
        first_child[once] = self._nodes + 2 * cut.size + np.arange(once.size)
        self._nodes += 2 * cut.size + once.size
        if self._recorder is not None:
            is_cut = is_open & ~small
            self._recorder.record(boxes, found, np.where(is_cut, middle, np.nan), first_child)
        if done.size:
            self._undivided.append(Boxes(lower[:, done], upper[:, done], bound[done], boxes.place[done]))
        self._opened.push(Boxes(lower[:, once], upper[:, once], bound[once], first_child[once]))
        left, right = upper[:, cut].copy(), lower[:, cut].copy()
        columns = np.arange(cut.size)
        left[split[cut], columns] = right[split[cut], columns] = middle[cut]
        self._opened.push(
            Boxes(
                np.concatenate([lower[:, cut], right], axis=1),
                np.concatenate([left, upper[:, cut]], axis=1),
                np.concatenate([bound[cut], bound[cut]]),
                np.concatenate([first_child[cut], first_child[cut] + 1]),
            )
        )

    def _is_contracted_by_value(self, found: Examination) -> bool:
        """Return whether a contraction excluded points because of their value, which is at most the threshold."""
        # A box that is closed by its bound needs no contraction. The bound of a proof keeps the distance from what its
        # checker must show.
        count, rest = len(self.form.functions), (found.verdict != Verdict.BOUNDED) | (self._recorder is not None)
        return any(bool(((why >= 0) & (why < count) & rest).any()) for why in (found.cut_lower, found.cut_upper))


def reason_without_bound(form: StandardForm, lower: FloatArray, upper: FloatArray, bound: FloatArray) -> str:
    """Return the reason for stopping at boxes, ends (n, B), of which one has no finite bound (B,)."""
    which = int(np.argmin(np.isfinite(bound)))
    point = 0.5 * (lower[:, which] + upper[:, which])
    at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(form.names, point, strict=True))
    return f"the expressions have no finite bound near {at}, as where a limb has zero length"
