"""Schema of case files with all their tables: those of the workspace, and of limits, too."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, Tag, model_validator

from .limits.registry import LimitsTable
from .schema import Document
from .table import Table, Vector, fault_of
from .workspace import TURNS


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

    position: Annotated[list[Span], Field(min_length=3, max_length=3)] = Field(
        description="origin of the platform frame"
    )
    rotation: WorkspaceRotationTable | None = Field(default=None, description="left out: no rotation")


class WholeDocument(Document):
    """A whole case file."""

    limits: LimitsTable | None = Field(default=None, description="limits that a design must keep to be built")
    workspace: WorkspaceTable | None = Field(default=None, description="poses for which a machine is judged")
