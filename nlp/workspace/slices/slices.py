"""Slices of a box of poses: where J is proved to be regular, where it is beyond a singular pose, and where limits hold.

A slice has two coordinates of the box; the others stay at the middle. The slice is covered by boxes of its own, so
that what it shows is proved for the poses of the slice alone. It is wider than the workspace, to show what comes next.
Where several limits are violated, a box has the one that is violated first on the straight way from the middle.
"""

from __future__ import annotations

import enum
import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....models import FloatArray, frozen_array
from ...case.case import Case
from ...case.limits.legs import Actuator
from ...case.workspace import TurnKind
from ...errors import CaseError
from ..machine import Legs, legs_of, workspace_of_case
from ..posebox import PoseBox, pose_box, scaled
from ..regular.engines import RankEngine, rank_engine
from ..regular.regularity import Rank
from ..scale import largest_factor
from .limitcells import LimitCells, LimitState, SliceLimit

#: Factor by which a slice is wider than the workspace, and width of its smallest boxes in parts of the slice.
_WIDER, _LEAST = 3.0, 2.0**-8
#: Points to each side of a slice, and on each way from its middle, at which limits are tried for the first violated.
_POINTS, _STEPS = 65, 96
#: Names of the coordinates of a pose, by the kind of its rotations.
_NAMES = {
    TurnKind.ANY_AXIS: ("p_x", "p_y", "p_z", "rotation about x", "rotation about y", "rotation about z"),
    TurnKind.AXIS: ("p_x", "p_y", "p_z", "angle", "", ""),
    TurnKind.ROLL_PITCH_YAW: ("p_x", "p_y", "p_z", "roll", "pitch", "yaw"),
}


class Region(enum.Enum):
    """What a box of a slice is."""

    REGULAR = "proved regular"
    BEYOND = "regular, with a singular pose on the way from the middle"
    OPEN = "open: too close to a singular pose"


#: Limits of a box: all are proved to be kept, or nothing is proved; else the index of a limit that is violated.
KEPT, UNDECIDED = -1, -2


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice of a box of poses.

    Attributes:
        names: of its two coordinates.
        are_angles: whether each is an angle; angles are radians.
        ball: largest angle of a workspace of rotations about any axis, radians, where both coordinates are such angles:
            an angle is then twice the arc tangent of a component of a Cayley vector; None elsewhere.
        workspace: (2, 2) lower and upper ends of the workspace in the slice.
        whole: (2, 2) those of the slice.
        boxes: (B, 4) lower ends, then upper ends of its boxes.
        regions: region of each box.
        limits: the limits at a pose that the slice shows.
        binding: (B,) for each box the index of the limit that is violated first, ``KEPT`` or ``UNDECIDED``.
        left_out: keys of limits that the slice does not show: those over several poses, and those without bounds.
    """

    names: tuple[str, str]
    are_angles: tuple[bool, bool]
    ball: float | None
    workspace: FloatArray
    whole: FloatArray
    boxes: FloatArray
    regions: tuple[Region, ...]
    limits: tuple[SliceLimit, ...]
    binding: NDArray[np.int16]
    left_out: tuple[str, ...]


def slices_of(case: Case) -> tuple[Slice, ...]:
    """Return the slices of a case's workspace: each pair of positions, and each pair of rotations.

    Args:
        case: a case with fixed dimensions.

    Raises:
        CaseError: the case has no workspace, a free dimension, or a robot that is not six straight legs.
    """
    workspace, legs = workspace_of_case(case), legs_of(case)
    if legs is None:
        raise CaseError("robot.model", "has no slices, which need six straight legs", case.model.name, case.source)
    box = pose_box(workspace)
    wide = pose_box(scaled(workspace, min(_WIDER, largest_factor(workspace))))
    # A slice shows the square around the ball of rotations.
    wide = replace(wide, ball=np.inf)
    free = wide.free
    turning, moving = [k for k in free if k > 2], [k for k in free if k < 3]
    pairs = [*itertools.combinations(moving, 2), *itertools.combinations(turning, 2)]
    if not pairs:
        pairs = [(k, each) for k in moving for each in turning]
    return tuple(_slice(case, legs, box, wide, pair) for pair in pairs)


def _slice(case: Case, legs: Legs, box: PoseBox, wide: PoseBox, pair: tuple[int, int]) -> Slice:
    """Return the slice of two coordinates."""
    chosen = list(pair)
    middle = 0.5 * (wide.lower + wide.upper)
    lower, upper = middle.copy(), middle.copy()
    lower[chosen], upper[chosen] = wide.lower[chosen], wide.upper[chosen]
    whole = replace(wide, lower=frozen_array(lower, (6,)), upper=frozen_array(upper, (6,)))
    limits = LimitCells(case, legs, whole, chosen)
    cover = _cover(rank_engine(legs, wide), limits, _First(limits, whole, chosen), whole, chosen)
    ends = np.array([[each.lower[chosen], each.upper[chosen]] for each in (box, wide)])
    are_angles = (pair[0] > 2, pair[1] > 2)
    parts = cover.boxes
    for k, is_angle in enumerate(are_angles):
        if is_angle:
            ends[:, :, k] = 2 * np.arctan(ends[:, :, k])
            parts[:, [k, k + 2]] = 2 * np.arctan(parts[:, [k, k + 2]])
    names = _NAMES[box.kind]
    is_ball = box.kind is TurnKind.ANY_AXIS and all(are_angles)
    return Slice(
        names=(names[pair[0]], names[pair[1]]),
        are_angles=are_angles,
        ball=2 * float(np.arctan(np.sqrt(box.ball))) if is_ball else None,
        workspace=frozen_array(ends[0], (2, 2)),
        whole=frozen_array(ends[1], (2, 2)),
        boxes=frozen_array(parts, parts.shape),
        regions=cover.regions,
        limits=limits.limits,
        binding=cover.binding,
        left_out=(*limits.uncovered, *_over_poses(case)),
    )


def _over_poses(case: Case) -> tuple[str, ...]:
    """Return the keys of limits that no single pose keeps or violates."""
    limit = next((each for each in case.limits if isinstance(each, Actuator)), None)
    if limit is None:
        return ()
    return tuple(f"actuator.{name}" for name in ("stroke_max", "dead_length") if getattr(limit, name) is not None)


class _Cover(NamedTuple):
    """Boxes that cover a slice, lower then upper ends (B, 4), and the region and the limit (B,) of each."""

    boxes: FloatArray
    regions: tuple[Region, ...]
    binding: NDArray[np.int16]


def _cover(engine: RankEngine, limits: LimitCells, first: _First, whole: PoseBox, chosen: list[int]) -> _Cover:
    """Return boxes that cover a slice: each is decided, or as small as they get."""
    middle = 0.5 * (whole.lower + whole.upper)
    own = int(engine.examine(middle[None], middle[None]).sign[0])
    lows, highs, known = whole.lower[None], whole.upper[None], limits.unknown
    boxes, regions, binding = [], [], []
    while len(lows):
        found = engine.examine(lows, highs)
        known = limits.examine(known, lows, highs)
        states = limits.states(known)
        small = ((highs - lows)[:, chosen] <= _LEAST * (whole.upper - whole.lower)[chosen]).all(axis=1)
        limit, is_same = first.of(states, lows, highs)
        closed = ((found.verdict == Rank.REGULAR) & is_same) | small
        boxes.append(np.concatenate([lows[closed][:, chosen], highs[closed][:, chosen]], axis=1))
        binding.append(limit[closed])
        for k in np.flatnonzero(closed).tolist():
            beyond = Region.REGULAR if found.sign[k] == own else Region.BEYOND
            regions.append(beyond if found.verdict[k] == Rank.REGULAR else Region.OPEN)
        lows, highs = _halves(lows[~closed], highs[~closed], chosen)
        known = np.tile(known[:, ~closed], 4)
    parts = np.concatenate(binding)
    parts.flags.writeable = False
    return _Cover(np.concatenate(boxes), tuple(regions), parts)


class _First:
    """The limit that is violated first on the straight way from the middle of a slice.

    The limit's violation in a box is that of :mod:`.limitcells`; which of several comes first is taken from points.

    Args:
        limits: of the slice.
        whole: the slice.
        chosen: its two coordinates.
    """

    def __init__(self, limits: LimitCells, whole: PoseBox, chosen: list[int]) -> None:
        self._limits, self._whole, self._chosen = limits, whole, chosen
        self._lower, self._upper = whole.lower[chosen], whole.upper[chosen]
        self._count = len(limits.limits)

    @cached_property
    def _violated(self) -> NDArray[np.bool_]:
        """Whether each limit is violated at points of the slice, (M, N, N)."""
        axes = [np.linspace(low, high, _POINTS) for low, high in zip(self._lower, self._upper, strict=True)]
        points = np.repeat(0.5 * (self._whole.lower + self._whole.upper)[None], _POINTS**2, axis=0)
        points[:, self._chosen] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        return self._limits.violated(points).reshape(self._count, _POINTS, _POINTS)

    def of(
        self, states: NDArray[np.int8], lower: FloatArray, upper: FloatArray
    ) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
        """Return the limit (B,) of each box, and whether it is that of the whole box.

        Args:
            states: (M, B) of the limits over the boxes.
            lower: (B, 6) lower ends of the boxes.
            upper: (B, 6) upper ends of the boxes.
        """
        violated = states == LimitState.VIOLATED
        limit = np.where((states == LimitState.OPEN).any(axis=0), UNDECIDED, KEPT).astype(np.int16)
        is_same = limit == KEPT
        some = np.flatnonzero(violated.any(axis=0))
        if not some.size:
            return limit, is_same
        limit[some] = np.argmax(violated[:, some], axis=0)
        # Another limit that is open may be violated first in a part of the box.
        is_same[some] = (states[:, some] == LimitState.KEPT).sum(axis=0) == self._count - 1
        several = some[~is_same[some]]
        if several.size:
            low, high = lower[several][:, self._chosen], upper[several][:, self._chosen]
            own = violated[:, several]
            limit[several] = self._first(own, 0.5 * (low + high))
            corners = [np.column_stack([x[:, 0], y[:, 1]]) for x in (low, high) for y in (low, high)]
            candidates = states[:, several] != LimitState.KEPT
            around = [self._first(candidates, corner) for corner in corners]
            is_same[several] = np.all([each == limit[several] for each in around], axis=0)
        return limit, is_same

    def _first(self, candidates: NDArray[np.bool_], ends: FloatArray) -> NDArray[np.int16]:
        """Return which of the candidates (M, C) is violated first on the way to each end (C, 2)."""
        middle = 0.5 * (self._lower + self._upper)
        parts = np.linspace(0.0, 1.0, _STEPS)[:, None, None]
        way = middle + parts * (ends - middle)
        place = np.rint((way - self._lower) / (self._upper - self._lower) * (_POINTS - 1)).astype(np.intp)
        on_way = self._violated[:, place[..., 0], place[..., 1]] & candidates[:, None]
        # One that is violated at no point of the way comes last.
        begins = np.where(on_way.any(axis=1), np.argmax(on_way, axis=1), _STEPS)
        begins = np.where(candidates, begins, _STEPS + 1)
        return np.asarray(np.argmin(begins, axis=0), dtype=np.int16)


def _halves(lower: FloatArray, upper: FloatArray, chosen: list[int]) -> tuple[FloatArray, FloatArray]:
    """Return boxes bisected along the two coordinates, each into four."""
    middle = 0.5 * lower + 0.5 * upper
    lows, highs = [], []
    for first, second in itertools.product((False, True), repeat=2):
        low, high = lower.copy(), upper.copy()
        for k, is_upper in zip(chosen, (first, second), strict=True):
            (low if is_upper else high)[:, k] = middle[:, k]
        lows.append(low)
        highs.append(high)
    return np.concatenate(lows), np.concatenate(highs)
