"""The programmed path of a case: the name of its file, and choices that the file leaves open."""

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
from .checks import check_value
from .pose import Free, Value, written_value
from .workspace import LARGEST_TURN, TURNS

if TYPE_CHECKING:
    from .toml import TomlValue

#: Conventions of three angles: the factors of a rotation from left to right, and ``rpy`` for ``zyx``.
Convention: TypeAlias = Literal["rpy", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]
#: Names of the numbers of a place, with their dimensions: position, then rotation ``Rz(yaw) Ry(pitch) Rx(roll)``.
PLACE = {**dict.fromkeys("xyz", Dimension.LENGTH), **dict.fromkeys(TURNS, Dimension.ANGLE)}


@dataclass(frozen=True)
class PathFile:
    """The file of a programmed path, which is read where the path is asked for.

    Attributes:
        file: name of the file: G-code, or a table of poses whose name ends in ``.csv``.
        folder: folder beside which the file is: that of the case file; the current one if left out.
        unit: ``"mm"`` or ``"in"``, of a program before G20 or G21; None for that of the case.
        start: (6,) X, Y, Z, A, B, C at which the machine stands before a program, angles in degrees; None where this is
            not known.
        offsets: (6,) origins of a program's coordinate systems by their names, such as ``"G54"``.
        angles: convention of a program's A, B and C.
        between: ``"angles"`` or ``"slerp"``, the motion between two points; None for that of the file.
        place: (6,) of the path's frame in the world, its position and then roll, pitch and yaw, radians; fixed or free.
        has_limits: whether a solve must find a design that is regular and keeps the case's limits along the path.
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

    def check(self, units: Units) -> None:
        """Refuse a number of the place that is out of its range.

        Args:
            units: units for people.

        Raises:
            CaseError: it is refused.
        """
        if len(self.place) != len(PLACE):
            raise CaseError("path.place", f"must have {len(PLACE)} numbers, got {len(self.place)}")
        for (name, dimension), value in zip(PLACE.items(), self.place, strict=True):
            domain = (-LARGEST_TURN, LARGEST_TURN) if dimension is Dimension.ANGLE else (-math.inf, math.inf)
            check_value(value, f"path.place.{name}", dimension, units, domain)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free numbers of the place."""
        return tuple(name for name, value in zip(PLACE, self.place, strict=True) if isinstance(value, Free))

    @property
    def name(self) -> Path:
        """Path of the file."""
        return Path(self.folder) / self.file

    def to_keys(self, units: Units) -> dict[str, TomlValue | None]:
        """Return the table of a case file that states this path; the file's name is as it was stated."""
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
            "place": place if any(value is not None for value in place.values()) else None,
        }
