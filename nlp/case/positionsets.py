"""Sets of positions of a workspace: disc, ring, cylinder, ball, cone, and boxes or other shapes cut by half spaces.

A workspace keeps a box that encloses its set. Searches and the checker of proofs contract boxes to the set itself.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...models import Dimension, FloatArray, frozen_array, unit_vector
from ...models.rotation import perpendiculars
from ...models.values import dataclass
from ..errors import CaseError
from ..units import Units
from .checks import check_direction, check_value, check_vector
from .pose import Free, Value, ends_of, written_value

if TYPE_CHECKING:
    from .toml import TomlValue

Triple: TypeAlias = tuple[float, float, float]

#: Key of a set of positions in a case file.
KEY = "workspace.position"
#: Relative outward rounding of the enclosing box, and inward rounding of points that are moved into a set.
_OUTWARDS, _INWARDS = 2.0**-44, 2.0**-36
#: Number of points among which a point inside of the half spaces is chosen, and largest number of such choices.
_POINTS, _TRIALS, _SEED = 4096, 64, 0


class SetKind(enum.Enum):
    """Shapes of a set of positions; each is a key of ``workspace.position``."""

    DISC = "disc"
    RING = "ring"
    CYLINDER = "cylinder"
    BALL = "ball"
    CONE = "cone"
    BOX = "box"


#: Shapes with circles about a vertical axis: their heights are ranges of z.
UPRIGHT = (SetKind.DISC, SetKind.RING)
#: Shapes with an axis from one point to another.
_AXIAL = (SetKind.CYLINDER, SetKind.CONE)
#: Keys of the two points of the axis.
POINTS = {SetKind.CYLINDER: ("start", "end"), SetKind.CONE: ("apex", "base")}


@dataclass(frozen=True)
class HalfSpace:
    """Half space of positions ``p`` with ``normal . (p - point) <= 0``.

    Attributes:
        normal: direction out of the half space, of any length but zero.
        point: point on its plane, length.
    """

    normal: Triple
    point: Triple


@dataclass(frozen=True)
class PositionSet:
    """Set of positions of the platform's origin.

    Attributes:
        kind: shape of the set.
        radius: radius of the shape, of the base of a cone, or outer radius of a ring; 0 for a box.
        centre: centre of a disc, ring (x and y are read) or ball, first point of a cylinder's axis, apex of a cone.
        end: second point of a cylinder's axis; centre of a cone's base.
        inner: inner radius of a ring.
        angles: first and last direction of a ring, radians from the x axis towards the y axis; a whole ring if empty.
        spans: ranges of x, y and z of a box; the last one is also the range of z of a disc or ring.
        half_spaces: half spaces that contain the set.
        shift: displacement of the whole set, length.
        is_diameter: If true, the case states diameters instead of radii.
    """

    kind: SetKind
    radius: float = 0.0
    centre: Triple = (0.0, 0.0, 0.0)
    end: Triple = (0.0, 0.0, 0.0)
    inner: float = 0.0
    angles: tuple[float, ...] = ()
    spans: tuple[Value, Value, Value] = (0.0, 0.0, 0.0)
    half_spaces: tuple[HalfSpace, ...] = ()
    shift: Triple = (0.0, 0.0, 0.0)
    is_diameter: bool = False

    @property
    def shaped(self) -> tuple[int, ...]:
        """Indices of the coordinates whose ranges follow from the shape."""
        return (0, 1) if self.kind in UPRIGHT else () if self.kind is SetKind.BOX else (0, 1, 2)

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Indices of the coordinates that the set couples; the other coordinates have the ranges of the box."""
        return tuple(sorted({*self.shaped, *(k for each in self.half_spaces for k in range(3) if each.normal[k])}))

    @property
    def is_convex(self) -> bool:
        """Whether the set contains the line between any two of its positions."""
        return self.kind is not SetKind.RING

    @property
    def has_radius(self) -> bool:
        """Whether the shape has a radius."""
        return self.kind is not SetKind.BOX

    @property
    def axis(self) -> FloatArray:
        """Vector (3,) along the axis of a cylinder or a cone."""
        return frozen_array(np.subtract(self.end, self.centre), (3,))

    @cached_property
    def box(self) -> tuple[Value, Value, Value]:
        """Ranges of x, y and z of a box around the set: ranges of the file, or computed ranges, rounded outwards."""
        if self.kind is SetKind.BOX:
            return self._shifted(self.spans)
        r, low, high = self.radius, np.array(self.centre), np.array(self.centre)
        if self.kind in _AXIAL:
            low, high = np.minimum(self.centre, self.end), np.maximum(self.centre, self.end)
            a = self.axis / (float(np.linalg.norm(self.axis)) or 1.0)
            across = r * np.sqrt(np.maximum(1 - a * a, 0.0))
            if self.kind is SetKind.CONE:
                base = np.array(self.end)
                low, high = np.minimum(self.centre, base - across), np.maximum(self.centre, base + across)
            else:
                low, high = low - across, high + across
        else:
            low, high = low - r, high + r
        slack = _OUTWARDS * np.maximum(np.maximum(np.abs(low), np.abs(high)), r)
        if self.kind in _AXIAL:
            # A coordinate along the axis ends at the two points.
            slack[across == 0] = 0.0
        ends: list[Value] = [Free(*each) for each in zip((low - slack).tolist(), (high + slack).tolist(), strict=True)]
        if self.kind in UPRIGHT:
            ends[2] = self.spans[2]
        return self._shifted((ends[0], ends[1], ends[2]))

    def _shifted(self, spans: tuple[Value, Value, Value]) -> tuple[Value, Value, Value]:
        """Return ranges after the displacement; they are rounded outwards."""
        if not any(self.shift):
            return spans
        found = list[Value]()
        for value, by in zip(spans, self.shift, strict=True):
            if not isinstance(value, Free):
                found.append(value + by)
                continue
            low, high = value.lower + by, value.upper + by
            found.append(Free(math.nextafter(low, -math.inf), math.nextafter(high, math.inf)) if by else value)
        return found[0], found[1], found[2]

    @cached_property
    def middle(self) -> FloatArray:
        """Position (3,) inside the set, from which searches begin: the centre of the shape where it belongs to the set.

        Raises:
            CaseError: no position of the shape was found in all half spaces.
        """
        shape = np.array([sum(ends_of(each)) / 2 for each in self.spans])
        if self.kind in UPRIGHT:
            shape[:2] = self.centre[:2]
        if self.kind is SetKind.RING:
            first, last = self.angles or (0.0, 0.0)
            between, at = (self.inner + self.radius) / 2, (first + last) / 2
            shape[:2] += between * np.array([math.cos(at), math.sin(at)])
        elif self.kind is SetKind.BALL:
            shape = np.array(self.centre)
        elif self.kind in _AXIAL:
            shape = (np.array(self.centre) + np.array(self.end)) / 2
        shape = shape + np.array(self.shift)
        if not self.half_spaces or float(self.depths(shape[None])[0]) > 0:
            return frozen_array(shape, (3,))
        rng = np.random.default_rng(_SEED)
        for _ in range(_TRIALS):
            points = self.shape_points(_POINTS, rng)
            depths = self.depths(points)
            if depths.max() > 0:
                return frozen_array(points[int(depths.argmax())], (3,))
        raise CaseError(f"{KEY}.half_spaces", f"exclude every position of the {self.kind.value}")

    def depths(self, points: FloatArray) -> FloatArray:
        """Return the smallest distances (N,) of points (N, 3) from the planes of the half spaces, negative outside."""
        found = np.full(len(points), np.inf)
        for each in self.half_spaces:
            n = np.array(each.normal) / np.linalg.norm(each.normal)
            found = np.minimum(found, (np.array(each.point) + np.array(self.shift) - points) @ n)
        return found

    def shape_points(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random points (count, 3) of the shape, slightly inside its surface; half spaces are not considered."""
        ends = np.array([ends_of(each) for each in self.box])
        points = rng.uniform(ends[:, 0], ends[:, 1], (count, 3))
        share, turn = rng.uniform(size=(2, count))
        r: float | FloatArray
        r, about = self.radius * (1 - _INWARDS), np.stack([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)], axis=1)
        origin = np.array(self.centre) + np.array(self.shift)
        if self.kind is SetKind.DISC:
            points[:, :2] = origin[:2] + r * np.sqrt(share)[:, None] * about
        elif self.kind is SetKind.RING:
            first, last = self.angles or (0.0, 2 * math.pi)
            room = _INWARDS * (last - first)
            at = first + room + turn * (last - first - 2 * room)
            least = self.inner * (1 + _INWARDS)
            size = np.sqrt(least**2 + share * (r**2 - least**2))
            points[:, :2] = origin[:2] + size[:, None] * np.stack([np.cos(at), np.sin(at)], axis=1)
        elif self.kind is SetKind.BALL:
            away = rng.normal(size=(count, 3))
            points = origin + r * np.cbrt(share)[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
        elif self.kind in _AXIAL:
            along = _INWARDS + (1 - 2 * _INWARDS) * rng.uniform(size=count)
            if self.kind is SetKind.CONE:
                along = np.minimum(np.cbrt(along), 1 - _INWARDS)
                r = r * along
            e = perpendiculars(unit_vector(self.axis))
            points = origin + along[:, None] * self.axis + (r * np.sqrt(share))[:, None] * (about @ e)
        return points

    def shape_clipped(self, points: FloatArray) -> FloatArray:
        """Return points (N, 3) moved into the shape, slightly inside its surface; half spaces are not considered."""
        ends = np.array([ends_of(each) for each in self.box])
        points = np.clip(points, ends[:, 0], ends[:, 1])
        r, origin = self.radius * (1 - _INWARDS), np.array(self.centre) + np.array(self.shift)
        if self.kind is SetKind.DISC:
            points[:, :2] = origin[:2] + _shortened(points[:, :2] - origin[:2], r)
        elif self.kind is SetKind.RING:
            d = points[:, :2] - origin[:2]
            at, size = np.arctan2(d[:, 1], d[:, 0]), np.clip(np.linalg.norm(d, axis=1), self.inner * (1 + _INWARDS), r)
            if self.angles:
                first, last = self.angles
                centre, half = (first + last) / 2, (last - first) / 2 * (1 - _INWARDS)
                off = np.remainder(at - centre + np.pi, 2 * np.pi) - np.pi
                at = centre + np.clip(off, -half, half)
            points[:, :2] = origin[:2] + size[:, None] * np.stack([np.cos(at), np.sin(at)], axis=1)
        elif self.kind is SetKind.BALL:
            points = origin + _shortened(points - origin, r)
        elif self.kind in _AXIAL:
            a = self.axis
            along = np.clip((points - origin) @ a / (a @ a), _INWARDS, 1 - _INWARDS)[:, None]
            off = points - origin - ((points - origin) @ a / (a @ a))[:, None] * a
            points = origin + along * a + _shortened(off, r * (along[:, 0] if self.kind is SetKind.CONE else 1.0))
        return points

    def scaled(self, factor: float) -> PositionSet:
        """Return the set with its radius times a factor: the width of a ring, the size of a cone about its apex.

        The shape of a set without a radius is scaled about its centre. Half spaces and heights stay.
        """
        if self.kind is SetKind.RING:
            return replace(self, radius=self.inner + factor * (self.radius - self.inner))
        if self.kind is SetKind.CONE:
            end = np.array(self.centre) + factor * self.axis
            return replace(self, radius=factor * self.radius, end=(float(end[0]), float(end[1]), float(end[2])))
        if self.kind is SetKind.BOX:
            first, second, third = (scaled_range(each, factor) for each in self.spans)
            return replace(self, spans=(first, second, third))
        return replace(self, radius=factor * self.radius)

    def moved(self, offset: FloatArray) -> PositionSet:
        """Return the set displaced by a vector (3,)."""
        x, y, z = (np.array(self.shift) + offset).tolist()
        return replace(self, shift=(x, y, z))

    def contains(self, point: FloatArray) -> bool:
        """Return whether a point (3,) lies in the set, up to rounding."""
        size = max(float(np.abs(np.array([ends_of(each) for each in self.box])).max()), self.radius)
        near = np.linalg.norm(self.shape_clipped(point[None]) - point) <= 8 * _INWARDS * size
        return bool(near and self.depths(point[None])[0] >= -_INWARDS * size)

    def check(self, units: Units) -> None:
        """Check the numbers of the set.

        Raises:
            CaseError: a number is not allowed; the message names its key in a case file.
        """
        key = f"{KEY}.{self.kind.value}"
        name = "diameter" if self.is_diameter else "radius"
        for index in (2,) if self.kind in UPRIGHT else range(3) if self.kind is SetKind.BOX else ():
            place = f"{key}.z" if self.kind in UPRIGHT else f"{key}[{index}]"
            check_value(self.spans[index], place, Dimension.LENGTH, units)
        factor = 2.0 if self.is_diameter else 1.0
        if self.has_radius and not 0 < self.radius < math.inf:
            raise CaseError(f"{key}.{name}", "must be above 0", units.shown(factor * self.radius, Dimension.LENGTH))
        if self.kind is SetKind.RING:
            if not 0 < self.inner < self.radius:
                fault = f"must be above 0, and below the {name} of the ring"
                shown = units.shown(factor * self.inner, Dimension.LENGTH)
                raise CaseError(f"{key}.inner_{name}", fault, shown)
            if self.angles and not 0 < self.angles[1] - self.angles[0] < 2 * math.pi:
                fault = (
                    "must have min below max, and less than a whole turn between them; leave it out for a whole ring"
                )
                raise CaseError(f"{key}.angle", fault)
        check_vector(self.centre, f"{key}.{POINTS.get(self.kind, ('centre', ''))[0]}")
        if self.kind in _AXIAL:
            first, last = POINTS[self.kind]
            check_vector(self.end, f"{key}.{last}")
            if not self.axis.any():
                raise CaseError(f"{key}.{last}", f"must be a point different from {first}")
        for k, each in enumerate(self.half_spaces):
            check_direction(each.normal, f"{KEY}.half_spaces[{k}].normal")
            check_vector(each.point, f"{KEY}.half_spaces[{k}].point")
        _ = self.middle

    def to_table(self, units: Units) -> dict[str, TomlValue | None]:
        """Return the table of the set in a case file."""

        def length(value: float) -> TomlValue:
            return units.written(value, Dimension.LENGTH)

        def point(values: Triple, count: int = 3) -> TomlValue:
            shifted = [value + by for value, by in zip(values, self.shift, strict=True)]
            return [length(each) for each in shifted[:count]]

        name, factor = ("diameter", 2.0) if self.is_diameter else ("radius", 1.0)
        spans: list[TomlValue] = [written_value(each, units, Dimension.LENGTH) for each in self._shifted(self.spans)]
        shape: dict[str, TomlValue | None] = {name: length(factor * self.radius)}
        if self.kind in UPRIGHT:
            shape["centre"] = point(self.centre, 2) if any((*self.centre, *self.shift)) else None
            shape["z"] = spans[2]
        elif self.kind is SetKind.BALL:
            shape["centre"] = point(self.centre)
        elif self.kind in _AXIAL:
            shape |= dict(zip(POINTS[self.kind], (point(self.centre), point(self.end)), strict=True))
        if self.kind is SetKind.RING:
            shape[f"inner_{name}"] = length(factor * self.inner)
            if self.angles:
                ends = (units.written(each, Dimension.ANGLE) for each in self.angles)
                shape["angle"] = dict(zip(("min", "max"), ends, strict=True))
        halves: list[TomlValue] = [
            {"normal": list(each.normal), "point": point(each.point)} for each in self.half_spaces
        ]
        own: TomlValue = spans if self.kind is SetKind.BOX else {k: v for k, v in shape.items() if v is not None}
        return {self.kind.value: own, "half_spaces": halves or None}

    def words(self, units: Units, digits: Callable[[float], str] = "{:.7g}".format) -> str:
        """Return a description of the set without ranges of coordinates, such as ``disc of diameter 200 mm``.

        Args:
            units: units of the description.
            digits: formatter of numbers.
        """

        def text(value: float) -> str:
            return digits(units.shown(value, Dimension.LENGTH))

        def at(values: Triple, count: int = 3) -> str:
            return f"({', '.join(text(v + by) for v, by in zip(values[:count], self.shift, strict=False))})"

        unit = f" {units.label(Dimension.LENGTH)}".rstrip()
        name, factor = ("diameter", 2.0) if self.is_diameter else ("radius", 1.0)
        parts = []
        if self.kind is SetKind.RING:
            parts.append(f"ring of {name} {text(factor * self.inner)} to {text(factor * self.radius)}{unit}")
            parts[-1] += f" about {at(self.centre, 2)}" if any((*self.centre[:2], *self.shift[:2])) else ""
            if self.angles:
                ends = " to ".join(digits(units.shown(each, Dimension.ANGLE)) for each in self.angles)
                parts[-1] += f", directions {ends} {units.label(Dimension.ANGLE)}"
        elif self.has_radius:
            parts.append(f"{self.kind.value} of {name} {text(factor * self.radius)}{unit}")
            if self.kind in _AXIAL:
                between = "from {} to {}" if self.kind is SetKind.CYLINDER else "with apex {} and base {}"
                parts[-1] += f" {between.format(at(self.centre), at(self.end))}{unit}"
            else:
                count = 2 if self.kind is SetKind.DISC else 3
                parts[-1] += f" about {at(self.centre, count)}" if any((*self.centre, *self.shift)) else ""
        if self.half_spaces:
            count = len(self.half_spaces)
            parts.append(f"{'box ' * (not parts)}within {count} half space{'s' * (count > 1)}")
        return ", ".join(parts)


def scaled_range(value: Value, factor: float) -> Value:
    """Return a range scaled about its centre; a fixed value stays."""
    if not isinstance(value, Free):
        return value
    centre = (value.lower + value.upper) / 2
    return Free(centre + factor * (value.lower - centre), centre + factor * (value.upper - centre))


def _shortened(vectors: FloatArray, most: float | FloatArray) -> FloatArray:
    """Return vectors (N, k) with norms of at most the given ones, (N,) or a number."""
    sizes = np.linalg.norm(vectors, axis=1)
    factors = most / np.maximum(np.maximum(sizes, most), np.finfo(float).tiny)
    return np.asarray(vectors * factors[:, None])
