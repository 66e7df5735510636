"""Separation of a form into limbs: groups of terms of a sum that share only some variables.

    phi(x) = phi_0(s) + sum_k phi_k(s, o_k),   conditions on (s) or on (s, o_k)

``s`` are shared variables, and ``o_k`` are variables that only part k has. For a design with free joint coordinates
the parts are the limbs, and the pose is shared; for several poses with free coordinates the parts are the poses, and
the dimensions are shared. A part is called a limb in both cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import casadi as ca
import numpy as np
from casadi import SX

from ....models import frozen_array
from .form import StandardForm, dependence_of

#: Largest number of terms of a sum that are separated; a longer sum counts as one term.
_MOST_TERMS = 4096


@dataclass(frozen=True, eq=False)
class Limb:
    """A limb of a separated form: the terms and conditions with variables that no other limb has.

    Attributes:
        own: indices, in the whole form, of the variables that only this limb has.
        form: form of the limb; its variables are the shared ones, then its own.
    """

    own: tuple[int, ...]
    form: StandardForm


@dataclass(frozen=True, eq=False)
class Separation:
    """A form as shared variables and limbs.

    Attributes:
        shared: indices of the shared variables in the whole form.
        common: form of the terms and conditions with only shared variables; None without shared variables.
        constant: sum of the constant terms.
        limbs: limbs, at least two.
    """

    shared: tuple[int, ...]
    common: StandardForm | None
    constant: float
    limbs: tuple[Limb, ...]


def separate(form: StandardForm) -> Separation | None:
    """Return the separation of a form; None for several functions, or without parts smaller than the whole form."""
    if len(form.functions) != 1:
        return None
    terms = terms_of(form.functions[0])
    expressions = ca.vertcat(*terms, *[each.expression for each in form.conditions])
    # The variables of each term, then of each condition.
    links = [frozenset(np.flatnonzero(row).tolist()) for row in dependence_of(expressions, form.x)]
    groups = _smallest_groups(form.n, links, len(terms))
    if not groups:
        return None
    shared = tuple(i for i in range(form.n) if not any(i in group for group in groups))
    limbs = []
    for group in groups:
        own = tuple(sorted(group))
        limbs.append(Limb(own, _part(form, terms, (*shared, *own), [bool(link & group) for link in links])))
    rest = [link <= frozenset(shared) for link in links]
    if shared:
        return Separation(shared, _part(form, terms, shared, rest), 0.0, tuple(limbs))
    if any(rest[len(terms) :]):
        return None
    return Separation((), None, float(ca.DM(sum(compress(terms, rest), SX(0)))), tuple(limbs))


def _part(form: StandardForm, terms: Sequence[SX], places: Sequence[int], chosen: Sequence[bool]) -> StandardForm:
    """Return the form of one limb, or of the common part.

    Args:
        form: the whole form.
        terms: terms of the sum that belong to the result.
        places: indices of the variables of the result in the whole form.
        chosen: for each term, then for each condition, whether it belongs to the result.
    """
    index = list(places)
    return StandardForm(
        nlp=form.nlp,
        x=form.x[index],
        lower=frozen_array(form.lower[index], (len(index),)),
        upper=frozen_array(form.upper[index], (len(index),)),
        functions=(sum(compress(terms, chosen), SX(0)),),
        conditions=tuple(compress(form.conditions, chosen[len(terms) :])),
        places=tuple(places) if form.places is None else tuple(form.places[i] for i in places),
    )


def _smallest_groups(n: int, links: Sequence[frozenset[int]], terms: int) -> list[frozenset[int]]:
    """Return the variables that only one limb has, limb by limb, for the separation whose largest part is smallest.

    For each number N, variables that occur in at most N terms are candidates for own variables. Candidates in a common
    term or condition belong to one limb. The list is empty if no separation has parts smaller than the whole.

    Args:
        n: number of variables.
        links: variables of each term, then of each condition.
        terms: number of terms.
    """
    counts = [sum(i in term for term in links[:terms]) for i in range(n)]
    numbers, best, least = sorted(set(counts)), list[frozenset[int]](), n
    for most in numbers[:-1] or numbers:
        own = frozenset(i for i in range(n) if counts[i] <= most)
        groups = _connected(own, links)
        size = n - len(own) + max(map(len, groups))
        if len(groups) > 1 and size < least:
            best, least = sorted(groups, key=min), size
    return best


def _connected(own: frozenset[int], links: Sequence[frozenset[int]]) -> list[frozenset[int]]:
    """Return the connected sets of own variables; common terms and conditions are the links."""
    groups = [frozenset((i,)) for i in own]
    for link in links:
        touched = [group for group in groups if group & link]
        if len(touched) > 1:
            groups = [group for group in groups if not group & link] + [frozenset().union(*touched)]
    return groups


def terms_of(expression: SX) -> list[SX]:
    """Return the terms of a sum (1, 1), with constant factors multiplied in."""
    return [each if factor == 1 else factor * each for each, factor in factored_terms(expression)]


def factored_terms(expression: SX) -> list[tuple[SX, float]]:
    """Return the terms of a sum (1, 1), each with its constant factor."""
    terms: list[tuple[SX, float]] = []
    waiting = [(expression, 1.0)]
    while waiting:
        each, factor = waiting.pop()
        if len(terms) + len(waiting) > _MOST_TERMS:
            return [(expression, 1.0)]
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
            terms.append((each, factor))
    return terms
