"""Journal: a file of JSON lines, appended as work is done, from which an interrupted run is resumed.

The first line is the head, each other line a row as JSON. The incomplete last line of a killed process is removed when
the journal is opened again. One process at a time holds a journal.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar, get_type_hints

from ..errors import InputError
from ..interruption import WRITING
from .locks import hold
from .strictjson import json_tree, value_of

if TYPE_CHECKING:
    from typing import Self

Kind = TypeVar("Kind", bound=NamedTuple)


@cache
def fields_of(kind: type[NamedTuple]) -> tuple[tuple[str, object], ...]:
    """Return the fields of a row with their types."""
    return tuple(get_type_hints(kind).items())


def line_of(row: NamedTuple) -> str:
    """Return a row as one line of JSON, with its line end.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(row, separators=(",", ":"), allow_nan=False) + "\n"


def row_of(kind: type[Kind], line: str | bytes) -> Kind:
    """Return the row of a line.

    Raises:
        ValueError: the line was not written by :func:`line_of`.
    """
    data, fields = json_tree(line), fields_of(kind)
    if not isinstance(data, list) or len(data) != len(fields):
        raise ValueError(f"expected a row of {len(fields)} values")
    return kind(*(value_of(of, value, name) for (name, of), value in zip(fields, data, strict=True)))


class JournalFile:
    """File of JSON lines, locked by this process.

    Args:
        path: name of the file, created if missing.
        head: first line of the file, which identifies the work.
        work: name of the work in messages.
        other: advice for a journal of other work.

    Raises:
        InputError: the file cannot be written, belongs to other work, or another process holds it.
    """

    def __init__(self, path: Path, head: Mapping[str, object], work: str, other: str) -> None:
        self.path = path
        self._head = (json.dumps(head) + "\n").encode()
        try:
            self._file = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b")
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
        try:
            if not hold(self._file.fileno()):
                raise InputError(f"{path}: another run of this {work} is writing it; wait for its end")
            self._end = self._read(f"{path}: belongs to another {work}; {other}")
        except BaseException:
            self._file.close()
            raise

    def load_entry(self, place: int, line: bytes) -> None:
        """Process an existing line of the file at a byte position."""
        raise NotImplementedError

    @property
    def is_empty(self) -> bool:
        """True if there are no lines below the head."""
        return self._end == len(self._head)

    def append(self, lines: Iterable[str]) -> list[int]:
        """Append lines, and return their byte positions.

        Raises:
            InputError: the file cannot be written, as on a full disk; its earlier content stays.
        """
        with WRITING:
            content = [line.encode() for line in lines]
            *places, end = accumulate(map(len, content), initial=self._end)
            try:
                self._file.seek(self._end)
                self._file.write(b"".join(content))
                self._file.flush()
            except OSError as error:
                raise InputError(f"{self.path}: cannot be written: {error.strerror or error}") from None
            self._end = end
        return places

    def lines_at(self, places: Iterable[int]) -> Iterator[bytes]:
        """Yield the lines at byte positions."""
        with self.path.open("rb") as file:
            after = -1
            for place in places:
                if place != after:
                    file.seek(place)
                line = file.readline()
                after = place + len(line)
                yield line

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file and release it for other processes; a file without lines is removed."""
        if not self._file.closed and self.is_empty:
            self.path.unlink(missing_ok=True)
        self._file.close()

    def remove(self) -> None:
        """Remove the file, when a result contains its rows."""
        self.path.unlink(missing_ok=True)
        self._file.close()

    def _read(self, refusal: str) -> int:
        """Read the lines, remove an incomplete last one, and return the end of the file.

        Raises:
            InputError: the journal belongs to other work, or the file is not a journal.
        """
        head = self._file.readline()
        if not head.endswith(b"\n") and self._head.startswith(head):
            self._file.seek(0)
            self._file.truncate()
            self._file.write(self._head)
            self._file.flush()
        elif head != self._head:
            raise InputError(refusal)
        place = len(self._head)
        for line in self._file:
            if not line.endswith(b"\n"):
                break
            self.load_entry(place, line)
            place += len(line)
        self._file.truncate(place)
        return place
