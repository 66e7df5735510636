"""Division of the segments of a path at given points, so that settings can have values there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from .options import Between
from .orientation import quaternions_from_angles, roll_pitch_yaw, shortest_turns, turned
from .path import Kind, ProgrammedPath
from .sampling import Points

if TYPE_CHECKING:
    from numpy.typing import NDArray


def divided_path(path: ProgrammedPath, points: Points) -> ProgrammedPath:
    """Return a path whose knots are given points of it; the motion is the same.

    Args:
        path: the path, without settings.
        points: points in order: the beginning of each segment, points inside, and the end of the path.
    """
    segments, begin = points.segments[:-1], points.parameters[:-1]
    end = np.where(points.segments[1:] == segments, points.parameters[1:], 1.0)
    part, last = end - begin, len(path) - 1
    arcs = np.zeros((0, 6))
    on_arcs = np.flatnonzero(path.kinds[segments] == Kind.ARC)
    rows = np.searchsorted(path.arc_segments, segments[on_arcs])
    if on_arcs.size:
        arcs = path.arcs[rows].copy()
        arcs[:, 2] += begin[on_arcs] * arcs[:, 3]
        arcs[:, 4] += begin[on_arcs] * arcs[:, 5]
        arcs[:, [3, 5]] *= part[on_arcs, None]
    return replace(
        path,
        knots=np.vstack([_knots(path, segments, begin), path.knots[last + 1 :]]),
        lines=path.lines[segments],
        kinds=path.kinds[segments],
        durations=path.durations[segments] * part,
        arcs=arcs,
        planes=path.planes[rows],
    )


def _knots(path: ProgrammedPath, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
    """Return positions and angles (k, 6) at points of segments, in the path's frame."""
    k = segments
    start, finish = path.knots[k], path.knots[k + 1]
    found = start + s[:, None] * (finish - start)
    inside = np.flatnonzero(s > 0)
    own = replace(path, frame=None, tool=None)
    found[inside, :3] = own.poses_at(k[inside], s[inside]).positions
    if path.between is Between.SLERP and inside.size:
        first, last = (quaternions_from_angles(each[inside, 3:], path.order) for each in (start, finish))
        axes, angles = shortest_turns(first, last)
        found[inside, 3:] = roll_pitch_yaw(turned(first, axes, s[inside] * angles))
    return np.asarray(found)
