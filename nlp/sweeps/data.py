"""A sweep as a result."""

from __future__ import annotations

from types import MappingProxyType

from ...models import FloatArray
from ..case.case import Case
from ..results.jsondata import finite_or_none, vector
from ..results.point import head_data, versions
from ..results.sweep import Column, SweepResult
from ..results.tradeoffwording import unit_of_objective
from .columns import SweepColumns, stated_pose_note


def sweep_result(case: Case, found: SweepColumns) -> SweepResult:
    """Return the answers of a sweep as a result.

    Args:
        case: the case at one of the points.
        found: the answers.
    """
    is_proved = any(found.certificate)
    return SweepResult(
        head=head_data(case),
        notice=stated_pose_note(case, found.note),
        unit=unit_of_objective(case),
        numbers=MappingProxyType({name: vector(values) for name, values in found.numbers.items()}),
        statuses=found.status,
        F=_column(found.F),
        design=MappingProxyType({name: _column(values) for name, values in found.design.items()}),
        actives=found.active,
        multipliers=found.multipliers,
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
