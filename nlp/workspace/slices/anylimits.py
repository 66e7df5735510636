"""Reach of limbs and limits of any robot over the boxes of a slice, with dependent coordinates that follow from others.

Ranges of expressions over a box are those of their forms, in which the dependent coordinates are replaced by their
relation to the independent ones (:mod:`..general.relation`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from ....models import Dimension, FloatArray, Substitution
from ....models.joints.closedform import ClosedForm
from ...case.case import Case
from ...case.limits.clearance import LegClearance
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.task import Sense
from ...certificate.enclosing.instructions import compile_tape
from ...errors import UncoveredError
from ..claims import claims_of
from ..general.cells import Cells
from ..general.enclosing import Encloser, Forms
from ..general.problem import Problem
from ..general.relation import ROUNDING, Relation, relation_of
from ..general.spectrum import Spectrum
from .limitcells import ON_LIMIT, LimitState, SampledLimit, SliceLimit, slice_layout, states_of


class Ranges(NamedTuple):
    """Smallest and largest values (B, R) of expressions over boxes."""

    lower: FloatArray
    upper: FloatArray


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
        self._problem = problem
        self._independent, self._dependent = list(problem.independent), list(problem.dependent)
        layout = slice_layout(replace(case, model=closed.model), problem.box, problem.free)
        # The variables of the layout are those of the problem, in its order.
        given = [problem.z, SX(ca.DM(layout.table.values))]
        own = [layout.table.variables_vector, layout.table.arguments_vector]
        robot, symbols = layout.robots[0], Substitution.identity(closed.model).all
        unknowns = layout.table.variables_vector[len(problem.free) :]
        at = [robot.parameters, unknowns, robot.rotation, robot.position]
        reach = ca.Function("reach", symbols, [each.value for each in closed.reaches]).call(at)
        claims = [claim for claim in claims_of(layout, with_objective=False) if claim.limit is not None]
        function = ca.Function("values", own, [*reach, *(claim.expression for claim in claims)])
        values = [ca.densify(each) for each in function.call(given)]
        self._reaches, rest = len(reach), values[len(reach) :]
        limits: dict[str, SliceLimit] = {}
        uncovered: dict[str, None] = {}
        for claim, value in zip(claims, rest, strict=True):
            try:
                compile_tape(ca.Function("limit", [problem.z], [value]))
            except UncoveredError:
                uncovered[claim.key] = None
        kept = [(claim, value) for claim, value in zip(claims, rest, strict=True) if claim.key not in uncovered]
        for claim, _ in kept:
            limit = claim.reading.from_value(claim.limit or 0.0)
            limits.setdefault(claim.key, SliceLimit(claim.key, limit, claim.reading.dimension, is_enclosed=True))
        places = {key: k for k, key in enumerate(limits)}
        self._places = [places[claim.key] for claim, _ in kept]
        bounds = np.array([claim.limit or 0.0 for claim, _ in kept])
        self._sign = np.array([1.0 if claim.sense is Sense.MAX else -1.0 for claim, _ in kept])
        self._limit = self._sign * bounds + ON_LIMIT * np.abs(bounds)
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
            if self._dependent:
                uncovered[key] = None
                continue
            oracle = Spectrum(problem, each.length, is_condition=is_condition)
            self._sampled.append(SampledLimit(key, oracle, -bound if is_condition else bound))
            self._places.append(len(limits))
            limits[key] = SliceLimit(key, bound, Dimension.NUMBER, is_enclosed=False)
        #: Keys of limits that are not decided on boxes.
        self.uncovered = tuple(uncovered)
        #: The limits, one for each key.
        self.limits = tuple(limits.values())
        expressions = ca.vertcat(problem.equations, *values[: len(reach)], *(value for _, value in kept))
        # A last entry that is not used, for a robot without limits.
        self._encloser = Encloser(problem.z, ca.vertcat(SX(0, 1), expressions, problem.z[0]))
        self._function = ca.Function("limits", [problem.z], [ca.densify(ca.vertcat(SX(0, 1), *(v for _, v in kept)))])

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
        k, reaches = len(self._dependent), self._reaches
        forms = self._encloser(cells.lower.T, cells.upper.T)
        relation = relation_of(forms.part(slice(0, k)), self._independent, self._dependent, [])
        reach = self._ranges(forms.part(slice(k, k + reaches)), relation)
        values = self._ranges(forms.part(slice(k + reaches, -1)), relation)
        most = np.where(self._sign > 0, values.upper, -values.lower)
        least = np.where(self._sign > 0, values.lower, -values.upper)
        new = states_of(most <= self._limit, least > self._limit).T
        sampled = known[len(new) :].copy()
        for row, limit in zip(sampled, self._sampled, strict=True):
            left = np.flatnonzero(row == LimitState.OPEN)
            box = self._problem.box
            lower, upper = (self._problem.pose_of(each[left]) for each in (cells.lower, cells.upper))
            row[left] = limit.states(lower, upper) if box.free else LimitState.OPEN
        states = np.concatenate([np.where(known[: len(new)] == LimitState.OPEN, new, known[: len(new)]), sampled])
        return Judged(
            relation,
            np.asarray((reach.lower >= 0).all(axis=1)),
            np.asarray((reach.upper < 0).any(axis=1)),
            states.astype(np.int8),
        )

    def states(self, found: NDArray[np.int8]) -> NDArray[np.int8]:
        """Return the states (M, B) of the limits from those of their claims (K, B)."""
        states = np.full((len(self.limits), found.shape[1]), LimitState.KEPT, dtype=np.int8)
        for place, row in zip(self._places, found, strict=True):
            states[place] = np.maximum(states[place], row)
        return states

    def violated(self, z: FloatArray) -> NDArray[np.bool_]:
        """Return whether each limit is violated at points (P, n) with closed loops: (M, P); not where it is NaN."""
        found = np.zeros((len(self.limits), len(z)), dtype=np.bool_)
        with np.errstate(all="ignore"):
            own = self._sign[:, None] * self._function(z.T).full() > self._limit[:, None]
            parts = [*own, *(limit.violated(self._problem.pose_of(z)) for limit in self._sampled)]
        for place, part in zip(self._places, parts, strict=True):
            found[place] |= part
        return found

    def _ranges(self, forms: Forms, relation: Relation) -> Ranges:
        """Return the ranges of expressions; infinite where nothing is known."""
        own, others = forms.a[:, :, self._dependent], forms.a[:, :, self._independent]
        size = np.abs(own)
        with np.errstate(all="ignore"):
            middle = forms.c + (own @ relation.off[:, :, None])[:, :, 0]
            slope = np.abs(others - own @ relation.T).sum(axis=2)
            rest = forms.r + (size @ relation.rho[:, :, None])[:, :, 0]
            terms = np.abs(forms.c) + np.abs(others).sum(axis=2) + (size @ relation.reach[:, :, None])[:, :, 0]
            half = (slope + rest) * (1 + ROUNDING) + ROUNDING * terms
            lower, upper = middle - half, middle + half
        known = np.isfinite(lower) & np.isfinite(upper)
        return Ranges(np.where(known, lower, -np.inf), np.where(known, upper, np.inf))
