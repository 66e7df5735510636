"""Boxes that cover a slice of any robot: closed loops followed from the middle, ranks, reach and limits over each."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from .....models.joints.closedform import closed_form
from ....case.case import Case
from ....errors import CaseError, UncoveredError
from ...boxes.rows import WHOLE, Boxes, joined, some
from ...boxes.search import Verdicts
from ..ranks.krawczyk import Relation
from ..ranks.loop_boxes import Cells, Examiner
from ..ranks.rank_rule import RankTest
from ..robot.closed_loops import Loops
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, build_problem
from .anylimits import AnyLimits
from .assemblies import same_assembly
from .firstviolated import POINTS, FirstViolated, grid_points
from .limitcells import SliceLimit
from .regions import UNDECIDED, Cover, CoverRule, Region, cover_of, index_of

#: Boxes that are examined at once.
_BLOCK = 512


class Covered(NamedTuple):
    """A covered slice, its limits, and the keys of limits that it does not show."""

    cover: Cover
    limits: tuple[SliceLimit, ...]
    uncovered: tuple[str, ...]


class _Columns(NamedTuple):
    """Columns of the boxes of a slice.

    Attributes:
        near, is_known: those of :class:`..ranks.loop_boxes.Cells`.
        states: (B, K) of the claims about limits.
        is_regular: (B,) whether all ranks are proved to be full.
        relation: of the dependent coordinates.
    """

    near: FloatArray
    is_known: NDArray[np.bool_]
    states: NDArray[np.int8]
    is_regular: NDArray[np.bool_]
    relation: Relation


class AnySlices:
    """Slices of a robot.

    Args:
        case: with fixed dimensions.
        box: its workspace.

    Attributes:
        problem: the robot over the workspace.
        limits: its limits.
        examiners: of its ranks.

    Raises:
        CaseError: the loops are not closed in the middle of the workspace, or have an operation without a rule.
    """

    def __init__(self, case: Case, box: PoseBox) -> None:
        closed = closed_form(case.model)
        try:
            self.problem = problem = build_problem(case, closed.model, box)
            self.limits = AnyLimits(case, closed, problem)
            matrices = [problem.locked, *([] if problem.unactuated is None else [problem.unactuated])]
            tests = [RankTest(each, problem.z, problem.start) for each in matrices]
            self.examiners = [Examiner(problem, each) for each in tests]
        except (NotJudgedError, UncoveredError) as error:
            raise CaseError("workspace", f"has no slices: {error}", source=case.source) from None
        self._dependent = list(problem.dependent)
        # Of a square matrix the sign of the determinant is a statement too.
        own = ca.densify(problem.locked.matrix)
        self._matrix = ca.Function("M", [problem.z], [own]) if own.shape[0] == own.shape[1] else None

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of those numbers of the pose, among the six of a box, that the robot can choose."""
        return tuple(self.problem.free[k] for k in self.problem.independent)

    def cover(self, wide: PoseBox, chosen: list[int]) -> Covered:
        """Return the cover of a slice.

        Args:
            wide: has the ends of the slice.
            chosen: its two coordinates.
        """
        problem, limits = self.problem, self.limits
        places = [problem.free.index(k) for k in chosen]
        lower, upper = wide.lower[chosen], wide.upper[chosen]
        grid = self._grid(places, lower, upper)
        first = FirstViolated(
            lambda: limits.violated(grid.reshape(POINTS**2, -1)).reshape(-1, POINTS, POINTS),
            len(limits.limits),
            lower,
            upper,
        )
        rule = _SliceRule(self, grid, first, places, lower, upper)
        cells, region, binding = joined(rule.done)
        if self._dependent:
            is_one = same_assembly(self.examiners[0], problem, cells, places, (lower, upper))
            region = np.where(is_one, region, index_of(Region.UNKNOWN)).astype(np.int8)
            binding = np.where(is_one, binding, UNDECIDED).astype(np.int16)
        if self._matrix is not None:
            self._with_signs(cells, region)
        cover = cover_of(cells.lower[:, places], cells.upper[:, places], region, binding)
        return Covered(cover, limits.limits, limits.uncovered)

    def with_ranks(self, cells: Cells, is_regular: NDArray[np.bool_]) -> tuple[Cells, NDArray[np.bool_]]:
        """Return boxes with dependent coordinates where these are known, and whether all ranks are proved."""
        rows = np.flatnonzero(~(is_regular & cells.is_known))
        if not rows.size:
            return cells, is_regular
        parts = some(cells, rows)
        regular = np.ones(len(rows), dtype=bool)
        for examiner in self.examiners:
            left = np.flatnonzero(regular)
            found = examiner.examine(some(parts, left))
            for whole, part in zip(parts, found.cells, strict=True):
                whole[left] = part
            regular[left] = found.is_regular
        every = some(cells, np.arange(len(cells.lower)))
        for target, part in zip(every, parts, strict=True):
            target[rows] = part
        is_regular = is_regular.copy()
        is_regular[rows] = regular
        return every, is_regular

    def _grid(self, places: list[int], lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return closed loops (N, N, n) at the points of the grid, followed from the middle; NaN where they end."""
        problem, dependent = self.problem, self._dependent
        grid = np.broadcast_to(problem.start, (POINTS, POINTS, len(problem.start))).copy()
        grid[:, :, places] = grid_points(lower, upper)
        if not dependent:
            return grid
        loops: Loops = self.examiners[0].loops
        middle = POINTS // 2
        away = np.stack(np.meshgrid(*[np.arange(POINTS) - middle] * 2, indexing="ij"), axis=-1)
        ring = np.abs(away).max(axis=-1)
        for r in range(middle + 1):
            at = np.argwhere(ring == r)
            back = at - np.sign(away[at[:, 0], at[:, 1]]) * (np.abs(away[at[:, 0], at[:, 1]]) == r) * (r > 0)
            z = grid[at[:, 0], at[:, 1]]
            z[:, dependent] = grid[back[:, 0], back[:, 1]][:, dependent]
            known = np.asarray(np.isfinite(z).all(axis=1))
            z[known] = loops.all_closed(z[known].T, dependent).T
            grid[at[:, 0], at[:, 1]] = np.where(known[:, None], z, np.nan)
        return grid

    def _with_signs(self, cells: Cells, region: NDArray[np.int8]) -> None:
        """Set the region of regular boxes in which the determinant has another sign than in the middle."""
        rows = np.flatnonzero(region == index_of(Region.REGULAR))
        own = self._sign(self.problem.start[None])[0]
        for begin in range(0, len(rows), _BLOCK):
            some = rows[begin : begin + _BLOCK]
            region[some[self._sign(cells.centre[some]) != own]] = index_of(Region.OTHER_SIGN)

    def _sign(self, z: FloatArray) -> FloatArray:
        """Return the signs (B,) of the determinant at points (B, n)."""
        if self._matrix is None:
            raise TypeError("a matrix that is not square has no determinant")
        size = self._matrix.size1_out(0)
        found = self._matrix(z.T).full().reshape(size, len(z), size).transpose(1, 0, 2)
        return np.asarray(np.linalg.slogdet(found)[0])


class _SliceRule(CoverRule[_Columns]):
    """Rule of ranks, reach and limits over the boxes of a slice.

    Args:
        slices: of the robot.
        grid: (N, N, n) closed loops at the points of the grid.
        first: the limits that are violated first.
        places: indices of the coordinates of the slice.
        lower, upper: (2,) its ends.

    Attributes:
        done: the boxes that are decided, and indices of regions and limits.
    """

    block = _BLOCK

    def __init__(
        self,
        slices: AnySlices,
        grid: FloatArray,
        first: FirstViolated,
        places: list[int],
        lower: FloatArray,
        upper: FloatArray,
    ) -> None:
        super().__init__(places, lower, upper)
        self._slices, self._grid, self._first = slices, grid, first
        self.done: list[tuple[Cells, NDArray[np.int8], NDArray[np.int16]]] = []
        problem = slices.problem
        self._independent, dependent = list(problem.independent), list(problem.dependent)
        ends = np.stack([problem.start, problem.start])
        ends[0, places], ends[1, places] = lower, upper
        ends[:, dependent] = np.nan
        k, f = len(dependent), len(self._independent)
        nothing = np.zeros((1, k)), np.zeros((1, k, f)), np.full((1, k), np.inf), np.zeros((1, k, 0))
        columns = _Columns(
            problem.start[None].copy(),
            np.full(1, not dependent),
            slices.limits.unknown.T,
            np.zeros(1, dtype=bool),
            Relation(*nothing),
        )
        self.cover(Boxes(ends[:1], ends[1:], np.zeros(1), np.array([WHOLE]), columns))

    def divided(self, boxes: Boxes[_Columns]) -> Boxes[_Columns]:
        """Return the quarters of boxes, with the dependent coordinates that follow where they are known."""
        parts, count = super().divided(boxes), len(boxes.split)
        sides = np.zeros(parts.lower.shape)
        sides[:, self._places[0]] = np.tile(np.repeat([-1.0, 1.0], count), 2)
        sides[:, self._places[1]] = np.repeat([-1.0, 1.0], 2 * count)
        cells = Cells(parts.lower, parts.upper, parts.more.near, parts.more.is_known)
        found = self._slices.examiners[0].narrowed(cells, parts.more.relation, sides[:, self._independent])
        return parts._replace(lower=found.lower, upper=found.upper)

    def examine(self, boxes: Boxes[_Columns]) -> Verdicts[_Columns]:
        """Return the boxes that are not decided."""
        slices, low, high, small = self._slices, *self.ends(boxes.lower, boxes.upper)
        near, is_known, known, is_regular, relation = boxes.more
        # Closed loops of the nearest point of the grid: those of the middle, followed without a jump.
        at = np.rint(self._in_grid(0.5 * (low + high))).astype(np.intp)
        closed = self._grid[at[:, 0], at[:, 1]]
        use = ~is_known & np.isfinite(closed).all(axis=1)
        cells = Cells(boxes.lower, boxes.upper, np.where(use[:, None], closed, near), is_known)
        # Where the loops are closed at no point of the grid in and around a box, none of its parts is tried.
        is_empty = ~is_known & ~self._has_point(low, high)
        cells, is_regular = slices.with_ranks(cells, is_regular)
        relation = Relation(*(np.array(each) for each in relation))
        reached, unreached = np.zeros(len(small), dtype=bool), np.zeros(len(small), dtype=bool)
        rows, states = np.flatnonzero(cells.is_known), known.T.copy()
        if rows.size:
            found = slices.limits.examine(some(cells, rows), states[:, rows])
            for whole, part in zip(relation, found.relation, strict=True):
                whole[rows] = part
            reached[rows], unreached[rows], states[:, rows] = found.reached, found.unreached, found.states
        is_regular &= reached
        binding, is_same = self._first.of(slices.limits.states(states), low, high)
        region = np.where(reached, index_of(Region.OPEN), index_of(Region.UNKNOWN))
        region[is_regular] = index_of(Region.REGULAR)
        region[unreached] = index_of(Region.UNREACHED)
        binding[~reached] = UNDECIDED
        done = (is_regular & is_same) | unreached | small | (is_empty & ~cells.is_known)
        self.done.append(some((cells, region.astype(np.int8), binding), done))
        columns = _Columns(cells.near, cells.is_known, states.T, is_regular, relation)
        return self.open(Boxes(cells.lower, cells.upper, boxes.bound, boxes.split, columns), done)

    def _in_grid(self, points: FloatArray) -> FloatArray:
        """Return points (B, 2) of the slice as fractional indices of the grid."""
        return (points - self._lower) / (self._upper - self._lower) * (POINTS - 1)

    def _has_point(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return whether loops are closed at a point of the grid in or beside each box (B,)."""
        total = np.zeros((POINTS + 1, POINTS + 1))
        total[1:, 1:] = np.isfinite(self._grid).all(axis=-1).cumsum(axis=0).cumsum(axis=1)
        begin = np.clip(np.floor(self._in_grid(lower)), 0, POINTS - 1).astype(np.intp)
        end = np.clip(np.ceil(self._in_grid(upper)), 0, POINTS - 1).astype(np.intp) + 1
        found = total[end[:, 0], end[:, 1]] - total[begin[:, 0], end[:, 1]]
        return np.asarray(found - total[end[:, 0], begin[:, 1]] + total[begin[:, 0], begin[:, 1]] > 0)
