"""Options for reading a path, and the units of its file.

Lengths of a path are in the unit of the case, and angles of options in degrees, as in G-code.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction

from ..errors import InputError, listing, nearest
from ..units import Units
from .orientation import order_named

#: Lengths of program units in millimetres, by their codes.
MILLIMETRES = {20: Fraction(127, 5), 21: Fraction(1)}
#: Lengths of case units in millimetres, by their labels.
_LABELS = {
    "um": Fraction(1, 1000), "mm": Fraction(1), "cm": Fraction(10), "dm": Fraction(100), "m": Fraction(1000),
    "in": MILLIMETRES[20], "ft": 12 * MILLIMETRES[20],
}  # fmt: skip
#: Controllers whose rules of reading programs are known.
FLAVOURS = ("linuxcnc", "printer")
#: Names of coordinate systems in LinuxCNC, numbered from 1.
SYSTEMS = (54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3)


class Between(enum.Enum):
    """Interpolation between two points of a path.

    ``ANGLES``: the three angles change linearly, as LinuxCNC moves the axes A, B and C. ``SLERP``: one rotation about a
    fixed axis by the smallest angle. In both, the position changes linearly or along an arc.
    """

    ANGLES = "angles"
    SLERP = "slerp"


@dataclass(frozen=True)
class PathOptions:
    """Options that a path's file does not state.

    Attributes:
        between: interpolation between two points; None for linear angles, or for ``SLERP`` if a table of poses states
            quaternions, or axes and angles.
        angles: convention of a program's angles A, B and C; see :data:`.orientation.ORDERS`.
        unit: length unit of a program before G20 or G21, ``"mm"`` or ``"in"``; None for the length unit of the case, if
            this is mm or in.
        start: (6,) position X, Y, Z, A, B, C of the machine before a program, in machine coordinates; None if unknown:
            the path then begins at the first point with known X, Y and Z.
        offsets: (6,) origin of each coordinate system in machine coordinates, by the system's name, such as ``"G54"``;
            0 for a system without an entry.
        skips_deleted: If true, lines that begin with a slash are skipped, as by default in LinuxCNC.
        flavour: rules of reading a program: ``"linuxcnc"``, or ``"printer"`` for firmware of 3D printers.
        end_of_file: If true, the end of the file ends a program, as for printers; otherwise it needs M2, M30 or %.
        part: number of the part of a printer's program that is the path, from 1; None for the only part. Homing,
            macros and motors off divide a program into parts.
        macros: names of a printer's macros that a program may call; their motions are not in the file.

    Raises:
        InputError: the value of an option is not allowed.
    """

    between: Between | None = None
    angles: str = "rpy"
    unit: str | None = None
    start: Sequence[float] | None = None
    offsets: Mapping[str, Sequence[float]] = field(default_factory=dict)
    skips_deleted: bool = True
    flavour: str = "linuxcnc"
    end_of_file: bool = False
    part: int | None = None
    macros: Sequence[str] = ()

    def __post_init__(self) -> None:
        order_named(self.angles)
        if self.flavour not in FLAVOURS:
            raise InputError(f"flavour = {self.flavour!r}: must be {' or '.join(FLAVOURS)}")
        self._check_flavour()
        if self.unit not in (None, "mm", "in"):
            raise InputError(f"unit = {self.unit!r}: must be mm or in")
        names = [f"G{code}" for code in SYSTEMS]
        for name, numbers in (*self.offsets.items(), *([] if self.start is None else [("start", self.start)])):
            if name not in ("start", *names):
                raise InputError(f"offset {name!r}: no such coordinate system; {nearest(name, names)}")
            if len(numbers) != 6 or not all(math.isfinite(number) for number in numbers):
                raise InputError(f"{name} = {listing(map(str, numbers))}: must be six finite numbers: X, Y, Z, A, B, C")

    @classmethod
    def stated_in(cls, given: object) -> PathOptions:
        """Return the options that a case or the premises of a proof state under the same names.

        Raises:
            InputError: an option has no meaning in the flavour of the program.
            ValueError: the interpolation is unknown.
        """
        names = (each.name for each in fields(cls) if each.name not in ("between", "skips_deleted"))
        between: str | None = getattr(given, "between", None)
        options = {name: getattr(given, name) for name in names}
        return cls(None if between is None else Between(between), **options)

    def _check_flavour(self) -> None:
        """Refuse options without a meaning in the flavour.

        Raises:
            InputError: there is such an option.
        """
        if self.part is not None and self.part < 1:
            raise InputError(f"part = {self.part}: must be 1 or more")
        if self.flavour == "printer":
            wrong = {"unit": self.unit not in (None, "mm"), "offsets": bool(self.offsets)}
            reason = "has no meaning with the flavour printer: firmware of printers reads millimetres without offsets"
        else:
            wrong = {"part": self.part is not None, "macros": bool(self.macros)}
            reason = "is only for the flavour printer"
        for name in wrong:
            if wrong[name]:
                raise InputError(f"{name} = {getattr(self, name)!r}: {reason}")


def code_of_unit(unit: str | None, units: Units) -> int | None:
    """Return the code of the initial unit of a program; None if it is unknown.

    Args:
        unit: length unit, see ``unit`` of :class:`PathOptions`.
        units: units of the case.
    """
    return {"mm": 21, "in": 20}.get(unit or units.length)


def program_unit(code: int, units: Units, source: str) -> Fraction:
    """Return the length of a program's unit in the unit of the case.

    Args:
        code: code of the program's unit, 20 or 21.
        units: units of the case.
        source: name of the program, for messages.

    Raises:
        InputError: the unit of the case has no known length.
    """
    if units.length not in _LABELS:
        fault = f"the case's unit of lengths, {units.length!r}, has no known length in millimetres"
        raise InputError(f"{source}: cannot be read: {fault}; {nearest(units.length, _LABELS)}")
    return MILLIMETRES[code] / _LABELS[units.length]
