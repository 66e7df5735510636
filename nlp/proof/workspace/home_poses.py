"""Single poses of a robot in the home assembly mode, as ``evaluate`` computes them.

A pose refutes a claim only if the robot violates the claim in the home assembly mode. A search that treats the loop
equations as conditions may find the pose in another assembly mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray
from ...case.case import Case
from ...case.task import Sense
from ...errors import EvaluationError
from ...evidence.closing import closed_in_place
from ...evidence.mobility import mobility_of
from ...evidence.singularities import is_passive_singular
from ...evidence.state import evaluate
from ...program.layout import Layout, robot_length
from ...program.nlp import Nlp
from ..statement.claims import REACH, Claim, claims_of
from ..statement.fixed_robot import JointErrors
from ..statement.posed_layout import extreme_program
from ..statement.tolerance import coordinate_layout
from .numbers.within_tolerance import RobotsWithinTolerance
from .robot.pose_box import PoseBox, pose_coordinates
from .verdict import Outcome, Verdict, slack_of

#: Reasons for a claim that stays open because of other assembly modes.
_ELSEWHERE = "violations of the limit are known only in other assembly modes than home"
_WIDER = "the bound covers every assembly mode, but the best known value is in the home assembly mode"
#: Relative difference of two values in one assembly mode; and fraction of the quantity's typical value below which
#: values are 0.
_SAME, _SMALL = 1e-6, 1e-6


class Homes:
    """Nominal robot of a case, and robots within its tolerance, at single poses in the home assembly mode.

    Args:
        case: case with fixed dimensions.
        box: box of poses.
        quantities: names of quantities of the robot.
        robots: robots within the tolerance; None if only the nominal robot is judged.

    Attributes:
        case, box, robots: arguments of the constructor.
    """

    def __init__(
        self, case: Case, box: PoseBox, quantities: Sequence[str], robots: RobotsWithinTolerance | None
    ) -> None:
        self.case, self.box, self.robots, self._quantities = case, box, robots, quantities

    @cached_property
    def _layout(self) -> Layout:
        """The case as expressions of joint-centre errors and of the coordinates of a pose."""
        if self.robots is not None:
            return self.robots.symbols.layout
        return coordinate_layout(self.case, pose_coordinates(self.box))

    @cached_property
    def _nlp(self) -> Nlp:
        """Nonlinear program with the loop equations at a pose as constraints."""
        return extreme_program(self._layout, SX(0), Sense.MIN)

    @cached_property
    def _claims(self) -> dict[tuple[str, Sense], tuple[Claim, ca.Function]]:
        """Claims with functions for their values, by name and sense.

        Of two claims with the same name and sense, the first one is kept.
        """
        program, found = self._nlp.program, {}
        for each in reversed(claims_of(self._layout, self._quantities)):
            value = ca.Function("value", [program.x, program.p], [ca.densify(each.expression)])
            found[each.name, each.sense] = each, value
        return found

    def is_singular(self, y: FloatArray, errors: JointErrors | None, *, constraints: bool) -> bool:
        """Return whether J, or the constraint wrenches, lose their rank at a pose (6,), as ``evaluate`` reports it.

        Args:
            y: coordinates of the pose.
            errors: joint-centre errors of a robot within the tolerance; None for the nominal robot.
            constraints: If true, test the constraint wrenches instead of J.
        """
        if not self.case.model.unknowns:
            return True
        x = self._closed(y, errors)
        if x is None:
            return False
        # Where nested loops lose rank, the motions due to actuators are undefined and define no constraints.
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

    def shown(self, each: Verdict) -> Verdict:
        """Replace the value of a verdict by the value at its pose in the home assembly mode.

        The verdict becomes open if only another assembly mode refutes the claim.
        """
        if not self.case.model.unknowns or each.pose is None or each.key == REACH:
            return each
        x = self._closed(self.box.coordinates(each.pose), each.errors)
        is_limit = each.limit is not None
        wrong, reason = (Outcome.REFUTED, _ELSEWHERE) if is_limit else (Outcome.PROVED, _WIDER)
        opened = replace(each, outcome=Outcome.OPEN, reason=reason) if each.outcome is wrong else each
        if x is None:
            return replace(opened, reached=np.nan, pose=None)
        if (each.name, each.sense) not in self._claims:
            return each
        claim, function = self._claims[each.name, each.sense]
        value = float(function(x, self._nlp.arguments))
        reached = claim.reading.from_value(value)
        if is_limit and claim.limit is not None:
            sign = each.sense.sign
            if sign * (value - claim.limit) > slack_of(claim.limit):
                return replace(each, reached=reached, outcome=Outcome.REFUTED, reason="")
            return replace(opened, reached=reached)
        is_other = abs(reached - each.reached) > _SAME * max(abs(each.reached), _SMALL * self._size_of(claim))
        return replace(opened if is_other else each, reached=reached)

    def _size_of(self, claim: Claim) -> float:
        """Return the typical value of a quantity: the robot's size for lengths, F without cancellation for F."""
        if claim.reading.dimension is Dimension.LENGTH:
            return robot_length(self.case) ** claim.reading.power
        return self._nlp.objective_size if claim.name.partition(" ")[0] == "F" else 1.0

    def _closed(self, y: FloatArray, errors: JointErrors | None) -> FloatArray | None:
        """Close the loops at a pose (6,) of a robot, and return this point of the nonlinear program.

        None if the loops do not close.
        """
        nlp = self._nlp
        x, inner = nlp.start.copy(), set(nlp.program.places.inner)
        given = y[list(self.box.free)]
        if self.robots is not None:
            family = self.robots.family
            own = np.zeros(family.errors.numel()) if errors is None else errors.vectors.ravel()
            given = np.concatenate([own, given])
        x[[k for k in range(nlp.n) if k not in inner]] = given
        return closed_in_place(nlp, x)
