"""Tables of loads, platform motions, gravity and the objective in a case file, and their conversion."""

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
    """Force and moment of unknown direction, by their largest magnitudes."""

    force: FiniteFloat = Field(
        default=Load.any_force, ge=0, description="magnitude of a force that may act in any direction"
    )
    moment: FiniteFloat = Field(
        default=Load.any_moment, ge=0, description="magnitude of a moment that may act about any axis"
    )


class LoadTable(Table):
    """External load on the platform: force and moment at a point, or the weight of a mass."""

    name: str | None = Field(default=None, min_length=1, description="name of the load, such as cutting force")
    force: Vector = Field(default=[0.0, 0.0, 0.0], description="external force on the platform")
    moment: Vector = Field(default=[0.0, 0.0, 0.0], description="external moment on the platform, about the point")
    point: Vector = Field(default=[0.0, 0.0, 0.0], description="point at which the force acts, in the platform frame")
    frame: Literal["world", "platform"] = Field(
        default="world", description="frame in which force and moment are given"
    )
    sign: Literal["given", "both"] = Field(
        default="given", description="given: the load acts in the given sense only; both: the opposite load counts too"
    )
    any: AnyTable | None = Field(
        default=None, description="additional force and moment of unknown direction, by their magnitudes"
    )
    mass: FiniteFloat | None = Field(
        default=None, gt=0, description="mass whose weight is the load, instead of a force and a moment"
    )
    centre: Vector = Field(default=[0.0, 0.0, 0.0], description="centre of the mass, in the platform frame")
    always: bool = Field(
        default=Load.always, description="If true, the load acts together with each of the other loads"
    )

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> LoadTable:
        """Refuse a mass together with a force, and a centre without a mass."""
        given = [key for key in _NOT_OF_MASS if key in self.model_fields_set]
        if self.mass is not None and given:
            raise fault_of(given[0], "conflicts with mass; write another [[load]]")
        if self.mass is None and "centre" in self.model_fields_set:
            raise fault_of("centre", "has no effect without mass; for a force, use point")
        return self


class MotionTable(Table):
    """Largest speeds of the platform, in any direction and about any axis."""

    linear: FiniteFloat = Field(
        default=Motion.linear, ge=0, description="largest speed of the platform origin, length per second"
    )
    angular: FiniteFloat = Field(
        default=Motion.angular, ge=0, description="largest angular speed of the platform, angle per second"
    )


class GravityTable(Table):
    """Gravity, for loads given as masses."""

    acceleration: Vector = Field(
        description=f"acceleration of gravity in the world frame, force per mass; "
        f"without this table {[*GRAVITY]} in units of m, N and kg"
    )


class ObjectiveTable(Table):
    """Objective: a quantity of actuators, legs or J instead of F, or the worst F over a workspace or path."""

    minimise: Literal["actuator_force", "actuator_speed", "actuator_power", "leg_length"] | None = Field(
        default=None,
        description="quantity of the actuators whose largest magnitude over loads, actuators and poses is minimised; "
        "leg_length: longest leg along the path",
    )
    maximise: Literal["smallest_singular_value"] | None = Field(
        default=None,
        description="quantity that is maximised along the path: the smallest singular value of J, with moments about "
        "the platform origin divided by length",
    )
    length: float | None = Field(
        default=None,
        description="length by which moments about the platform origin are divided; only with maximise",
    )
    over: Literal["workspace", "path"] | None = Field(
        default=None,
        description="poses over which the worst F is optimised; limits.over must name the same ones, or as is given",
    )
    as_: Literal["mean", "worst"] | None = Field(
        default=None,
        alias="as",
        description="combination over the points of the path, while values with per = 'path' change along it: mean "
        "(weighted by time, or by length without times) or worst",
    )

    @model_validator(mode="after")
    def _refuse_nothing(self) -> ObjectiveTable:
        """Refuse a table without an objective, with two of them, or with a length that has no effect."""
        if self.minimise is None and self.maximise is None and self.over is None:
            raise fault_of("minimise", "is missing: give minimise, over, or both")
        if self.minimise is not None and self.maximise is not None:
            raise fault_of("maximise", f'conflicts with minimise = "{self.minimise}"; remove one of them')
        if self.length is not None and self.maximise is None:
            raise fault_of("length", "has an effect only with maximise; remove it")
        return self


def loading_of(
    loads: list[LoadTable], motion: MotionTable | None, gravity: GravityTable | None, units: Units
) -> Loading:
    """Return loads, motion and gravity of a case file."""
    return Loading(
        tuple(_load(table, f"load {index + 1}") for index, table in enumerate(loads)),
        None if motion is None else Motion(motion.linear, units.to_internal(motion.angular, Dimension.TURN_SPEED)),
        None if gravity is None else tuple(gravity.acceleration),
    )


def _load(table: LoadTable, name: str) -> Load:
    """Return the load of a table.

    Args:
        table: the table.
        name: name of the load if the table has none.
    """
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
