"""Points of a path at which the platform stands: a pose that is stated again, up to the rounding of its digits.

Such a motion has no direction, and its feed gives it a time of rounding size, in which any speed is possible. It is no
segment; with a time of its own it is a dwell.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from ..errors import InputError
from .options import Between
from .orientation import Order, quaternions_from_angles, shortest_turns
from .path import Kind, ProgrammedPath

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Way, as a part of the largest coordinate of a path, and turn, radians, up to which the platform stands: of numbers
#: with eleven digits the last one.
STILL = 1e-11


def turns_between(angles: FloatArray, order: Order, between: Between) -> FloatArray:
    """Return the sizes (n,) of the turns from each of n + 1 orientations to the next, radians.

    Args:
        angles: (n + 1, 3) angles of the orientations, radians.
        order: convention of the angles.
        between: motion between two of them: a shortest turn, or three angles that change.
    """
    if between is Between.ANGLES:
        return np.asarray(np.linalg.norm(np.diff(angles, axis=0), axis=1))
    quaternions = quaternions_from_angles(angles, order)
    return shortest_turns(quaternions[:-1], quaternions[1:])[1]


def still_way(positions: FloatArray) -> float:
    """Return the length of a way between positions (n, 3) up to which the platform stands."""
    return STILL * float(np.abs(positions).max(initial=0.0))


def standing(knots: FloatArray, order: Order, between: Between) -> NDArray[np.intp]:
    """Return for each knot (n,) the one at which the platform stands then: itself, or one before it.

    Args:
        knots: (n, 6) positions and angles.
        order: convention of the angles.
        between: motion between two knots.
    """
    most, at = still_way(knots[:, :3]), np.arange(len(knots))

    def stands(one: FloatArray) -> NDArray[np.bool_]:
        ways = np.linalg.norm(np.diff(one[:, :3], axis=0), axis=1)
        return np.asarray((ways <= most) & (turns_between(one[:, 3:], order, between) <= STILL))

    for k in (np.flatnonzero(stands(knots)) + 1).tolist():
        # Many short steps one after the other are a motion.
        if at[k - 1] == k - 1 or stands(knots[[at[k - 1], k]])[0]:
            at[k] = at[k - 1]
    return at


def duration_at(way: FloatArray, turn: FloatArray, feeds: tuple[FloatArray, FloatArray], still: float) -> FloatArray:
    """Return the times of motions at a feed, seconds: of the way, or, for a turn in place, of the turn.

    Args:
        way: lengths.
        turn: radians.
        feeds: lengths, and radians, per second.
        still: way up to which the platform turns in place.
    """
    of_way, of_turn = way / feeds[0], turn / feeds[1]
    # Neither of both is a motion: a part of one.
    of_rest = np.where(turn > STILL, of_turn, np.maximum(of_way, of_turn))
    return np.asarray(np.where(way > still, of_way, of_rest))


def _times_of_steps(path: ProgrammedPath, at: NDArray[np.intp]) -> FloatArray:
    """Return the times of segments, where short steps one after the other are one motion in the time of them all."""
    found = path.durations.copy()
    ways, turns = path.lengths, turns_between(path.knots[:, 3:], path.order, path.between)
    most = still_way(path.knots[:, :3])
    for k in np.flatnonzero((ways <= most) & (turns <= STILL) & (at[1:] == np.arange(1, len(path.knots)))).tolist():
        ends = path.knots[[at[k], k + 1]]
        way = float(np.linalg.norm(ends[1, :3] - ends[0, :3]))
        whole, step = (
            (way, ways[k]) if way > most else (turns_between(ends[:, 3:], path.order, path.between)[0], turns[k])
        )
        found[k] *= whole / step
    return found


def without_rests(path: ProgrammedPath, *, are_timed: bool) -> ProgrammedPath:
    """Return a path without the lines along which the platform stands.

    Args:
        path: the path.
        are_timed: whether the times of lines are stated by themselves: such a line is a dwell then.

    Raises:
        InputError: no segment is left.
    """
    at = standing(path.knots, path.order, path.between)
    still = (at[1:] < np.arange(1, len(path.knots))) & (path.kinds == Kind.LINE)
    # A dwell behind points that are left out is where the platform stands.
    knots = path.knots[at]
    if not still.any():
        return path if np.array_equal(knots, path.knots) else replace(path, knots=knots)
    if are_timed:
        return replace(path, knots=knots, kinds=np.where(still, Kind.DWELL, path.kinds).astype(np.uint8))
    kept, durations = ~still, _times_of_steps(path, at)
    if not kept.any():
        raise InputError(f"{path.source}: there is no path: all of its points are one pose")
    return replace(
        path,
        knots=knots[np.concatenate([[True], kept])],
        lines=path.lines[kept],
        kinds=path.kinds[kept],
        durations=durations[kept],
    )
