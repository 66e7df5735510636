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
from ...boxes.rows import WHOLE, Boxes, joined, some
from ...boxes.search import Verdicts
from ...statement.machine import Legs, legs_of, workspace_of_case
from ..ranks.loop_boxes import Cells, Examined, Examiner
from ..ranks.rank_rule import RankTest
from ..robot.pose_box import PoseBox, pose_box, scaled
from ..robot.posed_robot import build_problem
from ..scale import largest_factor
from .anyslice import AnySlices, Covered
from .firstviolated import POINTS, FirstViolated, grid_points
from .limitcells import LimitCells, SliceLimit
from .regions import Cover, CoverRule, Region, cover_of, index_of

#: Boxes that are examined at once.
_BLOCK = 4096
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
    problem = build_problem(case, case.model, wide)
    examiner = Examiner(problem, RankTest(problem.locked, problem.z, problem.start))
    cover = _LegsRule(examiner, limits, first, whole, chosen).result
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


#: States (B, K) of the parts of limits.
_States = NDArray[np.int8]


class _LegsRule(CoverRule[_States]):
    """Rule of ranks and limits of six straight legs."""

    block = _BLOCK

    def __init__(
        self, examiner: Examiner, limits: LimitCells, first: FirstViolated, whole: PoseBox, chosen: list[int]
    ) -> None:
        super().__init__(chosen, whole.lower[chosen], whole.upper[chosen])
        self._examiner, self._limits, self._first = examiner, limits, first
        middle = 0.5 * (whole.lower + whole.upper)[None]
        self._sign = self._ranks(middle, middle).signs[0]
        self._done: list[tuple[FloatArray, FloatArray, NDArray[np.int8], NDArray[np.int16]]] = []
        ends = whole.lower[None], whole.upper[None]
        self.cover(Boxes(*ends, np.zeros(1), np.array([WHOLE]), limits.unknown.T))

    def _ranks(self, lower: FloatArray, upper: FloatArray) -> Examined:
        """Return the ranks over boxes (B, 6)."""
        free = list(self._examiner.problem.free)
        low, high = lower[:, free], upper[:, free]
        return self._examiner.examine(Cells(low, high, 0.5 * (low + high), np.ones(len(low), dtype=bool)))

    def examine(self, boxes: Boxes[_States]) -> Verdicts[_States]:
        """Return the boxes that are not decided."""
        found = self._ranks(boxes.lower, boxes.upper)
        known = self._limits.examine(boxes.more.T, boxes.lower, boxes.upper)
        low, high, small = self.ends(boxes.lower, boxes.upper)
        limit, is_same = self._first.of(self._limits.states(known), low, high)
        region = np.where(found.signs == self._sign, index_of(Region.REGULAR), index_of(Region.BEYOND))
        region = np.where(found.is_regular, region, index_of(Region.OPEN)).astype(np.int8)
        done = (found.is_regular & is_same) | small
        self._done.append(some((low, high, region, limit), done))
        return self.open(boxes._replace(more=known.T), done)

    @property
    def result(self) -> Cover:
        """The boxes that cover the slice."""
        return cover_of(*joined(self._done))
