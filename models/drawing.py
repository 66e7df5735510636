"""Drawing of a robot as symbols: points, links, joints, circles, directions and marks, without colours or widths.

The corners of a plate's outline are those of the convex hull of its joints, in order.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable

import numpy as np
from casadi import SX

from .arrays import FloatArray
from .values import dataclass

#: Distance below which two points coincide, or a point lies on an edge, relative to the size of the plate.
_NEAR = 1e-9


class Body(enum.Enum):
    """Body with which a part of the drawing moves."""

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
        end: name of the second point.
        body: the body with which the link moves.
        limb: name of the limb to which the link belongs; None for a link of no limb.
        kind: bar, rod or rail.
        row: index, among the rows of the limb, of the row whose force the link carries; None if the link carries
            several.
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
        """Name of the joint kind, for people."""
        return self.name.lower()


@dataclass(frozen=True, eq=False)
class JointSymbol:
    """The symbol of a joint.

    Attributes:
        name: unique within the drawing: limb and number, such as ``1:2``.
        kind: kind of the joint; a parallelogram has a symbol at each of its four hinges.
        place: (3, 1) position in world coordinates, length.
        axes: (3, 1) vector along each axis in world coordinates, of any length but zero; none for a spherical joint.
        body: the body with which the joint moves.
        limb: name of the limb to which the joint belongs, if the limb has a wrench.
        is_actuated: True if an actuator drives the joint.
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
    """Circle through joints, in world coordinates.

    Attributes:
        centre: (3, 1) centre of the circle, length.
        through: (3, 1) point of the circle, length.
        normal: (3, 1) normal of the circle's plane, of any length but zero.
        body: the body with which the circle moves.
    """

    centre: SX
    through: SX
    normal: SX
    body: Body


@dataclass(frozen=True, eq=False)
class Direction:
    """A named direction at a point, such as a joint's axis.

    Attributes:
        name: unique name within the drawing; the name of the parameter if the direction is a parameter.
        origin: (3, 1) start in world coordinates, length.
        vector: (3, 1) direction in world coordinates, of any length but zero.
        body: the body with which the direction moves.
        limb: name of the limb to which the direction belongs; None for a direction of no limb.
    """

    name: str
    origin: SX
    vector: SX
    body: Body
    limb: str | None = None


class MarkKind(enum.Enum):
    """Kind of quantity shown by a mark."""

    LENGTH = "length"
    ANGLE = "angle"
    POINT = "point"

    @property
    def size(self) -> int:
        """Number of points of a mark of this kind."""
        return {MarkKind.LENGTH: 2, MarkKind.ANGLE: 3, MarkKind.POINT: 1}[self]


@dataclass(frozen=True, eq=False)
class Mark:
    """Mark of a parameter in the drawing: the length, angle or point that the parameter measures.

    Attributes:
        parameter: name of the parameter.
        kind: length, angle or point.
        points: (3, 1) positions in world coordinates: start and end of a length; vertex, start and end of an angle; or
            the point.
        body: the body with which the mark moves.
    """

    parameter: str
    kind: MarkKind
    points: tuple[SX, ...]
    body: Body


@dataclass(frozen=True, eq=False)
class Scene:
    """The drawing of a robot.

    Attributes:
        points: named points of the drawing.
        links: straight links between points.
        circles: circles, such as those of joint centres.
        directions: directions at points, such as axes.
        marks: marks of parameters.
        joints: symbols of joints; a drawing without them has round dots at the ends of links.
    """

    points: tuple[Point, ...] = ()
    links: tuple[Link, ...] = ()
    circles: tuple[Circle, ...] = ()
    directions: tuple[Direction, ...] = ()
    marks: tuple[Mark, ...] = ()
    joints: tuple[JointSymbol, ...] = ()

    @property
    def expressions(self) -> tuple[tuple[str, SX], ...]:
        """All (3, 1) expressions of the drawing with names for messages, in the order of the fields."""
        return (
            *((f"point {point.name}", point.position) for point in self.points),
            *((f"circle {i} {name}", part) for i, circle in enumerate(self.circles) for name, part in _vectors(circle)),
            *((f"direction {item.name}", part) for item in self.directions for part in (item.origin, item.vector)),
            *((f"mark of {mark.parameter}", part) for mark in self.marks for part in mark.points),
            *((f"joint {each.name}", part) for each in self.joints for part in (each.place, *each.axes)),
        )

    def faults(self, limbs: Iterable[str], parameters: Iterable[str]) -> Iterable[str]:
        """Yield a sentence for every inconsistency between the drawing and the rest of the model.

        Faults are unknown ends of links, unknown limbs and parameters, and marks with a wrong number of points.

        Args:
            limbs: names of the model's limbs.
            parameters: names of the model's parameters.
        """
        points, limbs, parameters = {point.name for point in self.points}, set(limbs), set(parameters)
        for link in self.links:
            for end in (link.start, link.end):
                if end not in points:
                    yield f"a link ends at {end!r}, which is not a point of the drawing"
        owned = [("link", link) for link in self.links] + [("direction", each) for each in self.directions]
        for kind, item in [*owned, *(("joint", each) for each in self.joints)]:
            if item.limb is not None and item.limb not in limbs:
                yield f"a {kind} belongs to limb {item.limb!r}, which has no wrench"
        for mark in self.marks:
            if mark.parameter not in parameters:
                yield f"a mark shows {mark.parameter!r}, which is not a parameter"
            if len(mark.points) != mark.kind.size:
                yield f"the mark of {mark.parameter!r} should have {mark.kind.size} points, got {len(mark.points)}"


def _vectors(circle: Circle) -> tuple[tuple[str, SX], ...]:
    return ("centre", circle.centre), ("through", circle.through), ("normal", circle.normal)


def outline(points: FloatArray) -> list[int]:
    """Return the indices of the corners of the convex hull of points (n, 3) in their least-squares plane.

    Collinear points have two corners, the ends; coincident points have one.
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
