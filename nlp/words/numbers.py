"""Numbers, and names of quantities, as text.

A number below its error bound (``results.rounding``) has no significant digit: its text is 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

from ..errors import load_words
from ..results.rounding import NOISE, settled
from .text import Figure

#: Error bound of a residual in scaled terms: corrections end at a tenth of it.
_RESIDUAL = 1e-12
#: Significant digits of the result of a search; further digits are rounding error.
_SOLVED = 9
#: Sense of a force and its load in the name of a limited quantity, up to the pose.
_LOADED = re.compile(r" (?:(backwards|smallest) )?load (.+?)(?=(?:, other sense)?(?: pose \d+)?$)")
#: Key of a limit or a setting, and words for ends of a range.
_KEY = re.compile(r"(?<![\w.])(?:(?:limits|task)(?:\.[a-z]\w*)+|[a-z]\w*(?:\.[a-z]\w*)*\.(?:min|max)\b)")
_ENDS = {"min": "minimum", "max": "maximum"}
#: Underscore of a name; that of a coordinate such as ``p_y`` belongs to its symbol.
_UNDERSCORE = re.compile(r"_(?![a-z](?![a-z]))")
_SENSES = {None: "", "backwards": ", negative force", "smallest": ", smallest force"}


def number(value: float, size: float = 0.0, *, digits: int = 7, signed: bool = False, part: float = NOISE) -> Figure:
    """Return the text of a number.

    Args:
        value: the number.
        size: magnitude to which the error bound is relative, such as the largest term or the range of the number.
        digits: number of significant digits.
        signed: If true, a positive number has a sign.
        part: error bound, as a fraction of ``size``.
    """
    value = settled(value, size, part)
    return Figure(f"{value:{'+' if signed and value else ''}.{digits}g}", value)


def rounded_to(value: float, digits: int, *, up: bool) -> str:
    """Return the text of a number, rounded up or down to the given number of significant digits."""
    settled_value = Context(prec=_SOLVED).create_decimal(value)
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{float(context.plus(settled_value)):.{digits}g}"


def listed(values: Iterable[float]) -> str:
    """Return numbers with five digits each; a number within the rounding error of the largest is 0."""
    numbers = list(values)
    size = max(map(abs, numbers), default=0.0)
    return "  ".join(number(value, size, digits=5) for value in numbers)


def per_words(unit: str | None) -> str:
    """Return the unit in which a derivative is stated, such as ``per cm``; ``per 1`` for a quantity without a unit."""
    return f"per {unit or 1}"


def quantity_words(name: str) -> str:
    """Return the name of a limited quantity in words: the sense of its force and its load, separated by commas.

    ``actuator_force actuator 2- backwards load cutting`` becomes ``actuator_force actuator 2-, negative force, load
    "cutting"``: results in JSON and proof records contain the name unchanged.
    """
    return _LOADED.sub(lambda found: f"{_SENSES[found[1]]}, {load_words(found[2])}", name)


def key_words(text: str) -> str:
    """Return a text with the keys of limits and settings in words, such as ``maximum leg length``.

    ``limits.leg_length.max`` becomes ``maximum leg length``, and ``limits.footprint.base`` becomes ``footprint base``.
    Other names, such as ``x1``, stay as they are, and ``p_y.min`` becomes ``minimum p_y``.
    """
    return _KEY.sub(_words_of_key, text)


def _words_of_key(found: re.Match[str]) -> str:
    *names, end = found[0].removeprefix("limits.").split(".")
    words = spaced(" ".join(names))
    return f"{_ENDS[end]} {words}" if end in _ENDS else f"{words} {spaced(end)}".strip()


def spaced(name: str) -> str:
    """Return the name of a quantity with spaces, such as ``leg length limb 1-``; ``p_y`` stays as it is."""
    return _UNDERSCORE.sub(" ", name)


def side_words(name: str) -> str:
    """Return the name of an active bound or limit in words, from a key without ``limits.`` or from a quantity.

    ``footprint.base`` becomes ``footprint base``, and ``leg_length limb 1- max`` becomes ``leg length limb 1- max``.
    """
    head, space, rest = name.partition(" ")
    return f"{spaced(head)}{space}{rest}" if space else key_words(f"limits.{name}")


def residual(value: float) -> str:
    """Return the text of a scaled residual; a residual below the error bound has no significant digit."""
    return f"{value:.1e}" if value > _RESIDUAL else f"below {_RESIDUAL:.0e}"
