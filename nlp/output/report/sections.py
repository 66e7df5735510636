"""Sections of a report as HTML: sentences, tables, and charts with text alternatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...case.case import Case
from ...case.choices import catalogue_dimensions
from ...case.pose import sizes_of_turn
from ...evidence.optimality import CURVED, Evidence
from ...results.data import CertificateData, CombinedData, CombinedResult, SolveResult
from ...results.point import task_data
from ...results.rounding import size_of_F
from ...words.checks import published_table
from ...words.joints import limb_part_table
from ...words.lines import (
    certificate_lines,
    change_lines,
    choice_lines,
    costliest_words,
    counted,
    evidence_lines,
    followed_words,
    headline,
    is_unasked_singularity,
    relaxation_sentences,
    singularity_lines,
    task_words,
    tolerance_line,
)
from ...words.numbers import key_words, number
from ...words.objective import objective_words
from ...words.path import along_table, path_proof_lines
from ...words.robot import combined_design_table, robot_tables, solved_design_table
from ...words.schedule import no_schedule_line, schedule_lines, schedule_table
from ...words.tables import active_table, limit_table, limits_title, margin_table, origin_table, outcome_table
from ...words.text import Line, TextTable
from ...words.workspace import proof_lines, proof_tables
from .charts import Curve, Spot, line_chart
from .exploration import optima, surroundings
from .markup import Markup, beside, caption, image_source, join_markup, paragraphs, tag
from .report import Report
from .robotview import first_still, robot_section
from .tables import html_table


def evidence_section(report: Report) -> Markup:
    """Return the evidence of optimality, which is computed from the nonlinear program only."""
    result = report.result
    if isinstance(result, SolveResult):
        return join_markup(_evidence_of(report.case, result))
    parts: list[Markup] = []
    for part, own in zip(report.parts, result.tasks, strict=True):
        parts += [tag("h3", f"Separate optimum of “{part.name}”"), *_evidence_of(report.case, own)]
    optimality = result.combined.optimality
    if optimality is not None:
        parts += [tag("h3", "Combined tasks"), tag("p", f"Optimality: {optimality.kind.value}.")]
        parts.append(
            _active_table(result.combined, optimality, result.combined.value or 0.0, is_answer=result.status.is_answer)
        )
    return join_markup(parts)


def _evidence_of(case: Case, result: SolveResult) -> Iterator[Markup]:
    """Yield the evidence for the point of one nonlinear program."""
    yield paragraphs(evidence_lines(result, case))
    optimality = result.optimality
    if optimality is None:
        return
    size = 0.0 if result.robot is None else size_of_F(result.robot)
    yield _active_table(result, optimality, size, is_answer=result.status.is_answer)
    if len(optimality.eigenvalues) and result.reached is None:
        values = optimality.eigenvalues
        listed = ", ".join(number(value, 1.0, digits=4, part=CURVED) for value in values)
        yield tag("p", f"Eigenvalues of the reduced Hessian, in scaled variables: {listed}.")


def _active_table(result: SolveResult | CombinedData, optimality: Evidence, size: float, *, is_answer: bool) -> Markup:
    if not optimality.active:
        return tag("p", "No bound or limit is active.")
    table = active_table(result, size, is_answer=is_answer)
    words = {cell for row in table.rows for cell in row}
    states = " and ".join(word for word in ("violated", "active") if word in words)
    multipliers = ": multipliers" if is_answer else ""
    return html_table(table, f"{states} bounds and limits{multipliers}")


def certificate_section(report: Report) -> Markup:
    """Return the certificates: proved bounds, and bound and incumbent over time."""
    result = report.result
    found: list[tuple[str, CertificateData | None]] = []
    if isinstance(result, CombinedResult):
        pairs = zip(report.parts, result.tasks, strict=True)
        found += [(f"Separate optimum of “{part.name}”", own.certificate) for part, own in pairs]
        found.append(("Combined tasks", result.combined.certificate))
    else:
        found.append(("", result.certificate))
    parts: list[Markup] = []
    if report.refusal:
        parts.append(tag("p", f"No certificate: {report.refusal}.", class_="warning"))
    for name, certificate in found:
        if certificate is None:
            continue
        if name:
            parts.append(tag("h3", name))
        parts.append(paragraphs(certificate_lines(certificate)))
        parts += bound_chart(certificate.history)
    return join_markup(parts)


def workspace_section(report: Report) -> Markup:
    """Return the proof of the design over its workspace; empty without limits over the workspace."""
    result = report.result
    if result.workspace is None:
        return Markup("")
    tables = (
        html_table(each, each.title, id=f"workspace-{each.name}")
        for each in proof_tables(report.case, result.workspace)
    )
    return join_markup([paragraphs(proof_lines(result.workspace)), *tables])


def path_section(report: Report) -> Markup:
    """Return the proof of the design along its tool path; empty without limits along a path."""
    result = report.result
    if result.path is None:
        return Markup("")
    lines = path_proof_lines(report.case, result.path)
    tables = along_table(report.case, [each for each in result.path.claims if each.limit is not None])
    return join_markup([paragraphs(lines), *(html_table(each, each.title, id=f"path-{each.name}") for each in tables)])


def bound_chart(history: Sequence[Sequence[float]]) -> list[Markup]:
    """Return a chart of the bound and the incumbent against time, from a history of (seconds, bound, incumbent)."""
    if not history:
        return []
    if len(history) == 1:
        ((after, bound, found),) = history
        return [tag("p", f"One step: after {after:.3g} s the bound was {bound:.7g} and the best known F {found:.7g}.")]
    seconds, bounds, best = ([row[k] for row in history] for k in range(3))
    words = (
        f"Bound: {bounds[0]:.7g} after {seconds[0]:.3g} s, {bounds[-1]:.7g} after {seconds[-1]:.3g} s. "
        f"Best known F: {best[0]:.7g}, then {best[-1]:.7g}."
    )
    chart = line_chart(
        [Curve(seconds, bounds, "curve", steps=True), Curve(seconds, best, "curve best", steps=True)],
        [Spot(seconds[-1], bounds[-1], "spot", f"bound {bounds[-1]:.7g}")],
        words=words,
        labels=("time, s", "F"),
    )
    what = f"proved bound (blue) and best known F (orange). {words}"
    return [tag("figure", chart, caption("Bound over time", what))]


def published_section(report: Report) -> Markup:
    """Return the table of published and computed values."""
    if report.check is None:
        return Markup("")
    return html_table(published_table(report.check), "Published and computed values", id="compared")


def sections(report: Report, *, is_live: bool = False) -> list[tuple[str, str, Markup]]:
    """Return anchor, heading and content of every section; some have no content.

    The order answers a reader's questions: the problem, the design, its evidence, its limits, alternatives, and the
    data to repeat the solve. A live view replaces the 3-D view. Without it, the robot and its dimensions come first.
    """
    # The robot of a schedule is that at the first point of the path.
    first = "" if report.case.over_path is None else " at the first point of the path"
    problem = [
        ("case", "Problem", _case(report)),
        ("schedule", "Schedule along the path", _schedule(report)),
    ]
    design = [
        ("robot", f"Robot and task motion{first}", robot_section(report, is_live=is_live)),
        ("result", f"Result{first}", _result(report)),
    ]
    return [
        *(problem if is_live else design),
        *(design if is_live else problem),
        ("evidence", "Evidence of optimality", evidence_section(report)),
        ("certificate", "Certificate of the global optimum", certificate_section(report)),
        ("workspace", "Proof over the workspace", workspace_section(report)),
        ("path", "Proof along the path", path_section(report)),
        ("limits", f"Limits and margins{first}", _limits(report)),
        ("optima", "Local optima", optima(report)),
        ("around", "F near the design", surroundings(report)),
        ("published", "Comparison with published values", published_section(report)),
        ("origin", "Case file and versions", _origin(report)),
    ]


def first_screen(report: Report) -> Markup:
    """Return the robot and the table of its dimensions, which a live view replaces."""
    result = report.result
    robot = result.robot
    if robot is None:
        return first_still(report)
    if isinstance(result, CombinedResult):
        table = combined_design_table(report.case, result.combined, robot)
    else:
        table = solved_design_table(report.case, result, robot)
    return beside(first_still(report), html_table(table, _design_words(report)))


def _design_words(report: Report) -> str:
    """Return the caption of the table of dimensions."""
    return "Dimensions and pose" if report.is_answer else "Final point of the search, not an optimum"


def answer(report: Report) -> Markup:
    """Return the result for the top of the page, or the status of a solve without an optimum."""
    result = report.result
    if isinstance(result, SolveResult):
        lines = [headline(result, report.case).words] if report.case.over_path is None else _schedule_answer(report)
    else:
        combined = result.combined
        value = "" if combined.value is None else f", value {number(combined.value)}"
        tasks = f"{len(report.parts)} tasks, combined by {combined.method.value}"
        lines = [f"{tasks}: {result.status.value}{value}"]
        if not report.is_answer:
            lines.append("This is not an optimum: the page shows the final point of the search.")
    kind = "answer" if report.is_answer else "answer none"
    robot = report.result.robot
    if report.is_answer and is_unasked_singularity(robot, report.case):
        kind = "answer singular"
        if robot is not None and isinstance(result, CombinedResult):
            lines.append(f"The robot is singular: rank {robot.rank}.")
    return tag("div", paragraphs(lines), class_=kind, id="answer")


def _schedule_answer(report: Report) -> list[str]:
    """Return the objective over the path with its gain, or that no schedule was found."""
    result = report.result
    if isinstance(result, CombinedResult) or result.schedule is None:
        return [no_schedule_line(report.case).words]
    first = next(each for each in schedule_lines(report.case, result.schedule) if isinstance(each, Line))
    return [f"{first.words}{first.after}"]


def _schedule(report: Report) -> Markup:
    """Return the schedule: its evidence, map and rates, and its points; empty without a schedule."""
    result = report.result
    if isinstance(result, CombinedResult) or result.schedule is None:
        return Markup("")
    found = [*schedule_lines(report.case, result.schedule)]
    parts = [paragraphs(each for each in found if isinstance(each, Line))]
    if report.schedule:
        names = ", ".join(result.schedule.names)
        name = f"Schedule of {names} along the path"
        words = "objective with the schedule and the best constant, and rates below it"
        image = tag("img", src=image_source(report.schedule), alt=f"{name}: {words}")
        parts.append(tag("figure", image, caption(name, words)))
    parts += [html_table(each, each.name.capitalize()) for each in found if isinstance(each, TextTable)]
    if result.schedule.names:
        parts.append(html_table(schedule_table(result.schedule), "Points of the path", id="points"))
    return join_markup(parts)


def _objective_lines(case: Case) -> Iterator[str]:
    """Yield the objective: F of each task, or a quantity of the actuators."""
    measured = objective_words(case)
    if measured:
        yield f"F is {measured}."
    if case.tasks[0].measure:
        return
    for k, task in enumerate(case.tasks):
        word = {"max": "as large as possible", "min": "as small as possible"}[task.sense.value]
        motion = followed_words(task) if task.follows else task_words(task_data(case, k), case.units)
        yield f"Task “{task.name}”: F {word} for a {motion}."
    yield "F is the sum of the squared rates at which the limbs' unit wrenches do work in the task's motion."


def _poses_line(case: Case) -> str:
    """Return the combination of F over the poses of a case, and the shown pose."""
    is_measured = bool(case.tasks[0].measure)
    over = "largest" if is_measured else case.over_poses.value
    shown = "The picture begins" if is_measured else "The picture and its rates begin"
    return f"Poses: {case.poses_per_task}; F is their {over}. {shown} with the first pose; a slider selects the others."


def _variable_lines(case: Case, names: list[str]) -> list[str]:
    """Return sentences on the variables of a case, or on the settings of a schedule."""
    if names:
        lines = [f"{counted(len(names), 'variable')}: {', '.join(names)}. All other parameters are fixed."]
        turns = [pose.rotation for pose in case.poses if pose.rotation.axis is None]
        if any(sizes_of_turn(turn.angle)[1] > 0 for turn in turns):
            lines.append("q is the vector part of the unit quaternion of the platform's rotation.")
        return lines
    if case.settings:
        return [f"Settings that change along the path: {', '.join(case.settings)}."]
    return ["No variables: the robot is evaluated at the stated dimensions and pose."]


def _case(report: Report) -> Markup:
    """Return the problem of the case in sentences."""
    case, first = report.case, report.parts[0]
    words = case.model.description
    lines = [f"{words[:1].upper()}{words[1:]}.", *(f"Note: {remark}." for remark in case.model.remarks)]
    lines += _objective_lines(case)
    if len(case.tasks) > 1:
        lines.append(f"Method that combines the tasks: {case.method.value}.")
    program = first.nlp.program
    # The epigraph variable and the joint coordinates of closed loops are not variables of the case.
    internal = set(program.places.inner)
    if program.places.epigraph is not None:
        internal.add(program.places.epigraph.level)
    free = () if first.nlp.is_fixed else enumerate(program.variables)
    names = [variable.name for k, variable in free if k not in internal]
    chosen = [each.name for each in catalogue_dimensions(case)]
    if chosen:
        lines.append(f"Variables with listed values: {', '.join(chosen)}.")
    lines += _variable_lines(case, names)
    if case.changes:
        lines.append(f"Set for each task: {', '.join(case.changes)}.")
    if case.poses_per_task > 1:
        lines.append(_poses_line(case))
    limits = report.result.limits
    if limits:
        listed = ", ".join(f"{key_words(f'limits.{row.key}')} {row.limit:g} {row.unit}".strip() for row in limits)
        lines.append(f"Limits: {listed}.")
    search = case.search
    if names:
        lines.append(f"Search: {counted(search.starts, 'starting point')}, seed {search.seed}.")
    return tag("div", paragraphs(lines), class_="prose")


def _result(report: Report) -> Markup:
    """Return the design, and the tables of its robot."""
    result = report.result
    if isinstance(result, CombinedResult):
        return _combined_result(report, result)
    sentences = [f"It would be {each.removeprefix('would be ')}." for each in relaxation_sentences(result, report.case)]
    chosen = paragraphs(choice_lines(result.choice, result.rounding, is_answer=report.is_answer))
    return join_markup([chosen, *_task_tables(report.case, result, "design"), paragraphs(sentences)])


def _combined_result(report: Report, result: CombinedResult) -> Markup:
    """Return the design for the combined tasks, then the separate optimum of each task."""
    case, combined = report.case, result.combined
    parts = [paragraphs(choice_lines(result.choice, result.rounding, is_answer=report.is_answer))]
    robot, tables, ranks = result.robot, [], []
    if robot is not None:
        tables.append(html_table(combined_design_table(case, combined, robot), _design_words(report), id="design"))
        ranks = [paragraphs(singularity_lines(each, case.units)) for each in combined.settings or [robot]]
    if combined.tasks:
        outcomes = outcome_table(combined, result.tasks)
        tables.append(html_table(outcomes, "Tasks: F at this point and separately", id="outcomes"))
    parts += [beside(*tables), *ranks]
    parts.append(paragraphs(change_lines(result)))
    parts += [tag("p", f"Note: {notice}.") for notice in combined.notices]
    parts += [tag("p", f"Violated: {name}", class_="warning") for name in combined.violated]
    for k, own in enumerate(result.tasks):
        parts.append(tag("h3", f"Separate optimum of “{report.parts[k].name}”"))
        parts.append(paragraphs([headline(own, case)]))
        parts += _task_tables(case.of_task(k) if case.changes else case, own, f"design-{k + 1}")
    return join_markup(parts)


def _task_tables(case: Case, result: SolveResult, anchor: str) -> list[Markup]:
    """Return the tables of the result of one task."""
    robot, reached = result.robot, result.reached is not None
    if robot is None:
        return [tag("p", "The robot does not exist at the final point of the search.", class_="warning")]
    words = "Final point of the search" if reached else "Dimensions and pose"
    design = html_table(solved_design_table(case, result, robot), words, id=anchor)
    first, *others = robot_tables(case, robot)
    words = "Limbs" if robot.several is None else "Poses"
    parts = [beside(design, html_table(first, words, id=f"{anchor}-{first.name}"))]
    for table in others:
        words = f"{table.name.replace('-', ' ').capitalize()} by pose and limb"
        parts.append(tag("details", tag("summary", words), html_table(table, words, id=f"{anchor}-{table.name}")))
    parts_by_limb = limb_part_table(case, robot)
    if parts_by_limb is not None:
        parts.append(html_table(parts_by_limb, "Actuation and constraint parts of F by limb", id=f"{anchor}-actuation"))
    if not reached:
        parts.append(paragraphs(singularity_lines(robot, case.units)))
    return parts


def _limits(report: Report) -> Markup:
    """Return the limits with their effect on F, and all margins."""
    limits, margins = report.result.limits, report.result.margins
    if not limits:
        return Markup("")
    words = "Limits: margin and effect on F"
    held = limits_title(report.case, report.result.workspace or report.result.path)
    words += f", {held}" if held else ""
    robot = report.result.robot
    size = 0.0 if robot is None else size_of_F(robot, report.result.F or 0.0)
    parts = [html_table(limit_table(limits, size), words, id="limit")]
    costliest = costliest_words(limits, in_words=True)
    if costliest is not None:
        parts.append(tag("p", costliest))
    result = report.result
    if isinstance(result, SolveResult) and result.tolerance is not None:
        parts.append(paragraphs([tolerance_line(result.tolerance, result.F, report.case.units)]))
    every = html_table(margin_table(margins), "All margins: positive within the limit")
    parts.append(tag("details", tag("summary", f"All margins ({len(margins)})"), every))
    return join_markup(parts)


def _origin(report: Report) -> Markup:
    """Return versions, search settings, and the case file."""
    result = report.result
    origin = origin_table(result.versions, report.case.search, result.seconds)
    text = tag("pre", tag("code", report.text, id="case-text"), tabindex="0", aria_label="Case file", class_="file")
    copy = tag(
        "p",
        tag("button", "Copy case file", type="button", id="copy"),
        " ",
        tag("span", id="copied", role="status"),
        class_="controls script",
    )
    case = tag("div", tag("h3", "Case file"), copy, text, class_="fill")
    return beside(html_table(origin, "Versions and search settings", id="versions"), case)
