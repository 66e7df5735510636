"""Rows of a sweep's table: the answer at one point, as the journal stores it."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import NamedTuple, get_type_hints

from ..evidence.optimality import Evidence
from ..system.strictjson import json_tree, value_of

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
        multipliers: of the active sides, in F per unit of the limit, per radian for angles.
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


def with_evidence(row: Row, evidence: Evidence) -> Row:
    """Return a row with the evidence at its point."""
    return row._replace(
        active=tuple(f"{side.name} {side.bound}" for side in evidence.active),
        multipliers=tuple(side.multiplier for side in evidence.active),
        verdict=evidence.kind.value,
        stationarity=finite(evidence.stationarity),
        feasibility=finite(evidence.feasibility),
        curvature=finite(evidence.eigenvalues[0]) if len(evidence.eigenvalues) else None,
    )


def finite(value: float) -> float | None:
    """Return a number as a row has it: None where it is not finite."""
    return float(value) if math.isfinite(value) else None


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
    return Row(*(value_of(kind, value, name) for (name, kind), value in zip(_kinds(), data, strict=True)))


@cache
def _kinds() -> tuple[tuple[str, object], ...]:
    """Return the fields of a row with their types."""
    return tuple(get_type_hints(Row).items())
