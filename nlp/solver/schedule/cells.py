"""Proved bound of all schedules of one or two settings: dynamic programming over cells with outward-rounded enclosures.

The ranges of the settings are divided into cells, boxes of equal widths h. For each point i and cell c, an enclosure
gives a number ``U_i(c) >= f_i(s)`` for all s in c that keep the limits, or shows that no s in c keeps them. A schedule
moves by at most ``r dt_i`` in each setting, hence by at most ``floor(r dt_i / h) + 1`` cells. So the best sequence of
cells is a bound of all schedules. A forward and a backward pass give the bound of the schedules through each cell.
Cells below the known schedule are dropped, and all other cells are halved. The number of cells grows linearly with the
path.

With ``h`` just above ``r dt / m``, a sequence of cells moves by exactly m cells, and is as slow as the rate allows. A
width without this property would allow steps of up to ``r dt + h``.

An enclosure is affine with a remainder that falls with the square of the width. So one enclosure serves a block of
cells, until the remainder is as large as the change over a cell.

The bound is for the design, and at the points of the path. Every sum is rounded upwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...errors import CaseError, listing
from ...interruption import is_requested, why_stopped
from ...proof.enclosure.forms import Encloser, Forms
from .dynamic import sliding_maximum
from .problem import ScheduleProblem, ends

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest number of settings.
_SETTINGS = 2
#: Smallest number of cells of each setting at the beginning, for one setting and for two; largest number of halvings.
_CELLS, _LEVELS = (64, 16), 24
#: Largest number of cells of all points together, and number of values of cells that are computed at a time.
_MOST, _BATCH = 16_000_000, 2_000_000
#: Part by which the width is above a part of the step of the rate, far above its rounding; number of these parts for
#: which the width is chosen, and number of compared widths.
_ABOVE, _PARTS, _WIDTHS = 1e-6, 8, 64
#: Largest number of cells of a block along each setting, and largest remainder as a part of the change over a cell.
_BLOCK, _REMAINDER = 8, 0.5
#: Number of singular vectors that bound the smallest singular value over a block: two values may coincide in it.
_VECTORS = 2
#: Relative rounding of a sum of the terms of a form: far above the number of terms times 2^-53.
_ROUNDING = 2.0**-44
#: Relative increase of the number of cells that a rate allows, for its rounding; rounding of the ends of cells, as a
#: part of the largest end.
_REACH, _EDGE = 1 + 1e-12, 2.0**-49


class CellBound(NamedTuple):
    """Bound of all schedules at the points of the path.

    Attributes:
        bound: signed bound: no schedule within limits and rates has a larger objective; infinite without any.
        cells: number of examined cells.
        levels: number of examined widths.
        reason: reason for an end before the gap was reached, such as a time limit; empty if it was reached.
    """

    bound: float
    cells: int
    levels: int
    reason: str = ""


class _Cells(NamedTuple):
    """Box of cells of one point: place (k,) of its first cell, and an upper bound of the objective for each cell.

    The bound is minus infinity where a cell is dropped or no settings in it keep the limits.
    """

    first: NDArray[np.intp]
    upper: FloatArray


class _Kept(NamedTuple):
    """Box of cells of one point: place (k,) of its first cell, and whether each cell is kept."""

    first: NDArray[np.intp]
    kept: NDArray[np.bool_]


def check_certified(problem: ScheduleProblem) -> None:
    """Refuse a case whose schedules have no bound.

    Raises:
        CaseError: the case has no setting, or more than two.
        UncoveredError: an expression has an operation without an enclosure.
    """
    count = len(problem.settings)
    if count > _SETTINGS:
        names = listing(each.name for each in problem.settings)
        fault = f"bounds schedules of at most two changing numbers; this case has {count}: {names}; fix one of them"
        raise CaseError("certify", fault, source=problem.case.source)
    if not count:
        fault = "bounds schedules, but no value of this case changes along the path"
        raise CaseError("certify", fault, source=problem.case.source)
    _Enclosed(problem, ends(problem.design)[2])


def cell_bound(problem: ScheduleProblem, d: FloatArray, value: float, gap: float) -> CellBound:
    """Return a bound of all schedules for a design.

    An interrupt or a time limit ends the search with the bound that is proved by then.

    Args:
        problem: the problem, as :func:`check_certified` allows it.
        d: (n,) design.
        value: signed objective of a known schedule.
        gap: relative gap at which the search ends.

    Raises:
        UncoveredError: an expression has an operation without an enclosure.
    """
    enclosed = _Enclosed(problem, d)
    grid = _Grid(problem)
    start = _Kept(np.zeros(len(grid.widths), dtype=np.intp), np.ones(grid.counts, dtype=bool))
    kept = [start] * len(problem.points)
    bound, total = math.inf, 0
    for level in range(_LEVELS):
        cells = enclosed.cells(kept, grid)
        if cells is None:
            return CellBound(bound, total, level, why_stopped())
        total += sum(int(each.kept.sum()) for each in kept)
        found = _passed(problem, cells, grid, value)
        if found.bound == -math.inf:
            # No sequence of cells keeps the limits: only a known schedule can be the best one.
            return CellBound(value, total, level + 1)
        # A known schedule may exceed limits by rounding, which cells do not.
        bound, kept = min(bound, max(found.bound, value)), found.kept
        if bound - value <= gap * abs(value):
            return CellBound(bound, total, level + 1)
        if not all(each.kept.size for each in kept):
            return CellBound(min(bound, value), total, level + 1)
        if sum(each.kept.size for each in kept) * 2 ** len(grid.widths) > _MOST:
            return CellBound(bound, total, level + 1, f"more than {_MOST:,} cells")
        kept = [_halved(each) for each in kept]
        grid = grid.halved()
    return CellBound(bound, total, _LEVELS, f"cells halved {_LEVELS} times")


class _Grid:
    """Grid of cells over the ranges of the settings.

    Args:
        problem: the problem.

    Attributes:
        low, high: (k,) ends of the ranges.
        widths: (k,) widths of the cells.
        counts: number of cells of each setting at the beginning.
    """

    def __init__(self, problem: ScheduleProblem) -> None:
        self.low, self.high, _ = ends(problem.settings)
        k = len(self.low)
        self.widths = np.array([
            _width(span, steps, _CELLS[k - 1])
            for span, steps in zip((self.high - self.low).tolist(), problem.steps.T, strict=True)
        ])  # fmt: skip
        # The last cell ends above the range.
        self.counts = tuple(int(each) + 1 for each in np.ceil((self.high - self.low) / self.widths))

    def halved(self) -> _Grid:
        """Return the grid of halved cells; edges of cells stay the same to the last bit."""
        found = object.__new__(_Grid)
        found.low, found.high, found.counts, found.widths = self.low, self.high, self.counts, 0.5 * self.widths
        return found

    def edges(self, places: NDArray[np.intp]) -> FloatArray:
        """Return the lower edges (..., k) of cells at places (..., k); at most the upper end of the range."""
        return np.asarray(np.minimum(self.low + self.widths * places, self.high))

    def reach(self, steps: FloatArray) -> NDArray[np.intp]:
        """Return the number of cells (N - 1, k) by which schedules with largest steps (N - 1, k) can move."""
        edge = _EDGE * np.maximum(np.abs(self.low), np.abs(self.high)) / self.widths
        # The range has fewer cells than this, so larger steps do not matter.
        span = (self.high - self.low) / self.widths + 2
        return np.asarray(np.floor(np.minimum(steps / self.widths * _REACH + edge, span)) + 1).astype(np.intp)


def _width(span: float, steps: FloatArray, count: int) -> float:
    """Return the width of the cells of one setting at the beginning.

    It is a step of the rate, times or divided by a power of 2: the step for which cells relax the rate least.

    Args:
        span: length of the range.
        steps: (N - 1,) largest steps of the setting.
        count: least number of cells.
    """
    finite = steps[np.isfinite(steps) & (steps > 0) & (steps < span)]
    if not len(finite):
        return span / count
    widths = np.unique(np.quantile(finite, np.linspace(0, 1, _WIDTHS), method="nearest")) * (1 + _ABOVE)
    parts = widths[:, None] / _PARTS
    moved = ((np.floor(finite / parts) + 1) * parts).sum(axis=1)
    step = float(widths[int(np.argmin(moved))])
    return math.ldexp(step, math.floor(math.log2(span / (count * step))))


def _trimmed(first: NDArray[np.intp], kept: NDArray[np.bool_]) -> _Kept:
    """Return the smallest box of cells that contains all kept ones; without cells if none is kept."""
    begins, shape = [], []
    for axis in range(kept.ndim):
        places = np.flatnonzero(kept.any(axis=tuple(each for each in range(kept.ndim) if each != axis)))
        if not len(places):
            return _Kept(first, kept[(slice(0),) * kept.ndim])
        begins.append(int(places[0]))
        shape.append(slice(int(places[0]), int(places[-1]) + 1))
    return _Kept(first + np.array(begins, dtype=np.intp), kept[tuple(shape)].copy())


def _halved(cells: _Kept) -> _Kept:
    """Return the halves of cells along each setting."""
    kept = cells.kept
    for axis in range(kept.ndim):
        kept = np.repeat(kept, 2, axis=axis)
    return _Kept(2 * cells.first, kept)


class _Enclosed:
    """Enclosures of objective and limits over cells.

    Args:
        problem: the problem.
        d: (n,) design.
    """

    def __init__(self, problem: ScheduleProblem, d: FloatArray) -> None:
        own, s, point = problem.symbols
        k = len(problem.settings)
        # A limit on an estimate is stricter than that of the case, so it excludes no cell.
        exact = ca.vertcat(SX(0, 1), *[problem.limits[j] for j in np.flatnonzero(problem.are_exact).tolist()])
        vectors = SX(6, 0) if problem.matrix is None else SX.sym("v", 6, _VECTORS)
        if problem.matrix is None:
            weighted = problem.objective * ca.DM(problem.weights)
            expression = weighted if problem.is_worst or problem.has_levels else ca.sum1(weighted)
        else:
            expression = ca.sum1((problem.matrix @ vectors) ** 2).T
        z = SX.sym("z", k + point.numel() + vectors.numel())
        count = k + point.numel()
        given = [SX(ca.DM(d)) if own.numel() else SX(0, 1), z[:k], z[k:count], z[count:]]
        function = ca.Function("point", [own, s, point, ca.vec(vectors)], [expression, exact])
        values, limits = function.call(given)
        self._d = d
        self._problem, self._count, self._rows = problem, values.numel(), values.numel() + limits.numel()
        self._encloser = Encloser(z, ca.vertcat(values, limits))
        self._block = 1

    def cells(self, kept: Sequence[_Kept], grid: _Grid) -> list[_Cells] | None:
        """Return the cells of each point with bounds of the objective; None if a stop is requested before the end."""
        size, k = self._block, len(grid.widths)
        boxes = [_in_blocks(each, size) for each in kept]
        flat = [np.flatnonzero(box.kept.reshape(_split(box.kept.shape, size)).any(axis=_inner(k))) for box in boxes]
        blocks = np.concatenate([
            np.stack(np.unravel_index(own, [n // size for n in box.kept.shape]), axis=1) + box.first // size
            for own, box in zip(flat, boxes, strict=True)
        ])  # fmt: skip
        points = np.repeat(np.arange(len(kept)), [len(own) for own in flat])
        upper = np.empty((len(points), size**k))
        # Forms have a slope for each coordinate, also for those of the point.
        batch = max(_BATCH // (self._rows * max(size**k, k + len(self._problem.numbers))), 1)
        remainders = []
        for start in range(0, len(points), batch):
            if is_requested():
                return None
            part = slice(start, start + batch)
            upper[part], remainder = self._of_blocks(blocks[part], points[part], grid)
            remainders.append(remainder)
        self._choose_block(np.concatenate(remainders))
        found, done = [], 0
        for own, box in zip(flat, boxes, strict=True):
            values = np.full((*(n // size for n in box.kept.shape), size**k), -math.inf)
            values.reshape(-1, size**k)[own] = upper[done : done + len(own)]
            done += len(own)
            order = [each for axis in range(k) for each in (axis, k + axis)]
            whole = values.reshape(*values.shape[:-1], *[size] * k).transpose(order).reshape(box.kept.shape)
            whole[~box.kept] = -math.inf
            found.append(_Cells(box.first, whole))
        return found

    def _choose_block(self, remainders: FloatArray) -> None:
        """Choose the number of cells of a block along each setting at the next level, whose cells have half the width.

        Args:
            remainders: (B,) remainders of the objective over blocks, as parts of the change over a block.
        """
        # Remainder as a part of the change, over a block of one cell: it is proportional to the width.
        one = 0.5 * float(np.median(remainders)) / self._block
        size = 1
        # Over a larger block the remainder is larger with the square of the width, but the change over a cell is not.
        while size < _BLOCK and one * (2 * size) ** 2 <= _REMAINDER:
            size *= 2
        self._block = size

    def _numbers(self, points: NDArray[np.intp], blocks: NDArray[np.intp], grid: _Grid) -> FloatArray:
        """Return the inputs (m, B) of blocks besides the settings: the numbers of points, and singular vectors.

        ``|J v|`` is not below the smallest singular value for any unit vector v. Those of the middle of a block are
        closest.
        """
        numbers = self._problem.numbers[:, points]
        low, high = grid.edges(blocks * self._block), grid.edges((blocks + 1) * self._block)
        matrices = self._problem.matrices(self._d, 0.5 * (low + high), numbers)
        if matrices is None:
            return numbers
        vectors = np.linalg.svd(np.nan_to_num(matrices))[2][:, -_VECTORS:]
        # Rounding makes no vector shorter than 1.
        return np.vstack([numbers, (1 + _ROUNDING) * vectors.reshape(len(points), -1).T])

    def _of_blocks(
        self, blocks: NDArray[np.intp], points: NDArray[np.intp], grid: _Grid
    ) -> tuple[FloatArray, FloatArray]:
        """Return bounds (B, cells of a block) of the objective over the cells of blocks, and their remainders.

        Args:
            blocks: (B, k) places of the blocks.
            points: (B,) their points.
            grid: the grid of cells.
        """
        size, k = self._block, len(grid.widths)
        numbers = self._numbers(points, blocks, grid)
        # Edges (B, k, size + 1) of all cells of a block.
        places = (blocks[:, None, :] * size + np.arange(size + 1)[:, None]).astype(np.intp)
        edges = grid.edges(places).transpose(0, 2, 1)
        low, high = edges[:, :, 0], edges[:, :, -1]
        forms = self._encloser(np.vstack([low.T, numbers]), np.vstack([high.T, numbers]))
        centre, radius = 0.5 * (low + high), 0.5 * (high - low)
        # Coordinates of the cells in the block, of which all lie in [-1, 1]; wider by the rounding of the edges.
        with np.errstate(invalid="ignore", divide="ignore"):
            ranges = np.where(radius[:, :, None] > 0, (edges - centre[:, :, None]) / radius[:, :, None], 0.0)
            spread = np.where(radius > 0, _EDGE * (1 + np.abs(centre) / radius), 0.0)[:, :, None]
        least, largest = np.maximum(ranges[:, :, :-1] - spread, -1.0), np.minimum(ranges[:, :, 1:] + spread, 1.0)
        upper = _over_cells(forms, least, largest, self._count)
        if self._problem.matrix is not None:
            upper = np.where(upper == -math.inf, upper, np.nextafter(np.sqrt(np.maximum(upper, 0.0)), math.inf))
        # Cells above the range are empty; its upper end belongs to the cell below.
        beyond = edges[:, :, :-1] >= grid.high[:, None]
        for axis in range(k):
            shape = (len(blocks), *(size if each == axis else 1 for each in range(k)))
            upper = np.where(beyond[:, axis].reshape(shape), -math.inf, upper)
        with np.errstate(invalid="ignore", divide="ignore"):
            change = np.abs(forms.a[:, : self._count, :]).sum(axis=2)
            parts = np.nan_to_num(forms.r[:, : self._count] / change, nan=math.inf, posinf=math.inf).min(axis=1)
        return upper.reshape(len(blocks), -1), np.asarray(parts)


def _over_cells(forms: Forms, least: FloatArray, largest: FloatArray, count: int) -> FloatArray:
    """Return upper bounds (B, cells...) of the objective; minus infinity where a limit is provably exceeded.

    Args:
        forms: (B, R) forms of the objectives and limits over the blocks.
        least: (B, k, size) smallest coordinates of the cells of each block, in [-1, 1].
        largest: (B, k, size) their largest coordinates.
        count: number of objectives.
    """
    k, size = least.shape[1:]
    with np.errstate(invalid="ignore", over="ignore"):
        rest = np.abs(forms.a[:, :, k:]).sum(axis=2) + forms.r
        slack = rest + _ROUNDING * (np.abs(forms.c) + np.abs(forms.a).sum(axis=2) + forms.r)
        shape = (*forms.c.shape, *[1] * k)
        high, low = (forms.c[:, :count] + slack[:, :count]).reshape(shape[0], count, *shape[2:]), None
        if forms.c.shape[1] > count:
            low = (forms.c[:, count:] - slack[:, count:]).reshape(shape[0], -1, *shape[2:])
        for axis in range(k):
            over = (len(least), -1, *(size if each == axis else 1 for each in range(k)))
            ends_of_terms = [forms.a[:, :, axis, None] * each[:, None, axis] for each in (least, largest)]
            high = high + np.maximum(*(each[:, :count] for each in ends_of_terms)).reshape(over)
            if low is not None:
                low = low + np.minimum(*(each[:, count:] for each in ends_of_terms)).reshape(over)
    # A value that may be undefined has no bound, and its limit excludes nothing.
    objective = np.where(np.isnan(high), math.inf, high).min(axis=1)
    if low is None:
        return np.asarray(objective)
    out = (np.where(np.isnan(low), -math.inf, low) > 0).any(axis=1)
    return np.asarray(np.where(out, -math.inf, objective))


def _in_blocks(cells: _Kept, size: int) -> _Kept:
    """Return a box of cells, extended to whole blocks of ``size`` cells along each setting."""
    before = cells.first % size
    after = -(before + cells.kept.shape) % size
    return _Kept(cells.first - before, np.pad(cells.kept, list(zip(before.tolist(), after.tolist(), strict=True))))


def _split(shape: tuple[int, ...], size: int) -> tuple[int, ...]:
    """Return the shape of an array of cells, with the cells of a block on axes of their own."""
    return tuple(each for n in shape for each in (n // size, size))


def _inner(k: int) -> tuple[int, ...]:
    """Return the axes of the cells of a block."""
    return tuple(2 * axis + 1 for axis in range(k))


class _Passed(NamedTuple):
    """Largest bound of all schedules through cells, and cells whose bound is not below a value.

    Attributes:
        bound: largest bound; minus infinity if no sequence of cells keeps the limits.
        kept: cells of each point.
    """

    bound: float
    kept: list[_Kept]


def _passed(problem: ScheduleProblem, cells: Sequence[_Cells], grid: _Grid, value: float) -> _Passed:
    """Return the largest bound of the schedules through cells, and the cells through which a value may be reached."""
    reach, weights = grid.reach(problem.steps).tolist(), problem.points.weights.tolist()
    gains = [_gain(problem, each, weight) for each, weight in zip(cells, weights, strict=True)]
    before = [gains[0]]
    for gain, own in zip(gains[1:], reach, strict=True):
        best = _reached(before[-1], gain, own)
        before.append(_Cells(gain.first, _joined(problem, gain.upper, best)))
    bound, after = float(before[-1].upper.max()), gains[-1]
    if bound == -math.inf:
        return _Passed(bound, [])
    kept = [_trimmed(after.first, before[-1].upper >= value)]
    for i in range(len(gains) - 2, -1, -1):
        rest = _reached(after, gains[i], reach[i])
        through = _joined(problem, before[i].upper, rest)
        bound = min(bound, float(through.max()))
        kept.append(_trimmed(gains[i].first, through >= value))
        after = _Cells(gains[i].first, _joined(problem, gains[i].upper, rest))
        before[i + 1 :] = []  # no longer needed
    return _Passed(bound, kept[::-1])


def _gain(problem: ScheduleProblem, cells: _Cells, weight: float) -> _Cells:
    """Return the parts of cells in the objective of a schedule."""
    if problem.is_worst:
        return cells
    with np.errstate(invalid="ignore"):
        gain = cells.upper * weight
    # A weight of 0 gives no bound to a value that may be undefined.
    gain = np.where(cells.upper == -math.inf, -math.inf, np.where(np.isnan(gain), math.inf, gain))
    return _Cells(cells.first, _up(gain))


def _reached(source: _Cells, target: _Cells, reach: Sequence[int]) -> FloatArray:
    """Return the largest bound of the source's cells from which each cell of the target is reached."""
    best = source.upper
    for axis, own in enumerate(reach):
        shift = int(target.first[axis] - source.first[axis])
        best = sliding_maximum(best, own, shift=shift, size=target.upper.shape[axis], axis=axis)
    return best


def _joined(problem: ScheduleProblem, gain: FloatArray, rest: FloatArray) -> FloatArray:
    """Return the bound of a cell together with the bound of the rest of the schedule."""
    if problem.is_worst:
        return np.minimum(gain, rest)
    with np.errstate(invalid="ignore"):
        joined = gain + rest
    # An unknown bound does not help a schedule that does not exist.
    return _up(np.where(np.isnan(joined), -math.inf, joined))


def _up(values: FloatArray) -> FloatArray:
    """Return values rounded upwards after one operation; a dropped cell stays one."""
    return np.asarray(np.where(values == -math.inf, values, np.nextafter(values, math.inf)))
