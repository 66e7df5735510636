"""Reading of files up to a size; each fault is one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...models.fileversions import VERSION_KEY, FileVersions
from ..errors import CaseError, InputError


def read_limited(source: str | Path, largest: int, *, is_regular: bool = False) -> bytes:
    """Return the bytes of a file.

    Args:
        source: name of the file, as written in messages.
        largest: largest number of bytes to read, also for devices without an end.
        is_regular: If true, pipes and devices are refused.

    Raises:
        InputError: the file cannot be read, is not a regular file if it must be, or is too large.
    """
    path = Path(source)
    try:
        if is_regular and path.exists() and not path.is_file():
            raise InputError(f"{source}: cannot be read: it is not a regular file")
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except (OSError, ValueError) as error:
        fault = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise InputError(f"{source}: cannot be read: {fault}") from None
    if len(content) > largest:
        raise InputError(f"{source}: cannot be read: it is larger than {largest // 2**20} MB")
    return content


def text_of_bytes(content: bytes) -> str:
    """Return UTF-8 text without a byte order mark, with Unix line ends.

    Raises:
        UnicodeDecodeError: the content is not UTF-8 text.
    """
    return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def check_version(kind: FileVersions, tables: Mapping[str, object], source: str | None = None) -> None:
    """Refuse a file of an unsupported version; the default is version 1.

    Args:
        kind: kind of the file.
        tables: content of the file.
        source: name of the file, for the message.

    Raises:
        CaseError: the version is not supported.
    """
    if fault := kind.fault(tables.get(VERSION_KEY, 1)):
        raise CaseError(VERSION_KEY, fault, tables[VERSION_KEY], source)
