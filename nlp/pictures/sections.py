"""A report as sections of HTML: words and tables, and a chart with its text alternative where one helps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.console import Group

from screwsynth.nlp.ipopt import StartStatus
from screwsynth.nlp.pictures.charts import Curve, Spot, count_chart, line_chart
from screwsynth.nlp.pictures.frames import RATES
from screwsynth.nlp.pictures.markup import Markup, grid, html_table, joined, paragraphs, tag
from screwsynth.nlp.pictures.report import Part, Report
from screwsynth.nlp.pictures.slices import LEVEL, Slice, has_loops
from screwsynth.nlp.result import motion_of
from screwsynth.nlp.solver import Solution
from screwsynth.nlp.tables import (
    certificate_lines,
    design_table,
    headline,
    limb_table,
    limit_table,
    motion_words,
    outcome_table,
    pose_table,
    singularity_lines,
    tolerance_line,
    verdict_lines,
)

#: So many optima are shown in full.
_OPTIMA = 12


def sections(report: Report) -> list[tuple[str, str, Markup]]:
    """Every section that has something to show: its anchor, its heading and its content."""
    found = [
        ("case", "The case in words", _case(report)),
        ("robot", "The robot and its motion", _robot(report)),
        ("result", "Result", _result(report)),
        ("limits", "Limits: margins and costs", _limits(report)),
        ("optima", "Optima found", _optima(report)),
        ("around", "F around this point", _around(report)),
        ("evidence", "Evidence of optimality", _evidence(report)),
        ("certificate", "Certificate", _certificates(report)),
        ("published", "Published and computed", _published(report)),
        ("origin", "Case text and versions", _origin(report)),
    ]
    return [(anchor, title, content) for anchor, title, content in found if content]


def answer(report: Report) -> Markup:
    """What was found, at the top of the page; what is no answer is said to be none."""
    result = report.result
    if "combined" not in result:
        group = headline(report.case, result)
        lines = [str(line) for line in group.renderables[-1:]] if isinstance(group, Group) else []
    else:
        combined = result["combined"]
        value = "" if combined["value"] is None else f", value {combined['value']:.7g}"
        lines = [f"{len(report.parts)} tasks, combined by {combined['method']}: {result['status']}{value}"]
        if not report.is_answer:
            lines.append("This is no answer: what was reached is shown below.")
    kind = "answer" if report.is_answer else "answer none"
    return tag("div", paragraphs(lines), class_=kind, id="answer")


def _case(report: Report) -> Markup:
    case, first = report.case, report.parts[0]
    lines = [f"{case.model.description}."]
    for task in case.tasks:
        word = {"max": "as large as possible", "min": "as small as possible"}[task.sense.value]
        lines.append(f"Task “{task.name}”: make F {word} for a {motion_words(motion_of(task.twist), case.units)}.")
    lines.append(
        "F is the sum of the squares of the rates at which the limbs' unit wrenches do work in the task's motion."
    )
    if len(case.tasks) > 1:
        lines.append(f"The tasks are brought together by the method {case.method.value}.")
    names = [variable.name for variable in first.nlp.program.variables if variable.name != LEVEL]
    if names:
        plural = "numbers are" if len(names) > 1 else "number is"
        lines.append(f"{len(names)} {plural} free: {', '.join(names)}. Everything else is fixed.")
        if any(name.endswith("q_x") for name in names):
            lines.append("q is the vector part of the unit quaternion that turns the platform.")
    else:
        lines.append("Nothing is free: the robot is evaluated where it stands.")
    if case.pose_count > 1:
        lines.append(
            f"The robot works at {case.pose_count} poses; F is their {case.over_poses.value}. "
            "Pictures and their rates show the first."
        )
    limits = _point(report).get("limits") or []
    if limits:
        listed = ", ".join(f"{row['key']} {row['limit']:g} {row['unit']}".strip() for row in limits)
        lines.append(f"Limits: {listed}.")
    search = case.search
    if names:
        lines.append(f"Searched from {search.starts} starting points, seed {search.seed}.")
    return paragraphs(lines)


def _robot(report: Report) -> Markup:
    views = [part.view for part in report.parts if part.view is not None]
    if not views:
        return paragraphs(["The robot does not exist at the point reached, so there is no picture of it."])
    first = views[0]
    head: list[Markup] = []
    if not report.is_answer:
        head.append(tag("p", "This is what was reached, and not an optimum.", class_="warning"))
    if len(views) > 1:
        options = [tag("option", view["name"], value=k) for k, view in enumerate(views)]
        head.append(
            tag("p", tag("label", "Task: ", for_="task"), tag("select", *options, id="task"), class_="controls script")
        )
    last = len(first["frames"]) - 1
    moving = tag(
        "p",
        tag("label", "Move the platform along the task's motion", for_="travel"),
        tag("input", type="range", id="travel", min=0, max=last, step=1, value=first["zero"]),
        tag("output", first["frames"][first["zero"]]["words"], id="travelled", for_="travel"),
        class_="controls travel script",
    )
    turns = [("left", "Turn left"), ("right", "Turn right"), ("up", "Tilt up"), ("down", "Tilt down")]
    turns += [("in", "Nearer"), ("out", "Farther"), ("reset", "First view")]
    buttons = tag(
        "div",
        *(tag("button", words, type="button", data_turn=key) for key, words in turns),
        class_="controls buttons script",
        role="group",
        aria_label="View",
    )
    picture = tag(
        "figure",
        tag(
            "div",
            tag("p", "The picture appears when its script has started.", class_="waiting script"),
            id="view",
            class_="view",
            role="img",
            aria_label="The robot in three dimensions; the table below says the same in numbers.",
        ),
        buttons,
        # Printers get a copy of the picture, because what WebGL draws is not printed.
        tag("img", id="view-copy", class_="copy", alt="The robot in three dimensions, as in the table below"),
        tag("figcaption", _legend(first), id="view-words"),
    )
    content = [*head, moving, picture, tag("h3", "Rates at this position"), _rates(first)]
    note = "Without a script nothing moves and the picture is missing; every number is in the tables."
    return joined([*content, tag("noscript", tag("p", note))])


def _legend(view: dict[str, Any]) -> Markup:
    gradient = f"background:linear-gradient(90deg,{','.join(RATES)})"
    bar = tag("span", class_="scale", style=gradient, aria_hidden="true")
    words = [
        "Limbs by their rate, scaled to the largest here: blue is negative, grey none, orange positive.",
        " Bold black: the axis of the task's motion",
        ", with a purple path of its pitch" if view["motion"] and view["motion"]["path"] else "",
        ". Purple arrows: velocities of the platform's corners, not to scale.",
        " Dotted grey: the start." if view["reference"] else "",
        " Green, dashed: motions that nothing resists." if view["free"] else "",
        " Arrows with two heads: couples." if any(row["kind"] == "couple" for row in view["rows"]) else "",
        " Point at a limb for its length, rate, share of F and wrench.",
    ]
    return joined([bar, *words])


def _rates(view: dict[str, Any]) -> Markup:
    """Rates of every row at the drawn posture; the script keeps it in step with the platform."""
    frame = view["frames"][view["zero"]]
    # Where the task's motion is resisted by nothing, what is left is rounding.
    rates = [rate if abs(rate) > frame["noise"] else 0.0 for rate in frame["rates"]]
    largest = max(map(abs, rates), default=0.0) or 1.0
    total = sum(rate**2 for rate in rates)
    couples = any(row["kind"] == "couple" for row in view["rows"])
    headers = [
        "limb",
        *(["wrench"] if couples else []),
        f"length, {view['unit']}",
        f"rate, {view['rate_unit']}",
        "",
        "share of F",
    ]
    body = []
    for k, row in enumerate(view["rows"]):
        rate = rates[k]
        part = rate / largest
        bar = tag("span", tag("i"), class_="bar minus" if rate < 0 else "bar", style=f"--part:{abs(part):.4f}")
        share = f"{100 * rate**2 / total:.1f} %" if total > 0 else "none"
        cells = [f"{frame['lengths'][k]:.6g}", f"{rate:+.6g}", bar, share]
        kinds = ["length number", "rate number", "bars", "share number"]
        body.append(
            tag(
                "tr",
                tag("th", row["limb"], scope="row"),
                tag("td", row["kind"]) if couples else None,
                *(tag("td", cell, class_=kind) for cell, kind in zip(cells, kinds, strict=True)),
            )
        )
    head = tag("tr", *(tag("th", header, scope="col") if header else tag("td") for header in headers))
    caption = tag(
        "caption",
        "F = ",
        tag("span", f"{frame['F'] if total > 0 else 0:.7g}", id="F-there"),
        " with the platform ",
        tag("span", frame["words"], id="where"),
    )
    table = tag("table", caption, tag("thead", head), tag("tbody", *body), id="rates")
    return tag("div", table, class_="scroll", tabindex="0", role="region", aria_label="Rates at this position")


def _result(report: Report) -> Markup:
    case, result = report.case, report.result
    parts: list[Markup] = []
    if "combined" not in result:
        parts += _one(report, result, "design")
        for row in result.get("relaxation", []):
            unit = f" {row['unit']}" if row["unit"] else ""
            line = (
                f"It would be feasible with {row['key']} = {row['needed']:.6g}{unit} instead of {row['limit']:g}{unit}."
            )
            parts.append(tag("p", line))
        return joined(parts)
    combined = result["combined"]
    point = _point(report)
    if "parameters" in point:
        words = "The combined robot" if report.is_answer else "What was reached; this is no answer"
        parts.append(html_table(design_table(case, point), words, id="design"))
        parts += paragraphs_of(singularity_lines(case, {**point, "task_is_free": False}))
    if combined["tasks"]:
        parts.append(html_table(outcome_table(combined), "What it means for each task", id="outcomes"))
    parts += [tag("p", f"Note: {notice}.") for notice in combined["notices"]]
    parts += [tag("p", f"Violated: {name}", class_="warning") for name in combined["violated"]]
    for k, own in enumerate(result["tasks"]):
        parts.append(tag("h3", f"“{report.parts[k].name}” by itself"))
        parts += paragraphs_of(_last_line(headline(case, own)))
        parts += _one(report, own, f"design-{k + 1}")
    return joined(parts)


def _one(report: Report, result: dict[str, Any], anchor: str) -> list[Markup]:
    """Tables of one task's result."""
    case = report.case
    if "parameters" not in result:
        return [tag("p", "The robot does not exist at the point reached.", class_="warning")]
    reached = "reached" in result
    parts = [
        html_table(design_table(case, result), "What was reached" if reached else "Dimensions and pose", id=anchor)
    ]
    if "poses" in result:
        parts.append(html_table(pose_table(case, result), "The robot at every pose", id=f"{anchor}-poses"))
    else:
        parts.append(html_table(limb_table(case, result), "Limbs", id=f"{anchor}-limbs"))
    if "rank" in result and not reached:
        parts += paragraphs_of(singularity_lines(case, result))
    return parts


def _limits(report: Report) -> Markup:
    point = _point(report)
    if not point.get("limits"):
        return Markup("")
    parts = [
        html_table(limit_table(point), "How near the robot comes to each limit, and what the limit costs", id="limit")
    ]
    costly = [row for row in point["limits"] if row["active"] and row["cost"]]
    if costly:
        row = max(costly, key=lambda each: abs(each["cost"] * (each["limit"] or 1.0)))
        unit = row["unit"] or "unit"
        parts.append(
            tag("p", f"Per part of its own size, {row['key']} costs most: F changes by {row['cost']:+.4g} per {unit}.")
        )
    if point.get("tolerance"):
        parts += paragraphs_of([tolerance_line(report.case, point)])
    rows = [
        [
            row["name"],
            row["bound"],
            "none" if row["value"] is None else f"{row['value']:.6g}",
            f"{row['limit']:.6g}",
            "none" if row["margin"] is None else f"{row['margin']:.4g}",
            row["unit"],
            "active" if row["active"] else "",
        ]
        for row in point["margins"]
    ]
    headers = ["where", "bound", "value", "limit", "margin", "unit", ""]
    every = grid(headers, rows, "Every margin, positive inside")
    parts.append(tag("details", tag("summary", f"Every margin ({len(rows)})"), every))
    return joined(parts)


def _optima(report: Report) -> Markup:
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
    return joined(parts)


def _optima_of(solution: Solution) -> Iterator[Markup]:
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
    nlp = solution.nlp
    units = nlp.case.units
    names = [variable.name for variable in nlp.program.variables]
    labels = [units.label(variable.dimension) for variable in nlp.program.variables]
    headers = ["", *(f"{name}, {unit}" if unit else name for name, unit in zip(names, labels, strict=True))]
    rows = [
        [
            f"F = {found.F:.7g}, {found.count} starts"
            + (f", a set over {100 * found.spread:.0f} % of the ranges" if found.spread > 1e-3 else ""),
            *(
                f"{units.shown(float(value), variable.dimension):.6g}"
                for value, variable in zip(found.x, nlp.program.variables, strict=True)
            ),
        ]
        for found in solution.optima[:_OPTIMA]
    ]
    left = len(solution.optima) - len(rows)
    more = f" ({left} worse ones are left out)" if left else ""
    yield grid(headers, rows, f"Where they lie{more}")


def _around(report: Report) -> Markup:
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
                if report.parts[0].nlp.program.directions
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
    return joined(parts)


def _slice(part: Part, each: Slice) -> Markup:
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
    return joined([chooser, tag("figure", picture, tag("figcaption", id="map-words")), *([few] if few else [])])


def _evidence(report: Report) -> Markup:
    result = report.result
    parts: list[Markup] = []
    if "combined" not in result:
        return joined(_evidence_of(report, result))
    for k, own in enumerate(result["tasks"]):
        parts += [tag("h3", f"“{report.parts[k].name}” by itself"), *_evidence_of(report, own)]
    combined = result["combined"]
    if combined["optimality"] is not None:
        parts += [tag("h3", "The combined program"), tag("p", f"Verdict: {combined['optimality']['kind']}.")]
        parts += _active(combined["optimality"])
    return joined(parts)


def _evidence_of(report: Report, result: dict[str, Any]) -> Iterator[Markup]:
    # Rank and starts have their own places on the page.
    rest = {key: value for key, value in result.items() if key != "rank"}
    yield from paragraphs_of(verdict_lines(report.case, {**rest, "starts": {"run": 0}}))
    evidence = result["optimality"]
    if evidence is None:
        return
    yield from _active(evidence)
    if evidence["reduced_hessian_eigenvalues"] and "reached" not in result:
        listed = ", ".join(f"{value:.4g}" for value in evidence["reduced_hessian_eigenvalues"])
        yield tag("p", f"Curvatures along the directions that are left, in scaled variables: {listed}.")


def _active(evidence: dict[str, Any]) -> list[Markup]:
    if not evidence["active"]:
        return [tag("p", "No bound or limit is active.")]
    rows = [[s["name"], s["bound"], f"{s['value']:.7g}", f"{s['multiplier']:.4g}"] for s in evidence["active"]]
    return [grid(["", "side", "value", "multiplier, F per unit"], rows, "Active bounds and limits")]


def _certificates(report: Report) -> Markup:
    result = report.result
    found: list[tuple[str, dict[str, Any] | None]] = []
    if "combined" in result:
        found += [(f"“{report.parts[k].name}” by itself", own["certificate"]) for k, own in enumerate(result["tasks"])]
        found.append(("The combined program", result["combined"]["certificate"]))
    else:
        found.append(("", result["certificate"]))
    parts: list[Markup] = []
    for name, certificate in found:
        if certificate is None:
            continue
        if name:
            parts.append(tag("h3", name))
        parts += paragraphs_of(certificate_lines(certificate))
        parts += bound_chart(certificate)
    return joined(parts)


def bound_chart(certificate: dict[str, Any]) -> list[Markup]:
    """The bound and the best F known against time."""
    rows = [row for row in certificate["history"] if row[1] is not None and row[2] is not None]
    if len(rows) < 2:
        if not rows:
            return []
        seconds, bound, best = rows[0]
        return [tag("p", f"It took one round: after {seconds:.3g} s the bound was {bound:.7g}, the best F {best:.7g}.")]
    seconds, bounds, best = ([float(row[k]) for row in rows] for k in range(3))
    words = (
        f"The bound goes from {bounds[0]:.7g} after {seconds[0]:.3g} s to {bounds[-1]:.7g} after {seconds[-1]:.3g} s; "
        f"the best F known from {best[0]:.7g} to {best[-1]:.7g}."
    )
    chart = line_chart(
        [Curve(seconds, bounds, "curve", steps=True), Curve(seconds, best, "curve best", steps=True)],
        [Spot(seconds[-1], bounds[-1], "spot", f"bound {bounds[-1]:.7g}")],
        words=words,
        labels=("seconds", "F"),
    )
    return [tag("figure", chart, tag("figcaption", f"Bound (blue) and best point known (orange). {words}"))]


def _published(report: Report) -> Markup:
    if report.check is None:
        return Markup("")
    rows = [
        [
            row.published.quantity,
            ", ".join(f"{value:g}" for value in row.published.value),
            ", ".join(f"{value:.7g}" for value in row.computed) or "none",
            row.verdict,
            row.published.source,
            row.published.because or row.rule,
        ]
        for row in report.check.published
    ]
    headers = ["quantity", "published", "computed", "", "where", "how it is known"]
    return grid(headers, rows, "What the literature prints beside what is computed here", id="compared")


def _origin(report: Report) -> Markup:
    result = report.result
    rows = [[name, text] for name, text in result["versions"].items()]
    rows.append(["seed", str(report.case.search.seed)])
    rows.append(["starts", str(report.case.search.starts)])
    rows.append(["seconds", f"{result['seconds']:.3g}"])
    text = tag("pre", tag("code", report.text, id="case-text"), tabindex="0", aria_label="Case text")
    copy = tag(
        "p",
        tag("button", "Copy the case", type="button", id="copy"),
        " ",
        tag("span", id="copied", role="status"),
        class_="controls script",
    )
    return joined(
        [grid(["", ""], rows, "What the numbers depend on", id="versions"), tag("h3", "Case file"), copy, text]
    )


def paragraphs_of(lines: Any) -> list[Markup]:  # noqa: ANN401 - any lines of text
    """A paragraph for each line of text."""
    return [paragraphs([line]) for line in lines]


def _last_line(group: object) -> list[object]:
    return [*group.renderables[-1:]] if isinstance(group, Group) else [group]


def _point(report: Report) -> dict[str, Any]:
    """Where the robot of the report stands in its result."""
    result = report.result
    if "combined" not in result:
        return result
    combined = result["combined"]
    reached: dict[str, Any] = combined.get("reached") or {}
    return {**combined, **reached}
