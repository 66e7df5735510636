"""Surroundings of the answer as HTML: other optima, slices and maps of F."""

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
from .markup import Markup, html_table, join_markup, paragraphs, script_frame, tag
from .report import Part, Report
from .slices import Slice, has_loops

_ENCLOSED = (
    "Here F is drawn over the active limits that cost most. Each point of a curve is a solve of its own, from few "
    "starting points and from the optima beside it. The dot in colour is this point; the command tradeoff draws such "
    "curves more closely. Slices along single variables would show little: most variables cannot move alone from this "
    "point without leaving a limit."
)


def optima(report: Report) -> Markup:
    """Return the distinct optima found from the starts: a chart of counts over F, and a table of their variables."""
    parts: list[Markup] = []
    result = report.result
    results = [result] if isinstance(result, SolveResult) else result.tasks
    solutions: list[tuple[str, str, str, ProgramSolution, RobotData | None]] = [
        (part.name, part.label, part.unit, part.solution, own.robot)
        for part, own in zip(report.parts, results, strict=True)
    ]
    if report.combined is not None:
        case = report.case
        solutions.append(
            ("the combined program", objective_label(case), unit_of_objective(case), report.combined, None)
        )
    for name, label, unit, solution, robot in solutions:
        if not solution.starts:
            continue
        if len(solutions) > 1:
            parts.append(tag("h3", name))
        parts += _optima_of(solution, robot, label, unit)
    return join_markup(parts)


def _optima_of(solution: ProgramSolution, robot: RobotData | None, label: str, unit: str) -> Iterator[Markup]:
    converged = sum(found.count for found in solution.optima)
    yield tag("p", f"{converged} of {counted(len(solution.starts), 'start')} ended in an optimum.")
    failed = Counter(start.status for start in solution.starts if start.status is not StartStatus.CONVERGED)
    yield from (tag("p", f"{count}: {status.value}.") for status, count in failed.items())
    if not solution.optima:
        return
    if solution.better is not None:
        reached = f"{number(task_F(robot, solution.better))} {unit}".rstrip()
        yield tag(
            "p", f"A search that did not converge reached F = {reached} within the limits, better than any optimum."
        )
    best = solution.optima[0]
    F = f"{number(task_F(robot, best.F))} {unit}".rstrip()
    times = "once" if best.count == 1 else f"{best.count} times"
    words = f"{len(solution.optima)} distinct optima; the best, F = {F}, was found {times}."
    if len(solution.optima) == 1:
        words = f"All of these ended in one optimum, F = {F}."
        if best.count == 1:
            words = f"The optimum that was found: F = {F}."
        yield tag("p", words)
    else:
        chart = count_chart([(o.F, o.count) for o in solution.optima], words=words, labels=(label, "starts"))
        yield tag("figure", chart, tag("figcaption", words))
    left = len(solution.optima) - MOST_OPTIMA
    more = f" ({left} worse {'one is' if left == 1 else 'ones are'} left out)" if left > 0 else ""
    yield html_table(optimum_table(solution, robot), f"Where they lie{more}")


def surroundings(report: Report) -> Markup:
    """Return F along each variable through the answer, and over pairs of variables."""
    parts: list[Markup] = []
    with_maps = [k for k, part in enumerate(report.parts) if part.planes]
    if not any(part.slices for part in report.parts):
        if any(has_loops(part.nlp) for part in report.parts) and report.parts[0].nlp.n:
            return paragraphs(
                ["One variable cannot move alone: the robot's loops would open. So there are no slices of F."]
            )
        return Markup("")
    if report.curves:
        here = {f"limits.{row.key}": row.limit for row in _limits(report)}
        curves = [tradeoff_designs(each, report.case) for each in report.curves]
        parts += [tag("p", _ENCLOSED), curve_figures(*curves, here=here), *map(designs_rows, curves)]
    parts += _slices(report)
    if with_maps:
        parts.append(tag("h3", "Two variables at once"))
        parts.append(_maps(report, with_maps))
    return join_markup(parts)


def _limits(report: Report) -> tuple[LimitData, ...]:
    return report.result.limits if isinstance(report.result, SolveResult) else ()


def _slices(report: Report) -> Iterator[Markup]:
    """Yield the slices; beside curves, those of the variables that can move alone only."""
    shown = [[each for each in part.slices if each.has_room or not report.curves] for part in report.parts]
    if not any(shown):
        return
    if report.curves:
        yield tag("h3", "Variables that can move alone")
    yield tag(
        "p",
        "Each slice moves one variable from bound to bound and holds the others. Solid: within every limit; "
        "dashed: outside of one, or off an equation of the robot. Vertical lines: the bounds. Dot: this point."
        + (
            " A component of a free direction moves with the direction's others, which are scaled to unit length."
            if report.parts[0].nlp.program.places.directions
            else ""
        ),
    )
    for part, slices in zip(report.parts, shown, strict=True):
        if len(report.parts) > 1:
            yield tag("h3", f"Slices for “{part.name}”")
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
        words = f"{variable.name}: F from {np.nanmin(each.F):.5g} to {np.nanmax(each.F):.5g} on the slice"
        if kept.any():
            k = int(np.nanargmax(inside) if nlp.sign < 0 else np.nanargmin(inside))
            best = "largest" if nlp.sign < 0 else "smallest"
            words += f", {best} within the limits at {number(values[k], width, digits=5)} {unit}".rstrip()
            if kept.sum() == 1:
                words += ", the only one of its points within them"
            elif not kept[finite].all():
                words += f"; within every limit on {100 * np.mean(kept):.0f} % of it"
        else:
            words += "; no point of it keeps every limit"
        words += f". Here: F = {here:.6g} {part.unit}".rstrip() + f" at {at:.5g} {unit}".rstrip() + "."
    else:
        words = f"{variable.name}: it cannot move while the others are held."
    chart = line_chart(
        [Curve(values, each.F.tolist(), "curve outside"), Curve(values, inside.tolist(), "curve")],
        [Spot(at, here, "spot", f"here: {variable.name} = {at:.6g} {unit}, F = {here:.7g} {part.unit}".rstrip())],
        words=words,
        labels=(f"{variable.name}, {unit}" if unit else variable.name, part.label),
        bounds=(values[0], values[-1]),
    )
    return tag("figure", chart, tag("figcaption", words))


def _maps(report: Report, parts: Sequence[int]) -> Markup:
    """Return the frame of the maps of F, and the choice of two variables.

    Args:
        report: the report.
        parts: indices of the parts with maps.
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
    few = tag("p", f"The first {shown} of {every} pairs are here.") if shown < every else None
    return join_markup([chooser, tag("figure", picture, tag("figcaption", id="map-words")), *([few] if few else [])])
