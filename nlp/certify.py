"""A proven bound of the global optimum, by branch and bound over the whole box.

Boxes are examined in blocks, those with the largest bounds first, by :mod:`screwsynth.nlp.bounding` or by the C kernel
that does the same. A box is closed when its bound does not exceed the best value known by more than the gap, when a
condition cannot hold in it, or when no maximum can lie in it; otherwise it is cut in two. What is left when the search
is stopped still gives a bound, which is as sure as that at the end.

Nothing here trusts a solver: an incumbent is only a point at which the program's own functions are evaluated.
"""

from __future__ import annotations

import heapq
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.bounding import Examined, NumpyEngine, Verdict
from screwsynth.nlp.kkt import FEASIBLE, assembled, correct, linearise
from screwsynth.nlp.program import Nlp
from screwsynth.nlp.standardform import StandardForm, standard_form


@dataclass
class _Open:
    """Boxes that wait, in chunks, those with the largest bound first."""

    heap: list[tuple[float, int, FloatArray, FloatArray, FloatArray]] = field(default_factory=list)
    count: int = 0
    size: int = 0

    def push(self, lower: FloatArray, upper: FloatArray, bound: FloatArray) -> None:
        if bound.size:
            self.count -= 1
            self.size += bound.size
            heapq.heappush(self.heap, (-float(bound.max()), self.count, lower, upper, bound))

    def pop(self, most: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        taken, total = [], 0
        while self.heap and total < most:
            _, _, lower, upper, bound = heapq.heappop(self.heap)
            self.size -= bound.size
            room = most - total
            if bound.size > room:
                order = np.argsort(-bound, kind="stable")
                rest = order[room:]
                self.push(lower[:, rest], upper[:, rest], bound[rest])
                lower, upper, bound = lower[:, order[:room]], upper[:, order[:room]], bound[order[:room]]
            taken.append((lower, upper, bound))
            total += bound.size
        return (
            np.concatenate([each[0] for each in taken], axis=1),
            np.concatenate([each[1] for each in taken], axis=1),
            np.concatenate([each[2] for each in taken]),
        )

    @property
    def bound(self) -> float:
        return -self.heap[0][0] if self.heap else -np.inf


def run(form: StandardForm, engine, incumbent: float, gap: float, limit: int = 10**7):
    opened = _Open()
    opened.push(form.lower[:, None].copy(), form.upper[:, None].copy(), np.array([np.inf]))
    boxes = 0
    t0 = time.process_time()
    while opened.size:
        lower, upper, before = opened.pop(engine.block)
        boxes += before.size
        found = engine.examine(lower, upper, incumbent + gap)
        if found.value.max() > incumbent:
            incumbent = found.value.max()
        keep = np.flatnonzero(found.verdict == Verdict.OPEN)
        lo, hi, bound, var = found.lower[:, keep], found.upper[:, keep], np.fmin(found.bound, before)[keep], found.split[keep]
        if keep.size:
            at = 0.5 * (lo[var, np.arange(keep.size)] + hi[var, np.arange(keep.size)])
            left, right = hi.copy(), lo.copy()
            left[var, np.arange(keep.size)] = at
            right[var, np.arange(keep.size)] = at
            opened.push(np.concatenate([lo, right], axis=1), np.concatenate([left, hi], axis=1), np.concatenate([bound, bound]))
        if boxes > limit: break
    return boxes, opened.size, incumbent, max(opened.bound, incumbent+gap), time.process_time() - t0
