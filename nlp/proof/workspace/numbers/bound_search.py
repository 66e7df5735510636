"""Smallest value of a function over a box of poses, from bounds of it over boxes: best-first bisection.

The function is given by an :class:`Oracle`: lower bounds over boxes, and values at points. Its value at a point is an
upper bound of the smallest value, improved by random steps from the best point known; what is proved rests on the
bounds alone.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from .....models import FloatArray
from .....models.arrays import first_largest
from ....interruption import one_search, reason_of, reason_to_stop
from ..robot.pose_box import PoseBox

if TYPE_CHECKING:
    from ..proof_record import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 256
#: Random points from which the search of a small value begins, steps from the best of them, and points in each step.
_POINTS, _STEPS, _AROUND = 256, 24, 32
#: Factor of the size of steps from one to the next.
_SHRINK = 0.7
_SEED = 0
#: Part of itself by which a value may be off by rounding: the first of several that are the same is taken.
_TIE = 1e-11


class Bounds(NamedTuple):
    """Lower bounds (B,) over boxes, -inf without one, and the share (B, 6) of each coordinate in their slack."""

    lower: FloatArray
    shares: FloatArray


class Oracle(Protocol):
    """Bounds and values of a function of the pose."""

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""

    def values(self, points: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, 6)."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """The smallest value of a function over the workspace.

    Attributes:
        bound: proven: no pose has a smaller value.
        value: at ``y``.
        y: (6,) the best pose known.
        boxes, open: number of boxes examined, and of boxes left.
        seconds: wall time.
        reason: for stopping before the gap was met; else empty.
    """

    bound: float
    value: float
    y: FloatArray
    boxes: int
    open: int
    seconds: float
    reason: str


def prove_minimum(
    oracle: Oracle,
    box: PoseBox,
    *,
    gap: float,
    limit: float | None = None,
    slack: float = 0.0,
    time_limit: float | None = None,
    recorder: TreeRecord | None = None,
) -> Minimum:
    """Prove the smallest value of a function over a box of poses.

    Args:
        oracle: the function.
        box: the poses.
        gap: allowed distance of the bound from the best value known, in the function's unit.
        limit: the search ends, with a wider gap, once the bound is at least this, and not before, whatever the gap is,
            while no value below it is known.
        slack: how far a value may be below the limit and still count as on it.
        time_limit: seconds after which the search stops with the bound reached.
        recorder: records the boxes for a proof; every leaf has a bound of at least that of the result.
    """
    began = time.perf_counter()
    y, value = _good_point(oracle, box)
    lower, upper = box.lower[None], box.upper[None]
    nothing = Bounds(np.array([-math.inf]), oracle.bounds(lower, upper).shares)
    state = _State(lower, upper, nothing, math.inf, y, value, 0)

    def run() -> str:
        nonlocal state
        while len(state.bounds.lower) and state.least < _target(state.value, gap, limit, slack):
            reason = reason_to_stop(time.perf_counter() - began)
            if reason:
                return reason
            state = _after_step(state, oracle, box, gap, limit, slack, recorder)
        return ""

    with one_search(time_limit):
        reason = reason_of(run)
    count = len(state.bounds.lower)
    least = min(state.least, state.value)
    return Minimum(least, state.value, state.y, state.boxes, count, time.perf_counter() - began, reason)


class _State(NamedTuple):
    """A search after a step: open boxes, the smallest bound of the closed ones, the best pose, and boxes examined."""

    lower: FloatArray
    upper: FloatArray
    bounds: Bounds
    closed: float
    y: FloatArray
    value: float
    boxes: int

    @property
    def least(self) -> float:
        """The smallest bound of all boxes."""
        return min(self.closed, float(self.bounds.lower.min(initial=math.inf)))


def _after_step(
    state: _State,
    oracle: Oracle,
    box: PoseBox,
    gap: float,
    limit: float | None,
    slack: float,
    recorder: TreeRecord | None,
) -> _State:
    """Return the state after the boxes with the smallest bounds were bisected."""
    lower, upper, (bound, shares), closed, y, value, boxes = state
    order = np.argpartition(bound, min(_BLOCK, len(bound)) - 1)
    now, later = order[:_BLOCK], order[_BLOCK:]
    part_lower, part_upper, parents = lower[now], upper[now], bound[now]
    split = first_largest(np.where(part_upper > part_lower, shares[now], -1.0))
    every = np.arange(len(now))
    middle = 0.5 * part_lower[every, split] + 0.5 * part_upper[every, split]
    left, right = part_upper.copy(), part_lower.copy()
    left[every, split] = right[every, split] = middle
    halves = np.concatenate([part_lower, right]), np.concatenate([left, part_upper])
    children = box.contracted(*halves)
    if recorder is not None:
        recorder.cuts(part_lower, part_upper, split)
        recorder.contractions(halves, (children.lower, children.upper), children.outside)
    kept = ~children.outside
    new_lower, new_upper = children.lower[kept], children.upper[kept]
    at = oracle.bounds(new_lower, new_upper)
    found = np.fmax(at.lower, np.concatenate([parents, parents])[kept])
    centres = box.clipped(0.5 * new_lower + 0.5 * new_upper)
    values = oracle.values(centres)
    if len(values) and is_smaller(float(np.nanmin(values)), value):
        best = first_smallest(values)
        y, value = centres[best], float(values[best])
    done = found >= max(value - gap, _target(value, gap, limit, slack))
    return _State(
        np.concatenate([lower[later], new_lower[~done]]),
        np.concatenate([upper[later], new_upper[~done]]),
        Bounds(np.concatenate([bound[later], found[~done]]), np.concatenate([shares[later], at.shares[~done]])),
        min(closed, float(found[done].min(initial=math.inf))),
        y,
        value,
        boxes + len(found),
    )


def is_smaller(value: float, known: float) -> bool:
    """Return whether a value is smaller than a known one by more than rounding."""
    return value < (known - _TIE * abs(known) if math.isfinite(known) else known)


def first_smallest(values: FloatArray) -> int:
    """Return the place of the first of the smallest values (K,), up to rounding; NaN are left out."""
    least = float(np.nanmin(values))
    return int(np.argmax(values <= least + _TIE * abs(least)))


def _target(value: float, gap: float, limit: float | None, slack: float) -> float:
    """Return the bound at which a search ends: that of the gap, or of the limit where no value below it is known."""
    if limit is None or value < limit - slack:
        return value - gap
    return limit if value >= limit else limit - slack


def _good_point(oracle: Oracle, box: PoseBox) -> tuple[FloatArray, float]:
    """Return a point with a small value, and the value."""
    rng = np.random.default_rng(_SEED)
    points = np.concatenate([box.random(_POINTS, rng), _corners(box)])
    values = oracle.values(points)
    best = first_smallest(values)
    y, value, step = points[best], float(values[best]), 0.3
    for _ in range(_STEPS):
        around = box.clipped(y + step * (box.upper - box.lower) * rng.normal(size=(_AROUND, 6)))
        values = oracle.values(around)
        best = first_smallest(values)
        if is_smaller(float(values[best]), value):
            y, value = around[best], float(values[best])
        else:
            step *= _SHRINK
    return y, value


def _corners(box: PoseBox) -> FloatArray:
    """Return the corners (64, 6) of the box, moved into the workspace."""
    sides = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
    return box.clipped(box.lower + sides * (box.upper - box.lower))
