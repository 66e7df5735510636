"""F* of a sweep over one or two numbers, with the regions of equal active limits outlined."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from ....models import FloatArray
from ...case.case import Case
from ...errors import InputError
from ...program.formulation import formulate_each
from ...results.design import limits_data, margins_data
from ...results.objective import objective_label
from ...results.parts import LimitData
from ...results.tradeoff import unit_of_number
from ...sweeps.points import Points
from ..sweeptable import TablePoint
from .canvas import INK, MUTED, draw_edges
from .fonts import legible

_SIZE = (7.2, 5.0)
#: Names of at most as many regions are written, each of at least this part of the points; others are outlined only.
_NAMED = 12
_LARGE = 0.04


def check_axes(points: Points) -> None:
    """Refuse a picture of a sweep that is no grid over one or two numbers.

    Raises:
        InputError: it is none.
    """
    changing = [axis for axis in points.axes if len(axis) > 1]
    if not 1 <= len(changing) <= 2:
        fault = f"{len(changing)} numbers change on a grid" if points.axes else "the points are rows of a file"
        raise InputError(f"--plot: draws F over one or two numbers of --over, and {fault}")


def sweep_figure(case: Case, points: Points, found: Sequence[TablePoint]) -> Figure:
    """Return F over one or two numbers as a Matplotlib figure.

    Args:
        case: the case, for the title and the unit of F.
        points: a grid over one or two numbers.
        found: objective and active sides at each point.
    """
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    changing = [(name, axis) for name, axis in zip(points.names, points.axes, strict=True) if len(axis) > 1]
    shape = tuple(len(axis) for _, axis in changing)
    F = np.array([each.F for each in found]).reshape(shape)
    names = sorted({each.active for each in found if np.isfinite(each.F)})
    sets = np.array([names.index(each.active) if np.isfinite(each.F) else -1 for each in found]).reshape(shape)
    if len(changing) == 1:
        _draw_curve(axes, changing[0][1], F, sets, names, objective_label(case))
    else:
        _draw_map(figure, axes, [axis for _, axis in changing], F, sets, names, objective_label(case))
        axes.set_ylabel(_label(case, changing[1][0]), color=INK, parse_math=False)
    axes.set_xlabel(_label(case, changing[0][0]), color=INK, parse_math=False)
    draw_edges(axes)
    title = "\n".join(textwrap.wrap(case.title or case.name, 70, max_lines=2, placeholder=" …"))
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)
    note = (
        "Lines: the active limits change. Empty: no answer."
        if np.isnan(F).any()
        else "Lines: the active limits change."
    )
    figure.supxlabel(note, fontsize=8.5, color=MUTED, x=0.01, ha="left")
    return figure


def _label(case: Case, name: str) -> str:
    """Return the name of a case's number with its unit, for an axis."""
    limits: Sequence[LimitData] = ()
    if name.startswith("limits."):
        nlp = formulate_each(case)[0]
        limits = limits_data(margins_data(nlp, nlp.start, optimal=False))
    unit = unit_of_number(name, case, limits)
    return legible(f"{name}, {unit}" if unit else name)


def _draw_curve(axes: Axes, x: FloatArray, F: FloatArray, sets: FloatArray, names: Sequence[str], label: str) -> None:
    """Draw F over one number, with a line between neighbours whose active sets differ."""
    axes.plot(x, F, color="#08519c", linewidth=1.4, marker="o", markersize=3 if len(x) <= 100 else 0, gid="F")
    ends = np.flatnonzero(np.diff(sets))
    for k in ends:
        axes.axvline((x[k] + x[k + 1]) / 2, color=MUTED, linewidth=0.8, gid="region")
    starts = [0, *(ends + 1).tolist()]
    for first, last in zip(starts, [*(ends + 1).tolist(), len(x)], strict=True):
        if len(starts) <= _NAMED and last - first >= _LARGE * len(x) and sets[first] >= 0:
            middle = (x[first] + x[last - 1]) / 2
            text = names[int(sets[first])].replace("; ", "\n") or "none active"
            place = axes.get_xaxis_transform()
            axes.text(
                middle,
                0.02,
                text,
                transform=place,
                fontsize=7.5,
                color=MUTED,
                ha="center",
                va="bottom",
                parse_math=False,
            )
    axes.set_ylabel(label, color=INK, parse_math=False)
    axes.grid(color="#e3e6e8", linewidth=0.7)
    axes.ticklabel_format(useOffset=False)


def _draw_map(
    figure: Figure,
    axes: Axes,
    at: Sequence[FloatArray],
    F: FloatArray,
    sets: FloatArray,
    names: Sequence[str],
    label: str,
) -> None:
    """Draw F over two numbers in colours, one cell a point, with a line between cells whose active sets differ."""
    orders = [np.argsort(axis) for axis in at]
    F, sets = F[np.ix_(*orders)], sets[np.ix_(*orders)]
    x, y = (_edges(axis[order]) for axis, order in zip(at, orders, strict=True))
    mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(F.T), cmap="viridis", gid="F")
    bar = figure.colorbar(mesh, ax=axes)
    bar.set_label(label, color=INK, parse_math=False)
    lines = [[(x[i + 1], y[j]), (x[i + 1], y[j + 1])] for i, j in zip(*np.nonzero(np.diff(sets, axis=0)), strict=True)]
    lines += [[(x[i], y[j + 1]), (x[i + 1], y[j + 1])] for i, j in zip(*np.nonzero(np.diff(sets, axis=1)), strict=True)]
    axes.add_collection(LineCollection(lines, colors="white", linewidths=1.2, gid="region"))
    for k, name in enumerate(names):
        i, j = np.nonzero(sets == k)
        if len(names) > _NAMED or len(i) < _LARGE * sets.size:
            continue
        nearest = int(np.argmin((i - np.median(i)) ** 2 + (j - np.median(j)) ** 2))
        i, j = i[nearest], j[nearest]
        text = name.replace("; ", "\n") or "none active"
        place = (x[i] + x[i + 1]) / 2, (y[j] + y[j + 1]) / 2
        axes.text(*place, text, fontsize=7, color="white", ha="center", va="center", parse_math=False)


def _edges(values: FloatArray) -> FloatArray:
    """Return the edges (n + 1,) of cells around ascending values (n,)."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
