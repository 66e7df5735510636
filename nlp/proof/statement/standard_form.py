"""Standard form of a program for the search of its whole box: maximise the least of some functions under conditions.

    maximise  min_j phi_j(x)   over  lower <= x <= upper,   h_k(x) <= 0 or h_k(x) = 0

A minimum becomes a maximum of ``-F``. The worst case of several tasks is an epigraph in the program: a variable
``level`` with one constraint for each task. Here it is the least of the tasks' own functions again, without that
variable. The program's arguments are put in as doubles, and a proof is about the graph with these constants.

A limit on the smallest singular value is one on an estimate of the smallest eigenvalue of ``A = J'J`` that takes
thousands of operations. An enclosure of it is of use on small boxes alone. The estimate is from below, so that where it
is at least ``s^2``

    M = A - s^2 I   has no negative eigenvalue.

So no principal minor of M is negative. Minors are polynomials in J, whose terms cancel in forms of second order. By
interlacing a box with two eigenvalues of M below 0, where the determinant is positive, has smaller minors that are
negative. For condition numbers the like, with ``tr A^4 / (c^2 tr A^3)`` in the place of ``s^2``, excludes wide boxes
too, but saved no boxes of a search.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray, frozen_array
from ...case.limits.constraint import End, Spectral
from ...evidence.state import CLOSED
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ...program.program import Program
from .form import Condition, StandardForm
from .reduced_form import without_unknowns

__all__ = ["Condition", "StandardForm", "is_in_home_mode", "standard_form"]

#: Orders of the principal minors. Those of 4 and 5 exclude boxes twice as wide as the determinant alone; smaller ones
#: gain nothing more, as few poses have so many small singular values.
_ORDERS = (4, 5, 6)
#: Part of itself by which s^2 is smaller than stated: rounding of its numbers.
_ROUNDING = 1e-9
_SIZE = 6


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
    stated, implied = _conditions(constraints), _conditions(_further_loop_equations(nlp, x))
    signs = _signs(nlp, x)
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
    loops = {f"{each.name}{where}" for each in program.model.closure for where in _poses(program)}
    return without_unknowns(form, [*(each for each in stated if each.name in loops), *implied, *signs])


def _of_singular_values(nlp: Nlp, x: SX) -> list[Condition]:
    """Return the conditions that follow from limits on the smallest singular value."""
    found = [
        condition
        for k, each in enumerate(nlp.program.constraints)
        if each.spectral is not None
        for condition in _spectral_conditions(each.name, each.spectral, float(nlp.g_lower[k]))
    ]
    values = _with_numbers(nlp, x, [each.expression for each in found])
    return [replace(each, expression=value) for each, value in zip(found, values, strict=True)]


def _poses(program: Program) -> list[str]:
    """Return the end of the names of constraints of each pose."""
    count = len(program.robots)
    return [f" pose {k + 1}" for k in range(count)] if count > 1 else [""] * count


def _with_numbers(nlp: Nlp, x: SX, expressions: Sequence[SX]) -> list[SX]:
    """Return expressions of a program's symbols with x and numbers in the place of its variables and arguments."""
    program = nlp.program
    values = ca.Function("values", [program.x, program.p], list(expressions)) if expressions else None
    return [] if values is None else list(values.call([x, SX(ca.DM(nlp.arguments))]))


def _varying(nlp: Nlp, x: SX, named: dict[str, SX]) -> Iterator[tuple[str, SX]]:
    """Yield those of some expressions, by name, that depend on a variable, with numbers in them."""
    for name, each in zip(named, _with_numbers(nlp, x, list(named.values())), strict=True):
        if any(ca.which_depends(each, x, 1, True)):
            yield name, each


def _further_loop_equations(nlp: Nlp, x: SX) -> list[_BoundedExpression]:
    """Return the loop equations that the program leaves out, and distances that follow, with bounds of a closed loop.

    The former follow from those of the program near its answer, but not in the whole box: there joints that are
    assembled in no way at all may fulfil the program's equations. Numbers in the place of arguments leave rounding
    error in them, so that an exact equation could hold nowhere.
    """
    program, model = nlp.program, nlp.program.model
    names = {constraint.name for constraint in program.constraints}
    further: dict[str, SX] = {}
    for where, robot in zip(_poses(program), program.robots, strict=True):
        values = [*ca.vertsplit(robot.closure), *ca.vertsplit(robot.distances)]
        for equation, expression in zip((*model.closure, *model.distances), values, strict=True):
            if f"{equation.name}{where}" not in names:
                further[f"{equation.name}{where}"] = expression
    return [_BoundedExpression(name, each, -CLOSED, CLOSED) for name, each in _varying(nlp, x, further)]


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
    found: dict[str, SX] = {}
    for where, robot in zip(_poses(nlp.program), nlp.program.robots, strict=True):
        for each, value in zip(nlp.program.model.signs, ca.vertsplit(robot.signs), strict=True):
            if nlp.in_home_mode or not each.is_mode:
                found[f"{each.name}{where}"] = -value
    return [Condition(name, each, is_equation=False) for name, each in _varying(nlp, x, found)]


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


def _spectral_conditions(name: str, spectral: Spectral, lower: float) -> Iterator[Condition]:
    """Yield conditions on the minors of a function of J, given a lower bound of its smallest eigenvalue, if finite."""
    if spectral.end is not End.SMALLEST or not (np.isfinite(lower) and lower > 0):
        return
    scale = SX([1, 1, 1, *[1 / spectral.length] * 3])
    J = spectral.matrix @ ca.diag(scale)
    minors = _Minors(J.T @ J - (1 - _ROUNDING) * lower * SX.eye(_SIZE))
    for order in _ORDERS:
        for chosen in combinations(range(_SIZE), order):
            places = "".join(str(k + 1) for k in chosen)
            yield Condition(f"{name} minor {places}", -minors.of(chosen, chosen), is_equation=False, follows=True)


class _Minors:
    """Minors of a matrix by expansion along rows, each computed once.

    Args:
        matrix: (n, n) expressions.
    """

    def __init__(self, matrix: SX) -> None:
        self._matrix = matrix
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], SX] = {}

    def of(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> SX:
        """Return the determinant (1, 1) of some rows and as many columns."""
        key = rows, columns
        if key not in self._known:
            first, *others = rows
            if not others:
                return self._matrix[first, columns[0]]
            terms = [
                (-1) ** k * self._matrix[first, column] * self.of(tuple(others), columns[:k] + columns[k + 1 :])
                for k, column in enumerate(columns)
            ]
            self._known[key] = sum(terms, SX(0))
        return self._known[key]
