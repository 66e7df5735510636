"""Ipopt near a schedule: settings at all points, or one constant, together with the free dimensions of the design.

With its usual barrier Ipopt leaves the ridge on which it begins. The small barrier and distances from bounds keep it
there. A largest worst value leaves most of the schedule open, so the mean is maximised next, at this level. The mean of
quantities of legs or actuators has one level for each point, which is below all of them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from ....models import FloatArray
from .problem import INSIDE, ScheduleProblem, ends

#: Barrier and distances from bounds at which Ipopt begins, and its tolerance.
_BARRIER, _NEAR, _TOLERANCE = 1e-7, 1e-9, 1e-9
#: Largest number of iterations.
_ITERATIONS = 300
#: Part of the level that the second search may lose.
_LOSS = 1e-7


class Polished(NamedTuple):
    """Design (n,), settings (N, k) and signed objective after a local search."""

    d: FloatArray
    s: FloatArray
    value: float


def polish(
    problem: ScheduleProblem,
    d: FloatArray,
    s: FloatArray,
    *,
    constant: bool = False,
    near: bool = True,
    iterations: int = _ITERATIONS,
) -> Polished | None:
    """Return the local optimum near a design and a schedule; None if none was found that keeps the limits.

    Args:
        problem: the problem.
        d: (n,) design.
        s: (N, k) schedule.
        constant: If true, settings are the same at all points.
        near: If true, the search stays near its start.
        iterations: largest number of iterations.
    """
    if problem.is_worst:
        level = _search(problem, d, s, constant=constant, near=near, iterations=iterations, goal="level")
        if level is None or constant:
            return level
        reached = problem.value(level.d, level.s, estimated=True)
        least = reached - _LOSS * abs(reached)
        again = _search(
            problem, level.d, level.s, constant=False, near=True, iterations=iterations, goal="", at_least=least
        )
        return level if again is None or again.value < level.value - 2 * _LOSS * abs(level.value) else again
    return _search(problem, d, s, constant=constant, near=near, iterations=iterations, goal="")


def _search(
    problem: ScheduleProblem,
    d: FloatArray,
    s: FloatArray,
    *,
    constant: bool,
    near: bool,
    iterations: int,
    goal: str,
    at_least: float | None = None,
) -> Polished | None:
    """Return the result of one search for the largest level or the largest mean; see :func:`polish`."""
    count, k = s.shape
    n = len(d)
    rows = 1 if constant else count
    centre, half = _scales(problem)
    levels = 1 if goal == "level" else count if problem.has_levels else 0
    at_levels, at_extents = n + rows * k, n + rows * k + levels
    x = MX.sym("x", at_extents + 2 * len(problem.extents))
    design = ca.DM(centre[:n]) + ca.DM(half[:n]) * x[:n] if n else MX(0, 1)
    own = ca.reshape(x[n : n + rows * k], k, rows)
    own = ca.repmat(ca.DM(centre[n:]), 1, rows) + ca.repmat(ca.DM(half[n:]), 1, rows) * own
    S = ca.repmat(own, 1, count) if constant else own
    values, limits = problem.function.map(count)(ca.repmat(design, 1, count), S, problem.numbers)
    T = values.shape[0]
    weighted = values * ca.repmat(ca.DM(problem.weights), 1, count)
    start = problem.combined(problem.at(d, s, estimated=True).objective)
    size = float(np.abs(start).mean()) or 1.0
    g, low, high = [ca.vec(limits)], [-math.inf] * limits.numel(), [0.0] * limits.numel()
    if problem.of_design.numel():
        g.append(ca.Function("own", [problem.symbols[0]], [problem.of_design])(design))
        low, high = low + [-math.inf] * problem.of_design.numel(), high + [0.0] * problem.of_design.numel()
    if rows > 1:
        rates, ends_of_rates = _rate_rows(problem, x[n : n + rows * k], half[n:])
        g += rates
        low, high = low + [-end for end in ends_of_rates], high + ends_of_rates
    x0 = np.concatenate([(d - centre[:n]) / half[:n], ((s[:rows] - centre[n:]) / half[n:]).ravel()])
    lbx, ubx = -np.ones(len(x0)), np.ones(len(x0))
    if levels:
        least = -math.inf if at_least is None else at_least / size
        x0 = np.append(x0, np.maximum((start if levels > 1 else start.min(keepdims=True)) / size, least))
        lbx, ubx = np.append(lbx, [least] * levels), np.append(ubx, [math.inf] * levels)
        t = x[at_levels:at_extents]
        g.append(_above_levels(weighted / size, t))
        low, high = low + [0.0] * (T * count), high + [math.inf] * (T * count)
        objective = -ca.dot(t, ca.DM(problem.points.weights)) if levels > 1 else -t
    else:
        objective = -ca.dot(ca.sum1(weighted).T, ca.DM(problem.points.weights)) / size
        if at_least is not None:
            g.append(ca.vec(weighted) / size)
            low, high = low + [at_least / size] * (T * count), high + [math.inf] * (T * count)
    if problem.extents:
        extents = _extent_rows(problem, d, s, ca.repmat(design, 1, count), S, x[at_extents:])
        g.append(extents.rows)
        low, high = low + [-math.inf] * extents.rows.numel(), high + [0.0] * extents.rows.numel()
        x0 = np.append(x0, extents.start)
        lbx, ubx = (np.append(each, [end] * len(extents.start)) for each, end in ((lbx, -math.inf), (ubx, math.inf)))
    solver = ca.nlpsol("schedule", "ipopt", {"x": x, "f": objective, "g": ca.vertcat(*g)}, _options(near, iterations))
    found = solver(x0=np.clip(x0, lbx, ubx), lbx=lbx, ubx=ubx, lbg=low, ubg=high)
    point = np.clip(found["x"].full().ravel()[: n + rows * k], -1.0, 1.0)
    return _kept(problem, centre[:n] + half[:n] * point[:n], centre[n:] + half[n:] * point[n:].reshape(rows, k))


def _kept(problem: ScheduleProblem, d: FloatArray, s: FloatArray) -> Polished | None:
    """Return a design (n,) and a schedule (N, k), or a constant (1, k), that keeps all limits; None if it does not."""
    low_d, high_d, _ = ends(problem.design)
    low_s, high_s, _ = ends(problem.settings)
    d_new, s_new = np.clip(d, low_d, high_d), np.clip(s, low_s, high_s)
    if problem.is_periodic:
        s_new[-1] = s_new[0]
    count = len(problem.points)
    s_new = np.repeat(s_new, count, axis=0) if len(s_new) < count else within_rates(problem, s_new)
    if not problem.is_feasible(d_new, s_new):
        return None
    return Polished(d_new, s_new, problem.value(d_new, s_new))


class _ExtentRows(NamedTuple):
    """Rows (r, 1) of limits that compare two points, at most 0, and first values (2 l,) of the extents."""

    rows: MX
    start: FloatArray


def _extent_rows(
    problem: ScheduleProblem, d: FloatArray, s: FloatArray, design: MX, settings: MX, extents: MX
) -> _ExtentRows:
    """Return the rows of limits that compare two points, with the smallest and the largest length as variables.

    Args:
        problem: the problem.
        d: (n,) design at the start.
        s: (N, k) schedule at the start.
        design: (n, N) design at the points.
        settings: (k, N) settings at the points.
        extents: (2 l, 1) smallest lengths, then largest lengths, relative to their sizes.
    """
    first, count, half = problem.compared(d, s), len(problem.points), len(problem.extents)
    size = np.abs(first).mean(axis=0)
    lengths = problem.lengths_function.map(count)(design, settings, problem.numbers) / ca.repmat(ca.DM(size), 1, count)
    smallest, largest = extents[:half], extents[half:]
    rows = [ca.vec(ca.repmat(smallest, 1, count) - lengths), ca.vec(lengths - ca.repmat(largest, 1, count))]
    rows += [
        (size[j] * (largest[j] - each.ratio * smallest[j]) - each.most) / abs(each.most) + problem.extent_margin
        for j, own in enumerate(problem.extents)
        for each in own
    ]
    return _ExtentRows(ca.vertcat(*rows), np.concatenate([first.min(axis=0) / size, first.max(axis=0) / size]))


def _above_levels(values: MX, levels: MX) -> MX:
    """Return values (T, N) minus the level of their point, or minus the only level, as a column."""
    T, count = values.shape
    return ca.vec(values - (ca.repmat(levels.T, T, 1) if levels.numel() > 1 else ca.repmat(levels, T, count)))


def _rate_rows(problem: ScheduleProblem, s: MX, half: FloatArray) -> tuple[list[MX], list[float]]:
    """Return steps as parts of the rates, since an error of a step would grow along the path, and their largest sizes.

    Args:
        problem: the problem.
        s: (N k, 1) scaled settings, point by point.
        half: (k,) half widths of their ranges.
    """
    rows, sizes, k = list[MX](), list[float](), len(half)
    for j in range(k):
        steps = problem.steps[:, j] * (1 - INSIDE) / half[j]
        limited = np.flatnonzero(np.isfinite(steps)).tolist()
        own = s[j::k]
        rows.append((own[1:] - own[:-1])[limited] / ca.DM(steps[limited]))
        sizes += [1.0] * len(limited)
        if problem.is_periodic:
            rows.append(own[-1] - own[0])
            sizes.append(0.0)
    return rows, sizes


def within_rates(problem: ScheduleProblem, s: FloatArray) -> FloatArray:
    """Return a schedule (N, k) whose steps are within the rates, after steps that exceed them by rounding."""
    found, limits = s.copy(), problem.steps * (1 - 0.5 * INSIDE)
    if (np.abs(np.diff(s, axis=0)) <= limits).all():
        return found
    for i in range(1, len(s)):
        found[i] = np.clip(s[i], found[i - 1] - limits[i - 1], found[i - 1] + limits[i - 1])
    return found


def _scales(problem: ScheduleProblem) -> tuple[FloatArray, FloatArray]:
    """Return the middles and half widths of the ranges of design and settings."""
    low, high, _ = ends([*problem.design, *problem.settings])
    return 0.5 * (low + high), 0.5 * (high - low)


def _options(near: bool, iterations: int) -> dict[str, Any]:
    """Return the options of Ipopt."""
    own: dict[str, Any] = {"print_level": 0, "sb": "yes", "max_iter": iterations, "tol": _TOLERANCE}
    own["bound_relax_factor"] = 0.0  # bounds and rates are kept exactly
    if near:
        pushes = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
        own |= {"mu_init": _BARRIER, **dict.fromkeys(pushes, _NEAR)}
    return {"print_time": False, "ipopt": own}
