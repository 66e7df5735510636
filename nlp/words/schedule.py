"""Lines about a schedule: its objective beside that of the best constant, its rates, and the bound of all schedules."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..case.pose import OverPoses
from ..case.task import LEG_LENGTH, SMALLEST
from ..results.objective import unit_of_objective
from ..results.point import task_data
from .lines import followed_words, task_lines
from .numbers import number
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from ..case.case import Case
    from ..results.schedule import ScheduleData


def objective_name(case: Case) -> str:
    """Return the name of the objective over the path."""
    measure, is_mean = case.tasks[0].measure, case.over_path is OverPoses.MEAN
    if not measure:
        return "mean F" if is_mean else "worst F"
    own = {LEG_LENGTH: "longest leg", SMALLEST: "smallest singular value"}
    name = own.get(measure, f"largest {measure.replace('_', ' ')}")
    return f"mean {name}" if is_mean else name


def schedule_task_lines(case: Case) -> Iterator[Line]:
    """Yield name, sense and motion of each task along the path."""
    for k, task in enumerate(case.tasks):
        if task.follows:
            yield Line(f"{task.name}, {task.sense.value} F: {followed_words(task)}", label="task")
        elif task.is_stated:
            yield from task_lines(task_data(case, k), case.units)


def schedule_lines(case: Case, schedule: ScheduleData) -> Iterator[Line | TextTable]:
    """Yield the objective with its gain over the best constant, the bound, and the rates."""
    name, segments = objective_name(case), schedule.segments
    where = f"along {segments:,} segment{'s' * (segments != 1)}"
    unit = unit_of_objective(case)
    yield Line(
        f"{name} = {number(schedule.value)}{f' {unit}' if unit else ''}",
        tone=Tone.ANSWER,
        after=f" {where} ({_gain(schedule)})",
    )
    if case.model.locked:
        joints = case.model.locked
        who = f"actuated joint{'s' * (len(joints) > 1)} {', '.join(joints)}"
        what = "J" if case.tasks[0].measure == SMALLEST else "F"
        yield Line(f"{what} is taken with {who} locked at each point of the path", label="note")
    words = (
        f"locally optimal: {search_words(schedule)}"
        if schedule.names or schedule.design
        else "evaluated: all dimensions and settings are fixed"
    )
    yield Line(words, label="status")
    if schedule.bound is not None and schedule.gap is not None:
        stopped = "" if schedule.reason is None else f"; stopped: {schedule.reason}"
        words = f"{schedule.statement} (proved, gap {100 * schedule.gap:.2g} %{stopped})"
        yield Line(words, label="bound", tone=Tone.HOLDS)
    elif schedule.reason is not None:
        yield Line(f"none proved; stopped: {schedule.reason}", label="bound", tone=Tone.NO_ANSWER)
    if schedule.proved is not None:
        points = f"{schedule.added} point{'s' * (schedule.added != 1)} added"
        verdict = "no singularity and no violated limit at any point of the path"
        words, tone = (verdict, Tone.HOLDS) if schedule.proved else ("not proved along the path", Tone.NO_ANSWER)
        yield Line(f"{words} ({points})", label="schedule proved" if schedule.proved else "schedule", tone=tone)
    rows: list[tuple[str | Line, ...]] = []
    for k, (each, unit) in enumerate(zip(schedule.names, schedule.units, strict=True)):
        column = [row[k] for row in schedule.rows]
        rate = schedule.rates[k]
        rows.append(
            (
                each,
                unit,
                number(min(column)),
                number(max(column)),
                "" if schedule.constant is None else number(schedule.constant.values[k]),
                "" if rate.used is None else number(rate.used),
                "inf" if rate.max is None else number(rate.max),
            )
        )
    if rows:
        head = ("setting", "unit", "smallest", "largest", "best constant", "rate", "largest rate")
        yield TextTable(head, tuple(rows), "settings")
    if schedule.design:
        units = {
            name: case.units.label(item.dimension)
            for item in case.model.parameters
            for name in case.component_names(item)
        }
        design = tuple((name, number(value), units[name]) for name, value in schedule.design.items())
        yield TextTable(("dimension", "value", "unit"), design, "design", with_unit=(1,))


def schedule_table(schedule: ScheduleData) -> TextTable:
    """Return the settings and the objective at each point of the path."""
    heads = [] if schedule.times is None else ["t\ns"]
    heads += (f"{name}\n{unit}" for name, unit in zip(schedule.names, schedule.units, strict=True))
    rows = [
        (
            *(() if schedule.times is None else (number(schedule.times[i]),)),
            *(number(value) for value in row),
            number(schedule.F[i]),
        )
        for i, row in enumerate(schedule.rows)
    ]
    return TextTable((*heads, "objective"), tuple(rows), "schedule", "schedule", is_curve=True, part="schedule")


def no_schedule_line(case: Case) -> Line:
    """Return the outcome of a search without an answer."""
    names = ", ".join(case.settings) or "design"
    words = f"no schedule found: the search found no {names} within the limits and rates; this is no proof"
    return Line(words, tone=Tone.NO_ANSWER)


def gain_words(schedule: ScheduleData) -> str:
    """Return the gain over the best constant; empty without settings."""
    names = ", ".join(schedule.names)
    if not names:
        return ""
    if schedule.constant is None:
        return f"no constant {names} keeps the limits"
    return f"{_signed(schedule, schedule.constant.gain)} compared with the best constant {names}"


def search_words(schedule: ScheduleData) -> str:
    """Return the methods of the search, and what may be better than its result."""
    if schedule.names:
        return "dynamic programming, then Ipopt; another schedule may be better"
    return "searches by Ipopt; another design may be better"


def _gain(schedule: ScheduleData) -> str:
    """Return the best constant and the gain over it, in words."""
    constant = schedule.constant
    if not schedule.names:
        return "no setting changes"
    names = ", ".join(schedule.names)
    if constant is None:
        return f"no constant {names} keeps the limits"
    return f"{number(constant.value)} with the best constant {names}, {_signed(schedule, constant.gain)}"


def _signed(schedule: ScheduleData, gain: float) -> str:
    """Return a gain in per cent, with the sign of the change of the objective; ``no gain`` if it is 0."""
    if not gain:
        return "no gain"
    change = gain if schedule.constant is None or schedule.value >= schedule.constant.value else -gain
    return f"{100 * change:+.2f} %"
