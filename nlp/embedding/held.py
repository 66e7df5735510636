"""What a case's fixed numbers make hold, so that its program has no constraint for it.

In C the fixed numbers are arguments. An answer is judged by all of it: loop equations that follow from the others at
the case's numbers, lengths of fixed directions, and limits on fixed numbers alone.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from ..case.limits.constraint import BoundedConstraint
from ..program.nlp import Nlp
from .ctext import integer_table, number_table
from .runtimelimits import RunTimeLimits


@dataclass(frozen=True, eq=False)
class Held:
    """Constraints that the fixed numbers make hold.

    Attributes:
        items: the constraints; first those that depend on variables, all of them loop equations.
        equations: number of these.
    """

    items: tuple[BoundedConstraint, ...]
    equations: int

    @property
    def values(self) -> SX:
        """(k, 1) expressions of the constraints."""
        return ca.vertcat(SX(0, 1), *[item.constraint.expression for item in self.items])


def held_by_fixed_numbers(nlp: Nlp) -> Held:
    """Return the constraints that the case's fixed numbers make hold."""
    pairs = [
        item
        for family in nlp.fixed_families
        for a, b in itertools.permutations(range(int(family.values.numel())), 2)
        for item in family.pair(a, b)
    ]
    items = (*nlp.implied, *nlp.constant_limits, *pairs)
    x = nlp.program.x
    varies = [bool(nlp.n) and any(ca.which_depends(each.constraint.expression, x, 1, True)) for each in items]
    first = tuple(item for item, own in zip(items, varies, strict=True) if own)
    return Held((*first, *(item for item, own in zip(items, varies, strict=True) if not own)), len(first))


def held_texts(held: Held, limits: RunTimeLimits) -> dict[str, str]:
    """Return the texts for the placeholders about what the fixed numbers make hold.

    A bound that C sets at run time is the tightest one of the constraints that it is a bound of.
    """
    bounds = [np.array([item.lower for item in held.items]), np.array([item.upper for item in held.items])]
    shared: list[tuple[int, int, int]] = []
    for k, item in enumerate(held.items):
        for is_upper, key in enumerate(item.constraint.keys):
            places = limits.places(key, item.constraint.reading, is_upper=bool(is_upper))
            shared += [(k, is_upper, place) for place in places]
            if places:
                bounds[is_upper][k] = np.inf if is_upper else -np.inf
    columns = zip(("shared_held", "shared_is_upper", "shared_constraints"), range(3), strict=True)
    tables = [number_table(f"held_{end}", "HELD", own) for end, own in zip(("lower", "upper"), bounds, strict=True)]
    tables += [integer_table(name, "SHARED", [each[column] for each in shared]) for name, column in columns]
    return {
        "nheld": str(len(held.items)),
        "nequations": str(held.equations),
        "nshared": str(len(shared)),
        "held_tables": "\n".join(tables) if held.items else "",
    }
