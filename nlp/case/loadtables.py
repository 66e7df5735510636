"""Tables of loads, of the platform's motions and of gravity in a case file, and what they state."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, FiniteFloat, model_validator

from ...models import Dimension
from ..units import Units
from .loads import GRAVITY, Load, Loading, Motion
from .table import Table, Vector, fault_of

#: Keys that a mass does not have.
_NOT_OF_MASS = ("force", "moment", "point", "frame", "sign", "any")


class AnyTable(Table):
    """A load of any direction."""

    force: FiniteFloat = Field(default=Load.any_force, ge=0, description="size of a force in any direction")
    moment: FiniteFloat = Field(default=Load.any_moment, ge=0, description="size of a moment about any axis")


class LoadTable(Table):
    """A load: what the world does to the platform."""

    name: str | None = Field(default=None, min_length=1, description="a few words")
    force: Vector = Field(default=[0.0, 0.0, 0.0], description="force on the platform")
    moment: Vector = Field(default=[0.0, 0.0, 0.0], description="moment on it, about the point")
    point: Vector = Field(default=[0.0, 0.0, 0.0], description="where it acts, in the platform's frame")
    frame: Literal["world", "platform"] = Field(default="world", description="directions of force and moment")
    sign: Literal["given", "both"] = Field(default="given", description="this load alone, or its opposite too")
    any: AnyTable | None = Field(default=None, description="force and moment of any direction, on top")
    mass: FiniteFloat | None = Field(default=None, gt=0, description="a mass whose weight acts, instead of a force")
    centre: Vector = Field(default=[0.0, 0.0, 0.0], description="centre of the mass, in the platform's frame")
    always: bool = Field(default=Load.always, description="whether it is added to each of the other loads")

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> LoadTable:
        """Return the table, or refuse a mass beside a force, and a centre without a mass."""
        given = [key for key in _NOT_OF_MASS if key in self.model_fields_set]
        if self.mass is not None and given:
            raise fault_of(given[0], "cannot stand beside mass; write another [[load]]")
        if self.mass is None and "centre" in self.model_fields_set:
            raise fault_of("centre", "means nothing without mass; a force acts at point")
        return self


class MotionTable(Table):
    """The platform's fastest motions, in any direction and about any axis."""

    linear: FiniteFloat = Field(default=Motion.linear, ge=0, description="speed of its origin, length per second")
    angular: FiniteFloat = Field(default=Motion.angular, ge=0, description="angular speed, angle per second")


class GravityTable(Table):
    """Gravity, for loads that are masses."""

    acceleration: Vector = Field(
        description=f"weight of a unit of mass; without this table {[*GRAVITY]}, in m, N and kg"
    )


class ObjectiveTable(Table):
    """What is optimised: a number of the actuators instead of F, or the worst F of all poses."""

    minimise: Literal["actuator_force", "actuator_speed", "actuator_power"] | None = Field(
        default=None, description="its largest size over loads, actuators and poses is made as small as possible"
    )
    over: Literal["workspace", "path"] | None = Field(
        default=None, description="F is its worst over all poses there, where the limits must hold too"
    )

    @model_validator(mode="after")
    def _refuse_nothing(self) -> ObjectiveTable:
        """Return the table, or refuse one that says nothing."""
        if self.minimise is None and self.over is None:
            raise fault_of("minimise", "is missing: give minimise, over, or both")
        return self


def loading_of(
    loads: list[LoadTable], motion: MotionTable | None, gravity: GravityTable | None, units: Units
) -> Loading:
    """Return the loads, the motions and the gravity that a case file states."""
    return Loading(
        tuple(_load(table, f"load {index + 1}") for index, table in enumerate(loads)),
        None if motion is None else Motion(motion.linear, units.to_internal(motion.angular, Dimension.TURN_SPEED)),
        None if gravity is None else tuple(gravity.acceleration),
    )


def _load(table: LoadTable, name: str) -> Load:
    """Return the load of a table, with a name for one that has none."""
    further = table.any or AnyTable()
    return Load(
        name=table.name or name,
        force=tuple(table.force),
        moment=tuple(table.moment),
        point=tuple(table.point if table.mass is None else table.centre),
        in_platform=table.frame == "platform",
        both_signs=table.sign == "both",
        any_force=further.force,
        any_moment=further.moment,
        mass=table.mass or 0.0,
        always=table.always,
    )
