"""The outline of a plate through the joints on it: the corners of their convex hull, in order around it."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray

#: Points nearer to each other, or to an edge, than this part of the plate's size are one, or on the edge.
_NEAR = 1e-9


def outline(points: FloatArray) -> list[int]:
    """Return the indices of the corners of the convex hull of points (n, 3) in their plane of least squares.

    Points on a line have two corners, its ends; points at one place have one.
    """
    middle = points - points.mean(axis=0)
    size = float(np.abs(middle).max(initial=0.0))
    if size == 0.0:
        return [0]
    _, extents, axes = np.linalg.svd(middle)
    flat = middle @ axes[:2].T
    order = sorted(range(len(points)), key=lambda k: (flat[k, 0], flat[k, 1]))
    if len(extents) < 2 or extents[1] <= _NEAR * extents[0]:
        return [order[0], order[-1]]
    # Andrew's monotone chain: both halves turn left at every corner.
    halves = []
    for way in (order, order[::-1]):
        half: list[int] = []
        for k in way:
            while len(half) > 1 and _turn(flat[half[-2]], flat[half[-1]], flat[k]) <= _NEAR * size**2:
                half.pop()
            half.append(k)
        halves.append(half[:-1])
    return halves[0] + halves[1]


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Return twice the area of a triangle, positive where its corners turn left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
