"""Journal of a sweep: a file to which the result of each solved point is appended."""

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

#: Status of a point at which the case contradicts itself; other statuses are those of a solve.
REFUSED = "refused"


class Row(NamedTuple):
    """Result at one point of a sweep.

    Attributes:
        point: index of the point.
        status: status of the solve, or ``refused`` if the case contradicts itself at the point.
        F: objective; for several tasks the value of their combination. None without an optimum.
        x: design variables in the case's units; empty for a refused point.
        active: active sides of bounds and limits, such as ``p_z max``.
        multipliers: multipliers of the active sides, in F per unit of the limit.
        verdict: kind of the point, such as a strict local maximum.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest violation of a bound or limit, in half ranges.
        curvature: smallest eigenvalue of the reduced Hessian; None without a free direction, or if it is not computed.
        starts: number of searches.
        converged: number of searches that converged to an optimum.
        engine: engine that found the point, ``compiled`` or ``ipopt``.
        seconds: wall time; for points of a block, an equal share.
        note: reason of a refused point or certificate, or note that limits over a workspace are only checked at the
            stated pose, or not proved; empty otherwise.
        certificate: status of the certificate; empty without a certificate.
        bound: proved bound of F, which no feasible design exceeds; None without a certificate.
        gap: absolute difference of F and the bound; None without a certificate.
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


#: Suffix of a journal's name after the name of the table.
ENDING = ".journal"


class Journal(JournalFile):
    """File with the solved rows of a sweep.

    Args:
        path: path of the file; a missing file is created.
        fingerprint: fingerprint of the sweep.
        count: number of points of the sweep.

    Raises:
        InputError: the file cannot be written, belongs to another sweep, or is locked by another process.
    """

    def __init__(self, path: Path, fingerprint: str, count: int) -> None:
        self._places: NDArray[np.int64] = np.full(count, -1, dtype=np.int64)
        head = {"screwsynth": "sweep", "fingerprint": fingerprint, "points": count}
        super().__init__(path, head, "sweep", "choose another --out, or remove it")

    def load_entry(self, place: int, line: bytes) -> None:
        """Register a row of the file at its position."""
        with suppress(ValueError):
            index = row_of(Row, line).point
            if 0 <= index < len(self._places) and self._places[index] < 0:
                self._places[index] = place

    @property
    def words(self) -> str:
        """Number of solved points, and how to continue."""
        count = len(self._places)
        done = f"{count - len(self.missing):,} of {count:,} points are in {self.path}"
        return f"{done}: the same command continues from there"

    @property
    def missing(self) -> NDArray[np.intp]:
        """Indices of the points without a row, ascending."""
        return np.flatnonzero(self._places < 0)

    def add(self, rows: Iterable[Row]) -> None:
        """Append rows; rows of points that already have one are ignored.

        Raises:
            InputError: the file cannot be written.
        """
        new = {row.point: line_of(row) for row in rows if self._places[row.point] < 0}
        self._places[list(new)] = self.append(new.values())

    def rows(self) -> Iterator[Row]:
        """Yield the rows in the order of their points."""
        for line in self.lines_at(self._places[self._places >= 0].tolist()):
            yield row_of(Row, line)
