"""A description's joints and closures as one list of elementary joints between bodies, in the world."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism.graph import ElementaryKind
from .description import Closing, Description, LoopClosure
from .frames import Frame

#: Points nearer than this, in parts of the robot's size, are one point: rounding of decimals of nine digits.
SAME_POINT = 1e-9


@dataclass(frozen=True, eq=False)
class Element:
    """An elementary joint between two bodies.

    Attributes:
        name: unique.
        kind: ``R``, ``P``, ``S`` or ``weld``.
        first: name of a body.
        second: name of the other, whose motion relative to the first the coordinate counts.
        point: (3,) its centre or a point of its axis, in the world.
        axis: (3,) unit direction of its axis in the world; zero for ``S`` and ``weld``.
        range: smallest and largest coordinate.
        closure: whether it closes a loop.
    """

    name: str
    kind: ElementaryKind
    first: str
    second: str
    point: FloatArray
    axis: FloatArray
    range: tuple[float, float] | None = None
    closure: bool = False


def elements_of(given: Description, size: float) -> list[Element]:
    """Return all joints of a description: couplings of one joint hold it, and two balls are a hinge, three a weld.

    Args:
        given: the description.
        size: of the robot.
    """
    parents = {body.name: body.parent for body in given.bodies}
    held = {each.factors[0][0] for each in given.couplings if len(each.factors) == 1}
    found: list[Element] = []
    for joint in given.joints:
        kind: ElementaryKind = "weld" if joint.name in held else joint.kind
        axis = np.zeros(3) if kind == "weld" else joint.axis
        found.append(Element(joint.name, kind, parents[joint.body], joint.body, joint.point, axis, joint.range))
    for closure in given.closures:
        found += _closing_elements(given, closure)
    return _with_hinges(found, size)


def _closing_elements(given: Description, closure: LoopClosure) -> list[Element]:
    """Return the elementary joints of a closure; between two of them stands a body without size."""
    A = given.place_of(closure.first) @ closure.first_frame
    B = given.place_of(closure.second) @ closure.second_frame
    none, z, other = np.zeros(3), A.rotation[:, 2], B.rotation[:, 2]
    parts: dict[Closing, list[tuple[ElementaryKind, FloatArray]]] = {
        Closing.BALL: [("S", none)],
        Closing.WELD: [("weld", none)],
        Closing.HINGE: [("R", z)],
        Closing.SLIDE: [("P", z)],
        Closing.CYLINDER: [("R", z), ("P", z)],
        Closing.UNIVERSAL: [("R", z), ("R", other)],
    }
    middle = f"{closure.name} cross"
    bodies = [closure.first, closure.second]
    written = parts[closure.closing]
    if len(written) == 2:
        bodies.insert(1, middle)
    return [
        Element(
            closure.name if len(written) == 1 else f"{closure.name} {k + 1}",
            kind,
            bodies[k],
            bodies[k + 1],
            A.position,
            axis,
            closure=True,
        )
        for k, (kind, axis) in enumerate(written)
    ]


def rigid_groups(elements: list[Element], bodies: list[str]) -> dict[str, str]:
    """Return for each body the first one of those to which welds fix it."""
    group = {name: name for name in bodies}

    def leader(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    for each in elements:
        if each.kind == "weld":
            one, other = sorted((leader(each.first), leader(each.second)), key=bodies.index)
            group[other] = one
    return {name: leader(name) for name in bodies}


def bodies_of(given: Description, elements: list[Element]) -> list[str]:
    """Return the names of all bodies, with those that stand between elementary joints of one closure."""
    names = [body.name for body in given.bodies]
    return list(dict.fromkeys([*names, *(name for each in elements for name in (each.first, each.second))]))


def place_in(given: Description, name: str) -> Frame:
    """Return the place of a body in the world; of one without size, the world's own."""
    return next((body.place for body in given.bodies if body.name == name), Frame())


def _with_hinges(elements: list[Element], size: float) -> list[Element]:
    """Return the joints with closing balls between the same two rigid bodies as one joint."""
    bodies = list(dict.fromkeys(name for each in elements for name in (each.first, each.second)))
    leader = rigid_groups(elements, bodies)
    pairs: dict[frozenset[str], list[Element]] = {}
    for each in elements:
        if each.kind == "S" and each.closure:
            pairs.setdefault(frozenset((leader[each.first], leader[each.second])), []).append(each)
    replaced: dict[str, Element | None] = {}
    for balls in pairs.values():
        if len(balls) > 1:
            replaced |= {each.name: None for each in balls[1:]} | {balls[0].name: _joined(balls, size)}
    return [new for each in elements if (new := replaced.get(each.name, each)) is not None]


def _joined(balls: list[Element], size: float) -> Element:
    """Return the joint that several balls between two bodies are: a ball, a hinge, or a weld."""
    first = balls[0]
    apart = [each.point - first.point for each in balls[1:]]
    longest = max(apart, key=lambda way: float(np.linalg.norm(way)))
    length = float(np.linalg.norm(longest))
    if length <= SAME_POINT * size:
        return first
    axis = longest / length
    straight = all(
        float(np.linalg.norm(np.cross(one - other, axis))) <= SAME_POINT * size
        for one, other in combinations([np.zeros(3), *apart], 2)
    )
    kind: ElementaryKind = "R" if straight else "weld"
    direction = axis if straight else np.zeros(3)
    return Element(first.name, kind, first.first, first.second, first.point, direction, closure=True)
