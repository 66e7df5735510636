"""G-code programs as tool paths, by the rules of LinuxCNC's interpreter.

Motions are read as by LinuxCNC, in its order within a line. Other words are refused with line and word, or listed as
ignored if they cause no motion. The reader tracks the current point in machine coordinates: lengths in the unit of the
case, and angles in degrees. :mod:`.printer` reads programs of printers with the same state.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable

import numpy as np

from ..case.pose import LARGEST
from ..errors import InputError
from ..units import Units
from .arcs import PLANES, TOLERANCES, Arc, ArcError, Tolerances, arc_about, arc_length, centre_of_radius
from .idle import BEFORE_PATH, idle_words
from .options import SYSTEMS, Between, PathOptions, code_of_unit, program_unit
from .orientation import order_named
from .path import Kind, ProgrammedPath
from .standing import duration_at, turns_between, without_rests
from .words import AXES, Block, WordError, block_of

#: Length of a translation, in millimetres or inches, that counts as none: so short a motion is a pure rotation.
_NO_WAY = 1e-7
#: Letters that are allowed on each line.
_ANYWHERE = frozenset("XYZABCFST")
_CENTRE = "IJK"
#: Largest number of turns of an arc, so that its angle keeps enough digits.
_MOST_TURNS = 10_000


def read_program(lines: Iterable[str], source: str, units: Units, options: PathOptions) -> ProgrammedPath:
    """Return the tool path of a G-code program.

    Args:
        lines: lines of the program.
        source: name of the program, for messages.
        units: units of the case.
        options: choices that the program leaves open.

    Raises:
        InputError: the program contains an unsupported word, has no end, or makes no motion.
    """
    return Interpreter(source, units, options).run(lines)


class Interpreter:
    """State of a machine that runs a program, and the path so far."""

    def __init__(self, source: str, units: Units, options: PathOptions) -> None:
        self.source, self.units, self.options = source, units, options
        self.order, self.between = order_named(options.angles), options.between or Between.ANGLES
        self.line = 0
        # Initial modes of LinuxCNC.
        self.motion: float = 80
        self.plane = 17
        self.is_incremental = self.has_absolute_centres = self.is_inverse_time = False
        self.feed = self.turn_feed = 0.0
        program_unit(21, units, source)  # refuses a case without a known unit
        self.unit: int | None = None
        self.scale = (1.0, 1.0)
        self.tolerances = Tolerances(0, 0, 0)
        if (unit := code_of_unit(options.unit, units)) is not None:
            self._set_unit(unit)
        # Offsets, and the point in machine coordinates.
        self.system = 0
        self.origins = [[float(each) for each in options.offsets.get(f"G{code}", (0,) * 6)] for code in SYSTEMS]
        self.axis_offsets = [0.0] * 6
        self.shift = list(self.origins[0])
        self.now = [math.nan] * 3 + [0.0] * 3 if options.start is None else [float(each) for each in options.start]
        self.is_known = options.start is not None
        # The path.
        self.knots = array("d", self.now if self.is_known else ())
        self.lines, self.kinds, self.seconds = array("i"), array("B"), array("d")
        self.arcs, self.planes = array("d"), array("B")
        self.idle: dict[str, list[int]] = {}
        self.before_path = BEFORE_PATH

    def run(self, lines: Iterable[str]) -> ProgrammedPath:
        """Return the tool path of a program; the errors are those of :func:`read_program`."""
        try:
            has_end = self._run(lines)
        except (WordError, ArcError) as error:
            word, fault = (
                (error.word, error.fault) if isinstance(error, WordError) else (f"G{self.motion:g}", str(error))
            )
            where = f"line {self.line}, {word}" if word else f"line {self.line}"
            raise InputError(f"{self.source}: {where}: {fault}") from None
        if not (has_end or self.options.end_of_file):
            raise InputError(
                f"{self.source}: line {self.line}: the program does not end with M2, M30 or %, so it may be"
                " cut off; if it is complete, give --end-of-file"
            )
        if not self.lines:
            unknown = [letter for letter, axis in AXES.items() if math.isnan(self.now[axis])]
            reason = f"the start of {' and '.join(unknown)} is not known" if unknown else "the program makes no motion"
            raise InputError(f"{self.source}: there is no path: {reason}")
        knots = np.array(self.knots).reshape(-1, 6)
        if not (np.abs(knots) <= LARGEST).all():
            line = self.lines[max(int(np.argmin((np.abs(knots) <= LARGEST).all(axis=1))) - 1, 0)]
            raise InputError(f"{self.source}: line {line}: must be finite and at most {LARGEST:g} in magnitude")
        knots[:, 3:] = np.radians(knots[:, 3:])
        path = ProgrammedPath(
            self.source,
            knots,
            np.array(self.lines, dtype=np.int32),
            np.array(self.kinds, dtype=np.uint8),
            np.array(self.seconds),
            np.array(self.arcs).reshape(-1, 6),
            np.array(self.planes, dtype=np.uint8),
            self.order,
            self.between,
            idle_words(self.idle),
            warnings=self._warnings(),
        )
        return without_rests(path, are_timed=False)

    def _run(self, lines: Iterable[str]) -> bool:
        """Run a program; return True if it has an end."""
        is_first, has_percent = True, False
        for line in lines:
            self.line += 1
            if is_first and line.strip():
                is_first, has_percent = False, line.strip() == "%"
                if has_percent:
                    continue
            if has_percent and line.strip() == "%":
                return True
            if self.options.skips_deleted and line.lstrip().startswith("/"):
                self._note("/")
            elif self._execute(block_of(line)):
                return True
        return False

    def _warnings(self) -> tuple[str, ...]:
        """Return sentences about the program that a user has to know."""
        return ()

    def _note(self, word: str) -> None:
        """Record a word that causes no motion."""
        self.idle.setdefault(word, [self.line, 0])[1] += 1

    def _execute(self, block: Block) -> bool:
        """Execute a line; return True if it ends the program."""
        codes, stops, words = block
        motion = self._motion_of(block)
        if not _ANYWHERE.issuperset(words):
            _check_letters(codes, words, motion)
        if stops or "S" in words or "T" in words:
            self._note_all(block)
        has_modes = len(codes) > ("motion" in codes)
        if has_modes:
            self._set_modes(codes, words)
        if "F" in words:
            self._set_feed(words["F"], motion)
        if has_modes:
            self._act(codes, words)
        if motion is not None:
            self._move(motion, words, codes.get("once") == 53)
        return stops.get("stop") in (2, 30)

    def _motion_of(self, block: Block) -> float | None:
        """Return the motion code of a line, modal or given on it; None for no motion."""
        codes, _, words = block
        once, has_axes = codes.get("once"), not AXES.keys().isdisjoint(words)
        motion = codes.get("motion")
        if once in (10, 92):
            if motion not in (None, 80):
                raise WordError(f"G{once:g}", f"conflicts with G{motion:g}: both use axis words")
            return motion
        if motion is None and (has_axes or (self.motion in (2, 3) and not words.keys().isdisjoint(_CENTRE))):
            motion = self.motion
            if motion == 80:
                word = next(letter for letter in words if letter in AXES)
                raise WordError(
                    f"{word}{words[word]:g}", "axis word without an active motion mode; program G0, G1, G2 or G3 first"
                )
        if motion == 80 and has_axes:
            raise WordError("G80", "conflicts with axis words")
        if once == 53 and motion not in (0, 1):
            raise WordError("G53", "needs G0 or G1")
        return motion

    def _note_all(self, block: Block) -> None:
        """Record the words of a line that cause no motion."""
        for code in block.stops.values():
            self._note(f"M{code:g}")
        for letter in ("S", "T"):
            if letter in block.words:
                self._note(f"{letter}{block.words[letter]:g}")

    def _set_modes(self, codes: dict[str, float], words: dict[str, float]) -> None:
        """Set the modes on which the feed of a line depends: feed mode and unit."""
        if "feed" in codes:
            self.is_inverse_time = codes["feed"] == 93
            self.feed = self.turn_feed = 0.0
        if "unit" in codes:
            unit = int(codes["unit"])
            if "F" in words and not self.is_inverse_time and self.unit not in (None, unit):
                raise WordError(f"G{unit}", "changes the unit of F on the same line; write F on another line")
            self._set_unit(unit)

    def _set_unit(self, code: int) -> None:
        """Set the unit of lengths, by its code."""
        self.unit, unit = code, program_unit(code, self.units, self.source)
        self.scale = (float(unit.numerator), float(unit.denominator))
        self.tolerances = TOLERANCES[code].times(float(unit))

    def _length(self, value: float) -> float:
        """Return a length of the program in the unit of the case."""
        if self.unit is None:
            raise WordError("", "the unit of length is not known: program G20 or G21 first")
        # Two factors, so that a millimetre is the nearest number to a thousandth of a metre.
        return value * self.scale[0] / self.scale[1]

    def _set_feed(self, value: float, motion: float | None) -> None:
        """Set the feed of a line: length or degrees per minute, or the inverse of the time in minutes."""
        if value < 0:
            raise WordError(f"F{value:g}", "is negative")
        if not self.is_inverse_time:
            self.feed, self.turn_feed = self._length(value), value
        elif motion not in (1, 2, 3):
            raise WordError(f"F{value:g}", "is an inverse time in G93, but the line has no G1, G2 or G3")

    def _act(self, codes: dict[str, float], words: dict[str, float]) -> None:
        """Execute the codes of a line that cause no motion, in LinuxCNC's order."""
        once = codes.get("once")
        if once == 4:
            self._dwell(words)
        self.plane = int(codes.get("plane", self.plane))
        if "system" in codes:
            self.system = SYSTEMS.index(codes["system"])
        if "control" in codes:
            parts = [f"{letter}{words[letter]:g}" for letter in "PQ" if letter in words]
            self._note(" ".join([f"G{codes['control']:g}", *parts]))
        self.is_incremental = codes.get("distance", 91 if self.is_incremental else 90) == 91
        self.has_absolute_centres = codes.get("centre", 90.1 if self.has_absolute_centres else 91.1) == 90.1
        if once == 10:
            self._set_origin(words)
        elif once == 92:
            self._set_axis_offsets(words)
        if "cancel" in codes:
            self.axis_offsets = [0.0] * 6
        self.shift = [a + b for a, b in zip(self.origins[self.system], self.axis_offsets, strict=True)]

    def _dwell(self, words: dict[str, float]) -> None:
        """Execute a dwell (G4)."""
        if not words.get("P", -1) >= 0:
            raise WordError("G4", "needs P, a time of 0 seconds or more")
        if words["P"]:
            self._add(Kind.DWELL, self.now, words["P"])

    def _axis_words(self, words: dict[str, float], code: str) -> dict[int, float]:
        """Return the axis words of a line by axis; refuse a line without axis words."""
        found = {AXES[a]: self._length(v) if AXES[a] < 3 else v for a, v in words.items() if a in AXES}
        if not found:
            raise WordError(code, "needs axis words, such as X10")
        return found

    def _set_origin(self, words: dict[str, float]) -> None:
        """Set the origin of a coordinate system (G10)."""
        if words.get("L") not in (2, 20):
            raise WordError("G10", "is supported only with L2 and L20")
        number = words.get("P", -1)
        if number not in range(len(SYSTEMS) + 1):
            raise WordError(
                "G10", f"P must be the number of a coordinate system, 1 to {len(SYSTEMS)}, or 0 for the active one"
            )
        system = int(number) - 1 if number else self.system
        for axis, value in self._axis_words(words, "G10").items():
            origin = value
            if words["L"] == 20:  # the point has this coordinate
                origin = self._stated(axis, "G10 L20") - self.axis_offsets[axis] - value
            self.origins[system][axis] = origin

    def _set_axis_offsets(self, words: dict[str, float]) -> None:
        """Set the axis offsets, so that the current point has the coordinates that the line states (G92)."""
        for axis, value in self._axis_words(words, "G92").items():
            self.axis_offsets[axis] = self._stated(axis, "G92") - self.origins[self.system][axis] - value

    def _stated(self, axis: int, code: str) -> float:
        """Return a coordinate of the current point; refuse a code that needs an unknown coordinate."""
        if math.isnan(self.now[axis]):
            raise WordError(code, f"needs the present {'XYZABC'[axis]}, which is not yet known; give the start point")
        return self.now[axis]

    def _move(self, motion: float, words: dict[str, float], is_machine: bool) -> None:
        """Make a motion if the line has axis words, and keep the motion mode for the following lines."""
        self.motion = motion
        if motion == 80:
            return
        if is_machine and self.is_incremental:
            raise WordError("G53", "needs absolute coordinates: program G90 first")
        if motion and not (words.get("F") if self.is_inverse_time else self.feed):
            needed = (
                "an F on the same line in G93" if self.is_inverse_time else "a feed: F is 0 or not stated since G94"
            )
            raise WordError(f"G{motion:g}", f"needs {needed}")
        end = self._end(words, is_machine)
        if motion > 1:
            self._move_along_arc(motion, words, end)
        elif end != self.now:
            self._add(
                Kind.LINE, end, self._seconds(math.dist(self.now[:3], end[:3]), end, words) if motion else math.nan
            )

    def _end(self, words: dict[str, float], is_machine: bool) -> list[float]:
        """Return the end point of a motion in machine coordinates."""
        end = self.now.copy()
        for letter, value in words.items():
            axis = AXES.get(letter)
            if axis is None:
                continue
            value = self._length(value) if axis < 3 else value  # noqa: PLW2901 - in the unit of the case
            if self.is_incremental:
                end[axis] = self._stated(axis, "G91") + value
            else:
                end[axis] = value if is_machine else value + self.shift[axis]
        return end

    def _seconds(self, length: float, end: list[float], words: dict[str, float]) -> float:
        """Return the time, seconds, of a motion at the feed, for a given length of the translation."""
        if self.is_inverse_time:
            return 60 / words["F"]
        still = _NO_WAY * self.scale[0] / self.scale[1]
        if length > still:
            return 60 * length / self.feed
        turn = turns_between(np.radians([self.now[3:], end[3:]]), self.order, self.between)
        feeds = np.array([self.feed / 60]), np.array([math.radians(self.turn_feed) / 60])
        return float(duration_at(np.array([length]), turn, feeds, still)[0])

    def _move_along_arc(self, motion: float, words: dict[str, float], end: list[float]) -> None:
        """Make an arc or a helix."""
        first, second, along = PLANES[self.plane]
        for axis in range(3):
            self._stated(axis, f"G{motion:g}")
        start, last, turns = (self.now[first], self.now[second]), (end[first], end[second]), words.get("P", 1)
        if not 1 <= turns <= _MOST_TURNS or turns != int(turns):
            raise WordError(f"P{turns:g}", f"must be a number of turns: 1, 2, ..., {_MOST_TURNS}")
        given = [letter for letter in _CENTRE if letter in words]
        if ("R" in words) == bool(given):
            raise WordError(f"G{motion:g}", "needs the offsets I, J, K of the centre, or the radius R, not both")
        if given:
            centre = self._centre(words, given, first, second)
        else:
            centre = centre_of_radius(self._length(words["R"]), start, last, motion == 2, self.tolerances)
        arc = arc_about(centre, start, last, int(turns if motion == 3 else -turns), self.tolerances)
        length = arc_length(arc.radius, arc.growth, arc.sweep, end[along] - self.now[along])
        self._add(Kind.ARC, end, self._seconds(length, end, words), arc)

    def _centre(self, words: dict[str, float], given: list[str], first: int, second: int) -> tuple[float, float]:
        """Return the centre given by I, J and K."""
        letters = [_CENTRE[first], _CENTRE[second]]
        for letter in given:
            if letter not in letters:
                raise WordError(f"{letter}{words[letter]:g}", f"is not an offset in the plane of G{self.plane}")
        if not self.has_absolute_centres:
            offsets = [self._length(words.get(letter, 0)) for letter in letters]
            return self.now[first] + offsets[0], self.now[second] + offsets[1]
        if len(given) < 2:
            raise WordError("G90.1", f"needs both {letters[0]} and {letters[1]}")
        one, other = (self._length(words[letter]) for letter in letters)
        return one + self.shift[first], other + self.shift[second]

    def _add(self, kind: Kind, end: list[float], seconds: float, arc: Arc | None = None) -> None:
        """Add a segment from the current point to an end point; from an unknown point, only move there."""
        self.now = end
        if not self.is_known:
            self._note(self.before_path)
            self.is_known = not any(map(math.isnan, end))
            self.knots.extend(end if self.is_known else ())
            return
        self.knots.extend(end)
        self.lines.append(self.line)
        self.kinds.append(kind)
        self.seconds.append(seconds)
        if arc is not None:
            self.arcs.extend(arc)
            self.planes.append(self.plane)


def _check_letters(codes: dict[str, float], words: dict[str, float], motion: float | None) -> None:
    """Refuse letters that no code of the line uses, and a P that two codes use.

    Raises:
        WordError: the line has such a letter.
    """
    is_arc, once, is_blending = motion in (2, 3), codes.get("once"), codes.get("control") == 64
    times = [is_arc, once in (4, 10), is_blending].count(True)
    if "P" in words and times > 1:
        raise WordError(f"P{words['P']:g}", "could belong to two codes of the line; write these codes on two lines")
    used = {**dict.fromkeys("IJKR", is_arc), "P": times == 1, "L": once == 10, "Q": is_blending}
    for letter, value in words.items():
        if not used.get(letter, True):
            raise WordError(f"{letter}{value:g}", "is not used by any code of the line")
