"""Picture of a schedule: map of the objective over path and setting, and rates of the settings against their limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from ....models import FloatArray
from ...solver.schedule.dynamic import grid_of
from ...solver.schedule.formulation import schedule_problem
from ...words.schedule import objective_name
from .canvas import INK, RED
from .curves import draw_frame, draw_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...case.case import Case
    from ...solver.scheduled import Schedule
    from ...solver.solution import Solution

#: Width of the picture, and height of a map and of the rates, inches.
_WIDTH, _MAP, _RATES = 8.2, 3.6, 2.0
#: Colours of forbidden parts, of the schedule, of the best constant, and of the rates.
_FORBIDDEN, _SCHEDULE, _CONSTANT = "#b9bec2", "#d0021b", "#ffffff"
_COLOURS = ("#08519c", "#b34700", "#00703c")


def schedule_figure(case: Case, solution: Solution) -> Figure | None:
    """Return the maps of the settings and their rates as a Matplotlib figure; None without a schedule."""
    schedule = solution.schedule
    return None if schedule is None or not schedule.names else figure_of_schedule(case, schedule)


def figure_of_schedule(case: Case, schedule: Schedule) -> Figure:
    """Return the maps of the settings and their rates as a Matplotlib figure; the schedule has a setting."""
    problem, units = schedule_problem(case), schedule.units
    d = np.array([units.to_internal(schedule.design[each.name], each.dimension) for each in problem.design])
    unit = np.array([units.to_internal(1.0, each) for each in schedule.dimensions])
    is_timed = bool(np.isfinite(schedule.times).all())
    along = schedule.times if is_timed else np.arange(float(len(schedule.times)))
    count = len(schedule.names)
    size = (_WIDTH, count * _MAP + is_timed * _RATES)
    figure = Figure(figsize=size, facecolor="white", layout="constrained")
    ratios = [_MAP] * count + [_RATES] * is_timed
    panels = np.atleast_1d(figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios))
    for k, name in enumerate(schedule.names):
        grid = grid_of(problem, d, schedule.values * unit, k)
        values = np.where(np.isfinite(grid.objective), grid.objective * schedule.sign, math.nan)
        axes = panels[k]
        axes.set_facecolor(_FORBIDDEN)
        mesh = axes.pcolormesh(
            along[grid.stages], grid.values / unit[k], values.T, cmap="viridis", shading="nearest", rasterized=True
        )
        bar = figure.colorbar(mesh, ax=axes)
        bar.set_label(f"{objective_name(case).split()[-1]} at the point", color=INK)
        axes.plot(
            along, schedule.values[:, k], color=_SCHEDULE, linewidth=1.8, label="schedule", gid=f"schedule {name}"
        )
        if schedule.constant is not None:
            held = schedule.constant.values[k]
            axes.axhline(held, color=_CONSTANT, linestyle="--", linewidth=1.4, label="best constant", gid="constant")
        axes.set_ylabel(_label(name, units.label(schedule.dimensions[k])), color=INK, parse_math=False)
        axes.legend(loc="upper right", fontsize=8.5, facecolor="#dfe3e6", framealpha=0.9)
    draw_frame(panels[0], _title(case, schedule))
    panels[0].grid(visible=False)
    if is_timed:
        _draw_rates(panels[-1], schedule)
    panels[-1].set_xlabel("time, s" if is_timed else "point of the path", color=INK)
    figure.supxlabel("Grey: a limit is violated.", fontsize=8.5, color=INK, x=0.01, ha="left")
    return figure


def _label(name: str, unit: str) -> str:
    """Return the label of an axis."""
    return f"{name}, {unit}" if unit else name


def _title(case: Case, schedule: Schedule) -> str:
    """Return the objective with that of the best constant."""
    title = f"{objective_name(case)} = {schedule.value:.6g}"
    return title if schedule.constant is None else f"{title}, best constant {schedule.constant.value:.6g}"


def _draw_rates(axes: Axes, schedule: Schedule) -> None:
    """Draw the rate of each setting as steps, and its limits as dotted lines, as parts of the limit."""
    draw_grid(axes)
    seconds = np.diff(schedule.times)
    for k, name in enumerate(schedule.names):
        limit = float(schedule.rates[k])
        rates: FloatArray = np.diff(schedule.values[:, k]) / seconds
        part = rates / limit if math.isfinite(limit) else rates / (np.abs(rates).max() or 1.0)
        axes.stairs(part, schedule.times, color=_COLOURS[k % len(_COLOURS)], label=name, gid=f"rate {name}")
    for end in (-1.0, 1.0):
        axes.axhline(end, color=RED, linestyle=":", linewidth=1.0, gid="rate limit")
    axes.set_ylabel("rate / largest rate", color=INK)
    if len(schedule.names) > 1:
        axes.legend(fontsize=8.5, frameon=False)
