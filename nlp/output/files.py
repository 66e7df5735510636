"""Reading and writing of files: a file is written whole or not at all, and each fault is one sentence."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from ..errors import InputError


def write_text(target: str, text: str) -> None:
    """Write a text to a file, or to standard output for ``-``.

    Raises:
        InputError: the file cannot be written.
    """
    if target == "-":
        sys.stdout.write(text)
    else:
        write_bytes(target, text.encode("utf-8"))


def write_bytes(target: str, content: bytes) -> None:
    """Write bytes to a file; ``-`` is a file's name here.

    The file appears under its name only when it is complete; a pipe or device is written to, not replaced.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        path = Path(target)
        if path.exists() and not path.is_file():
            path.write_bytes(content)
        else:
            _replace(path.resolve(), content)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


def write_folder(target: str, files: Mapping[str, str]) -> None:
    """Write texts by file name into a folder, which is made when missing.

    All files are complete before the first appears under its name; other files in the folder stay.

    Raises:
        InputError: the folder cannot be made or written.
    """
    folder = Path(target)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".screwsynth.") as waiting:
            for name, text in files.items():
                (Path(waiting) / name).write_text(text, encoding="utf-8")
            for name in files:
                (Path(waiting) / name).replace(folder / name)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


def check_target(target: str) -> None:
    """Refuse a file that cannot be written, before the work begins.

    Raises:
        InputError: the folder is missing or closed, or the target is a folder.
    """
    if target == "-":
        return
    path = Path(target)
    try:
        fault = _fault(path)
    except OSError as error:
        fault = str(error.strerror)
    if fault:
        raise InputError(f"{target or 'an empty name'}: cannot be written: {fault}")


def read_text(source: str) -> str:
    """Read the text of a file.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        return Path(source).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{source}: is no text") from None
    except (OSError, ValueError) as error:
        fault = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise InputError(f"{source}: cannot be read: {fault}") from None


def _replace(path: Path, content: bytes) -> None:
    """Put a complete file in the place of an older one, or of none."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".screwsynth.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        # Only its owner may read a temporary file; the result gets the permissions of any new file.
        mask = os.umask(0)
        os.umask(mask)
        Path(temporary).chmod(0o666 & ~mask)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _cannot_be_written(target: str, error: OSError) -> InputError:
    return InputError(f"{target}: cannot be written: {error.strerror or error}")


def _fault(path: Path) -> str:
    """Return the reason why a file cannot be written; empty where it can."""
    if path.is_dir():
        return "it is a folder"
    if not path.parent.is_dir():
        return f"{path.parent} is no folder"
    return "" if os.access(path.parent, os.W_OK) else f"no permission in {path.parent}"
