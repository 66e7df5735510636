"""Reach of limbs and numbers with a limit, of any robot, over boxes with dependent coordinates that follow from others.

Ranges of expressions over a box are those of their forms, in which the dependent coordinates are replaced by their
relation to the independent ones (:mod:`.relation`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Substitution
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.task import Sense
from ....errors import UncoveredError
from ...enclosure.forms import Encloser, Forms
from ...enclosure.tape import compile_tape
from ...statement.claims import claims_of
from ...statement.tolerance import coordinate_layout
from ..ranks.krawczyk import ROUNDING, Coordinates, Relation, relation_of, with_relation
from ..ranks.loop_boxes import LoopBoxes
from ..robot.pose_box import pose_coordinates
from ..robot.posed_robot import Problem

#: Part of a limit by which a value may be beyond it and still count as on it: rounding, as in the proofs.
ON_LIMIT = 1e-9


class Ranges(NamedTuple):
    """Ranges of R expressions over B boxes.

    Attributes:
        lower, upper: (B, R) smallest and largest values; infinite where nothing is known.
        slopes: (B, R, f) derivatives by the f independent coordinates, times their half widths.
    """

    lower: FloatArray
    upper: FloatArray
    slopes: FloatArray


class Enclosed(NamedTuple):
    """Results for B boxes: the relation of dependent coordinates, and ranges of the reach of limbs and of numbers."""

    relation: Relation
    reach: Ranges
    numbers: Ranges


class LimitValues:
    """Reach of limbs and numbers with a limit over boxes.

    The numbers are those of the claims times their signs, so that all limits are largest values.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        problem: this robot over the workspace.

    Raises:
        UncoveredError: a loop equation, or the reach of a limb, holds an operation without a rule.
    """

    def __init__(self, case: Case, closed: ClosedForm, problem: Problem) -> None:
        self._of = Coordinates(list(problem.independent), list(problem.dependent), [])
        layout = coordinate_layout(replace(case, model=closed.model), pose_coordinates(problem.box))
        # The variables of the layout are those of the problem, in its order.
        given = [problem.z, SX(ca.DM(layout.table.values))]
        own = [layout.table.variables_vector, layout.table.arguments_vector]
        robot, symbols = layout.robots[0], Substitution.identity(closed.model).all
        unknowns = layout.table.variables_vector[len(problem.free) :]
        at = [robot.parameters, unknowns, robot.rotation, robot.position]
        reach = ca.Function("reach", symbols, [each.value for each in closed.reaches]).call(at)
        claims = [claim for claim in claims_of(layout, with_objective=False) if claim.limit is not None]
        values = ca.Function("values", own, [*reach, *(claim.expression for claim in claims)]).call(given)
        self._reaches, uncovered = len(reach), dict[str, None]()
        pairs = list(zip(claims, values[len(reach) :], strict=True))
        for claim, value in pairs:
            try:
                compile_tape(ca.Function("number", [problem.z], [ca.densify(value)]))
            except UncoveredError:
                uncovered[claim.key] = None
        kept = [(claim, value) for claim, value in pairs if claim.key not in uncovered]
        #: The claims whose numbers have bounds, and keys of those that hold an operation without a rule.
        self.claims, self.uncovered = tuple(claim for claim, _ in kept), tuple(uncovered)
        signs = [1.0 if claim.sense is Sense.MAX else -1.0 for claim in self.claims]
        #: (K,) signs of the claims.
        self.sign = np.array(signs)
        bounds = np.array([claim.limit or 0.0 for claim in self.claims])
        #: (K,) largest values allowed of the numbers, with room for rounding.
        self.limit = self.sign * bounds + ON_LIMIT * np.abs(bounds)
        numbers = ca.vertcat(SX(0, 1), *[sign * value for sign, (_, value) in zip(signs, kept, strict=True)])
        # A last entry that is not used, for a robot without any.
        entries = ca.vertcat(SX(0, 1), problem.equations, *values[: len(reach)], numbers, problem.z[0])
        self._encloser = Encloser(problem.z, entries)
        self._function = ca.Function("numbers", [problem.z], [ca.densify(numbers)])

    def enclosed(self, boxes: LoopBoxes) -> Enclosed:
        """Return ranges over boxes (B,) whose dependent coordinates are known."""
        k, reaches = len(self._of.dependent), self._reaches
        forms = self._encloser(boxes.lower.T, boxes.upper.T)
        relation = relation_of(forms.part(slice(0, k)), self._of)
        found = with_relation(forms.part(slice(k, -1)), relation, self._of)
        return Enclosed(relation, _ranges(found.part(slice(0, reaches))), _ranges(found.part(slice(reaches, None))))

    def values(self, z: FloatArray) -> FloatArray:
        """Return the numbers (K, P) at points (P, n); not finite where a limb does not reach."""
        with np.errstate(all="ignore"):
            return np.asarray(self._function(z.T).full().reshape(len(self.claims), len(z)))


def _ranges(forms: Forms) -> Ranges:
    """Return the ranges of expressions."""
    with np.errstate(all="ignore"):
        half = (np.abs(forms.a).sum(axis=2) + forms.r) * (1 + ROUNDING) + ROUNDING * np.abs(forms.c)
        lower, upper = forms.c - half, forms.c + half
    known = np.isfinite(lower) & np.isfinite(upper)
    return Ranges(np.where(known, lower, -np.inf), np.where(known, upper, np.inf), forms.a)
