"""The rows of a sweep as typed columns, and as a result."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..results.explorations import Column, SweepResult
from ..results.objective import unit_of_objective
from ..results.point import head_data, stated_pose_notice, versions
from ..system.jsonvalues import finite_or_none, vector
from .journal import Row, row_kinds
from .sweep import Sweep


@dataclass(frozen=True, eq=False)
class SweepColumns:
    """The answers of a sweep, column by column, in the order of its N points; NaN where there is no number.

    Attributes:
        numbers: (N,) values of each number that changes, by name.
        status: that of a solve; ``refused`` where the case contradicts itself.
        F: (N,) objective; for several tasks the value of their combination.
        design: (N,) each free number of the case by name, in the case's units.
        active: sides of bounds and limits that each design lies on.
        multipliers: of the active sides.
        verdict: on each point.
        stationarity: (N,) evidence, as the two that follow.
        feasibility: (N,) largest distance outside a side.
        curvature: (N,) smallest eigenvalue of the reduced Hessian.
        starts: (N,) number of searches.
        converged: (N,) number of those that converged.
        engine: whose point it is.
        seconds: (N,) wall time.
        note: reason of a refusal; that limits over a workspace are taken at the stated pose alone, or not proved.
        certificate: status of each proof; empty texts without ``certified``.
        bound: (N,) proven bound of F.
        gap: (N,) its distance from F.
    """

    numbers: Mapping[str, FloatArray]
    status: tuple[str, ...]
    F: FloatArray
    design: Mapping[str, FloatArray]
    active: tuple[tuple[str, ...], ...]
    multipliers: tuple[tuple[float, ...], ...]
    verdict: tuple[str, ...]
    stationarity: FloatArray
    feasibility: FloatArray
    curvature: FloatArray
    starts: NDArray[np.int64]
    converged: NDArray[np.int64]
    engine: tuple[str, ...]
    seconds: FloatArray
    note: tuple[str, ...]
    certificate: tuple[str, ...]
    bound: FloatArray
    gap: FloatArray

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        answers = int(np.isfinite(self.F).sum())
        return f"<SweepColumns of {len(self):,} points over {', '.join(self.numbers)}: {answers:,} have an answer>"


def columns_of(sweep: Sweep, rows: Sequence[Row]) -> SweepColumns:
    """Return the rows of a whole sweep, in the order of its points, as columns."""

    def numbers(values: Sequence[float | None]) -> FloatArray:
        return frozen_array(np.array(values, dtype=np.float64), (len(rows),))

    def column(name: str, kind: object) -> Any:  # noqa: ANN401 - as the fields of SweepColumns
        values = [getattr(row, name) for row in rows]
        if kind is int:
            return np.array(values, dtype=np.int64)
        return numbers(values) if kind in (float, float | None) else tuple(values)

    points, variables = sweep.points, sweep.variables
    values = zip(points.names, points.values.T, strict=True)
    design = {name: numbers([row.x[k] if k < len(row.x) else None for row in rows]) for k, name in enumerate(variables)}
    return SweepColumns(
        numbers=MappingProxyType({name: frozen_array(each, (len(points),)) for name, each in values}),
        design=MappingProxyType(design),
        **{name: column(name, kind) for name, kind in row_kinds() if name not in ("point", "x")},
    )


def stated_pose_note(case: Case, notes: Iterable[str]) -> str | None:
    """Return the notice that limits over the workspace are taken at the stated pose alone, where a row has it.

    Args:
        case: the case at one of the points.
        notes: of the rows.
    """
    notice = stated_pose_notice(case)
    return notice if notice is not None and notice in notes else None


def sweep_result(case: Case, found: SweepColumns) -> SweepResult:
    """Return the answers of a sweep as a result.

    Args:
        case: the case at one of the points.
        found: the answers.
    """
    is_proved = any(found.certificate)
    return SweepResult.of(
        found,
        head=head_data(case),
        notice=stated_pose_note(case, found.note),
        unit=unit_of_objective(case),
        numbers=MappingProxyType({name: vector(values) for name, values in found.numbers.items()}),
        statuses=found.status,
        F=_column(found.F),
        design=MappingProxyType({name: _column(values) for name, values in found.design.items()}),
        actives=found.active,
        verdicts=found.verdict,
        stationarity=_column(found.stationarity),
        feasibility=_column(found.feasibility),
        curvature=_column(found.curvature),
        starts=tuple(found.starts.tolist()),
        converged=tuple(found.converged.tolist()),
        engines=found.engine,
        times=_column(found.seconds),
        notes=found.note,
        certificates=found.certificate if is_proved else None,
        bounds=_column(found.bound) if is_proved else None,
        gaps=_column(found.gap) if is_proved else None,
        versions=versions(),
    )


def _column(values: FloatArray) -> Column:
    """Return numbers (N,) with None for those that are not finite."""
    return tuple(finite_or_none(value) for value in values.tolist())
