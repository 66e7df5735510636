"""A report as sections of HTML: words and tables, and a chart with its text alternative where one helps."""

from __future__ import annotations

from typing import Any

from rich.console import Group

from ...program.places import FreeRotation
from ...results.data import motion_of
from ..pictures.style import RATE_COLOURS
from ..terminal import (
    design_table,
    headline,
    limb_table,
    limit_table,
    motion_words,
    outcome_table,
    pose_table,
    singularity_lines,
    tolerance_line,
)
from .exploration import around, optima
from .frames import ViewData
from .judgement import certificates, evidence_section, published
from .markup import Markup, grid, html_table, joined, paragraphs, paragraphs_of, tag
from .report import Report


def sections(report: Report) -> list[tuple[str, str, Markup]]:
    """Every section that has something to show: its anchor, its heading and its content."""
    found = [
        ("case", "The case in words", _case(report)),
        ("robot", "The robot and its motion", _robot(report)),
        ("result", "Result", _result(report)),
        ("limits", "Limits: margins and costs", _limits(report)),
        ("optima", "Optima found", optima(report)),
        ("around", "F around this point", around(report)),
        ("evidence", "Evidence of optimality", evidence_section(report)),
        ("certificate", "Certificate", certificates(report)),
        ("published", "Published and computed", published(report)),
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
    program = first.nlp.program
    level = None if program.places.epigraph is None else program.places.epigraph.level
    names = [variable.name for k, variable in enumerate(program.variables) if k != level]
    if names:
        plural = "numbers are" if len(names) > 1 else "number is"
        lines.append(f"{len(names)} {plural} free: {', '.join(names)}. Everything else is fixed.")
        if any(isinstance(rotation, FreeRotation) for rotation in program.places.rotations):
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


def _legend(view: ViewData) -> Markup:
    gradient = f"background:linear-gradient(90deg,{','.join(RATE_COLOURS)})"
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


def _rates(view: ViewData) -> Markup:
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
