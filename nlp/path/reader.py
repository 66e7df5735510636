"""Reading of tool-path files: G-code, and tables of poses with names that end in ``.csv``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..case.case import Case
from ..case.pathfile import PathFile
from ..case.pose import Free
from ..errors import CaseError, InputError
from ..system.reading import read_limited, text_of_bytes
from ..units import Units
from .gcode import read_program
from .options import Between, PathOptions
from .orientation import quaternions_from_angles, shortest_turns
from .path import ProgrammedPath
from .placing import placed
from .poses_csv import read_poses
from .printer import read_printer_program
from .printerwords import sign_of_printer
from .settings import UNCHANGED, Changing, ToolTurn, changing_of

#: Largest size of a file, bytes: some ten million lines.
_LARGEST = 2**28
#: Smallest difference of a shortest rotation from half a turn, radians: below it, rounding would choose the direction.
_HALF_TURN = 1e-9


def read_path(
    file: str | Path, units: Units, options: PathOptions | None = None, changing: Changing = UNCHANGED
) -> ProgrammedPath:
    """Return the tool path of a file.

    Args:
        file: name of the file.
        units: units of the case.
        options: choices that the file leaves open.
        changing: quantities of the case that change along the path.

    Raises:
        InputError: the file cannot be read, or contains an unsupported word.
    """
    return path_of_text(text_of_path(file), str(file), units, options, changing)


def text_of_path(file: str | Path) -> str:
    """Return the text of a path's file, with Unix line ends.

    Raises:
        InputError: the file cannot be read.
    """
    content = read_limited(file, _LARGEST)
    if is_table(str(file)):
        try:
            return text_of_bytes(content)
        except UnicodeDecodeError:
            raise InputError(f"{file}: cannot be read: it is not UTF-8 text") from None
    # Comments may have any encoding; words of G-code are ASCII.
    text = content.removeprefix(b"\xef\xbb\xbf").decode("ascii", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_table(file: str) -> bool:
    """Return True if the name of a file is that of a table of poses, False for G-code."""
    return file.lower().endswith(".csv")


def path_of_text(
    text: str, source: str, units: Units, options: PathOptions | None = None, changing: Changing = UNCHANGED
) -> ProgrammedPath:
    """Return the tool path of a file's text.

    Args:
        text: text with Unix line ends.
        source: name of the file, which distinguishes tables from G-code.
        units: units of the case.
        options: choices that the file leaves open.
        changing: quantities of the case that change along the path.

    Raises:
        InputError: the text contains an unsupported word.
    """
    options = options or PathOptions()
    if is_table(source):
        path = read_poses(text, source, units, options, changing)
    else:
        changing.refuse_without_table(source)
        path = _path_of_program(text.split("\n"), source, units, options)
        if changing.axis is not None:
            path = replace(path, tool=ToolTurn(changing.axis, np.full(len(path.knots), changing.turn)))
    if path.between is Between.SLERP:
        _check_turns(path)
    return path


def _path_of_program(lines: list[str], source: str, units: Units, options: PathOptions) -> ProgrammedPath:
    """Return the tool path of a program in its flavour; an error says if the program is for a printer.

    Raises:
        InputError: the program cannot be read.
    """
    if options.flavour == "printer":
        return read_printer_program(lines, source, units, options)
    try:
        return read_program(lines, source, units, options)
    except InputError as error:
        sign = sign_of_printer(lines)
        if sign is None:
            raise
        advice = "give --flavour printer, or flavour = 'printer' in [path]"
        raise InputError(f"{error}; this looks like a printer's file ({sign}): {advice}") from None


def path_of_case(case: Case, options: PathOptions | None = None) -> ProgrammedPath:
    """Return the tool path of a case, in the placement that the case states.

    Args:
        case: the case.
        options: options that replace those of the case.

    Raises:
        CaseError: the case has no path, or a parameter of its placement is free.
        InputError: the path's file cannot be read, or contains an unsupported word.
    """
    return in_place_of_case(stated_path(case, options), case)


def in_place_of_case(path: ProgrammedPath, case: Case) -> ProgrammedPath:
    """Return the path of a case's file in the placement that the case states.

    Raises:
        CaseError: a parameter of the placement is free.
    """
    stated = case.path
    numbers = () if stated is None else stated.place
    fixed = [value for value in numbers if not isinstance(value, Free)]
    if stated is not None and stated.free:
        fault = "is free, but a path needs one placement: set a value with --set, or give a result with --of"
        raise CaseError(f"path.place.{stated.free[0]}", fault, source=case.source)
    return placed(path, fixed)


def path_without_settings(case: Case) -> ProgrammedPath:
    """Return the tool path of a case before its settings are known; errors are those of :func:`path_of_case`."""
    return in_place_of_case(stated_path(case, changing=changing_of(case).unread), case)


def stated_path(case: Case, options: PathOptions | None = None, changing: Changing | None = None) -> ProgrammedPath:
    """Return the tool path of a case, in its frame.

    Args:
        case: the case.
        options: options that replace those of the case.
        changing: quantities that change along the path; those of the case if left out.

    Raises:
        CaseError, InputError: as :func:`path_of_case`.
    """
    stated = case.path
    if stated is None:
        raise CaseError("path", "is missing: give the table [path], or the file of a path", source=case.source)
    # Messages name the file with its whole path; results use the stated name.
    path = read_path(stated.name, case.units, options or options_of(stated), changing or changing_of(case))
    return replace(path, source=stated.file)


def options_of(stated: PathFile) -> PathOptions:
    """Return the options for reading the path of a case.

    Raises:
        CaseError: an option has no meaning in the flavour of the program.
    """
    try:
        return PathOptions.stated_in(stated)
    except InputError as error:
        raise CaseError("path", str(error)) from None


def _check_turns(path: ProgrammedPath) -> None:
    """Refuse a segment with two shortest rotations between its orientations.

    Raises:
        InputError: the path has such a segment.
    """
    quaternions = quaternions_from_angles(path.knots[:, 3:], path.order)
    _, angles = shortest_turns(quaternions[:-1], quaternions[1:])
    if (angles > np.pi - _HALF_TURN).any():
        line = path.lines[int(np.argmax(angles))]
        raise InputError(
            f"{path.source}: line {line}: rotates by half a turn, so its direction is ambiguous; add a point between"
        )
