"""Content of a report about a solved case: result, robot along the task's motion, and F near the design.

The report of a failed solve shows the final point of the search, and says that it is not an optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....models import FloatArray
from ...case.case import Case
from ...evidence.loads import loads_at
from ...evidence.state import RobotState
from ...program.nlp import Nlp
from ...results.checks import CaseCheck
from ...results.data import CaseResult
from ...results.objective import pose_objective, unit_of_objective
from ...results.rounding import ordered
from ...results.tradeoff import TradeoffResult
from ...solver.multistart import ProgramSolution
from ...solver.solution import Solution, TaskOutcome
from ...system.jsonvalues import json_data
from ...words.numbers import number
from ...words.objective import objective_label
from ..pictures.drawing import Drawing, drawing_of
from ..pictures.figures import picture_of
from ..pictures.posture import states_at_poses, worst_pose
from ..pictures.schedules import figure_of_schedule
from .frames import PoseView, ViewData, view_data
from .markup import with_signs
from .slices import Plane, Slice, has_loops, planes_of, slices_of

#: Largest number of maps of two variables in a report: seven variables have 21 pairs.
_PLANES = 24


@dataclass(frozen=True, eq=False)
class Part:
    """Task of a report: nonlinear program of the task at the design.

    Attributes:
        name: name of the task.
        label: label of an axis, F with its unit.
        unit: unit of F.
        nlp: nonlinear program of the task.
        x: (n,) variables at the design.
        solution: separate solution of the task.
        views: data of the 3-D view, for each pose at which the robot can be assembled.
        drawings: drawings of the robot, in the order of the views.
        slices: F along each variable.
        planes: F over pairs of variables.
        pairs: number of all pairs of variables.
    """

    name: str
    label: str
    unit: str
    nlp: Nlp
    x: FloatArray
    solution: ProgramSolution
    views: tuple[ViewData, ...]
    drawings: tuple[Drawing, ...]
    slices: tuple[Slice, ...]
    planes: tuple[Plane, ...]
    pairs: int


@dataclass(frozen=True, eq=False)
class Report:
    """Content of a report.

    Attributes:
        case: solved case.
        text: text of the case file.
        result: result of the solve.
        parts: tasks of the report.
        combined: solution of the nonlinear program that combines several tasks; None without such a program.
        check: published and expected values with the computed ones; None if the case has none.
        is_answer: True if the point is an optimum of the case.
        refusal: reason why a requested certificate is impossible; empty otherwise.
        curves: trade-offs over the active limits, shown instead of slices; empty for slices.
        schedule: SVG picture of the schedule; empty without values that change along the path.
    """

    case: Case
    text: str
    result: CaseResult
    parts: tuple[Part, ...]
    combined: ProgramSolution | None
    check: CaseCheck | None
    is_answer: bool
    refusal: str = ""
    curves: tuple[TradeoffResult, ...] = ()
    schedule: bytes = b""

    @property
    def is_enclosed(self) -> bool:
        """True if most slices contain only the design, as a single variable cannot change within the limits."""
        slices = [each for part in self.parts for each in part.slices]
        return bool(slices) and 2 * sum(not each.has_room for each in slices) > len(slices)

    def as_data(self, *, is_live: bool = False) -> dict[str, Any]:
        """Return the data for the script of the page, as JSON types; a live view replaces the data of the 3-D views."""
        return {
            "result": json_data(self.result),
            "views": [] if is_live else [view for part in self.parts for view in part.views],
            "planes": [[_plane(part, plane) for plane in part.planes] for part in self.parts],
        }


def report_of(
    text: str, solution: Solution, result: CaseResult, check: CaseCheck | None = None, refusal: str = ""
) -> Report:
    """Return the content of a report about a solved case, without solving anything.

    Args:
        text: text of the case file.
        solution: solution of the case.
        result: result of the solution, with certificates.
        check: published and expected values with the computed ones; None if the case has none.
        refusal: reason why a requested certificate is impossible; empty otherwise.
    """
    is_answer = solution.status.is_answer
    combined = None if solution.combination is None else solution.combination.combined
    parts = tuple(
        _part(outcome, outcome.at, j, len(solution.outcomes), is_answer=is_answer)
        for j, outcome in enumerate(solution.outcomes)
    )
    schedule, picture = solution.schedule, b""
    if schedule is not None and schedule.names:
        picture = picture_of(".svg", figure_of_schedule, solution.case, schedule)
    return Report(solution.case, text, result, parts, combined, check, is_answer, refusal, schedule=picture)


def _part(outcome: TaskOutcome, x: FloatArray, task: int, tasks: int, *, is_answer: bool) -> Part:
    """Return the content of one task at a point (n,)."""
    nlp, state, own = outcome.own.nlp, outcome.state, outcome.own
    # The program of a task with its own dimensions or pose is that of a case with this task only.
    index = min(task, len(nlp.case.tasks) - 1)
    states = states_at_poses(outcome)
    values = _measured(nlp, x, states) if outcome.task.measure else []
    worst, count = worst_pose(states, outcome.task.sense), len(states)
    if values:
        worst = None if count == 1 or len(values) < count else _first_largest(values)
    unit = unit_of_objective(nlp.case, index)
    drawings, views = [], []
    for k, each in enumerate(states):
        if each is not None:
            drawing = drawing_of(nlp, x, each, index, pose=k, is_answer=is_answer)
            drawings.append(drawing)
            words = f"{values[k]:.7g} {unit}" if len(values) == count else ""
            shown = PoseView(task, k, count, k == worst, count * tasks, nlp.objective_size, words)
            views.append(view_data(drawing, each.rates, shown))
    can_move = state is not None and nlp.n > 0 and not has_loops(nlp)
    slices: Sequence[Slice] = slices_of(nlp, x) if can_move else []
    planes: Sequence[Plane] = planes_of(nlp, x, _PLANES // tasks) if can_move else []
    count = len(slices)
    return Part(
        name=nlp.case.tasks[index].name,
        label=objective_label(nlp.case, index),
        unit=unit,
        nlp=nlp,
        x=x,
        solution=own,
        views=tuple(views),
        drawings=tuple(drawings),
        slices=tuple(slices),
        planes=tuple(planes),
        pairs=count * (count - 1) // 2,
    )


def _measured(nlp: Nlp, x: FloatArray, states: Sequence[RobotState | None]) -> list[float]:
    """Return the optimised quantity of the actuators at each pose at which the robot can be assembled."""
    return [pose_objective(nlp.case, loads_at(nlp, x, state, k)) for k, state in enumerate(states) if state is not None]


def _first_largest(values: Sequence[float]) -> int:
    """Return the index of the largest value, the first index among values equal up to rounding."""
    rounded = [ordered(value) for value in values]
    return rounded.index(max(rounded))


def _plane(part: Part, plane: Plane) -> dict[str, Any]:
    """Return a map in the case's units, rounded to the precision of a picture."""
    nlp, x = part.nlp, part.x
    i, j = plane.variables
    names, units = nlp.program.variables, nlp.case.units

    def shown(k: int, value: float) -> float:
        return float(f"{units.shown(value, names[k].dimension):.6g}")

    return {
        "names": [names[i].name, names[j].name],
        "units": [units.label(names[k].dimension) for k in (i, j)],
        "label": part.label,
        "first": [shown(i, float(value)) for value in plane.first],
        "second": [shown(j, float(value)) for value in plane.second],
        "F": [[float(f"{value:.5g}") if np.isfinite(value) else None for value in row] for row in plane.F],
        "inside": ["".join("1" if kept else "0" for kept in row) for row in plane.inside],
        "at": [shown(i, float(x[i])), shown(j, float(x[j]))],
        "words": with_signs(plane_words(nlp, x, plane)),
    }


def plane_words(nlp: Nlp, x: FloatArray, plane: Plane) -> str:
    """Return a description of a map."""
    i, j = plane.variables
    names, units = nlp.program.variables, nlp.case.units

    def text(k: int, value: float) -> str:
        name, dimension = names[k].name, names[k].dimension
        width = units.shown(float(nlp.scale[k]), dimension)
        return f"{name} = {number(units.shown(value, dimension), width, digits=5)} {units.label(dimension)}".strip()

    if not np.isfinite(plane.F).any():
        return f"{names[i].name} and {names[j].name} cannot change while the other variables are fixed."
    words = f"F over {names[i].name} and {names[j].name}: {np.nanmin(plane.F):.5g} to {np.nanmax(plane.F):.5g}. "
    kept = np.where(plane.inside > 0, plane.F, np.nan)
    part = 100 * float(np.mean(plane.inside))
    if np.isfinite(kept).any():
        best = int(np.nanargmax(kept) if nlp.sign < 0 else np.nanargmin(kept))
        row, column = divmod(best, kept.shape[1])
        word = "largest" if nlp.sign < 0 else "smallest"
        at = f"{text(i, float(plane.first[column]))}, {text(j, float(plane.second[row]))}"
        words += f"Within all limits, F is {word} at {at} on this grid. "
    words += f"This design: {text(i, float(x[i]))}, {text(j, float(x[j]))}."
    return (
        words
        if part == 100
        else f"{words} Pale: a limit or an equation of the robot is violated ({100 - part:.3g} % of the map)."
    )
