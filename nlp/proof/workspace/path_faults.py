"""First point of a tool path at which a quantity violates its limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....models import FloatArray
from ..statement.claims import Claim
from .numbers.bound_search import Number
from .numbers.extremes import goal_of
from .ranks.followed import closed_along
from .robot.path_cover import PathCover, Place, place_in
from .robot.pose_box import PoseNumbers
from .robot.posed_robot import Problem
from .verdict import Fault, Outcome, Verdict

#: Number of sampled points on all segments together; smallest and largest number on one segment.
_ALL_SAMPLES, _LEAST_SAMPLES, _MOST_SAMPLES = 50_000, 5, 129
#: Number of bisections between two sampled points.
_STEPS = 80


def pose_at(problem: Problem, cover: PathCover, place: Place) -> PoseNumbers:
    """Return the pose at a point of a path; with dependent coordinates, the pose of the nominal robot."""
    piece = np.array([[place.segment, place.parameter, place.parameter]])
    if not problem.box.dependent:
        return problem.box.pose(cover.points(piece, 0.0)[0])
    problem = problem.problem.resting or problem.problem
    row = int(np.flatnonzero(cover.pieces[:, 0] == place.segment)[0])
    z = closed_along(problem, cover)[row].copy()
    z[problem.of_path] = problem.path_points(cover, piece, 0.0)[0]
    closed = problem.loops.all_closed(z[:, None], problem.dependent)[:, 0]
    return problem.box.pose(problem.pose_of(closed if np.isfinite(closed).all() else z))


def refuted(verdicts: Sequence[Verdict]) -> dict[int, Verdict]:
    """Return the refuted verdicts among ``verdicts``, by their index."""
    return {k: each for k, each in enumerate(verdicts) if each.outcome is Outcome.REFUTED}


def first_faults(numbers: Number, wrong: Mapping[int, Verdict], cover: PathCover) -> dict[Claim, Fault]:
    """Return, by claim, the first known point where the nominal robot violates the limit.

    Claims are left out if this point is not before the point of the verdict.

    Args:
        numbers: quantities of claims.
        wrong: verdicts that refute some of these claims, by index of the quantity.
        cover: boxes of the path.
    """
    problem, found = numbers.problem, dict[Claim, Fault]()
    if not wrong:
        return found
    left, near = dict(wrong), closed_along(problem, cover)
    for rows in cover.blocks():
        if not left:
            break
        sampled = _Sampled(numbers, cover, cover.pieces[rows], near[rows])
        for k, worst in list(left.items()):
            claim, goal = worst.claim, goal_of(worst.claim)
            first = sampled.first(k, (goal.limit or 0.0) - goal.slack, worst.place)
            if first is None:
                continue
            del left[k]
            place, value = first
            if place <= (worst.place or place):
                value = claim.reading.from_value(-claim.sense.sign * value)
                found[claim] = Fault(place, value, pose_at(problem, cover, place))
    return found


class _Sampled:
    """Values of the nominal robot at points of segments, with loops closed from the middle of each segment to its ends.

    Args:
        numbers: quantities to evaluate.
        cover: boxes of the path.
        pieces: (B, 3) whole segments: index, and both ends of the parameter.
        near: (B, n) points with closed loops in the middles of the segments.
    """

    def __init__(self, numbers: Number, cover: PathCover, pieces: FloatArray, near: FloatArray) -> None:
        self._numbers, self._cover, self._pieces = numbers, cover, pieces
        # With an odd count the middle is among the samples.
        count = min(max(_ALL_SAMPLES // len(cover.pieces), _LEAST_SAMPLES), _MOST_SAMPLES) | 1
        self._parts, middle = np.linspace(0.0, 1.0, count).tolist(), count // 2
        self._points = [near] * count
        for k in (*range(middle, count), *range(middle - 1, -1, -1)):
            self._points[k] = self._closed(self._points[k + (k < middle) - (k > middle)], pieces, self._parts[k])
        self._values = np.stack([self._values_at(z) for z in self._points], axis=1)

    def _closed(self, near: FloatArray, pieces: FloatArray, part: float) -> FloatArray:
        """Return points with closed loops at a fraction of pieces, from near points; NaN if Newton's method fails."""
        problem, z = self._numbers.problem, near.copy()
        z[:, problem.of_path] = problem.path_points(self._cover, pieces, part)
        return self._numbers.closed(z)

    def _values_at(self, z: FloatArray) -> FloatArray:
        """Return the values (B, K) of the quantities at points; NaN at a point where the loops could not be closed."""
        found, known = np.full((len(z), self._numbers.count), np.nan), np.isfinite(z).all(axis=1)
        found[known] = self._numbers.values(z[known])
        return found

    def first(self, k: int, least: float, worst: Place | None) -> tuple[Place, float] | None:
        """Return the first known place at which a quantity is below its limit, and the value; None without a place.

        Args:
            k: index of the quantity.
            least: the limit.
            worst: known place with a violation, possibly between two samples; None without a known place.
        """
        beyond = [(row, self._parts[sample]) for row, sample in np.argwhere(self._values[:, :, k] < least)[:1].tolist()]
        begin, end = (int(self._pieces[row, 0]) for row in (0, -1))
        if worst is not None and begin <= worst.segment <= end:
            beyond.append((int(np.flatnonzero(self._pieces[:, 0] == worst.segment)[0]), worst.parameter))
        if not beyond:
            return None
        row, high = min(beyond)
        # The last sample without a violation before this one.
        sample = max(int(np.searchsorted(self._parts, high)) - 1, 0)
        low = min(self._parts[sample], high)
        beside = [self._points[each][row : row + 1] for each in (min(sample + 1, len(self._parts) - 1), sample)]
        piece, z = self._pieces[row : row + 1], next((at for at in beside if np.isfinite(at).all()), beside[0])

        def value_at(part: float) -> float:
            return float(self._values_at(self._closed(z, piece, part))[0, k])

        value = value_at(high)
        if not value < least:  # for example where the loops cannot be closed between the samples
            return None
        for _ in range(_STEPS if low < high else 0):
            half = 0.5 * (low + high)
            there = value_at(half)
            low, high, value = (low, half, there) if there < least else (half, high, value)
        return place_in(piece[0], high), value
