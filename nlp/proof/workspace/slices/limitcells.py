"""Limits over the boxes of a slice: each kept, or violated, at every pose of a box, or open.

A limit on an expression is decided by the ranges of :mod:`screwsynth.nlp.proof.enclosure`, one on the clearance of
legs by its bound from below and by how far the legs move within the box. A limit on singular values is proved to be
kept by its bound; it counts as violated where it is so at the corners and at the middle of the box, which is no proof.
"""

from __future__ import annotations

import enum
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import Dimension, FloatArray
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.task import Sense
from ....errors import UncoveredError
from ....program.layout import Layout
from ...enclosure.forms import enclose
from ...enclosure.tape import compile_tape
from ...statement.claims import Claim, claims_of
from ...statement.machine import Legs
from ..numbers.clearance import Clearance
from ..numbers.limit_values import ON_LIMIT
from ..numbers.singular import SingularValues
from ..numbers.spectrum import Spectrum
from ..robot.box_layout import box_layout
from ..robot.pose_box import PoseBox

#: Boxes that are examined at once: the terms of six legs over one box take some ten thousand numbers.
_BLOCK = 1024
_CLEARANCE = "leg_clearance.min"


class LimitState(enum.IntEnum):
    """A limit over a box."""

    KEPT = 0
    OPEN = 1
    VIOLATED = 2


@dataclass(frozen=True, eq=False)
class SliceLimit:
    """A limit of a slice.

    Attributes:
        key: dotted key, below ``limits``, in the case.
        limit: the limit, radians for angles.
        dimension: of the limit.
        is_enclosed: whether boxes where it is violated are proved so, and not by samples.
    """

    key: str
    limit: float
    dimension: Dimension
    is_enclosed: bool


class _Part(Protocol):
    """A limit, or a part of it, such as that on one pair of legs."""

    @property
    def key(self) -> str:
        """Dotted key, below ``limits``, in the case."""

    def states(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.int8]:
        """Return the states (B,) over boxes (B, 6)."""

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return whether it is violated at points (P, 6): (P,)."""


class LimitCells:
    """The limits of a case over the boxes of a slice.

    Args:
        case: with fixed dimensions.
        legs: its joint centres.
        box: the slice: only the chosen coordinates vary.
        chosen: the two coordinates of the slice.
    """

    def __init__(self, case: Case, legs: Legs, box: PoseBox, chosen: Sequence[int]) -> None:
        parts: list[_Part] = []
        limits: dict[str, SliceLimit] = {}
        uncovered: dict[str, None] = {}
        layout = box_layout(case, box, chosen)
        claims = [claim for claim in claims_of(layout, with_objective=False) if claim.limit is not None]
        for key in dict.fromkeys(claim.key for claim in claims):
            own = [claim for claim in claims if claim.key == key]
            try:
                parts.append(_Expressions(layout, own, chosen))
            except UncoveredError:
                uncovered[key] = None
                continue
            value = own[0].reading.from_value(own[0].limit or 0.0)
            limits[key] = SliceLimit(key, value, own[0].reading.dimension, is_enclosed=True)
        #: Keys of limits whose expressions have an operation without a rule.
        self.uncovered = tuple(uncovered)
        for limit in case.limits:
            if isinstance(limit, LegClearance):
                pairs = itertools.combinations(range(len(legs.base)), 2)
                parts += [_Apart(Clearance(legs, box, one, other), limit.min) for one, other in pairs]
                limits[_CLEARANCE] = SliceLimit(_CLEARANCE, limit.min, Dimension.LENGTH, is_enclosed=True)
            elif isinstance(limit, SmallestSingularValue):
                key = "smallest_singular_value.min"
                oracle = SingularValues(legs, box, limit.length, is_condition=False)
                parts.append(SampledLimit(key, oracle, limit.min))
                limits[key] = SliceLimit(key, limit.min, Dimension.NUMBER, is_enclosed=False)
            elif isinstance(limit, ConditionNumber):
                key = "condition_number.max"
                oracle = SingularValues(legs, box, limit.length, is_condition=True)
                parts.append(SampledLimit(key, oracle, -limit.max))
                limits[key] = SliceLimit(key, limit.max, Dimension.NUMBER, is_enclosed=False)
        self._parts = tuple(parts)
        #: The limits, one for each key.
        self.limits = tuple(limits.values())
        places = {key: k for k, key in enumerate(limits)}
        self._places = [places[part.key] for part in parts]

    @property
    def unknown(self) -> NDArray[np.int8]:
        """(K, 1) states of the parts of the limits before anything is known."""
        return np.full((len(self._parts), 1), LimitState.OPEN, dtype=np.int8)

    def examine(self, known: NDArray[np.int8], lower: FloatArray, upper: FloatArray) -> NDArray[np.int8]:
        """Return the states (K, B) of the parts of the limits over boxes (B, 6), from those of larger boxes (K, B)."""
        found = known.copy()
        for row, part in zip(found, self._parts, strict=True):
            left = np.flatnonzero(row == LimitState.OPEN)
            for begin in range(0, len(left), _BLOCK):
                some = left[begin : begin + _BLOCK]
                row[some] = part.states(lower[some], upper[some])
        return found

    def states(self, found: NDArray[np.int8]) -> NDArray[np.int8]:
        """Return the states (M, B) of the limits from those of their parts (K, B)."""
        return states_of_limits(found, self._places, len(self.limits))

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return whether each limit is violated at points (P, 6): (M, P)."""
        found = np.zeros((len(self.limits), len(points)), dtype=np.bool_)
        for place, part in zip(self._places, self._parts, strict=True):
            for begin in range(0, len(points), _BLOCK):
                block = slice(begin, begin + _BLOCK)
                found[place, block] |= part.violated(points[block])
        return found


class _Expressions:
    """The claims of one limit about expressions of the pose.

    Raises:
        UncoveredError: an expression has an operation without a rule.
    """

    def __init__(self, layout: Layout, claims: Sequence[Claim], chosen: Sequence[int]) -> None:
        self.key = claims[0].key
        self._chosen = list(chosen)
        table = layout.table
        fixed = SX(ca.DM(table.values))
        values = [ca.substitute(claim.expression, table.arguments_vector, fixed) for claim in claims]
        function = ca.Function("limits", [table.variables_vector], [ca.densify(ca.vertcat(*values))])
        self._tape = compile_tape(function)
        limits = np.array([claim.limit or 0.0 for claim in claims])[:, None]
        self._sign = np.array([1.0 if claim.sense is Sense.MAX else -1.0 for claim in claims])[:, None]
        self._limit = self._sign * limits + ON_LIMIT * np.abs(limits)

    def states(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.int8]:
        found = enclose(self._tape, lower[:, self._chosen].T, upper[:, self._chosen].T)
        is_most = self._sign > 0
        most, least = np.where(is_most, found.hi, -found.lo), np.where(is_most, found.lo, -found.hi)
        return states_of((most <= self._limit).all(axis=0), (least > self._limit).any(axis=0))

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        at = points[:, self._chosen].T
        return np.asarray((self._sign * enclose(self._tape, at, at).c > self._limit).any(axis=0))


class _Apart:
    """The clearance of a pair of legs."""

    key = _CLEARANCE

    def __init__(self, pair: Clearance, limit: float) -> None:
        self._pair = pair
        self._limit = limit - ON_LIMIT * abs(limit)

    def states(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.int8]:
        bounds = self._pair.bounds(lower, upper)
        # Each of the two legs moves by at most the sum of the shares from its place at the middle of the box.
        most = self._pair.values(0.5 * lower + 0.5 * upper) + 2 * bounds.shares.sum(axis=1)
        return states_of(bounds.lower >= self._limit, most < self._limit)

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        return np.asarray(self._pair.values(points) < self._limit)


class SampledLimit:
    """A function that is bounded from below only; violated where it is so at the corners and the middle of a box."""

    def __init__(self, key: str, oracle: SingularValues | Spectrum, limit: float) -> None:
        self.key = key
        self._oracle = oracle
        self._limit = limit - ON_LIMIT * abs(limit)

    def states(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.int8]:
        """Return the states (B,) over boxes (B, 6)."""
        kept = self._oracle.bounds(lower, upper).lower >= self._limit
        free = np.flatnonzero((upper > lower).any(axis=0))
        violated = self.violated(0.5 * lower + 0.5 * upper)
        for sides in itertools.product((False, True), repeat=len(free)):
            corner = lower.copy()
            for k, is_upper in zip(free, sides, strict=True):
                corner[:, k] = upper[:, k] if is_upper else lower[:, k]
            violated &= self.violated(corner)
        return states_of(kept, violated)

    def violated(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return whether it is violated at points (P, 6): (P,)."""
        return np.asarray(self._oracle.values(points) < self._limit)


def states_of(kept: NDArray[np.bool_], violated: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Return states from whether each claim is proved to be kept, or violated."""
    return np.where(kept, LimitState.KEPT, np.where(violated, LimitState.VIOLATED, LimitState.OPEN)).astype(np.int8)


def states_of_limits(found: NDArray[np.int8], places: Sequence[int], count: int) -> NDArray[np.int8]:
    """Return the states (M, B) of limits, each the worst of its parts.

    Args:
        found: (K, B) states of the parts.
        places: (K,) the limit of each part.
        count: number M of the limits.
    """
    states = np.full((count, found.shape[1]), LimitState.KEPT, dtype=np.int8)
    for place, row in zip(places, found, strict=True):
        states[place] = np.maximum(states[place], row)
    return states
