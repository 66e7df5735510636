"""Reach of limbs and limits of any robot over the boxes of a slice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .....models import Dimension, FloatArray
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ..numbers.limit_values import LimitValues
from ..numbers.spectrum import Spectrum
from ..ranks.krawczyk import Relation
from ..ranks.loop_boxes import Cells
from ..robot.posed_robot import Problem
from .limitcells import LimitState, SampledLimit, SliceLimit, states_of, states_of_limits


class Judged(NamedTuple):
    """Results for B boxes.

    Attributes:
        relation: of the dependent coordinates.
        reached: (B,) whether all limbs reach every pose of the box, proved.
        unreached: (B,) whether a limb reaches no pose of it, proved.
        states: (K, B) of the claims about limits.
    """

    relation: Relation
    reached: NDArray[np.bool_]
    unreached: NDArray[np.bool_]
    states: NDArray[np.int8]


class AnyLimits:
    """Reach of limbs and limits of a robot over boxes.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        problem: this robot over the workspace.

    Raises:
        UncoveredError: a loop equation holds an operation without a rule.
    """

    def __init__(self, case: Case, closed: ClosedForm, problem: Problem) -> None:
        self._problem, self._values = problem, LimitValues(case, closed, problem)
        limits: dict[str, SliceLimit] = {}
        for claim in self._values.claims:
            limit = claim.reading.from_value(claim.limit or 0.0)
            limits.setdefault(claim.key, SliceLimit(claim.key, limit, claim.reading.dimension, is_enclosed=True))
        uncovered = dict.fromkeys(self._values.uncovered)
        self._sampled: list[SampledLimit] = []
        for each in case.limits:
            if isinstance(each, LegClearance):
                uncovered["leg_clearance.min"] = None
            if not isinstance(each, SmallestSingularValue | ConditionNumber):
                continue
            is_condition = isinstance(each, ConditionNumber)
            key, bound = (
                ("condition_number.max", each.max)
                if isinstance(each, ConditionNumber)
                else ("smallest_singular_value.min", each.min)
            )
            if problem.dependent:
                uncovered[key] = None
                continue
            oracle = Spectrum(problem, each.length, is_condition=is_condition)
            self._sampled.append(SampledLimit(key, oracle, -bound if is_condition else bound))
            limits[key] = SliceLimit(key, bound, Dimension.NUMBER, is_enclosed=False)
        places = {key: k for k, key in enumerate(limits)}
        self._places = [places[each.key] for each in self._values.claims]
        self._places += [places[each.key] for each in self._sampled]
        #: Keys of limits that are not decided on boxes.
        self.uncovered = tuple(uncovered)
        #: The limits, one for each key.
        self.limits = tuple(limits.values())

    @property
    def unknown(self) -> NDArray[np.int8]:
        """(K, 1) states of the claims about limits before anything is known."""
        return np.full((len(self._places), 1), LimitState.OPEN, dtype=np.int8)

    def examine(self, cells: Cells, known: NDArray[np.int8]) -> Judged:
        """Judge boxes whose dependent coordinates are known.

        Args:
            cells: (B,) boxes.
            known: (K, B) states of the claims over larger boxes.
        """
        found = self._values.enclosed(cells)
        limit = self._values.limit
        new = states_of(found.numbers.upper <= limit, found.numbers.lower > limit).T
        sampled = known[len(new) :].copy()
        for row, own in zip(sampled, self._sampled, strict=True):
            left = np.flatnonzero(row == LimitState.OPEN)
            row[left] = own.states(*(self._problem.pose_of(each[left]) for each in (cells.lower, cells.upper)))
        states = np.concatenate([np.where(known[: len(new)] == LimitState.OPEN, new, known[: len(new)]), sampled])
        return Judged(
            found.relation,
            np.asarray((found.reach.lower >= 0).all(axis=1)),
            np.asarray((found.reach.upper < 0).any(axis=1)),
            states.astype(np.int8),
        )

    def states(self, found: NDArray[np.int8]) -> NDArray[np.int8]:
        """Return the states (M, B) of the limits from those of their claims (K, B)."""
        return states_of_limits(found, self._places, len(self.limits))

    def violated(self, z: FloatArray) -> NDArray[np.bool_]:
        """Return whether each limit is violated at points (P, n) with closed loops: (M, P); not where it is NaN."""
        found = np.zeros((len(self.limits), len(z)), dtype=np.bool_)
        with np.errstate(all="ignore"):
            own = self._values.values(z) > self._values.limit[:, None]
            parts = [*own, *(limit.violated(self._problem.pose_of(z)) for limit in self._sampled)]
        for place, part in zip(self._places, parts, strict=True):
            found[place] |= part
        return found
