"""Reach and limits over the boxes of a slice: satisfied at every pose of a box, violated at every pose, or open.

Reach and limits on expressions are decided by ranges, clearances of legs by lower and upper bounds. A limit on
singular values, or on an actuator quantity, is proved by a lower bound. Such a limit counts as violated if the corners
and the centre of the box violate it; this is not a proof.
"""

from __future__ import annotations

import enum
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import Dimension, FloatArray
from .....models.arrays import values_at
from .....models.joints.model.closedform import ClosedForm
from ....case.case import Case
from ....case.task import Sense
from ....case.workspace import Workspace
from ....errors import UncoveredError
from ...boxes.search import some
from ...enclosure.forms import Encloser
from ...statement.claims import Claim, dependent_claims, searched_claims
from ...statement.motors import motor_claims
from ..numbers.bound_search import Number
from ..numbers.clearance import Clearance
from ..numbers.expressions import ranges
from ..numbers.motors import Motors
from ..numbers.searched import Subject
from ..numbers.within_tolerance import RobotsWithinTolerance
from ..ranks.krawczyk import Coordinates, Relation, relation_of, with_relation
from ..ranks.loop_boxes import LoopBoxes
from ..robot.pose_box import pose_box
from ..robot.posed_robot import NotJudgedError, build_problem
from ..verdict import slack_of

#: Values in place of the index of a violated limit of a box: all limits are proved, or nothing is proved.
KEPT, UNDECIDED = -1, -2
#: Number of grid points along each side of a slice, and along each line from its middle, for the first violated limit.
POINTS, _STEPS = 65, 96


class LimitState(enum.IntEnum):
    """State of a limit over a box."""

    KEPT = 0
    OPEN = 1
    VIOLATED = 2


@dataclass(frozen=True, eq=False)
class SliceLimit:
    """Limit of a case that a slice shows.

    Attributes:
        key: dotted key below ``limits`` in the case.
        limit: value of the limit, radians for angles.
        dimension: dimension of the limit.
        is_enclosed: whether violations over boxes are proved, and not only sampled.
    """

    key: str
    limit: float
    dimension: Dimension
    is_enclosed: bool


class SliceLimits:
    """Reach of limbs, and limits of a case, over boxes.

    Claims, such as the distance of one pair of legs, are ordered: reach, limits on expressions, other limits.

    Args:
        case: case with fixed dimensions.
        closed: robot of the case, with closed forms in place of unknowns.
        workspace: box of poses, with the robot's dependent coordinates.

    Attributes:
        problem: the robot over the workspace.
        uncovered: keys of limits that are not decided on boxes.
        limits: the limits, one for each key.

    Raises:
        NotJudgedError: the loops are not closed in the middle of the workspace.
        UncoveredError: a loop equation, or the reach of a limb, has an operation without an interval rule.
    """

    def __init__(self, case: Case, closed: ClosedForm, workspace: Workspace) -> None:
        case = replace(case, joint_centre_tolerance=None)
        self.problem = problem = build_problem(case, closed.model, pose_box(workspace))
        alone = RobotsWithinTolerance(case, closed, problem)
        reaches, claims = alone.symbols.claims((), with_objective=False)
        claims += dependent_claims(alone.symbols.layout.robots[0], workspace)
        known = [claim for claim in claims if claim.limit is not None and alone.is_covered(claim)]
        uncovered = dict.fromkeys(each.key for each in claims if each.limit is not None and each not in known)
        limits: dict[str, SliceLimit] = {}
        for claim in known:
            limit = claim.reading.from_value(claim.limit or 0.0)
            limits.setdefault(claim.key, SliceLimit(claim.key, limit, claim.reading.dimension, is_enclosed=True))
        subject = Subject(case, closed.model, problem)
        self._others: list[_Other] = []
        motors = [each for each in motor_claims(case) if each.limit is not None]
        groups = [[each] for each in searched_claims(case)]
        groups += [list(group) for _, group in itertools.groupby(motors, lambda each: each.motor and each.motor.place)]
        for group in groups:
            try:
                number = Motors(problem, case, group) if group[0].motor else subject.number(group[0])
                other = _Other([each.key for each in group], number, np.array(list(map(_least, group))))
            except (NotJudgedError, UncoveredError):
                uncovered |= dict.fromkeys(each.key for each in group)
                continue
            for claim in group:
                limit, dimension = claim.limit or 0.0, claim.reading.dimension
                limits[claim.key] = SliceLimit(claim.key, limit, dimension, is_enclosed=other.is_enclosed)
            self._others.append(other)
        keys = [*(each.key for each in known), *(key for each in self._others for key in each.keys)]
        self._places, self._reaches = [list(limits).index(key) for key in keys], len(reaches)
        self.uncovered, self.limits = tuple(uncovered), tuple(limits.values())
        self._of = Coordinates(list(problem.independent), list(problem.dependent), [])
        self._leasts = np.array([_least(claim) for claim in (*reaches, *known)])
        numbers = ca.vertcat(SX(0, 1), *map(alone.number, (*reaches, *known)))
        # The last entry is not used; it makes the vector nonempty.
        self._encloser = Encloser(problem.z, ca.vertcat(SX(0, 1), problem.equations, numbers, problem.z[0]))
        self._function = ca.Function("numbers", [problem.z], [ca.densify(numbers)])

    @property
    def unknown(self) -> NDArray[np.int8]:
        """Initial states (1, K) of the claims."""
        return np.full((1, self._reaches + len(self._places)), LimitState.OPEN, dtype=np.int8)

    def examine(self, boxes: LoopBoxes, relation: Relation, known: NDArray[np.int8]) -> NDArray[np.int8]:
        """Return the states (B, K) of the claims over boxes.

        Args:
            boxes: (B,) boxes; states of boxes with unknown dependent coordinates stay as they are.
            relation: relation of the dependent coordinates; the examination updates this relation in place.
            known: (B, K) states over larger boxes.
        """
        states, enclosed, k = known.copy(), len(self._leasts), len(self._of.dependent)
        is_open = (states == LimitState.OPEN) & boxes.is_known[:, None]
        rows = np.flatnonzero(is_open[:, :enclosed].any(axis=1) | (boxes.is_known & bool(k)))
        if rows.size:
            forms = self._encloser(boxes.lower[rows].T, boxes.upper[rows].T)
            own = relation_of(forms.part(slice(0, k)), self._of)
            for whole, part in zip(relation, own, strict=True):
                whole[rows] = part
            lower, upper = ranges(with_relation(forms.part(slice(k, -1)), own, self._of))
            found = _states_of(lower >= self._leasts, upper < self._leasts)
            states[rows, :enclosed] = np.where(is_open[rows, :enclosed], found, states[rows, :enclosed])
        last = enclosed
        for each in self._others:
            first, last = last, last + len(each.keys)
            rows = np.flatnonzero(is_open[:, first:last].any(axis=1))
            if rows.size:
                found = each.states(some(boxes, rows))
                states[rows, first:last] = np.where(is_open[rows, first:last], found, states[rows, first:last])
        return states

    def reached(self, states: NDArray[np.int8]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return whether all limbs reach every pose of each box, and whether a limb reaches none; states are (B, K)."""
        own = states[:, : self._reaches]
        return np.asarray((own == LimitState.KEPT).all(axis=1)), np.asarray((own == LimitState.VIOLATED).any(axis=1))

    def of_limits(self, states: NDArray[np.int8]) -> NDArray[np.int8]:
        """Return the states (M, B) of the limits: the worst state of the claims (B, K) of each limit."""
        found = np.full((len(self.limits), len(states)), LimitState.KEPT, dtype=np.int8)
        np.maximum.at(found, self._places, states[:, self._reaches :].T)
        return found

    def violated(self, z: FloatArray) -> NDArray[np.bool_]:
        """Return whether each limit is violated at points (P, n) with closed loops, (M, P); False for NaN."""
        found = np.zeros((len(self.limits), len(z)), dtype=np.bool_)
        with np.errstate(all="ignore"):
            numbers = values_at(self._function, z)[0][:, :, 0].T
            claims = [*(numbers < self._leasts[:, None])[self._reaches :]]
            claims += [row for each in self._others for row in each.violated(z).T]
        for place, claim in zip(self._places, claims, strict=True):
            found[place] |= claim
        return found


def _least(claim: Claim) -> float:
    """Return the smallest allowed value of a claim's quantity, negated for a largest value; 0 without a limit."""
    limit = claim.limit or 0.0
    return (limit if claim.sense is Sense.MIN else -limit) - slack_of(limit)


def _states_of(kept: NDArray[np.bool_], violated: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Return the states of claims from two arrays: whether each claim is proved, and whether it is violated."""
    return np.where(kept, LimitState.KEPT, np.where(violated, LimitState.VIOLATED, LimitState.OPEN)).astype(np.int8)


class _Other:
    """Limits on quantities that are not expressions of the pose.

    Args:
        keys: keys of the K limits.
        number: the quantities.
        leasts: (K,) smallest allowed values.

    Attributes:
        keys: keys of the K limits.
        is_enclosed: whether violations over boxes are proved, and not only sampled.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """

    def __init__(self, keys: Sequence[str], number: Number, leasts: FloatArray) -> None:
        self.keys, self._number, self._leasts, self._examiner = keys, number, leasts, number.examiner
        self.is_enclosed = isinstance(number, Clearance) and not number.problem.dependent

    def states(self, boxes: LoopBoxes) -> NDArray[np.int8]:
        """Return the states (B, K) over boxes with known dependent coordinates.

        A limit on a quantity without an upper bound counts as violated if the corners and the centre of a box violate
        it.
        """
        kept = self._examiner.examine(boxes).smallest >= self._leasts
        if isinstance(self._number, Clearance) and self.is_enclosed:
            return _states_of(kept, self._number.most(boxes.lower, boxes.upper)[:, None] < self._leasts)
        middle = self._number.closed(0.5 * boxes.lower + 0.5 * boxes.upper)
        violated = self.violated(middle)
        free = [k for k in self._number.problem.independent if (boxes.upper > boxes.lower)[:, k].any()]
        for sides in itertools.product((boxes.lower, boxes.upper), repeat=len(free)):
            corner = middle.copy()
            for k, ends in zip(free, sides, strict=True):
                corner[:, k] = ends[:, k]
            violated &= self.violated(self._number.closed(corner))
        return _states_of(kept, violated)

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return whether each limit is violated at points (P, n) with closed loops: (P, K)."""
        return np.asarray(self._number.values(points) < self._leasts)


class FirstViolated:
    """First violated limit on the straight line from the middle of a slice.

    Violations over boxes are proved by enclosures; which of several limits comes first is sampled at points.

    Args:
        limits: the limits.
        grid: (N, N, n) points with closed loops on the grid of the slice.
        lower: (2,) lower ends of the slice.
        upper: (2,) upper ends of the slice.
    """

    def __init__(self, limits: SliceLimits, grid: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        self._limits, self._grid, self._lower, self._upper = limits, grid, lower, upper

    @cached_property
    def _violated(self) -> NDArray[np.bool_]:
        """Whether each limit is violated at points of the grid, (M, N, N)."""
        return self._limits.violated(self._grid.reshape(POINTS**2, -1)).reshape(-1, POINTS, POINTS)

    def of(
        self, states: NDArray[np.int8], lower: FloatArray, upper: FloatArray
    ) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
        """Return the limit of each box (``KEPT``, ``UNDECIDED`` or an index), and whether it concerns the whole box.

        Args:
            states: (M, B) states of the limits over the boxes.
            lower: (B, 2) lower ends of the boxes.
            upper: (B, 2) upper ends of the boxes.
        """
        violated = states == LimitState.VIOLATED
        limit = np.where((states == LimitState.OPEN).any(axis=0), UNDECIDED, KEPT).astype(np.int16)
        is_same = limit == KEPT
        rows = np.flatnonzero(violated.any(axis=0))
        if not rows.size:
            return limit, is_same
        limit[rows] = np.argmax(violated[:, rows], axis=0)
        # Another open limit may be violated first in a part of the box.
        is_same[rows] = (states[:, rows] == LimitState.KEPT).sum(axis=0) == len(states) - 1
        several = rows[~is_same[rows]]
        if several.size:
            low, high = lower[several], upper[several]
            limit[several] = self._first(violated[:, several], 0.5 * (low + high))
            corners = [np.column_stack([x[:, 0], y[:, 1]]) for x in (low, high) for y in (low, high)]
            candidates = states[:, several] != LimitState.KEPT
            around = [self._first(candidates, corner) for corner in corners]
            is_same[several] = np.all([each == limit[several] for each in around], axis=0)
        return limit, is_same

    def _first(self, candidates: NDArray[np.bool_], ends: FloatArray) -> NDArray[np.int16]:
        """Return which of the candidates (M, C) is violated first on the line to each end (C, 2)."""
        middle = 0.5 * (self._lower + self._upper)
        way = middle + np.linspace(0.0, 1.0, _STEPS)[:, None, None] * (ends - middle)
        place = np.rint((way - self._lower) / (self._upper - self._lower) * (POINTS - 1)).astype(np.intp)
        on_way = self._violated[:, place[..., 0], place[..., 1]] & candidates[:, None]
        # A limit that is violated at no point of the line comes last.
        begins = np.where(on_way.any(axis=1), np.argmax(on_way, axis=1), _STEPS)
        begins = np.where(candidates, begins, _STEPS + 1)
        return np.asarray(np.argmin(begins, axis=0), dtype=np.int16)
