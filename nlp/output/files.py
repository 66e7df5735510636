"""Reading and writing of files.

A file is written completely or not at all, and an error is one sentence. Files of other programs are not overwritten.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path

from ..errors import InputError
from ..interruption import WRITING, unfinished, wrote
from ..system.locks import held_folder
from ..system.reading import read_limited, text_of_bytes

#: Name of the manifest, which lists the written files of a folder; without it, a folder with files is refused.
MANIFEST = "screwsynth-files.txt"
#: Bits of the write permissions of owner, group and others.
_WRITABLE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
#: Largest file that is read, bytes: larger than any proof record that fits into memory; a device has no end.
LARGEST_FILE = 256 * 2**20
#: Prefix of the names of incomplete files and folders.
_WAITING = ".screwsynth."
_MANIFEST_HEAD = "# Written by screwsynth, which may replace these files:"


def write_text(target: str, text: str) -> None:
    """Write a text to a file, or to standard output for ``-``.

    Raises:
        InputError: the file cannot be written.
    """
    if target == "-":
        with WRITING:
            sys.stdout.write(text)
            sys.stdout.flush()
    else:
        write_bytes(target, text.encode("utf-8"))


def write_bytes(target: str, content: bytes) -> None:
    """Write bytes to a file; the name ``-`` is not standard output here.

    The file gets its name when it is complete; a pipe or device is written to, not replaced.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        path = Path(target)
        if path.exists() and not path.is_file():
            path.write_bytes(content)
        else:
            _replace(path.resolve(), content)
        wrote(target)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


@contextmanager
def write_whole(target: str) -> Iterator[Path]:
    """Yield the path of a temporary file, which is renamed to the target if the block ends without an error.

    The temporary name is the same at each run, so the next run replaces the file of a killed run.

    Raises:
        InputError: the file cannot be written.
    """
    path = Path(target).resolve()
    waiting = path.with_name(f"{_WAITING}{path.name}")
    try:
        waiting.unlink(missing_ok=True)
        with unfinished(waiting):
            try:
                yield waiting
                waiting.replace(path)
            except BaseException:
                waiting.unlink(missing_ok=True)
                raise
        wrote(target)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


def write_folder(target: str, files: Mapping[str, str], *, force: bool = False) -> None:
    """Write texts into the files of a folder; a missing folder is created.

    All files are written completely before the first one gets its final name; other files in the folder stay. A
    manifest in the folder has the names of the written files. Two runs at the same time write one after the other.

    Args:
        target: path of the folder.
        files: texts by file name, which may begin with the name of a subfolder.
        force: If true, also overwrite files that screwsynth did not write.

    Raises:
        InputError: the folder cannot be made or written, or a file of another origin would be replaced.
    """
    if not force:
        check_folder(target, files)
    folder = Path(target)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with held_folder(folder):
            if not force:
                _refuse_foreign(folder, target, files)
            listed = sorted({*files, *(name for name in _written_before(folder) or () if (folder / name).exists())})
            every = {**files, MANIFEST: "\n".join([_MANIFEST_HEAD, *listed]) + "\n"}
            with WRITING, tempfile.TemporaryDirectory(dir=folder, prefix=_WAITING) as waiting:
                for name, text in every.items():
                    (Path(waiting) / name).parent.mkdir(parents=True, exist_ok=True)
                    (Path(waiting) / name).write_text(text, encoding="utf-8")
                for name in every:
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (Path(waiting) / name).replace(folder / name)
        wrote(target)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


def check_folder(target: str, files: Iterable[str] = ()) -> None:
    """Refuse a folder with files of another origin before the work begins.

    Args:
        target: path of the folder, which may be missing or empty.
        files: names of the files to write, if known.

    Raises:
        InputError: the folder has no manifest, its manifest lacks a file to write, or the target is not a folder.
    """
    folder = Path(target)
    try:
        if not folder.exists():
            return
        if not folder.is_dir():
            raise InputError(f"{target}: cannot be written: it is a file, not a folder")
        with held_folder(folder):
            _refuse_foreign(folder, target, files)
    except OSError as error:
        raise _cannot_be_written(target, error) from None


def _refuse_foreign(folder: Path, target: str, files: Iterable[str]) -> None:
    """Refuse a folder with files of another origin; arguments and errors as for :func:`check_folder`."""
    written = _written_before(folder)
    # Incomplete files of a killed run may be replaced.
    if written is None:
        foreign = sorted(each.name for each in folder.iterdir() if not each.name.startswith(_WAITING))
    else:
        foreign = sorted(name for name in set(files) - set(written) if (folder / name).exists())
    if foreign:
        raise InputError(
            f"{target}: contains {foreign[0]}, not written by screwsynth: choose an empty or a new folder, or --force"
        )


def check_outputs(inputs: Mapping[Path, str], outputs: Mapping[str, str | None]) -> None:
    """Refuse, before the work begins, outputs that are not writable, overwrite an input, or share a file.

    Links are resolved first. Pipes and devices take any number of outputs.

    Args:
        inputs: input files with their description for messages.
        outputs: output files by option; None and ``-`` are ignored.

    Raises:
        InputError: an output cannot be written, is an input, or is the file of another output too.
    """
    chosen = {option: Path(target) for option, target in outputs.items() if target not in (None, "-") and target}
    for target in outputs.values():
        if target is not None:
            check_target(target)
    for option, path in chosen.items():
        for read, words in inputs.items():
            if _is_same_file(path, read):
                raise InputError(f"{option} {path}: is {words}, which would be lost; choose another name")
    for (option, path), (other, second) in combinations(chosen.items(), 2):
        if _is_same_file(path, second):
            raise InputError(f"{option} {path}: is also the file of {other}; choose another name")


def check_origin(target: str, beginning: str, *, force: bool = False) -> None:
    """Refuse to overwrite a file of another origin, before the work begins.

    Args:
        target: path of the output file; it may be missing, empty, a pipe or a device.
        beginning: first characters of every such file that screwsynth writes.
        force: If true, also overwrite a file of another origin.

    Raises:
        InputError: the file has another beginning.
    """
    path = Path(target)
    if force or target == "-" or not path.is_file():
        return
    try:
        with path.open("rb") as file:
            found = file.read(len(beginning.encode("utf-8")))
    except OSError as error:
        raise _cannot_be_written(target, error) from None
    if found and found != beginning.encode("utf-8"):
        raise InputError(f"{target}: exists, and screwsynth did not write it: choose another name, or --force")


def check_target(target: str) -> None:
    """Refuse an output file that cannot be written, before the work begins.

    Raises:
        InputError: the folder is missing or has no write permission, or the target is a folder.
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
        InputError: the file cannot be read, is too large, or is not UTF-8 text.
    """
    content = read_limited(source, LARGEST_FILE)
    try:
        return text_of_bytes(content)
    except UnicodeDecodeError:
        raise InputError(f"{source}: is not a UTF-8 text file") from None


def _replace(path: Path, content: bytes) -> None:
    """Write a complete file, which replaces an older one."""
    with WRITING:
        _write_and_rename(path, content)


def _write_and_rename(path: Path, content: bytes) -> None:
    """Write a temporary file and rename it to the target."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=_WAITING)
    with unfinished(Path(temporary)):
        _fill_and_rename(handle, temporary, path, content)


def _fill_and_rename(handle: int, temporary: str, path: Path, content: bytes) -> None:
    """Fill a temporary file and rename it to the target."""
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        # Only its owner may read a temporary file; the renamed file gets the permissions of any new file.
        mask = os.umask(0)
        os.umask(mask)
        Path(temporary).chmod(0o666 & ~mask)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _cannot_be_written(target: str, error: OSError) -> InputError:
    return InputError(f"{target}: cannot be written: {error.strerror or error}")


def _written_before(folder: Path) -> list[str] | None:
    """Return the file names in the manifest of a folder; None without a manifest."""
    try:
        head, *names = (folder / MANIFEST).read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, ValueError):  # not a manifest, or an empty one
        return None
    return names if head == _MANIFEST_HEAD else None


def _is_same_file(one: Path, other: Path) -> bool:
    """Return whether two paths are the same file, existing or new; false for pipes and devices."""
    try:
        first, second = one.resolve(), other.resolve()
        if first.exists() and second.exists():
            return first.is_file() and first.samefile(second)
    except (OSError, RuntimeError, ValueError):  # such as a loop of links, or an invalid name
        return False
    return first == second


def _fault(path: Path) -> str:
    """Return the reason why a file cannot be written; empty if it can."""
    if path.is_dir():
        return "it is a folder"
    if not path.parent.is_dir():
        return f"{path.parent} is not a folder"
    # The user root may write any file, but a file without write permission is protected on purpose.
    if path.is_file() and not (os.access(path, os.W_OK) and path.stat().st_mode & _WRITABLE):
        return "it is read-only"
    folder = path.resolve().parent
    return "" if os.access(folder, os.W_OK) else f"no permission in {folder}"
