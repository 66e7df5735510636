"""Limits, margins, tasks, optima and motions as tables of text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..evidence.kkt import ACTIVE
from ..results.data import CombinedData
from ..results.rounding import NOISE, rate_sizes, settled, settled_F, task_F
from ..units import Units, slope_unit
from .joints import motion_words
from .lines import SET, counted
from .numbers import number
from .text import TextTable

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from ..case.case import Case
    from ..case.settings import Search
    from ..evidence.margins import Margin
    from ..evidence.principal_motions import TaskAnalysis
    from ..program.nlp import Nlp
    from ..results.data import SolveResult
    from ..results.parts import LimitData, RobotData, VersionsData
    from ..results.path import PathProofData
    from ..results.workspace import WorkspaceProofData
    from ..solver.multistart import ProgramSolution

#: So many places where a limit is active are named.
_PLACES = 3
#: Error of the margin in an active limit, as a part of the limit: that of the test whether a point lies on it.
_ON_LIMIT = 10 * ACTIVE
#: Error bound of the pitch of a principal motion, as a part of the robot's size: motions whose F are nearly equal are
#: eigenvectors that mix, and robot files give their numbers with six to nine digits.
_EIGENVECTOR = 1e-6
#: So many optima are shown in full.
MOST_OPTIMA = 12


def principal_table(motions: TaskAnalysis, units: Units, size: float) -> TextTable:
    """Return the motions at which F is stationary: those of unit rotation, then translations of unit speed.

    Args:
        motions: to show.
        units: of the case.
        size: of the robot, length.
    """
    rows = []
    for kind in (motions.rotations, motions.translations):
        for rank, motion in zip(("least", "", "most"), kind, strict=True):
            words = motion_words(motion.motion, units, size, _EIGENVECTOR)
            rows.append((rank, number(motion.F, kind[-1].F), words))
    return TextTable(("resisted", "F", "motion"), tuple(rows), "motions")


def limits_title(case: Case, proof: WorkspaceProofData | PathProofData | None = None) -> str:
    """Return at which poses the rows of the limits hold, where a case has limits beside its poses; else nothing.

    Args:
        case: the case.
        proof: of a solved design over the workspace or along the path, of which some poses became constraints.
    """
    if not case.limits_over:
        return ""
    stated = "limits at the stated pose" if case.pose_count == 1 else "limits at the stated poses"
    if proof is None or not proof.poses:
        return f"{stated}, not {case.limits_where}"
    return f"{stated}, and where a pose of the {case.limits_over} became a constraint of its limit"


def limit_table(limits: Sequence[LimitData], F: float = 0.0, title: str = "") -> TextTable:
    """Return every limit of the case: how near the design comes to it, its cost, and where; violated and active first.

    Args:
        limits: of the case.
        F: size of F, of which costs have their error.
        title: of the table; empty for none.
    """
    rows = []
    for row in sorted(limits, key=lambda each: (not each.violated, not each.active)):
        where = [_place(name) for name in row.violated or row.active] or [_place(row.nearest)]
        more = f" and {len(where) - _PLACES} more" if len(where) > _PLACES else ""
        slope = settled(row.cost or 0.0, abs(F) / (abs(row.limit) or 1.0))
        cost = f"{slope:+.4g} {slope_unit(row.unit)}" if row.active and slope else ""
        beside = abs(row.limit) or 1.0
        word = "violated" if row.violated else "active" if row.active else ""
        shown = ", ".join(where[:_PLACES]) + more
        limit, value = number(row.limit, digits=6), _text(row.value, beside)
        rows.append((row.key, limit, row.unit, value, _margin_text(row.margin, beside, word), word, cost, shown))
    return TextTable(
        ("limit", "number", "unit", "nearest", "margin", "", "costs", "where"), tuple(rows), "limits", title
    )


def _text(value: float, size: float) -> str:
    """Return a number's text, 0 where it is rounding error beside a size."""
    return number(value, size, digits=6) if math.isfinite(value) else "none"


def _margin_text(margin: float, beside: float, word: str) -> str:
    """Return a margin's text; at an active limit its error is that of the test for active limits."""
    if not math.isfinite(margin):
        return "none"
    return number(margin, beside, digits=6, part=_ON_LIMIT if word == "active" else NOISE)


def _place(name: str) -> str:
    """Return the place of a limit: its name without the first word."""
    return name.partition(" ")[2]


def outcome_table(combined: CombinedData, tasks: Sequence[SolveResult] = ()) -> TextTable:
    """Return each task at the combined point.

    Args:
        combined: the combined tasks.
        tasks: each task by itself, whose motions tell the error of F.
    """
    robot = None if combined.point is None else combined.point.robot
    rows = []
    for k, task in enumerate(combined.tasks):
        own = tasks[k].robot if k < len(tasks) else None
        sizes: list[float] = []
        if robot is not None and own is not None and own.task is not None:
            sizes = rate_sizes(robot.jacobian, own.task.motion.twist, robot.pose.position)
        F, best = (None if value is None else settled_F(value, sizes) for value in (task.F, task.best))
        loss = None if task.loss is None else settled(task.loss, max(abs(F or 0.0), abs(best or 0.0)))
        if F == best == 0:
            loss = 0.0
        cells = ["none" if value is None else number(value) for value in (F, best, loss)]
        cells[1] += "" if task.unique else " (not unique)"
        verdict = "" if task.verdict is None else task.verdict.value
        rows.append((task.name, task.sense.value, f"{task.weight:g}", *cells, verdict))
    headers = ("task", "sense", "weight", "F", "best alone", "loss", "at this point")
    return TextTable(headers, tuple(rows), "tasks", extra=1)


def margin_table(margins: Sequence[Margin]) -> TextTable:
    """Return every margin: violated and active ones first."""
    rows = []
    for row in sorted(margins, key=lambda each: (not each.violated, not each.active)):
        beside = abs(row.limit) or 1.0
        word = "violated" if row.violated else "active" if row.active else ""
        limit, value = number(row.limit, digits=6), _text(row.value, beside)
        cells = (row.name, row.bound, value, limit, _margin_text(row.margin, beside, word), row.unit, word)
        rows.append(cells)
    return TextTable(("where", "bound", "value", "limit", "margin", "unit", ""), tuple(rows), "margins")


def active_table(result: SolveResult | CombinedData, F: float, *, is_answer: bool) -> TextTable:
    """Return the bounds and limits that the point lies on or outside of, with their multipliers.

    A point that is no answer has no multipliers: the numbers that the solver left say nothing.

    Args:
        result: with evidence.
        F: size of F, of which multipliers have their error.
        is_answer: whether the point is an answer.
    """
    active = () if result.optimality is None else result.optimality.active
    violated = _violated(result)
    headers, rows = ("", "side", "value", "unit", "state", "multiplier"), []
    for side in active:
        slope = number(side.multiplier, abs(F) / (abs(side.value) or 1.0), digits=4)
        state = "violated" if side.name in violated else "active"
        cells = (side.name, side.bound, number(side.value), side.unit or "", state, f"{slope} {slope_unit(side.unit)}")
        rows.append(cells if is_answer else cells[:-1])
    return TextTable(headers if is_answer else headers[:-1], tuple(rows), "active")


def _violated(result: SolveResult | CombinedData) -> Collection[str]:
    """Return the names of the bounds and constraints that a point violates."""
    if isinstance(result, CombinedData):
        return result.violated
    return () if result.reached is None else [side.name for side in result.reached.violated]


def sizes_of_variables(nlp: Nlp) -> list[float]:
    """Return the size of each variable's range in the case's units, beside which its values have rounding error."""
    pairs = zip(nlp.scale, nlp.program.variables, strict=True)
    return [nlp.case.units.shown(float(size), variable.dimension) for size, variable in pairs]


def optimum_table(solution: ProgramSolution, robot: RobotData | None = None) -> TextTable:
    """Return the best of the distinct optima that a solve found: F, and every variable.

    Args:
        solution: of one program.
        robot: at the best of them, whose task tells the error of F.
    """
    units, variables = solution.nlp.case.units, solution.nlp.program.variables
    labels = [(variable.name, units.label(variable.dimension)) for variable in variables]
    widths = sizes_of_variables(solution.nlp)
    rows = []
    for found in solution.optima[:MOST_OPTIMA]:
        spread = f", a set over {100 * found.spread:.0f} % of the ranges" if found.spread > SET else ""
        at = [
            number(units.shown(float(value), variable.dimension), width, digits=6)
            for value, variable, width in zip(found.x, variables, widths, strict=True)
        ]
        F = number(task_F(robot, found.F))
        mode = f", {found.assembly.brief}" if found.assembly is not None and found.assembly.brief else ""
        rows.append((f"F = {F}, {counted(found.count, 'start')}{spread}{mode}", *at))
    headers = ("", *(f"{name}, {unit}" if unit else name for name, unit in labels))
    return TextTable(headers, tuple(rows), "optima")


def origin_table(versions: VersionsData, search: Search | None = None, seconds: float = 0.0) -> TextTable:
    """Return versions, and of a search seed, starts and time: all that the numbers depend on."""
    rows = [(name, str(getattr(versions, name))) for name in versions.fields]
    if search is not None:
        rows += [("seed", str(search.seed)), ("starts", str(search.starts)), ("seconds", f"{seconds:.3g}")]
    return TextTable(("", ""), tuple(rows), "versions")
