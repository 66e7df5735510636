"""Ranks of a robot's matrices along a tool path: proved piece by piece, or refuted at a place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ....models import FloatArray
from ...errors import UncoveredError
from ...interruption import one_search
from ..boxes.search import TOO_SMALL, Effort, Order, joined, some
from ..boxes.tree import TreeRecord
from ..statement.claims import RANKS, REGULAR
from .path_faults import pose_at
from .ranks.loop_boxes import APART, LoopBoxes, loop_boxes_of
from .ranks.ranks import RankRule
from .ranks.singular_pose import DeterminantSigns, SingularPose
from .robot.path_cover import PathCover, Place, place_in
from .robot.posed_model import RankMatrix
from .robot.posed_robot import Problem
from .verdict import EVERYWHERE, Outcome, Verdict, not_judged

#: Relative singular value that counts as 0 at a point of a path; number of steps of the search for such a point; and
#: fractions of a piece's width, as powers of two, at which the search starts.
_SINGULAR, _STEPS, _FAR = 1e-9, 80, 16
#: Number of parts between two places; the rows must be defined on each part.
_PARTS = 64
#: Parameters of each segment at which signs of the determinant are compared.
_SAMPLES = (0.0, 0.25, 0.5, 0.75, 1.0)


def rank_along(
    problem: Problem, matrix: RankMatrix, name: str, cover: PathCover, recorder: TreeRecord | None = None
) -> Verdict:
    """Return the verdict on the rank of a matrix along a path, and record the search for a proof."""
    change = _sign_change(problem, matrix, cover)
    if change is not None:
        place, sides = change
        pose, ends = pose_at(problem, cover, place), np.array([[each.segment + each.parameter] for each in sides])
        return Verdict(RANKS[name], Outcome.REFUTED, pose=pose, place=place, sides=ends)
    effort = Effort()
    try:
        with one_search():
            rule = RankRule(problem, matrix, recorder, lambda *_: None)
            search = rule.search(Order.NEWEST)
            # If one piece is too small to bisect, the claim stays open or is refuted, so the search can stop.
            reason = effort.run(search, lambda: TOO_SMALL if search.state.small else None)
    except UncoveredError as error:
        return replace(not_judged(name, str(error)), seconds=effort.seconds)
    left = search.state.left
    if not left:
        reason = reason or ("" if rule.is_one_assembly() else APART)
        outcome = Outcome.OPEN if reason else Outcome.PROVED
        return Verdict(RANKS[name], outcome, reason=reason, boxes=search.boxes, seconds=effort.seconds)
    boxes = joined(search.state.small or left)
    pieces = boxes.more.along
    first = np.lexsort(pieces.T[[1, 0]])[:1]
    place, value = _most_singular(problem, matrix, cover, pieces[first[0]], loop_boxes_of(some(boxes, first)))
    is_singular = value <= _SINGULAR
    words = f"its smallest singular value is {value:.1e} times the largest one there"
    words = words if math.isfinite(value) else reason
    outcome = Outcome.REFUTED if is_singular else Outcome.OPEN
    return Verdict(
        RANKS[name],
        outcome,
        pose=pose_at(problem, cover, place),
        reason=words,
        boxes=search.boxes,
        open=search.left,
        seconds=effort.seconds,
        place=place,
    )


def rank_at_start(problem: Problem, matrix: RankMatrix, cover: PathCover) -> Verdict:
    """Return the verdict on J of a robot that is singular at every pose, from the first point of the path."""
    place = Place(int(cover.pieces[0, 0]), 0.0)
    is_singular = SingularPose(problem, matrix).smallest(problem.start) <= _SINGULAR
    outcome = Outcome.REFUTED if is_singular else Outcome.OPEN
    pose = pose_at(problem, cover, place)
    return Verdict(RANKS[REGULAR], outcome, pose=pose, reason=EVERYWHERE, place=place)


def _sign_change(problem: Problem, matrix: RankMatrix, cover: PathCover) -> tuple[Place, tuple[Place, Place]] | None:
    """Return the first place with a proved change of sign of the determinant, and its two neighbours.

    The rows are provably defined everywhere between the two neighbours.
    """
    if matrix.matrix.shape != (6, 6) or matrix.nullity or problem.dependent or problem.names:
        return None
    signs, free, every = DeterminantSigns(problem, matrix), list(problem.free), cover.pieces
    for rows in cover.blocks():
        pieces = every[rows]
        points = [cover.points(pieces, part)[:, free] for part in _SAMPLES]
        values = np.stack([np.sign(signs.computed(each)) for each in points], axis=1)
        for k, j in np.argwhere(values[:, :-1] * values[:, 1:] < 0).tolist():
            low, high = _SAMPLES[j], _SAMPLES[j + 1]
            if signs.proved(points[j][k]) * signs.proved(points[j + 1][k]) >= 0:
                continue
            ends = np.linspace(low, high, _PARTS + 1)
            ends = pieces[k, 1] + ends * (pieces[k, 2] - pieces[k, 1])
            boxes = cover.boxes(np.stack([np.full(_PARTS, pieces[k, 0]), ends[:-1], ends[1:]], axis=1))
            if not signs.has_values(*(each[:, free] for each in boxes)):
                continue
            sides = place_in(pieces[k], low), place_in(pieces[k], high)
            for _ in range(_STEPS):
                middle = 0.5 * (low + high)
                sign = np.sign(signs.computed(cover.points(pieces[k : k + 1], middle)[:, free])[0])
                low, high = (middle, high) if sign == values[k, j] else (low, middle)
            return place_in(pieces[k], high), sides
    return None


def _most_singular(
    problem: Problem, matrix: RankMatrix, cover: PathCover, piece: FloatArray, box: LoopBoxes
) -> tuple[Place, float]:
    """Return the point in or near a piece of the path with the smallest singular value, and this value."""
    newton, stated = SingularPose(problem, matrix), problem.stated
    chosen = [problem.free[j] for j in stated]

    def at(s: float) -> float:
        z = box.near[0].copy()
        z[stated] = cover.points(np.array([[piece[0], s, s]]), 0.0)[0, chosen]
        if problem.dependent:
            z = problem.loops.all_closed(z[:, None], list(problem.dependent))[:, 0]
        return newton.smallest(z) if np.isfinite(z).all() else math.inf

    # If the value falls with the square of the distance, pieces far from the smallest value stay open too.
    wide, middle = piece[2] - piece[1], 0.5 * (piece[1] + piece[2])
    away = wide * 2.0 ** np.arange(_FAR)
    near = np.clip(np.concatenate([[middle], middle - away, middle + away]), 0.0, 1.0)
    best = float(near[int(np.argmin([at(each) for each in near.tolist()]))])
    wide += abs(best - middle)
    low, high = max(best - wide, 0.0), min(best + wide, 1.0)
    for _ in range(_STEPS):
        s = np.linspace(low, high, 5)
        values = [at(each) for each in s.tolist()]
        k = int(np.argmin(values))
        low, high = float(s[max(k - 1, 0)]), float(s[min(k + 1, 4)])
    middle = 0.5 * (low + high)
    return Place(int(piece[0]), middle), at(middle)
