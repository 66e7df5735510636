"""Symbols of joints in pictures: a mark for each kind, filled if actuated, and strokes for the axes."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from matplotlib.lines import Line2D

from ....models import Body, JointKind
from .canvas import INK, Canvas
from .drawing import Drawing

#: Half of the length of the stroke of an axis, as a fraction of the robot's size.
_STROKE = 0.06


class _Look(NamedTuple):
    """Marks of a kind of joint: Matplotlib symbol and size in points, inner symbol, and whether axes are shown."""

    mark: str
    size: float
    inner: str = ""
    inner_size: float = 0.0
    has_axes: bool = True


_LOOKS = {
    JointKind.PRISMATIC: _Look("s", 10.0, has_axes=False),
    JointKind.CYLINDRICAL: _Look("s", 10.0, "o", 5.0),
    JointKind.SPHERICAL: _Look("o", 9.0, "o", 3.2, has_axes=False),
    JointKind.HELICAL: _Look("h", 9.0),
    JointKind.REVOLUTE: _Look("o", 7.0),
    JointKind.UNIVERSAL: _Look("D", 6.2),
    JointKind.PARALLELOGRAM: _Look("o", 3.6, has_axes=False),
}


def paint_joint_symbols(canvas: Canvas, drawing: Drawing) -> None:
    """Paint the symbol of every joint, with larger symbols below smaller ones at the same position."""
    joints = zip(drawing.model.scene.joints, drawing.posture.joints, strict=True)
    for order, (joint, (place, *axes)) in enumerate(sorted(joints, key=lambda each: -_LOOKS[each[0].kind].size)):
        look = _LOOKS[joint.kind]
        at = (45 if joint.body is Body.PLATFORM else 31) + order / 1000
        if look.has_axes:
            for axis in axes:
                ends = place + np.outer([-_STROKE, _STROKE], axis) * drawing.size
                canvas.line(ends, f"joint axis {joint.name}", color=INK, linewidth=1.4, zorder=at)
        face = INK if joint.is_actuated else "white"
        canvas.marker(
            place,
            f"joint {joint.name}",
            symbol=look.mark,
            markersize=look.size,
            markerfacecolor=face,
            markeredgecolor=INK,
            markeredgewidth=1.2,
            zorder=at,
        )
        if look.inner:
            canvas.marker(
                place, f"joint inner {joint.name}", symbol=look.inner, markersize=look.inner_size, color=INK, zorder=at
            )


#: Handles of one entry of a legend, drawn over each other.
Handles: TypeAlias = tuple[Line2D, ...]


def symbol_legend(drawing: Drawing) -> list[tuple[Handles, str]]:
    """Return handles and a text for each kind of joint of a drawing, and for actuated joints."""
    joints = drawing.model.scene.joints
    found: list[tuple[Handles, str]] = []
    for kind, look in ((kind, _LOOKS[kind]) for kind in JointKind if any(each.kind is kind for each in joints)):
        marks = [_mark(look.mark, 0.85 * look.size, "white")]
        if look.inner:
            marks.append(_mark(look.inner, 0.85 * look.inner_size, INK))
        found.append((tuple(marks), f"{kind.words} ({kind.value})"))
    if any(each.is_actuated for each in joints):
        found.append(((_mark("s", 6.0, INK),), "filled: actuated"))
    return found


def _mark(symbol: str, size: float, face: str) -> Line2D:
    """Return a mark of a legend."""
    return Line2D([], [], linestyle="none", marker=symbol, markersize=size, markerfacecolor=face, markeredgecolor=INK)
