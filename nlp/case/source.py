"""Files of cases: found by name, read as text and as tables, with the CSV and robot files that they name.

A case is named by its path; a shipped case also by its bare name; ``-`` is standard input, which is read once for all
readings of a command.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ... import cases
from ...models import model_names
from ..errors import InputError, nearest
from ..system.reading import read_limited, text_of_bytes
from .csvrows import named_csv_files

#: Largest case file, bytes. The largest that a person writes is a thousand times smaller; a device has no end.
_LARGEST_FILE = 4 * 2**20
_SHIPPED = Path(cases.__file__).parent
#: Standard input as a path, and its name in results and messages. A file with this name has a folder before it.
_STDIN, _STDIN_NAME = Path("-"), "stdin"
#: Standard input that was read, and its content.
_read: list[tuple[object, bytes]] = []


def shipped_cases() -> tuple[str, ...]:
    """Return the names of the cases that come with the package, in order."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def find_case(name: str) -> Path:
    """Return the file of a case.

    Args:
        name: path of the file, the bare name of a shipped case, or ``-`` for standard input.

    Raises:
        InputError: there is no such file.
    """
    if name == str(_STDIN):
        return _STDIN
    try:
        path = _file_of(name)
    except OSError as error:  # such as a name that is too long
        raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    if path is None and name in model_names():
        raise InputError(f"{name}: is a robot, not a case; screwsynth new {name} > my-{name}.toml writes a case of it")
    if path is None and name.endswith(".toml"):
        stem = Path(name).stem
        hint = f"; did you mean {stem!r}? this case comes with screwsynth" if stem in shipped_cases() else ""
        raise InputError(f"{name}: no such file{hint}")
    if path is None:
        beside = Path(f"{name}.toml")
        hint = f"did you mean {beside}?" if name and beside.is_file() else nearest(name, shipped_cases())
        raise InputError(
            f"{name or 'an empty name'}: no such file, and no case of this name comes with screwsynth; {hint}"
        )
    return path


def _file_of(name: str) -> Path | None:
    """Return the file with a path or a bare name, or None where there is none.

    Raises:
        InputError: the path is a folder's.
    """
    path = Path(name)
    if name and path.is_dir():
        raise InputError(f"{name}: is a folder, not a case file")
    if name and path.exists():
        return path.absolute() if path == _STDIN else path
    return _SHIPPED / f"{name}.toml" if name in shipped_cases() else None


def read_text(path: Path) -> str:
    """Return the text of a case's file; a byte order mark is left out, and line ends are those of Unix.

    Raises:
        InputError: the file cannot be read, is too large, or is no UTF-8 text.
    """
    name = source_name(path)
    content = _read_stdin() if path == _STDIN else read_limited(path, _LARGEST_FILE)
    try:
        return text_of_bytes(content)
    except UnicodeDecodeError:
        raise InputError(f"{name}: cannot be read: it is not UTF-8 text") from None


def source_name(path: Path) -> str:
    """Return the name of a case's file for messages."""
    return _STDIN_NAME if path == _STDIN else str(path)


def _read_stdin() -> bytes:
    """Return what standard input holds, which can be read once.

    Raises:
        InputError: it cannot be read, or is too large.
    """
    stream = sys.stdin
    if _read and _read[-1][0] is stream:
        return _read[-1][1]
    try:
        content = stream.buffer.read(_LARGEST_FILE + 1)
    except (AttributeError, OSError, ValueError):  # a closed stream, or none of bytes
        raise InputError(f"{_STDIN_NAME}: cannot be read") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{_STDIN_NAME}: cannot be read: it is larger than {_LARGEST_FILE // 2**20} MB")
    _read[:] = [(stream, content)]
    return content


def tables_of(path: Path, text: str) -> dict[str, Any]:
    """Return the tables of a case file's text.

    Raises:
        InputError: the text is not valid TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        from ..system.slips import toml_fault  # noqa: PLC0415 - only messages need it

        raise InputError(f"{source_name(path)}: {toml_fault(text, error)}") from None


def named_files(tables: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the CSV files and the robot file that a document names and whose content it holds; they need not exist.

    Args:
        tables: the document, as ``tomllib`` returns it.
        folder: folder of the document, beside which the files are.
    """
    robot = tables.get("robot")
    file = robot.get("file") if isinstance(robot, dict) else None
    of_robot = (folder / file,) if isinstance(file, str) and file else ()
    return (*named_csv_files(tables, folder), *of_robot)


def _path_files(tables: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the file of the programmed path that a document names; the arguments are those of :func:`named_files`."""
    path = tables.get("path")
    file = path.get("file") if isinstance(path, dict) else None
    return (folder / file,) if isinstance(file, str) and file else ()


def inputs_of(path: Path, tables: Mapping[str, Any]) -> Mapping[Path, str]:
    """Return the files that a case is read from, as :func:`case_inputs`, from its file and that file's tables."""
    names = (*named_files(tables, path.parent), *_path_files(tables, path.parent))
    return {**dict.fromkeys(names, "a file that the case names"), path: "the case file"}


def case_inputs(name: str) -> Mapping[Path, str]:
    """Return the files that a case is read from, and the words for each in messages: its own, and those that it names.

    A pipe or device can be read once only, and is left to who reads the case: the files that it names are not known.

    Args:
        name: as for :func:`find_case`.

    Raises:
        InputError: the file cannot be read, or is not valid TOML.
    """
    path = find_case(name)
    return inputs_of(path, tables_of(path, read_text(path)) if path == _STDIN or path.is_file() else {})
