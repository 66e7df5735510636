"""Slices of a box of poses: where J is proved to be regular, where it is beyond a singular pose, and where limits hold.

A slice has two coordinates of the box; the others stay at the middle. The slice is covered by boxes of its own, so
that what it shows is proved for the poses of the slice alone. It is wider than the workspace, to show what comes next.
Where several limits are violated, a box has the one that is violated first on the straight way from the middle.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray, frozen_array
from ....case.case import Case
from ....case.limits.legs import Actuator
from ....case.workspace import TurnKind
from ....errors import CaseError
from ...statement.machine import Legs, legs_of, workspace_of_case
from ..regular.engines import RankEngine, rank_engine
from ..regular.regularity import Rank
from ..robot.pose_box import PoseBox, pose_box, scaled
from ..scale import largest_factor
from .anyslice import AnySlices, Covered
from .firstviolated import POINTS, FirstViolated, grid_points
from .limitcells import LimitCells, SliceLimit
from .regions import LEAST, Cover, Region, quarters

#: Factor by which a slice is wider than the workspace.
_WIDER = 3.0
#: Names of the coordinates of a pose, by the kind of its rotations.
_NAMES = {
    TurnKind.ANY_AXIS: ("p_x", "p_y", "p_z", "rotation about x", "rotation about y", "rotation about z"),
    TurnKind.AXIS: ("p_x", "p_y", "p_z", "angle", "", ""),
    TurnKind.ROLL_PITCH_YAW: ("p_x", "p_y", "p_z", "roll", "pitch", "yaw"),
}


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
        CaseError: the case has no workspace, a free dimension, fewer than two numbers that the robot can choose, or a
            robot whose loops are not closed in the middle of the workspace.
    """
    case = replace(case, joint_centre_tolerance=None)
    workspace, legs = workspace_of_case(case), legs_of(case)
    box = pose_box(workspace)
    wide = pose_box(scaled(workspace, min(_WIDER, largest_factor(workspace))))
    # A slice shows the square around the ball of rotations.
    wide = replace(wide, ball=np.inf)
    others = AnySlices(case, box) if legs is None else None
    free = wide.free if others is None else others.free
    turning, moving = [k for k in free if k > 2], [k for k in free if k < 3]
    pairs = [*itertools.combinations(moving, 2), *itertools.combinations(turning, 2)]
    if not pairs:
        pairs = [(k, each) for k in moving for each in turning]
    if not pairs:
        fault = "has no slices: they need two numbers of the pose, given as { min, max }, that the robot can choose"
        raise CaseError("workspace", fault, source=case.source)
    return tuple(_slice(case, legs, others, box, wide, pair) for pair in pairs)


def _of_legs(case: Case, legs: Legs, wide: PoseBox, chosen: list[int]) -> Covered:
    """Return the cover of a slice of six straight legs."""
    middle = 0.5 * (wide.lower + wide.upper)
    lower, upper = middle.copy(), middle.copy()
    lower[chosen], upper[chosen] = wide.lower[chosen], wide.upper[chosen]
    whole = replace(wide, lower=frozen_array(lower, (6,)), upper=frozen_array(upper, (6,)))
    limits = LimitCells(case, legs, whole, chosen)

    def violated() -> NDArray[np.bool_]:
        """Return whether each limit is violated at the points of the grid, (M, N, N)."""
        points = np.repeat(middle[None], POINTS**2, axis=0)
        points[:, chosen] = grid_points(lower[chosen], upper[chosen]).reshape(-1, 2)
        return limits.violated(points).reshape(-1, POINTS, POINTS)

    first = FirstViolated(violated, len(limits.limits), lower[chosen], upper[chosen])
    cover = _cover(rank_engine(legs, wide), limits, first, whole, chosen)
    return Covered(cover, limits.limits, limits.uncovered)


def _slice(
    case: Case, legs: Legs | None, others: AnySlices | None, box: PoseBox, wide: PoseBox, pair: tuple[int, int]
) -> Slice:
    """Return the slice of two coordinates."""
    chosen = list(pair)
    if others is not None:
        cover, limits, uncovered = others.cover(wide, chosen)
    elif legs is not None:
        cover, limits, uncovered = _of_legs(case, legs, wide, chosen)
    else:
        raise TypeError("a robot is six straight legs, or another")
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
        limits=limits,
        binding=cover.binding,
        left_out=(*uncovered, *_over_poses(case)),
    )


def _over_poses(case: Case) -> tuple[str, ...]:
    """Return the keys of limits that no single pose keeps or violates."""
    limit = next((each for each in case.limits if isinstance(each, Actuator)), None)
    if limit is None:
        return ()
    return tuple(f"actuator.{name}" for name in ("stroke_max", "dead_length") if getattr(limit, name) is not None)


def _cover(engine: RankEngine, limits: LimitCells, first: FirstViolated, whole: PoseBox, chosen: list[int]) -> Cover:
    """Return boxes that cover a slice: each is decided, or as small as they get."""
    middle = 0.5 * (whole.lower + whole.upper)
    own = int(engine.examine(middle[None], middle[None]).sign[0])
    lows, highs, known = whole.lower[None], whole.upper[None], limits.unknown
    boxes, regions, binding = [], [], []
    while len(lows):
        found = engine.examine(lows, highs)
        known = limits.examine(known, lows, highs)
        states = limits.states(known)
        small = ((highs - lows)[:, chosen] <= LEAST * (whole.upper - whole.lower)[chosen]).all(axis=1)
        limit, is_same = first.of(states, lows[:, chosen], highs[:, chosen])
        closed = ((found.verdict == Rank.REGULAR) & is_same) | small
        boxes.append(np.concatenate([lows[closed][:, chosen], highs[closed][:, chosen]], axis=1))
        binding.append(limit[closed])
        for k in np.flatnonzero(closed).tolist():
            beyond = Region.REGULAR if found.sign[k] == own else Region.BEYOND
            regions.append(beyond if found.verdict[k] == Rank.REGULAR else Region.OPEN)
        lows, highs = quarters(lows[~closed], highs[~closed], chosen)
        known = np.tile(known[:, ~closed], 4)
    parts = np.concatenate(binding)
    parts.flags.writeable = False
    return Cover(np.concatenate(boxes), tuple(regions), parts)
