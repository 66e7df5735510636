"""Constraints whose limits are a little tighter than those of a case."""

from __future__ import annotations

import math
from dataclasses import replace

from ..case.limits.constraint import BoundedConstraint

#: Part of a limit by which it is tighter in the constraints: several gaps of the proofs fit between.
TIGHTER = 1e-3


def tightened(item: BoundedConstraint, name: str) -> BoundedConstraint:
    """Return a constraint with tighter bounds and a name; its number is that of its expression."""
    lower = item.lower + TIGHTER * abs(item.lower) if math.isfinite(item.lower) else item.lower
    upper = item.upper - TIGHTER * abs(item.upper) if math.isfinite(item.upper) else item.upper
    # A measure is evaluated at the stated pose, and this is another.
    stated = (item.lower, item.upper)
    return BoundedConstraint(replace(item.constraint, name=name, measure=None, stated=stated), lower, upper)
