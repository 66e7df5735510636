"""Sweeps as data, column by column."""

from collections.abc import Mapping
from typing import TypeAlias

from .jsondata import Absent, Inline, JsonObject, Vector
from .parts import HeadData, VersionsData

#: A number for each point; null where there is none.
Column: TypeAlias = tuple[float | None, ...]


class SweepResult(JsonObject):
    """Result of a sweep: one entry for each point in each column.

    Attributes:
        head: the case at the first point.
        notice: that limits are taken at the stated pose alone, where the case has them over its workspace and the
            compiled engine solved points; else absent.
        unit: of F; empty where tasks do not agree in it.
        numbers: values of each number that changes, by name.
        statuses: of each solve; "refused" where the case contradicts itself.
        F: objective, or the value of the combination of several tasks.
        design: values of each free number, by name.
        actives: sides of bounds and limits that each design lies on.
        multipliers: of the active sides.
        verdicts: kind of each point.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest distance outside a side, in half ranges.
        curvature: smallest eigenvalue of the reduced Hessian.
        starts: number of searches.
        converged: number of searches that converged.
        engines: whose point it is.
        times: wall time, seconds.
        notes: reasons of refusals.
        certificates: status of each proof; absent where none was asked for.
        bounds: proven bounds of F; absent likewise.
        gaps: distances of the bounds from F; absent likewise.
        versions: of the programs.
    """

    head: Inline[HeadData]
    notice: Absent[str]
    unit: str
    numbers: Mapping[str, Vector]
    statuses: tuple[str, ...]
    F: Column
    design: Mapping[str, Column]
    actives: tuple[tuple[str, ...], ...]
    multipliers: tuple[Vector, ...]
    verdicts: tuple[str, ...]
    stationarity: Column
    feasibility: Column
    curvature: Column
    starts: tuple[int, ...]
    converged: tuple[int, ...]
    engines: tuple[str, ...]
    times: Column
    notes: tuple[str, ...]
    certificates: Absent[tuple[str, ...]]
    bounds: Absent[Column]
    gaps: Absent[Column]
    versions: VersionsData
