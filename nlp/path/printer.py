"""G-code programs of 3D printers as tool paths, by the rules of Klipper and Marlin.

Points, arcs and offsets are read as by :mod:`.gcode`. The differences: all motions share one feed, dwells are in
milliseconds, and motions of the extruder only are dwells. After homing, macros and motors off the position is unknown:
these commands divide a program into parts, and one part is the path.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..units import Units
from .arcs import Arc
from .gcode import Interpreter
from .idle import UNKNOWN_START
from .merging import joined_to_previous
from .options import PathOptions
from .path import Kind, ProgrammedPath
from .printerwords import ACTED, MOTORS_OFF, STILL, command_of, is_closed, refuse
from .words import WordError

_POSITION = "XYZ"
#: Letters of motions along lines and arcs.
_LINE, _ARC = frozenset("XYZEF"), frozenset("XYZEFIJKR")
#: Commands with which printing ends.
_ENDS = frozenset({"M0", "M2", "M18", "M30", "M81", "M84"})
#: Largest number of parts, or of macros, that a message lists.
_SHOWN = 5


def read_printer_program(lines: Iterable[str], source: str, units: Units, options: PathOptions) -> ProgrammedPath:
    """Return the tool path of a printer's G-code program; the arguments are those of :func:`.gcode.read_program`.

    Raises:
        InputError: the program contains an unsupported command, makes no motion, or has several parts.
    """
    return _Printer(source, units, options).run(lines)


class _Place(NamedTuple):
    """Numbers of knots, segments and arcs before a part."""

    knots: int
    segments: int
    arcs: int


class _Printer(Interpreter):
    """State of a printer that runs a program, and the path so far."""

    def __init__(self, source: str, units: Units, options: PathOptions) -> None:
        super().__init__(source, units, options)
        self._set_unit(21)
        self.extruder = 0.0
        self.is_relative_extruder = self.is_ended = self.has_motion = False
        self.factor = 1.0
        #: Factors of feeds, with their first lines.
        self.factors: dict[str, int] = {}
        #: Feed of each segment with the factor of M220; NaN for a segment that is no line.
        self.feeds = array("d")
        self.begin = _Place(0, 0, 0)
        self.parts: list[tuple[_Place, _Place]] = []
        self.part = 1
        #: Commands whose motions are not in the file, with first line and number.
        self.hidden: dict[str, list[int]] = {}
        self.macros = frozenset(name.upper() for name in options.macros)

    def _run(self, lines: Iterable[str]) -> bool:
        for line in lines:
            self.line += 1
            name, words = command_of(line)
            if name in ("G0", "G1", "G2", "G3"):
                self._execute_motion(int(name[1:]), words)
            elif name:
                self._execute_command(name, words)
        self._close_part()
        self._choose_part()
        self._merge()
        return True

    def _warnings(self) -> tuple[str, ...]:
        found = []
        for name, (line, count) in list(self.hidden.items())[:_SHOWN]:
            more = f", and {count - 1} more" if count > 1 else ""
            found.append(f"{name} (line {line}{more}): its motions are not in the file and are not checked")
        if len(self.hidden) > _SHOWN:
            found.append(f"motions of {len(self.hidden) - _SHOWN} more macros are not checked")
        if self.factors:
            shown = ", ".join(f"{name} (line {line})" for name, line in list(self.factors.items())[:_SHOWN])
            more = f", and {len(self.factors) - _SHOWN} more" if len(self.factors) > _SHOWN else ""
            found.append(f"{shown}{more}: each scales the feeds after it by this percentage")
        if len(self.parts) > 1:
            found.append(f"part {self.part} of {len(self.parts)} of the program; the other parts are not checked")
        if not all(map(math.isnan, self.seconds)):
            found.append(
                "times follow from the programmed feeds; a print takes longer, because firmware limits acceleration"
            )
        if not self.is_ended:
            found.append("no M84 after the last motion: the file may be cut off")
        return tuple(found)

    def _execute_motion(self, code: int, words: dict[str, float]) -> None:
        """Execute a line with a motion."""
        allowed = _ARC if code > 1 else _LINE
        if not allowed.issuperset(words):
            letter = next(each for each in words if each not in allowed)
            raise WordError(f"{letter}{words[letter]:g}", f"is not supported with G{code} of printers")
        self.motion = code
        if "F" in words:
            if words["F"] <= 0:
                raise WordError(f"F{words['F']:g}", "must be above 0")
            self.feed, self.turn_feed = self._length(words["F"]), words["F"]
        extruded = self._extruded(words["E"]) if "E" in words else 0.0
        before = len(self.lines)
        if code > 1 and self.is_known:
            self._move_along_arc(code, words, self._end(words, is_machine=False))
        elif not words.keys().isdisjoint(_POSITION) and (end := self._end(words, is_machine=False)) != self.now:
            self._add(Kind.LINE, end, self._seconds(math.dist(self.now[:3], end[:3]), end, words))
        elif extruded and self.feed:
            self._wait(60 * abs(extruded) / (self.turn_feed * self.factor))
        if len(self.lines) > before and self.kinds[-1] != Kind.DWELL:
            self.has_motion, self.is_ended = True, False

    def _execute_command(self, name: str, words: dict[str, float]) -> None:
        """Execute a line whose command is not a motion."""
        self.is_ended = self.is_ended or name in _ENDS or name in self.macros
        if name in STILL:
            self._check_retraction(name, words)
            self._note(name)
            if name in MOTORS_OFF and (not words or not words.keys().isdisjoint(_POSITION)):
                self._lose_position()
        elif name in ACTED:
            self._act_on(name, words)
        elif name in self.macros and not is_closed(name):
            self.feed = 0.0
            self._hide(name)
        else:
            raise refuse(name)

    def _act_on(self, name: str, words: dict[str, float]) -> None:
        """Execute a command that changes the state."""
        if name in ("G90", "G91"):
            self.is_incremental = name == "G91"
        elif name in ("M82", "M83"):
            self.is_relative_extruder = name == "M83"
        elif name in ("G17", "G18", "G19"):
            self.plane = int(name[1:])
        elif name == "G28":
            self._hide(name)
        elif name == "G4":
            self._dwell(words)
        elif name == "G92":
            self._set_extruder(words)
        elif name == "M220":
            self._set_factor(words)

    def _extruded(self, value: float) -> float:
        """Move the extruder, and return its motion, mm."""
        if self.is_relative_extruder or self.is_incremental:
            self.extruder += value
            return value
        before, self.extruder = self.extruder, value
        return value - before

    def _set_extruder(self, words: dict[str, float]) -> None:
        """Set the position of the extruder (G92)."""
        if words.keys() != {"E"}:
            letters = "".join(letter for letter in words if letter != "E")
            which = f"sets {' and '.join(letters)}" if letters else "sets all axes to 0"
            raise WordError("G92", f"{which}; only E is supported: program the coordinates without an offset")
        self.extruder = words["E"]

    def _set_factor(self, words: dict[str, float]) -> None:
        """Set the factor of all feeds (M220)."""
        if words.keys() != {"S"} or words["S"] <= 0:
            raise WordError("M220", "is supported only with a percentage above 0, S")
        self.factor = words["S"] / 100
        self.factors.setdefault(f"M220 S{words['S']:g}", self.line)

    def _check_retraction(self, name: str, words: dict[str, float]) -> None:
        """Refuse a retraction that lifts the tool, and offsets of tools.

        Raises:
            WordError: the line has such a word.
        """
        for letter, value in words.items():
            if letter in "LXYZUVWABC" and (name == "G10" or value):
                which = "offsets of tools and coordinates are" if name == "G10" else "a lift of the tool is"
                raise WordError(name, f"{which} not supported, because the path would differ from that in the file")

    def _dwell(self, words: dict[str, float]) -> None:
        if not {"P", "S"}.issuperset(words) or len(words) > 1:
            raise WordError("G4", "needs one time: P in milliseconds, or S in seconds")
        seconds = words.get("P", 0.0) / 1000 + words.get("S", 0.0)
        if seconds < 0:
            raise WordError("G4", "needs a time of at least 0")
        if seconds:
            self._wait(seconds)

    def _wait(self, seconds: float) -> None:
        """Add a dwell to the path, if the path has begun."""
        if self.is_known:
            self._add(Kind.DWELL, self.now, seconds)

    def _seconds(self, length: float, end: list[float], words: dict[str, float]) -> float:  # noqa: ARG002
        return 60 * length / (self.feed * self.factor) if self.feed else math.nan

    def _stated(self, axis: int, code: str) -> float:  # noqa: ARG002
        # An unknown coordinate stays unknown after a relative motion.
        return self.now[axis]

    def _add(self, kind: Kind, end: list[float], seconds: float, arc: Arc | None = None) -> None:
        before = len(self.lines)
        super()._add(kind, end, seconds, arc)
        if len(self.lines) > before:
            self.feeds.append(self.feed * self.factor if kind is Kind.LINE else math.nan)

    def _place(self) -> _Place:
        return _Place(len(self.knots) // 6, len(self.lines), len(self.planes))

    def _hide(self, name: str) -> None:
        """Record a command with motions that are not in the file, and lose the position."""
        self.hidden.setdefault(name, [self.line, 0])[1] += 1
        self._lose_position()

    def _lose_position(self) -> None:
        """Begin a part at an unknown position; before the first motion, a stated start position stays known."""
        if self.options.start is not None and not self.parts and not self.has_motion:
            return
        self._close_part()
        self.now, self.is_known = [math.nan] * 3 + [0.0] * 3, False
        if self.parts:
            self.before_path = UNKNOWN_START

    def _close_part(self) -> None:
        """End a part; a part without a motion is dropped."""
        here = self._place()
        if self.has_motion:
            self.parts.append((self.begin, here))
        self.begin, self.has_motion = here, False

    def _choose_part(self) -> None:
        """Reduce the arrays to the part that is the path.

        Raises:
            InputError: the options choose none of several parts, or one that does not exist.
        """
        if not self.parts:
            self.lines = array("i")
            return
        count, chosen = len(self.parts), self.options.part or 1
        if chosen > count or (count > 1 and self.options.part is None):
            shown = ", ".join(
                f"{k} (lines {self.lines[first.segments]} to {self.lines[last.segments - 1]})"
                for k, (first, last) in enumerate(self.parts[:_SHOWN], 1)
            )
            more = f", and {count - _SHOWN} more" if count > _SHOWN else ""
            cause = f"homing, macros and motors off divide the program into {count} part{'s' * (count > 1)}"
            fault = f"there is no part {chosen}; {cause}" if chosen > count else cause
            raise InputError(f"{self.source}: {fault}: {shown}{more}; choose one with --part")
        self.part = chosen
        first, last = self.parts[chosen - 1]
        self.knots = self.knots[6 * first.knots : 6 * last.knots]
        segments = slice(first.segments, last.segments)
        self.lines, self.kinds, self.seconds = self.lines[segments], self.kinds[segments], self.seconds[segments]
        self.feeds = self.feeds[segments]
        self.arcs, self.planes = self.arcs[6 * first.arcs : 6 * last.arcs], self.planes[first.arcs : last.arcs]

    def _merge(self) -> None:
        """Merge successive lines in one direction at one feed; times add up."""
        if not self.lines:
            return
        knots, kinds, feeds = np.array(self.knots).reshape(-1, 6), np.array(self.kinds), np.array(self.feeds)
        joined = joined_to_previous(knots[:, :3], kinds, feeds, self.scale)
        if not joined.any():
            return
        first = np.flatnonzero(~joined)
        last = np.append(first[1:], len(joined))
        self.seconds = array("d", np.add.reduceat(np.array(self.seconds), first).tolist())
        self.lines = array("i", np.array(self.lines)[first].tolist())
        self.kinds = array("B", kinds[first].tolist())
        self.knots = array("d", knots[np.append(0, last)].ravel().tolist())
