"""Proved bound of all schedules of one setting: dynamic programming over cells, with enclosures rounded outwards.

The range of the setting is divided into cells of equal width h. For each point i and cell c, an enclosure gives a
number ``U_i(c) >= f_i(s)`` for all s in c that keep the limits, or shows that no s in c keeps them. A schedule moves by
at most ``r dt_i``, hence by at most ``floor(r dt_i / h) + 1`` cells. So the best sequence of cells is a bound of all
schedules. A forward and a backward pass give the bound of the schedules through each cell; cells below the known
schedule are dropped, and the others are halved. The number of cells grows with the path linearly.

The bound is for the design, and at the points of the path. Every sum is rounded upwards.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...errors import CaseError
from ...interruption import is_requested
from ...proof.enclosure.forms import Encloser, Forms
from .problem import ScheduleProblem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of cells at the beginning, and largest number of halvings.
_CELLS, _LEVELS = 64, 24
#: Largest number of cells of all points together, and number of cells that are enclosed at a time.
_MOST, _BATCH = 600_000, 20_000
#: Relative rounding of a sum of the terms of a form: far above the number of terms times 2^-53.
_ROUNDING = 2.0**-44
#: Relative increase of the number of cells that a rate allows, for its rounding; rounding of the ends of cells, as a
#: part of the largest end.
_REACH, _EDGE = 1 + 1e-12, 2.0**-49


class CellBound(NamedTuple):
    """Bound of all schedules at the points of the path.

    Attributes:
        bound: signed bound: no schedule within limits and rates has a larger objective.
        width: width of the last cells.
        cells: number of enclosed cells.
        levels: number of halvings.
    """

    bound: float
    width: float
    cells: int
    levels: int


class _Cells(NamedTuple):
    """Kept cells of one point: ascending places (c,), and upper bounds (c,) of the objective."""

    places: NDArray[np.intp]
    upper: FloatArray


def check_certified(problem: ScheduleProblem) -> None:
    """Refuse a case with several settings.

    Raises:
        CaseError: the case has more than one setting.
    """
    count = len(problem.settings)
    if count != 1:
        fault = f"bounds schedules of one changing number; this case has {count}"
        raise CaseError("certify", fault, source=problem.case.source)


def cell_bound(problem: ScheduleProblem, d: FloatArray, value: float, gap: float) -> CellBound:
    """Return a bound of all schedules for a design.

    Args:
        problem: the problem, with one setting.
        d: (n,) design.
        value: signed objective of a known schedule.
        gap: relative gap at which the search ends.

    Raises:
        CaseError: the case has more than one setting.
        UncoveredError: an expression has an operation without an enclosure.
    """
    check_certified(problem)
    enclosed = _Enclosed(problem, d)
    low, high = problem.settings[0].lower, problem.settings[0].upper
    kept = [np.arange(_CELLS) for _ in range(len(problem.points))]
    size, bound, total, level = _CELLS, math.inf, 0, 0
    for level in range(_LEVELS):
        if is_requested():
            break
        edges = _edges(low, high, size)
        cells = enclosed.cells(kept, edges)
        total += sum(map(len, kept))
        width = (high - low) / size
        through = _through(problem, cells, width)
        if through is None:
            # No sequence of cells keeps the limits: only a known schedule can be the best one.
            return CellBound(value, width, total, level)
        most = max(float(each.max(initial=-math.inf)) for each in through)
        bound = min(bound, max(most, value))
        if bound - value <= gap * abs(value):
            break
        left = [one.places[each >= value] for one, each in zip(cells, through, strict=True)]
        if any(len(each) == 0 for each in left):
            bound = min(bound, value)
            break
        if 2 * sum(map(len, left)) > _MOST:
            break
        kept = [np.stack([2 * each, 2 * each + 1], axis=1).ravel() for each in left]
        size *= 2
    return CellBound(bound, (high - low) / size, total, level)


def _edges(low: float, high: float, size: int) -> FloatArray:
    """Return the ends (size + 1,) of the cells; neighbours share an end, and the outer ends are exact."""
    edges = low + (high - low) * (np.arange(size + 1) / size)
    edges[0], edges[-1] = low, high
    return edges


class _Enclosed:
    """Enclosures of objective and limits over cells.

    Args:
        problem: the problem.
        d: (n,) design.
    """

    def __init__(self, problem: ScheduleProblem, d: FloatArray) -> None:
        own, s, point = problem.symbols
        z = SX.sym("z", 1 + point.numel())
        given = [SX(ca.DM(d)) if own.numel() else SX(0, 1), z[:1], z[1:]]
        function = ca.Function("point", [own, s, point], [problem.objective, problem.limits])
        objective, limits = function.call(given)
        weighted = objective * ca.DM(problem.weights)
        values = weighted if problem.is_worst or problem.has_levels else ca.sum1(weighted)
        self._problem, self._count = problem, values.numel()
        self._encloser = Encloser(z, ca.vertcat(values, limits))

    def cells(self, kept: list[NDArray[np.intp]], edges: FloatArray) -> list[_Cells]:
        """Return the cells of each point in which the limits may hold, with bounds of the objective."""
        points = np.repeat(np.arange(len(kept)), [len(each) for each in kept])
        index = np.concatenate(kept)
        upper = np.empty(len(index))
        for start in range(0, len(index), _BATCH):
            part = slice(start, start + _BATCH)
            numbers = self._problem.numbers[:, points[part]]
            lower = np.vstack([edges[index[part]], numbers])
            higher = np.vstack([edges[index[part] + 1], numbers])
            upper[part] = self._upper(self._encloser(lower, higher))
        ends = np.cumsum([0, *(len(each) for each in kept)])
        found = []
        for a, b in pairwise(ends.tolist()):
            own = upper[a:b] > -math.inf
            found.append(_Cells(index[a:b][own], upper[a:b][own]))
        return found

    def _upper(self, forms: Forms) -> FloatArray:
        """Return upper bounds (B,) of the objective; minus infinity where a limit is provably exceeded."""
        with np.errstate(invalid="ignore", over="ignore"):
            spread = np.abs(forms.a).sum(axis=2) + forms.r
            slack = _ROUNDING * (np.abs(forms.c) + spread)
            high = forms.c + spread + slack
            low = forms.c - spread - slack
        # A value that may be undefined has no bound, and its limit excludes nothing.
        high = np.where(np.isnan(high), math.inf, high)
        low = np.where(np.isnan(low), -math.inf, low)
        count = self._count
        objective = high[:, :count].min(axis=1)
        out = (low[:, count:] > 0).any(axis=1)
        return np.where(out, -math.inf, objective)


def _through(problem: ScheduleProblem, cells: list[_Cells], width: float) -> list[FloatArray] | None:
    """Return for each point the bound of the schedules through each kept cell; None if there is no such schedule."""
    setting = problem.settings[0]
    edge = _EDGE * max(abs(setting.lower), abs(setting.upper)) / width
    cells_moved = np.minimum(problem.steps[:, 0] / width * _REACH + edge, _CELLS * 2.0**_LEVELS)
    reach = (np.floor(cells_moved) + 1).astype(int).tolist()
    before = _pass(problem, cells, reach)
    after = _pass(problem, cells[::-1], reach[::-1], is_backward=True)
    if before is None or after is None:
        return None
    found = []
    for forward, backward in zip(before, after[::-1], strict=True):
        found.append(np.minimum(forward, backward) if problem.is_worst else _up(forward + backward))
    return found


def _pass(
    problem: ScheduleProblem, cells: list[_Cells], reach: list[int], *, is_backward: bool = False
) -> list[FloatArray] | None:
    """Return bounds of the schedules up to each cell; a backward pass leaves out the cell itself."""
    weights = problem.points.weights[::-1] if is_backward else problem.points.weights
    gains = [each.upper if problem.is_worst else _up(each.upper * w) for each, w in zip(cells, weights, strict=True)]
    neutral = math.inf if problem.is_worst else 0.0
    level = np.full(len(cells[0].places), neutral)
    found = [level if is_backward else gains[0]]
    for i in range(1, len(cells)):
        whole = gains[i - 1] if not is_backward else _joined(problem, gains[i - 1], found[-1])
        source = found[-1] if not is_backward else whole
        best = _largest_within(cells[i - 1].places, source, cells[i].places, reach[i - 1])
        if not (best > -math.inf).any():
            return None
        found.append(best if is_backward else _joined(problem, gains[i], best))
    return found


def _joined(problem: ScheduleProblem, gain: FloatArray, rest: FloatArray) -> FloatArray:
    """Return the bound of a cell together with the bound of the rest of the schedule."""
    return np.minimum(gain, rest) if problem.is_worst else _up(gain + rest)


def _up(values: FloatArray) -> FloatArray:
    """Return values rounded upwards after one operation."""
    return np.asarray(np.nextafter(values, math.inf))


def _largest_within(index: NDArray[np.intp], values: FloatArray, at: NDArray[np.intp], reach: int) -> FloatArray:
    """Return the largest value of the cells within some steps of each cell; minus infinity without any.

    Args:
        index: (c,) ascending indices of cells.
        values: (c,) their values.
        at: (b,) indices of the cells around which the largest value is taken.
        reach: number of steps to both sides.
    """
    left, right = np.searchsorted(index, at - reach, "left"), np.searchsorted(index, at + reach, "right")
    length = right - left
    table = [values]
    while 2 ** len(table) <= length.max(initial=0):
        half = 2 ** (len(table) - 1)
        table.append(np.maximum(table[-1][:-half], table[-1][half:]))
    found = np.full(len(at), -math.inf)
    some = np.flatnonzero(length > 0)
    order = np.floor(np.log2(length[some])).astype(int)
    for k in np.unique(order).tolist():
        own = some[order == k]
        found[own] = np.maximum(table[k][left[own]], table[k][right[own] - 2**k])
    return found
