"""Sums of squared quotients, split into parts with accurate enclosures for the kernel.

The work rate of a row in a twist is ``N / |d|``, with N and ``D = |d|^2`` polynomials in the joint coordinates. Its
square is

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D,    for any number rho, with D > 0.

With ``rho = N / D`` at the centre of a box, the first part is linear in N and D, which have accurate models, and E is 0
at the centre. Enclosures of the quotient and its derivatives, operation by operation, are tens of times as wide on
large boxes, because the second-order terms of each factor are bounded separately.

For a minimum of F, the first part is a tangent from below: ``N^2 / D >= 2 rho N - rho^2 D``. It has neither quotient
nor square, so its second-order form is accurate on large boxes. ``rho`` is ``N / D`` at a point with a small sum of
squares; the bound is valid for any ``rho``.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
from casadi import SX

from ..statement.limb_separation import factored_terms, terms_of
from ..statement.standard_form import StandardForm


class Quotient(NamedTuple):
    """A term ``sign * N^2 / D`` of a function.

    Attributes:
        N, D: (1, 1) numerator before squaring, and denominator.
        sign: 1 or -1.
        function: index of the function.
    """

    N: SX
    D: SX
    sign: int
    function: int


class Rows(NamedTuple):
    """Expressions with squared quotients split off.

    Attributes:
        expressions: (E, 1) functions without their quotients, then other expressions, then N and D of each quotient.
        quotients: terms that were split off from the functions.
    """

    expressions: SX
    quotients: tuple[Quotient, ...]

    @property
    def functions(self) -> tuple[int, ...]:
        """Index of the function of each quotient."""
        return tuple(each.function for each in self.quotients)


def _taken_apart(form: StandardForm, signs: tuple[int, ...], more: tuple[SX, ...] = ()) -> Rows | None:
    """Return a form's functions with squared quotients of given signs split off; None without such a quotient."""
    rests, found = [SX(0) for _ in form.functions], list[Quotient]()
    for j, function in enumerate(form.functions):
        for term in terms_of(function):
            quotient = as_quotient(term, j)
            if quotient is None or quotient.sign not in signs:
                rests[j] = rests[j] + term
            else:
                found.append(quotient)
    parts = [part for each in found for part in (each.N, each.D)]
    return Rows(ca.densify(ca.vertcat(*rests, *more, *parts)), tuple(found)) if found else None


def search_rows(form: StandardForm, *, apart: bool) -> Rows:
    """Return the expressions of a form; if ``apart`` is true, with squared quotients of its functions split off."""
    rows = _taken_apart(form, (1, -1), tuple(each.expression for each in form.conditions)) if apart else None
    return rows or Rows(form.expressions, ())


def tangent_rows(form: StandardForm) -> Rows | None:
    """Return the functions of a form for tangents, without terms ``-N^2 / D``; None if no function has such a term."""
    return _taken_apart(form, (-1,))


def as_quotient(term: SX, function: int) -> Quotient | None:
    """Return a term as a squared quotient; None for other terms."""
    term, factor = factored_terms(term)[0]
    if not (term.is_op(ca.OP_DIV) and term.dep(0).is_op(ca.OP_SQ)) or term.dep(1).is_constant() or factor == 0:
        return None
    N, D = term.dep(0).dep(0), term.dep(1)
    return Quotient(N, D if abs(factor) == 1 else D / abs(factor), 1 if factor > 0 else -1, function)
