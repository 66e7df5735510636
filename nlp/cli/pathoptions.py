"""Options of the commands ``path`` and ``verify-proof`` for reading a path's file."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

from . import options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..path.options import PathOptions

AlongFile = Annotated[
    str | None,
    options.file("--along", "Tool path, G-code or a .csv file of poses, instead of the path of the case"),
]
Unit = Annotated[str | None, options.text("--unit", "mm|in", "Length unit of G-code before G20 or G21")]
Stands = Annotated[
    str | None,
    options.text("--start", "X,Y,Z,A,B,C", "Pose before the G-code begins; X,Y,Z if the angles are 0"),
]
Offsets = Annotated[
    list[str] | None,
    options.several("--offset", "G54=X,Y,Z,A,B,C", "Origin of a coordinate system of the G-code"),
]
Angles = Annotated[
    str | None,
    options.text("--angles", "rpy|xyz|...", "Convention of A, B, C in the G-code; rpy, as in LinuxCNC, if left out"),
]
BetweenPoints = Annotated[
    str | None,
    options.text("--between", "angles|slerp", "Rotation between points: linear in the angles, or about one axis"),
]
Flavour = Annotated[
    str | None,
    options.text(
        "--flavour", "linuxcnc|printer", "Rules of reading G-code: LinuxCNC's, the default, or those of 3D printers"
    ),
]
EndOfFile = Annotated[bool, options.flag("--end-of-file", "The end of the file ends the G-code, without M2, M30 or %")]
Part = Annotated[int | None, options.whole("--part", "Part of a printer's G-code between homings or macros, from 1", 1)]
Macros = Annotated[
    list[str] | None,
    options.several("--macro", "NAME", "Macro that a printer's G-code may call; its motions are not checked"),
]


class PathChoices(NamedTuple):
    """Texts of the options for reading a path file; None for missing options."""

    unit: str | None
    start: str | None
    offsets: list[str]
    angles: str | None
    between: str | None
    flavour: str | None = None
    end_of_file: bool = False
    part: int | None = None
    macros: Sequence[str] = ()

    @property
    def is_any(self) -> bool:
        """True if an option is given."""
        return any(each not in (None, [], (), False) for each in self)

    def over(self, own: PathOptions) -> PathOptions:
        """Return the options of a case, with the given options in their place.

        Raises:
            InputError: an option is not allowed.
        """
        from dataclasses import replace

        from ..errors import InputError
        from ..path.options import Between

        def numbers(text: str) -> list[float]:
            try:
                found = [float(part) for part in text.split(",")]
            except ValueError:
                return []
            return found if all(map(math.isfinite, found)) else []

        def start_of(text: str) -> list[float]:
            found = numbers(text)
            if len(found) not in (3, 6):
                fault = "must be six finite numbers: X,Y,Z,A,B,C; or three, X,Y,Z, if the angles are 0"
                raise InputError(f"--start {text}: {fault}")
            return [*found, 0.0, 0.0, 0.0][:6]

        found = dict(own.offsets)
        for each in self.offsets:
            name, equals, text = each.partition("=")
            if not equals:
                raise InputError(f"--offset {each}: must be a coordinate system and its origin: G54=X,Y,Z,A,B,C")
            found[name] = numbers(text)
            if len(found[name]) != 6:
                raise InputError(f"--offset {each}: must be six finite numbers after {name}=: X,Y,Z,A,B,C")
        if self.between not in (None, *(each.value for each in Between)):
            raise InputError(f"--between {self.between}: must be angles or slerp")
        return replace(
            own,
            between=own.between if self.between is None else Between(self.between),
            angles=own.angles if self.angles is None else self.angles,
            unit=own.unit if self.unit is None else self.unit,
            start=own.start if self.start is None else start_of(self.start),
            offsets=found,
            flavour=self.flavour or own.flavour,
            end_of_file=self.end_of_file or own.end_of_file,
            part=own.part if self.part is None else self.part,
            macros=tuple(self.macros or own.macros),
        )
