"""Standard form of a program for the search of its whole box: maximise the least of some functions under conditions.

    maximise  min_j phi_j(x)   over  lower <= x <= upper,   h_k(x) <= 0 or h_k(x) = 0

A minimum becomes a maximum of ``-F``. The worst case of several tasks is an epigraph in the program: a variable
``level`` with one constraint for each task. Here it is the least of the tasks' own functions again, without that
variable. The program's arguments are put in as doubles, and a proof is about the graph with these constants.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray, frozen_array
from ...evidence.state import CLOSED
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ...program.program import Program
from .form import Condition, StandardForm
from .minors import spectral_conditions
from .reduced_form import without_unknowns

__all__ = ["Condition", "StandardForm", "is_in_home_mode", "standard_form"]


class _BoundedExpression(NamedTuple):
    """A constraint with numbers in the place of the program's arguments."""

    name: str
    expression: SX
    lower: float
    upper: float


def standard_form(nlp: Nlp) -> StandardForm:
    """Return the standard form of a program with at least one variable."""
    nlp = with_all_pairs(nlp)
    program = nlp.program
    x = SX.sym("x", nlp.n)
    F, g = program.values.call([x, SX(ca.DM(nlp.arguments))])
    epigraph = program.places.epigraph
    count = nlp.n if epigraph is None else epigraph.level
    functions: list[SX] = [-nlp.sign * F]
    lower, upper = nlp.g_lower.tolist(), nlp.g_upper.tolist()
    constraints = [
        _BoundedExpression(constraint.name, g[k], lower[k], upper[k])
        for k, constraint in enumerate(program.constraints)
    ]
    if epigraph is not None:
        pairs = list(zip(constraints, program.constraints, strict=True))
        level = x[epigraph.level]
        functions = [
            _function_of_epigraph(each.expression, level, nlp.sign)
            for each, constraint in pairs
            if constraint in epigraph.constraints
        ]
        constraints = [each for each, constraint in pairs if constraint not in epigraph.constraints]
    further = _further_loop_equations(program, x, nlp.arguments)
    stated, implied, signs = _conditions(constraints), _conditions(further), _signs(nlp, x)
    stated += _of_singular_values(nlp, x)
    form = StandardForm(
        nlp=nlp,
        x=x[:count],
        lower=frozen_array(nlp.lower[:count], (count,)),
        upper=frozen_array(nlp.upper[:count], (count,)),
        functions=tuple(functions),
        conditions=(*stated, *implied, *signs),
        signs=tuple(signs),
        sign=-nlp.sign,
        has_epigraph=epigraph is not None,
    )
    if not nlp.in_home_mode:
        return form
    loops = _loop_names(program)
    return without_unknowns(form, [*(each for each in stated if each.name in loops), *implied, *signs])


def _of_singular_values(nlp: Nlp, x: SX) -> list[Condition]:
    """Return the conditions that follow from limits on the smallest singular value."""
    program = nlp.program
    found = [
        condition
        for k, each in enumerate(program.constraints)
        if each.spectral is not None
        for condition in spectral_conditions(each.name, each.spectral, float(nlp.g_lower[k]))
    ]
    if not found:
        return []
    function = ca.Function("minors", [program.x, program.p], [each.expression for each in found])
    values = function.call([x, SX(ca.DM(nlp.arguments))])
    return [replace(each, expression=value) for each, value in zip(found, values, strict=True)]


def _loop_names(program: Program) -> set[str]:
    """Return the names of all loop equations that a program may have as constraints."""
    count = len(program.robots)
    where = [f" pose {k + 1}" for k in range(count)] if count > 1 else [""]
    return {f"{each.name}{own}" for each in program.model.closure for own in where}


def _further_loop_equations(program: Program, x: SX, arguments: FloatArray) -> list[_BoundedExpression]:
    """Return the loop equations that the program leaves out, and distances that follow, with bounds of a closed loop.

    The former follow from those of the program near its answer, but not in the whole box: there joints that are
    assembled in no way at all may fulfil the program's equations. Numbers in the place of arguments leave rounding
    error in them, so that an exact equation could hold nowhere.
    """
    names = {constraint.name for constraint in program.constraints}
    further: dict[str, SX] = {}
    for k, robot in enumerate(program.robots):
        where = f" pose {k + 1}" if len(program.robots) > 1 else ""
        model = program.model
        pairs = (
            *zip(model.closure, ca.vertsplit(robot.closure), strict=True),
            *zip(model.distances, ca.vertsplit(robot.distances), strict=True),
        )
        for equation, expression in pairs:
            if f"{equation.name}{where}" not in names:
                further[f"{equation.name}{where}"] = expression
    if not further:
        return []
    function = ca.Function("loops", [program.x, program.p], list(further.values()))
    values = function.call([x, SX(ca.DM(arguments))])
    return [
        _BoundedExpression(name, each, -CLOSED, CLOSED)
        for name, each in zip(further, values, strict=True)
        if any(ca.which_depends(each, x, 1, True))
    ]


def is_in_home_mode(nlp: Nlp, x: FloatArray) -> bool | None:
    """Return whether a robot is in home's working mode at a point (n,); None where it has no sign of a mode."""
    if not nlp.n or not any(each.is_mode for each in nlp.program.model.signs):
        return None
    form = standard_form(replace(nlp, in_home_mode=True))
    return form.keeps_signs(x)


def _signs(nlp: Nlp, x: SX) -> list[Condition]:
    """Return the conditions of a robot's assembly: where its joints do not hold together it is no robot.

    Those of home's working mode count where the program says so.
    """
    program = nlp.program
    found: dict[str, SX] = {}
    for k, robot in enumerate(program.robots):
        where = f" pose {k + 1}" if len(program.robots) > 1 else ""
        for each, value in zip(program.model.signs, ca.vertsplit(robot.signs), strict=True):
            if nlp.in_home_mode or not each.is_mode:
                found[f"{each.name}{where}"] = -value
    if not found:
        return []
    function = ca.Function("signs", [program.x, program.p], list(found.values()))
    values = function.call([x, SX(ca.DM(nlp.arguments))])
    return [
        Condition(name, each, is_equation=False)
        for name, each in zip(found, values, strict=True)
        if any(ca.which_depends(each, x, 1, True))
    ]


def _function_of_epigraph(expression: SX, level: SX, sign: float) -> SX:
    """Return the function that bounds the level in a constraint ``expression >= 0``, which is linear in the level."""
    slope = ca.jacobian(expression, level)
    without = ca.substitute(expression, level, 0)
    # Maximum: level <= -without / slope, slope < 0. Minimum: level >= -without / slope, slope > 0; negated.
    return -without / slope if sign < 0 else without / slope


def _conditions(constraints: Sequence[_BoundedExpression]) -> list[Condition]:
    """Return an equation for equal bounds, else an inequality for each finite bound."""
    conditions = []
    for name, expression, low, high in constraints:
        if low == high:
            conditions.append(Condition(name, expression - low, is_equation=True))
            continue
        if np.isfinite(high):
            conditions.append(Condition(name, expression - high, is_equation=False))
        if np.isfinite(low):
            conditions.append(Condition(name, low - expression, is_equation=False))
    return conditions
