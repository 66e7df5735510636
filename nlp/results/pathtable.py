"""Table of actuator coordinates along a path, for controllers: knots with times, poses, speeds and accelerations.

Speeds and accelerations are differences between knots, for actuators that move linearly from knot to knot. Settings
have a column for their value and, with times, one for their rate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import Dimension, FloatArray
from ...models.statics import driven_joints
from ..case.pathfile import TURN
from ..path.options import Between
from ..path.orientation import ORDERS
from ..system.csvtext import csv_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..case.case import Case
    from ..path.path import ProgrammedPath
    from ..proof.workspace.path_knots import Knots

#: Number of rows that are computed at once.
_BLOCK = 2**14
#: Columns of the pose.
_POSE = ("x", "y", "z", "roll", "pitch", "yaw")


class KnotMotion(NamedTuple):
    """Motion of the actuators between K knots of a path, in radians; NaN where no time is stated.

    Attributes:
        times: (K,) seconds from the start; a segment without a time counts 0.
        speeds: (K, a) speeds of the motion that ends at each knot.
        accelerations: (K, a) change of the speed at each knot, divided by the mean time of both adjacent motions.
    """

    times: FloatArray
    speeds: FloatArray
    accelerations: FloatArray


def knot_motion(path: ProgrammedPath, knots: Knots) -> KnotMotion:
    """Return the motion of the actuators between knots."""
    k, s, q = knots.segments, knots.parameters, knots.coordinates
    durations = np.nan_to_num(path.durations)
    begins = np.concatenate([[0.0], np.cumsum(durations)[:-1]])
    before = np.where(k[1:] == k[:-1], s[:-1], 0.0)
    seconds = np.concatenate([[np.nan], (s[1:] - before) * path.durations[k[1:]]])[:, None]
    speeds = np.concatenate([np.full((1, q.shape[1]), np.nan), np.diff(q, axis=0)]) / seconds
    mean = 0.5 * (seconds[1:] + seconds[:-1])
    changes = np.diff(speeds, axis=0) / mean
    accelerations = np.concatenate([changes, np.full((1, q.shape[1]), np.nan)])
    return KnotMotion(begins[k] + s * durations[k], speeds, accelerations)


def _angles(path: ProgrammedPath, k: NDArray[np.intp], s: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw (K, 3) at places of a path, before the turn about the tool.

    If the file has these angles, they are those of the file.
    """
    if path.between is Between.ANGLES and path.order == ORDERS["rpy"] and path.frame is None:
        start = path.knots[k, 3:]
        return np.asarray(start + s[:, None] * (path.knots[k + 1, 3:] - start))
    R = rotations
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    found = [np.arctan2(R[:, 2, 1], R[:, 2, 2]), pitch, np.arctan2(R[:, 1, 0], R[:, 0, 0])]
    return np.stack(found, axis=1)


def path_settings(case: Case, path: ProgrammedPath) -> list[tuple[str, Dimension]]:
    """Return the names and dimensions of the values that change along a path: the turn, then dimensions of the robot.

    A path with a fixed turn has it too.
    """
    kinds = {name: item.dimension for item in case.model.parameters for name in item.components}
    turn = [] if path.tool is None else [(TURN, Dimension.ANGLE)]
    return [*turn, *((case.parameter_name(name), kinds[name]) for name in path.settings.names)]


def settings_at(path: ProgrammedPath, k: NDArray[np.intp], s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the values (K, d) of :func:`path_settings` at places of a path, and their changes over whole segments."""
    values, changes = path.settings.at(k, s), path.settings.changes(k)
    if path.tool is None:
        return values, changes
    start, change = path.tool.angles[k], np.diff(path.tool.angles)[k]
    return np.column_stack([start + s * change, values]), np.column_stack([change, changes])


def knots_csv(case: Case, path: ProgrammedPath, knots: Knots) -> str:
    """Return a row for each knot: line, segment and parameter, time, pose, coordinates, speeds and accelerations.

    The settings of the path follow the pose, and their rates are the last columns. Values are in the units of the case.
    Cells are empty if the robot does not reach the pose, or without a time.
    """
    units, names = case.units, [name for name, _ in path_settings(case, path)]
    head = ["line", "segment", "parameter", *(["t"] * path.is_timed), *_POSE, *names]
    head += [f"{measure} {name}" for measure, name in zip(knots.measures, knots.actuators, strict=True)]
    scales = np.array([units.to_internal(1.0, each.dimension) for each in driven_joints(case.model)])
    if path.is_timed:
        head += [f"{word} {name}" for word in ("speed", "acceleration") for name in knots.actuators]
        head += [f"rate {name}" for name in names]
    return csv_text(head, _rows(case, path, knots, scales))


def _rows(case: Case, path: ProgrammedPath, knots: Knots, scales: FloatArray) -> Iterator[list[float | None]]:
    """Yield the rows; unknown values are None."""
    motion, task = knot_motion(path, knots), replace(path, tool=None)
    settings = np.array([case.units.to_internal(1.0, kind) for _, kind in path_settings(case, path)])
    for begin in range(0, len(knots.segments), _BLOCK):
        rows = slice(begin, begin + _BLOCK)
        k, s = knots.segments[rows], knots.parameters[rows]
        poses = task.poses_at(k, s)
        angles = _angles(path, k, s, poses.rotations) / case.units.to_internal(1.0, Dimension.ANGLE)
        values_at, changes = settings_at(path, k, s)
        parts = [poses.positions, angles, values_at / settings, knots.coordinates[rows] / scales]
        if path.is_timed:
            times, *others = (each[rows] for each in motion)
            parts = [times[:, None], *parts, *(each / scales for each in others)]
            # The rate of the motion that ends at the knot, as for speeds; the path begins without a motion.
            is_first = np.arange(len(knots.segments))[rows, None] == 0
            parts.append(np.where(is_first, np.nan, changes / path.durations[k, None] / settings))
        values = np.hstack(parts)
        known = np.asarray(np.isfinite(values))
        whole: list[bool] = np.asarray(known.all(axis=1)).tolist()
        places = zip(path.lines[k].tolist(), k.tolist(), s.tolist(), strict=True)
        for j, (place, row) in enumerate(zip(places, values.tolist(), strict=True)):
            cells = row if whole[j] else [x if is_known else None for x, is_known in zip(row, known[j], strict=True)]
            yield [*place, *cells]
