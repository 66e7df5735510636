"""Journal of a sweep: a file to which rows are appended as they finish, and from which a killed run is resumed.

A row is the answer at one point. The first line is the head, each other line a row as JSON. An incomplete last line of
a killed process is removed when the journal is opened again. One process at a time holds a journal.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, get_type_hints

import numpy as np

from ..errors import InputError
from ..evidence.optimality import Evidence
from ..interruption import WRITING
from ..system.jsonvalues import finite_or_none
from ..system.locks import hold
from ..system.strictjson import json_tree, value_of
from ..units import Units

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Status of a point at which the case contradicts itself; the other statuses are those of a solve.
REFUSED = "refused"


class Row(NamedTuple):
    """The answer at one point.

    Attributes:
        point: index of the point.
        status: that of the solve, or ``refused`` where the case is none at this point.
        F: objective; for several tasks the value of their combination. None where there is no answer.
        x: the free numbers of the design in the case's units; empty for a point that is refused.
        active: sides of bounds and limits on which the point lies, such as ``p_z max``.
        multipliers: of the active sides, in F per unit of the limit.
        verdict: on the point, in words.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest distance outside a side, in half ranges.
        curvature: smallest eigenvalue of the reduced Hessian; None where no direction is left, or it is not computed.
        starts: number of searches.
        converged: number of searches that ended at an optimum.
        engine: ``compiled`` or ``ipopt``: whose point it is.
        seconds: wall time; of points solved together, an equal share.
        note: a sentence where the point is refused, or where its certificate is, and about limits over a workspace that
            are taken at the stated pose alone, or are not proved; empty otherwise.
        certificate: status of the proof; empty where none was asked for, or it is refused.
        bound: no feasible design has a better F; None where nothing is proved.
        gap: distance of the bound from F; None likewise.
    """

    point: int
    status: str
    F: float | None
    x: tuple[float, ...] = ()
    active: tuple[str, ...] = ()
    multipliers: tuple[float, ...] = ()
    verdict: str = ""
    stationarity: float | None = None
    feasibility: float | None = None
    curvature: float | None = None
    starts: int = 0
    converged: int = 0
    engine: str = ""
    seconds: float = 0.0
    note: str = ""
    certificate: str = ""
    bound: float | None = None
    gap: float | None = None


def with_evidence(row: Row, evidence: Evidence, units: Units) -> Row:
    """Return a row with the evidence at its point, in the units of the case."""
    return row._replace(
        active=tuple(f"{side.name} {side.bound}" for side in evidence.active),
        multipliers=evidence.multipliers_in(units),
        verdict=evidence.kind.value,
        stationarity=finite_or_none(evidence.stationarity),
        feasibility=finite_or_none(evidence.feasibility),
        curvature=finite_or_none(evidence.eigenvalues[0]) if len(evidence.eigenvalues) else None,
    )


def line_of(row: Row) -> str:
    """Return a row as one line of JSON, with its line end."""
    return json.dumps(row, separators=(",", ":"), allow_nan=False) + "\n"


def row_of(line: str | bytes) -> Row:
    """Return the row of a line.

    Raises:
        ValueError: the line is none of :func:`line_of`.
    """
    data = json_tree(line)
    if not isinstance(data, list) or len(data) != len(Row._fields):
        raise ValueError("the line is no row")
    return Row(*(value_of(kind, value, name) for (name, kind), value in zip(row_kinds(), data, strict=True)))


@cache
def row_kinds() -> tuple[tuple[str, object], ...]:
    """Return the fields of a row with their types."""
    return tuple(get_type_hints(Row).items())


#: Ending of a journal's name behind that of the table.
ENDING = ".journal"


class Journal:
    """Rows of a sweep that are solved, in a file.

    Args:
        path: of the file, which is made when missing.
        fingerprint: of the sweep.
        count: number of its points.

    Raises:
        InputError: the file cannot be written, belongs to another sweep, or is held by another process.
    """

    def __init__(self, path: Path, fingerprint: str, count: int) -> None:
        self.path = path
        self._head = (json.dumps({"screwsynth": "sweep", "fingerprint": fingerprint, "points": count}) + "\n").encode()
        self._places: NDArray[np.int64] = np.full(count, -1, dtype=np.int64)
        try:
            self._file = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b")
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
        try:
            self._hold()
            self._end = self._read()
        except BaseException:
            self._file.close()
            raise

    @property
    def words(self) -> str:
        """How many points it has, and what goes on from there."""
        count = len(self._places)
        done = f"{count - len(self.missing):,} of {count:,} points are in {self.path}"
        return f"{done}: the same command goes on from there"

    @property
    def missing(self) -> NDArray[np.intp]:
        """Indices of the points without a row, ascending."""
        return np.flatnonzero(self._places < 0)

    def append(self, rows: Iterable[Row]) -> None:
        """Append rows; those of points that have one already are left out.

        Raises:
            InputError: the file cannot be written, as on a full disk; what is in it already stays.
        """
        lines: list[bytes] = []
        with WRITING:
            end = self._end
            for row in rows:
                if self._places[row.point] >= 0:
                    continue
                self._places[row.point] = end
                lines.append(line_of(row).encode())
                end += len(lines[-1])
            try:
                self._file.seek(self._end)
                self._file.write(b"".join(lines))
                self._file.flush()
            except OSError as error:
                raise InputError(f"{self.path}: cannot be written: {error.strerror or error}") from None
            self._end = end

    def rows(self) -> Iterator[Row]:
        """Yield the rows in the order of their points."""
        with self.path.open("rb") as file:
            after = -1
            for place in self._places[self._places >= 0].tolist():
                if place != after:
                    file.seek(place)
                line = file.readline()
                after = place + len(line)
                yield row_of(line)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, which another process may hold from then on; without rows it is removed."""
        if not self._file.closed and (self._places < 0).all():
            self.path.unlink(missing_ok=True)
        self._file.close()

    def remove(self) -> None:
        """Remove the file, once its rows are in the table."""
        self.path.unlink(missing_ok=True)
        self._file.close()

    def _hold(self) -> None:
        """Hold the file for this process alone.

        Raises:
            InputError: another process holds it.
        """
        if not hold(self._file.fileno()):
            raise InputError(f"{self.path}: another run of this sweep is writing it; wait for its end")

    def _read(self) -> int:
        """Read the places of the rows, cut off an incomplete last line, and return the file's end.

        Raises:
            InputError: the journal is of another sweep, or no journal.
        """
        head = self._file.readline()
        if not head.endswith(b"\n") and self._head.startswith(head):
            self._file.seek(0)
            self._file.truncate()
            self._file.write(self._head)
            self._file.flush()
        elif head != self._head:
            raise InputError(f"{self.path}: belongs to another sweep; choose another --out, or remove it")
        place = len(self._head)
        for line in self._file:
            if not line.endswith(b"\n"):
                break
            try:
                index = row_of(line).point
            except ValueError:
                index = -1
            if 0 <= index < len(self._places) and self._places[index] < 0:
                self._places[index] = place
            place += len(line)
        self._file.truncate(place)
        return place
