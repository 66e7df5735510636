"""Case files by name: their paths, their text, their tables, and the files that they refer to.

The name of a case is its path, or the bare name of a shipped case. ``-`` is standard input, which is read once per
command and kept.
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

#: Largest case file, bytes: a thousand times the largest that a person writes. A device file may be endless.
_LARGEST_FILE = 4 * 2**20
_SHIPPED = Path(cases.__file__).parent
#: Standard input as a path, and its name in results and messages. A file called "-" is given as "./-".
_STDIN, _STDIN_NAME = Path("-"), "stdin"
#: Stream of the last reading of standard input, and its content.
_read: list[tuple[object, bytes]] = []


def shipped_cases() -> tuple[str, ...]:
    """Return the names of the shipped cases, sorted."""
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
        raise InputError(f"{name}: is a robot, not a case; screwsynth new {name} > my-{name}.toml writes a case for it")
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
    """Return the file of a path or of a shipped case; None if it does not exist.

    Raises:
        InputError: the path is a folder.
    """
    path = Path(name)
    if name and path.is_dir():
        raise InputError(f"{name}: is a folder, not a case file; give the path of a .toml file")
    if name and path.exists():
        return path.absolute() if path == _STDIN else path
    return _SHIPPED / f"{name}.toml" if name in shipped_cases() else None


def read_text(path: Path) -> str:
    """Return the text of a case file, without a byte order mark and with Unix line ends.

    Raises:
        InputError: the file cannot be read, is too large, or is not UTF-8 text.
    """
    name = source_name(path)
    content = _read_stdin() if path == _STDIN else read_limited(path, _LARGEST_FILE)
    try:
        return text_of_bytes(content)
    except UnicodeDecodeError:
        raise InputError(f"{name}: cannot be read: it is not UTF-8 text") from None


def source_name(path: Path) -> str:
    """Return the name of a case file for messages."""
    return _STDIN_NAME if path == _STDIN else str(path)


def _read_stdin() -> bytes:
    """Return the content of standard input; later calls return the same content.

    Raises:
        InputError: standard input cannot be read, or is too large.
    """
    stream = sys.stdin
    if _read and _read[-1][0] is stream:
        return _read[-1][1]
    try:
        content = stream.buffer.read(_LARGEST_FILE + 1)
    except (AttributeError, OSError, ValueError):  # a closed stream, or a stream without bytes
        raise InputError(f"{_STDIN_NAME}: cannot be read: standard input is closed; give a case file") from None
    if len(content) > _LARGEST_FILE:
        raise InputError(f"{_STDIN_NAME}: cannot be read: it is larger than {_LARGEST_FILE // 2**20} MB")
    _read[:] = [(stream, content)]
    return content


def tables_of(path: Path, text: str) -> dict[str, Any]:
    """Return the tables of a case file.

    Args:
        path: path of the file, for messages.
        text: text of the file.

    Raises:
        InputError: the text is not valid TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        from ..system.slips import toml_fault  # noqa: PLC0415 - only messages need it

        raise InputError(f"{source_name(path)}: {toml_fault(text, error)}") from None


def named_files(tables: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the CSV files and the robot file to which a case file refers; they need not exist.

    Args:
        tables: the case file, as ``tomllib`` returns it.
        folder: folder of the case file, from which the file names begin.
    """
    robot = tables.get("robot")
    file = robot.get("file") if isinstance(robot, dict) else None
    of_robot = (folder / file,) if isinstance(file, str) and file else ()
    return (*named_csv_files(tables, folder), *of_robot)


def _path_files(tables: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the tool-path file to which a case file refers; the arguments are those of :func:`named_files`."""
    path = tables.get("path")
    file = path.get("file") if isinstance(path, dict) else None
    return (folder / file,) if isinstance(file, str) and file else ()


def inputs_of(path: Path, tables: Mapping[str, Any]) -> Mapping[Path, str]:
    """Return the input files of a case as :func:`case_inputs` does, from its path and its tables."""
    names = (*named_files(tables, path.parent), *_path_files(tables, path.parent))
    return {**dict.fromkeys(names, "a file that the case names"), path: "the case file"}


def case_inputs(name: str) -> Mapping[Path, str]:
    """Return the input files of a case, each with its description for messages.

    These are the case file and the files to which it refers. A pipe or device can be read only once, by the reader of
    the case; only the pipe itself is then returned.

    Args:
        name: path of the case file, the bare name of a shipped case, or ``-`` for standard input.

    Raises:
        InputError: the file cannot be read, or is not valid TOML.
    """
    path = find_case(name)
    return inputs_of(path, tables_of(path, read_text(path)) if path == _STDIN or path.is_file() else {})
