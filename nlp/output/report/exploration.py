"""Surroundings of the answer as HTML: other optima, slices and maps of F."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from ...results.tables import MOST_OPTIMA, optimum_table
from ...solver.multistart import ProgramSolution
from ...solver.starts import StartStatus
from .charts import Curve, Spot, count_chart, line_chart
from .markup import Markup, html_table, join_markup, paragraphs, tag
from .report import Part, Report
from .slices import Slice, has_loops


def optima(report: Report) -> Markup:
    """Return the distinct optima found from the starts: a chart of counts over F, and a table of their variables."""
    parts: list[Markup] = []
    solutions = [(part.name, part.solution) for part in report.parts]
    if report.combined is not None:
        solutions.append(("the combined program", report.combined))
    for name, solution in solutions:
        if not solution.starts:
            continue
        if len(solutions) > 1:
            parts.append(tag("h3", name))
        parts += _optima_of(solution)
    return join_markup(parts)


def _optima_of(solution: ProgramSolution) -> Iterator[Markup]:
    """Yield the starts of one program, and its distinct optima."""
    converged = sum(found.count for found in solution.optima)
    yield tag("p", f"{converged} of {len(solution.starts)} starts ended in an optimum.")
    failed = Counter(start.status for start in solution.starts if start.status is not StartStatus.CONVERGED)
    yield from (tag("p", f"{count}: {status.value}.") for status, count in failed.items())
    if not solution.optima:
        return
    best = solution.optima[0]
    words = f"{len(solution.optima)} distinct optima; the best, F = {best.F:.7g}, was found {best.count} times."
    if len(solution.optima) == 1:
        words = f"All of these ended in one optimum, F = {best.F:.7g}."
        yield tag("p", words)
    else:
        chart = count_chart([(o.F, o.count) for o in solution.optima], words=words, labels=("F", "starts"))
        yield tag("figure", chart, tag("figcaption", words))
    left = len(solution.optima) - MOST_OPTIMA
    more = f" ({left} worse ones are left out)" if left > 0 else ""
    yield html_table(optimum_table(solution), f"Where they lie{more}")


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
    parts.append(
        tag(
            "p",
            "Each slice moves one variable from bound to bound and holds the others. Solid: within every limit; "
            "dashed: outside of one, or off an equation of the robot. Vertical lines: the bounds. Dot: this point."
            + (
                " A component of a free direction moves with the direction's others, which are scaled to unit length."
                if report.parts[0].nlp.program.places.directions
                else ""
            ),
        )
    )
    for part in report.parts:
        if len(report.parts) > 1:
            parts.append(tag("h3", f"Slices for “{part.name}”"))
        parts.append(tag("div", *(_slice(part, each) for each in part.slices), class_="charts"))
    if with_maps:
        parts.append(tag("h3", "Two variables at once"))
        parts.append(_maps(report, with_maps))
    return join_markup(parts)


def _slice(part: Part, each: Slice) -> Markup:
    """Return a chart of F along one variable, with a sentence about it."""
    nlp, x = part.nlp, part.x
    variable, units = nlp.program.variables[each.variable], nlp.case.units
    values = [units.shown(float(value), variable.dimension) for value in each.values]
    inside = np.where(each.inside > 0, each.F, np.nan)
    at = units.shown(float(x[each.variable]), variable.dimension)
    here = nlp.evaluate(x)[0]
    unit = units.label(variable.dimension)
    finite = np.isfinite(each.F)
    if finite.any():
        kept = np.isfinite(inside)
        words = f"{variable.name}: F from {np.nanmin(each.F):.5g} to {np.nanmax(each.F):.5g} on the slice"
        if kept.any():
            k = int(np.nanargmax(inside) if nlp.sign < 0 else np.nanargmin(inside))
            best = "largest" if nlp.sign < 0 else "smallest"
            words += f", {best} within the limits at {values[k]:.5g} {unit}".rstrip()
            if kept.sum() == 1:
                words += ", the only one of its points within them"
            elif not kept[finite].all():
                words += f"; within every limit on {100 * np.mean(kept):.0f} % of it"
        else:
            words += "; no point of it keeps every limit"
        words += f". Here: F = {here:.6g} at {at:.5g} {unit}".rstrip() + "."
    else:
        words = f"{variable.name}: it cannot move while the others are held."
    chart = line_chart(
        [Curve(values, each.F.tolist(), "curve outside"), Curve(values, inside.tolist(), "curve")],
        [Spot(at, here, "spot", f"here: {variable.name} = {at:.6g} {unit}, F = {here:.7g}")],
        words=words,
        labels=(f"{variable.name}, {unit}" if unit else variable.name, "F"),
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
    picture = tag(
        "div",
        tag("p", "The map appears when its script has started.", class_="waiting script"),
        id="map",
        class_="map",
        role="img",
        aria_label="Map of F over two variables",
    )
    few = tag("p", f"The first {shown} of {every} pairs are here.") if shown < every else None
    return join_markup([chooser, tag("figure", picture, tag("figcaption", id="map-words")), *([few] if few else [])])
