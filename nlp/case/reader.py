"""Reader of case files: from TOML to a :class:`~screwsynth.nlp.case.case.Case`, with angles in radians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from pydantic import ValidationError

from ...models import Dimension, FloatArray, Model, unit_vector
from ...models.fileversions import CASE_FILES
from ...models.model import joint_parameter
from ..errors import CaseError, nearest
from ..system.reading import check_version
from ..units import Units
from .case import Case
from .checks import check_direction
from .controller import SAME
from .csvrows import TableOrigins, insert_rows, pose_tables
from .displacements import read_displacements
from .limits.limits import Limits
from .overrides import Settings, override_number
from .pose import (
    OverPoses,
    PerPose,
    PerTask,
    Pose,
    Rotation,
    RotationForm,
    Value,
    ends_of,
    internal_dimension,
    internal_value,
    rotation_from_matrix,
    rotation_from_quaternion,
    rotation_from_rpy,
)
from .robots import insert_robot_file, model_of_table
from .schema import (
    DimensionRange,
    Document,
    ExpectTable,
    Listed,
    PoseTable,
    PublishedTable,
    RotationTable,
    TaskTable,
    TaskValues,
)
from .settings import Expectation, ExpectedValue, Published, Search
from .source import find_case, inputs_of, named_files, read_text, source_name, tables_of
from .table import case_error
from .task import Method, Sense, Task, unit_twist
from .toml import toml_document

#: Value of a dimension in a case file.
Dimensional: TypeAlias = float | DimensionRange | Listed | TaskValues

#: Tables of robot files; each robot file has at least one of these.
_OF_ROBOT_FILES = frozenset(("limb", "links", "joint"))


class CaseFile(NamedTuple):
    """Case with its text and its input files.

    Attributes:
        case: the case.
        text: TOML that states this case without other files: the text of the case file, unless settings change it or
            it refers to other files.
        inputs: input files, each with its description for messages: the case file, and the files to which it refers.
    """

    case: Case
    text: str
    inputs: Mapping[Path, str]


def load_case(name: str, settings: Settings | None = None) -> Case:
    """Read a case from its file.

    Args:
        name: path of a TOML file, the bare name of a shipped case, or ``-`` for standard input.
        settings: new values by name, in the units of the file: a parameter or component (``base_1_x``), ``p_x``,
            ``p_y``, ``p_z``, ``angle``, or ``axis`` with three numbers; a bound of a variable (``p_z.max``); a value of
            a limit, which may be new (``limits.leg_length.max``). A parameter with the name of a pose coordinate is
            called ``robot.p_x``.

    Raises:
        InputError: the file cannot be read, or has an error.
    """
    return read_case(name, settings).case


def read_case(name: str, settings: Settings | None = None) -> CaseFile:
    """Read a case with its text and its input files; arguments and errors are those of :func:`load_case`."""
    path = find_case(name)
    text = read_text(path)
    tables = tables_of(path, text)
    # The reader replaces file names in the tables by the content of the files.
    inputs, named = inputs_of(path, tables), named_files(tables, path.parent)
    source = Path(source_name(path))
    case = case_from_tables(tables, name=source.stem, source=source.name, settings=settings or {}, folder=path.parent)
    return CaseFile(case, toml_document(tables) if named or settings else text, inputs)


class PoseRows(NamedTuple):
    """Poses of a CSV file.

    Attributes:
        positions: (N, 3) origins of the platform frame in the world frame, length.
        rotations: (N, 3, 3) rotation matrices from platform to world coordinates.
        rows: (N,) row number of each pose in the file, from 1.
    """

    positions: FloatArray
    rotations: FloatArray
    rows: tuple[int, ...]


def read_poses(file: str, units: Units, option: str = "poses") -> PoseRows:
    """Return the poses of a CSV file given by an option; the columns are those of the key ``poses`` of a case.

    Args:
        file: name of the file.
        units: units of the values in the file.
        option: option with the name of the file, for messages.

    Raises:
        InputError: the file cannot be read, or has an error.
    """
    tables, origins, rows = pose_tables(file, option)
    positions, rotations = np.zeros((len(tables), 3)), np.zeros((len(tables), 3, 3))
    try:
        for k, table in enumerate(tables):
            written = _pose_table(table, k)
            positions[k] = [ends_of(internal_value(part, units, Dimension.LENGTH))[0] for part in written.position]
            rotation = _rotation(written.rotation, units, f"pose[{k}]")
            axis, angle = rotation.axis, rotation.angle
            if axis is None:
                raise CaseError(f"pose[{k}].rotation.axis", "is missing: give the axis of rotation with its angle")
            rotations[k] = _matrix(unit_vector(check_direction(axis, f"pose[{k}].rotation.axis")), ends_of(angle)[0])
    except CaseError as error:
        raise (error if error.source else origins.error_in(error, file)) from None
    return PoseRows(positions, rotations, rows)


def _pose_table(table: dict[str, Any], index: int) -> PoseTable:
    """Return a checked table of a pose; errors are those of :func:`_parse`."""
    try:
        return PoseTable.model_validate(table)
    except ValidationError as error:
        fault = case_error(error.errors(include_url=False)[0])
        raise CaseError(f"pose[{index}].{fault.key}", fault.fault, fault.value) from None


def _matrix(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation matrix (3, 3) of an angle, radians, about a unit axis (3,)."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)


def case_from_tables(
    tables: dict[str, Any], *, name: str, source: str, settings: Settings | None = None, folder: Path | None = None
) -> Case:
    """Return the case of a TOML document.

    Args:
        tables: the document, as ``tomllib`` returns it; settings and CSV files change it in place.
        name: name of the case in results.
        source: name of the document in messages.
        settings: new values by name, see :func:`load_case`.
        folder: folder from which file names in the document begin; the current folder if left out.

    Raises:
        CaseError: the document, or a CSV file to which it refers, has an error.
        InputError: a CSV file is not a table.
    """
    origins = TableOrigins()
    try:
        if is_robot_file(tables):
            fault = f'is a robot file, not a case; write [robot] file = "{source}" in a case'
            raise CaseError("the file", f"{fault}, or create a case with screwsynth new {source}")
        check_version(CASE_FILES, tables)
        origins = insert_rows(tables, folder or Path())
        robot_file = insert_robot_file(tables, folder or Path())
        written = _parse(tables)
        if settings:
            for key, value in settings.items():
                override_number(tables, key, value)
            written = _parse(tables)
        return _case_of(written, name, source, "" if folder is None else str(folder), robot_file)
    except CaseError as error:
        raise (error if error.source else origins.error_in(error, source)) from None


def is_robot_file(tables: Mapping[str, Any]) -> bool:
    """Return whether a TOML document is a robot file instead of a case."""
    return "robot" not in tables and not _OF_ROBOT_FILES.isdisjoint(tables)


def case_with_settings(tables: dict[str, Any], settings: Settings, like: Case) -> Case:
    """Return the case of a document with values replaced, and with the robot of a case already read from the document.

    Args:
        tables: the document, as ``tomllib`` returns it; changed in place.
        settings: new values by name, see :func:`load_case`.
        like: case read from the document without settings.

    Raises:
        CaseError: the case has no value with a name, or a value is not allowed.
    """
    for key, value in settings.items():
        override_number(tables, key, value)
    return _case_of(_parse(tables), like.name, "", "", model=like.model)


def _parse(tables: dict[str, Any]) -> Document:
    """Return the checked tables of a document.

    Args:
        tables: the document, as ``tomllib`` returns it.

    Raises:
        CaseError: the document has an error; the first one is reported, with its dotted key.
    """
    try:
        return Document.model_validate(tables)
    except ValidationError as error:
        raise case_error(error.errors(include_url=False)[0]) from None


def _case_of(
    written: Document, name: str, source: str, folder: str, robot_file: str | None = None, model: Model | None = None
) -> Case:
    """Return the case of a document.

    Args:
        written: the document.
        name: name of the case in results.
        source: name of the document in messages.
        folder: folder of the document; empty for the current folder.
        robot_file: name of the file with the robot's definition; None if the document contains the definition.
        model: the robot; None for the robot of the document.

    Raises:
        CaseError: the document has an error.
    """
    units = Units(written.units.length, written.units.angle, written.units.force)
    model = model_of_table(written.robot, robot_file) if model is None else model
    if not model.has_couples and "characteristic_length" in written.robot.model_fields_set:
        fault = f"has no effect on {model.name!r}, which has no constraint couples; remove the key"
        raise CaseError("robot.characteristic_length", fault)
    dimensions = {parameter.name: parameter.dimension for parameter in model.parameters}
    dimensions |= {joint_parameter(each.joint): each.dimension for each in model.unknowns if each.is_free}
    poses = written.pose if isinstance(written.pose, list) else [written.pose]
    tasks = [_task(task, index) for index, task in enumerate(written.task)]
    keys = _pose_keys(written)
    steps = [read_displacements(pose, tasks, units, key) for pose, key in zip(poses, keys, strict=True)]
    of_tasks = _poses_of_tasks(written)
    share = len(tasks) if of_tasks and len(poses) > 1 else 1
    method, over_poses = _combination(written, sum(map(len, steps)) // share)
    first, *further = [
        Pose(
            [internal_value(part, units, Dimension.LENGTH) for part in pose.position],
            _rotation(pose.rotation, units, key),
            moves,
        )
        for pose, moves, key in zip(poses, steps, keys, strict=True)
    ]
    search = written.solve
    return Case(
        model=model,
        parameters={
            key: _parameter_value(key, given, units, dimensions.get(key, Dimension.NUMBER))
            for key, given in written.robot.parameters.items()
        },
        position=first.position,
        rotation=first.rotation,
        displacements=first.displacements,
        further=further,
        pose_per_task=of_tasks,
        over_poses=over_poses,
        worst_everywhere=written.read_worst_everywhere(),
        over_path=written.read_over_path(),
        limits=Limits.from_table(written.limits, model, units),
        joint_centre_tolerance=None if written.tolerance is None else written.tolerance.joint_centre,
        workspace=written.read_workspace(units),
        path=written.read_path(folder, units),
        loading=written.read_loading(units),
        controller=SAME if written.controller is None else written.controller.read(model, units),
        tasks=written.read_tasks(tasks),
        units=units,
        characteristic_length=written.robot.characteristic_length,
        search=Search(search.starts, search.seed, search.max_iterations, screen=search.screen),
        method=method,
        title=written.title,
        name=name,
        expect=_expectation(written.expect),
        published=tuple(_published(row) for row in written.published),
        source=source,
    )


def _pose_keys(written: Document) -> list[str]:
    """Return the dotted key of each stated pose."""
    return [f"pose[{k}]" for k in range(len(written.pose))] if isinstance(written.pose, list) else ["pose"]


def _poses_of_tasks(written: Document) -> bool:
    """Return whether every task has its own pose.

    Raises:
        CaseError: the poses name tasks in another order than the tasks, or not all poses name a task.
    """
    poses, keys = (written.pose if isinstance(written.pose, list) else [written.pose]), _pose_keys(written)
    for pose, key in zip(poses, keys, strict=True):
        if pose.per is not None and (len(poses) > 1 or pose.task is not None):
            raise CaseError(
                f"{key}.per", 'needs a single [pose]; write task = "NAME" in each [[pose]] instead', pose.per
            )
    if all(pose.task is None for pose in poses):
        return any(pose.per is not None for pose in poses)
    names = [task.name or f"task {k + 1}" for k, task in enumerate(written.task)]
    for pose, key in zip(poses, keys, strict=True):
        if pose.task is None:
            raise CaseError(f"{key}.task", "is missing: another [[pose]] names its task, so each must")
        if pose.task not in names:
            raise CaseError(f"{key}.task", f"no such task; {nearest(pose.task, names)}", pose.task)
    if len(names) == 1:
        raise CaseError(f"{keys[0]}.task", "has no effect with one task; remove it", poses[0].task)
    count = max(len(poses) // len(names), 1)
    for k, (pose, key) in enumerate(zip(poses, keys, strict=True)):
        if len(poses) % len(names) or pose.task != names[k // count]:
            fault = "is out of order: give the poses in the order of the tasks, the same number for each task"
            raise CaseError(f"{key}.task", fault, pose.task)
    return True


def _combination(written: Document, poses: int) -> tuple[Method, OverPoses]:
    """Return the combination of tasks, and the combination of F over poses.

    Args:
        written: the document.
        poses: number of poses of the robot.

    Raises:
        CaseError: a key has no effect on a case with one task, or with one pose.
    """
    combine = written.combine
    if combine is None:
        return Case.method, Case.over_poses
    if len(written.task) == 1 and (combine.method is not None or combine.over_poses is None):
        key = "combine" if combine.over_poses is None else "combine.method"
        raise CaseError(key, "has no effect with one task; remove it, or add another [[task]]")
    if poses == 1 and combine.over_poses is not None:
        raise CaseError("combine.over_poses", "has no effect with one pose; remove it, or add another [[pose]]")
    method = Case.method if combine.method is None else Method(combine.method)
    return method, Case.over_poses if combine.over_poses is None else OverPoses(combine.over_poses)


def _expectation(written: ExpectTable) -> Expectation:
    """Return the expected results of a document."""
    values = tuple(ExpectedValue(row.quantity, row.value, row.within) for row in written.value)
    return Expectation(written.F, written.tolerance, written.singular, values)


def _parameter_value(
    key: str, given: Dimensional | list[Dimensional], units: Units, dimension: Dimension
) -> Value | PerTask | PerPose | list[Value | PerTask | PerPose]:
    """Return the value of a parameter, angles in radians.

    Args:
        key: name of the parameter.
        given: value in the units of the file.
        units: units of the file.
        dimension: physical dimension of the parameter.

    Raises:
        CaseError: the value is a list of a single number.
    """
    if not isinstance(given, list):
        return internal_dimension(given, units, dimension)
    if len(given) == 1:
        raise CaseError(f"robot.parameters.{key}", "must be a number or { min, max }, without brackets")
    return [internal_dimension(part, units, dimension) for part in given]


def _rotation(written: RotationTable | None, units: Units, pose: str) -> Rotation:
    """Return the rotation of a stated pose; the identity without a table.

    Args:
        written: table of the rotation; None if the file has none.
        units: units of the file.
        pose: dotted key of the pose, for messages.

    Raises:
        CaseError: the matrix is not orthogonal, or the quaternion is not of unit length.
    """
    if written is None:
        return Rotation()
    key = f"{pose}.rotation"
    if written.rpy is not None:
        angles = [units.to_internal(part, Dimension.ANGLE) for part in written.rpy]
        return Rotation(*rotation_from_rpy(angles, f"{key}.rpy"), RotationForm.RPY)
    if written.matrix is not None:
        return Rotation(*rotation_from_matrix(written.matrix, f"{key}.matrix"))
    if written.quaternion is not None:
        return Rotation(*rotation_from_quaternion(written.quaternion, f"{key}.quaternion"), RotationForm.QUATERNION)
    if written.angle is None:
        raise CaseError(f"{key}.angle", "is missing: give a number or { min, max }")
    return Rotation(written.axis, internal_value(written.angle, units, Dimension.ANGLE))


def _task(written: TaskTable, index: int) -> Task:
    """Return a task of a document.

    Args:
        written: table of the task.
        index: index of the task.

    Raises:
        CaseError: the motion is stated both by a screw and by a twist, or axis, point or pitch is missing or invalid.
    """
    key, name = f"task[{index}]", written.name or f"task {index + 1}"
    if written.follows is not None:
        for part in ("axis", "point", "pitch", "twist"):
            if getattr(written, part) is not None:
                raise CaseError(f"{key}.{part}", "conflicts with follows; state the motion in one way")
        return Task.following(written.follows, sense=written.sense, name=name, weight=written.weight)
    if written.twist is None:
        twist = unit_twist(written.axis, written.point, written.pitch, key)
        point = None if written.pitch == math.inf else written.point
        return Task(twist, Sense(written.sense), name, written.weight, point)
    for part in ("axis", "point", "pitch"):
        if getattr(written, part) is not None:
            raise CaseError(f"{key}.{part}", "conflicts with twist; state the motion in one way")
    return Task(written.twist, Sense(written.sense), name, written.weight)


def _published(row: PublishedTable) -> Published:
    """Return a published value of a document."""
    value = tuple(row.value) if isinstance(row.value, list) else (row.value,)
    return Published(row.quantity, value, row.source, row.reproduced, row.because, row.decimals, row.over)
