"""Functions that are sums of squared quotients, taken apart for the kernel.

The work rate of a row in a twist is ``N / |d|``, with N and ``D = |d|^2`` polynomials in the joint coordinates. Its
square is

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D,    for any number rho, with D > 0.

With ``rho = N / D`` at the centre of a box, the first part is linear in N and D, whose models are accurate, and E is 0
at the centre. Enclosures of the quotient and its derivatives, operation by operation, are tens of times as wide on
large boxes: there the terms of second order of each factor are bounded by themselves.

For a minimum of F, the first part alone is a tangent from below: ``N^2 / D >= 2 rho N - rho^2 D``. It has neither
quotient nor square, so that its form of second order is accurate on large boxes. ``rho`` is ``N / D`` at a point where
the sum of squares is small; any other one gives a bound that holds too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
from casadi import SX

from ..statement.form import without_ties
from ..statement.limb_separation import terms_of

if TYPE_CHECKING:
    from ..statement.standard_form import StandardForm


class Quotient(NamedTuple):
    """A term ``sign * N^2 / D`` of a function.

    Attributes:
        N, D: (1, 1).
        sign: 1 or -1.
        function: number of the function.
    """

    N: SX
    D: SX
    sign: int
    function: int


@dataclass(frozen=True, eq=False)
class SearchRows:
    """A form's expressions as a search encloses them.

    Attributes:
        expressions: (E, 1) functions without their quotients, conditions, then N and D of each quotient.
        jacobian: (E, n) derivatives, dense.
        quotients: the terms that are missing in the functions.
    """

    expressions: SX
    jacobian: SX
    quotients: tuple[Quotient, ...]


def _taken_apart(form: StandardForm, signs: tuple[int, ...]) -> tuple[list[SX], list[Quotient]]:
    """Return the functions of a form without their squared quotients of some signs, and these."""
    rests: list[SX] = []
    found: list[Quotient] = []
    for j, function in enumerate(form.functions):
        rest = SX(0)
        for term in terms_of(function):
            quotient = as_quotient(term, j)
            if quotient is None or quotient.sign not in signs:
                rest = rest + term
            else:
                found.append(quotient)
        rests.append(rest)
    return rests, found


def search_rows(form: StandardForm, *, apart: bool) -> SearchRows:
    """Return the expressions of a form, with the squared quotients of its functions taken apart if so wanted."""
    rests, found = _taken_apart(form, (1, -1)) if apart else ([], [])
    if not found:
        return SearchRows(form.expressions, form.jacobian, ())
    conditions = [each.expression for each in form.conditions]
    parts = [part for each in found for part in (each.N, each.D)]
    expressions = ca.densify(ca.vertcat(*rests, *conditions, *parts))
    jacobian = ca.densify(without_ties(ca.jacobian(expressions, form.x), form.x))
    return SearchRows(expressions, jacobian, tuple(found))


def as_quotient(term: SX, function: int) -> Quotient | None:
    """Return a term as a squared quotient; None for another one."""
    factor = 1.0
    while True:
        if term.is_op(ca.OP_NEG):
            term, factor = term.dep(0), -factor
        elif term.is_op(ca.OP_TWICE):
            term, factor = term.dep(0), 2 * factor
        elif term.is_op(ca.OP_MUL) and term.dep(0).is_constant():
            term, factor = term.dep(1), factor * float(term.dep(0))
        elif term.is_op(ca.OP_MUL) and term.dep(1).is_constant():
            term, factor = term.dep(0), factor * float(term.dep(1))
        else:
            break
    if not (term.is_op(ca.OP_DIV) and term.dep(0).is_op(ca.OP_SQ)) or term.dep(1).is_constant() or factor == 0:
        return None
    N, D = term.dep(0).dep(0), term.dep(1)
    return Quotient(N, D if abs(factor) == 1 else D / abs(factor), 1 if factor > 0 else -1, function)


class TangentRows(NamedTuple):
    """Rows behind the expressions of a form.

    Attributes:
        expressions: (J + 2 K, 1) functions without their K terms ``-N^2 / D``, then N and D of each.
        functions: (K,) number of the function of each.
    """

    expressions: SX
    functions: tuple[int, ...]


def tangent_rows(form: StandardForm) -> TangentRows | None:
    """Return the rows of a form for tangents; None where no function has squares with a minus sign."""
    rests, found = _taken_apart(form, (-1,))
    parts = [part for each in found for part in (each.N, each.D)]
    return TangentRows(ca.vertcat(*rests, *parts), tuple(each.function for each in found)) if found else None
