"""Tool paths from tables of poses: each row of a CSV file is a point, with the pose columns of a case.

Columns ``t`` (seconds) or ``feed`` (length or angle per second) state the times. Each setting of the case has a column:
``turn`` about the tool's axis, and dimensions by their names. Values are in the units of the case.
"""

from __future__ import annotations

from typing import TypedDict

import numpy as np

from ...models import Dimension, FloatArray
from ..case.csvrows import POSE_ROWS, NumberTable, check_header, csv_rows, number_table
from ..case.pathfile import TURN
from ..case.pose import LARGEST
from ..errors import CaseError, InputError
from ..units import Units
from .options import Between, PathOptions
from .orientation import ORDERS, order_named, roll_pitch_yaw
from .path import Kind, ProgrammedPath
from .settings import UNCHANGED, Changing, Settings, ToolTurn
from .standing import duration_at, rest_length, turns_between, without_rests

#: Advice for a dimension whose drive is of interest.
_JOINTS = "give the robot joint by joint for that"


class _Set(TypedDict, total=False):
    """Fields of a path with the tool's turn, the settings, and sentences about unused columns."""

    tool: ToolTurn
    settings: Settings
    warnings: tuple[str, ...]


#: Columns of poses and of times.
_ROWS = POSE_ROWS._replace(others={**POSE_ROWS.others, "t": ("t",), "feed": ("feed",)})
#: Default values of empty rotation cells; 0 for all others.
_LEFT_OUT = {"qw": "1", "axis_z": "1"}
#: Largest deviation of a quaternion's norm from 1, as in a case file.
_ROUNDING = 1e-6


def read_poses(
    text: str, source: str, units: Units, options: PathOptions, changing: Changing = UNCHANGED
) -> ProgrammedPath:
    """Return the path through the rows of a table.

    Args:
        text: text of the file.
        source: name of the file, for messages.
        units: units of the case.
        options: options for reading; only the interpolation between rows has an effect.
        changing: quantities of the case with columns of their own.

    Raises:
        InputError: the table has a fault, or fewer than two points.
    """
    if order_named(options.angles) != ORDERS["rpy"]:
        raise InputError(f"{source}: angles = {options.angles!r}: is only for G-code; tables have roll, pitch and yaw")
    table = _read_table(text, source, changing)
    has_angles = not {"qw", "axis_x", "angle"} & table.columns.keys()
    between = options.between or (Between.ANGLES if has_angles else Between.SLERP)
    if between is Between.ANGLES and not has_angles:
        fault = 'between = "angles" needs the columns roll, pitch and yaw; for other columns use between = "slerp"'
        raise InputError(f"{source}: {fault}")
    knots = np.hstack([table.block("x y z"), _angles(table, units)])
    if len(knots) < 2:
        raise InputError(
            f"{source}: there is no path: fewer than two points; "
            "expected a first row with the names of the columns, then two or more rows"
        )
    path = ProgrammedPath(
        source,
        knots,
        table.rows[1:],
        np.full(len(knots) - 1, Kind.LINE, dtype=np.uint8),
        _durations(table, knots, between, units),
        np.empty((0, 6)),
        np.empty(0, dtype=np.uint8),
        ORDERS["rpy"],
        between,
        **_settings(table, changing, units),
    )
    # A repeated point is a dwell if its time is stated, else no segment.
    return without_rests(path, are_timed="t" in table.columns)


def _settings(table: NumberTable, changing: Changing, units: Units) -> _Set:
    """Return the tool's turn and the settings of the rows.

    Raises:
        InputError: a value is out of its range, or changes too fast.
    """
    values = changing.values_of(table, units)
    unused = [f"column {name}: not used" for name in table.columns if name in changing.fixed]
    drives = [
        f"F locks {name}; its drive has no force or power here{'' if name in changing.joints else f': {_JOINTS}'}"
        for name in changing.own
    ]
    found = _Set(warnings=(*unused, *drives))
    if changing.axis is not None:
        found["tool"] = ToolTurn(changing.axis, values.get(TURN, np.full(len(table.rows), changing.turn)))
    if changing.own:
        whole = np.stack([values[name] for name in changing.own], axis=1)
        found["settings"] = Settings(tuple(changing.own.values()), whole)
    return found


def _read_table(text: str, source: str, changing: Changing) -> NumberTable:
    """Return the values of a file.

    Raises:
        InputError: the file is not a table, has unknown columns, or a cell is not a number.
    """
    records = csv_rows(text, source)
    top, header = next(records, (0, []))
    if not header:
        raise InputError(
            f"{source}: has no rows: expected a first row with the names of the columns, then rows of values"
        )
    further = {name: (name,) for name in (*changing.ranges, *changing.fixed)}
    rows = _ROWS._replace(others={**_ROWS.others, **further})
    found = check_header(header, rows, lambda fault: CaseError(f"row {top}", fault, source=source))
    changing.check_columns(header, source)
    if {"t", "feed"} <= found.keys():
        raise CaseError(f"row {top}", "column 'feed' conflicts with 't'; keep one of them", source=source)
    turns = [names for key, names in found.items() if key in POSE_ROWS.others]
    left_out = [{header.index(name): _LEFT_OUT.get(name, "0") for name in names} for names in turns]
    table = number_table(records, header, source, left_out)
    for name, column in table.columns.items():
        table.refuse(~(np.abs(column) <= LARGEST), name, f"must be finite and at most {LARGEST:g} in magnitude")
    return table


def _angles(table: NumberTable, units: Units) -> FloatArray:
    """Return roll, pitch and yaw (n, 3) of the rows."""
    columns, zeros = table.columns, np.zeros(len(table.rows))
    unit = units.to_internal(1, Dimension.ANGLE)
    if "roll" in columns:
        return table.block("roll pitch yaw") * unit
    if "qw" in columns:
        quaternions = table.block("qw qx qy qz")
        sizes = np.linalg.norm(quaternions, axis=1)
        table.refuse(~(np.abs(sizes - 1) <= _ROUNDING), "qw, qx, qy, qz", "must be a unit quaternion (w, x, y, z)")
        return roll_pitch_yaw(quaternions / sizes[:, None])
    axes = table.block("axis_x axis_y axis_z") if "axis_x" in columns else np.array([[0.0, 0.0, 1.0]])
    sizes = np.linalg.norm(axes, axis=1)
    table.refuse(~(sizes > 0), "axis_x, axis_y, axis_z", "must be an axis of any length but zero")
    half = columns.get("angle", zeros)[:, None] * unit / 2
    return roll_pitch_yaw(np.hstack([np.cos(half), np.sin(half) * axes / sizes[:, None]]))


def _durations(table: NumberTable, knots: FloatArray, between: Between, units: Units) -> FloatArray:
    """Return the times (n - 1,) from each row to the next, seconds; NaN if not stated."""
    durations = np.full(len(knots) - 1, np.nan)
    if "t" in table.columns:
        durations = np.diff(table.columns["t"])
        wrong = np.concatenate([[False], ~(durations > 0)])
        table.refuse(wrong, "t", "must be later than that of the row before")
    elif "feed" in table.columns:
        feeds = table.columns["feed"]
        table.refuse(~(feeds > 0), "feed", "must be positive")
        ways = np.linalg.norm(np.diff(knots[:, :3], axis=0), axis=1)
        turns = turns_between(knots[:, 3:], ORDERS["rpy"], between)
        both = feeds[1:], feeds[1:] * units.to_internal(1, Dimension.ANGLE)
        durations = duration_at(ways, turns, both, rest_length(knots[:, :3]))
    return durations
