"""Sections of a report as HTML: words, tables, and charts with text alternatives."""

from __future__ import annotations

from ...case.case import Case
from ...case.pose import sizes_of_turn
from ...results.data import CombinedResult, SolveResult
from ...results.designtable import combined_design_table, solved_design_table
from ...results.jointwording import limb_part_table
from ...results.point import task_data
from ...results.robottables import robot_tables
from ...results.rounding import number, size_of_F
from ...results.tables import limit_table, limits_title, margin_table, origin_table, outcome_table
from ...results.wording import (
    costliest_words,
    counted,
    headline,
    is_unasked_singularity,
    relaxation_words,
    singularity_lines,
    task_words,
    tolerance_line,
)
from .exploration import optima, surroundings
from .judgement import certificate_section, evidence_section, published_section, workspace_section
from .markup import Markup, html_table, join_markup, paragraphs, tag
from .report import Report
from .robotview import robot_section


def sections(report: Report) -> list[tuple[str, str, Markup]]:
    """Return the anchor, heading and content of every section; some have no content."""
    return [
        ("case", "The case in words", _case(report)),
        ("robot", "The robot and its motion", robot_section(report)),
        ("result", "Result", _result(report)),
        ("limits", "Limits: margins and costs", _limits(report)),
        ("optima", "Optima found", optima(report)),
        ("around", "F around this point", surroundings(report)),
        ("evidence", "Evidence of optimality", evidence_section(report)),
        ("certificate", "Certificate", certificate_section(report)),
        ("workspace", "Workspace", workspace_section(report)),
        ("published", "Published and computed", published_section(report)),
        ("origin", "Case text and versions", _origin(report)),
    ]


def answer(report: Report) -> Markup:
    """Return the answer for the top of the page, or the sentence that there is no answer."""
    result = report.result
    if isinstance(result, SolveResult):
        lines = [headline(result, report.case).words]
    else:
        combined = result.combined
        value = "" if combined.value is None else f", value {number(combined.value)}"
        tasks = f"{len(report.parts)} tasks, combined by {combined.method.value}"
        lines = [f"{tasks}: {result.status.value}{value}"]
        if not report.is_answer:
            lines.append("This is no answer: what was reached is shown below.")
    kind = "answer" if report.is_answer else "answer none"
    robot = report.result.robot
    if report.is_answer and is_unasked_singularity(robot, report.case):
        kind = "answer singular"
        if robot is not None and isinstance(result, CombinedResult):
            lines.append(f"The robot is singular: rank {robot.rank}.")
    return tag("div", paragraphs(lines), class_=kind, id="answer")


def _case(report: Report) -> Markup:
    """Return the case in words."""
    case, first = report.case, report.parts[0]
    lines = [f"{case.model.description}.", *(f"Note: {remark}." for remark in case.model.remarks)]
    for k, task in enumerate(case.tasks):
        word = {"max": "as large as possible", "min": "as small as possible"}[task.sense.value]
        lines.append(f"Task “{task.name}”: make F {word} for a {task_words(task_data(case, k), case.units)}.")
    lines.append(
        "F is the sum of the squares of the rates at which the limbs' unit wrenches do work in the task's motion."
    )
    if len(case.tasks) > 1:
        lines.append(f"The tasks are brought together by the method {case.method.value}.")
    program = first.nlp.program
    # The epigraph's level and the joint positions that close the loops are the program's, not the case's.
    internal = set(program.places.inner)
    if program.places.epigraph is not None:
        internal.add(program.places.epigraph.level)
    free = () if first.nlp.is_fixed else enumerate(program.variables)
    names = [variable.name for k, variable in free if k not in internal]
    if names:
        plural = "numbers are" if len(names) > 1 else "number is"
        lines.append(f"{len(names)} {plural} free: {', '.join(names)}. Everything else is fixed.")
        turns = [pose.rotation for pose in case.poses if pose.rotation.axis is None]
        if any(sizes_of_turn(turn.angle)[1] > 0 for turn in turns):
            lines.append("q is the vector part of the unit quaternion that turns the platform.")
    else:
        lines.append("Nothing is free: the robot is evaluated where it stands.")
    if case.pose_count > 1:
        lines.append(
            f"The robot works at {case.pose_count} poses; F is their {case.over_poses.value}. "
            "The picture and its rates begin with the first; a slider shows each."
        )
    limits = report.result.limits
    if limits:
        listed = ", ".join(f"{row.key} {row.limit:g} {row.unit}".strip() for row in limits)
        lines.append(f"Limits: {listed}.")
    search = case.search
    if names:
        lines.append(f"Searched from {counted(search.starts, 'starting point')}, seed {search.seed}.")
    return paragraphs(lines)


def _result(report: Report) -> Markup:
    """Return the design, and the tables of its robot."""
    result = report.result
    if isinstance(result, CombinedResult):
        return _combined_result(report, result)
    sentences = [f"It would be {relaxation_words(row)}." for row in result.relaxation or ()]
    return join_markup([*_task_tables(report.case, result, "design"), paragraphs(sentences)])


def _combined_result(report: Report, result: CombinedResult) -> Markup:
    """Return the design at the combined point, then each task by itself."""
    case, combined = report.case, result.combined
    parts: list[Markup] = []
    robot = result.robot
    if robot is not None:
        words = "The combined robot" if report.is_answer else "What was reached; this is no answer"
        parts.append(html_table(combined_design_table(case, combined, robot), words, id="design"))
        parts.append(paragraphs(singularity_lines(robot, case.units)))
    if combined.tasks:
        parts.append(html_table(outcome_table(combined, result.tasks), "What it means for each task", id="outcomes"))
    parts += [tag("p", f"Note: {notice}.") for notice in combined.notices]
    parts += [tag("p", f"Violated: {name}", class_="warning") for name in combined.violated]
    for k, own in enumerate(result.tasks):
        parts.append(tag("h3", f"“{report.parts[k].name}” by itself"))
        parts.append(paragraphs([headline(own, case)]))
        parts += _task_tables(case, own, f"design-{k + 1}")
    return join_markup(parts)


def _task_tables(case: Case, result: SolveResult, anchor: str) -> list[Markup]:
    """Return the tables of one task's result."""
    robot, reached = result.robot, result.reached is not None
    if robot is None:
        return [tag("p", "The robot does not exist at the point reached.", class_="warning")]
    caption = "What was reached" if reached else "Dimensions and pose"
    parts = [html_table(solved_design_table(case, result, robot), caption, id=anchor)]
    first, *others = robot_tables(case, robot)
    caption = "Limbs" if robot.several is None else "The robot at every pose"
    parts.append(html_table(first, caption, id=f"{anchor}-{first.name}"))
    for table in others:
        caption = f"{table.name.replace('-', ' ').capitalize()} by pose and limb"
        parts.append(tag("details", tag("summary", caption), html_table(table, caption, id=f"{anchor}-{table.name}")))
    parts_by_limb = limb_part_table(case, robot)
    if parts_by_limb is not None:
        parts.append(
            html_table(parts_by_limb, "Actuation and constraints in F, limb by limb", id=f"{anchor}-actuation")
        )
    if not reached:
        parts.append(paragraphs(singularity_lines(robot, case.units)))
    return parts


def _limits(report: Report) -> Markup:
    """Return the limits with their costs, and every margin."""
    limits, margins = report.result.limits, report.result.margins
    if not limits:
        return Markup("")
    caption = "How near the robot comes to each limit, and what the limit costs"
    proof = report.result.workspace if isinstance(report.result, SolveResult) else None
    held = limits_title(report.case, proof)
    caption += f": {held}" if held else ""
    robot = report.result.robot
    size = 0.0 if robot is None else size_of_F(robot, report.result.F or 0.0)
    parts = [html_table(limit_table(limits, size), caption, id="limit")]
    costliest = costliest_words(limits)
    if costliest is not None:
        parts.append(tag("p", costliest))
    result = report.result
    if isinstance(result, SolveResult) and result.tolerance is not None:
        parts.append(paragraphs([tolerance_line(result.tolerance, result.F, report.case.units)]))
    every = html_table(margin_table(margins), "Every margin, positive inside")
    parts.append(tag("details", tag("summary", f"Every margin ({len(margins)})"), every))
    return join_markup(parts)


def _origin(report: Report) -> Markup:
    """Return versions, settings of the search, and the text of the case."""
    result = report.result
    origin = origin_table(result.versions, report.case.search, result.seconds)
    text = tag("pre", tag("code", report.text, id="case-text"), tabindex="0", aria_label="Case text")
    copy = tag(
        "p",
        tag("button", "Copy the case", type="button", id="copy"),
        " ",
        tag("span", id="copied", role="status"),
        class_="controls script",
    )
    return join_markup(
        [html_table(origin, "What the numbers depend on", id="versions"), tag("h3", "Case file"), copy, text]
    )
