"""Pictures of trade-off curves: F over a number of the case, one mark for each solve."""

from __future__ import annotations

import math
import textwrap

from matplotlib.figure import Figure

from ...case.case import Case
from ...results.tradeoff import TradeoffResult
from ...results.tradeoffwording import objective_label, tradeoff_words
from .canvas import INK, RED
from .figures import picture_of
from .frame import draw_frame

#: Width and height of the picture, inches.
_SIZE = (7.2, 4.6)
#: A colour and a mark for each task; more tasks begin again.
_LOOKS = (("#08519c", "o"), ("#b34700", "s"), ("#3f86c4", "^"), ("#e08a3c", "D"))


def tradeoff_picture(case: Case, result: TradeoffResult, ending: str) -> bytes:
    """Return the content of a picture file of a trade-off.

    Args:
        case: the case.
        result: its trade-off.
        ending: ``.png``, ``.svg`` or ``.pdf``.
    """
    return picture_of(lambda: tradeoff_figure(case, result), ending)


def tradeoff_figure(case: Case, result: TradeoffResult) -> Figure:
    """Return F over the number as a Matplotlib figure; the line of each task carries ``F`` and its name as ``gid``."""
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    values = [point.value for point in result.points]
    several = len(result.tasks) > 1
    for k, name in enumerate(result.tasks):
        colour, mark = _LOOKS[k % len(_LOOKS)]
        F = [math.nan if point.tasks[k] is None else point.tasks[k] for point in result.points]
        label = name if several else None
        axes.plot(values, F, color=colour, marker=mark, markersize=4.5, linewidth=1.4, label=label, gid=f"F {name}")  # type: ignore[arg-type]
    missing = [point.value for point in result.points if not point.status.is_answer]
    for value in missing:
        axes.axvline(value, color=RED, linewidth=0.8, linestyle=":", gid="no answer")
    axes.set_xlabel(f"{result.over}, {result.unit}" if result.unit else result.over, color=INK, parse_math=False)
    axes.set_ylabel(objective_label(case), color=INK, parse_math=False)
    draw_frame(axes, case.title or case.name)
    axes.margins(x=0.03)
    if several:
        for text in axes.legend(frameon=False, fontsize=9).get_texts():
            text.set_parse_math(False)
    words = tradeoff_words(result)
    if words:
        note = "\n".join(textwrap.wrap(f"Dotted: {'; '.join(words)}.", 95, max_lines=3, placeholder=" …"))
        figure.supxlabel(note, fontsize=8.5, color=RED, x=0.01, ha="left", parse_math=False)
    return figure
