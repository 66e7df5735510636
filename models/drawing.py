"""The drawing of a robot, symbolically: what a picture in true proportion needs, and nothing of how it is painted."""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass

from casadi import SX


class Body(enum.Enum):
    """What a point of the drawing moves with."""

    BASE = "base"
    PLATFORM = "platform"
    LIMB = "limb"


@dataclass(frozen=True, eq=False)
class Point:
    """A named point of the drawing: (3, 1) world coordinates, length."""

    name: str
    position: SX
    body: Body


@dataclass(frozen=True, eq=False)
class Link:
    """A straight line of the drawing between two named points; ``limb`` names the limb it is part of, if any."""

    start: str
    end: str
    body: Body
    limb: str | None = None


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle that joints lie on: (3, 1) centre, one of its points, and normal, in world coordinates."""

    centre: SX
    through: SX
    normal: SX
    body: Body


@dataclass(frozen=True, eq=False)
class Direction:
    """A named direction at a point, such as a joint's axis.

    Attributes:
        name: unique within the drawing; that of a parameter where the direction is one.
        origin: (3, 1) world coordinates, length.
        vector: (3, 1) in world coordinates, of any length but zero.
        body: what it moves with.
        limb: the limb it is part of, if any.
    """

    name: str
    origin: SX
    vector: SX
    body: Body
    limb: str | None = None


class MarkKind(enum.Enum):
    """How a parameter shows in the drawing."""

    LENGTH = "length"
    ANGLE = "angle"
    POINT = "point"

    @property
    def size(self) -> int:
        """Number of points of such a mark."""
        return {MarkKind.LENGTH: 2, MarkKind.ANGLE: 3, MarkKind.POINT: 1}[self]


@dataclass(frozen=True, eq=False)
class Mark:
    """Where a parameter is seen in the drawing, so that nobody must guess what it measures.

    Attributes:
        parameter: name of the parameter.
        kind: what is measured.
        points: each (3, 1) in world coordinates: start and end of a length; vertex, start and end of an angle; the
            point itself.
        body: what it moves with.
    """

    parameter: str
    kind: MarkKind
    points: tuple[SX, ...]
    body: Body


@dataclass(frozen=True, eq=False)
class Scene:
    """The robot as points and straight links, with circles, directions and marks where they say more."""

    points: tuple[Point, ...] = ()
    links: tuple[Link, ...] = ()
    circles: tuple[Circle, ...] = ()
    directions: tuple[Direction, ...] = ()
    marks: tuple[Mark, ...] = ()

    @property
    def expressions(self) -> tuple[tuple[str, SX], ...]:
        """Every (3, 1) expression of the drawing, with what it is, in the order of the fields."""
        return (
            *((f"point {point.name}", point.position) for point in self.points),
            *((f"circle {i} {what}", part) for i, circle in enumerate(self.circles) for what, part in _parts(circle)),
            *((f"direction {item.name}", part) for item in self.directions for part in (item.origin, item.vector)),
            *((f"mark of {mark.parameter}", part) for mark in self.marks for part in mark.points),
        )

    def faults(self, limbs: Iterable[str], parameters: Iterable[str]) -> Iterable[str]:
        """What contradicts the rest of the model: ends, limbs and parameters that do not exist, and wrong counts."""
        points, limbs, parameters = {point.name for point in self.points}, set(limbs), set(parameters)
        for link in self.links:
            for end in (link.start, link.end):
                if end not in points:
                    yield f"a link ends at {end!r}, which is no point of the drawing"
        for what, item in [("link", link) for link in self.links] + [("direction", each) for each in self.directions]:
            if item.limb is not None and item.limb not in limbs:
                yield f"a {what} belongs to limb {item.limb!r}, which has no wrench"
        for mark in self.marks:
            if mark.parameter not in parameters:
                yield f"a mark shows {mark.parameter!r}, which is no parameter"
            if len(mark.points) != mark.kind.size:
                yield f"the mark of {mark.parameter!r} should have {mark.kind.size} points, got {len(mark.points)}"


def _parts(circle: Circle) -> tuple[tuple[str, SX], ...]:
    return ("centre", circle.centre), ("through", circle.through), ("normal", circle.normal)
