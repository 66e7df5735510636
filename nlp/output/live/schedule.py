"""Live view of a schedule: the robot along its path with its settings, and the best constant settings beside them."""

from __future__ import annotations

import base64
import gzip
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ....models import FloatArray
from ....models.instance import length_of
from ...case.case import Case
from ...case.pathfile import TURN
from ...case.pose import Free, OverPoses, ends_of
from ...path.settings import changing_of
from ...path.waypoints import Waypoints
from ...program.nlp import Nlp
from ...results.objective import unit_of_objective
from ...results.schedule import schedule_data
from ...solver.schedule.dynamic import grid_of
from ...solver.schedule.formulation import schedule_problem
from ...solver.schedule.problem import ScheduleProblem
from ...solver.schedule.search import at_point
from ...solver.solution import Solution
from ...view.source import ViewSource, view_or_drawing
from ...words.numbers import number
from ...words.schedule import (
    gain_words,
    no_schedule_line,
    objective_name,
    schedule_lines,
    schedule_task_lines,
    search_words,
)
from .page import LivePage, LiveParts, Track, live_page, live_parts
from .posing import pose_places, with_free_pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...solver.scheduled import Schedule

#: Largest number of points of a page, and of columns and rows of a map.
_POINTS, _COLUMNS, _ROWS = 1000, 200, 160
#: Number of turns about the tool at which rotations are compared.
_TURNS = 61
#: Largest size of the packed table of the schedule, characters.
_TABLE = 400_000
#: Value of a map where a limit is violated, and the values of the smallest and the largest objective.
_FORBIDDEN, _LOW, _HIGH = 0, 1, 255


class _Along(NamedTuple):
    """Schedule in the units of computations.

    Attributes:
        schedule: the schedule.
        problem: its problem, at the points of the schedule.
        d: (n,) design.
        s: (N, k) settings.
        units: (k,) units of the settings.
        seconds: (N - 1,) time from each point to the next; NaN without stated times.
        shown: indices of the points of the page.
    """

    schedule: Schedule
    problem: ScheduleProblem
    d: FloatArray
    s: FloatArray
    units: FloatArray
    seconds: FloatArray
    shown: NDArray[np.intp]


def schedule_page(solution: Solution, command: str) -> LivePage:
    """Return the live page of a solved case with an objective along its path; for arguments see :func:`.live_parts`."""
    source, track = _shown(solution)
    return live_page(source, None, command, track)


def schedule_parts(solution: Solution, command: str) -> LiveParts:
    """Return the pieces of the page of :func:`schedule_page`, for the first screen of another page."""
    source, track = _shown(solution)
    return live_parts(source, None, command, track)


def _shown(solution: Solution) -> tuple[ViewSource, Track | None]:
    """Return the view of the robot and its track along the path; without a schedule, the first point and None."""
    if solution.schedule is None:
        return view_or_drawing(_without_schedule(solution)), None
    along = _along(solution)
    source = view_or_drawing(_case_along(along))
    return source, _track(solution, along, source.subject.nlp)


def _without_schedule(solution: Solution) -> Case:
    """Return the case at the first point of the path, with a title that says that no schedule was found."""
    title = (
        f"{solution.case.title or solution.case.name}: first point of the path. {no_schedule_line(solution.case).words}"
    )
    return replace(solution.outcomes[0].own.nlp.case, title=title)


def _along(solution: Solution) -> _Along:
    """Return the schedule of a solution in the units of computations."""
    schedule, problem = solution.schedule, schedule_problem(solution.case)
    if schedule is None:
        raise TypeError("the solution has no schedule")
    units, count = schedule.units, len(schedule.values)
    factors = np.array([units.to_internal(1.0, each) for each in schedule.dimensions])
    seconds = np.diff(schedule.times)
    # Points that a proof has added are points of the schedule too.
    points = Waypoints(
        problem.points.points,
        schedule.poses.positions,
        schedule.poses.rotations,
        schedule.feeds,
        seconds,
        np.full(count, 1 / count),
    )
    return _Along(
        schedule=schedule,
        problem=replace(problem, points=points, margins=None),
        d=_design(problem, schedule.design),
        s=schedule.values * factors,
        units=factors,
        seconds=seconds,
        shown=np.unique(np.linspace(0, count - 1, min(count, _POINTS)).round().astype(np.intp)),
    )


def _design(problem: ScheduleProblem, values: Mapping[str, float]) -> FloatArray:
    """Return the design (n,) in the units of computations, from values by name in the case's units."""
    units = problem.case.units
    return np.array([units.to_internal(values[each.name], each.dimension) for each in problem.design])


def _case_along(along: _Along) -> Case:
    """Return the case of the robot at the first point, with the poses and settings of the path as its ranges."""
    problem = along.problem
    start = at_point(problem, along.d, along.s[0])
    settings = {each.name: Free(each.lower, each.upper) for each in problem.settings if each.name != TURN}
    size = length_of(start.model, start.fixed_parameters("the first point has fixed dimensions").tolist())
    # The page evaluates points of the path, and needs no optimum of the pose.
    posed = replace(start.with_components(settings), search=start.search.but(1, None))
    return with_free_pose(posed, problem.points.positions, _largest_turn(along), size)


def _largest_turn(along: _Along) -> float:
    """Return the largest rotation of the platform along the path, radians, over the whole range of its turn."""
    q, changing = along.schedule.quaternions, changing_of(along.problem.case)
    if changing.axis is None:
        return float(2 * np.arccos(np.clip(np.abs(q[:, 0]), 0.0, 1.0)).max())
    half = 0.5 * np.linspace(*ends_of(changing.ranges.get(TURN, changing.turn)), _TURNS)
    real = np.outer(q[:, 0], np.cos(half)) - np.outer(q[:, 1:] @ changing.axis, np.sin(half))
    return float(2 * np.arccos(np.clip(np.abs(real), 0.0, 1.0)).max())


def _track(solution: Solution, along: _Along, nlp: Nlp) -> Track:
    """Return the points of a path with their settings, and the texts and maps of the page."""
    schedule, case = along.schedule, solution.case
    positions, quaternions = along.problem.points.positions, schedule.quaternions
    vectors = quaternions[:, 1:] * np.where(quaternions[:, :1] < 0, -1.0, 1.0)
    places = pose_places(nlp)
    numbers = dict(zip(nlp.case.scalars, nlp.program.places.numbers, strict=True))
    settings = [-1 if each == TURN else numbers[each].index for each in schedule.names]
    is_timed = bool(np.isfinite(schedule.times).all())
    at = schedule.times if is_timed else np.arange(float(len(schedule.times)))
    x = nlp.start.copy()
    start = solution.outcomes[0].own
    x[list(nlp.program.places.inner)] = start.x[list(start.nlp.program.places.inner)]
    x[places] = [*positions[0], *vectors[0]]
    for k, place in enumerate(settings):
        if place >= 0:
            x[place] = along.s[0, k]
    frames = [
        {
            "words": f"point {k + 1:,} of {len(at):,}{f', {number(float(at[k]), digits=5)} s' if is_timed else ''}",
            "at": float(at[k]),
            "values": [*positions[k].tolist(), *vectors[k].tolist()],
        }
        for k in along.shown.tolist()
    ]
    count = len(frames)
    data = {
        "places": places,
        "frames": frames,
        "path": positions[along.shown].tolist(),
        "nearest": [-1] * count,
        "margins": [None] * count,
        "limits": [],
        "most": 1,
        "marks": [],
        "panels": [],
        "first": 0,
        "schedule": _schedule_data(solution, along, nlp, settings),
    }
    shown = schedule_data(schedule)
    (first, *_) = schedule_lines(case, shown)
    return Track(x, data, schedule.names, getattr(first, "words", ""), tuple(schedule_task_lines(case)))


def _schedule_data(solution: Solution, along: _Along, nlp: Nlp, places: list[int]) -> dict[str, Any]:
    """Return the part of the track that only a schedule has; see ``ScheduleData`` in ``schedule.js``."""
    schedule, problem, case = along.schedule, along.problem, solution.case
    reach, step = _reach(along)
    factors, shown = 1 / along.units, along.shown.tolist()
    rates = schedule.rates.tolist()
    numbers = dict(zip(nlp.case.scalars, nlp.program.places.numbers, strict=True))
    table = base64.b64encode(gzip.compress(schedule.to_csv().encode(), mtime=0)).decode("ascii")
    changing = changing_of(case)
    return {
        "settings": [
            {
                "name": each.name,
                "unit": schedule.units.label(each.dimension),
                "factor": float(factors[k]),
                "low": each.lower,
                "high": each.upper,
                "rate": rates[k] if math.isfinite(rates[k]) else None,
                "place": places[k],
            }
            for k, each in enumerate(problem.settings)
        ],
        "rows": along.s[along.shown].tolist(),
        "reach": reach[shown].tolist(),
        "step": _finite(step[shown]),
        "rates": _finite(_rates(along)[shown]),
        "F": schedule.F[along.shown].tolist(),
        "value": schedule.value,
        "constant": _constant(along),
        "design": {
            "places": [numbers[each.name].index for each in problem.design],
            "values": along.d.tolist(),
        },
        "feeds": problem.points.feeds[along.shown].tolist(),
        "axis": None if changing.axis is None else changing.axis.tolist(),
        "turn": changing.turn,
        "follows": [each.follows for each in case.tasks],
        "weights": [each.weight for each in case.tasks],
        "measure": case.tasks[0].measure,
        "length": case.tasks[0].length or 1.0,
        "isWorst": case.over_path is OverPoses.WORST,
        "sign": schedule.sign,
        "unit": unit_of_objective(case),
        "isTimed": bool(np.isfinite(schedule.times).all()),
        "isAnswer": solution.status.is_answer,
        "name": objective_name(case),
        **_texts(solution, schedule),
        "maps": [_map(along, k) for k in range(len(problem.settings))],
        "hasSlopes": len(case.tasks) == 1 and not case.tasks[0].measure,
        "table": table if len(table) <= _TABLE else None,
    }


def _texts(solution: Solution, schedule: Schedule) -> dict[str, Any]:
    """Return the headlines of the schedule and of the best constant."""
    data, unit, name = schedule_data(schedule), unit_of_objective(solution.case), objective_name(solution.case)
    gain = gain_words(data)
    bound = "" if data.statement is None else f"{data.statement} (proved)"
    proved = "" if data.proved is None else "limits proved at every point of the path" if data.proved else ""
    free = bool(schedule.names or schedule.design)
    words = [f"found by the program: {search_words(data)}" if free else "no value is free", proved, bound]
    held = None
    if data.constant is not None:
        held = {
            "value": f"{name} = {number(data.constant.value)} {unit}".rstrip(),
            "word": "best constant",
            "words": "found by the program, with a grid and Ipopt; the same values at all points",
        }
    return {
        "schedule": {
            "value": f"{name} = {number(data.value)} {unit}".rstrip(),
            "word": "locally optimal" if solution.status.is_answer else solution.status.value,
            "words": "; ".join(each for each in (gain, *words) if each),
        },
        "held": held,
    }


def _constant(along: _Along) -> dict[str, Any] | None:
    """Return the best constant settings with their design and their objective at each point; None without them."""
    constant, problem = along.schedule.constant, along.problem
    if constant is None or not along.schedule.names:
        return None
    row, d = constant.values * along.units, _design(problem, constant.design)
    found = problem.at(d, np.repeat(row[None, :], len(along.s), axis=0))
    F = along.schedule.sign * problem.combined(found.objective)
    return {"row": row.tolist(), "design": d.tolist(), "F": F[along.shown].tolist(), "value": constant.value}


def _reach(along: _Along) -> tuple[FloatArray, FloatArray]:
    """Return the ranges (N, k, 2) of each setting that its rate reaches from both neighbours, and steps (N, k).

    A step is the largest change from the nearer one of the neighbours. Along a closed path with ``periodic``, the first
    and the last point have neighbours on both sides.
    """
    s, steps = along.s, along.problem.steps
    count, settings = s.shape
    low = np.array([each.lower for each in along.problem.settings])
    high = np.array([each.upper for each in along.problem.settings])
    reach = np.empty((count, settings, 2))
    reach[:, :, 0], reach[:, :, 1] = low, high
    step = np.full((count, settings), math.inf)
    pairs = [(i, i + 1, i) for i in range(count - 1)]
    if along.problem.is_periodic and count > 2:
        pairs += [(count - 2, 0, count - 2), (count - 1, 1, 0)]
    for a, b, segment in pairs:
        for here, there in ((a, b), (b, a)):
            reach[here, :, 0] = np.maximum(reach[here, :, 0], s[there] - steps[segment])
            reach[here, :, 1] = np.minimum(reach[here, :, 1], s[there] + steps[segment])
            step[here] = np.minimum(step[here], steps[segment])
    return reach, step


def _rates(along: _Along) -> FloatArray:
    """Return the rates (N, k) from each point to the next, in the case's units; at the last point, to this point."""
    rates = np.diff(along.schedule.values, axis=0) / along.seconds[:, None]
    return np.vstack([rates, rates[-1:]])


def _map(along: _Along, k: int) -> dict[str, Any]:
    """Return the objective over path and a setting, one byte a value, column by column."""
    schedule = along.schedule
    grid = grid_of(along.problem, along.d, along.s, k)
    columns = np.unique(np.linspace(0, len(grid.stages) - 1, min(len(grid.stages), _COLUMNS)).round().astype(np.intp))
    rows = np.unique(np.linspace(0, len(grid.values) - 1, min(len(grid.values), _ROWS)).round().astype(np.intp))
    values = grid.objective[np.ix_(columns, rows)] * schedule.sign
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    part = np.where(known, (np.where(known, values, low) - low) / ((high - low) or 1.0), 0.0)
    shades = np.where(known, _LOW + np.rint((_HIGH - _LOW) * part), _FORBIDDEN).astype(np.uint8)
    is_timed = bool(np.isfinite(schedule.times).all())
    at = schedule.times[grid.stages[columns]] if is_timed else grid.stages[columns].astype(float)
    return {
        "at": at.tolist(),
        "rows": len(rows),
        "low": low,
        "high": high,
        "shades": base64.b64encode(shades.tobytes()).decode("ascii"),
    }


def _finite(values: FloatArray) -> list[list[float | None]]:
    """Return rows of numbers for JSON, with null for numbers that are not finite."""
    return [[each if math.isfinite(each) else None for each in row] for row in values.tolist()]
