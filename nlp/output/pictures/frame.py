"""Frame and title of a picture with curves, the same for all of them."""

from __future__ import annotations

import textwrap

from matplotlib.axes import Axes

from .canvas import INK, MUTED


def draw_frame(axes: Axes, title: str) -> None:
    """Draw grid, ticks and edges of axes, and a title of at most two lines."""
    axes.grid(color="#e3e6e8", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=9)
    for spine in axes.spines.values():
        spine.set_edgecolor(MUTED)
    axes.ticklabel_format(useOffset=False)
    lines = textwrap.wrap(title, 66, max_lines=2, placeholder=" …")
    axes.set_title("\n".join(lines), loc="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)
