"""Tables of the workspace and of the programmed path in a case file, and what they state."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, Tag, model_validator

from ...models import Dimension, unit_vector
from ..units import Units
from .checks import check_direction
from .pathfile import PLACE, Convention, PathFile
from .pose import internal_value
from .table import FileName, Table, Value, Vector, fault_of
from .workspace import TURNS, TurnKind, Turns, Workspace


class SpanTable(Table):
    """A range of a number of the pose."""

    min: FiniteFloat = Field(description="smallest value")
    max: FiniteFloat = Field(description="largest value, above min")


Span = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[SpanTable, Tag("<range>")],
    Discriminator(lambda value: "<range>" if isinstance(value, dict | SpanTable) else "<number>"),
]


class WorkspaceRotationTable(Table):
    """Rotations of a workspace: about any axis, about one axis, or by roll, pitch and yaw."""

    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [
                {"required": ["angle"], "properties": {"roll": False, "pitch": False, "yaw": False}},
                {"required": ["roll"], "properties": {"angle": False, "axis": False}},
                {"required": ["pitch"], "properties": {"angle": False, "axis": False}},
                {"required": ["yaw"], "properties": {"angle": False, "axis": False}},
            ]
        }
    )

    axis: Vector | None = Field(default=None, description="axis of the world frame; left out: any axis")
    angle: Span | None = Field(default=None, description="angle about the axis")
    roll: Span | None = Field(default=None, description="first turn, about the world's x; 0 if left out")
    pitch: Span | None = Field(default=None, description="second turn, about the world's y; 0 if left out")
    yaw: Span | None = Field(default=None, description="third turn, about the world's z; 0 if left out")

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> WorkspaceRotationTable:
        """Return the table, or refuse two forms of a rotation beside each other, and none."""
        turns = [name for name in TURNS if getattr(self, name) is not None]
        others = [name for name in ("angle", "axis") if getattr(self, name) is not None]
        if turns and others:
            raise fault_of(turns[0], f"cannot stand beside {others[0]}; state the rotation in one way")
        if not turns and self.angle is None:
            raise fault_of("angle", "is missing: give angle, or one or more of roll, pitch, yaw")
        return self


class WorkspaceTable(Table):
    """The poses that a machine must reach: every pose of a box."""

    about: Literal["world", "pose"] = Field(
        default="world",
        description="origin of the numbers: the world, or the case's pose, for excursions along the axes of the world",
    )
    position: Annotated[list[Span], Field(min_length=3, max_length=3)] = Field(
        description="origin of the platform frame"
    )
    rotation: WorkspaceRotationTable | None = Field(default=None, description="left out: no rotation")

    def read(self, units: Units, *, has_limits: bool) -> Workspace:
        """Return the workspace, over which limits may hold.

        Raises:
            CaseError: the axis of its rotations is zero.
        """
        position = [internal_value(value, units, Dimension.LENGTH) for value in self.position]
        return Workspace(position, _turns(self.rotation, units), has_limits, about_pose=self.about == "pose")


Six = Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)]


class PlaceTable(Table):
    """The place of a path's frame in the world; free numbers are chosen by a solve with limits over the path."""

    x: Value = Field(default=0.0, description="position")
    y: Value = Field(default=0.0, description="position")
    z: Value = Field(default=0.0, description="position")
    roll: Value = Field(default=0.0, description="first turn, about the world's x")
    pitch: Value = Field(default=0.0, description="second turn, about the world's y")
    yaw: Value = Field(default=0.0, description="third turn, about the world's z")


class PathTable(Table):
    """The programmed path along which a machine is judged."""

    file: FileName = Field(description="file beside this one: G-code, or a .csv file of poses")
    unit: Literal["mm", "in"] | None = Field(default=None, description="unit of a program before G20 or G21")
    start: Six | None = Field(
        default=None, description="X, Y, Z, A, B, C, angles in degrees, where the machine stands before a program"
    )
    offsets: dict[Literal["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"], Six] = Field(
        default_factory=dict, description="origins of a program's coordinate systems"
    )
    angles: Convention = Field(default=PathFile.angles, description="convention of a program's A, B and C")
    between: Literal["angles", "slerp"] | None = Field(default=None, description="motion between two points")
    place: PlaceTable | None = Field(default=None, description="of the path's frame; left out: that of the world")

    def read(self, folder: str, units: Units, *, has_limits: bool) -> PathFile:
        """Return the programmed path, along which limits may hold; its file is beside the document, in the folder."""
        given, stated = dict(self), self.place
        given["place"] = tuple(
            0.0 if stated is None else internal_value(getattr(stated, name), units, dimension)
            for name, dimension in PLACE.items()
        )
        return PathFile(folder=folder, has_limits=has_limits, **given)


def _turns(rotation: WorkspaceRotationTable | None, units: Units) -> Turns:
    """Return the rotations that a case file states.

    Raises:
        CaseError: the axis is zero.
    """
    if rotation is None:
        return Turns()
    if rotation.angle is None:
        angles = [internal_value(getattr(rotation, name) or 0.0, units, Dimension.ANGLE) for name in TURNS]
        return Turns(TurnKind.ROLL_PITCH_YAW, tuple(angles))
    angle = internal_value(rotation.angle, units, Dimension.ANGLE)
    if rotation.axis is None:
        return Turns(TurnKind.ANY_AXIS, (angle,))
    x, y, z = unit_vector(check_direction(rotation.axis, "workspace.rotation.axis")).tolist()
    return Turns(TurnKind.AXIS, (angle,), (x, y, z))
