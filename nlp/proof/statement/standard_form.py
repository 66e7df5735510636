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

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray, frozen_array
from ...case.limits.constraint import End
from ...evidence.state import CLOSED
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from .form import Condition, Kind, StandardForm
from .reduced_form import without_unknowns

__all__ = ["Condition", "Kind", "StandardForm", "is_in_home_mode", "standard_form"]

#: Orders of the principal minors. Those of 4 and 5 exclude boxes twice as wide as the determinant alone; smaller ones
#: gain nothing more, as few poses have so many small singular values.
_ORDERS = (4, 5, 6)
#: Part of itself by which s^2 is smaller than stated: rounding of its numbers.
_ROUNDING = 1e-9
_SIZE = 6


def standard_form(nlp: Nlp) -> StandardForm:
    """Return the standard form of a program with at least one variable."""
    nlp = with_all_pairs(nlp)
    program = nlp.program
    x, arguments = SX.sym("x", nlp.n), SX(ca.DM(nlp.arguments))
    F, g = program.values.call([x, arguments])
    epigraph = program.places.epigraph
    count = nlp.n if epigraph is None else epigraph.level
    loops = {f"{each.name}{where}" for each in program.model.closure for where in _ends_of_names(nlp)}
    functions: list[SX] = [-nlp.sign * F] if epigraph is None else []
    stated: list[Condition] = []
    for k, each in enumerate(program.constraints):
        if epigraph is not None and each in epigraph.constraints:
            functions.append(_function_of_epigraph(g[k], x[epigraph.level], nlp.sign))
        else:
            kind = Kind.LOOP if each.name in loops else Kind.LIMIT
            stated += _conditions(each.name, g[k], float(nlp.g_lower[k]), float(nlp.g_upper[k]), kind)
    found = [*_of_singular_values(nlp), *_of_joints(nlp)]
    # Numbers take the place of arguments; what then depends on no variable says nothing of a robot's joints.
    values = ca.Function("values", [program.x, program.p], [each.expression for each in found]).call([x, arguments])
    numbered = [replace(each, expression=value) for each, value in zip(found, values, strict=True)]
    stated += [each for each in numbered if not each.is_of_joints or any(ca.which_depends(each.expression, x, 1, True))]
    form = StandardForm(
        nlp=nlp,
        x=x[:count],
        lower=frozen_array(nlp.lower[:count], (count,)),
        upper=frozen_array(nlp.upper[:count], (count,)),
        functions=tuple(functions),
        conditions=tuple(stated),
    )
    return without_unknowns(form) if nlp.in_home_mode else form


def is_in_home_mode(nlp: Nlp, x: FloatArray) -> bool | None:
    """Return whether a robot is in home's working mode at a point (n,); None where it has no sign of a mode."""
    if not nlp.n or not any(each.is_mode for each in nlp.program.model.signs):
        return None
    return standard_form(replace(nlp, in_home_mode=True)).keeps_signs(x)


def _ends_of_names(nlp: Nlp) -> list[str]:
    """Return the end of the names of constraints of each pose."""
    count = len(nlp.program.robots)
    return [f" pose {k + 1}" for k in range(count)] if count > 1 else [""] * count


def _function_of_epigraph(expression: SX, level: SX, sign: float) -> SX:
    """Return the function that bounds the level in a constraint ``expression >= 0``, which is linear in the level."""
    slope = ca.jacobian(expression, level)
    without = ca.substitute(expression, level, 0)
    # Maximum: level <= -without / slope, slope < 0. Minimum: level >= -without / slope, slope > 0; negated.
    return -without / slope if sign < 0 else without / slope


def _conditions(name: str, expression: SX, low: float, high: float, kind: Kind) -> Iterator[Condition]:
    """Yield an equation for equal bounds, else an inequality for each finite bound."""
    if low == high:
        yield Condition(name, expression - low, is_equation=True, kind=kind)
        return
    if np.isfinite(high):
        yield Condition(name, expression - high, is_equation=False, kind=kind)
    if np.isfinite(low):
        yield Condition(name, low - expression, is_equation=False, kind=kind)


def _of_joints(nlp: Nlp) -> Iterator[Condition]:
    """Yield conditions of a robot's joints beside the program's constraints, in its symbols.

    First the loop equations that the program leaves out, and distances that follow, with bounds of a closed loop. They
    follow from those of the program near its answer, but not in the whole box: there joints that are assembled in no
    way at all may fulfil the program's equations. Numbers in the place of arguments leave rounding error in them, so
    that an exact equation could hold nowhere. Then the signs of the assembly: where joints do not hold together it is
    no robot. Those of home's working mode count where the program says so.
    """
    model, names = nlp.program.model, {constraint.name for constraint in nlp.program.constraints}
    poses = list(zip(_ends_of_names(nlp), nlp.program.robots, strict=True))
    for where, robot in poses:
        values = [*ca.vertsplit(robot.closure), *ca.vertsplit(robot.distances)]
        for equation, value in zip((*model.closure, *model.distances), values, strict=True):
            if f"{equation.name}{where}" not in names:
                yield from _conditions(f"{equation.name}{where}", value, -CLOSED, CLOSED, Kind.LOOP)
    for where, robot in poses:
        for sign, value in zip(model.signs, ca.vertsplit(robot.signs), strict=True):
            if nlp.in_home_mode or not sign.is_mode:
                yield Condition(f"{sign.name}{where}", -value, is_equation=False, kind=Kind.ASSEMBLY)


def _of_singular_values(nlp: Nlp) -> Iterator[Condition]:
    """Yield conditions on the minors that follow from limits on the smallest singular value of J, in its symbols."""
    for constraint, lower in zip(nlp.program.constraints, nlp.g_lower.tolist(), strict=True):
        spectral = constraint.spectral
        if spectral is None or spectral.end is not End.SMALLEST or not (np.isfinite(lower) and lower > 0):
            continue
        J = spectral.matrix @ ca.diag(SX([1, 1, 1, *[1 / spectral.length] * 3]))
        minors = _Minors(J.T @ J - (1 - _ROUNDING) * lower * SX.eye(_SIZE))
        for order in _ORDERS:
            for chosen in combinations(range(_SIZE), order):
                name = f"{constraint.name} minor {''.join(str(k + 1) for k in chosen)}"
                yield Condition(name, -minors.of(chosen, chosen), is_equation=False, kind=Kind.FOLLOWS)


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
