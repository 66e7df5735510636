"""Sample points of a path, progress along it, and velocities, for pictures."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import FloatArray
from .path import Kind, ProgrammedPath

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of points in addition to the ends of segments, if these leave room.
_INSIDE = 600
#: Fraction of a segment for a difference quotient: small rotations, and small rounding.
_STEP = 1e-5


class Points(NamedTuple):
    """Points of a path in order: segment indices (P,), and path parameters (P,) from 0 to 1."""

    segments: NDArray[np.intp]
    parameters: FloatArray


class ProgressKind(enum.Enum):
    """Quantity that measures the progress along a path."""

    TIME = "time"
    LENGTH = "length along the path"
    SEGMENTS = "segments"


class Progress(NamedTuple):
    """Progress along a path at the knots (n + 1,): seconds, length, or number of segments."""

    kind: ProgressKind
    knots: FloatArray

    def at(self, points: Points) -> FloatArray:
        """Return the progress (P,) at points."""
        start = self.knots[points.segments]
        return np.asarray(start + points.parameters * (self.knots[points.segments + 1] - start))


def spread_points(path: ProgrammedPath, most: int, also: Sequence[tuple[int, float]] = ()) -> Points:
    """Return points spread over a path by the sizes of its motions, translations and rotations alike.

    Both ends of each segment are included, unless there are too many.

    Args:
        path: the path.
        most: largest number of points before ``also`` is added.
        also: segments and path parameters of further points.
    """
    count, turned = len(path), np.abs(np.diff(path.knots[:, 3:], axis=0)).sum(axis=1)
    shares = path.lengths / (path.lengths.sum() or 1.0) + turned / (turned.sum() or 1.0)
    shares = shares / shares.sum() if shares.any() else np.full(count, 1 / count)
    if 2 * count <= most:
        inside = np.floor(shares * min(_INSIDE, most - 2 * count)).astype(int) + 2
        segments = np.repeat(np.arange(count), inside)
        first = np.repeat(np.cumsum(inside) - inside, inside)
        parameters = (np.arange(len(segments)) - first) / np.repeat(inside - 1, inside)
    else:
        ends = np.concatenate([[0.0], np.cumsum(shares)])
        at = np.linspace(0.0, ends[-1], most)
        segments = np.clip(np.searchsorted(ends[1:], at), 0, count - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            parameters = np.clip(np.nan_to_num((at - ends[segments]) / shares[segments]), 0.0, 1.0)
    every = np.concatenate([np.stack([segments, parameters], axis=1), np.reshape(also, (-1, 2))])
    every = np.unique(every, axis=0)
    return Points(every[:, 0].astype(np.intp), every[:, 1])


def progress_of(path: ProgrammedPath) -> Progress:
    """Return the progress along a path: time if known throughout, else length if each motion has one, else segments."""
    kinds = ((ProgressKind.TIME, path.durations), (ProgressKind.LENGTH, path.lengths))
    for kind, sizes in kinds:
        moves = (path.kinds != Kind.DWELL) if kind is ProgressKind.LENGTH else np.ones(len(path), dtype=bool)
        if np.isfinite(sizes).all() and (sizes[moves] > 0).all() and sizes.any():
            return Progress(kind, np.concatenate([[0.0], np.cumsum(sizes)]))
    return Progress(ProgressKind.SEGMENTS, np.arange(len(path) + 1.0))


def twists_at(path: ProgrammedPath, points: Points) -> FloatArray:
    """Return platform twists (P, 6): angular velocity, then velocity of the platform's origin, in the world frame.

    Twists are per second for segments with a known duration, else NaN.
    """
    segments, s = points
    ends = np.clip(s - _STEP, 0.0, 1.0), np.clip(s + _STEP, 0.0, 1.0)
    (start, R), (end, Q) = (path.poses_at(segments, each) for each in ends)
    turn = 0.5 * (Q @ R.transpose(0, 2, 1) - R @ Q.transpose(0, 2, 1))
    turns = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        seconds = (ends[1] - ends[0]) * path.durations[segments]
        return np.asarray(np.hstack([turns, end - start]) / seconds[:, None])
