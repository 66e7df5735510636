"""Pictures of the slices of a workspace."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from ....models import Dimension, FloatArray
from ...case.case import Case
from ...workspace.slices import Region, Slice
from .canvas import INK, MUTED
from .figures import picture_of

#: Width and height of one slice, inches.
_SIZE = (3.2, 3.3)
_COLUMNS = 3
_COLOURS = {Region.REGULAR: "#a9d2ae", Region.BEYOND: "#b34700", Region.OPEN: "#e8c35a"}


def slices_picture(case: Case, slices: Sequence[Slice], ending: str) -> bytes:
    """Return the content of a picture file of a workspace's slices.

    Args:
        case: the case.
        slices: of its workspace.
        ending: ``.png``, ``.svg`` or ``.pdf``.
    """
    return picture_of(lambda: slices_figure(case, slices), ending)


def slices_figure(case: Case, slices: Sequence[Slice]) -> Figure:
    """Return the slices as a Matplotlib figure; the boxes of each region carry its name as ``gid``."""
    columns = min(_COLUMNS, len(slices))
    rows = -(-len(slices) // columns)
    figure = Figure(figsize=(_SIZE[0] * columns, _SIZE[1] * rows + 0.6), facecolor="white", layout="constrained")
    for k, each in enumerate(slices):
        axes = figure.add_subplot(rows, columns, k + 1)
        for region, colour in _COLOURS.items():
            chosen = [box for box, own in zip(each.boxes, each.regions, strict=True) if own is region]
            if chosen:
                outlines = [_outline(case, each, box) for box in chosen]
                axes.add_collection(
                    PolyCollection(outlines, facecolors=colour, edgecolors=colour, linewidths=0.2, gid=region.value)
                )
        low, high = (_shown(case, each, end) for end in each.whole)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        inner, outer = (_shown(case, each, end) for end in each.workspace)
        axes.add_patch(
            Rectangle((inner[0], inner[1]), *(outer - inner), fill=False, edgecolor=INK, linewidth=1.2, gid="workspace")
        )
        dimensions = [Dimension.ANGLE if is_angle else Dimension.LENGTH for is_angle in each.are_angles]
        labels = [f"{name}, {case.units.label(part)}" for name, part in zip(each.names, dimensions, strict=True)]
        axes.set_xlabel(labels[0], color=INK, parse_math=False)
        axes.set_ylabel(labels[1], color=INK, parse_math=False)
        axes.tick_params(colors=INK, labelsize=8)
        for spine in axes.spines.values():
            spine.set_edgecolor(MUTED)
    title = "\n".join(textwrap.wrap(case.title or case.name, 70, max_lines=2, placeholder=" …"))
    figure.suptitle(f"{title}: slices through the middle of the workspace", fontsize=10, color=INK, parse_math=False)
    handles = [Patch(facecolor=colour, label=region.value) for region, colour in _COLOURS.items()]
    handles.append(Patch(facecolor="none", edgecolor=INK, label="workspace"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    return figure


def _shown(case: Case, each: Slice, point: FloatArray) -> FloatArray:
    """Return a point (2,) of a slice in the case's units."""
    parts = zip(point, each.are_angles, strict=True)
    return np.array([case.units.shown(float(v), Dimension.ANGLE if a else Dimension.LENGTH) for v, a in parts])


def _outline(case: Case, each: Slice, box: FloatArray) -> FloatArray:
    """Return the corners (4, 2) of a box in the case's units."""
    (a, b), (c, d) = _shown(case, each, box[:2]), _shown(case, each, box[2:])
    return np.array([[a, b], [c, b], [c, d], [a, d]])
