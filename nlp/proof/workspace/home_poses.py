"""A machine at single poses with its joints in home's assembly, as ``evaluate`` shows it.

A pose refutes a claim only where the machine has the fault in this assembly. Searches follow closed loops over boxes,
by Newton's method, or take them as conditions, and may find the pose in another one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...case.case import Case
from ...case.task import Sense
from ...errors import EvaluationError
from ...evidence.closing import closed_in_place
from ...evidence.mobility import mobility_of
from ...evidence.singularities import is_passive_singular
from ...evidence.state import evaluate
from ...program.layout import Layout
from ..statement.claims import REACH, Claim, claims_of
from ..statement.machine import CentreErrors
from ..statement.posed_layout import extreme_program
from ..statement.tolerance import coordinate_layout
from .numbers.extremes import Extreme, slack_of
from .robot.pose_box import PoseBox, pose_coordinates
from .tolerance.machines import Machines
from .verdict import Outcome

#: Reasons for a claim that poses of other assemblies leave open.
_ELSEWHERE = "poses beyond the limit are known in other assemblies of the joints than home's alone"
_WIDER = "the bound holds in every assembly of the joints, and the value reached is one of home's"
#: Part of its size by which a value in home's assembly differs from that of the same assembly in a search.
_SAME = 1e-6


class _HomePoses:
    """A machine at single poses, in the assembly of home.

    Args:
        layout: a case as symbols of the numbers of a pose, and of errors of joint centres.
        claims: numbers in its symbols.
    """

    def __init__(self, layout: Layout, claims: Sequence[Claim] = ()) -> None:
        self._nlp = nlp = extreme_program(layout, SX(0), Sense.MIN)
        self._claims = {(each.name, each.sense): k for k, each in reversed(list(enumerate(claims)))}
        self._numbers = tuple(claims)
        values = ca.vertcat(SX(0, 1), *[each.expression for each in claims])
        self._values = ca.Function("values", [nlp.program.x, nlp.program.p], [ca.densify(values)])
        inner = set(nlp.program.places.inner)
        self._given = [k for k in range(nlp.n) if k not in inner]

    def closed(self, given: FloatArray) -> FloatArray | None:
        """Return the point of the program with closed loops at given numbers, in their order; None without one."""
        x = self._nlp.start.copy()
        x[self._given] = given
        return closed_in_place(self._nlp, x)

    def is_singular(self, given: FloatArray, *, constraints: bool = False) -> bool:
        """Return whether J, or the constraint wrenches alone, lose their rank at given numbers."""
        x = self.closed(given)
        if x is None:
            return False
        # Where nested loops lose their rank, the actuators' motions have no value, and say nothing of constraints.
        if constraints and self._nlp.program.model.nested and is_passive_singular(self._nlp, x):
            return False
        try:
            state = evaluate(self._nlp, x)
        except EvaluationError:
            return False
        if not constraints:
            return state.is_singular
        found, generic = mobility_of(self._nlp, x, state), self._nlp.program.model.generic
        return found is None or generic is None or found.constraint_rank < generic.constraints

    def shown(self, each: Extreme, given: FloatArray) -> Extreme:
        """Return an extreme with its value in home's assembly, and open where only another one refutes it.

        Args:
            each: with a pose.
            given: the numbers of the pose.
        """
        x, k = self.closed(given), self._claims.get((each.name, each.sense))
        if x is None:
            nowhere = replace(each, reached=np.nan, pose=None)
            if each.limit is None:
                return _opened(nowhere, _WIDER) if each.outcome is Outcome.PROVED else nowhere
            return _opened(nowhere, _ELSEWHERE) if each.outcome is Outcome.REFUTED else nowhere
        if k is None:
            return each
        claim, sign = self._numbers[k], 1.0 if each.sense is Sense.MAX else -1.0
        value = float(self._values(x, self._nlp.arguments)[k])
        reached = claim.reading.from_value(value)
        found = replace(each, reached=reached)
        if each.limit is not None and claim.limit is not None:
            if sign * (value - claim.limit) > slack_of(claim.limit):
                return replace(found, outcome=Outcome.REFUTED, reason="")
            return _opened(found, _ELSEWHERE) if each.outcome is Outcome.REFUTED else found
        is_other = abs(reached - each.reached) > _SAME * max(abs(each.reached), 1e-6)
        return _opened(found, _WIDER) if is_other and each.outcome is Outcome.PROVED else found


def _opened(each: Extreme, reason: str) -> Extreme:
    """Return an extreme whose claim is open."""
    return replace(each, outcome=Outcome.OPEN, reason=reason)


class Homes:
    """The design of a case, and machines within its tolerance, at single poses in the assembly of home.

    Args:
        case: with fixed dimensions.
        box: the poses.
        quantities: names of measures of the robot.
        machines: every machine within the tolerance; None where only the design is meant.

    Attributes:
        case, box, machines: as given.
    """

    def __init__(self, case: Case, box: PoseBox, quantities: Sequence[str], machines: Machines | None) -> None:
        self.case, self.box, self.machines, self._quantities = case, box, machines, quantities

    @cached_property
    def _design(self) -> _HomePoses:
        layout = coordinate_layout(self.case, pose_coordinates(self.box))
        return _HomePoses(layout, claims_of(layout, self._quantities))

    @cached_property
    def _built(self) -> _HomePoses:
        if self.machines is None:
            raise TypeError("no machines are meant")
        layout = self.machines.symbols.layout
        return _HomePoses(layout, claims_of(layout, self._quantities))

    def is_singular(self, y: FloatArray, centres: CentreErrors | None, *, constraints: bool) -> bool:
        """Return whether J, or the constraint wrenches alone, lose their rank at a pose (6,), as ``evaluate`` shows it.

        Args:
            y: coordinates of the pose.
            centres: errors of the joint centres of another machine than the design.
            constraints: whether the constraint wrenches are meant.
        """
        if not self.case.model.unknowns:
            return True
        poses, given = self._at(y, centres)
        return poses.is_singular(given, constraints=constraints)

    def shown(self, each: Extreme) -> Extreme:
        """Return an extreme with its value in home's assembly, and open where only another one refutes it."""
        if not self.case.model.unknowns or each.pose is None or each.key == REACH:
            return each
        poses, given = self._at(self.box.coordinates(each.pose), each.centres)
        return poses.shown(each, given)

    def _at(self, y: FloatArray, centres: CentreErrors | None) -> tuple[_HomePoses, FloatArray]:
        """Return the design or the machines, with the numbers of a pose and of errors."""
        own = y[list(self.box.free)]
        if centres is None:
            return self._design, own
        return self._built, np.concatenate([centres.vectors.ravel(), own])
