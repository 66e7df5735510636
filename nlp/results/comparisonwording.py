"""A comparison of robots in words: lines, a table of text, and rows for a CSV file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..system.csvtext import csv_text
from .rounding import number
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from .comparison import ComparedRateData, ComparedRobotData, ComparedTaskData, ComparisonResult

_SEPARATOR = "; "
#: Digits of F, and of other numbers, in the table.
_DIGITS, _FEW = 7, 4


def comparison_summary(result: ComparisonResult) -> Iterator[Line | TextTable]:
    """Yield a comparison: the rules, the table, then words and dimensions robot by robot."""
    yield Line(result.title or result.case, tone=Tone.TITLE)
    for sentence in result.sentences:
        yield Line(sentence)
    yield comparison_table(result)
    for robot in result.robots:
        for sentence in robot.sentences:
            yield Line(sentence, label=robot.name, tone=Tone.CAUTION)
    for robot in result.robots:
        if robot.dimensions:
            yield Line(dimension_words(robot), label=f"{robot.name}, dimensions")


def comparison_table(result: ComparisonResult) -> TextTable:
    """Return a row for each robot, the best first; robots that are not ranked come last."""
    robots = result.robots
    tasks = next((each.tasks for each in robots if each.tasks), ())
    several = len(tasks) > 1
    unit = result.units.length
    headers = ["robot", "rank", "freedoms", "value" if several else _headed("F", tasks[0].unit if tasks else "")]
    headers += [_headed(f"F of {each.name}", each.unit) for each in tasks] if several else []
    headers += ["constraints\n% of F", "largest rate", _headed("size", unit)]
    with_limits, with_proof = result.limits > 0, any(each.certificate or each.certificate_fault for each in robots)
    with_workspace = any(each.workspace is not None for each in robots)
    with_strokes = any(each.strokes for each in robots)
    headers += ["limits kept"] if with_limits else []
    headers += ["workspace"] if with_workspace else []
    headers += ["stroke"] if with_strokes else []
    headers += ["certificate"] if with_proof else []
    rows = []
    for rank, robot in enumerate(robots, start=1):
        row = [robot.name, str(rank) if robot.part == "ranked" else robot.part]
        row += ["" if robot.freedoms is None else str(robot.freedoms), _text(robot.value, _DIGITS)]
        if several:
            row += [_text(each.F, _DIGITS) for each in robot.tasks] or [""] * len(tasks)
        row += [_constraints(robot), _largest_rate(robot), _text(robot.final_size, _FEW)]
        row += [f"{robot.limits_kept} of {result.limits}"] if with_limits else []
        row += ["" if robot.workspace is None else robot.workspace.value] if with_workspace else []
        row += [_strokes(robot)] if with_strokes else []
        row += [_proof(robot)] if with_proof else []
        rows.append(tuple(row))
    return TextTable(tuple(headers), tuple(rows), "comparison")


def dimension_words(robot: ComparedRobotData) -> str:
    """Return the free dimensions of a design in one line, all where none is free; an end of a range is marked."""
    parts = []
    free = [each for each in robot.dimensions if each.range is not None]
    for each in free or robot.dimensions:
        ends = each.range or ()
        mark = next((word for end, word in zip(ends, ("least", "most"), strict=False) if _is_at(each.value, end)), "")
        parts.append(f"{each.name} = {each.value:.5g} {each.unit}".rstrip() + (f" ({mark})" if mark else ""))
    return ", ".join(parts)


def comparison_csv(result: ComparisonResult) -> str:
    """Return a comparison as CSV, one row for each robot; what has no value is an empty cell."""
    tasks = next((each.tasks for each in result.robots if each.tasks), ())
    head = ["robot", "model", "part", "freedoms", "status", "value"]
    for each in tasks:
        head += [f"F of {each.name}", f"can move {each.name}", f"constraint part of {each.name}"]
        head += [f"rates for {each.name}"]
    head += ["factor", "size", "final_size", "dimensions", "active", "limits_kept", "limits_left_out"]
    head += ["singularities", "workspace", "strokes", "certificate", "proven_bound", "gap", "sentences", "seconds"]
    rows = []
    for robot in result.robots:
        proof = robot.certificate
        row: list[object] = [robot.name, robot.model, robot.part, robot.freedoms]
        row += [None if robot.status is None else robot.status.value, robot.value]
        for task in robot.tasks or [None] * len(tasks):
            row += [None] * 4 if task is None else _task_cells(task)
        row += [robot.factor, robot.size, robot.final_size]
        row += [_SEPARATOR.join(f"{each.name}={each.value!r}" for each in robot.dimensions)]
        row += [_SEPARATOR.join(robot.active), robot.limits_kept]
        row += [_SEPARATOR.join(each.key for each in robot.limits_left_out), _SEPARATOR.join(robot.singularities)]
        row += ["" if robot.workspace is None else robot.workspace.value]
        row += [_SEPARATOR.join(f"{name}={each.stroke!r}" for name, each in robot.strokes.items())]
        row += [None] * 3 if proof is None else [proof.status.value, proof.bound, proof.gap]
        row += [" ".join(robot.sentences), robot.seconds]
        rows.append(row)
    return csv_text(head, rows)


def _headed(name: str, unit: str) -> str:
    return f"{name}\n{unit}" if unit else name


def _is_at(value: float, end: float) -> bool:
    """Return whether a number is at an end of its range, within the rounding of a search."""
    return abs(value - end) <= 1e-6 * max(abs(value), abs(end))


def _text(value: float | None, digits: int) -> str:
    return "" if value is None else number(value, digits=digits)


def _constraints(robot: ComparedRobotData) -> str:
    """Return the largest part of F that constraints carry, in percent."""
    known = [each.constraint for each in robot.tasks if each.constraint is not None]
    return f"{100 * max(known):.3g}" if known else ""


def _largest_rate(robot: ComparedRobotData) -> str:
    """Return the rate that is largest in size among all tasks, with its unit."""
    rates: list[ComparedRateData] = [rate for each in robot.tasks for rate in each.rates]
    if not rates:
        return ""
    if any(rate.rate is None for rate in rates):
        return "undetermined"
    largest = max(rates, key=lambda each: abs(each.rate or 0.0))
    # A motion that no actuator drives leaves rounding errors of a size that F tells.
    size = max((math.sqrt(each.F) for each in robot.tasks if each.F is not None), default=0.0)
    return f"{number(abs(largest.rate or 0.0), size, digits=_FEW)} {largest.unit}"


def _strokes(robot: ComparedRobotData) -> str:
    return ", ".join(f"{each.stroke:.{_FEW}g} {each.unit}" for each in robot.strokes.values())


def _proof(robot: ComparedRobotData) -> str:
    """Return the status of a certificate with its gap; ``none`` where it is refused."""
    proof = robot.certificate
    if proof is None:
        return "none" if robot.certificate_fault else ""
    gap = proof.relative_gap if proof.relative_gap is not None else proof.gap
    return proof.status.value if gap is None else f"{proof.status.value}, gap {gap:.1e}"


def _task_cells(task: ComparedTaskData) -> list[object]:
    rates = (f"{each.actuator}={'' if each.rate is None else repr(each.rate)} {each.unit}" for each in task.rates)
    return [task.F, task.can_move, task.constraint, _SEPARATOR.join(rates)]
