"""Writer of case files: TOML from which an equal :class:`~screwsynth.nlp.case.case.Case` is read.

Angles are written in the case's unit. A task is written as axis, point and pitch if these give its twist to the last
bit, and otherwise as a twist.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ...models import Dimension, FloatArray, Model, Parameter, Substitution, axis_from_screw, unit_vector
from ...models.model import joint_parameter
from ...models.posesettings import slope_name
from ...models.statics import driven_joints
from ..errors import CaseError
from ..units import Units
from .case import Case
from .checks import check_real, check_reals
from .displacements import written_displacements
from .loads import Loading
from .overrides import fields_of
from .pose import Free, PerPose, PerTask, Pose, Rotation, Value, written_dimension, written_value
from .posesettings import setting_limits, stated_setting
from .reader import case_from_tables, case_with_settings
from .settings import Expectation, Search
from .task import Task, unit_twist
from .toml import TomlValue, plain_value, toml_lines, toml_table, toml_tables

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: Digits to which components are rounded in the search for a short direction, such as [2, 2, 1].
_DIGITS = 12
#: Largest integer component of a short direction.
_LARGEST_COMPONENT = 12
#: Largest rounding error of a component, in units of its last place: of one division and one norm.
_ROUNDINGS = 4
#: Relative difference of the expressions of two robots at a random point, above which the robots are different.
_SAME = 1e-9


def case_text(case: Case) -> str:
    """Return the text of a case file for a case; the text is checked by reading it again.

    A characteristic length and a combination without effect are left out, because case files do not allow them.

    Raises:
        CaseError: no case file can state the case: its name and options give another robot, or a value is not allowed
            in files.
    """
    text = "\n".join(_lines(case)) + "\n"
    try:
        again = case_from_tables(tomllib.loads(text), name=case.name, source="")
    except CaseError as error:
        raise CaseError(error.key, f"cannot be written to a case file: {error.fault}", error.value) from None
    if not _are_same(case.model, again.model):
        fault = "cannot be written to a case file: this name with these options gives a different robot"
        raise CaseError("robot.model", fault, case.model.name)
    return text


def with_settings(case: Case, settings: Mapping[str, float | ArrayLike]) -> Case:
    """Return a case with some values replaced by name, as the option ``--set`` does.

    Args:
        case: the case; its robot need not have a name.
        settings: new values in the case's units, by the names of :func:`load_case`.

    Raises:
        CaseError: the case has no value with a name, a value is not allowed, or no case file can state the case.
    """
    try:
        numbers = {name: _setting(name, value) for name, value in settings.items()}
        read = case_with_settings(tomllib.loads("\n".join(_lines(case))), numbers, case)
    except CaseError as error:
        raise (error if error.source or not case.source else error.within(case.source)) from None
    found = {field: getattr(read, field) for name in numbers for field in fields_of(name)}
    if "rotation" in found:
        found["rotation"] = _as_stated(case.rotation, read.rotation)
        further = zip(case.further, read.further, strict=True)
        found["further"] = [replace(new, rotation=_as_stated(old.rotation, new.rotation)) for old, new in further]
    if case.path is not None and read.path is not None and "path" in found:
        found["path"] = replace(case.path, place=read.path.place, tool=read.path.tool)
    return replace(case, **found)


def _setting(name: str, value: float | ArrayLike) -> float | list[float]:
    """Return a checked number, or the numbers of a point, axis or direction."""
    if np.ndim(value) == 0:
        return check_real(value, name)
    return [float(part) for part in check_reals(value, name)]


def _as_stated(old: Rotation, new: Rotation) -> Rotation:
    """Return the old rotation, with its form, if both rotations are equal; otherwise the new one."""
    one, other = ((), ()) if old.axis is None or new.axis is None else (old.axis, new.axis)
    is_same = (old.axis is None) == (new.axis is None) and np.array_equal(one, other)
    return old if is_same and old.angle == new.angle else new


def _lines(case: Case) -> Iterator[str]:
    """Yield the lines of a case file."""
    units, model = case.units, case.model
    yield from toml_lines({"title": case.title or None})
    yield from toml_table("[units]", _units(units))
    length = case.characteristic_length if model.has_couples else None
    options: dict[str, TomlValue | None] = {key: plain_value(value) for key, value in model.options.items()}
    name = None if "definition" in options else model.name
    yield from toml_table(
        "[robot]", {"model": name, **options, "characteristic_length": length, **_stiffness(case.loading)}
    )
    parameters: dict[str, TomlValue] = {}
    further = {*(slope_name(each.name) for each in model.settings), *map(joint_parameter, model.locked)}
    for item in model.parameters:
        if item.name in further and not _is_locked(case, item):
            continue
        values, stated = case.components(item.name), _stated(case, item)
        numbers = [written_dimension(value, units, item.dimension) for value in stated]
        parameters[item.name] = numbers[0] if len(numbers) == 1 else numbers
        if item.is_direction and not any(isinstance(value, Free) for value in values):
            parameters[item.name] = _direction(np.array(values, dtype=np.float64))
    yield from toml_table("[robot.parameters]", parameters)
    yield from _poses(case)
    for task in case.tasks:
        if task.is_stated:
            yield from toml_table("[[task]]", _task(task))
        over = case.limits_over if case.worst_everywhere else None
        along = None if case.over_path is None else case.over_path.value
        over = "path" if along else over
        measure = {task.objective_key.partition(".")[2]: task.measure or None, "length": task.length}
        yield from toml_table("[objective]", {**measure, "over": over, "as": along})
    yield from toml_table("[combine]", _combination(case))
    yield from _loading(case.loading, units)
    yield from toml_table("[controller]", case.controller.to_keys(driven_joints(model), units))
    yield from toml_table("[limits]", _limits(case))
    yield from toml_table("[tolerance]", {"joint_centre": case.joint_centre_tolerance})
    if case.workspace is not None:
        yield from toml_table("[workspace]", case.workspace.to_keys(case.units))
    if case.path is not None:
        yield from toml_table("[path]", case.path.to_keys(units))
    settings = {key: getattr(case.search, key) for key in ("starts", "seed", "max_iterations", "screen")}
    yield from toml_table("[solve]", {key: each for key, each in settings.items() if each != getattr(Search, key)})
    yield from _expectation(case.expect)
    for row in case.published:
        value = row.value[0] if len(row.value) == 1 else row.value
        yield from toml_table("[[published]]", {**vars(row), "value": value, "because": row.because or None})


def _is_locked(case: Case, item: Parameter) -> bool:
    """Return whether a parameter is the coordinate of a joint that is locked at a stated value."""
    is_joint = item.name in map(joint_parameter, case.model.locked)
    return is_joint and not any(isinstance(each, Free) for each in case.components(item.name))


def _stated(case: Case, item: Parameter) -> list[Value | PerTask | PerPose]:
    """Return the components of a parameter as a case file states them."""
    given = case.parameters[item.name]
    found: list[Value | PerTask | PerPose] = list(given) if isinstance(given, Sequence) else [given]
    affine = {each.name for each in case.model.settings}
    names = affine if case.workspace is None else affine.union(case.workspace.setting_names)
    for k, name in enumerate(item.components):
        value = found[k]
        if name in affine:
            found[k] = stated_setting(
                case.model, name, case.components(item.name)[k], case.components(slope_name(name))
            )
        elif name in names and isinstance(value, Free):
            found[k] = PerPose(value)
    return found


def _units(units: Units) -> dict[str, TomlValue | None]:
    """Return the table of the units; the default force unit is left out."""
    force = None if units.force == Units.force else units.force
    return {"length": units.length, "angle": units.angle, "force": force}


def _stiffness(loading: Loading) -> dict[str, TomlValue]:
    """Return the key of the actuator stiffness: one number for all actuators, or a table by name."""
    given = loading.stiffness
    return {} if given is None else {"actuator_stiffness": given[""] if given.keys() == {""} else dict(given)}


def _loading(loading: Loading, units: Units) -> Iterator[str]:
    """Yield the lines of loads, motion and gravity."""
    for load in loading.loads:
        sizes = {"force": load.any_force or None, "moment": load.any_moment or None}
        table: dict[str, TomlValue | None] = {
            "name": load.name,
            "mass": load.mass or None,
            "force": load.force if any(load.force) else None,
            "moment": load.moment if any(load.moment) else None,
            "centre" if load.mass else "point": load.point if any(load.point) else None,
            "frame": "platform" if load.in_platform else None,
            "sign": "both" if load.both_signs else None,
            "any": sizes if any(sizes.values()) else None,
            "always": load.always or None,
        }
        yield from toml_table("[[load]]", table)
    if loading.motion is not None:
        angular = units.written(loading.motion.angular, Dimension.TURN_SPEED)
        yield from toml_table("[motion]", {"linear": loading.motion.linear, "angular": angular})
    if loading.gravity is not None:
        yield from toml_table("[gravity]", {"acceleration": tuple(loading.gravity)})


def _expectation(expect: Expectation) -> Iterator[str]:
    tolerance = expect.tolerance if expect.tolerance != Expectation.tolerance else None
    yield from toml_table("[expect]", {"F": expect.F, "tolerance": tolerance, "singular": expect.singular})
    yield from toml_tables("[[expect.value]]", map(vars, expect.values))


def _direction(unit: FloatArray) -> list[float]:
    """Return components (3,) with a given unit vector to the last bit; short integers if there are any."""
    largest = float(np.abs(unit).max())
    for scale in range(1, _LARGEST_COMPONENT + 1):
        short = [round(float(part) / largest * scale, _DIGITS) for part in unit]
        if np.array_equal(unit_vector(short), unit):
            return short
    # Components with largest magnitude 1 gave this unit vector; search for them among the rounded ones.
    long, steps = unit / largest, range(-_ROUNDINGS, _ROUNDINGS + 1)
    moved = np.abs(long) < 1
    for moves in itertools.product(*(steps if each else (0,) for each in moved)):
        components = long + np.spacing(long) * moves
        if np.array_equal(unit_vector(components), unit):
            return [float(part) for part in components]
    return [float(part) for part in unit]


def _poses(case: Case) -> Iterator[str]:
    """Yield the lines of the stated poses; equal ranges of all tasks are written once."""
    tables = [_pose(case, pose) for pose in case.poses]
    if not case.pose_per_task:
        yield from toml_tables("[[pose]]" if case.further else "[pose]", tables)
    elif len(tables) == len(case.tasks) and all(table == tables[0] for table in tables):
        yield from toml_table("[pose]", {**tables[0], "per": "task"})
    else:
        count = len(tables) // len(case.tasks)
        named = ({**table, "task": case.tasks[k // count].name} for k, table in enumerate(tables))
        yield from toml_tables("[[pose]]", named)


def _pose(case: Case, pose: Pose) -> dict[str, TomlValue | None]:
    """Return the table of a stated pose."""
    axis, angle = pose.rotation.axis, pose.rotation.angle
    rotation: dict[str, TomlValue] | None = {"angle": written_value(angle, case.units, Dimension.ANGLE)}
    if axis is not None:
        held = np.asarray(axis, dtype=np.float64)
        rotation = {"axis": _direction(held), **(rotation or {})}
        if angle == 0 and np.array_equal(held, (0, 0, 1)):
            rotation = None
    return {
        "position": [written_value(value, case.units, Dimension.LENGTH) for value in pose.position],
        "rotation": rotation,
        **written_displacements(pose.displacements, case.tasks, case.units),
    }


def _task(task: Task) -> dict[str, TomlValue | None]:
    """Return the table of a task."""
    weight = task.weight if task.weight != Task.weight else None
    if task.follows:
        return {"name": task.name, "sense": task.sense.value, "follows": task.follows, "weight": weight}
    twist = np.asarray(task.twist, dtype=np.float64)
    motion: dict[str, TomlValue | None] = {"twist": twist.tolist()}
    screw = axis_from_screw(twist)
    pitch = round(screw.pitch, _DIGITS)
    # The twist contains the unit vector itself, without another rounding.
    axis = _direction(twist[3:] if math.isinf(pitch) else twist[:3])
    point = None if task.point is None else np.asarray(task.point, dtype=np.float64).tolist()
    # A task that was stated by its twist has no point, and is written as a twist.
    is_screw = math.isinf(pitch) == (point is None)
    if is_screw and np.array_equal(unit_twist(axis, point, pitch, "task"), twist):
        motion = {"axis": axis, "point": point, "pitch": pitch}
    return {"name": task.name, "sense": task.sense.value, **motion, "weight": weight}


def _combination(case: Case) -> dict[str, TomlValue | None]:
    """Return the table of the combination of tasks and poses, with only the keys that the file may have."""
    method = case.method.value if len(case.tasks) > 1 else None
    return {"method": method, "over_poses": case.over_poses.value if case.poses_per_task > 1 else None}


def _limits(case: Case) -> dict[str, TomlValue | None]:
    """Return the table of the limits.

    Raises:
        CaseError: two limits need different values of one key.
    """
    found: dict[str, TomlValue | None] = {}
    if case.limits_over:
        found["over"] = case.limits_over
    own = setting_limits(case.model)
    for limit in case.limits:
        if limit.name in own:
            continue
        _merge(found, limit.to_keys(case.model, case.units), "limits")
    return found


def _merge(found: dict[str, TomlValue | None], other: Mapping[str, TomlValue | None], place: str) -> None:
    """Merge a table into another one, including the tables of joints and actuators within it.

    Args:
        found: table that receives the keys.
        other: table with the new keys.
        place: dotted key of the table, for messages.

    Raises:
        CaseError: both tables have a key with different values.
    """
    for key, value in other.items():
        have = found.setdefault(key, value)
        if isinstance(have, dict) and isinstance(value, Mapping) and _is_merged(key, place):
            _merge(have, value, f"{place}.{key}")
        elif have != value:
            fault = "cannot be written to a case file, which allows one value, but the limits have two"
            raise CaseError(f"{place}.{key}", f"{fault}: {have} and {value}")


def _is_merged(key: str, place: str) -> bool:
    """Return whether several limits may share a key, as those of joints and of actuators do."""
    return "joint" in (key, place.rpartition(".")[2]) or key.startswith("actuator_")


def _are_same(one: Model, other: Model) -> bool:
    """Return whether two robots have equal parameters, rows and measures, by their values at a random point."""
    names = [[item.components for item in model.parameters] for model in (one, other)]
    if names[0] != names[1] or one.limbs != other.limbs or len(one.unknowns) != len(other.unknowns):
        return False
    rng = np.random.default_rng(0)
    point = [rng.uniform(0.5, 1.5, part.shape) for part in Substitution.identity(one).all]

    def rows(model: Model) -> FloatArray:
        outputs = [part for row in model.wrenches for part in (row.force, row.moment)]
        outputs += [ca.vec(part) for each in model.members for part in (each.centre, each.screws)]
        outputs += [*(each.values for each in model.quantities), *(each.expression for each in model.closure)]
        function = ca.Function("model", Substitution.identity(model).all, [ca.vertcat(*outputs)])
        return np.array(function.call(point)[0])

    first, second = rows(one), rows(other)
    return first.shape == second.shape and np.allclose(first, second, rtol=_SAME, atol=_SAME, equal_nan=True)
