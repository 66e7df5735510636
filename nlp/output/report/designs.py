"""Designs along a curve or a front as HTML: a small picture of each, its numbers, and what becomes active there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....models import FloatArray
from ...program.nlp import Nlp
from ...program.program import design_indices
from ...results.rounding import number
from ..pictures.designs import design_pictures
from ..pictures.drawing import Drawing
from .markup import Markup, image_source, join_markup, paragraphs, tag

#: So many designs are drawn at most.
_MOST = 12
_WORDS = (
    "The robot at each design, from one direction and at one scale. Its limbs have the colours of their rates: blue "
    "for shortening, orange for lengthening."
)


class Design(NamedTuple):
    """A design of a curve.

    Attributes:
        name: the value or the goals that it belongs to.
        words: its result.
        numbers: of the design, each with its name and unit.
        active: bounds and limits that it lies on.
        drawing: the robot there; None where it cannot be drawn.
    """

    name: str
    words: str
    numbers: tuple[str, ...]
    active: tuple[str, ...]
    drawing: Drawing | None


def free_numbers(nlp: Nlp, x: FloatArray) -> tuple[str, ...]:
    """Return the dimensions and poses of a program that are free, each with its name, value and unit."""
    units, variables = nlp.case.units, nlp.program.variables
    found = []
    for k in design_indices(nlp.program):
        shown = number(units.shown(float(x[k]), variables[k].dimension), digits=5)
        found.append(f"{variables[k].name} = {shown} {units.label(variables[k].dimension)}".rstrip())
    return tuple(found)


def bends(active: Sequence[frozenset[str]]) -> list[int]:
    """Return the indices of the designs at which other bounds and limits are active than at the one before."""
    return [k for k in range(1, len(active)) if active[k] != active[k - 1]]


def chosen_designs(active: Sequence[frozenset[str]]) -> list[int]:
    """Return the indices of the designs that are drawn: both ends, each side of a bend, then evenly spread ones."""
    count = len(active)
    sides = [each for k in bends(active) for each in (k - 1, k)]
    spread = np.rint(np.linspace(0, count - 1, min(count, _MOST))).astype(int).tolist()
    wanted = dict.fromkeys([*([0, count - 1] if count else []), *sides, *spread])
    return sorted(list(wanted)[:_MOST])


def changed_words(before: Sequence[str], after: Sequence[str]) -> str:
    """Return what becomes active and what no longer is; an empty text where nothing changes."""
    new = [each for each in after if each not in before]
    gone = [each for each in before if each not in after]
    parts = [f"{', '.join(new)} become{'s' * (len(new) == 1)} active"] if new else []
    parts += [f"{', '.join(gone)} no longer {'is' if len(gone) == 1 else 'are'}"] if gone else []
    return "; ".join(parts)


def bend_lines(designs: Sequence[Design], heading: str) -> Markup:
    """Return, below a heading, a sentence for each two neighbours between which other limits become active."""
    found = bends([frozenset(each.active) for each in designs])
    lines = [
        f"Between {designs[k - 1].name} and {designs[k].name}: "
        f"{changed_words(designs[k - 1].active, designs[k].active)}."
        for k in found
    ]
    if not lines:
        return Markup("")
    return tag("div", tag("h3", heading), tag("ul", *(tag("li", line) for line in lines), id="bends"))


def design_figures(designs: Sequence[Design]) -> Markup:
    """Return a figure of each chosen design that can be drawn, side by side as the width allows."""
    chosen = chosen_designs([frozenset(each.active) for each in designs])
    shown = [(designs[k], drawing) for k in chosen if (drawing := designs[k].drawing) is not None]
    if not shown:
        return Markup("")
    pictures = design_pictures([drawing for _, drawing in shown])
    figures = [
        tag(
            "figure",
            tag("img", src=image_source(content), alt=f"The robot at {each.name}"),
            tag("figcaption", tag("b", each.name), f": {each.words}", tag("small", ", ".join(each.numbers))),
        )
        for (each, _), content in zip(shown, pictures, strict=True)
    ]
    few = [] if len(shown) == len(designs) else [f"{len(shown)} of {len(designs)} designs are drawn."]
    return join_markup([paragraphs([_WORDS, *few]), tag("div", *figures, class_="designs")])
