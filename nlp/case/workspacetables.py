"""Tables of the workspace and of the tool path in a case file, and their conversion."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, Tag, model_validator

from ...models import Dimension, unit_vector
from ..units import Units
from .checks import check_direction
from .pathfile import PLACE, Convention, PathFile, Tool
from .pose import MISSING_RATE, internal_value
from .positionsets import PositionSet
from .positiontables import PositionSetTable, Span
from .table import FileName, Range, Table, Value, Vector, fault_of, tag_of_number
from .workspace import TURNS, TurnKind, Turns, Workspace


class WorkspaceRotationTable(Table):
    """Rotations of the workspace: about any axis, about one axis, or by roll, pitch and yaw."""

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

    axis: Vector | None = Field(
        default=None, description="axis of rotation in the world frame; if left out, rotations about every axis"
    )
    angle: Span | None = Field(default=None, description="angle of rotation about the axis, a number or a range")
    roll: Span | None = Field(default=None, description="first rotation, about the world x axis; 0 if left out")
    pitch: Span | None = Field(default=None, description="second rotation, about the world y axis; 0 if left out")
    yaw: Span | None = Field(default=None, description="third rotation, about the world z axis; 0 if left out")

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> WorkspaceRotationTable:
        """Refuse a table with two forms of the rotation, and a table without a rotation."""
        turns = [name for name in TURNS if getattr(self, name) is not None]
        others = [name for name in ("angle", "axis") if getattr(self, name) is not None]
        if turns and others:
            raise fault_of(turns[0], f"conflicts with {others[0]}; state the rotation in one way")
        if not turns and self.angle is None:
            raise fault_of("angle", "is missing: give angle, or one or more of roll, pitch, yaw")
        return self


class WorkspaceTable(Table):
    """Workspace: a box of poses, or a set of positions with rotations; the robot must reach all of its poses."""

    about: Literal["world", "pose"] = Field(
        default="world",
        description="world: position and rotation in the world frame; pose: excursions from the pose of the case, "
        "along and about the axes of the world frame",
    )
    position: Annotated[
        Annotated[Annotated[list[Span], Field(min_length=3, max_length=3)], Tag("<list>")]
        | Annotated[PositionSetTable, Tag("<set>")],
        Discriminator(lambda value: "<set>" if isinstance(value, dict | PositionSetTable) else "<list>"),
    ] = Field(
        description="origin of the platform frame: three coordinates, each a number or { min, max }; or a set of "
        "positions: { disc }, { ring }, { cylinder }, { ball }, { cone }, { box }, each with half_spaces if needed"
    )
    rotation: WorkspaceRotationTable | None = Field(
        default=None, description="rotations of the platform; if left out, no rotation"
    )

    def read(self, units: Units, *, has_limits: bool) -> Workspace:
        """Return the workspace.

        Args:
            units: units of the file.
            has_limits: If true, a solve must satisfy the limits at every pose of the workspace.

        Raises:
            CaseError: the axis of rotation is zero.
        """
        turns, about_pose = _turns(self.rotation, units), self.about == "pose"
        if isinstance(self.position, PositionSetTable):
            positions: PositionSet = self.position.read(units)
            return Workspace.within(positions, turns, has_limits, about_pose=about_pose)
        position = [internal_value(value, units, Dimension.LENGTH) for value in self.position]
        return Workspace(position, turns, has_limits, about_pose=about_pose)


Six = Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)]


class PlaceTable(Table):
    """Pose of the path's frame in the world frame; a solve with limits over the path chooses free coordinates."""

    x: Value = Field(default=0.0, description="x coordinate of the path's origin in the world frame")
    y: Value = Field(default=0.0, description="y coordinate of the path's origin in the world frame")
    z: Value = Field(default=0.0, description="z coordinate of the path's origin in the world frame")
    roll: Value = Field(default=0.0, description="first rotation of the path's frame, about the world x axis")
    pitch: Value = Field(default=0.0, description="second rotation of the path's frame, about the world y axis")
    yaw: Value = Field(default=0.0, description="third rotation of the path's frame, about the world z axis")


class TurnTable(Range):
    """Free turn of the platform about the tool's axis, which changes along the path."""

    rate: float | None = Field(default=None, description="largest change per second; inf for no limit")

    @model_validator(mode="after")
    def _refuse_without_rate(self) -> TurnTable:
        """Refuse a turn without its largest rate."""
        if self.rate is None:
            raise fault_of("rate", MISSING_RATE)
        return self


class ToolTable(Table):
    """Tool on the platform, whose axis goes through the origin of the platform frame."""

    axis: Vector = Field(description="direction of the tool's axis in the platform frame, of any length but zero")
    turn: Annotated[
        Annotated[FiniteFloat, Tag("<number>")] | Annotated[TurnTable, Tag("<range>")], Discriminator(tag_of_number)
    ] = Field(
        default=0.0,
        description="turn of the platform about the tool's axis, added to the path's orientations: a number, or "
        "{ min, max, rate } for a turn that changes along the path",
    )

    def read(self, units: Units) -> Tool:
        """Return the tool."""
        x, y, z = self.axis
        return Tool((x, y, z), internal_value(self.turn, units, Dimension.ANGLE))


class PathTable(Table):
    """Tool path along which the robot is verified."""

    file: FileName = Field(
        description="name of a file in the folder of the case file: G-code, or a table of poses (.csv)"
    )
    unit: Literal["mm", "in"] | None = Field(
        default=None, description="length unit of the G-code before G20 or G21; the unit of the case if left out"
    )
    start: Six | None = Field(
        default=None, description="X, Y, Z, A, B, C before the first line of the G-code, angles in degrees"
    )
    offsets: dict[Literal["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"], Six] = Field(
        default_factory=dict, description="origin (X, Y, Z, A, B, C) of each coordinate system of the G-code"
    )
    angles: Convention = Field(default=PathFile.angles, description="convention of the angles A, B and C in the G-code")
    between: Literal["angles", "slerp"] | None = Field(
        default=None,
        description="interpolation of rotations between two points: linear angles or slerp; the default depends on "
        "the file type",
    )
    flavour: Literal["linuxcnc", "printer"] = Field(
        default=PathFile.flavour, description="rules of reading the G-code: those of LinuxCNC or of 3D printers"
    )
    end_of_file: bool = Field(
        default=False, description="true if the end of the file ends the G-code, which then needs no M2, M30 or %"
    )
    part: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="part of a printer's G-code that is the path; the only part if left out"
    )
    macros: list[Annotated[str, Field(min_length=1)]] = Field(
        default_factory=list,
        description="names of a printer's macros that the G-code may call; their motions are not in the file",
    )
    place: PlaceTable | None = Field(
        default=None, description="pose of the path's frame in the world frame; if left out, both frames are equal"
    )
    tool: ToolTable | None = Field(default=None, description="axis of the tool, and the free turn about it")
    periodic: bool = Field(
        default=False, description="If true, values that change along the path are equal at its first and last point"
    )

    def read(self, folder: str, units: Units, *, has_limits: bool) -> PathFile:
        """Return the tool path.

        Args:
            folder: folder of the case file, from which the path's file name begins.
            units: units of the file.
            has_limits: If true, a solve must satisfy the limits along the whole path.
        """
        given, stated = dict(self) | {"macros": tuple(self.macros)}, self.place
        given["place"] = tuple(
            0.0 if stated is None else internal_value(getattr(stated, name), units, dimension)
            for name, dimension in PLACE.items()
        )
        given["tool"] = None if self.tool is None else self.tool.read(units)
        return PathFile(folder=folder, has_limits=has_limits, **given)


def _turns(rotation: WorkspaceRotationTable | None, units: Units) -> Turns:
    """Return the rotations of a workspace.

    Raises:
        CaseError: the axis of rotation is zero.
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
