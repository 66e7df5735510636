"""Search for the best design and schedule of a case, with the best constant setting beside it.

Dynamic programming gives a schedule for each of several designs, and Ipopt moves design and schedule together from
there. The best one is searched once more on a finer grid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....models import FloatArray
from ....models.mechanism.motions import rotation_matrix
from ....models.rotation import axis_angle_from_matrix
from ...case.case import Case
from ...case.pathfile import TURN
from ...case.pose import OverPoses, Rotation
from ...case.settings import Search
from ...case.task import Method, Sense, Task
from ...interruption import Milestone, is_requested, reached
from ...path.path import Poses
from ...path.settings import changing_of
from ...program.formulation import formulate
from ..compromise import solution_of_one_task
from ..multistart import solve_program
from ..scheduled import ConstantSetting, Schedule
from ..solution import Solution
from ..status import Status
from .cells import CellBound, cell_bound, check_certified
from .dynamic import constants, seeds
from .exchange import ProvedSchedule, exchanged
from .formulation import schedule_problem
from .polish import Polished, polish
from .problem import ScheduleProblem, ends

#: Largest number of designs from which the search begins.
_DESIGNS = 8

#: Function to call after each design: number of designs done, number of all, and best objective so far.
DesignProgress = Callable[[int, int, float | None], None]


def solve_schedule(
    case: Case,
    *,
    starts: int | None = None,
    seed: int | None = None,
    gap: float | None = None,
    progress: DesignProgress | None = None,
) -> Solution:
    """Return the best design and schedule found for a case with an objective over its path.

    The point of the solution is the robot at the first point of the path.

    Args:
        case: the case.
        starts: number of designs from which the search begins; the case's number, at most 8, if left out.
        seed: seed of these designs; the case's seed if left out.
        gap: relative gap to which a bound of all schedules is proved; None for no bound.
        progress: function to call after each design.

    Raises:
        CaseError: the case is not supported along a path, or the bound has more than two settings.
        InputError: the path cannot be read.
    """
    began = time.perf_counter()
    problem = schedule_problem(case)
    if gap is not None:
        check_certified(problem)
    search = case.search.but(starts, seed)
    designs = _designs(problem, search)
    found: list[Polished] = []
    fixed: list[Polished] = []
    for done, d in enumerate(designs):
        if is_requested() and found:
            break
        coarse = len(designs) > 1
        held = _constants(problem, d, fine=not coarse)
        fixed += held
        found += [*held, *_schedules(problem, d, held, fine=not coarse)]
        if progress is not None:
            values = [each.value for each in found]
            progress(done + 1, len(designs), problem.sign * max(values) if values else None)
    if not found:
        return _solution(problem, None, None, None, began, search)
    best = max(found, key=lambda each: each.value)
    if len(designs) > 1:
        constant = max(fixed, key=lambda each: each.value, default=None)
        found += _schedules(problem, best.d, [] if constant is None else [constant], fine=True)
        best = max(found, key=lambda each: each.value)
    constant = max(fixed, key=lambda each: each.value, default=None)
    proved = exchanged(problem, best) if case.limits_over else None
    if proved is not None:
        best = _at_stated_points(problem, proved)
    reached(Milestone.START)
    bound = None if gap is None else cell_bound(problem, best.d, best.value, gap)
    return _solution(problem, best, constant, bound, began, search, proved)


def _at_stated_points(problem: ScheduleProblem, proved: ProvedSchedule) -> Polished:
    """Return a schedule that was solved at further points, at the points of the problem, with its objective there."""
    new, old = (each.points.points.segments + each.points.points.parameters for each in (proved.problem, problem))
    s = proved.schedule.s[np.isin(new, old)]
    return Polished(proved.schedule.d, s, problem.value(proved.schedule.d, s))


def _designs(problem: ScheduleProblem, search: Search) -> list[FloatArray]:
    """Return the designs (n,) from which the search begins: the first values, then random ones."""
    low, high, first = ends(problem.design)
    if not len(first):
        return [first]
    rng = np.random.default_rng(search.seed)
    count = min(search.starts, _DESIGNS)
    return [first, *(rng.uniform(low, high) for _ in range(count - 1))]


def _constants(problem: ScheduleProblem, d: FloatArray, *, fine: bool) -> list[Polished]:
    """Return the best constant settings near the best ones of a grid, with the design moved too."""
    count = len(problem.points)
    found = []
    for s in constants(problem, d, fine=fine):
        start = np.repeat(np.reshape(s, (1, -1)), count, axis=0)
        found.append(polish(problem, d, start, constant=True, near=False))
    kept = [each for each in found if each is not None]
    return [max(kept, key=lambda each: each.value)] if kept else []


def _schedules(problem: ScheduleProblem, d: FloatArray, held: list[Polished], *, fine: bool) -> list[Polished]:
    """Return the schedules near those of dynamic programming, and near the best constant."""
    if not problem.settings:
        return []
    constant = held[0].s[0] if held else ends(problem.settings)[2]
    starts = [(d, s) for s in seeds(problem, d, constant, fine=fine)]
    starts += [(each.d, each.s) for each in held]
    found = [polish(problem, *start) for start in starts]
    return [each for each in found if each is not None]


def _solution(
    problem: ScheduleProblem,
    best: Polished | None,
    constant: Polished | None,
    bound: CellBound | None,
    began: float,
    search: Search,
    proved: ProvedSchedule | None = None,
) -> Solution:
    """Return the solution: the robot at the first point of the path, with its schedule."""
    case, sign = problem.case, problem.sign
    d, s = (ends(problem.design)[2], ends(problem.settings)[2]) if best is None else (best.d, best.s[0])
    start = at_point(problem, d, s)
    start = replace(start, tasks=start.tasks[:1], method=Case.method)
    own = solve_program(formulate(start), replace(search, starts=1), jobs=1)
    # That no schedule was found does not prove that none exists.
    status = Status.NOT_CONVERGED if best is None else Status.LOCAL
    if proved is not None and not proved.judgement.is_proved:
        status = Status.INTERRUPTED if is_requested() else Status.NOT_PROVED
    seconds = time.perf_counter() - began
    own = replace(own, status=status, seconds=seconds)
    found = replace(solution_of_one_task(start, own), case=case, status=status, seconds=seconds)
    if best is None:
        return found
    units = case.units
    unit = np.array([units.shown(1.0, each.dimension) for each in problem.settings])
    held = None
    if constant is not None:
        held = ConstantSetting(constant.s[0] * unit, sign * constant.value, _shown_design(problem, constant.d))
    # Rows at the further points keep the limits between the points of the problem.
    shown, rows = (problem, best) if proved is None else (proved.problem, proved.schedule)
    schedule = Schedule(
        names=tuple(each.name for each in problem.settings),
        dimensions=tuple(each.dimension for each in problem.settings),
        units=units,
        values=rows.s * unit,
        times=shown.points.times,
        poses=Poses(shown.points.positions, shown.points.rotations),
        feeds=shown.points.feeds,
        F=sign * shown.combined(shown.at(rows.d, rows.s).objective),
        over=case.over_path or OverPoses.MEAN,
        value=sign * best.value,
        constant=held,
        rates=np.array([each.rate for each in problem.settings], dtype=np.float64) * unit,
        design=_shown_design(problem, best.d),
        bound=None if bound is None or not math.isfinite(bound.bound) else sign * bound.bound,
        reason="" if bound is None else bound.reason,
        sign=sign,
        seconds=seconds,
        judgement=None if proved is None else proved.judgement,
        added=0 if proved is None else proved.added,
        is_home_mode=bool(case.model.unknowns),
    )
    return replace(found, schedule=schedule)


def _shown_design(problem: ScheduleProblem, d: FloatArray) -> dict[str, float]:
    """Return the values of a design (n,) in the case's units, by name."""
    named = zip(problem.design, d.tolist(), strict=True)
    return {each.name: problem.case.units.shown(value, each.dimension) for each, value in named}


def at_point(problem: ScheduleProblem, d: FloatArray, s: FloatArray, index: int = 0) -> Case:
    """Return the case of the robot at one point of the path: fixed design, settings, pose and motions.

    Several motions are combined by a weighted sum, as those of one point are.

    Args:
        problem: the problem.
        d: (n,) design.
        s: (k,) settings at the point.
        index: index of the point.
    """
    case, points = problem.case, problem.points
    values = {
        each.name: float(value) for each, value in zip((*problem.design, *problem.settings), (*d, *s), strict=True)
    }
    rotation, axis, changing = points.rotations[index], np.array([0.0, 0.0, 1.0]), changing_of(case)
    if changing.axis is not None:
        axis = rotation @ changing.axis
        rotation = rotation @ rotation_matrix(changing.axis * values.pop(TURN, changing.turn))
    p = points.positions[index]
    twists = {
        "feed": (0.0, 0.0, 0.0, *points.feeds[index]),
        "thrust": (0.0, 0.0, 0.0, *axis),
        "tool": (*axis, *np.cross(p, axis)),
    }
    tasks: list[Task] = []
    for task in case.tasks:
        if task.measure:
            tasks.append(Task((0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Sense.MIN, task.name, is_stated=False))
        else:
            tasks.append(replace(task, twist=twists[task.follows], follows="") if task.follows else task)
    return replace(
        case.with_components(values),
        position=tuple(p.tolist()),
        rotation=Rotation(*axis_angle_from_matrix(rotation)),
        tasks=tuple(tasks),
        path=None,
        over_path=None,
        method=Method.WEIGHTED_SUM if len(tasks) > 1 else Case.method,
    )
