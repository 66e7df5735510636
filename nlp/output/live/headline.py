"""Headline of a live page: the answer of the program, or the objective at the shown point, and the task."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....models import FloatArray
from ...case.case import Case
from ...program.nlp import Nlp
from ...results.data import OutcomeData, SolveResult
from ...results.objective import unit_of_objective
from ...results.result import result_of
from ...solver.solution import Solution
from ...words.lines import headline, objective_lines, task_lines
from ...words.numbers import number
from ...words.text import Line
from ..report.markup import Markup, join_markup, paragraphs, tag


def name_of_objective(case: Case) -> str:
    """Return the name of the objective in the headline."""
    if len(case.tasks) > 1:
        return case.method.value
    return "F" if case.pose_count == 1 else f"F ({case.over_poses.value} over {case.pose_count} poses)"


def answer_of(solution: Solution) -> dict[str, Any]:
    """Return the program's answer: point, words of the terminal's headline, and whether it is an optimum."""
    combination = solution.combination
    own = solution.outcomes[0].own if combination is None else combination.combined
    x = solution.x if own is None else own.x
    result = result_of(solution)
    found: dict[str, Any] = {"x": x.tolist(), "isOptimum": solution.status.is_answer, "optima": [], "tasks": []}
    if isinstance(result, SolveResult):
        return {**found, "words": headline(result, solution.case).words}
    method, value = solution.case.method.value, result.combined.value
    words = f"tasks combined by {method}" if value is None else f"{method} = {number(value)}"
    units = [unit_of_objective(solution.case, k) for k in range(len(result.combined.tasks))]
    return {
        **found,
        "words": f"{words}   ({solution.status.value})",
        "optima": [each.best for each in result.combined.tasks],
        "tasks": [_task_words(each, unit) for each, unit in zip(result.combined.tasks, units, strict=True)],
    }


def _task_words(task: OutcomeData, unit: str) -> str:
    """Return F of one of several tasks as a part of its separate optimum; ``panel.js`` writes it after a change."""
    if task.F is None:
        return f"{task.name}: no F"
    words = f"{task.name}: F = {number(task.F)} {unit}".rstrip()
    if task.best is None:
        return words
    part = f"{100 * task.F / task.best:.4g}\N{NO-BREAK SPACE}% of " if task.best else ""
    return f"{words}, {part}the separate {task.sense.value}imum {number(task.best)}"


def headline_of(
    nlp: Nlp, x: FloatArray, answer: dict[str, Any] | None, along: str | None, *, has_module: bool
) -> Markup:
    """Return the headline of an answer, along a path or, without both and without a module, of the shown point."""
    if answer is not None:
        return _answer_markup(answer["words"], answer["tasks"])
    if along is not None:
        return _answer_markup(along)
    return _answer_markup("") if has_module else _value_markup(nlp, x)


def _answer_markup(words: str, tasks: Sequence[str] = ()) -> Markup:
    """Return the content of the headline, with words for each of several tasks; the script fills it after a change."""
    return join_markup(
        [
            tag("span", words, id="F"),
            tag("span", id="word"),
            tag("span", id="words"),
            tag("ul", *(tag("li", each) for each in tasks), id="task-values", hidden=not tasks),
        ]
    )


def _value_markup(nlp: Nlp, x: FloatArray) -> Markup:
    """Return the headline of a page without an answer and without a module: the objective at the shown point."""
    F = float(np.ravel(nlp.program.kernels.derivatives(x, nlp.arguments).F)[0])
    words = f"{name_of_objective(nlp.case)} = {number(F)} {unit_of_objective(nlp.case)}".rstrip()
    if len(nlp.case.tasks) > 1 or not math.isfinite(F):
        words = ""
    return join_markup(
        [
            tag("span", words, id="F"),
            tag("span", "point", id="word"),
            tag("span", "nothing is optimised", id="words"),
            tag("ul", id="task-values", hidden=True),
        ]
    )


def task_of(case: Case, solution: Solution | None) -> Markup:
    """Return the meaning of F, if it is not a sum of squared rates, and the task in words."""
    result = None if solution is None else result_of(solution)
    lines = [*objective_lines(case)]
    if isinstance(result, SolveResult) and result.robot is not None and result.robot.task is not None:
        lines += [*task_lines(result.robot.task, case.units)]
    return task_markup(lines)


def task_markup(lines: Sequence[Line]) -> Markup:
    """Return the place of the task in words."""
    return tag("div", paragraphs(lines), class_="task", id="stated-task")
