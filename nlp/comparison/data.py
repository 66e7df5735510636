"""Comparison as a result and as a table of designs, with sentences on its rules and on missing results of robots."""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import MappingProxyType

import numpy as np

from ...models import Dimension, frozen_array
from ..case.case import Case
from ..case.choices import values_of_component
from ..case.names import name_of_task
from ..case.pose import Free
from ..errors import CaseError, listing
from ..program.program import design_names
from ..proof.workspace.verdict import Outcome
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
from ..results.objective import unit_of_objective
from ..results.parts import SCHEMA, UnitsData
from ..results.point import versions, violations
from ..solver.solution import Solution
from ..solver.status import Status
from ..system.jsonvalues import finite_or_none
from ..units import rate_unit
from ..words.comparison import comparison_columns, comparison_lines
from ..words.designs import DesignDetails, Designs, DrawnDesign, Join, PageWords, design_values, drawn_task
from ..words.text import Line, TextTable, Tone
from .compare import Comparison, part_of
from .entry import Entry, TaskFit, driven_wrenches

#: Factor from a fraction to percent.
_PERCENT = 100
#: Relative difference of sizes above which a sentence warns: F of a rotation then differs by twice as much.
_SAME_SIZE = 0.02


def entry_sentences(entry: Entry) -> list[str]:
    """Return sentences on missing results of a robot, and on results that cannot be compared."""
    found = []
    if entry.fault:
        found.append(f"The case is inconsistent with this robot: {entry.fault}.")
    elif not entry.has_answer:
        found.append(_no_answer(entry))
    for fit in entry.tasks:
        found += _fit_sentences(entry, fit)
    found += _left_out_sentences(entry)
    found += [f"Singular: {each}." for each in entry.singularities]
    found += _proof_sentences(entry)
    return found


def _left_out_sentences(entry: Entry) -> Iterator[str]:
    """Yield sentences on the limits that do not apply to a robot."""
    model = entry.contender.model
    left_out = () if entry.placed is None else entry.placed.left_out
    of_legs = [each.key for each in left_out if each.is_of_legs and model.structure]
    others = [each.key for each in left_out if each.key not in of_legs]
    if of_legs:
        own = listing(each.name for each in model.quantities)
        measures = f"; its quantities are {own}" if own else ""
        yield (
            f"Solved without {', '.join(of_legs)}: they apply to legs between joint centres, and this robot is defined "
            f"by joints{measures}."
        )
    if others:
        yield f"Solved without {', '.join(others)}: they do not apply to this robot."


def _fit_sentences(entry: Entry, fit: TaskFit) -> list[str]:
    """Return sentences on a robot's degrees of freedom for a task, and on actuators that do not drive it."""
    found = []
    if fit.can_move is False:
        mobility = "" if entry.freedoms is None else f" with {entry.freedoms} degrees of freedom"
        found.append(
            f"The platform{mobility} cannot follow the motion of {fit.name}: "
            f"{_PERCENT * (fit.constraint or 0.0):.3g} % of its F is constraint wrenches, not actuation."
        )
    elif fit.can_move is None:
        found.append(
            f"Unknown for this robot, which is defined by its rows: can the platform follow the motion of {fit.name}?"
        )
    largest = fit.largest_rate
    if largest is not None and math.isnan(largest.value):
        found.append(f"The task's motion does not determine the rate of actuator {largest.actuator}.")
    elif largest is not None and math.isinf(largest.value):
        found.append(f"Actuator {largest.actuator} cannot drive the platform at this design.")
    return found


def _proof_sentences(entry: Entry) -> list[str]:
    """Return sentences on missing proofs of a robot."""
    found = []
    if entry.certificate_fault:
        found.append(f"No certificate: {entry.certificate_fault}.")
    if entry.workspace_fault:
        found.append(f"No verdict over the workspace: {entry.workspace_fault}.")
    return found


def _no_answer(entry: Entry) -> str:
    """Return the reason why a robot has no optimum."""
    solution = entry.solution
    own = None if solution is None else solution.decided_by
    if solution is None or own is None:
        return "No optimum."
    status = solution.status.value
    if solution.status is Status.INTERRUPTED:
        return f"No optimum ({status})."
    closure = {equation.name for equation in (*entry.contender.model.closure, *entry.contender.model.loops)}
    names = [row.name for row in violations(own.nlp, own.x)]
    if any(name.split(" at ")[0] in closure for name in names):
        few = entry.freedoms is not None and entry.freedoms < 6
        reason = f"; its platform has {entry.freedoms} degrees of freedom" if few else ""
        return f"No optimum ({status}): its joints cannot be assembled at the poses of the case{reason}."
    keys = ", ".join(f"limits.{each.key}" for each in own.relaxation) or ", ".join(names[:3])
    return f"No optimum ({status}): no design within the ranges satisfies {keys or 'the limits'}."


def comparison_sentences(comparison: Comparison) -> list[str]:
    """Return sentences on a comparison."""
    return [*_rules(comparison), *_cautions(comparison), *_conventions(comparison)]


def _rules(comparison: Comparison) -> list[str]:
    """Return sentences on sizes and dimensions."""
    case, lines = comparison.case, []
    if comparison.size is not None:
        size = case.units.text(comparison.size, Dimension.LENGTH)
        lines.append(
            "Size: with typical dimensions at home, the largest distance between two points of each robot is scaled to "
            f"{size}."
        )
    else:
        lines.append("The robots are not scaled: typical lengths are lengths in the unit of the case.")
    if comparison.part:
        lines.append(
            f"Dimensions vary within {_PERCENT * comparison.part:g} % of the typical values; directions are fixed."
        )
    else:
        lines.append("Dimensions are fixed at the typical values.")
    if any(each.contender.is_of_case for each in comparison.entries):
        lines.append("The robot of the case keeps its dimensions and ranges.")
    if case.dimensions_per_task and not all(each.contender.is_of_case for each in comparison.entries):
        own = listing(name for name in case.changes if name != "pose")
        lines.append(f"Only the robot of the case changes {own} from task to task; every other robot is the same.")
    return lines


def _cautions(comparison: Comparison) -> list[str]:
    """Return sentences on differences that affect the comparison of F: sizes, numbers of terms, and units."""
    case, ranked, lines = comparison.case, comparison.ranked, []
    sizes = [each.final_size for each in ranked if each.final_size is not None]
    turns = any(np.any(np.asarray(task.twist, dtype=np.float64)[:3]) for task in case.tasks)
    if turns and sizes and max(sizes) > (1 + _SAME_SIZE) * min(sizes):
        own = any(each.contender.is_of_case for each in ranked)
        of_all = "a common size, except for the case's robot" if own else "a common size"
        lines.append(
            "The designs have different sizes (see the column size), and F of a rotation grows with the square of the "
            f"size: use --part 0 for {of_all}."
        )
    terms = {each.contender.label: driven_wrenches(each.contender) for each in ranked}
    if len(set(terms.values())) > 1:
        counts = ", ".join(f"{label} {count}" for label, count in terms.items())
        lines.append(f"F has one term for each actuation wrench, and the numbers of terms differ: {counts}.")
    kinds = {rate.dimension for each in ranked for fit in each.tasks for rate in fit.rates}
    if len(kinds) > 1:
        lines.append("Rates of rotary and of linear actuators have different units, and cannot be compared.")
    return lines


def _conventions(comparison: Comparison) -> list[str]:
    """Return sentences on units, and on robots that are not ranked."""
    case, entries, lines = comparison.case, comparison.entries, []
    if any(each.contender.model.has_couples for each in entries):
        length = case.units.text(comparison.characteristic_length, Dimension.LENGTH)
        lines.append(f"Characteristic length between couples and forces: {length}.")
    if any(part_of(each) == "limits not kept" for each in entries):
        lines.append(
            "A robot that does not satisfy all limits of the case is not ranked: F can be better with fewer limits."
        )
    if any(part_of(each) == "no freedom" for each in entries):
        lines.append(
            "A robot without the degrees of freedom for a task is not ranked: constraint wrenches are part of its F."
        )
    if len(case.tasks) > 1 and all(each.value is None for each in entries):
        lines.append(
            "The tasks are averaged, so there is no common value for a ranking: the robots are in the given order."
        )
    return lines


def comparison_result(comparison: Comparison) -> ComparisonResult:
    """Return a comparison as a result."""
    case = comparison.case
    return ComparisonResult.of(
        comparison,
        schema=SCHEMA,
        case=case.name,
        title=case.title,
        units=UnitsData.of(case.units),
        limits=len(case.limits),
        range=comparison.part,
        robots=tuple(_robot(case, each) for each in comparison.entries),
        sentences=tuple(comparison_sentences(comparison)),
        versions=versions(),
    )


def comparison_designs(comparison: Comparison, result: ComparisonResult) -> Designs[ComparedRobotData]:
    """Return a comparison as a table of designs.

    Args:
        comparison: comparison of robots.
        result: comparison as a result.
    """
    case, ranked = comparison.case, [each for each in result.robots if each.part == "ranked"]
    words = f"{len(ranked)} of {len(result.robots)} robots can be compared"
    if others := sum(each.part == "limits not kept" for each in result.robots):
        words += f", {others} {'does' if others == 1 else 'do'} not satisfy all limits"
    if ranked and ranked[0].value is not None:
        unit = ranked[0].tasks[0].unit if len(ranked[0].tasks) == 1 else ""
        best = f"{ranked[0].name} has the best value, {f'{ranked[0].value:.7g} {unit}'.rstrip()}"
        if ranked[0].workspace is Outcome.REFUTED:
            best += ", but violates limits over the workspace"
        words = f"{best}; {words}"
    return Designs(
        "comparison",
        case,
        "ranking of the robots",
        tuple(comparison_columns(result)),
        result.robots,
        Join.LIST,
        PageWords(
            f"Comparison: {case.name}, robots {', '.join(each.name for each in result.robots)}",
            f"{words}.",
            ("drawings", "Designs"),
            ("robots", "Ranking"),
            rules=result.sentences,
            below="each at its design, with common view, scale and colour scale.",
            is_answer=bool(ranked),
        ),
        before=[Line(case.title or case.name, tone=Tone.TITLE)],
        after=tuple(comparison_lines(result)),
        drawn=lambda: [
            _drawn(case, each, each.solution) for each in comparison.entries if each.solution and each.has_answer
        ],
        details=tuple(_details(each) for each in result.robots),
    )


def _details(robot: ComparedRobotData) -> DesignDetails:
    """Return the details of a robot for a page: description, missing results, and dimensions with their ranges."""
    rows = tuple(
        (
            each.name,
            f"{each.value:.6g}",
            each.unit,
            "fixed" if each.range is None else f"{each.range[0]:.5g} to {each.range[1]:.5g}",
        )
        for each in robot.dimensions
    )
    table = TextTable(("dimension", "value", "unit", "range"), rows, with_unit=(1,)) if rows else None
    return DesignDetails(robot.name, (f"{robot.description}.", *robot.sentences), table)


def _drawn(case: Case, entry: Entry, solution: Solution) -> DrawnDesign:
    """Return the design of a solved robot for a drawing, with its F and size."""
    name, unit = ("F", unit_of_objective(case)) if len(entry.tasks) == 1 else ("value", "")
    words = "no common value" if entry.value is None else f"{name} = {entry.value:.5g} {unit}".rstrip()
    if entry.final_size is not None:
        words += f", size {entry.final_size:.4g} {case.units.length}"
    if entry.can_move is False:
        words += ", cannot follow the motion"
    elif not entry.keeps_limits:
        words += ", does not satisfy all limits"
    outcome, nlp = solution.outcomes[0], solution.outcomes[0].own.nlp
    numbers, active = design_values(solution.whole, solution.x), _active(entry)
    words += drawn_task(solution.case)
    return DrawnDesign(entry.contender.label, words, numbers, active, nlp, outcome.at, outcome.state)


def _robot(case: Case, entry: Entry) -> ComparedRobotData:
    model, placed, units = entry.contender.model, entry.placed, case.units
    left_out = () if placed is None else placed.left_out
    return ComparedRobotData.of(
        entry,
        name=entry.contender.label,
        model=model.name,
        description=model.description,
        part=part_of(entry),
        status=None if entry.solution is None else entry.solution.status,
        tasks=tuple(_task(case, k, each) for k, each in enumerate(entry.tasks)),
        dimensions=_dimensions(entry),
        active=_active(entry),
        limits_kept=len(placed.case.limits) if placed is not None and entry.has_answer else 0,
        limits_left_out=tuple(ComparedLimitData.of(each) for each in left_out),
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
    )


def _task(case: Case, index: int, fit: TaskFit) -> ComparedTaskData:
    units, twist = case.units, frozen_array(case.tasks[index].twist, (6,))
    return ComparedTaskData.of(
        fit,
        unit=unit_of_objective(case, index),
        rates=tuple(
            ComparedRateData.of(rate, unit=rate_unit(twist, units, rate.dimension), rate=finite_or_none(rate.value))
            for rate in fit.rates
        ),
    )


def _active(entry: Entry) -> tuple[str, ...]:
    """Return the active bounds and limits of a design, without joint coordinates and loop equations."""
    own = None if entry.solution is None else entry.solution.decided_by
    if own is None or own.evidence is None or not entry.has_answer:
        return ()
    names = design_names(own.nlp.program)
    return tuple(f"{side.name} {side.bound}" for side in own.evidence.active if side.name in names)


def _dimensions(entry: Entry) -> tuple[ComparedDimensionData, ...]:
    """Return the dimensions of a design with their ranges."""
    if entry.placed is None or entry.solution is None or not entry.has_answer or entry.solution.state is None:
        return ()
    case, rows = entry.placed.case, []
    for item in case.model.parameters:
        of_task = [
            np.atleast_1d(outcome.state.parameters[item.name]) for outcome in entry.solution.outcomes if outcome.state
        ]
        shown = [
            (k, item.components[k] if task is None else name_of_task(item.components[k], task), allowed, task or 0)
            for k in range(len(item.components))
            for task, _, allowed in values_of_component(case, item, k)
        ]
        for k, name, allowed, task in shown:
            value, ends = of_task[task][k], None
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
    """Return the case with a robot as the text of a case file; None if no file can represent it."""
    if entry.placed is None:
        return None
    try:
        return entry.placed.case.to_toml()
    except CaseError:
        return None
