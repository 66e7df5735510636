"""Line segments in a picture: segments within boxes, segments that cross, and distances of points from segments.

All functions compare all pairs at once. A label has up to a thousand candidate positions, and a picture some hundred
segments: with one call of NumPy per position, the placement of labels would take most of the time of a picture.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ....models import FloatArray

BoolArray = npt.NDArray[np.bool_]

#: Component of a segment, in pixels, below which the segment is parallel to an axis.
_LEVEL = 1e-12
#: Distance between segment and box, in pixels, above which no exact test is needed; far above rounding errors.
_CLEAR = 1.0


def segments_in_boxes(segments: FloatArray, boxes: FloatArray) -> BoolArray:
    """Return whether a part of each segment is within each box, (n, k).

    Args:
        segments: (k, 4) ends of the segments.
        boxes: (n, 4) left, bottom, right, top of each box.
    """
    a, b = segments.T[:2], segments.T[2:]
    (low_x, low_y), (high_x, high_y) = np.minimum(a, b) - _CLEAR, np.maximum(a, b) + _CLEAR
    left, bottom, right, top = boxes.T[:, :, None]
    within = (high_x >= left) & (low_x <= right) & (high_y >= bottom) & (low_y <= top)
    # Few segments are near a box, and the exact test takes several times as long as this one.
    box, segment = np.nonzero(within)
    within[box, segment] = _in_box(segments[segment], boxes[box])
    return np.asarray(within)


def _in_box(segments: FloatArray, boxes: FloatArray) -> BoolArray:
    """Return whether a part of each segment (m, 4) is within the box of the same index, (m, 4); (m,).

    Liang and Barsky: the segment ``a + t (b - a)`` is within one pair of sides for an interval of ``t``, and within the
    box where both intervals and ``0 <= t <= 1`` have a point in common.
    """
    start, end = segments.T[:2], segments.T[2:]
    way = end - start
    near, far = boxes.T[:2] - start, boxes.T[2:] - start
    level = np.abs(way) < _LEVEL
    safe = np.where(level, 1.0, way)
    one, other = near / safe, far / safe
    first, last = np.where(level, 0.0, np.minimum(one, other)), np.where(level, 1.0, np.maximum(one, other))
    beside = level & ((near > 0) | (far < 0))
    low = np.maximum(np.maximum(first[0], first[1]), 0.0)
    high = np.minimum(np.minimum(last[0], last[1]), 1.0)
    return np.asarray((low <= high) & ~(beside[0] | beside[1]))


def segments_cross(segments: FloatArray, lines: FloatArray) -> BoolArray:
    """Return whether each line (n, 4) crosses each segment (k, 4), (n, k)."""
    a, b = segments.T[:2, None], segments.T[2:, None]
    c, d = lines.T[:2, :, None], lines.T[2:, :, None]
    one = _side(a, b, c) * _side(a, b, d)
    other = _side(c, d, a) * _side(c, d, b)
    return np.asarray((one < 0) & (other < 0))


def _side(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """Return the side of the line from p to q on which the point r lies, as a sign; x and y along the first axis."""
    u, v = q - p, r - p
    return np.asarray(u[0] * v[1] - u[1] * v[0])


def distances_to_segments(points: FloatArray, lines: FloatArray) -> FloatArray:
    """Return the distance of each point (k, 2) from each segment (n, 4), (n, k); segments have positive lengths."""
    start = lines.T[:2, :, None]
    way = lines.T[2:, :, None] - start
    off = points.T[:, None, :] - start
    part = np.clip((off[0] * way[0] + off[1] * way[1]) / (way[0] * way[0] + way[1] * way[1]), 0.0, 1.0)
    rest = off - part * way
    return np.asarray(np.sqrt(rest[0] * rest[0] + rest[1] * rest[1]))
