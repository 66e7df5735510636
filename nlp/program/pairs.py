"""Limits on many pairs of values, with only violated pairs as constraints.

A stroke over N poses limits ``N (N - 1)`` pairs of lengths for each leg. An optimum of a program without some pairs is
an optimum of the whole program if it satisfies every pair. The values of one leg are a family: all its pairs have one
limit. A solver therefore starts with few pairs, adds violated pairs, and searches again until no pair is violated.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...models import FloatArray, frozen_vector
from ..case.limits.constraint import BoundedConstraint
from .nlp import Nlp, PairPlace
from .repeated import without_repeated

#: Violation of a pair, relative to the largest value of its family, above which it is not rounding.
_ROUNDING = 1e-13


def with_pairs_at(nlp: Nlp, points: Iterable[FloatArray]) -> Nlp:
    """Return a program with further constraints on pairs: at each point, the tightest violated pair of each family.

    Args:
        nlp: the program.
        points: (n,) points.
    """
    missing = [place for x in points for place in violated_pairs(nlp, x)] if nlp.families else []
    return with_pairs(nlp, missing) if missing else nlp


def with_pairs(nlp: Nlp, places: Iterable[PairPlace]) -> Nlp:
    """Return a program with constraints on further pairs at the end; unchanged if it already has all pairs.

    Pairs of a symmetric robot that are the same function become one constraint.
    """
    fresh = [place for place in dict.fromkeys(places) if place not in set(nlp.pairs)]
    if not fresh:
        return nlp
    known = nlp.program.constraints[len(nlp.program.constraints) - nlp.pair_count :]
    items = [item for place in fresh for item in pair_constraints(nlp, place)]
    added = without_repeated(items, nlp.program.x, nlp.program.p, known)
    return replace(nlp.with_constraints(added), pairs=(*nlp.pairs, *fresh), pair_count=nlp.pair_count + len(added))


def with_shared_pairs(nlps: Sequence[Nlp], places: Iterable[PairPlace]) -> list[Nlp]:
    """Return programs that share their symbols, with constraints on further pairs; the results share symbols, too."""
    first = with_pairs(nlps[0], places)
    return [replace(first, arguments=nlp.arguments, sense=nlp.sense) for nlp in nlps]


def with_all_pairs(nlp: Nlp) -> Nlp:
    """Return a program with constraints on all pairs of values, in an order independent of its present pairs."""
    if not nlp.families:
        return nlp
    places = [
        PairPlace(k, a, b)
        for k, family in enumerate(nlp.families)
        for a, b in itertools.permutations(range(int(family.values.numel())), 2)
    ]
    return nlp if list(nlp.pairs) == places else with_pairs(without_pairs(nlp), places)


def without_pairs(nlp: Nlp) -> Nlp:
    """Return a program without the constraints on pairs of values, such as two lengths that differ by a stroke."""
    count = len(nlp.program.constraints) - nlp.pair_count
    return replace(
        nlp,
        program=replace(nlp.program, constraints=nlp.program.constraints[:count]),
        g_lower=frozen_vector(nlp.g_lower[:count]),
        g_upper=frozen_vector(nlp.g_upper[:count]),
        pairs=(),
        pair_count=0,
    )


def tightest_pairs(nlp: Nlp, x: FloatArray) -> Iterator[PairPlace]:
    """Yield the tightest pair of each family at a point (n,): its smallest and its largest value."""
    for k, values in enumerate(_values(nlp, x)):
        order = np.argsort(values, kind="stable")
        if np.isfinite(values).all():
            yield PairPlace(k, int(order[0]), int(order[-1]))


def violated_pairs(nlp: Nlp, x: FloatArray) -> list[PairPlace]:
    """Return the tightest violated pair of each family at a point (n,) that is not a constraint of the program."""
    if not nlp.families:
        return []
    values, known = _values(nlp, x), set(nlp.pairs)
    found = []
    for place in tightest_pairs(nlp, x):
        least, most = (float(values[place.family][k]) for k in (place.first, place.second))
        if place not in known and nlp.families[place.family].slack(least, most) < -_ROUNDING * abs(most):
            found.append(place)
    return found


def pair_constraints(nlp: Nlp, place: PairPlace) -> tuple[BoundedConstraint, ...]:
    """Return the constraints on one pair of values."""
    return nlp.families[place.family].pair(place.first, place.second)


def _values(nlp: Nlp, x: FloatArray) -> list[FloatArray]:
    """Return the values (N,) of each family at a point (n,)."""
    if not nlp.families:
        return []
    sizes = [int(family.values.numel()) for family in nlp.families]
    return np.split(nlp.family_values(x, nlp.arguments).ravel(), np.cumsum(sizes)[:-1])
