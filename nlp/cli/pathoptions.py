"""Options of the commands ``path`` and ``verify-proof`` that say how a path's file is read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from . import options

if TYPE_CHECKING:
    from ..path.options import PathOptions

AlongFile = Annotated[
    str | None,
    options.file("--along", "The path, poses in a .csv file or G-code, in place of the case's own"),
]
Unit = Annotated[str | None, options.text("--unit", "mm|in", "Unit of a program before G20 or G21")]
Stands = Annotated[
    str | None,
    options.text("--start", "X,Y,Z,A,B,C", "Where the machine stands before a program"),
]
Offsets = Annotated[
    list[str] | None,
    options.several("--offset", "G54=X,Y,Z,A,B,C", "Origin of a program's coordinate system"),
]
Angles = Annotated[
    str | None,
    options.text("--angles", "rpy|xyz|...", "Convention of a program's A, B, C; LinuxCNC's rpy if left out"),
]
BetweenPoints = Annotated[
    str | None,
    options.text("--between", "angles|slerp", "Turns between points: linear angles, or one axis"),
]


class PathChoices(NamedTuple):
    """Choices that a path's file leaves open, as texts of the options; None for those that are not given."""

    unit: str | None
    start: str | None
    offsets: list[str]
    angles: str | None
    between: str | None

    @property
    def is_any(self) -> bool:
        """Whether one is given."""
        return any(each not in (None, []) for each in self)

    def over(self, own: PathOptions) -> PathOptions:
        """Return the choices of a case, but for what is given.

        Raises:
            InputError: one is not allowed.
        """
        from dataclasses import replace

        from ..errors import InputError
        from ..path.options import Between

        def numbers(option: str, text: str) -> list[float]:
            try:
                return [float(part) for part in text.split(",")]
            except ValueError:
                raise InputError(f"{option} {text}: must be six numbers with commas: X,Y,Z,A,B,C") from None

        found = dict(own.offsets)
        for each in self.offsets:
            name, equals, text = each.partition("=")
            if not equals:
                raise InputError(f"--offset {each}: must be a coordinate system and its origin: G54=X,Y,Z,A,B,C")
            found[name] = numbers("--offset", text)
        if self.between not in (None, *(each.value for each in Between)):
            raise InputError(f"--between {self.between}: must be angles or slerp")
        return replace(
            own,
            between=own.between if self.between is None else Between(self.between),
            angles=own.angles if self.angles is None else self.angles,
            unit=own.unit if self.unit is None else self.unit,
            start=own.start if self.start is None else numbers("--start", self.start),
            offsets=found,
        )
