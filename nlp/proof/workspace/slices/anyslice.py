"""Boxes that cover a slice of any robot: closed loops followed from the middle, ranks, reach and limits over each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from .....models.joints.closedform import closed_form
from ....case.case import Case
from ....errors import CaseError, UncoveredError
from ..ranks.krawczyk import Relation
from ..ranks.loop_boxes import Cells, Examiner, joined
from ..ranks.rank_rule import RankTest
from ..robot.closed_loops import Loops
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, build_problem
from .anylimits import AnyLimits
from .assemblies import same_assembly
from .firstviolated import POINTS, FirstViolated, grid_points
from .limitcells import SliceLimit
from .regions import LEAST, SIDES, UNDECIDED, Cover, Region, quarters

#: Boxes that are examined at once.
_BLOCK = 512
#: Parts of a quarter by which ends of dependent coordinates move outwards: rounding.
_ROUNDING, _SUMS = 1e-14, 1e-12
#: Order of the regions in arrays.
_REGIONS = tuple(Region)


class Covered(NamedTuple):
    """A covered slice, its limits, and the keys of limits that it does not show."""

    cover: Cover
    limits: tuple[SliceLimit, ...]
    uncovered: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Boxes:
    """B boxes of a slice.

    Attributes:
        cells: their ends; dependent coordinates are NaN until they are known.
        states: (K, B) of the claims about limits.
        is_regular: (B,) whether all ranks are proved to be full.
        region: (B,) indices of regions.
        binding: (B,) indices of limits.
        is_done: (B,) whether a box is decided.
        relation: of the dependent coordinates.
    """

    cells: Cells
    states: NDArray[np.int8]
    is_regular: NDArray[np.bool_]
    region: NDArray[np.int8]
    binding: NDArray[np.int16]
    is_done: NDArray[np.bool_]
    relation: Relation


class AnySlices:
    """Slices of a robot.

    Args:
        case: with fixed dimensions.
        box: its workspace.

    Raises:
        CaseError: the loops are not closed in the middle of the workspace, or have an operation without a rule.
    """

    def __init__(self, case: Case, box: PoseBox) -> None:
        closed = closed_form(case.model)
        try:
            self._problem = problem = build_problem(case, closed.model, box)
            self._limits = AnyLimits(case, closed, problem)
            matrices = [problem.locked, *([] if problem.unactuated is None else [problem.unactuated])]
            tests = [RankTest(each, problem.z, problem.start) for each in matrices]
            self._examiners = [Examiner(problem, each, None, None) for each in tests]
        except (NotJudgedError, UncoveredError) as error:
            raise CaseError("workspace", f"has no slices: {error}", source=case.source) from None
        self._dependent = list(problem.dependent)
        # Of a square matrix the sign of the determinant is a statement too.
        own = ca.densify(problem.locked.matrix)
        self._matrix = ca.Function("M", [problem.z], [own]) if own.shape[0] == own.shape[1] else None

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of those numbers of the pose, among the six of a box, that the robot can choose."""
        return tuple(self._problem.free[k] for k in self._problem.independent)

    def cover(self, wide: PoseBox, chosen: list[int]) -> Covered:
        """Return the cover of a slice.

        Args:
            wide: has the ends of the slice.
            chosen: its two coordinates.
        """
        problem, limits = self._problem, self._limits
        places = [problem.free.index(k) for k in chosen]
        lower, upper = wide.lower[chosen], wide.upper[chosen]
        grid = self._grid(places, lower, upper)
        first = FirstViolated(
            lambda: limits.violated(grid.reshape(POINTS**2, -1)).reshape(-1, POINTS, POINTS),
            len(limits.limits),
            lower,
            upper,
        )
        ends = np.stack([problem.start, problem.start])
        ends[0, places], ends[1, places] = lower, upper
        ends[:, self._dependent] = np.nan
        is_known = np.full(1, not self._dependent)
        left = Cells(ends[:1], ends[1:], problem.start[None].copy(), is_known), limits.unknown, np.zeros(1, dtype=bool)
        done: list[_Boxes] = []
        while len(left[1].T):
            cells = left[0]
            # Closed loops of the nearest point of the grid: those of the middle, followed without a jump.
            centre = 0.5 * (cells.lower + cells.upper)[:, places]
            at = np.rint((centre - lower) / (upper - lower) * (POINTS - 1)).astype(np.intp)
            near = grid[at[:, 0], at[:, 1]]
            use = ~cells.is_known & np.isfinite(near).all(axis=1)
            left = cells._replace(near=np.where(use[:, None], near, cells.near)), *left[1:]
            # Where the loops are closed at no point of the grid in and around a box, none of its parts is tried.
            is_empty = ~cells.is_known & ~self._has_point(grid, cells, places, lower, upper)
            blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(centre), _BLOCK)]
            parts = [self._examine(*_some(left, each), is_empty[each], first, places, upper - lower) for each in blocks]
            done += [_of(each, each.is_done) for each in parts]
            left = _next([_of(each, ~each.is_done) for each in parts], places, list(problem.independent), problem.size)
        return Covered(self._cover(done, places, (lower, upper)), limits.limits, limits.uncovered)

    def _examine(
        self,
        cells: Cells,
        known: NDArray[np.int8],
        is_regular: NDArray[np.bool_],
        is_empty: NDArray[np.bool_],
        first: FirstViolated,
        places: list[int],
        width: FloatArray,
    ) -> _Boxes:
        """Examine boxes, which are known to be regular already or not, and may have no closed loops."""
        count, k = len(cells.lower), len(self._dependent)
        cells, is_regular = self._with_ranks(cells, is_regular)
        slopes, errors = np.zeros((count, k, len(self.free))), np.zeros((count, k, 0))
        relation = Relation(np.zeros((count, k)), slopes, np.full((count, k), np.inf), errors)
        reached, unreached = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        rows = np.flatnonzero(cells.is_known)
        states = known.copy()
        if rows.size:
            found = self._limits.examine(cells.some(rows), known[:, rows])
            for whole, part in zip(relation, found.relation, strict=True):
                whole[rows] = part
            reached[rows], unreached[rows], states[:, rows] = found.reached, found.unreached, found.states
        is_regular &= reached
        low, high = cells.lower[:, places], cells.upper[:, places]
        small = (high - low <= LEAST * width).all(axis=1)
        binding, is_same = first.of(self._limits.states(states), low, high)
        region = np.where(reached, _REGIONS.index(Region.OPEN), _REGIONS.index(Region.UNKNOWN))
        region[is_regular] = _REGIONS.index(Region.REGULAR)
        region[unreached] = _REGIONS.index(Region.UNREACHED)
        binding[~reached] = UNDECIDED
        is_done = (is_regular & is_same) | unreached | small | (is_empty & ~cells.is_known)
        return _Boxes(cells, states, is_regular, region.astype(np.int8), binding, is_done, relation)

    def _with_ranks(self, cells: Cells, is_regular: NDArray[np.bool_]) -> tuple[Cells, NDArray[np.bool_]]:
        """Return boxes with dependent coordinates where these are known, and whether all ranks are proved."""
        rows = np.flatnonzero(~(is_regular & cells.is_known))
        if not rows.size:
            return cells, is_regular
        parts = cells.some(rows)
        regular = np.ones(len(rows), dtype=bool)
        for examiner in self._examiners:
            some = np.flatnonzero(regular)
            found = examiner.examine(parts.some(some))
            for whole, part in zip(parts, found.cells, strict=True):
                whole[some] = part
            regular[some] = found.is_regular
        every = cells.some(np.arange(len(cells.lower)))
        for target, part in zip(every, parts, strict=True):
            target[rows] = part
        is_regular = is_regular.copy()
        is_regular[rows] = regular
        return every, is_regular

    def _grid(self, places: list[int], lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return closed loops (N, N, n) at the points of the grid, followed from the middle; NaN where they end."""
        problem, dependent = self._problem, self._dependent
        grid = np.broadcast_to(problem.start, (POINTS, POINTS, len(problem.start))).copy()
        grid[:, :, places] = grid_points(lower, upper)
        if not dependent:
            return grid
        loops: Loops = self._examiners[0].loops
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

    def _has_point(
        self, grid: FloatArray, cells: Cells, places: list[int], lower: FloatArray, upper: FloatArray
    ) -> NDArray[np.bool_]:
        """Return whether loops are closed at a point of the grid in or beside each box (B,)."""
        total = np.zeros((POINTS + 1, POINTS + 1))
        total[1:, 1:] = np.isfinite(grid).all(axis=-1).cumsum(axis=0).cumsum(axis=1)
        low, high = ((each[:, places] - lower) / (upper - lower) * (POINTS - 1) for each in (cells.lower, cells.upper))
        begin = np.clip(np.floor(low), 0, POINTS - 1).astype(np.intp)
        end = np.clip(np.ceil(high), 0, POINTS - 1).astype(np.intp) + 1
        found = total[end[:, 0], end[:, 1]] - total[begin[:, 0], end[:, 1]]
        return np.asarray(found - total[end[:, 0], begin[:, 1]] + total[begin[:, 0], begin[:, 1]] > 0)

    def _cover(self, done: list[_Boxes], places: list[int], ends: tuple[FloatArray, FloatArray]) -> Cover:
        """Return the boxes of a slice that are decided, those of other assemblies as not known."""
        cells = joined([each.cells for each in done])
        region, binding = (np.concatenate([getattr(each, name) for each in done]) for name in ("region", "binding"))
        if self._dependent:
            is_one = same_assembly(self._examiners[0], self._problem, cells, places, ends)
            region = np.where(is_one, region, _REGIONS.index(Region.UNKNOWN))
            binding = np.where(is_one, binding, UNDECIDED).astype(np.int16)
        if self._matrix is not None:
            self._with_signs(cells, region)
        boxes = np.concatenate([cells.lower[:, places], cells.upper[:, places]], axis=1)
        binding.flags.writeable = False
        return Cover(boxes, tuple(_REGIONS[k] for k in region.tolist()), binding)

    def _with_signs(self, cells: Cells, region: NDArray[np.int8]) -> None:
        """Set the region of regular boxes in which the determinant has another sign than in the middle."""
        rows = np.flatnonzero(region == _REGIONS.index(Region.REGULAR))
        own = self._sign(self._problem.start[None])[0]
        for begin in range(0, len(rows), _BLOCK):
            some = rows[begin : begin + _BLOCK]
            region[some[self._sign(cells.centre[some]) != own]] = _REGIONS.index(Region.OTHER_SIGN)

    def _sign(self, z: FloatArray) -> FloatArray:
        """Return the signs (B,) of the determinant at points (B, n)."""
        if self._matrix is None:
            raise TypeError("a matrix that is not square has no determinant")
        size = self._matrix.size1_out(0)
        found = self._matrix(z.T).full().reshape(size, len(z), size).transpose(1, 0, 2)
        return np.asarray(np.linalg.slogdet(found)[0])


_Left = tuple[Cells, NDArray[np.int8], NDArray[np.bool_]]


def _some(left: _Left, which: slice) -> _Left:
    """Return some of the boxes that are left."""
    cells, states, is_regular = left
    return cells.some(np.arange(len(cells.lower))[which]), states[:, which], is_regular[which]


def _of(boxes: _Boxes, which: NDArray[np.bool_]) -> _Boxes:
    """Return some of the boxes."""
    return _Boxes(
        boxes.cells.some(which),
        boxes.states[:, which],
        boxes.is_regular[which],
        boxes.region[which],
        boxes.binding[which],
        boxes.is_done[which],
        Relation(*(each[which] for each in boxes.relation)),
    )


def _next(parts: list[_Boxes], places: list[int], independent: list[int], size: FloatArray) -> _Left:
    """Return the quarters of boxes, with the dependent coordinates that follow where they are known."""
    dependent = [k for k in range(len(size)) if k not in independent]
    cells = joined([each.cells for each in parts])
    relation = Relation(*(np.concatenate(each) for each in zip(*(one.relation for one in parts), strict=True)))
    lower, upper = quarters(cells.lower, cells.upper, places)
    count, columns = len(cells.lower), [independent.index(k) for k in places]
    if dependent and count:
        middle, half = 0.5 * (cells.lower + cells.upper)[:, dependent], 0.5 * (cells.upper - cells.lower)[:, dependent]
        total = np.abs(relation.T).sum(axis=2)
        own = relation.T[:, :, columns]
        reach = total - 0.5 * np.abs(own).sum(axis=2) + relation.rho + _SUMS * (np.abs(relation.off) + total)
        slack, half = _ROUNDING * np.abs(middle), half * (1 + _ROUNDING)
        for k, sides in enumerate(SIDES):
            # A chosen coordinate lies in [-1, 0] or [0, 1] of the whole box.
            centre = relation.off - own @ np.where(sides, 0.5, -0.5)
            with np.errstate(all="ignore"):
                low = middle + half * np.maximum(centre - reach, -1.0) - slack
                high = middle + half * np.minimum(centre + reach, 1.0) + slack
            rows = slice(k * count, (k + 1) * count)
            for target, found in ((lower, np.minimum(low, high)), (upper, np.maximum(low, high))):
                part = target[rows]
                part[:, dependent] = np.where(cells.is_known[:, None], found, np.nan)
    near, is_known = np.tile(cells.near, (4, 1)), np.tile(cells.is_known, 4)
    states = np.tile(np.concatenate([each.states for each in parts], axis=1), 4)
    is_regular = np.tile(np.concatenate([each.is_regular for each in parts]), 4)
    return Cells(lower, upper, near, is_known), states, is_regular
