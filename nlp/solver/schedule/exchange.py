"""Schedules that keep their limits between the points too, by an exchange of places of the path.

The schedule is verified along the whole path. Places that refute a limit become points, where the limits are tighter by
a margin, and the schedule is solved again from the last one, until the proof succeeds.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....models import FloatArray
from ...case.case import Case
from ...case.pathfile import TURN
from ...interruption import is_requested
from ...path.dividing import divided_path
from ...path.path import ProgrammedPath
from ...path.reader import path_without_settings
from ...path.sampling import Points
from ...path.settings import Settings, ToolTurn, changing_of
from ...path.waypoints import Waypoints, with_places
from ...proof.workspace.judgement import Judgement
from ...proof.workspace.path_judge import judge_path
from .polish import Polished, polish, within_rates
from .problem import ScheduleProblem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Margins of the limits at added and at all other points, relative to the limits, as a limit that is exactly reached
#: cannot be proved; and gap of the proofs.
_MARGIN, _LEAST, _GAP = 1e-4, 2e-6, 1e-4
#: Largest margin of strokes, relative to them.
_LARGEST = 1e-3
#: Largest number of proofs.
_MOST = 12
#: Fractions of the way between two points at which limits are sampled for further places.
_PARTS = (0.25, 0.5, 0.75)


class ProvedSchedule(NamedTuple):
    """Schedule with its verdicts along the whole path.

    Attributes:
        problem: the problem with the added points.
        schedule: the schedule at its points.
        judgement: verdicts on ranks and limits at every point of the path.
        added: number of added points.
    """

    problem: ScheduleProblem
    schedule: Polished
    judgement: Judgement
    added: int


def exchanged(problem: ScheduleProblem, schedule: Polished) -> ProvedSchedule:
    """Return the schedule near a given one that keeps its limits along the whole path, as far as that is found.

    Args:
        problem: problem with the points of the path.
        schedule: schedule that keeps the limits at these points.
    """
    path, first = path_without_settings(problem.case), len(problem.points)
    judged = _judged(problem, schedule, path)
    for _ in range(_MOST):
        added = len(problem.points) - first
        places = [] if judged.is_proved or is_requested() else _places(problem, schedule, judged)
        tighter = _tighter(problem, judged)
        if judged.is_proved or is_requested() or not (places or tighter > problem.extent_margin):
            return ProvedSchedule(problem, schedule, judged, added)
        finer, own = _with_points(problem, path, schedule, places) if places else (problem, schedule.s)
        finer = replace(finer, extent_margin=tighter)
        found = polish(finer, schedule.d, own)
        if found is None:
            return ProvedSchedule(problem, schedule, judged, added)
        problem, schedule = finer, found
        judged = _judged(problem, schedule, path)
    return ProvedSchedule(problem, schedule, judged, len(problem.points) - first)


def _with_points(
    problem: ScheduleProblem, path: ProgrammedPath, schedule: Polished, places: list[tuple[int, float]]
) -> tuple[ScheduleProblem, FloatArray]:
    """Return the problem with further points, at (segment, parameter), and the settings (N, k) at all points.

    The settings do not change, so the new ones keep the rates too.
    """
    points, before = problem.points, np.array(places)
    finer = with_places(path, points, before)
    old, new = (each.points.segments + each.points.parameters for each in (points, finer))
    own = np.stack([np.interp(new, old, column) for column in schedule.s.T], axis=1)
    margins = np.where(np.isin(new, before.sum(axis=1)), _MARGIN, _LEAST)
    known = np.isin(new, old)
    margins[known] = _LEAST if problem.margins is None else problem.margins
    refined = replace(problem, points=finer, margins=margins)
    return refined, within_rates(refined, own)


def _tighter(problem: ScheduleProblem, judged: Judgement) -> float:
    """Return the margin of strokes after a proof: larger, up to a largest one, if a stroke failed or is undecided."""
    names = {each.name for own in problem.extents for each in own}
    failed = any(each.claim.name in names and each.fails for each in judged.verdicts)
    if not failed or problem.extent_margin >= _LARGEST:
        return problem.extent_margin
    return max(2 * problem.extent_margin, _MARGIN)


def _judged(problem: ScheduleProblem, schedule: Polished, path: ProgrammedPath) -> Judgement:
    """Return the verdicts on the limits along the whole path with the settings of a schedule."""
    case = fixed_design(problem, schedule.d)
    return judge_path(case, with_schedule(case, problem, schedule, path), gap=_GAP, limits_only=True)


def fixed_design(problem: ScheduleProblem, d: FloatArray) -> Case:
    """Return the case with the values (n,) of its free design, and free settings."""
    names = (each.name for each in problem.design)
    return problem.case.with_components(dict(zip(names, d.tolist(), strict=True)))


def with_schedule(case: Case, problem: ScheduleProblem, schedule: Polished, path: ProgrammedPath) -> ProgrammedPath:
    """Return the path, divided at the points of a problem, with the values of a schedule."""
    changing, columns = changing_of(case), {each.name: k for k, each in enumerate(problem.settings)}
    found = divided_path(path, problem.points.points)
    if changing.axis is not None:
        turn = schedule.s[:, columns[TURN]] if TURN in columns else np.full(len(schedule.s), changing.turn)
        found = replace(found, tool=ToolTurn(changing.axis, turn))
    names = [name for name in columns if name in changing.own]
    if names:
        values = schedule.s[:, [columns[name] for name in names]]
        found = replace(found, settings=Settings(tuple(changing.own[name] for name in names), values))
    return found


def _places(problem: ScheduleProblem, schedule: Polished, judged: Judgement) -> list[tuple[int, float]]:
    """Return the places (segment, parameter) of the path at which limits are refuted, in order."""
    points = problem.points.points
    starts, begin = points.segments[:-1], points.parameters[:-1]
    end = np.where(points.segments[1:] == starts, points.parameters[1:], 1.0)
    found = set[tuple[int, float]]()
    for each in judged.verdicts:
        for place in () if each.place is None else (each.place,):
            if each.fails and 0 < place.parameter < 1:
                k = place.segment
                found.add((int(starts[k]), float(begin[k] + place.parameter * (end[k] - begin[k]))))
    found |= _sampled(problem, schedule, starts, begin, end)
    known = set(zip(points.segments.tolist(), points.parameters.tolist(), strict=True))
    return sorted(found - known)


def _sampled(
    problem: ScheduleProblem, schedule: Polished, segments: NDArray[np.intp], begin: FloatArray, end: FloatArray
) -> set[tuple[int, float]]:
    """Return the sampled place with the largest excess over a limit between each two points that have one."""
    path, excess, places = path_without_settings(problem.case), [], []
    for part in _PARTS:
        at = begin + part * (end - begin)
        poses = path.poses_at(segments, at)
        own = schedule.s[:-1] + part * np.diff(schedule.s, axis=0)
        feeds, weights = problem.points.feeds[:-1], problem.points.weights[:-1]
        points = Waypoints(
            Points(segments, at), poses.positions, poses.rotations, feeds, problem.points.seconds, weights
        )
        middle = replace(problem, points=points, margins=None)
        excess.append(middle.at(schedule.d, own).excess.max(axis=1, initial=-np.inf))
        places.append(at)
    worst, largest = np.argmax(excess, axis=0), np.max(excess, axis=0)
    return {(int(segments[k]), float(places[worst[k]][k])) for k in np.flatnonzero(largest > 0).tolist()}
