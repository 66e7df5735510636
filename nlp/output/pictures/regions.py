"""F over one or two varied quantities of a grid, with numbered regions that have the same active limits."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ....models import FloatArray
from ...words.designs import ColumnKind, Designs, Row
from ...words.objective import objective_label
from .canvas import INK, MUTED, draw_edges
from .curves import numbers_of
from .fonts import legible

#: Width and height of the picture without its legend, and height of a line of the legend, inches; largest number of
#: letters in a line, and of lines in an entry.
_SIZE, _LINE, _WIDE, _LINES = (7.2, 5.0), 0.155, 112, 4
#: Largest number of numbered sets of active limits, those with the most points; other sets are only outlined.
_NUMBERED = 12
#: Fraction of all points above which a further region of the same active limits is numbered too.
_LARGE = 0.02
#: Heights of numbers above a curve, as fractions of the height of the axes.
_ROWS = (0.95, 0.88)
#: Room around a number, as fractions of the width and the height of the axes, and least distance of two ticks.
_ROOM, _APART = (0.045, 0.06), 0.115


def regions_legend(designs: Designs[Row]) -> list[str]:
    """Return the legend: the meaning of the lines, and the active limits of each numbered region."""
    F, active = _answers(designs)
    has_gaps = not np.isfinite(F).all()
    names = [name for name, _ in _counted(F, active)]
    lines = [
        "Lines: changes of the active limits. Empty: no optimum."
        if has_gaps
        else "Lines: changes of the active limits."
    ]
    sets = [name.split("; ") if name else [] for name in names[:_NUMBERED]]
    everywhere = [side for side in sets[0] if all(side in each for each in sets)] if len(names) > 1 else []
    lines += [f"Active in all regions: {_grouped(everywhere)}"] if everywhere else []
    also, other = ("also ", "other ") if everywhere else ("", "")
    for k, each in enumerate(sets, start=1):
        rest = [side for side in each if side not in everywhere]
        lines.append(f"{k}: {also}{_grouped(rest)}" if rest else f"{k}: no {other}active limit")
    if len(names) > _NUMBERED:
        lines.append(f"Without a number: {len(names) - _NUMBERED} further sets of active limits")
    return lines


def _answers(designs: Designs[Row]) -> tuple[FloatArray, list[str]]:
    """Return F (n,), NaN without an optimum, and the active sides of each row as one text."""
    ((objective,), (active,)) = (designs.of_kind(kind) for kind in (ColumnKind.OBJECTIVE, ColumnKind.ACTIVE))
    return numbers_of(objective, designs.rows), [str(active.cell(row) or "") for row in designs.rows]


def _counted(F: FloatArray, active: Sequence[str]) -> list[tuple[str, int]]:
    """Return the sets of active limits with their numbers of points, in descending order."""
    return Counter(sorted(each for value, each in zip(F, active, strict=True) if np.isfinite(value))).most_common()


def regions_figure(designs: Designs[Row], legend: Sequence[str]) -> Figure:
    """Return F over one or two varied quantities as a Matplotlib figure, with sentences below it.

    Args:
        designs: table of designs on a grid.
        legend: sentences below the chart, such as those of :func:`regions_legend`.
    """
    axis_of = {
        column: np.array(list(dict.fromkeys(numbers_of(column, designs.rows))))
        for column in designs.of_kind(ColumnKind.VARIED)
    }
    changing = [(column.axis, axis) for column, axis in axis_of.items() if len(axis) > 1]
    shape = tuple(len(axis) for _, axis in changing)
    values, active = _answers(designs)
    names = [name for name, _ in _counted(values, active)]
    F = values.reshape(shape)
    sets = np.array(
        [names.index(each) if np.isfinite(value) else -1 for value, each in zip(values, active, strict=True)]
    )
    sets = sets.reshape(shape)
    lines = [
        line
        for text in legend
        for line in textwrap.wrap(text, _WIDE, max_lines=_LINES, placeholder=" …", subsequent_indent="    ")
    ]
    size = (_SIZE[0], _SIZE[1] + _LINE * len(lines))
    figure = Figure(figsize=size, facecolor="white", layout="constrained")
    axes, label = figure.add_subplot(), objective_label(designs.case)
    if len(changing) == 1:
        _draw_curve(axes, changing[0][1], F, sets, label)
    else:
        _draw_map(figure, axes, [axis for _, axis in changing], F, sets, label)
        axes.set_ylabel(legible(changing[1][0]), color=INK, parse_math=False)
    axes.set_xlabel(legible(changing[0][0]), color=INK, parse_math=False)
    draw_edges(axes)
    title = "\n".join(textwrap.wrap(designs.title, 70, max_lines=2, placeholder=" …"))
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)
    if lines:
        figure.supxlabel(legible("\n".join(lines)), fontsize=8.5, color=INK, x=0.01, ha="left", parse_math=False)
    return figure


def _grouped(sides: Sequence[str]) -> str:
    """Return active sides grouped by limit, such as ``leg_length max (limb 1, limb 2)``."""
    groups: dict[str, list[str]] = {}
    for side in sides:
        key, *parts, end = side.split(" ")
        groups.setdefault(f"{key} {end}", []).extend([" ".join(parts)] if parts else [])
    return ", ".join(f"{key} ({', '.join(parts)})" if parts else key for key, parts in groups.items())


def _draw_curve(axes: Axes, x: FloatArray, F: FloatArray, sets: NDArray[np.intp], label: str) -> None:
    """Draw F over one varied quantity, with lines at changes of the active set, and the numbers of the regions."""
    by_x = np.argsort(x)
    x, F, sets = x[by_x], F[by_x], sets[by_x]
    axes.plot(x, F, color="#08519c", linewidth=1.4, marker="o", markersize=3 if len(x) <= 100 else 0, gid="F")
    changes = np.flatnonzero(np.diff(sets)) + 1
    for k in changes:
        axes.axvline((x[k - 1] + x[k]) / 2, color=MUTED, linewidth=0.8, gid="region")
    # Numbers are above the curve.
    axes.margins(y=0.2)
    spans = [(first, last) for first, last in pairwise([0, *changes.tolist(), len(x)]) if sets[first] >= 0]
    rows: list[list[float]] = [[] for _ in _ROWS]
    for first, last in sorted(spans, key=lambda span: span[0] - span[1]):
        at, number = float(x[first] + x[last - 1]) / 2, int(sets[first])
        for row, places in zip(_ROWS, rows, strict=True):
            if number < _NUMBERED and all(abs(at - other) >= _ROOM[0] * (x[-1] - x[0]) for other in places):
                places.append(at)
                _write_number(axes, number, at, row, is_on_top=True)
                break
    axes.set_ylabel(label, color=INK, parse_math=False)
    axes.grid(color="#e3e6e8", linewidth=0.7)
    axes.ticklabel_format(useOffset=False)
    axes.set_xticks(*_ticks(x))


def _draw_map(
    figure: Figure,
    axes: Axes,
    at: Sequence[FloatArray],
    F: FloatArray,
    sets: NDArray[np.intp],
    label: str,
) -> None:
    """Draw F over two varied quantities in colours, one cell per point; lines divide regions of active limits."""
    sorting = [np.argsort(axis) for axis in at]
    F, sets = F[np.ix_(*sorting)], sets[np.ix_(*sorting)]
    x, y = (_edges(axis[by_value]) for axis, by_value in zip(at, sorting, strict=True))
    mesh = axes.pcolormesh(x, y, np.ma.masked_invalid(F.T), cmap="viridis", gid="F")
    bar = figure.colorbar(mesh, ax=axes)
    bar.set_label(label, color=INK, parse_math=False)
    bar.ax.ticklabel_format(useOffset=False)
    lines = [[(x[i + 1], y[j]), (x[i + 1], y[j + 1])] for i, j in zip(*np.nonzero(np.diff(sets, axis=0)), strict=True)]
    lines += [[(x[i], y[j + 1]), (x[i + 1], y[j + 1])] for i, j in zip(*np.nonzero(np.diff(sets, axis=1)), strict=True)]
    # Dark with a light edge: visible on every colour.
    axes.add_collection(LineCollection(lines, colors="white", linewidths=2.8, capstyle="projecting", gid="region edge"))
    axes.add_collection(LineCollection(lines, colors=INK, linewidths=1.2, capstyle="projecting", gid="region"))
    middles = np.stack(np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2, indexing="ij"), axis=-1)
    room = np.array(_ROOM) * [np.ptp(x), np.ptp(y)]
    places: list[FloatArray] = []
    for region in _regions(sets):
        # The deepest cell of the region without a number of another region.
        for cell in region:
            place = middles[tuple(cell)]
            if all((np.abs(place - other) >= room).any() for other in places):
                places.append(place)
                _write_number(axes, int(sets[tuple(cell)]), *place)
                break
    axes.set_xticks(*_ticks(at[0]))
    axes.set_yticks(*_ticks(at[1]))


def _write_number(axes: Axes, place: int, x: float, y: float, *, is_on_top: bool = False) -> None:
    """Write the number of a region on a white disc; with ``is_on_top``, ``y`` is a fraction of the height."""
    disc = {"boxstyle": "circle,pad=0.22", "facecolor": "white", "edgecolor": INK, "linewidth": 0.8}
    where = axes.get_xaxis_transform() if is_on_top else axes.transData
    style = {"fontsize": 8, "color": INK, "ha": "center", "va": "center", "gid": "number"}
    axes.text(x, y, str(place + 1), transform=where, bbox=disc, zorder=10, **style)  # type: ignore[arg-type]


def _regions(sets: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Return the cells (k, 2) of each region that shows a number, farthest from the region's edge first.

    The number of a set of active limits is shown in the largest region of the set, and in its other large regions.

    Args:
        sets: (n, m) index of the set of active limits of each cell; -1 for none.
    """
    found: list[NDArray[np.intp]] = []
    for index in range(min(int(sets.max()) + 1, _NUMBERED)):
        left, parts = sets == index, []
        while left.any():
            part = np.zeros_like(left)
            part[tuple(np.argwhere(left)[0])] = True
            while (grown := _spread(part) & left).sum() > part.sum():
                part = grown
            left &= ~part
            parts.append(part)
        parts.sort(key=lambda part: -int(part.sum()))
        found += [_inwards(part) for k, part in enumerate(parts) if k == 0 or part.sum() >= _LARGE * sets.size]
    return found


def _spread(part: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a region (n, m) with its neighbours on four sides."""
    wide = np.pad(part, 1)
    return wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]


def _inwards(part: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the cells (k, 2) of a region (n, m), ordered by descending distance from the edge."""
    depth, inner = np.zeros(part.shape), part
    while inner.any():
        depth += inner
        inner = ~_spread(~np.pad(inner, 1))[1:-1, 1:-1]
    cells = np.argwhere(part)
    # Of equally deep cells, the nearest to their centre.
    deepest = cells[depth[tuple(cells.T)] == depth.max()].mean(axis=0)
    return cells[np.lexsort([np.linalg.norm(cells - deepest, axis=1), -depth[tuple(cells.T)]])]


def _ticks(values: FloatArray) -> tuple[list[float], list[str]]:
    """Return the varied values with a tick, at sufficient distances, and their texts."""
    ticks: list[float] = []
    for value in sorted(values.tolist()):
        if not ticks or value - ticks[-1] >= _APART * (np.max(values) - np.min(values)):
            ticks.append(value)
    return ticks, [f"{value:.5g}" for value in ticks]


def _edges(values: FloatArray) -> FloatArray:
    """Return the edges (n + 1,) of cells around ascending values (n,)."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
