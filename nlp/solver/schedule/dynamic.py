"""Dynamic programming over a grid of one setting: the best schedule among grid values, from any start.

    V_(i+1)(m) = f_(i+1)(m) + max { V_i(m') : |m' - m| <= w_i }

with ``min`` in place of ``+`` for the worst point. Only this search sees all ridges of F over path and setting: local
searches stop at the ridge where they begin.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....models import FloatArray
from .problem import ScheduleProblem, ends

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest number of points of the dynamic programme; between them, settings are linear.
_STAGES = 200
#: Number of grid values of a setting, and the largest number.
_GRID, _FINEST = 401, 3201
#: Number of grid steps that the rate allows between two points, at least: a coarser grid would freeze the setting.
_STEPS = 4
#: Largest number of combinations of several constant settings, of points at which they are compared, and distance of
#: two kept ones as a part of the ranges.
_COMBINED, _SAMPLED, _APART = 1600, 50, 0.2
#: Values of points that violate a limit.
_OUT = -math.inf


class Grid(NamedTuple):
    """Values of one setting at points of a path.

    Attributes:
        stages: (S,) indices of the points.
        values: (M,) values of the setting.
        objective: (S, M) value of each point; minus infinity where a limit is violated.
        reach: (S - 1,) number of grid steps that the rate allows between points.
        weights: (S,) weights of the points.
    """

    stages: NDArray[np.intp]
    values: FloatArray
    objective: FloatArray
    reach: NDArray[np.intp]
    weights: FloatArray


def grid_of(problem: ScheduleProblem, d: FloatArray, held: FloatArray, k: int, fine: bool = True) -> Grid:
    """Return the values of one setting at points of a path.

    Args:
        problem: the problem.
        d: (n,) design.
        held: (N, settings) schedule, of which the other settings are kept.
        k: index of the setting.
        fine: If false, a coarser grid of fewer points, for the comparison of designs.
    """
    count, setting = len(problem.points), problem.settings[k]
    stages, size = _stages(problem, k, _STAGES if fine else _STAGES // 2)
    # Half of the values leave at least two steps of the grid within the rate: fewer may freeze the setting.
    size = size if fine else max(_GRID // 2, size // 2)
    values = np.linspace(setting.lower, setting.upper, size)
    s = np.repeat(held[stages][:, None, :], size, axis=1)
    s[:, :, k] = values
    which = np.repeat(stages, size)
    found = problem.at(d, s.reshape(len(which), -1), which.tolist())
    objective = problem.combined(found.objective).reshape(len(stages), size)
    objective = np.where(_allowed(found.excess.reshape(len(stages), size, -1)), objective, _OUT)
    steps = np.array([problem.steps[a:b, k].sum() for a, b in pairwise(stages.tolist())])
    h = values[1] - values[0]
    reach = np.minimum(np.floor(steps / h), size).astype(int)
    weights = _stage_weights(problem.points.weights, stages, count)
    return Grid(stages, values, np.where(np.isfinite(objective), objective, _OUT), reach, weights)


def _stages(problem: ScheduleProblem, k: int, most: int) -> tuple[NDArray[np.intp], int]:
    """Return the points (S,) of the dynamic programme, and the number of grid values that its rate needs."""
    count, setting = len(problem.points), problem.settings[k]
    span = setting.upper - setting.lower
    stride = max(math.ceil((count - 1) / (most - 1)), 1)
    while True:
        stages = np.unique(np.append(np.arange(0, count, stride), count - 1))
        steps = np.array([problem.steps[a:b, k].sum() for a, b in pairwise(stages.tolist())])
        typical = float(np.median(steps))
        size = _GRID if typical >= span else math.ceil(_STEPS * span / typical) + 1
        if size <= _FINEST or len(stages) == 2:
            return stages, min(max(size, _GRID), _FINEST)
        stride *= 2


def _stage_weights(weights: FloatArray, stages: NDArray[np.intp], count: int) -> FloatArray:
    """Return the sums (S,) of the weights of the points nearest to each stage."""
    nearest = np.searchsorted(0.5 * (stages[1:] + stages[:-1]), np.arange(count))
    return np.asarray(np.bincount(nearest, weights=weights, minlength=len(stages)), dtype=np.float64)


def _allowed(excess: FloatArray) -> FloatArray:
    """Return whether grid values (S, M) keep the limits, up to half of the change to a neighbour.

    A design at the edge of feasibility may have allowed values only between those of the grid.
    """
    if not excess.shape[2]:
        return np.ones(excess.shape[:2], dtype=bool)
    change = np.abs(np.diff(excess, axis=1))
    slack = np.zeros_like(excess)
    slack[:, 1:], slack[:, :-1] = change, np.maximum(slack[:, :-1], change)
    return np.asarray((excess <= 0.5 * slack).all(axis=2))


def best_path(grid: Grid, *, is_worst: bool, first: int | None = None, last: int | None = None) -> FloatArray | None:
    """Return the grid values (S,) of the best schedule; None if no schedule of grid values keeps the limits.

    Args:
        grid: values of the points.
        is_worst: If true, the worst point counts, else the weighted sum.
        first: index of the value at the first point; None for any.
        last: index of the value at the last point; None for any.
    """
    gain = grid.objective if is_worst else grid.objective * grid.weights[:, None]
    levels = [_only(gain[0], first)]
    for i, reach in enumerate(grid.reach.tolist()):
        before = sliding_maximum(levels[-1], reach)
        levels.append(np.minimum(gain[i + 1], before) if is_worst else gain[i + 1] + before)
    levels[-1] = _only(levels[-1], last)
    m = int(np.argmax(levels[-1]))
    if not np.isfinite(levels[-1][m]):
        return None
    chosen = [m]
    for i in range(len(levels) - 2, -1, -1):
        reach = int(grid.reach[i])
        low = max(m - reach, 0)
        window = levels[i][low : m + reach + 1]
        best = np.flatnonzero(window >= (min(window.max(), levels[i + 1][m]) if is_worst else window.max()))
        # Among equally good values, the nearest one.
        m = low + int(best[np.argmin(np.abs(best + low - m))])
        chosen.append(m)
    return np.asarray(grid.values[chosen[::-1]])


def _only(values: FloatArray, index: int | None) -> FloatArray:
    """Return values (M,) without all but one; unchanged without an index."""
    if index is None:
        return values
    kept = np.full_like(values, _OUT)
    kept[index] = values[index]
    return kept


def sliding_maximum(
    values: FloatArray, reach: int, *, shift: int = 0, size: int | None = None, axis: int = 0
) -> FloatArray:
    """Return the largest of the values within some steps to both sides of each place; minus infinity without any.

    Args:
        values: (M, ...) values along an axis.
        reach: number of steps to both sides.
        shift: place of the first result, from the first value.
        size: number of results; that of the values if left out.
        axis: the axis.
    """
    count = values.shape[axis]
    size = count if size is None else size
    # No place is further from a value.
    reach = min(reach, max(shift + size - 1, count - 1 - shift, 0))
    begin, length = shift - reach, size + 2 * reach
    padded = np.full((*values.shape[:axis], length, *values.shape[axis + 1 :]), _OUT)
    first, last = max(begin, 0), min(begin + length, count)
    if first < last:
        padded[_along(axis, first - begin, last - begin)] = values[_along(axis, first, last)]
    width, done = 2 * reach + 1, 1
    while 2 * done <= width:
        length = padded.shape[axis]
        padded = np.maximum(padded[_along(axis, 0, length - done)], padded[_along(axis, done, length)])
        done *= 2
    rest = width - done
    found = padded[_along(axis, 0, size)]
    return found if rest == 0 else np.maximum(found, padded[_along(axis, rest, rest + size)])


def _along(axis: int, begin: int, end: int) -> tuple[slice, ...]:
    """Return the index of a part of an array along an axis."""
    return (*[slice(None)] * axis, slice(begin, end))


def seeds(
    problem: ScheduleProblem, d: FloatArray, constant: FloatArray, *, fine: bool = True, sweeps: int = 2
) -> list[FloatArray]:
    """Return schedules (N, k) from dynamic programming, in one setting after the other.

    Args:
        problem: the problem.
        d: (n,) design.
        constant: (k,) settings at which the search begins.
        fine: If false, coarser grids.
        sweeps: number of times that every setting is taken; once suffices for one setting.
    """
    count = len(problem.points)
    s = np.repeat(np.reshape(constant, (1, -1)), count, axis=0)
    found = False
    for _ in range(1 if len(problem.settings) == 1 else sweeps):
        for k in range(len(problem.settings)):
            grid = grid_of(problem, d, s, k, fine)
            best = _periodic(problem, grid) if problem.is_periodic else best_path(grid, is_worst=problem.is_worst)
            if best is not None:
                found = True
                s[:, k] = np.interp(np.arange(count), grid.stages, best)
    return [s] if found else []


def _periodic(problem: ScheduleProblem, grid: Grid) -> FloatArray | None:
    """Return the best found schedule (S,) with equal first and last values, from a few of these values."""
    free = best_path(grid, is_worst=problem.is_worst)
    if free is None:
        return None
    low, high = sorted(int(np.searchsorted(grid.values, each)) for each in (free[0], free[-1]))
    tried = np.unique(np.concatenate([np.linspace(low, high, 9), np.linspace(0, len(grid.values) - 1, 16)]).astype(int))
    best, most = None, _OUT
    for m in tried.tolist():
        found = best_path(grid, is_worst=problem.is_worst, first=m, last=m)
        if found is None:
            continue
        values = grid.objective[np.arange(len(found)), np.searchsorted(grid.values, found)]
        value = float(values.min() if problem.is_worst else values @ grid.weights)
        if value > most:
            best, most = found, value
    return best


def constants(problem: ScheduleProblem, d: FloatArray, *, fine: bool = True, most: int = 3) -> list[FloatArray]:
    """Return constant settings (k,) at which a search for the best constant begins: those of a grid, best first.

    Args:
        problem: the problem.
        d: (n,) design.
        fine: If false, a coarser grid.
        most: largest number of constants.
    """
    first = ends(problem.settings)[2]
    if not len(first):
        return [first]
    if len(first) > 1:
        return _several_constants(problem, d, most)
    held = np.repeat(first[None], len(problem.points), axis=0)
    grid = grid_of(problem, d, held, 0, fine)
    means = grid.objective.min(axis=0) if problem.is_worst else grid.weights @ grid.objective
    means = np.where(np.isfinite(grid.objective).all(axis=0), means, _OUT)
    left, right = np.append(_OUT, means[:-1]), np.append(means[1:], _OUT)
    peaks = np.flatnonzero((means >= left) & (means >= right) & np.isfinite(means))
    best = peaks[np.argsort(-means[peaks], kind="stable")][:most]
    return [np.array([grid.values[m]]) for m in best.tolist()] or [first]


def _several_constants(problem: ScheduleProblem, d: FloatArray, most: int) -> list[FloatArray]:
    """Return the first values of several settings, and the best constants of a grid that keep the limits.

    Args:
        problem: the problem.
        d: (n,) design.
        most: largest number of constants from the grid.
    """
    low, high, first = ends(problem.settings)
    k, count = len(first), len(problem.points)
    stages = np.unique(np.linspace(0, count - 1, min(count, _SAMPLED)).astype(int))
    parts = np.linspace(0.0, 1.0, max(int(_COMBINED ** (1 / k)), 2))
    grid = low + (high - low) * np.stack(np.meshgrid(*[parts] * k, indexing="ij"), axis=-1).reshape(-1, k)
    found = problem.at(d, np.repeat(grid, len(stages), axis=0), np.tile(stages, len(grid)).tolist())
    values = problem.combined(found.objective).reshape(len(grid), -1)
    allowed = (found.excess <= 0).all(axis=1).reshape(values.shape) & np.isfinite(values)
    values = np.where(allowed, values, _OUT)
    weights = _stage_weights(problem.points.weights, stages, count)
    level = values.min(axis=1) if problem.is_worst else values @ weights
    kept: list[FloatArray] = []
    for s in grid[np.argsort(-level, kind="stable")[: int(np.isfinite(level).sum())]]:
        # Neighbours of a better constant would lead to the same optimum.
        if len(kept) < most and all((np.abs(s - each) > _APART * (high - low)).any() for each in kept):
            kept.append(s)
    return [first, *kept]
