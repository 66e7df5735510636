"""Tables of sets of positions under ``workspace.position`` in a case file."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, Tag, model_validator

from ...models import Dimension
from ..units import Units
from .pose import Value, internal_value
from .positionsets import HalfSpace, PositionSet, SetKind, Triple
from .table import Table, Vector, empty_list, fault_of

#: Keys of the size of a shape.
_SIZES = ("diameter", "radius")


class SpanTable(Table):
    """Range of a coordinate of the pose."""

    min: FiniteFloat = Field(description="smallest value of the coordinate")
    max: FiniteFloat = Field(description="largest value of the coordinate, above min")


Span = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[SpanTable, Tag("<range>")],
    Discriminator(lambda value: "<range>" if isinstance(value, dict | SpanTable) else "<number>"),
]
Plane = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]
#: A height: a number, ``{ min, max }``, or two ends.
Height = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[SpanTable, Tag("<range>")] | Annotated[Plane, Tag("<list>")],
    Discriminator(
        lambda value: (
            "<range>" if isinstance(value, dict | SpanTable) else "<list>" if isinstance(value, list) else "<number>"
        )
    ),
]


class _Round(Table):
    """Shape with a radius."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [{"required": ["diameter"]}, {"required": ["radius"]}],
        }
    )

    diameter: FiniteFloat | None = Field(default=None, description="diameter; of the base for a cone")
    radius: FiniteFloat | None = Field(default=None, description="radius instead of the diameter")

    @model_validator(mode="after")
    def _refuse_two_sizes(self) -> _Round:
        """Refuse a shape without a size, or with both a diameter and a radius."""
        given = [name for name in _SIZES if getattr(self, name) is not None]
        if not given:
            raise fault_of("diameter", "is missing: give diameter or radius")
        if len(given) > 1:
            raise fault_of("radius", "conflicts with diameter; give one of them")
        return self

    @property
    def is_diameter(self) -> bool:
        """Whether the diameter is given."""
        return self.diameter is not None

    def size(self, units: Units) -> float:
        """Return the radius, length."""
        return _radius(self.diameter, self.radius, units)


class DiscTable(_Round):
    """Disc parallel to the x y plane, at one height or over a range of heights."""

    centre: Plane = Field(default=[0.0, 0.0], description="x and y of the centre")
    z: Height = Field(default=0.0, description="height: a number, { min, max } or [lower, upper]")


class RingTable(DiscTable):
    """Ring, or sector of a ring, parallel to the x y plane, at one height or over a range of heights."""

    inner_diameter: FiniteFloat | None = Field(default=None, description="inner diameter")
    inner_radius: FiniteFloat | None = Field(default=None, description="inner radius instead of the inner diameter")
    angle: SpanTable | None = Field(
        default=None, description="directions of a sector, from the x axis towards the y axis; a whole ring if left out"
    )

    @model_validator(mode="after")
    def _refuse_other_size(self) -> RingTable:
        """Refuse an inner size that is missing, or stated in another way than the outer one."""
        name = "diameter" if self.is_diameter else "radius"
        other = "radius" if self.is_diameter else "diameter"
        if getattr(self, f"inner_{other}") is not None:
            raise fault_of(f"inner_{other}", f"conflicts with {name}; give inner_{name}")
        if getattr(self, f"inner_{name}") is None:
            raise fault_of(f"inner_{name}", "is missing; a ring without it is a disc")
        return self


class CylinderTable(_Round):
    """Cylinder between two points of its axis."""

    start: Vector = Field(description="centre of one end")
    end: Vector = Field(description="centre of the other end")


class BallTable(_Round):
    """Ball."""

    centre: Vector = Field(description="centre of the ball")


class ConeTable(_Round):
    """Cone between its apex and its base."""

    apex: Vector = Field(description="apex of the cone")
    base: Vector = Field(description="centre of the base, on the axis")


class HalfSpaceTable(Table):
    """Half space: positions on the inner side of a plane."""

    normal: Vector = Field(description="direction out of the half space, of any length")
    point: Vector = Field(description="point on the plane")


class PositionSetTable(Table):
    """Set of positions: one shape, and half spaces that cut it."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": [kind.value]} for kind in SetKind]},
    )

    disc: DiscTable | None = Field(default=None, description="disc or upright cylinder")
    ring: RingTable | None = Field(default=None, description="ring or sector of a ring")
    cylinder: CylinderTable | None = Field(default=None, description="cylinder with any axis")
    ball: BallTable | None = Field(default=None, description="ball")
    cone: ConeTable | None = Field(default=None, description="cone with any axis")
    box: Annotated[list[Span], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="box: three coordinates, each a number or { min, max }"
    )
    half_spaces: list[HalfSpaceTable] = Field(
        default_factory=empty_list, description="half spaces that contain the set: planes that cut the shape"
    )

    @model_validator(mode="after")
    def _refuse_two_shapes(self) -> PositionSetTable:
        """Refuse a table without a shape, or with two."""
        given = [kind.value for kind in SetKind if getattr(self, kind.value) is not None]
        if not given:
            raise fault_of("", f"must have one of {', '.join(kind.value for kind in SetKind)}")
        if len(given) > 1:
            raise fault_of(given[1], f"conflicts with {given[0]}; a set of positions has one shape")
        return self

    def read(self, units: Units) -> PositionSet:
        """Return the set of positions."""
        kind = next(each for each in SetKind if getattr(self, each.value) is not None)
        given: DiscTable | RingTable | CylinderTable | BallTable | ConeTable | list[Span] = getattr(self, kind.value)
        halves = tuple(HalfSpace(_triple(each.normal, None), _triple(each.point, units)) for each in self.half_spaces)
        if isinstance(given, list):
            first, second, third = (internal_value(each, units, Dimension.LENGTH) for each in given)
            return PositionSet(kind, spans=(first, second, third), half_spaces=halves)
        size, is_diameter = given.size(units), given.is_diameter
        if isinstance(given, DiscTable):
            centre, spans = _triple([*given.centre, 0.0], units), (0.0, 0.0, _height(given.z, units))
            inner, angles = 0.0, tuple[float, ...]()
            if isinstance(given, RingTable):
                inner = _radius(given.inner_diameter, given.inner_radius, units)
                if given.angle is not None:
                    ends = given.angle.min, given.angle.max
                    angles = tuple(units.to_internal(each, Dimension.ANGLE) for each in ends)
            return PositionSet(
                kind,
                size,
                centre,
                inner=inner,
                angles=angles,
                spans=spans,
                half_spaces=halves,
                is_diameter=is_diameter,
            )
        if isinstance(given, BallTable):
            return PositionSet(kind, size, _triple(given.centre, units), half_spaces=halves, is_diameter=is_diameter)
        points = (given.apex, given.base) if isinstance(given, ConeTable) else (given.start, given.end)
        one, other = (_triple(each, units) for each in points)
        return PositionSet(kind, size, one, other, half_spaces=halves, is_diameter=is_diameter)


def _radius(diameter: float | None, radius: float | None, units: Units) -> float:
    """Return a radius, length, from a diameter or a radius of a file."""
    if diameter is not None:
        return units.to_internal(diameter, Dimension.LENGTH) / 2
    return units.to_internal(0.0 if radius is None else radius, Dimension.LENGTH)


def _height(written: float | SpanTable | list[float], units: Units) -> Value:
    """Return the height of a disc or ring."""
    if isinstance(written, list):
        written = SpanTable(min=written[0], max=written[1])
    return internal_value(written, units, Dimension.LENGTH)


def _triple(values: list[float], units: Units | None) -> Triple:
    """Return three numbers, lengths if units are given."""
    x, y, z = (each if units is None else units.to_internal(each, Dimension.LENGTH) for each in values)
    return float(x), float(y), float(z)
