"""The drawing of a robot as symbols: points, links, joints, circles, directions, marks; without colours or widths.

The outline of a plate has the corners of the convex hull of the joints on it, in order around it.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable

import numpy as np
from casadi import SX

from .arrays import FloatArray
from .values import dataclass

#: Points nearer to each other, or to an edge, than this part of the plate's size are one, or on the edge.
_NEAR = 1e-9


class Body(enum.Enum):
    """Body that a part of the drawing moves with."""

    BASE = "base"
    PLATFORM = "platform"
    LIMB = "limb"


@dataclass(frozen=True, eq=False)
class Point:
    """A named point of the drawing: (3, 1) world coordinates, length."""

    name: str
    position: SX
    body: Body


class LinkKind(enum.Enum):
    """Kind of a straight line: a bar or an edge of an outline, a thin rod, or a rail that a slide runs on."""

    BAR = "bar"
    ROD = "rod"
    RAIL = "rail"


@dataclass(frozen=True, eq=False)
class Link:
    """A straight line of the drawing between two named points.

    Attributes:
        start: name of the first point.
        end: name of the second one.
        body: the body that the link moves with.
        limb: name of the limb that the link is part of, if any.
        kind: bar, rod or rail.
        row: index, among the rows of the limb, of the one that the link carries alone; None for a link that carries
            others too.
    """

    start: str
    end: str
    body: Body
    limb: str | None = None
    kind: LinkKind = LinkKind.BAR
    row: int | None = None


class JointKind(enum.Enum):
    """Kind of a joint, by its letter."""

    REVOLUTE = "R"
    PRISMATIC = "P"
    HELICAL = "H"
    CYLINDRICAL = "C"
    UNIVERSAL = "U"
    SPHERICAL = "S"
    PARALLELOGRAM = "Pa"

    @property
    def words(self) -> str:
        """Its name for people."""
        return self.name.lower()


@dataclass(frozen=True, eq=False)
class JointSymbol:
    """The symbol of a joint.

    Attributes:
        name: unique within the drawing: limb and number, such as ``1:2``.
        kind: of the joint; a parallelogram has a symbol at each of its four hinges.
        place: (3, 1) in world coordinates, length.
        axes: each (3, 1) in world coordinates, of any length but zero; none for a spherical joint.
        body: the body that the joint is drawn with.
        limb: name of the limb that the joint is part of, if it has a wrench.
        is_actuated: whether an actuator drives the joint.
    """

    name: str
    kind: JointKind
    place: SX
    axes: tuple[SX, ...]
    body: Body
    limb: str | None = None
    is_actuated: bool = False


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle that joints lie on, in world coordinates.

    Attributes:
        centre: (3, 1) length.
        through: (3, 1) a point of the circle, length.
        normal: (3, 1) normal of the circle's plane, of any length but zero.
        body: the body that the circle moves with.
    """

    centre: SX
    through: SX
    normal: SX
    body: Body


@dataclass(frozen=True, eq=False)
class Direction:
    """A named direction at a point, such as a joint's axis.

    Attributes:
        name: unique within the drawing; the name of a parameter where the direction is that parameter.
        origin: (3, 1) world coordinates, length.
        vector: (3, 1) in world coordinates, of any length but zero.
        body: the body that the direction moves with.
        limb: name of the limb that the direction is part of, if any.
    """

    name: str
    origin: SX
    vector: SX
    body: Body
    limb: str | None = None


class MarkKind(enum.Enum):
    """Kind of quantity that a mark shows."""

    LENGTH = "length"
    ANGLE = "angle"
    POINT = "point"

    @property
    def size(self) -> int:
        """Number of points of a mark of this kind."""
        return {MarkKind.LENGTH: 2, MarkKind.ANGLE: 3, MarkKind.POINT: 1}[self]


@dataclass(frozen=True, eq=False)
class Mark:
    """A parameter's place in the drawing, which shows the length, angle or point that the parameter measures.

    Attributes:
        parameter: name of the parameter.
        kind: length, angle or point.
        points: each (3, 1) in world coordinates: start and end of a length; vertex, start and end of an angle; the
            point itself.
        body: the body that the mark moves with.
    """

    parameter: str
    kind: MarkKind
    points: tuple[SX, ...]
    body: Body


@dataclass(frozen=True, eq=False)
class Scene:
    """The drawing of a robot.

    Attributes:
        points: its named points.
        links: straight links between them.
        circles: circles, such as those of joint centres.
        directions: directions at points, such as axes.
        marks: marks of where parameters are measured.
        joints: joints, in the place of the round dots at the ends of links that a drawing without joints has.
    """

    points: tuple[Point, ...] = ()
    links: tuple[Link, ...] = ()
    circles: tuple[Circle, ...] = ()
    directions: tuple[Direction, ...] = ()
    marks: tuple[Mark, ...] = ()
    joints: tuple[JointSymbol, ...] = ()

    @property
    def expressions(self) -> tuple[tuple[str, SX], ...]:
        """Every (3, 1) expression of the drawing with a name for messages, in the order of the fields."""
        return (
            *((f"point {point.name}", point.position) for point in self.points),
            *((f"circle {i} {name}", part) for i, circle in enumerate(self.circles) for name, part in _vectors(circle)),
            *((f"direction {item.name}", part) for item in self.directions for part in (item.origin, item.vector)),
            *((f"mark of {mark.parameter}", part) for mark in self.marks for part in mark.points),
            *((f"joint {each.name}", part) for each in self.joints for part in (each.place, *each.axes)),
        )

    def faults(self, limbs: Iterable[str], parameters: Iterable[str]) -> Iterable[str]:
        """Yield a sentence for every contradiction between the drawing and the rest of the model.

        Contradictions are ends of links, limbs and parameters that do not exist, and marks with a wrong number of
        points.

        Args:
            limbs: names of the model's limbs.
            parameters: names of the model's parameters.
        """
        points, limbs, parameters = {point.name for point in self.points}, set(limbs), set(parameters)
        for link in self.links:
            for end in (link.start, link.end):
                if end not in points:
                    yield f"a link ends at {end!r}, which is no point of the drawing"
        owned = [("link", link) for link in self.links] + [("direction", each) for each in self.directions]
        for kind, item in [*owned, *(("joint", each) for each in self.joints)]:
            if item.limb is not None and item.limb not in limbs:
                yield f"a {kind} belongs to limb {item.limb!r}, which has no wrench"
        for mark in self.marks:
            if mark.parameter not in parameters:
                yield f"a mark shows {mark.parameter!r}, which is no parameter"
            if len(mark.points) != mark.kind.size:
                yield f"the mark of {mark.parameter!r} should have {mark.kind.size} points, got {len(mark.points)}"


def _vectors(circle: Circle) -> tuple[tuple[str, SX], ...]:
    """Return the three (3, 1) vectors of a circle with their names."""
    return ("centre", circle.centre), ("through", circle.through), ("normal", circle.normal)


def outline(points: FloatArray) -> list[int]:
    """Return the indices of the corners of the convex hull of points (n, 3) in their plane of least squares.

    Points on a line have two corners, its ends; points at one place have one.
    """
    middle = points - points.mean(axis=0)
    size = float(np.abs(middle).max(initial=0.0))
    if size == 0.0:
        return [0]
    _, extents, axes = np.linalg.svd(middle)
    flat = middle @ axes[:2].T
    order = sorted(range(len(points)), key=lambda k: (flat[k, 0], flat[k, 1]))
    if len(extents) < 2 or extents[1] <= _NEAR * extents[0]:
        return [order[0], order[-1]]
    # Andrew's monotone chain: both halves turn left at every corner.
    halves = []
    for way in (order, order[::-1]):
        half: list[int] = []
        for k in way:
            while len(half) > 1 and _turn(flat[half[-2]], flat[half[-1]], flat[k]) <= _NEAR * size**2:
                half.pop()
            half.append(k)
        halves.append(half[:-1])
    return halves[0] + halves[1]


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Return twice the area of a triangle, positive where its corners turn left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
