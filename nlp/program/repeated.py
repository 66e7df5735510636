"""Removal of repeated constraints: polynomial normal forms decide if two expressions are one function.

Symmetric robots have limits that are the same function of variables and arguments, such as the spacing of each pair of
joints on a circle; they would share one multiplier. Equal normal forms prove equality for all values, up to the
rounding of constants: polynomials in symbols and in values of other operations, whose operands are normal forms again.
Expressions that agree only at some points, such as distances between segments, stay separate.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from ..case.limits.constraint import BoundedConstraint, Constraint

#: Largest difference of equal coefficients, relative to the sizes of their summands: rounding.
_ROUNDING = 64 * float(np.finfo(float).eps)
#: Largest product of the numbers of terms that is expanded; a larger product stays an operation.
_MOST_TERMS = 64
#: Relative difference of values at random symbols above which two functions differ, and the number of such points:
#: distances of segments may agree on a part of the space.
_DIFFERENT, _POINTS = 1e-9, 8
_SEED = 0

#: Monomial: atom numbers in order, each repeated by its power.
_Monomial: TypeAlias = tuple[int, ...]


class _Coefficient(NamedTuple):
    """Coefficient, and the sum of the absolute values of its summands."""

    value: float
    size: float


#: Polynomial: monomials with their coefficients.
_Polynomial: TypeAlias = dict[_Monomial, _Coefficient]


def without_repeated(
    added: Sequence[BoundedConstraint], x: SX, p: SX, known: Sequence[Constraint] = ()
) -> list[BoundedConstraint]:
    """Return new constraints without repetitions of an earlier function with the same limit.

    Args:
        added: the new constraints.
        x: (n, 1) symbols of the variables.
        p: (k, 1) symbols of the arguments.
        known: existing constraints of a program.
    """
    constraints = [*known, *(item.constraint for item in added)]
    if len(constraints) < 2:
        return list(added)
    measured = [each.expression if each.exact is None else each.exact for each in constraints]
    function = ca.Function("measured", [x, p], [ca.densify(ca.vertcat(*measured))])
    rng = np.random.default_rng(_SEED)
    points = [(rng.uniform(-1, 1, x.numel()), rng.uniform(-1, 1, p.numel())) for _ in range(_POINTS)]
    values = np.column_stack([function(*each).full().ravel() for each in points])
    # Different values at random points prove that two constraints differ; this separates most of them.
    alike: dict[tuple[str, str], list[list[int]]] = {}
    for i, row in enumerate(values):
        groups = alike.setdefault(constraints[i].keys, [])
        firsts = values[[each[0] for each in groups]]
        near = np.flatnonzero(np.isclose(firsts, row, rtol=_DIFFERENT, equal_nan=True).all(axis=1))
        groups[near[0]].append(i) if len(near) else groups.append([i])
    several = [group for groups in alike.values() for group in groups if len(group) > 1]
    asked = [i for group in several for i in group]
    if not asked:
        return list(added)
    expressions = ca.densify(ca.vertcat(*[constraints[i].expression for i in asked]))
    forms = dict(zip(asked, _NormalForms().of(expressions, x, p), strict=True))
    repeated: set[int] = set()
    for group in several:
        for position, i in enumerate(group):
            earlier = (k for k in group[:position] if k not in repeated)
            if i >= len(known) and any(_are_same(forms[i], forms[k]) for k in earlier):
                repeated.add(i)
    return [item for i, item in enumerate(added, len(known)) if i not in repeated]


class _NormalForms:
    """Normal forms of expressions with common atoms: symbols, and operations that are not expanded."""

    def __init__(self) -> None:
        self._count = 0
        self._symbols: dict[tuple[int, int], int] = {}
        #: Operands and numbers of the atoms of each operation.
        self._operations: dict[int, list[tuple[list[_Polynomial], int]]] = {}
        #: Squares of sines and roots in terms of other atoms.
        self._squares: dict[int, _Polynomial] = {}

    def of(self, expressions: SX, x: SX, p: SX) -> list[_Polynomial]:
        """Return the normal forms of expressions (k, 1) of symbols."""
        function = ca.Function("forms", [x, p], [expressions])
        work: dict[int, _Polynomial] = {}
        found: list[_Polynomial] = [{} for _ in range(expressions.numel())]
        for k in range(function.n_instructions()):
            op, source, target = (
                function.instruction_id(k),
                function.instruction_input(k),
                function.instruction_output(k),
            )
            if op == ca.OP_OUTPUT:
                found[target[1]] = work[source[0]]
            elif op == ca.OP_CONST:
                work[target[0]] = _constant(function.instruction_constant(k))
            elif op == ca.OP_INPUT:
                place = self._symbols.setdefault((source[0], source[1]), self._count)
                self._count = max(self._count, place + 1)
                work[target[0]] = {(place,): _Coefficient(1.0, 1.0)}
            else:
                work[target[0]] = self._operation(op, [work[each] for each in source])
        return found

    def _operation(self, op: int, given: list[_Polynomial]) -> _Polynomial:
        """Return the normal form of an operation on normal forms."""
        one, other = given[0], given[-1]
        if op in (ca.OP_ADD, ca.OP_SUB):
            return _sum(one, other, 1.0 if op == ca.OP_ADD else -1.0)
        if op in (ca.OP_NEG, ca.OP_TWICE):
            return _sum({}, one, -1.0 if op == ca.OP_NEG else 2.0)
        if op in (ca.OP_MUL, ca.OP_SQ) and len(one) * len(other) <= _MOST_TERMS:
            return self._product(one, other)
        if op == ca.OP_DIV and set(other) == {()} and other[()].value:
            return _sum({}, one, 1 / other[()].value)
        if op in (ca.OP_SIN, ca.OP_COS):
            return self._wave(op, one)
        atom = self._atom(op, given)
        if op == ca.OP_SQRT:
            self._squares.setdefault(atom, one)
        return {(atom,): _Coefficient(1.0, 1.0)}

    def _wave(self, op: int, angle: _Polynomial) -> _Polynomial:
        """Return the normal form of a sine or cosine; its angle has no constant and a positive first sign."""
        constant = angle.get((), _Coefficient(0.0, 0.0)).value
        rest = {monomial: each for monomial, each in angle.items() if monomial}
        if not rest:
            return _constant(math.sin(constant) if op == ca.OP_SIN else math.cos(constant))
        sign = math.copysign(1.0, rest[min(rest)].value)
        rest = _sum({}, rest, sign)
        cosine: _Polynomial = {(self._atom(ca.OP_COS, [rest]),): _Coefficient(1.0, 1.0)}
        place = self._atom(ca.OP_SIN, [rest])
        sine: _Polynomial = {(place,): _Coefficient(sign, 1.0)}
        if place not in self._squares:
            self._squares[place] = _sum(_constant(1.0), self._product(cosine, cosine), -1.0)
        s, c = math.sin(constant), math.cos(constant)
        parts = [(sine, c), (cosine, s)] if op == ca.OP_SIN else [(cosine, c), (sine, -s)]
        return _sum(_sum({}, *parts[0]), *parts[1])

    def _atom(self, op: int, given: list[_Polynomial]) -> int:
        """Return the index of the atom that stands for an operation on normal forms."""
        known = self._operations.setdefault(op, [])
        for operands, place in known:
            if all(_are_same(one, other) for one, other in zip(operands, given, strict=True)):
                return place
        known.append((given, self._count))
        self._count += 1
        return self._count - 1

    def _product(self, one: _Polynomial, other: _Polynomial) -> _Polynomial:
        """Return a product, without squares of sines and roots."""
        found: _Polynomial = {}
        for first, a in one.items():
            for second, b in other.items():
                monomial = tuple(sorted((*first, *second)))
                pairs = itertools.pairwise(monomial)
                at = next((k for k, (u, v) in enumerate(pairs) if u == v and u in self._squares), None)
                term = {monomial: _Coefficient(1.0, 1.0)}
                if at is not None:
                    rest = {(*monomial[:at], *monomial[at + 2 :]): _Coefficient(1.0, 1.0)}
                    term = self._product(rest, self._squares[monomial[at]])
                factor = _Coefficient(a.value * b.value, a.size * b.size)
                for each, c in term.items():
                    have = found.get(each, _Coefficient(0.0, 0.0))
                    found[each] = _Coefficient(have.value + factor.value * c.value, have.size + factor.size * c.size)
        return found


def _constant(value: float) -> _Polynomial:
    return {(): _Coefficient(value, abs(value))}


def _sum(one: _Polynomial, other: _Polynomial, factor: float) -> _Polynomial:
    """Return the first polynomial plus a factor times the second."""
    found = dict(one)
    for monomial, each in other.items():
        have = found.get(monomial, _Coefficient(0.0, 0.0))
        found[monomial] = _Coefficient(have.value + factor * each.value, have.size + abs(factor) * each.size)
    return found


def _are_same(one: _Polynomial, other: _Polynomial) -> bool:
    """Return True if two polynomials have the same coefficients, up to rounding."""
    none = _Coefficient(0.0, 0.0)
    for monomial in one.keys() | other.keys():
        a, b = one.get(monomial, none), other.get(monomial, none)
        if not abs(a.value - b.value) <= _ROUNDING * (a.size + b.size):
            return False
    return True
