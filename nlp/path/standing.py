"""Points of a path without motion: repetitions of a pose up to the rounding of its digits.

Such a motion has no direction, and at a feed its time is rounding error, so that any speed would be possible. It is not
a segment; with a stated time it is a dwell.
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

#: Translation, relative to the largest coordinate of a path, and rotation, radians, that count as rest: the last of
#: eleven digits.
STILL = 1e-11


def turns_between(angles: FloatArray, order: Order, between: Between) -> FloatArray:
    """Return the rotation angles (n,) between successive orientations, n + 1 of them, radians.

    Args:
        angles: (n + 1, 3) angles of the orientations, radians.
        order: convention of the angles.
        between: interpolation between two orientations.
    """
    if between is Between.ANGLES:
        return np.asarray(np.linalg.norm(np.diff(angles, axis=0), axis=1))
    quaternions = quaternions_from_angles(angles, order)
    return shortest_turns(quaternions[:-1], quaternions[1:])[1]


def rest_length(positions: FloatArray) -> float:
    """Return the length of a translation between positions (n, 3) up to which the platform is at rest."""
    return STILL * float(np.abs(positions).max(initial=0.0))


def standing(
    knots: FloatArray, order: Order, between: Between, resets: NDArray[np.bool_] | None = None
) -> NDArray[np.intp]:
    """Return for each knot the index (n,) of the first knot of the same rest.

    If the platform has not moved since an earlier knot, this is the earlier knot; otherwise it is the knot itself.

    Args:
        knots: (n, 6) positions and angles.
        order: convention of the angles.
        between: interpolation between two knots.
        resets: (n - 1,) True between knots where a setting changes, which is a motion of the robot.
    """
    most, at = rest_length(knots[:, :3]), np.arange(len(knots))

    def stands(one: FloatArray) -> NDArray[np.bool_]:
        ways = np.linalg.norm(np.diff(one[:, :3], axis=0), axis=1)
        return np.asarray((ways <= most) & (turns_between(one[:, 3:], order, between) <= STILL))

    still = stands(knots) if resets is None else stands(knots) & ~resets
    for k in (np.flatnonzero(still) + 1).tolist():
        # Many short steps in succession are a motion.
        if at[k - 1] == k - 1 or stands(knots[[at[k - 1], k]])[0]:
            at[k] = at[k - 1]
    return at


def duration_at(way: FloatArray, turn: FloatArray, feeds: tuple[FloatArray, FloatArray], still: float) -> FloatArray:
    """Return the times of motions, seconds: of the translation at its feed, or of the rotation without a translation.

    Args:
        way: lengths of the translations.
        turn: rotation angles, radians.
        feeds: feeds of translation (length per second) and of rotation (radians per second).
        still: largest length of a translation that counts as none.
    """
    of_way, of_turn = way / feeds[0], turn / feeds[1]
    # Neither translation nor rotation is a motion by itself: a part of one.
    of_rest = np.where(turn > STILL, of_turn, np.maximum(of_way, of_turn))
    return np.asarray(np.where(way > still, of_way, of_rest))


def _times_of_steps(path: ProgrammedPath, at: NDArray[np.intp]) -> FloatArray:
    """Return the times (n,) of segments; the last of successive short steps gets the time of their whole motion."""
    found = path.durations.copy()
    ways, turns = path.lengths, turns_between(path.knots[:, 3:], path.order, path.between)
    most = rest_length(path.knots[:, :3])
    for k in np.flatnonzero((ways <= most) & (turns <= STILL) & (at[1:] == np.arange(1, len(path.knots)))).tolist():
        ends = path.knots[[at[k], k + 1]]
        way = float(np.linalg.norm(ends[1, :3] - ends[0, :3]))
        whole, step = (
            (way, ways[k]) if way > most else (turns_between(ends[:, 3:], path.order, path.between)[0], turns[k])
        )
        found[k] *= whole / step
    return found


def without_rests(path: ProgrammedPath, *, are_timed: bool) -> ProgrammedPath:
    """Return a path without the lines in which the platform is at rest.

    Args:
        path: the path.
        are_timed: True if lines have their own times; such a line becomes a dwell.

    Raises:
        InputError: the path has only such lines.
    """
    at = standing(path.knots, path.order, path.between, path.resets)
    still = (at[1:] < np.arange(1, len(path.knots))) & (path.kinds == Kind.LINE)
    # A dwell after removed points is where the platform is at rest.
    knots = path.knots[at]
    if not still.any():
        return path if np.array_equal(knots, path.knots) else replace(path, knots=knots)
    if are_timed:
        return replace(path, knots=knots, kinds=np.where(still, Kind.DWELL, path.kinds).astype(np.uint8))
    kept, durations = ~still, _times_of_steps(path, at)
    if not kept.any():
        raise InputError(f"{path.source}: there is no path: all points are the same pose")
    return replace(path, knots=knots, durations=durations).with_knots(kept)
