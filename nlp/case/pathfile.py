"""The programmed path of a case: the name of its file, and choices that the file leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from ...models.values import dataclass

if TYPE_CHECKING:
    from .toml import TomlValue

#: Conventions of three angles: the factors of a rotation from left to right, and ``rpy`` for ``zyx``.
Convention: TypeAlias = Literal["rpy", "xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]


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
        has_limits: whether a solve must find a design that is regular and keeps the case's limits along the path.
    """

    file: str
    folder: str = ""
    unit: Literal["mm", "in"] | None = None
    start: Sequence[float] | None = None
    offsets: Mapping[str, Sequence[float]] = field(default_factory=dict)
    angles: Convention = "rpy"
    between: Literal["angles", "slerp"] | None = None
    has_limits: bool = False

    @property
    def name(self) -> Path:
        """Path of the file."""
        return Path(self.folder) / self.file

    def to_keys(self) -> dict[str, TomlValue | None]:
        """Return the table of a case file that states this path; the file's name is as it was stated."""
        return {
            "file": self.file,
            "unit": self.unit,
            "start": None if self.start is None else list(self.start),
            "offsets": {name: list(origin) for name, origin in self.offsets.items()} or None,
            "angles": None if self.angles == PathFile.angles else self.angles,
            "between": self.between,
        }
