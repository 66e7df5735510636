"""Straight lines in the plane that meet a box or each other, and points near them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ....models import FloatArray

BoolArray = npt.NDArray[np.bool_]


def segments_in_box(segments: FloatArray, box: tuple[float, ...]) -> BoolArray:
    """Return for each line whether a part of it is within a box, (k,).

    Liang and Barsky: the line ``a + t (b - a)`` is within one pair of sides for an interval of ``t``, and within the
    box where both intervals and ``0 <= t <= 1`` have a point in common.

    Args:
        segments: (k, 4) ends of the lines.
        box: left, bottom, right, top.
    """
    if not len(segments):
        return np.zeros(0, dtype=np.bool_)
    low, high = np.zeros(len(segments)), np.ones(len(segments))
    for axis in range(2):
        start, way = segments[:, axis], segments[:, 2 + axis] - segments[:, axis]
        near, far = box[axis] - start, box[2 + axis] - start
        level = np.abs(way) < 1e-12
        safe = np.where(level, 1.0, way)
        first, last = np.minimum(near / safe, far / safe), np.maximum(near / safe, far / safe)
        beside = level & ((near > 0) | (far < 0))
        low = np.maximum(low, np.where(level, 0.0, first))
        high = np.minimum(high, np.where(level, 1.0, last))
        high = np.where(beside, -1.0, high)
    return np.asarray(low <= high)


def segments_cross(segments: FloatArray, line: FloatArray) -> BoolArray:
    """Return for each of the lines (k, 4) whether it crosses another line (4,), (k,)."""
    if not len(segments):
        return np.zeros(0, dtype=np.bool_)
    a, b = segments[:, :2], segments[:, 2:]
    c, d = line[:2], line[2:]

    def side(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
        u, v = q - p, r - p
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    one = side(a, b, c) * side(a, b, d)
    other = side(c, d, a) * side(c, d, b)
    return np.asarray((one < 0) & (other < 0))


def distances_to_segment(points: FloatArray, line: FloatArray) -> FloatArray:
    """Return the distance of each point (k, 2) from a straight line between its ends (4,), (k,)."""
    start, way = line[:2], line[2:] - line[:2]
    square = float(way @ way)
    part = np.clip((points - start) @ way / square, 0.0, 1.0) if square else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - np.outer(part, way), axis=1))
