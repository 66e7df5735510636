"""Numbers as text, 0 where they are below their error bound.

Where a number is smaller than its error bound (``results.rounding``), its digits mean nothing, and its text is 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

from ..results.rounding import NOISE, settled
from .text import Figure

#: Error bound of a residual in scaled terms: corrections end at a tenth of it.
_RESIDUAL = 1e-12
#: Significant digits of a number that a search has found: the others are rounding error.
_SOLVED = 9


def number(value: float, size: float = 0.0, *, digits: int = 7, signed: bool = False, part: float = NOISE) -> Figure:
    """Return the text of a number.

    Args:
        value: the number.
        size: of its terms, its neighbours or its range; the number is 0 where it is below a part of this.
        digits: number of significant digits.
        signed: whether a positive number has its sign.
        part: the error bound as a part of the size.
    """
    value = settled(value, size, part)
    return Figure(f"{value:{'+' if signed and value else ''}.{digits}g}", value)


def rounded_to(value: float, digits: int, *, up: bool) -> str:
    """Return the text of a number, rounded up or down where it has more digits than rounding error leaves of it."""
    settled_value = Context(prec=_SOLVED).create_decimal(value)
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{float(context.plus(settled_value)):.{digits}g}"


def listed(values: Iterable[float]) -> str:
    """Return numbers with five digits each, 0 where they are rounding error beside the largest."""
    numbers = list(values)
    size = max(map(abs, numbers), default=0.0)
    return "  ".join(number(value, size, digits=5) for value in numbers)


def residual(value: float) -> str:
    """Return the text of a residual in scaled terms, of which no digit means anything below its error bound."""
    return f"{value:.1e}" if value > _RESIDUAL else f"below {_RESIDUAL:.0e}"
