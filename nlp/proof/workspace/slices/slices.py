"""Slices of a box of poses: regions of proved full rank, regions beyond singular poses, and violated limits.

A slice has two coordinates of the box. The other coordinates stay at the centre, or depend on these two. Boxes
cover the slice, so its colours are proved only for poses of the slice. A slice is wider than the workspace, to show the
surrounding poses. If several limits are violated, a box shows the first violated limit on the straight line from the
middle. Loops without a closed form are followed from the middle.
"""

from __future__ import annotations

import enum
import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray, frozen_array
from .....models.joints.model.closedform import closed_form
from ....case.case import Case
from ....case.limits.legs import Actuator
from ....case.workspace import TurnKind, Workspace
from ....errors import CaseError, UncoveredError
from ...boxes.search import Boxes, BoxResults, Order, Search, bisected, joined, some
from ...statement.fixed_robot import workspace_of_case
from ..ranks.loop_boxes import Examiner, Followed, LoopBoxes, LoopRule, loop_boxes_of, one_assembly
from ..ranks.rank_rule import RankTest, is_polynomial
from ..robot.pose_box import PoseBox, pose_box, scaled
from ..robot.posed_robot import NotJudgedError
from ..scale import largest_factor
from .slice_limits import POINTS, UNDECIDED, FirstViolated, SliceLimit, SliceLimits

#: Factor by which a slice is wider than the workspace.
_WIDER = 3.0
#: Number of smallest boxes along each side of a slice.
_SIDE = 256
#: Number of points along each side of the grid for the outline of a set of positions.
_GRID = 241
#: Names of the coordinates of a pose, by the kind of its rotations.
_NAMES = {
    TurnKind.ANY_AXIS: ("p_x", "p_y", "p_z", "rotation about x", "rotation about y", "rotation about z"),
    TurnKind.AXIS: ("p_x", "p_y", "p_z", "angle", "", ""),
    TurnKind.ROLL_PITCH_YAW: ("p_x", "p_y", "p_z", "roll", "pitch", "yaw"),
}


class Region(enum.Enum):
    """Verdict on a box of a slice."""

    REGULAR = "proved: full rank"
    BEYOND = "full rank, but a singularity between here and the centre"
    OTHER_SIGN = "full rank, opposite sign of the determinant"
    SINGULAR = "singular at every pose"
    OPEN = "undecided: close to a singularity"
    UNREACHED = "out of reach (proved)"
    UNKNOWN = "undecided: reach or loop closure"


#: Order of the regions in arrays.
_REGIONS = tuple(Region)


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice of a box of poses.

    Attributes:
        names: names of the two coordinates.
        are_angles: whether each coordinate is an angle, radians.
        ball: largest angle, radians, of a workspace of rotations about any axis. Both coordinates are then angles:
            twice the arc tangents of components of a Cayley vector. None for other slices.
        workspace: (2, 2) lower and upper ends of the workspace in the slice.
        whole: (2, 2) lower and upper ends of the slice.
        boxes: (B, 4) lower ends, then upper ends of the boxes.
        regions: region of each box.
        limits: limits that the slice shows.
        binding: (B,) index of the first violated limit of each box, or ``KEPT`` or ``UNDECIDED``.
        left_out: keys of limits that the slice does not show: limits over several poses, and limits without bounds.
        outside: (N, N) numbers on a grid over the slice, by its first and second coordinate: negative in the set of
            positions, positive outside; None without a set, or for rotations.
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
    outside: FloatArray | None = None


def slices_of(case: Case) -> tuple[Slice, ...]:
    """Return the slices of a case's workspace: each pair of positions, and each pair of rotations.

    Args:
        case: case with fixed dimensions.

    Raises:
        CaseError: the case has no workspace, a free dimension, or fewer than two independent coordinates; or the loops
            are not closed in the middle of the workspace.
    """
    case = replace(case, joint_centre_tolerance=None)
    workspace = workspace_of_case(case)
    # A slice shows the square around the ball of rotations, and around a set of positions.
    wide = pose_box(scaled(workspace, min(_WIDER, largest_factor(workspace))))
    wide = replace(wide, ball=np.inf, positions=None)
    robot = _Robot(case, workspace)
    turning, moving = [k for k in robot.free if k > 2], [k for k in robot.free if k < 3]
    pairs = [*itertools.combinations(moving, 2), *itertools.combinations(turning, 2)]
    if not pairs:
        pairs = [(k, each) for k in moving for each in turning]
    if not pairs:
        fault = "has no slices: they need two independent coordinates of the pose with { min, max }"
        raise CaseError("workspace", fault, source=case.source)
    limit = next((each for each in case.limits if isinstance(each, Actuator)), None)
    # No single pose satisfies or violates these limits.
    over_poses = tuple(
        f"actuator.{name}" for name in ("stroke_max", "dead_length") if getattr(limit, name, None) is not None
    )
    return tuple(_slice(robot, wide, pair, over_poses) for pair in pairs)


class _Robot:
    """Robot with the examiners of its ranks and limits over the boxes of slices.

    Args:
        case: case with fixed dimensions.
        workspace: box of poses, with the dependent coordinates.

    Attributes:
        problem: the robot over the workspace.
        limits: limits of the case.
        examiners: examiners of the ranks.
        is_singular: whether J is singular at every pose.
        sign: sign of the determinant in the middle; 0 for a matrix that is not square.
        other: region of regular boxes whose determinant has the opposite sign; for polynomial entries, a singular pose
            lies between this region and the middle.
        free: indices, among the six coordinates of a box, of the independent coordinates with a range.

    Raises:
        CaseError: the loops do not close at the workspace centre, or have an operation without a rule.
    """

    def __init__(self, case: Case, workspace: Workspace) -> None:
        closed = closed_form(case.model)
        try:
            self.limits = SliceLimits(case, closed, workspace)
            self.problem = problem = self.limits.problem
            matrices = [problem.locked, *([] if problem.unactuated is None else [problem.unactuated])]
            tests = [RankTest(each, problem.z, problem.start) for each in matrices]
            self.examiners = [Examiner(problem, each) for each in tests]
        except (NotJudgedError, UncoveredError) as error:
            raise CaseError("workspace", f"has no slices: {error}", source=case.source) from None
        self.is_singular, self.sign = case.model.rank < 6, tests[0].sign
        is_continuous = not problem.dependent and is_polynomial(tests[0].entries, problem.z)
        self.other = Region.BEYOND if is_continuous else Region.OTHER_SIGN
        self.free = tuple(problem.free[k] for k in problem.independent)


def _slice(robot: _Robot, wide: PoseBox, pair: tuple[int, int], over_poses: tuple[str, ...]) -> Slice:
    """Return the slice along a pair of coordinates, covered with boxes."""
    chosen, box = list(pair), robot.problem.box
    rule = _SliceRule(robot, chosen, wide.lower[chosen], wide.upper[chosen])
    parts, region, binding = rule.cover()
    ends = np.array([[each.lower[chosen], each.upper[chosen]] for each in (box, wide)])
    are_angles = (pair[0] > 2, pair[1] > 2)
    for k, is_angle in enumerate(are_angles):
        if is_angle:
            ends[:, :, k] = 2 * np.arctan(ends[:, :, k])
            parts[:, [k, k + 2]] = 2 * np.arctan(parts[:, [k, k + 2]])
    names = _NAMES[box.kind]
    is_ball = box.kind is TurnKind.ANY_AXIS and all(are_angles)
    binding.flags.writeable = False
    return Slice(
        names=(names[pair[0]], names[pair[1]]),
        are_angles=are_angles,
        ball=2 * float(np.arctan(np.sqrt(box.ball))) if is_ball else None,
        workspace=frozen_array(ends[0], (2, 2)),
        whole=frozen_array(ends[1], (2, 2)),
        boxes=frozen_array(parts, parts.shape),
        regions=tuple(_REGIONS[k] for k in region.tolist()),
        limits=robot.limits.limits,
        binding=binding,
        left_out=(*robot.limits.uncovered, *over_poses),
        outside=None if any(are_angles) else _outside(box, chosen, ends[1]),
    )


def _outside(box: PoseBox, chosen: list[int], whole: FloatArray) -> FloatArray | None:
    """Return the numbers of :attr:`Slice.outside` over the ends (2, 2) of a slice along two coordinates."""
    if box.positions is None:
        return None
    first, second = (np.linspace(low, high, _GRID) for low, high in whole.T)
    points = np.tile(box.middle, (_GRID * _GRID, 1))
    points[:, chosen] = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    size = np.maximum((box.upper - box.lower)[chosen], np.finfo(float).tiny)
    ends = np.maximum(box.lower[chosen] - points[:, chosen], points[:, chosen] - box.upper[chosen]) / size
    found = np.maximum(box.positions.excess(points[:, :3]), ends.max(axis=1)).reshape(_GRID, _GRID)
    return frozen_array(found, (_GRID, _GRID))


class _SliceRule(LoopRule):
    """Rule for ranks, reach and limits over the boxes of a slice, which are bisected along both coordinates.

    Boxes carry the states of claims, a flag for proved ranks, and the sign of the determinant.

    Args:
        robot: the robot.
        chosen: indices of the coordinates of the slice, among the six of a pose.
        lower, upper: (2,) ends of the slice.
    """

    def __init__(self, robot: _Robot, chosen: list[int], lower: FloatArray, upper: FloatArray) -> None:
        problem = robot.problem
        super().__init__(problem, robot.examiners[0])
        self._more = robot.limits.unknown, np.zeros(1, dtype=bool), np.zeros(1, dtype=np.int32)
        # Boxes without loops are examined in C, many at once.
        self.block = 512 if problem.dependent else 4096
        self._robot, self._limits, self._dependent = robot, robot.limits, list(problem.dependent)
        self._places = [problem.free.index(k) for k in chosen]
        self._lower, self._upper = lower, upper
        self._grid = self._closed_grid()
        self._first = FirstViolated(robot.limits, self._grid, lower, upper)
        for end, value in zip(self._start[:2], (lower, upper), strict=True):
            end[:, self._independent] = problem.start[self._independent]
            end[:, self._places] = value
        self._done: list[tuple[LoopBoxes, NDArray[np.int8], NDArray[np.int16]]] = []

    def cover(self) -> tuple[FloatArray, NDArray[np.int8], NDArray[np.int16]]:
        """Return boxes (B, 4) that cover the slice, and the indices of their regions and limits."""
        root = self.root
        search = Search(self, root, whole=np.nan_to_num((root.upper - root.lower)[0]), least=(0, 0), order=Order.NEWEST)
        while search.is_open:
            search.step(-math.inf)
        boxes, region, binding = joined(self._done)
        if self._dependent:
            is_one = self._is_of_middle(boxes)
            region[~is_one], binding[~is_one] = _REGIONS.index(Region.UNKNOWN), UNDECIDED
        return np.hstack([boxes.lower[:, self._places], boxes.upper[:, self._places]]), region, binding

    def parts(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the quarters of boxes."""
        halves = bisected(boxes)
        return bisected(halves._replace(split=np.full(len(halves.split), self._places[1])))

    def examine(self, boxes: Boxes[Followed]) -> BoxResults[Followed]:
        """Return the boxes that stay open."""
        low, high = boxes.lower[:, self._places], boxes.upper[:, self._places]
        known, has_ranks, signs = (each.copy() for each in boxes.more.more)
        inside, is_empty = loop_boxes_of(boxes), np.zeros(len(signs), dtype=bool)
        if self._dependent:
            inside, is_empty = self._with_near(inside, low, high)
        inside = self._with_ranks(inside, has_ranks, signs)
        relation = some(boxes.more.relation, np.arange(len(signs)))
        states = self._limits.examine(inside, relation, known)
        reached, unreached = self._limits.reached(states)
        reached &= inside.is_known
        is_regular = has_ranks & reached
        binding, is_same = self._first.of(self._limits.of_limits(states), low, high)
        is_singular = reached & self._robot.is_singular
        cases = unreached, is_singular, is_regular & (signs == self._robot.sign), is_regular, reached
        regions = Region.UNREACHED, Region.SINGULAR, Region.REGULAR, self._robot.other, Region.OPEN
        region = np.select(cases, list(map(_REGIONS.index, regions)), _REGIONS.index(Region.UNKNOWN))
        binding[~reached] = UNDECIDED
        is_small = (high - low <= (self._upper - self._lower) / _SIDE).all(axis=1)
        done = ((is_regular | is_singular) & is_same) | unreached | is_small | (is_empty & ~inside.is_known)
        self._done.append(some((inside, region.astype(np.int8), binding), done))
        columns = Followed(
            inside.near, inside.is_known, relation, (states, has_ranks, signs), np.zeros((len(signs), 0))
        )
        split = np.full(len(done), self._places[0])
        left = some(Boxes(inside.lower, inside.upper, boxes.bound, split, columns), ~done)
        return BoxResults(left, -math.inf, len(done))

    def _with_ranks(self, boxes: LoopBoxes, is_regular: NDArray[np.bool_], signs: NDArray[np.int32]) -> LoopBoxes:
        """Return boxes with their dependent coordinates where known; update ``is_regular`` and ``signs``."""
        boxes = some(boxes, np.arange(len(is_regular)))
        rows = np.flatnonzero(~is_regular)
        for k, examiner in enumerate(self._robot.examiners):
            if not rows.size:
                break
            found = examiner.examine(some(boxes, rows))
            for whole, part in zip(boxes, found.boxes, strict=True):
                whole[rows] = part
            if not k:
                signs[rows] = found.signs
            is_regular[rows] = found.is_regular
            rows = rows[found.is_regular]
        return boxes

    def _with_near(self, boxes: LoopBoxes, low: FloatArray, high: FloatArray) -> tuple[LoopBoxes, NDArray[np.bool_]]:
        """Return boxes with joint positions from the nearest grid point, and which boxes are not bisected further.

        Grid points are followed from the middle without a jump; the loops may be closed nowhere in a box.
        """
        at = np.rint(self._in_grid(0.5 * (low + high))).astype(np.intp)
        closed = self._grid[at[:, 0], at[:, 1]]
        use = ~boxes.is_known & np.isfinite(closed).all(axis=1)
        total = np.zeros((POINTS + 1, POINTS + 1))
        total[1:, 1:] = np.isfinite(self._grid).all(axis=-1).cumsum(axis=0).cumsum(axis=1)
        begin = np.clip(np.floor(self._in_grid(low)), 0, POINTS - 1).astype(np.intp)
        end = np.clip(np.ceil(self._in_grid(high)), 0, POINTS - 1).astype(np.intp) + 1
        count = total[end[:, 0], end[:, 1]] - total[begin[:, 0], end[:, 1]]
        count += total[begin[:, 0], begin[:, 1]] - total[end[:, 0], begin[:, 1]]
        return boxes._replace(near=np.where(use[:, None], closed, boxes.near)), ~boxes.is_known & ~(count > 0)

    def _in_grid(self, points: FloatArray, steps: int = POINTS - 1) -> FloatArray:
        """Return points (B, 2) of the slice as fractional indices of a grid, with a number of steps along each side."""
        return (points - self._lower) / (self._upper - self._lower) * steps

    def _closed_grid(self) -> FloatArray:
        """Return grid points (N, N, n) with loops closed from the middle outwards; NaN where they do not close."""
        start, dependent = self._problem.start, self._dependent
        grid = np.broadcast_to(start, (POINTS, POINTS, len(start))).copy()
        axes = [np.linspace(low, high, POINTS) for low, high in zip(self._lower, self._upper, strict=True)]
        grid[:, :, self._places] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        if not dependent:
            return grid
        middle = POINTS // 2
        away = np.stack(np.meshgrid(*[np.arange(POINTS) - middle] * 2, indexing="ij"), axis=-1)
        ring = np.abs(away).max(axis=-1)
        for r in range(middle + 1):
            at = np.argwhere(ring == r)
            back = at - np.sign(away[at[:, 0], at[:, 1]]) * (np.abs(away[at[:, 0], at[:, 1]]) == r) * (r > 0)
            z = grid[at[:, 0], at[:, 1]]
            z[:, dependent] = grid[back[:, 0], back[:, 1]][:, dependent]
            known = np.asarray(np.isfinite(z).all(axis=1))
            z[known] = self._examiner.loops.all_closed(z[known].T, dependent).T
            grid[at[:, 0], at[:, 1]] = np.where(known[:, None], z, np.nan)
        return grid

    def _is_of_middle(self, boxes: LoopBoxes) -> NDArray[np.bool_]:
        """Return whether each box (B,) of the cover is provably in the assembly mode of the middle.

        Neighbours are found on the grid of the smallest boxes.
        """
        ends = (each[:, self._places] for each in (boxes.lower, boxes.upper))
        low, high = (np.rint(self._in_grid(each, _SIDE)).astype(np.intp) for each in ends)
        owner = np.empty((_SIDE, _SIDE), dtype=np.int64)
        for k, (begin, end) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
            owner[begin[0] : end[0], begin[1] : end[1]] = k
        pairs = [(owner[1:].ravel(), owner[:-1].ravel()), (owner[:, 1:].ravel(), owner[:, :-1].ravel())]
        both = np.unique(np.sort(np.concatenate([np.stack(each, axis=1) for each in pairs]), axis=1), axis=0)
        both = both[(both[:, 0] != both[:, 1]) & boxes.is_known[both].all(axis=1)]
        with np.errstate(invalid="ignore"):
            holds = ((boxes.lower <= self._problem.start) & (boxes.upper >= self._problem.start)).all(axis=1)
        return one_assembly(self._examiner, boxes, both, boxes.is_known & holds)
