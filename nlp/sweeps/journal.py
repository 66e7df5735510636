"""Journal of a sweep, to which the answer at each point is appended as it is found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..evidence.optimality import Evidence
from ..system.journal import JournalFile, line_of, row_of
from ..system.jsonvalues import finite_or_none
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


#: Ending of a journal's name behind that of the table.
ENDING = ".journal"


class Journal(JournalFile):
    """Rows of a sweep that are solved, in a file.

    Args:
        path: of the file, which is made when missing.
        fingerprint: of the sweep.
        count: number of its points.

    Raises:
        InputError: the file cannot be written, belongs to another sweep, or is held by another process.
    """

    def __init__(self, path: Path, fingerprint: str, count: int) -> None:
        self._places: NDArray[np.int64] = np.full(count, -1, dtype=np.int64)
        head = {"screwsynth": "sweep", "fingerprint": fingerprint, "points": count}
        super().__init__(path, head, "sweep", "choose another --out, or remove it")

    def found(self, place: int, line: bytes) -> None:
        """Take note of a row that is in the file, at a place."""
        with suppress(ValueError):
            index = row_of(Row, line).point
            if 0 <= index < len(self._places) and self._places[index] < 0:
                self._places[index] = place

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

    def add(self, rows: Iterable[Row]) -> None:
        """Append rows; those of points that have one already are left out.

        Raises:
            InputError: the file cannot be written.
        """
        new = {row.point: line_of(row) for row in rows if self._places[row.point] < 0}
        self._places[list(new)] = self.append(new.values())

    def rows(self) -> Iterator[Row]:
        """Yield the rows in the order of their points."""
        for line in self.lines_at(self._places[self._places >= 0].tolist()):
            yield row_of(Row, line)
