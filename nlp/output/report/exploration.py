"""Sections of a report about the surroundings of the design: local optima, slices and maps of F."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from ...evidence.state import ZERO_F
from ...results.data import SolveResult
from ...results.objective import unit_of_objective
from ...results.parts import LimitData, RobotData
from ...results.rounding import settled, task_F
from ...solver.multistart import ProgramSolution
from ...solver.starts import StartStatus
from ...words.lines import counted
from ...words.numbers import number
from ...words.objective import objective_label
from ...words.tables import MOST_OPTIMA, optimum_table
from ...words.tradeoff import tradeoff_designs
from .charts import Curve, Spot, count_chart, line_chart
from .curves import curve_figures
from .designs import designs_rows
from .markup import Markup, beside, caption, join_markup, paragraphs, script_frame, tag
from .report import Part, Report
from .slices import Slice, has_loops
from .tables import html_table

_ENCLOSED = (
    "Optimal F over the active limits with the largest effect. Each point of a curve is a new solve from a few "
    "starting points and from the neighbouring optima. The coloured dot is this design; the command tradeoff computes "
    "curves with more points. Slices along single variables are not shown: at this design, most variables cannot "
    "change independently without violating a limit."
)


def optima(report: Report) -> Markup:
    """Return the distinct local optima: a chart of counts over F, and a table of their variables."""
    parts: list[Markup] = []
    result = report.result
    results = [result] if isinstance(result, SolveResult) else result.tasks
    solutions: list[tuple[str, str, str, ProgramSolution, RobotData | None]] = [
        (f"Task “{part.name}”", part.label, part.unit, part.solution, own.robot)
        for part, own in zip(report.parts, results, strict=True)
    ]
    if report.combined is not None:
        case = report.case
        solutions.append(("Combined tasks", objective_label(case), unit_of_objective(case), report.combined, None))
    for name, label, unit, solution, robot in solutions:
        if not solution.starts:
            continue
        if len(solutions) > 1:
            parts.append(tag("h3", name))
        parts += _optima_of(solution, robot, label, unit)
    return join_markup(parts)


def _optima_of(solution: ProgramSolution, robot: RobotData | None, label: str, unit: str) -> Iterator[Markup]:
    converged = sum(found.count for found in solution.optima)
    yield tag("p", f"{converged} of {counted(len(solution.starts), 'start')} converged to a local optimum.")
    failed = Counter(start.status for start in solution.starts if start.status is not StartStatus.CONVERGED)
    yield from (tag("p", f"{count}: {status.value}.") for status, count in failed.items())
    if not solution.optima:
        return
    if solution.better is not None:
        reached = f"{number(task_F(robot, solution.better))} {unit}".rstrip()
        yield tag(
            "p", f"An unconverged search reached F = {reached} within the limits, better than every local optimum."
        )
    best = solution.optima[0]
    F = f"{number(task_F(robot, best.F))} {unit}".rstrip()
    times = "once" if best.count == 1 else f"{best.count} times"
    words = f"{len(solution.optima)} distinct optima; the best, F = {F}, was reached {times}."
    shown = []
    if len(solution.optima) == 1:
        words = f"All of them reached the same optimum, F = {F}."
        if best.count == 1:
            words = f"Local optimum: F = {F}."
        yield tag("p", words)
    else:
        chart = count_chart([(o.F, o.count) for o in solution.optima], words=words, labels=(label, "starts"))
        name = "Local optima"
        shown = [tag("figure", chart, caption(name, f"number of starts over F. {words}"), class_="chart-figure")]
    left = len(solution.optima) - MOST_OPTIMA
    more = f" ({left} worse {'optimum' if left == 1 else 'optima'} not shown)" if left > 0 else ""
    yield beside(*shown, html_table(optimum_table(solution, robot), f"Local optima: F and variables{more}"))


def surroundings(report: Report) -> Markup:
    """Return F along each variable through the design, and over pairs of variables."""
    parts: list[Markup] = []
    with_maps = [k for k, part in enumerate(report.parts) if part.planes]
    if not any(part.slices for part in report.parts):
        if any(has_loops(part.nlp) for part in report.parts) and report.parts[0].nlp.n:
            return paragraphs(
                ["No slices of F: no variable can change independently without opening the loops of the robot."]
            )
        return Markup("")
    if report.curves:
        here = {f"limits.{row.key}": row.limit for row in _limits(report)}
        curves = [tradeoff_designs(each, report.case) for each in report.curves]
        parts += [tag("p", _ENCLOSED), curve_figures(*curves, here=here), beside(*map(designs_rows, curves))]
    parts += _slices(report)
    if with_maps:
        parts.append(tag("h3", "F over two variables"))
        parts.append(_maps(report, with_maps))
    return join_markup(parts)


def _limits(report: Report) -> tuple[LimitData, ...]:
    return report.result.limits if isinstance(report.result, SolveResult) else ()


def _slices(report: Report) -> Iterator[Markup]:
    """Yield the slices; with trade-off curves, only those of variables that can change independently."""
    shown = [[each for each in part.slices if each.has_room or not report.curves] for part in report.parts]
    if not any(shown):
        return
    if report.curves:
        yield tag("h3", "Independent variables")
    yield tag(
        "p",
        "In each slice, one variable changes from bound to bound and the others stay fixed. Solid: all limits "
        "satisfied; dashed: a limit or an equation of the robot violated. Vertical lines: bounds. Dot: this design."
        + (
            " If the variable is a component of a unit vector, the other components are scaled to keep its length."
            if report.parts[0].nlp.program.places.directions
            else ""
        ),
    )
    for part, slices in zip(report.parts, shown, strict=True):
        if len(report.parts) > 1:
            yield tag("h3", f"Slices of task “{part.name}”")
        yield tag("div", *(_slice(part, each) for each in slices), class_="charts")


def _slice(part: Part, each: Slice) -> Markup:
    """Return a chart of F along one variable, with a sentence about it."""
    nlp, x = part.nlp, part.x
    variable, units = nlp.program.variables[each.variable], nlp.case.units
    values = [units.shown(float(value), variable.dimension) for value in each.values]
    inside = np.where(each.inside > 0, each.F, np.nan)
    width = values[-1] - values[0]
    at = settled(units.shown(float(x[each.variable]), variable.dimension), width)
    here = settled(nlp.evaluate(x)[0], nlp.objective_size, ZERO_F)
    unit = units.label(variable.dimension)
    finite = np.isfinite(each.F)
    if finite.any():
        kept = np.isfinite(inside)
        words = f"F from {np.nanmin(each.F):.5g} to {np.nanmax(each.F):.5g} along the slice"
        if kept.any():
            k = int(np.nanargmax(inside) if nlp.sign < 0 else np.nanargmin(inside))
            best = "largest" if nlp.sign < 0 else "smallest"
            words += f"; {best} F within the limits at {number(values[k], width, digits=5)} {unit}".rstrip()
            if kept.sum() == 1:
                words += ", the only point within the limits"
            elif not kept[finite].all():
                words += f"; all limits are satisfied on {100 * np.mean(kept):.0f} % of the slice"
        else:
            words += "; no point satisfies all limits"
        words += f". This design: F = {here:.6g} {part.unit}".rstrip() + f" at {at:.5g} {unit}".rstrip() + "."
    else:
        words = "no slice, as this variable cannot change while all others are fixed."
    chart = line_chart(
        [Curve(values, each.F.tolist(), "curve outside"), Curve(values, inside.tolist(), "curve")],
        [
            Spot(
                at, here, "spot", f"this design: {variable.name} = {at:.6g} {unit}, F = {here:.7g} {part.unit}".rstrip()
            )
        ],
        words=f"{variable.name}: {words}",
        labels=(f"{variable.name}, {unit}" if unit else variable.name, part.label),
        bounds=(values[0], values[-1]),
    )
    return tag("figure", chart, tag("figcaption", tag("b", f"{variable.name}:"), " ", words))


def _maps(report: Report, parts: Sequence[int]) -> Markup:
    """Return the frame of the maps of F, and the selection of two variables.

    Args:
        report: content of the report.
        parts: indices of the tasks with maps.
    """
    options = []
    for k in parts:
        part = report.parts[k]
        for index, plane in enumerate(part.planes):
            i, j = (part.nlp.program.variables[each].name for each in plane.variables)
            prefix = f"{part.name}: " if len(report.parts) > 1 else ""
            options.append(tag("option", f"{prefix}{i} and {j}", value=f"{k} {index}"))
    chooser = tag(
        "p", tag("label", "Variables: ", for_="pair"), tag("select", *options, id="pair"), class_="controls script"
    )
    shown, every = len(options), sum(part.pairs for part in report.parts)
    picture = script_frame("map", "map", "Map of F over two variables")
    few = tag("p", f"The first {shown} of {every} pairs are available.") if shown < every else None
    return join_markup([chooser, tag("figure", picture, tag("figcaption", id="map-words")), *([few] if few else [])])
