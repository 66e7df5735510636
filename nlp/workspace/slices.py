"""Slices of a box of poses: where J is proved to be regular, and where it is beyond a singular pose.

A slice has two coordinates of the box; the others stay at the middle. The slice is covered by boxes of its own, so
that what it shows is proved for the poses of the slice alone. It is wider than the workspace, to show what comes next.
"""

from __future__ import annotations

import enum
import itertools
from dataclasses import dataclass, replace

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..case.workspace import TurnKind
from ..errors import CaseError
from .engines import rank_engine
from .machine import Legs, legs_of, workspace_of_case
from .posebox import PoseBox, pose_box, scaled
from .regularity import Rank
from .scale import largest_factor

#: Factor by which a slice is wider than the workspace, and width of its smallest boxes in parts of the slice.
_WIDER, _LEAST = 2.0, 2.0**-7
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


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice of a box of poses.

    Attributes:
        names: of its two coordinates.
        are_angles: whether each is an angle; angles are radians.
        workspace: (2, 2) lower and upper ends of the workspace in the slice.
        whole: (2, 2) those of the slice.
        boxes: (B, 4) lower ends, then upper ends of its boxes.
        regions: region of each box.
    """

    names: tuple[str, str]
    are_angles: tuple[bool, bool]
    workspace: FloatArray
    whole: FloatArray
    boxes: FloatArray
    regions: tuple[Region, ...]


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
    return tuple(_slice(legs, box, wide, pair) for pair in pairs)


def _slice(legs: Legs, box: PoseBox, wide: PoseBox, pair: tuple[int, int]) -> Slice:
    """Return the slice of two coordinates."""
    chosen = list(pair)
    middle = 0.5 * (wide.lower + wide.upper)
    lower, upper = middle.copy(), middle.copy()
    lower[chosen], upper[chosen] = wide.lower[chosen], wide.upper[chosen]
    engine = rank_engine(legs, wide)
    own = int(engine.examine(middle[None], middle[None]).sign[0])
    stack, boxes, regions = [(lower[None], upper[None])], [], []
    while stack:
        lows, highs = stack.pop()
        found = engine.examine(lows, highs)
        small = ((highs - lows)[:, chosen] <= _LEAST * (upper - lower)[chosen]).all(axis=1)
        closed = (found.verdict == Rank.REGULAR) | small
        for k in np.flatnonzero(closed).tolist():
            boxes.append(np.concatenate([lows[k, chosen], highs[k, chosen]]))
            beyond = Region.REGULAR if found.sign[k] == own else Region.BEYOND
            regions.append(beyond if found.verdict[k] == Rank.REGULAR else Region.OPEN)
        left = np.flatnonzero(~closed)
        if left.size:
            stack.append(_halves(lows[left], highs[left], chosen))
    ends = np.array([[each.lower[chosen], each.upper[chosen]] for each in (box, wide)])
    are_angles = (pair[0] > 2, pair[1] > 2)
    parts = np.array(boxes).reshape(-1, 4)
    for k, is_angle in enumerate(are_angles):
        if is_angle:
            ends[:, :, k] = 2 * np.arctan(ends[:, :, k])
            parts[:, [k, k + 2]] = 2 * np.arctan(parts[:, [k, k + 2]])
    names = _NAMES[box.kind]
    return Slice(
        names=(names[pair[0]], names[pair[1]]),
        are_angles=are_angles,
        workspace=frozen_array(ends[0], (2, 2)),
        whole=frozen_array(ends[1], (2, 2)),
        boxes=frozen_array(parts, parts.shape),
        regions=tuple(regions),
    )


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
