"""The files that a case is read from: its own, and those that it names."""

from __future__ import annotations

import tomllib
from pathlib import Path

from ..errors import InputError
from .reader import case_text, find_case

#: Keys of a case that name CSV files.
_TABLES = ("poses", "tasks")


def input_files(name: str) -> list[Path]:
    """Return the file of a case, then the robot file and the CSV files that it names, which need not exist.

    A case that cannot be read names no other files; the fault is told where the case is read.

    Args:
        name: path of the file, or the bare name of a shipped case.

    Raises:
        InputError: there is no such file.
    """
    path = find_case(name)
    try:
        tables = tomllib.loads(case_text(name))
    except (InputError, ValueError, RecursionError):
        return [path]
    robot = tables.get("robot")
    named = [tables.get(key) for key in _TABLES] + [robot.get("file") if isinstance(robot, dict) else None]
    return [path, *(path.parent / each for each in named if isinstance(each, str) and each)]
