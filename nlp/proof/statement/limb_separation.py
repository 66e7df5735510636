"""Separation of a form into limbs, read off its expressions: parts of a sum with variables of their own.

    phi(x) = phi_0(s) + sum_k phi_k(s, o_k),   conditions on (s) or on (s, o_k)

``s`` are shared variables and ``o_k`` those of part k alone. For a design with free joint coordinates the parts are the
limbs, and the pose is shared; for several poses with free numbers of their own the parts are the poses, and the
dimensions are shared. A part is called a limb in both cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from ....models import frozen_array
from .standard_form import Condition, StandardForm

#: Largest number of terms of a sum that are told apart; a longer one counts as one term.
_MOST_TERMS = 4096


@dataclass(frozen=True, eq=False)
class Limb:
    """A part of a separated form.

    Attributes:
        own: places of its own variables in the whole form.
        form: the part as a form in its own right, over the shared variables and then its own ones.
    """

    own: tuple[int, ...]
    form: StandardForm


@dataclass(frozen=True, eq=False)
class Separation:
    """A form as shared variables and limbs.

    Attributes:
        shared: places of the shared variables in the whole form.
        common: the part with shared variables alone, as a form over them; None without shared variables.
        constant: the value of the terms without a variable.
        limbs: at least two.
    """

    shared: tuple[int, ...]
    common: StandardForm | None
    constant: float
    limbs: tuple[Limb, ...]


@dataclass(frozen=True)
class _Choice:
    """Shared variables, and groups of own variables with the terms and conditions that depend on them."""

    shared: tuple[int, ...]
    groups: tuple[frozenset[int], ...]

    @property
    def size(self) -> int:
        """Number of variables of the largest part."""
        return len(self.shared) + max(map(len, self.groups))


def separate(form: StandardForm) -> Separation | None:
    """Return the separation of a form; None where it has several functions, or no parts smaller than itself."""
    if len(form.functions) != 1:
        return None
    terms = terms_of(form.functions[0])
    of_terms = _dependence(terms, form.x)
    of_conditions = _dependence([each.expression for each in form.conditions], form.x)
    choice = _choose(form.n, of_terms, of_conditions)
    if choice is None:
        return None
    limbs = []
    for group in choice.groups:
        own = tuple(sorted(group))
        parts = [term for term, depends in zip(terms, of_terms, strict=True) if depends & group]
        kept = [each for each, depends in zip(form.conditions, of_conditions, strict=True) if depends & group]
        limbs.append(Limb(own, _part(form, (*choice.shared, *own), parts, kept)))
    shared = frozenset(choice.shared)
    rest = [term for term, depends in zip(terms, of_terms, strict=True) if depends <= shared]
    kept = [each for each, depends in zip(form.conditions, of_conditions, strict=True) if depends <= shared]
    if choice.shared:
        return Separation(choice.shared, _part(form, choice.shared, rest, kept), 0.0, tuple(limbs))
    if kept:
        return None
    return Separation((), None, float(ca.DM(sum(rest, SX(0)))), tuple(limbs))


def _part(
    form: StandardForm, places: Sequence[int], terms: Sequence[SX], conditions: Sequence[Condition]
) -> StandardForm:
    """Return a part of a form over some of its variables."""
    index = list(places)
    return StandardForm(
        nlp=form.nlp,
        x=form.x[index],
        lower=frozen_array(form.lower[index], (len(index),)),
        upper=frozen_array(form.upper[index], (len(index),)),
        functions=(sum(terms, SX(0)),),
        conditions=tuple(conditions),
        signs=tuple(each for each in conditions if any(each is sign for sign in form.signs)),
        sign=form.sign,
        has_epigraph=False,
        places=tuple(places) if form.places is None else tuple(form.places[i] for i in places),
    )


def _choose(n: int, terms: Sequence[frozenset[int]], conditions: Sequence[frozenset[int]]) -> _Choice | None:
    """Return the separation whose largest part is smallest; None without one that is smaller than the whole.

    A variable of at most so many terms is own, for every such number; own variables of one term or one condition belong
    to one limb.
    """
    counts = [sum(i in term for term in terms) for i in range(n)]
    best: _Choice | None = None
    for most in sorted(set(counts))[:-1] if len(set(counts)) > 1 else sorted(set(counts)):
        own = frozenset(i for i in range(n) if counts[i] <= most)
        groups = _connected(own, [*terms, *conditions])
        choice = _Choice(tuple(i for i in range(n) if i not in own), tuple(sorted(groups, key=min)))
        if len(groups) > 1 and choice.size < n and (best is None or choice.size < best.size):
            best = choice
    return best


def _connected(own: frozenset[int], links: Sequence[frozenset[int]]) -> list[frozenset[int]]:
    """Return the sets of own variables that no link connects with each other."""
    groups = [frozenset((i,)) for i in own]
    for link in links:
        touched = [group for group in groups if group & link]
        if len(touched) > 1:
            groups = [group for group in groups if not group & link] + [frozenset().union(*touched)]
    return groups


def _dependence(expressions: Sequence[SX], x: SX) -> list[frozenset[int]]:
    """Return the places of the variables on which each expression (1, 1) depends."""
    if not expressions:
        return []
    pattern = ca.jacobian(ca.vertcat(*expressions), x).sparsity()
    rows, columns = pattern.get_triplet()
    found: list[set[int]] = [set() for _ in expressions]
    for row, column in zip(rows, columns, strict=True):
        found[row].add(column)
    return [frozenset(each) for each in found]


def terms_of(expression: SX) -> list[SX]:
    """Return the terms of a sum (1, 1), constant factors multiplied in."""
    terms: list[SX] = []
    waiting = [(expression, 1.0)]
    while waiting:
        each, factor = waiting.pop()
        if len(terms) + len(waiting) > _MOST_TERMS:
            return [expression]
        if each.is_op(ca.OP_ADD):
            waiting += [(each.dep(1), factor), (each.dep(0), factor)]
        elif each.is_op(ca.OP_SUB):
            waiting += [(each.dep(1), -factor), (each.dep(0), factor)]
        elif each.is_op(ca.OP_NEG):
            waiting.append((each.dep(0), -factor))
        elif each.is_op(ca.OP_TWICE):
            waiting.append((each.dep(0), 2 * factor))
        elif each.is_op(ca.OP_MUL) and each.dep(0).is_constant():
            waiting.append((each.dep(1), factor * float(each.dep(0))))
        elif each.is_op(ca.OP_MUL) and each.dep(1).is_constant():
            waiting.append((each.dep(0), factor * float(each.dep(1))))
        else:
            terms.append(each if factor == 1 else factor * each)
    return terms
