"""Tables of limits, margins, tasks, optima and motions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..evidence.kkt import ACTIVE
from ..results.data import CombinedData
from ..results.rounding import FLAT, NOISE, rate_sizes, settled, settled_F, task_F
from ..units import Units
from .joints import motion_words
from .lines import SET, counted
from .numbers import number, per_words, quantity_words
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

#: Largest number of named places at which a limit is active.
_PLACES = 3
#: Error of the margin of an active limit, as a fraction of the limit: tolerance of the test for active limits.
_ON_LIMIT = 10 * ACTIVE
#: Error bound of the pitch of a principal motion, as a fraction of the robot's size. Eigenvectors of nearly
#: equal F mix, and robot files give dimensions with six to nine digits.
_EIGENVECTOR = 1e-6
#: Largest number of optima that are shown in full.
MOST_OPTIMA = 12


def principal_table(motions: TaskAnalysis, units: Units, size: float) -> TextTable:
    """Return the motions at which F is stationary: unit rotations, then unit translations.

    Args:
        motions: principal motions.
        units: units of the case.
        size: size of the robot, length.
    """
    rows = []
    for kind in (motions.rotations, motions.translations):
        for rank, motion in zip(("least F", "", "most F"), kind, strict=True):
            words = motion_words(motion.motion, units, size, _EIGENVECTOR)
            rows.append((rank, number(motion.F, kind[-1].F), words))
    title = "principal motions: stationary values of F among unit rotations, then unit translations"
    return TextTable(("", "F", "motion"), tuple(rows), "motions", title)


def limits_title(case: Case, proof: WorkspaceProofData | PathProofData | None = None) -> str:
    """Return the poses at which limits over a domain were checked; empty for limits at stated poses.

    Args:
        case: the case.
        proof: proof of a solved design over the workspace or along the path; None without one.
    """
    if not case.limits_over:
        return ""
    stated = "checked at the stated pose" if case.pose_count == 1 else "checked at the stated poses"
    if proof is None or not proof.poses:
        return f"{stated} only, not {case.limits_where}"
    return f"{stated} and at {case.limits_over} poses that were added as constraints"


def limit_table(limits: Sequence[LimitData], F: float = 0.0, title: str = "") -> TextTable:
    """Return the limits of a case: nearest value, margin, derivative of F, and place.

    Violated limits come first, then active ones.

    Args:
        limits: limits of the case.
        F: size of F, to which the rounding error of derivatives is relative.
        title: title of the table; empty for none.
    """
    rows = []
    for row in sorted(limits, key=lambda each: (not each.violated, not each.active)):
        where = [_place(name) for name in row.violated or row.active] or [_place(row.nearest)]
        more = f" and {len(where) - _PLACES} more" if len(where) > _PLACES else ""
        slope = settled(row.cost or 0.0, abs(F) / (abs(row.limit) or 1.0))
        cost = f"{slope:+.4g} {per_words(row.unit)}" if row.active and slope else ""
        beside = abs(row.limit) or 1.0
        word = "violated" if row.violated else "active" if row.active else ""
        shown = ", ".join(where[:_PLACES]) + more
        limit, value = number(row.limit, digits=6), _text(row.value, beside)
        rows.append((row.key, limit, row.unit, value, _margin_text(row.margin, beside, word), word, cost, shown))
    headers = ("limit", "allowed", "unit", "nearest value", "margin", "status", "change of F", "where")
    return TextTable(headers, tuple(rows), "limits", title, with_unit=(1, 3, 4))


def _text(value: float, size: float) -> str:
    """Return the text of a number; a number within the rounding error of ``size`` is 0."""
    return number(value, size, digits=6) if math.isfinite(value) else "none"


def _margin_text(margin: float, beside: float, word: str) -> str:
    """Return the text of a margin; at an active limit, its error is the tolerance of the test for active limits."""
    if not math.isfinite(margin):
        return "none"
    return number(margin, beside, digits=6, part=_ON_LIMIT if word == "active" else NOISE)


def _place(name: str) -> str:
    """Return the place of a limit: the name without its first word."""
    return quantity_words(name.partition(" ")[2])


def outcome_table(combined: CombinedData, tasks: Sequence[SolveResult] = ()) -> TextTable:
    """Return a row for each task at the combined point.

    Args:
        combined: the combined tasks.
        tasks: results of the separate solves, which give the rounding errors of F.
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
    headers = ("task", "sense", "weight", "F", "separate optimum", "loss", "this point for the task")
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
    headers = ("quantity", "bound", "value", "limit", "margin", "unit", "status")
    return TextTable(headers, tuple(rows), "margins", with_unit=(2, 3, 4))


def active_table(result: SolveResult | CombinedData, F: float, *, is_answer: bool) -> TextTable:
    """Return the active and violated bounds and limits of a point, with their multipliers.

    A point that is not an answer has no multipliers: the multipliers of the solver have no meaning there.

    Args:
        result: result with evidence.
        F: size of F, to which the rounding error of multipliers is relative.
        is_answer: If true, the point is an answer.
    """
    active = () if result.optimality is None else result.optimality.active
    violated = _violated(result)
    headers, rows = ("", "bound", "value", "unit", "status", "multiplier"), []
    for side in active:
        slope = number(side.multiplier, abs(F) / (abs(side.value) or 1.0), digits=4)
        state = "violated" if side.name in violated else "active"
        cells = (
            side.name,
            side.bound,
            number(side.value),
            side.unit or "",
            state,
            f"F better by {slope} {per_words(side.unit)} relaxed",
        )
        rows.append(cells if is_answer else cells[:-1])
    return TextTable(headers if is_answer else headers[:-1], tuple(rows), "active", with_unit=(2,))


def _violated(result: SolveResult | CombinedData) -> Collection[str]:
    """Return the names of the bounds and constraints that a point violates."""
    if isinstance(result, CombinedData):
        return result.violated
    return () if result.reached is None else [side.name for side in result.reached.violated]


def sizes_of_variables(nlp: Nlp) -> list[float]:
    """Return the widths of the variables' ranges in the case's units; rounding errors are relative to these widths."""
    pairs = zip(nlp.scale, nlp.program.variables, strict=True)
    return [nlp.case.units.shown(float(size), variable.dimension) for size, variable in pairs]


def optimum_table(solution: ProgramSolution, robot: RobotData | None = None) -> TextTable:
    """Return the best of the distinct optima of a solve: F, and every variable.

    Args:
        solution: solution of one nonlinear program.
        robot: robot at the best optimum, which gives the rounding error of F; None if unknown.
    """
    units, variables = solution.nlp.case.units, solution.nlp.program.variables
    labels = [(variable.name, units.label(variable.dimension)) for variable in variables]
    widths = sizes_of_variables(solution.nlp)
    rows = []
    for found in solution.optima[:MOST_OPTIMA]:
        spread = f", a set over {100 * found.spread:.0f} % of the ranges" if found.spread > SET else ""
        at = [
            number(units.shown(float(value), variable.dimension), width, digits=6, part=FLAT)
            for value, variable, width in zip(found.x, variables, widths, strict=True)
        ]
        F = number(task_F(robot, found.F))
        mode = f", {found.assembly.brief}" if found.assembly is not None and found.assembly.brief else ""
        rows.append((f"F = {F}, {counted(found.count, 'start')}{spread}{mode}", *at))
    headers = ("", *(f"{name}, {unit}" if unit else name for name, unit in labels))
    return TextTable(headers, tuple(rows), "optima")


def origin_table(versions: VersionsData, search: Search | None = None, seconds: float = 0.0) -> TextTable:
    """Return everything on which results depend: versions, and seed, starts and time of a search."""
    rows = [(name, str(getattr(versions, name))) for name in versions.fields]
    if search is not None:
        rows += [("seed", str(search.seed)), ("starts", str(search.starts)), ("seconds", f"{seconds:.3g}")]
    return TextTable(("", ""), tuple(rows), "versions")
