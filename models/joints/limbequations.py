"""Equations of a robot's limbs, from which unknowns follow: loops, distances, and gaps along the axes of joints."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .. import Model

#: Name of one of the equations of a path's loop.
_LOOP = re.compile(r"(?:loop|distance) (\S+) \((\d+)\)")


class Equation(NamedTuple):
    """Left sides of equations (k, 1), the length or number by which they are of order 1, and the name of one.

    ``limb`` is the limb whose joints they close; empty for none.
    """

    expression: SX
    size: SX
    limb: str
    name: str = ""


def gaps_of(model: Model) -> dict[str, Equation]:
    """Return the gap (3, 1) of each path that is opened at the centre of a joint, by the path's name.

    Any three equations of a path would do, as its gap is read off by its form alone: others have another one.
    """
    parts: dict[str, dict[int, Equation]] = {}
    for each in (*model.loops, *model.closure):
        match = _LOOP.match(each.name)
        if match is not None:
            parts.setdefault(match[1], {}).setdefault(
                int(match[2]), Equation(each.expression, each.size, limb_of(each.name))
            )
    first = {name: [own[k] for k in (1, 2, 3) if k in own] for name, own in parts.items()}
    return {
        name: Equation(ca.vertcat(*[each.expression for each in own]), own[0].size, own[0].limb)
        for name, own in first.items()
        if len(own) == 3
    }


def limb_of(name: str) -> str:
    """Return the limb of an equation from its name, such as 1 of ``loop 1.2 (3)``; empty where it has another form."""
    match = _LOOP.match(name)
    return "" if match is None else match[1].partition(".")[0]


def axes_of(model: Model, name: str) -> Iterator[SX]:
    """Yield the current direction (3, 1) of each rotation of a path's limb."""
    for each in model.joint_screws:
        if each.limb == name.partition(".")[0] and not each.is_nested:
            for k in range(each.all.shape[1]):
                if not each.all[:3, k].is_zero():
                    yield each.all[:3, k]
