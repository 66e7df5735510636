"""Table of a controller's conventions in a case file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, FiniteFloat, StringConstraints, Tag

from ...models import Model
from ...models.statics import driven_joints
from ..units import Units
from .controller import Controller, controller_of
from .table import Table, Vector, tag_of_number

_ByActuator = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[dict[str, FiniteFloat], Tag("<range>")],
    Discriminator(tag_of_number),
]


class ControllerTable(Table):
    """Conventions of the controller for generated kinematics: zero and sense of actuators, world frame and units."""

    length: Annotated[str, StringConstraints(strip_whitespace=True, max_length=20)] = Field(
        default=Controller.length, description="unit of length, such as mm; left out: that of the case"
    )
    angle: Literal["deg", "rad"] = Field(
        default=Controller.angle, description="unit of actuator angles and of roll, pitch, yaw in C"
    )
    zero: _ByActuator | None = Field(
        default=None,
        description="coordinate of the controller where that of the case is 0: of all actuators or by name",
    )
    sign: _ByActuator | None = Field(
        default=None, description="1 or -1: sense of the controller's coordinates, of all actuators or by name"
    )
    origin: Vector = Field(
        default=[0.0, 0.0, 0.0], description="origin of the controller's world frame in that of the case"
    )
    rpy: Vector = Field(
        default=[0.0, 0.0, 0.0], description="roll, pitch, yaw of the controller's world frame in that of the case"
    )

    def read(self, model: Model, units: Units) -> Controller:
        """Return the conventions for the actuators of a robot."""
        return controller_of(driven_joints(model), units, **dict(self))
