"""Joint positions of the nominal robot along a tool path: loops are closed from one point to the next."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .....models import FloatArray
from ....evidence.closed_loops import inverses
from ..robot.path_cover import PathCover
from ..robot.posed_robot import Problem

#: Largest relative correction of extrapolated joint positions that does not count as a jump; and smallest fraction of
#: a piece for one extrapolation.
_JUMP, _SHORTEST = 0.1, 2.0**-10


def closed_along(problem: Problem, cover: PathCover) -> FloatArray:
    """Return points (N, n) of the nominal robot with closed loops in the middle of segments.

    Where the loops cannot be closed, the row is the point of an earlier segment.
    """
    near, D = np.repeat(problem.start[None], len(cover.pieces), axis=0), list(problem.dependent)
    if D:
        design = problem.problem
        free, followed = len(problem.free), _followed(design.resting or design, cover)
        near[:, D], near[:, :free] = followed[:, D], followed[:, :free]
    return near


@lru_cache(maxsize=2)
def _followed(problem: Problem, cover: PathCover) -> FloatArray:
    """Return points (N, n) with closed loops in the middle of segments; after a failure, the start of the path.

    The result is cached: all searches of one path share it.
    """
    near, stated = np.repeat(problem.start[None], len(cover.pieces), axis=0), problem.stated
    parts = (0.0, 0.5, 1.0)
    z, points = problem.start.copy(), [problem.path_points(cover, cover.pieces, part) for part in parts]
    for k, ways in enumerate(zip(*points, strict=True)):
        # For another reference of rotations, the same pose has different coordinates.
        z[stated] = ways[0]
        for j in (1, 2):
            moved = _extrapolated(problem, z, ways[j])
            z = _moved(problem, cover, cover.pieces[k : k + 1], z, parts[j - 1 : j + 1]) if moved is None else moved
            near[k] = z if j == 1 else near[k]
    near.flags.writeable = False
    return near


def _extrapolated(problem: Problem, z: FloatArray, point: FloatArray) -> FloatArray | None:
    """Return the point (n,) with closed loops at another pose (f,), from extrapolated joint positions.

    The result is None if Newton's method corrects the positions by more than ``_JUMP``: the point may then be in
    another assembly mode.
    """
    D, own, size, loops = list(problem.dependent), problem.stated, problem.size, problem.loops
    guess = z.copy()
    guess[own] = point
    with np.errstate(all="ignore"):
        slopes = loops.slopes(z[:, None]) * size
        step = (slopes[:, :, own] @ ((point - z[own]) / size[own]))[:, :, None]
        guess[D] -= size[D] * (inverses(slopes[:, :, D]) @ step)[0, :, 0]
        moved = loops.all_closed(guess[:, None], D)[:, 0]
        return moved if (np.abs(moved - guess)[D] <= _JUMP * size[D]).all() else None


def _moved(
    problem: Problem, cover: PathCover, piece: FloatArray, z: FloatArray, parts: tuple[float, ...]
) -> FloatArray:
    """Return the point (n,) with closed loops after short steps along a piece (1, 3), or the last known point."""
    (at, end), step = parts, 0.25
    while at < end and step > _SHORTEST:
        to = min(at + step, end)
        moved = _extrapolated(problem, z, problem.path_points(cover, piece, to)[0])
        z, at, step = (z, at, 0.5 * step) if moved is None else (moved, to, step)
    return z
