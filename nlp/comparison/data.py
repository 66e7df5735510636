"""A comparison as a result."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from ...models import frozen_array
from ..case.case import Case
from ..case.pose import Free
from ..errors import CaseError
from ..program.program import design_names
from ..results.comparison import (
    ComparedDimensionData,
    ComparedLimitData,
    ComparedRateData,
    ComparedRobotData,
    ComparedStrokeData,
    ComparedTaskData,
    ComparisonResult,
)
from ..results.evidence import certificate_data
from ..results.jsondata import finite_or_none
from ..results.parts import SCHEMA, UnitsData
from ..results.point import versions
from ..units import objective_unit, rate_unit
from .compare import Comparison, part_of
from .entry import Entry, TaskFit
from .sentences import comparison_sentences, entry_sentences


def comparison_result(found: Comparison) -> ComparisonResult:
    """Return a comparison as a result."""
    case = found.case
    return ComparisonResult(
        schema=SCHEMA,
        case=case.name,
        title=case.title,
        units=UnitsData(length=case.units.length, angle=case.units.angle),
        limits=len(case.limits),
        size=found.size,
        range=found.part,
        characteristic_length=found.characteristic_length,
        robots=tuple(_robot(case, each) for each in found.entries),
        sentences=tuple(comparison_sentences(found)),
        versions=versions(),
        seconds=found.seconds,
    )


def _robot(case: Case, entry: Entry) -> ComparedRobotData:
    model, solution, units = entry.contender.model, entry.solution, case.units
    placed = entry.placed
    left_out = () if placed is None else placed.left_out
    return ComparedRobotData(
        name=entry.contender.label,
        model=model.name,
        description=model.description,
        part=part_of(entry),
        factor=entry.factor,
        size=entry.size,
        final_size=entry.final_size,
        freedoms=entry.freedoms,
        status=None if solution is None else solution.status,
        value=entry.value,
        sense=entry.sense,
        tasks=tuple(_task(case, k, each) for k, each in enumerate(entry.tasks)),
        dimensions=_dimensions(entry),
        active=_active(entry),
        singularities=entry.singularities,
        limits_kept=0 if placed is None else len(placed.case.limits),
        limits_left_out=tuple(ComparedLimitData(key=each.key, reason=each.reason) for each in left_out),
        certificate=certificate_data(entry.certificate),
        certificate_fault=entry.certificate_fault or None,
        workspace=entry.outcome,
        strokes=MappingProxyType(
            {
                name: ComparedStrokeData(
                    stroke=units.shown(each.value, each.dimension), unit=units.label(each.dimension)
                )
                for name, each in entry.strokes.items()
            }
        ),
        sentences=tuple(entry_sentences(entry)),
        case=_text(entry),
        seconds=entry.seconds,
    )


def _task(case: Case, index: int, fit: TaskFit) -> ComparedTaskData:
    units, twist = case.units, frozen_array(case.tasks[index].twist, (6,))
    return ComparedTaskData(
        name=fit.name,
        F=None if fit.F is None else finite_or_none(fit.F),
        unit=objective_unit([twist], units),
        can_move=fit.can_move,
        constraint=fit.constraint,
        rates=tuple(
            ComparedRateData(
                actuator=rate.actuator,
                unit=rate_unit(twist, units, rate.dimension),
                rate=finite_or_none(rate.value),
            )
            for rate in fit.rates
        ),
    )


def _active(entry: Entry) -> tuple[str, ...]:
    """Return the bounds and limits that a design lies on, without the joints and loops of the robot."""
    own = None if entry.solution is None else entry.solution.decided_by
    if own is None or own.evidence is None or not entry.has_answer:
        return ()
    names = design_names(own.nlp.program)
    return tuple(f"{side.name} {side.bound}" for side in own.evidence.active if side.name in names)


def _dimensions(entry: Entry) -> tuple[ComparedDimensionData, ...]:
    """Return the dimensions of a design with the ranges in which they were free."""
    if entry.placed is None or entry.solution is None or not entry.has_answer or entry.solution.state is None:
        return ()
    case, rows = entry.placed.case, []
    for item in case.model.parameters:
        values = np.atleast_1d(entry.solution.state.parameters[item.name])
        for name, allowed, value in zip(item.components, case.components(item.name), values, strict=True):
            ends = None
            if isinstance(allowed, Free):
                ends = tuple(case.units.shown(end, item.dimension) for end in (allowed.lower, allowed.upper))
            rows.append(
                ComparedDimensionData(
                    name=name,
                    value=case.units.shown(float(value), item.dimension),
                    unit=case.units.label(item.dimension),
                    range=ends,
                )
            )
    return tuple(rows)


def _text(entry: Entry) -> str | None:
    """Return the case with a robot as the text of a case file; None where no file can state it."""
    if entry.placed is None:
        return None
    try:
        return entry.placed.case.to_toml()
    except CaseError:
        return None
