"""Comparison of robots on one case: columns of a table of designs, and sentences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from .designs import SEPARATOR, Cell, Column, ColumnKind, certificate_columns
from .numbers import number
from .text import Line, Tone

if TYPE_CHECKING:
    from ..results.comparison import ComparedRateData, ComparedRobotData, ComparedTaskData, ComparisonResult
    from ..results.data import CertificateData

#: Digits of F, and of other numbers, in the table.
_DIGITS, _FEW = 7, 4


def comparison_lines(result: ComparisonResult) -> Iterator[Line]:
    """Yield the lines below the table: notes and dimensions of each robot, then the rules of the comparison."""
    for robot in result.robots:
        for sentence in robot.sentences:
            yield Line(sentence, label=robot.name, tone=Tone.CAUTION)
    for robot in result.robots:
        if robot.dimensions:
            yield Line(dimension_words(robot), label=f"{robot.name}, dimensions", part="dimensions")
    for sentence in result.sentences:
        yield Line(sentence, part="rules")


def comparison_columns(result: ComparisonResult) -> Iterator[Column[ComparedRobotData]]:
    """Yield the columns: robot, ranking, F, rates, sizes, limits, workspace, strokes, and certificate."""
    robots, proofs = result.robots, ColumnKind.PROOF
    tasks = next((each.tasks for each in robots if each.tasks), ())
    several, unit = len(tasks) > 1, result.units.length
    places = {robot.name: str(k) if robot.part == "ranked" else robot.part for k, robot in enumerate(robots, start=1)}
    yield Column("robot", lambda robot: robot.name, holds=str, label="robot", text=lambda robot: robot.name)
    yield Column("model", lambda robot: robot.model, holds=str)
    yield Column("part", lambda robot: robot.part, holds=str, label="ranking", text=lambda robot: places[robot.name])
    yield Column(
        "freedoms",
        lambda robot: robot.freedoms,
        holds=int,
        label="DOF",
        text=lambda robot: "" if robot.freedoms is None else str(robot.freedoms),
    )
    yield Column("status", lambda robot: None if robot.status is None else robot.status.value, holds=str)
    yield Column(
        "value",
        lambda robot: robot.value,
        ColumnKind.OBJECTIVE,
        label="value" if several else "F",
        unit=tasks[0].unit if len(tasks) == 1 else "",
        text=lambda robot: _text(robot.value, _DIGITS),
    )
    for k, task in enumerate(tasks):
        yield from _task_columns(k, task, is_shown=several)
    yield Column("", _constraints, label="constraint wrenches", unit="% of F", text=_constraints)
    yield Column("", _largest_rate, label="largest actuator rate", text=_largest_rate)
    yield Column("factor", lambda robot: robot.factor)
    yield Column("size", lambda robot: robot.size)
    yield Column(
        "final_size",
        lambda robot: robot.final_size,
        label="size",
        unit=unit,
        text=lambda robot: _text(robot.final_size, _FEW),
    )
    yield _joined("dimensions", lambda robot: (f"{each.name}={each.value!r}" for each in robot.dimensions))
    yield _joined("active", lambda robot: robot.active)
    yield Column(
        "limits_kept",
        lambda robot: None if robot.part == "no answer" else robot.limits_kept,
        holds=int,
        label="limits satisfied" if result.limits > 0 else "",
        text=lambda robot: "" if robot.part == "no answer" else f"{robot.limits_kept} of {result.limits}",
    )
    yield _joined("limits_left_out", lambda robot: (each.key for each in robot.limits_left_out))
    yield _joined("singularities", lambda robot: robot.singularities)
    yield Column(
        "workspace",
        _workspace,
        proofs,
        str,
        label="workspace" if any(each.workspace is not None for each in robots) else "",
        text=_workspace,
    )
    strokes = _joined("strokes", lambda robot: (f"{name}={each.stroke!r}" for name, each in robot.strokes.items()))
    yield replace(strokes, label="stroke" if any(each.strokes for each in robots) else "", text=_strokes)
    status, *bounds = certificate_columns(_certificate)
    is_proved = any(each.certificate or each.certificate_fault for each in robots)
    yield replace(status, label="certificate" if is_proved else "", text=_proof)
    yield from bounds
    yield Column("sentences", lambda robot: " ".join(robot.sentences), holds=str)
    yield Column("seconds", lambda robot: robot.seconds)


def _task_columns(k: int, task: ComparedTaskData, *, is_shown: bool) -> Iterator[Column[ComparedRobotData]]:
    """Yield the columns of a task; tables of several tasks show F only."""

    def of(cell: Callable[[ComparedTaskData], Cell]) -> Callable[[ComparedRobotData], Cell]:
        return lambda robot: cell(robot.tasks[k]) if robot.tasks else None

    yield Column(
        f"F of {task.name}",
        of(lambda each: each.F),
        label=f"F of {task.name}" if is_shown else "",
        unit=task.unit,
        text=lambda robot: _text(robot.tasks[k].F, _DIGITS) if robot.tasks else "",
    )
    yield Column(f"can move {task.name}", of(lambda each: each.can_move))
    yield Column(f"constraint part of {task.name}", of(lambda each: each.constraint))
    yield Column(f"rates for {task.name}", of(_rates), holds=str)


def _joined(name: str, texts: Callable[[ComparedRobotData], Iterable[str]]) -> Column[ComparedRobotData]:
    """Return a column whose cells list several texts."""
    return Column(name, lambda robot: SEPARATOR.join(texts(robot)), holds=str)


def dimension_words(robot: ComparedRobotData) -> str:
    """Return the free dimensions of a design, or all dimensions if none is free, with marks at bounds."""
    parts = []
    free = [each for each in robot.dimensions if each.range is not None]
    for each in free or robot.dimensions:
        ends = each.range or ()
        words = zip(ends, ("lower bound", "upper bound"), strict=False)
        mark = next((word for end, word in words if _is_at(each.value, end)), "")
        parts.append(f"{each.name} = {each.value:.5g} {each.unit}".rstrip() + (f" ({mark})" if mark else ""))
    return ", ".join(parts)


def _is_at(value: float, end: float) -> bool:
    """Return whether a value is at a bound of its range, within the rounding error of a search."""
    return abs(value - end) <= 1e-6 * max(abs(value), abs(end))


def _text(value: float | None, digits: int) -> str:
    return "" if value is None else number(value, digits=digits)


def _constraints(robot: ComparedRobotData) -> str:
    """Return the largest part of F from constraint wrenches, in percent."""
    known = [each.constraint for each in robot.tasks if each.constraint is not None]
    return f"{100 * max(known):.3g}" if known else ""


def _largest_rate(robot: ComparedRobotData) -> str:
    """Return the largest magnitude of a rate among all tasks, with its unit."""
    rates: list[ComparedRateData] = [rate for each in robot.tasks for rate in each.rates]
    if not rates:
        return ""
    if any(rate.rate is None for rate in rates):
        return "undetermined"
    largest = max(rates, key=lambda each: abs(each.rate or 0.0))
    # For a motion that no actuator drives, the rates are rounding errors, relative to the root of F.
    size = max((math.sqrt(each.F) for each in robot.tasks if each.F is not None), default=0.0)
    return f"{number(abs(largest.rate or 0.0), size, digits=_FEW)} {largest.unit}"


def _strokes(robot: ComparedRobotData) -> str:
    return ", ".join(f"{each.stroke:.{_FEW}g} {each.unit}" for each in robot.strokes.values())


def _proof(robot: ComparedRobotData) -> str:
    """Return the status and the gap of a certificate; ``none`` without a certificate."""
    proof = robot.certificate
    if proof is None:
        return "none" if robot.certificate_fault else ""
    gap = proof.relative_gap if proof.relative_gap is not None else proof.gap
    return proof.status.value if gap is None else f"{proof.status.value}, gap {gap:.1e}"


def _certificate(robot: ComparedRobotData) -> CertificateData | None:
    return robot.certificate


def _workspace(robot: ComparedRobotData) -> str:
    return "" if robot.workspace is None else robot.workspace.value


def _rates(task: ComparedTaskData) -> str:
    return SEPARATOR.join(f"{x.actuator}={'' if x.rate is None else repr(x.rate)} {x.unit}" for x in task.rates)
