"""Tool path of a case: name of its file, and conventions that the file does not state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from ...models import Dimension
from ...models.values import dataclass
from ..errors import CaseError
from ..units import Units
from .checks import check_direction, check_value
from .pose import MISSING_RATE, Free, Value, written_value
from .workspace import LARGEST_TURN, TURNS

if TYPE_CHECKING:
    from .toml import TomlValue

#: Conventions of three angles: axes of the rotation matrices from left to right, and ``rpy`` for ``zyx``.
Convention: TypeAlias = Literal["rpy", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]
#: Coordinates of the path's frame, with their dimensions: position, then rotation ``Rz(yaw) Ry(pitch) Rx(roll)``.
PLACE = {**dict.fromkeys("xyz", Dimension.LENGTH), **dict.fromkeys(TURNS, Dimension.ANGLE)}


#: Name of the turn about the tool's axis among the values that change along a path.
TURN = "turn"


@dataclass(frozen=True)
class Tool:
    """Tool on the platform; its axis goes through the origin of the platform frame.

    Attributes:
        axis: (3,) direction of the axis in the platform frame, of any length but zero.
        turn: turn of the platform about the axis, radians, added to the orientations of the path; a :class:`Free` with
            a rate changes along the path.
    """

    axis: tuple[float, float, float]
    turn: Value = 0.0


@dataclass(frozen=True)
class PathFile:
    """Tool path of a case, as the name of its file; the file is read when a command needs the path.

    Attributes:
        file: name of the file: G-code, or a table of poses whose name ends in ``.csv``.
        folder: folder from which the name begins: that of the case file; empty for the current folder.
        unit: ``"mm"`` or ``"in"``, unit of the G-code before G20 or G21; None for the case's length unit.
        start: (6,) X, Y, Z, A, B, C before the first line of the G-code, angles in degrees; None if not known.
        offsets: (6,) origin of each coordinate system of the G-code by its name, such as ``"G54"``.
        angles: convention of the angles A, B and C in the G-code.
        between: interpolation of rotations between two points, ``"angles"`` or ``"slerp"``; None for the file's
            default.
        flavour: ``"linuxcnc"`` or ``"printer"``, rules of reading the G-code.
        end_of_file: If true, the end of the file ends the G-code, which then needs no M2, M30 or %.
        part: number of the part of a printer's G-code that is the path, from 1; None for the only part.
        macros: names of a printer's macros that the G-code may call; their motions are not in the file.
        tool: axis of the tool, and the turn about it; None for no tool.
        periodic: If true, values that change along the path are equal at its first and last point.
        place: (6,) pose of the path's frame in the world frame: position, then roll, pitch and yaw, radians; each fixed
            or free.
        has_limits: If true, a solve finds a design without singularities and violated limits along the whole path.
    """

    file: str
    folder: str = ""
    unit: Literal["mm", "in"] | None = None
    start: Sequence[float] | None = None
    offsets: Mapping[str, Sequence[float]] = field(default_factory=dict)
    angles: Convention = "rpy"
    between: Literal["angles", "slerp"] | None = None
    place: tuple[Value, ...] = (0.0,) * 6
    has_limits: bool = False
    flavour: Literal["linuxcnc", "printer"] = "linuxcnc"
    end_of_file: bool = False
    part: int | None = None
    macros: Sequence[str] = ()
    tool: Tool | None = None
    periodic: bool = False

    def check(self, units: Units) -> None:
        """Check the pose of the path's frame.

        Args:
            units: units of messages.

        Raises:
            CaseError: a coordinate is out of its range, or there are not six.
        """
        if len(self.place) != len(PLACE):
            raise CaseError("path.place", f"must have {len(PLACE)} numbers, got {len(self.place)}")
        for (name, dimension), value in zip(PLACE.items(), self.place, strict=True):
            domain = (-LARGEST_TURN, LARGEST_TURN) if dimension is Dimension.ANGLE else (-math.inf, math.inf)
            check_value(value, f"path.place.{name}", dimension, units, domain)
        if self.tool is not None:
            check_direction(self.tool.axis, "path.tool.axis")
            turn = check_value(self.tool.turn, "path.tool.turn", Dimension.ANGLE, units, (-math.tau, math.tau))
            if isinstance(turn, Free) and turn.rate is None:
                raise CaseError("path.tool.turn.rate", MISSING_RATE)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free coordinates of the path's frame."""
        return tuple(name for name, value in zip(PLACE, self.place, strict=True) if isinstance(value, Free))

    @property
    def name(self) -> Path:
        """Path of the file."""
        return Path(self.folder) / self.file

    def to_keys(self, units: Units) -> dict[str, TomlValue | None]:
        """Return the keys of the table ``[path]`` that state this path, with the file name unchanged."""
        place = {
            name: None if value == 0 else written_value(value, units, dimension)
            for (name, dimension), value in zip(PLACE.items(), self.place, strict=True)
        }
        return {
            "file": self.file,
            "unit": self.unit,
            "start": None if self.start is None else list(self.start),
            "offsets": {name: list(origin) for name, origin in self.offsets.items()} or None,
            "angles": None if self.angles == PathFile.angles else self.angles,
            "between": self.between,
            "flavour": None if self.flavour == PathFile.flavour else self.flavour,
            "end_of_file": self.end_of_file or None,
            "part": self.part,
            "macros": list(self.macros) or None,
            "tool": None if self.tool is None else self._tool(self.tool, units),
            "periodic": self.periodic or None,
            "place": place if any(value is not None for value in place.values()) else None,
        }

    @staticmethod
    def _tool(tool: Tool, units: Units) -> TomlValue:
        """Return the table of the tool."""
        turn = {} if tool.turn == 0 else {TURN: written_value(tool.turn, units, Dimension.ANGLE)}
        return {"axis": list(tool.axis), **turn}
