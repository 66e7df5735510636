"""Points of a path at which F and limits are taken while settings change: poses, feed directions, times and weights.

The points are the knots of the path, and points between in its longer segments. The feed direction at a point is the
mean of the directions of the adjacent segments, which is the tangent where a table approximates a smooth curve. Where
the path turns back, it is the direction of the segment before.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ..errors import InputError
from .path import ProgrammedPath
from .sampling import Points, twists_at
from .standing import STILL, rest_length, turns_between

#: Smallest number of segments of a path with long segments.
LEAST = 200


class Waypoints(NamedTuple):
    """N points of a path.

    Attributes:
        points: segment and path parameter of each point.
        positions: (N, 3) origin of the platform frame in the world frame, length.
        rotations: (N, 3, 3) rotation matrices from platform to world coordinates, without a turn about the tool.
        feeds: (N, 3) unit vectors of the feed; 0 where the platform only rotates or rests.
        seconds: (N - 1,) time from each point to the next; NaN without a stated time.
        weights: (N,) weights of the points, with sum 1: the mean time of the adjacent segments, or their mean length if
            a time is not stated.
    """

    points: Points
    positions: FloatArray
    rotations: FloatArray
    feeds: FloatArray
    seconds: FloatArray
    weights: FloatArray

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def times(self) -> FloatArray:
        """Times (N,) of the points, seconds; NaN after a segment without a stated time."""
        return np.concatenate([[0.0], np.cumsum(self.seconds)])


def with_places(path: ProgrammedPath, points: Waypoints, places: FloatArray) -> Waypoints:
    """Return points of a path together with further places.

    Args:
        path: the path.
        points: points of the path.
        places: (k, 2) segment and path parameter of each further place.
    """
    own = np.stack(points.points, axis=1)
    # The last point is the end of the last segment.
    every = np.unique(np.vstack([own, places]), axis=0)
    return _at_points(path, Points(every[:, 0].astype(np.intp), every[:, 1]))


def waypoints(path: ProgrammedPath, least: int = LEAST) -> Waypoints:
    """Return the points of a path at which settings have values.

    Args:
        path: the path.
        least: number of segments of equal size into which the whole path is divided if its segments are longer.

    Raises:
        InputError: the path has fewer than two points.
    """
    sizes = _sizes(path)
    total = float(sizes.sum())
    pieces = np.maximum(np.floor(sizes / total * least), 1).astype(int) if total > 0 else np.ones(len(path), dtype=int)
    segments = np.repeat(np.arange(len(path)), pieces)
    inside = np.arange(len(segments)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    parameters = inside / np.repeat(pieces, pieces)
    if len(segments) < 1:
        raise InputError(f"{path.source}: there is no path: fewer than two points")
    ends = Points(np.append(segments, len(path) - 1).astype(np.intp), np.append(parameters, 1.0))
    return _at_points(path, ends)


def _at_points(path: ProgrammedPath, points: Points) -> Waypoints:
    """Return poses, feeds, times and weights at points of a path: the beginnings of segments, and points inside."""
    segments = points.segments[:-1]
    end = np.where(points.segments[1:] == segments, points.parameters[1:], 1.0)
    part, sizes = end - points.parameters[:-1], _sizes(path)
    poses = path.poses_at(points.segments, points.parameters)
    seconds = path.durations[segments] * part
    steps = seconds if np.isfinite(seconds).all() and seconds.sum() > 0 else sizes[segments] * part
    if not steps.sum() > 0:
        steps = np.ones(len(steps))
    weights = np.concatenate([[steps[0]], 0.5 * (steps[1:] + steps[:-1]), [steps[-1]]])
    weights = weights / math.fsum(weights.tolist())
    return Waypoints(points, poses.positions, poses.rotations, _feeds(path, points), seconds, weights)


def _sizes(path: ProgrammedPath) -> FloatArray:
    """Return the size (n,) of each segment: its length, or for a pure rotation its share of all rotations."""
    turns = turns_between(path.knots[:, 3:], path.order, path.between)
    lengths, still = path.lengths, rest_length(path.knots[:, :3])
    if not (lengths > still).any():
        return turns
    return np.where(lengths > still, lengths, 0.0)


def _feeds(path: ProgrammedPath, points: Points) -> FloatArray:
    """Return the unit vectors (N, 3) of the feed at points; 0 without a translation."""
    timed = _timed(path)
    back = Points(
        np.maximum(points.segments - (points.parameters == 0), 0),
        np.where(points.parameters == 0, 1.0, points.parameters),
    )
    found = _units(twists_at(timed, points)[:, 3:]), _units(twists_at(timed, back)[:, 3:])
    first, last = found[0].copy(), found[1].copy()
    last[0] = first[0] if points.parameters[0] == 0 else last[0]
    closed = np.linalg.norm(path.knots[0, :3] - path.knots[-1, :3]) <= rest_length(path.knots[:, :3])
    if closed:
        # The point where a closed contour begins lies between its last and its first segment.
        last[0], first[-1] = found[1][-1], found[0][0]
    # Where the path turns back, the mean has no direction: the feed is that of the arriving segment.
    mean = first + last
    is_back = np.linalg.norm(mean, axis=1, keepdims=True) <= STILL * np.linalg.norm(first, axis=1, keepdims=True)
    return _units(np.where(is_back, last, mean))


def _timed(path: ProgrammedPath) -> ProgrammedPath:
    """Return the path with a time of each segment, so that velocities have directions."""
    return replace(path, durations=np.ones(len(path)), kinds=path.kinds.copy())


def _units(vectors: FloatArray) -> FloatArray:
    """Return unit vectors (n, 3); 0 for vectors of zero length."""
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.where(sizes > 0, vectors / np.where(sizes > 0, sizes, 1.0), 0.0))
