"""What a report shows of a solved case: its result, its robot along the motion, and F beside the point found.

A report of a solve that failed shows what was reached, and calls it that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....models import FloatArray
from ...case.case import Case
from ...evidence.state import RobotState
from ...program.nlp import Nlp
from ...results.regression import CaseCheck, check_case
from ...solve.compromise import Compromise
from ...solve.multistart import Solution
from ..pictures.drawing import drawing_of
from .frames import ViewData, view_data
from .slices import Plane, Slice, has_loops, planes_of, slices_of

#: So many maps of two variables are made in all: seven free variables have 21 pairs.
_PLANES = 24


@dataclass(frozen=True, eq=False)
class Part:
    """One task of a report: its program at the point that the report is about.

    Attributes:
        name: of the task.
        nlp: its program.
        x: (n,) the point.
        solution: what the task has by itself.
        view: the robot there, for the 3-D view; None where it does not exist.
        slices: F along each variable.
        planes: F over pairs of variables.
        pairs: how many pairs there are.
    """

    name: str
    nlp: Nlp
    x: FloatArray
    solution: Solution
    view: ViewData | None
    slices: tuple[Slice, ...]
    planes: tuple[Plane, ...]
    pairs: int


@dataclass(frozen=True, eq=False)
class Report:
    """Everything that a page shows.

    Attributes:
        case: the case.
        text: the case as it is written in its file.
        result: as ``--json`` writes it.
        parts: one for each task.
        combined: the solution of the program that brings several tasks together, where there is one.
        check: published and expected numbers beside the computed; None where the case has none.
        is_answer: whether the point is what was asked for.
    """

    case: Case
    text: str
    result: dict[str, Any]
    parts: tuple[Part, ...]
    combined: Solution | None
    check: CaseCheck | None
    is_answer: bool

    def as_data(self) -> dict[str, Any]:
        """What the page's script needs, ready for JSON."""
        return {
            "result": self.result,
            "views": [part.view for part in self.parts if part.view is not None],
            "planes": [[_plane(part.nlp, part.x, plane) for plane in part.planes] for part in self.parts],
        }


def report_of(name: str, text: str, solution: Solution | Compromise, result: dict[str, Any]) -> Report:
    """Everything that a page shows of a solved case.

    Args:
        name: by which the case was read.
        text: the case as it is written in its file.
        solution: the solve.
        result: the same as plain data, with its certificates.

    Raises:
        InputError: a case that this one's published numbers refer to cannot be read.
    """
    if isinstance(solution, Compromise):
        case, combined, is_answer = solution.case, solution.combined, solution.status.is_answer
        parts = tuple(
            _part(outcome.own.nlp, solution.x, outcome.state, outcome.own, j, len(solution.outcomes), is_answer)
            for j, outcome in enumerate(solution.outcomes)
        )
    else:
        case, combined, is_answer = solution.nlp.case, None, solution.status.is_answer
        parts = (_part(solution.nlp, solution.x, solution.state, solution, 0, 1, is_answer),)
    check = check_case(name, {name: result}) if case.published else None
    return Report(case, text, result, parts, combined, check, is_answer)


def _part(
    nlp: Nlp, x: FloatArray, state: RobotState | None, own: Solution, task: int, tasks: int, is_answer: bool
) -> Part:
    view = None
    if state is not None:
        view = view_data(drawing_of(nlp, x, state, task, is_answer=is_answer), state.rates)
    can_move = state is not None and nlp.n > 0 and not has_loops(nlp)
    slices: Sequence[Slice] = slices_of(nlp, x) if can_move else []
    planes: Sequence[Plane] = planes_of(nlp, x, _PLANES // tasks) if can_move else []
    count = len(slices)
    return Part(
        name=nlp.case.tasks[task].name,
        nlp=nlp,
        x=x,
        solution=own,
        view=view,
        slices=tuple(slices),
        planes=tuple(planes),
        pairs=count * (count - 1) // 2,
    )


def _plane(nlp: Nlp, x: FloatArray, plane: Plane) -> dict[str, Any]:
    """A map in the case's units, rounded to what a picture shows."""
    i, j = plane.variables
    names, units = nlp.program.variables, nlp.case.units

    def shown(k: int, value: float) -> float:
        return float(f"{units.shown(value, names[k].dimension):.6g}")

    return {
        "names": [names[i].name, names[j].name],
        "units": [units.label(names[k].dimension) for k in (i, j)],
        "first": [shown(i, float(value)) for value in plane.first],
        "second": [shown(j, float(value)) for value in plane.second],
        "F": [[float(f"{value:.5g}") if np.isfinite(value) else None for value in row] for row in plane.F],
        "inside": ["".join("1" if kept else "0" for kept in row) for row in plane.inside],
        "at": [shown(i, float(x[i])), shown(j, float(x[j]))],
        "words": plane_words(nlp, x, plane),
    }


def plane_words(nlp: Nlp, x: FloatArray, plane: Plane) -> str:
    """What a map shows, in a sentence."""
    i, j = plane.variables
    names, units = nlp.program.variables, nlp.case.units

    def text(k: int, value: float) -> str:
        name = names[k].name
        return f"{name} = {units.shown(value, names[k].dimension):.5g} {units.label(names[k].dimension)}".strip()

    if not np.isfinite(plane.F).any():
        return f"{names[i].name} and {names[j].name} cannot move while the others are held."
    words = (
        f"F over {names[i].name} and {names[j].name} goes from {np.nanmin(plane.F):.5g} to {np.nanmax(plane.F):.5g}. "
    )
    kept = np.where(plane.inside > 0, plane.F, np.nan)
    part = 100 * float(np.mean(plane.inside))
    if np.isfinite(kept).any():
        best = int(np.nanargmax(kept) if nlp.sign < 0 else np.nanargmin(kept))
        row, column = divmod(best, kept.shape[1])
        word = "largest" if nlp.sign < 0 else "smallest"
        at = f"{text(i, float(plane.first[column]))}, {text(j, float(plane.second[row]))}"
        words += f"On this grid and within every limit it is {word} at {at}. "
    words += f"This point is at {text(i, float(x[i]))}, {text(j, float(x[j]))}."
    return words if part == 100 else f"{words} Pale: outside of a limit or equation ({100 - part:.3g} % of the map)."
