"""Files of paths: G-code, and tables of poses, whose names end in ``.csv``."""

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

#: Size of the largest file, bytes: some ten million lines.
_LARGEST = 2**28
#: Smallest distance of a shortest turn from half a turn, radians: nearer, rounding would choose its sense.
_HALF_TURN = 1e-9


def read_path(file: str | Path, units: Units, options: PathOptions | None = None) -> ProgrammedPath:
    """Return the path in a file.

    Args:
        file: name of the file.
        units: of the case.
        options: choices that the file leaves open.

    Raises:
        InputError: the file cannot be read, or holds anything that is not read.
    """
    return path_of_text(text_of_path(file), str(file), units, options)


def text_of_path(file: str | Path) -> str:
    """Return the text of a path's file, with the line ends of Unix.

    Raises:
        InputError: the file cannot be read.
    """
    content = read_limited(file, _LARGEST)
    if is_table(str(file)):
        try:
            return text_of_bytes(content)
        except UnicodeDecodeError:
            raise InputError(f"{file}: cannot be read: it is not UTF-8 text") from None
    # Comments may be in any encoding; a word of a program is ASCII.
    text = content.removeprefix(b"\xef\xbb\xbf").decode("ascii", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_table(file: str) -> bool:
    """Return whether a file of a path is a table of poses, by its name; else it is a program."""
    return file.lower().endswith(".csv")


def path_of_text(text: str, source: str, units: Units, options: PathOptions | None = None) -> ProgrammedPath:
    """Return the path in the text of a file.

    Args:
        text: the text, with the line ends of Unix.
        source: name of the file, which tells tables from programs.
        units: of the case.
        options: choices that the file leaves open.

    Raises:
        InputError: the text holds anything that is not read.
    """
    options = options or PathOptions()
    if is_table(source):
        path = read_poses(text, source, units, options)
    else:
        path = read_program(text.split("\n"), source, units, options)
    if path.between is Between.SLERP:
        _check_turns(path)
    return path


def path_of_case(case: Case, options: PathOptions | None = None) -> ProgrammedPath:
    """Return the path that a case states, in its place.

    Args:
        case: the case.
        options: in the place of those that the case states.

    Raises:
        CaseError: it states none, or a number of its place is free.
        InputError: its file cannot be read, or holds anything that is not read.
    """
    return in_place_of_case(stated_path(case, options), case)


def in_place_of_case(path: ProgrammedPath, case: Case) -> ProgrammedPath:
    """Return the path of a case's file in the place that the case states.

    Raises:
        CaseError: a number of its place is free.
    """
    stated = case.path
    numbers = () if stated is None else stated.place
    fixed = [value for value in numbers if not isinstance(value, Free)]
    if stated is not None and stated.free:
        fault = "is free, and a path is judged in one place: give it with --set, or a result with --of"
        raise CaseError(f"path.place.{stated.free[0]}", fault, source=case.source)
    return placed(path, fixed)


def stated_path(case: Case, options: PathOptions | None = None) -> ProgrammedPath:
    """Return the path that a case states, in its own frame; arguments and errors are those of :func:`path_of_case`."""
    stated = case.path
    if stated is None:
        raise CaseError("path", "is missing: give the table [path], or the file of a path", source=case.source)
    # What is wrong is told with the file's whole name, and results have the stated one.
    path = read_path(stated.name, case.units, options or options_of(stated))
    return replace(path, source=stated.file)


def options_of(stated: PathFile) -> PathOptions:
    """Return the options of reading a path that a case states."""
    between = None if stated.between is None else Between(stated.between)
    return PathOptions(between, stated.angles, stated.unit, stated.start, stated.offsets)


def _check_turns(path: ProgrammedPath) -> None:
    """Refuse a segment between orientations that two shortest turns join.

    Raises:
        InputError: there is one.
    """
    quaternions = quaternions_from_angles(path.knots[:, 3:], path.order)
    _, angles = shortest_turns(quaternions[:-1], quaternions[1:])
    if (angles > np.pi - _HALF_TURN).any():
        line = path.lines[int(np.argmax(angles))]
        raise InputError(
            f"{path.source}: line {line}: turns by half a turn, which may go either way; add a point between"
        )
