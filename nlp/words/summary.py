"""Summaries of results for a terminal, as lines and tables; the tables of a result by name.

A summary has the answer, the evidence, the design with its active limits, and sections for a longer view.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from ..case.case import Case
from ..case.names import name_of_task
from ..evidence.state import ZERO_F
from ..results.data import CombinedResult
from ..results.rounding import robot_size, size_of_F
from ..units import objective_unit
from .joints import limb_part_table
from .lines import (
    active_limit_lines,
    certificate_lines,
    change_lines,
    check_lines,
    choice_lines,
    combined_lines,
    combined_value_lines,
    exclusion_lines,
    fault_lines,
    heading_lines,
    is_unasked_singularity,
    objective_lines,
    optimality_line,
    singularity_lines,
    starts_caution,
    starts_lines,
    task_lines,
    title_line,
    tolerance_line,
    violation_lines,
)
from .loads import loading_tables
from .numbers import listed, number
from .robot import (
    combined_design_table,
    design_table,
    jacobian_table,
    plural_name,
    robot_table,
    robot_tables,
    robot_tables_by_limb,
    solved_design_table,
)
from .tables import limit_table, limits_title, margin_table, outcome_table, principal_table
from .text import Line, TextTable, Tone, in_part

if TYPE_CHECKING:
    from ..evidence.margins import Margin
    from ..evidence.principal_motions import TaskAnalysis
    from ..results.data import CaseResult, SolveResult
    from ..results.evaluation import EvaluationResult
    from ..results.evidence import CertifiedResult
    from ..results.parts import RobotData

#: Tables of a whole solve, which a robot at its poses lacks.
_OF_DESIGN = ("design", "limits", "margins", "actuation")

Summary: TypeAlias = Iterator[Line | TextTable]


def case_summary(case: Case, result: CaseResult) -> Summary:
    """Yield the result of a solve, of one task or of several."""
    return _combined_summary(case, result) if isinstance(result, CombinedResult) else _task_summary(case, result)


def _task_summary(case: Case, result: SolveResult) -> Summary:
    """Yield F, the evidence, the design and the active limits of a solve of one task; then the sections behind them."""
    if case.over_path is not None:
        yield from _schedule_summary(case, result)
        return
    robot = result.robot
    yield from heading_lines(case, result)
    yield from choice_lines(result.choice, result.rounding, is_answer=result.F is not None)
    yield from fault_lines(result, case)
    if result.F is None:
        yield from starts_lines(result.starts, robot)
        if case.limits_over == "workspace" and case.outside_workspace is not None:
            yield Line(case.outside_workspace.sentence, label="note")
    elif (caution := starts_caution(result.starts)) is not None:
        yield caution
    yield from _proof_lines(case, result)
    if result.optimality is not None:
        yield optimality_line(result.optimality)
    yield from certificate_lines(result.certificate)
    if robot is not None and result.reached is None:
        yield from singularity_lines(robot, case.units)
        yield from exclusion_lines(case, robot)
    yield from _remark_lines(case)
    if robot is not None:
        yield solved_design_table(case, result, robot)
    yield from active_limit_lines(result.limits, limits_title(case, result.workspace or result.path))
    yield from _task_parts(case, result)


def _schedule_summary(case: Case, result: SolveResult) -> Summary:
    """Yield the objective over the path with its bound, the settings and the design; then the schedule."""
    # Few cases have a schedule.
    from .schedule import no_schedule_line, schedule_lines, schedule_table, schedule_task_lines  # noqa: PLC0415

    yield title_line(case)
    yield from schedule_task_lines(case)
    if result.schedule is None:
        yield no_schedule_line(case)
        return
    yield from schedule_lines(case, result.schedule)
    if result.schedule.names:
        yield schedule_table(result.schedule)


def _task_parts(case: Case, result: SolveResult) -> Summary:
    """Yield the sections after the answer of a solve of one task."""
    robot = result.robot
    if robot is not None:
        yield from in_part("limbs" if robot.several is None else "poses", [robot_table(case, robot)])
    yield from in_part("evidence", check_lines(result))
    if result.F is not None:
        yield from in_part("starts", starts_lines(result.starts, robot))
    if robot is not None:
        yield from in_part("poses by limb", robot_tables_by_limb(case, robot))
        yield from in_part("forces", loading_tables(case, robot))
    if result.limits:
        size = 0.0 if robot is None else size_of_F(robot)
        title = limits_title(case, result.workspace or result.path)
        yield from in_part("limits", [limit_table(result.limits, size, title)])
    if result.tolerance is not None:
        yield from in_part("tolerance", [tolerance_line(result.tolerance, result.F, case.units)])
    yield from in_part("smallest margins", _proof_digest(result))
    if robot is not None and result.reached is None:
        yield from in_part("actuation", _limb_parts(case, robot))


def _proof_lines(case: Case, result: CaseResult) -> Iterator[Line]:
    """Yield the proof of a design over a workspace, or along a path."""
    if result.workspace is not None:
        # Few cases have a proof, and these modules load the rooms of proofs.
        from .verdicts import tolerance_lines  # noqa: PLC0415
        from .workspace import proof_lines  # noqa: PLC0415

        yield from proof_lines(result.workspace)
        yield from tolerance_lines(case, result.workspace.joint_centre)
    if result.path is not None:
        from .path import path_proof_lines  # noqa: PLC0415 - in the same way

        yield from path_proof_lines(case, result.path)


def _proof_digest(result: CaseResult) -> Summary:
    """Yield the limits with the smallest margin in the proof of a design."""
    if result.workspace is not None:
        from .verdicts import tightest_table  # noqa: PLC0415 - as above

        yield from tightest_table(result.workspace.extremes)
    if result.path is not None:
        from .path import tightest_along  # noqa: PLC0415 - as above

        yield from tightest_along(result.path)


def _combined_summary(case: Case, result: CombinedResult) -> Summary:
    """Yield the result of a solve of several tasks."""
    combined, point = result.combined, result.combined.method_point
    robot = None if point is None else point.robot
    yield title_line(case)
    for own in result.tasks:
        if own.robot is not None and own.robot.task is not None:
            yield from task_lines(own.robot.task, case.units)
    yield from combined_lines(result)
    yield outcome_table(combined, result.tasks)
    yield from choice_lines(result.choice, result.rounding, is_answer=point is not None)
    if combined.starts is not None and (caution := starts_caution(combined.starts)) is not None:
        yield caution
    yield from _proof_lines(case, result)
    yield from combined_value_lines(combined)
    yield from change_lines(result)
    for task in result.tasks:
        name = task.robot.task.name if task.robot is not None and task.robot.task is not None else None
        yield from _named(certificate_lines(task.certificate), name)
    yield from certificate_lines(combined.certificate)
    yield from _remark_lines(case)
    if robot is not None:
        yield combined_design_table(case, combined, robot)
    if point is not None:
        yield from active_limit_lines(point.limits or (), limits_title(case, result.workspace or result.path))
    yield from in_part("notes", (Line(notice, label="note") for notice in combined.notices))
    advice: dict[str, Line] = {}
    for each in combined.settings or ([] if robot is None else [robot]):
        part = "" if is_unasked_singularity(each, case) else "rank"
        name = each.task.name if each.task is not None and combined.settings else None
        yield from in_part(part, _named(singularity_lines(each, case.units), name))
        advice |= {line.text: line for line in exclusion_lines(case, each)}
    yield from advice.values()
    if point is not None and point.limits:
        title = limits_title(case, result.workspace or result.path)
        yield from in_part("limits", [limit_table(point.limits, combined.value or 0.0, title)])
    yield from in_part("smallest margins", _proof_digest(result))


def certified_summary(case: Case, result: CertifiedResult) -> Summary:
    """Yield the proved bounds of a case."""
    several = len(result.tasks) > 1
    yield title_line(case)
    yield from objective_lines(case)
    if result.notice is not None:
        yield Line(result.notice, label="note", tone=Tone.CAUTION)
    yield from choice_lines(result.choice)
    for task in result.tasks:
        if several:
            yield Line(f"{task.name}, {task.sense.value} F", label="task")
        yield from _named(certificate_lines(task.certificate), task.name if several else None)
    if several and result.certificate is not None:
        yield Line(case.method.value, label="tasks combined by")
        yield from certificate_lines(result.certificate)


def _named(lines: Iterable[Line], name: str | None) -> Iterator[Line]:
    """Yield lines about a task; with the name of the task if there are several tasks."""
    return (line if name is None else replace(line, text=f"{name}: {line.text}") for line in lines)


def evaluation_summary(case: Case, result: EvaluationResult) -> Summary:
    """Yield F, the violated limits and the rank of J at one point; then the sections, with the Jacobian."""
    robot = result.robot
    yield title_line(case)
    if result.objective is not None:
        yield from objective_lines(case)
        yield Line(f"{number(result.F)} {result.objective.unit}", label="F")
    for each in result.tasks:
        yield from task_lines(each.task, case.units)
        is_free = each.task_is_free and robot.several is None
        value = number(0.0 if is_free else each.F, size_of_F(robot, task=each.task), part=ZERO_F)
        yield Line(f"{value} {objective_unit([each.task.motion.twist], case.units)}".rstrip(), label="F")
    yield from violation_lines(result.violated)
    if result.limits:
        kept = sum(not row.violated for row in result.limits)
        where = f"; {limits_title(case)}" if limits_title(case) else ""
        tone = Tone.HOLDS if kept == len(result.limits) else Tone.FAULT
        yield Line(f"{kept} of {len(result.limits)} satisfied", label="limits", tone=tone, after=where)
    settings = result.settings or (robot,)
    for own in settings:
        name = own.task.name if own.task is not None and result.settings else None
        yield from _named(singularity_lines(own, case.units), name)
    yield from _remark_lines(case)
    yield from in_part("design", [design_table(case, robot, settings=result.settings or ())])
    limits = [limit_table(result.limits, size_of_F(robot), limits_title(case))] if result.limits else []
    if not result.settings:
        yield from _evaluated_robot(case, robot, result.principal_motions, limits)
        return
    yield from in_part("limits", limits)
    for k, (own, task) in enumerate(zip(settings, result.tasks, strict=True)):
        if task.principal_motions is not None:
            parts = _evaluated_robot(case.of_task(k), own, task.principal_motions)
            yield from (_of_task(item, k, own) for item in parts)


def _of_task(item: Line | TextTable, task: int, robot: RobotData) -> Line | TextTable:
    """Return a line or table of one task's robot, with the name of the task."""
    name = "" if robot.task is None else robot.task.name
    if isinstance(item, Line):
        return replace(item, text=f"{name}: {item.text}")
    return replace(item, name=name_of_task(item.name, task), title=f"{item.title}, {name}" if item.title else name)


def _evaluated_robot(case: Case, robot: RobotData, motions: TaskAnalysis, limits: Sequence[TextTable] = ()) -> Summary:
    """Yield the sections of a robot at one point, with the table of limits among them."""
    yield from in_part("limbs" if robot.several is None else "poses", [robot_table(case, robot)])
    yield from in_part("poses by limb", robot_tables_by_limb(case, robot))
    yield from in_part("forces", loading_tables(case, robot))
    yield from in_part("limits", limits)
    yield from in_part("J", [jacobian_table(case, robot)])
    # Singular values beyond the rank are 0: their computed values are rounding error.
    values = (value if k < robot.rank else 0.0 for k, value in enumerate(robot.singular_values))
    yield from in_part("singular values", [Line(listed(values), label="singular values")])
    yield from in_part("motions", [principal_table(motions, case.units, robot_size(robot))])
    yield from in_part("actuation", _limb_parts(case, robot))


def _limb_parts(case: Case, robot: RobotData) -> Summary:
    """Yield actuation and constraint wrenches by limb, if constraint wrenches contribute to F."""
    table = limb_part_table(case, robot)
    if table is not None and robot.joints is not None and robot.joints.constrained:
        yield table


def _remark_lines(case: Case) -> Summary:
    """Yield remarks on possible mistakes in the robot."""
    for remark in case.model.remarks:
        yield Line(remark, label="note")


def table_names(case: Case, *, at_point: bool) -> tuple[str, ...]:
    """Return the names of the tables that a result of a case can have.

    Args:
        case: the case.
        at_point: If true, the case is evaluated at a point, not solved.
    """
    if case.changes:
        several = range(len(case.tasks))
        own = [name for name in table_names(case.of_task(0), at_point=at_point) if name not in _OF_DESIGN]
        own += ["actuation"] if at_point and case.model.generic is not None else []
        shared = ["limits", "margins"] if case.limits else []
        return (
            "design",
            *(name_of_task(name, k) for k in several for name in own),
            *shared,
            *([] if at_point else ["tasks"]),
        )
    names = ["design"]
    if case.poses_per_task == 1:
        names.append("limbs")
    else:
        names += ["poses", *(["rates"] if at_point or len(case.tasks) == 1 else [])]
        measured = [item.name for item in case.model.quantities]
        # Leg lengths that are no quantity of the model are shown where the case limits them.
        measured += [each.name for each in case.limits if each.name == "leg_length"]
        names += [plural_name(name) for name in dict.fromkeys(measured)]
    if case.loading.loads:
        names.append("forces")
        names += ["deflections"] if case.loading.stiffness is not None else []
    if case.loading.motion is not None:
        names.append("speeds")
    if case.model.generic is not None and (at_point or len(case.tasks) == 1):
        names.append("actuation")
    if case.limits:
        names += ["limits", "margins"]
    if at_point:
        return (*names, "jacobian", "motions")
    return tuple(names) if len(case.tasks) == 1 else (*names, "tasks")


def case_tables(case: Case, result: CaseResult) -> Iterator[TextTable]:
    """Yield the tables of a solve: the tables of its summary, then every margin."""
    yield from _tables(case_summary(case, result))
    if not isinstance(result, CombinedResult) and result.robot is not None:
        yield from _limb_parts_left_out(case, result.robot, is_shown=result.reached is None)
    if isinstance(result, CombinedResult) and result.robot is not None:
        if result.combined.method_point is None:
            # The summary shows no design without an answer.
            yield combined_design_table(case, result.combined, result.robot)
        if not case.changes:
            yield from robot_tables(case, result.robot)
        for k, each in enumerate(result.combined.settings or ()):
            tables = robot_tables(case.of_task(k), each)
            yield from (replace(table, name=name_of_task(table.name, k)) for table in tables)
    yield from _margins(result.margins)


def evaluation_tables(case: Case, result: EvaluationResult) -> Iterator[TextTable]:
    """Yield the tables of an evaluation: the tables of its summary, then every margin."""
    yield from _tables(evaluation_summary(case, result))
    if not result.settings:
        yield from _limb_parts_left_out(case, result.robot, is_shown=True)
    for k, robot in enumerate(result.settings or ()):
        parts = _limb_parts_left_out(case.of_task(k), robot, is_shown=True)
        yield from (replace(table, name=name_of_task(table.name, k)) for table in parts)
    yield from _margins(result.margins)


def _limb_parts_left_out(case: Case, robot: RobotData, *, is_shown: bool) -> Iterator[TextTable]:
    """Yield actuation and constraints by limb, unless the summary shows them."""
    table = limb_part_table(case, robot)
    if table is not None and not (is_shown and robot.joints is not None and robot.joints.constrained):
        yield table


def _tables(items: Iterator[object]) -> Iterator[TextTable]:
    return (item for item in items if isinstance(item, TextTable))


def _margins(margins: Sequence[Margin]) -> Iterator[TextTable]:
    if margins:
        yield margin_table(margins)
