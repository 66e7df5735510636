"""Domain of a judgement along a tool path: boxes of its pieces, a box of all its poses, dependent coordinates."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from ....models import FloatArray, frozen_array
from ....models.joints.model.closedform import ClosedForm
from ...case.case import Case
from ...case.pose import Free, Value, ends_of
from ...case.workspace import LARGEST_TURN, TurnKind, Turns, Workspace
from ...errors import CaseError, InputError
from ...evidence.dependent import dependent_of, robot_size
from ...path.arcs import PLANES
from ...path.path import ProgrammedPath
from ..statement.chosen_settings import with_settings
from .path_closing import unknowns_at
from .robot.long_turns import turns_of_path
from .robot.path_cover import PathCover
from .robot.pose_box import PoseBox, pose_box
from .robot.posed_robot import NotJudgedError, Problem, build_problem

#: Relative width of the box of all poses if the path stays at one pose.
_ROOM = 1e-9
#: Largest change of a coordinate that counts as rounding, relative to the robot's size or as an angle.
_STILL = 1e-9


def covered(path: ProgrammedPath, size: float) -> tuple[PathCover, PoseBox, Workspace]:
    """Return the boxes of a path's pieces, the box of all its poses, and the workspace with this box.

    Args:
        path: the tool path.
        size: characteristic size of the robot, length.

    Raises:
        InputError: the path has no motion, or its rotations are not supported.
    """
    if not len(path):
        raise InputError(f"{path.source}: has no motion")
    turns = turns_of_path(path)
    arcs, axes = np.full((len(path), 6), np.nan), np.zeros((len(path), 3), dtype=np.intp)
    k = path.arc_segments
    arcs[k] = path.arcs
    axes[k] = [PLANES[plane] for plane in path.planes.tolist()] if len(k) else np.zeros((0, 3), dtype=np.intp)
    seconds = np.where(np.isfinite(path.durations), path.durations, np.inf)
    settings = path.settings
    cover = PathCover(path.knots[:, :3], arcs, axes, turns, seconds, path.frame, settings.values)
    lower, upper = cover.boxes(cover.pieces)
    low, high = lower.min(axis=0), upper.max(axis=0)
    of_pose = len(low) - len(settings.names)
    if not (high > low)[:of_pose].any():  # a path that stays at one pose
        room = _ROOM * max(float(np.abs(path.knots[:, :3]).max()), size)
        low[0], high[0] = low[0] - room, high[0] + room
    box = PoseBox(
        turns.kind,
        frozen_array((0, 0, 1), (3,)),
        frozen_array(low, low.shape),
        frozen_array(high, high.shape),
        math.inf,
        turns.reference,
        settings=settings.names,
    )
    about = Turns(TurnKind.ANY_AXIS, (Free(-LARGEST_TURN, LARGEST_TURN),))
    if turns.kind is TurnKind.ROLL_PITCH_YAW:
        about = Turns(turns.kind, tuple(_values(2 * np.arctan(low[3:6]), 2 * np.arctan(high[3:6]))))
    return cover, box, Workspace(_values(low[:3], high[:3]), about)


def design_along(case: Case, closed: ClosedForm, box: PoseBox, cover: PathCover) -> Problem:
    """Return the nominal robot with its loop equations and matrices along a path.

    Raises:
        NotJudgedError: the robot cannot be judged, or its loops are not closed at the first point.
    """
    first = cover.points(cover.pieces[:1], 0.0)[0]
    near = partial(unknowns_at, at_settings(case, box, first), closed, box.pose(first))
    design = replace(build_problem(case, closed.model, box, first, near), cover=cover)
    # An equation whose coordinate hardly changes counts as dependent on other equations, but must be satisfied.
    if not np.array_equal(design.start[design.stated], first[[design.free[j] for j in design.stated]]):
        raise NotJudgedError("the loop equations of the robot have no known solution at the first point of the path")
    return design


def at_settings(case: Case, box: PoseBox, at: FloatArray) -> Case:
    """Return the case with the settings at a point (c,) of a path; unchanged for a path without settings."""
    return with_settings(case, dict(zip(box.settings, at[box.of_pose :].tolist(), strict=True)))


def with_dependent(case: Case, box: PoseBox, workspace: Workspace) -> tuple[PoseBox, Workspace]:
    """Return the box of a path and its workspace, with the dependent coordinates of the robot.

    Raises:
        NotJudgedError: the path moves a dependent coordinate, or its rotations are not given by three angles.
    """
    if workspace.turns.kind is not TurnKind.ROLL_PITCH_YAW:
        return box, workspace
    # The settings in the middle of their ranges: dependent coordinates are refused while settings change.
    case = at_settings(case, box, 0.5 * box.lower + 0.5 * box.upper)
    try:
        found = dependent_of(case, workspace)
    except CaseError as error:
        raise NotJudgedError(error.fault) from None
    places = [each.index for each in found.dependent]
    if not places:
        return box, workspace
    if box.settings:
        raise NotJudgedError("dependent coordinates of the pose are not judged while joints change along the path")
    stated, angle = (*workspace.position, *workspace.turns.angles), _STILL
    length = _STILL * robot_size(case, [sum(ends_of(each)) / 2 for each in workspace.position])
    moved = [k for k in places if np.ptp(ends_of(stated[k])) > (length if k < 3 else angle)]
    if moved:
        names, chosen = (
            " and ".join(found.names[k] for k in which) for which in (moved, [k for k in range(6) if k not in places])
        )
        raise NotJudgedError(f"the path changes {names}, but this robot can choose only {chosen} independently")
    wide = pose_box(found)
    lower, upper = box.lower.copy(), box.upper.copy()
    lower[places], upper[places] = wide.lower[places], wide.upper[places]
    lower, upper = frozen_array(lower, (6,)), frozen_array(upper, (6,))
    # Ranges as narrow as rounding errors are not limits.
    still = [sum(ends_of(each)) / 2 if k in places else each for k, each in enumerate(stated)]
    found = replace(found, position=still[:3], turns=replace(found.turns, angles=tuple(still[3:])))
    return replace(box, lower=lower, upper=upper, dependent=tuple(places)), found


def _values(low: FloatArray, high: FloatArray) -> list[Value]:
    """Return ranges, or fixed values where both ends are equal."""
    return [Free(a, b) if b > a else a for a, b in zip(low.tolist(), high.tolist(), strict=True)]
