"""Case files: from TOML to a :class:`~screwsynth.nlp.case.case.Case`, the only place where degrees become radians.

A case is named by its path, or, for the ones that come with the package, by its bare name.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import screwsynth.cases

from ...models import Dimension, FloatArray, screw_from_axis
from ..errors import CaseError, InputError, nearest
from ..units import Units
from . import schema as document
from .case import Case
from .displacements import displacements
from .limits.limits import Limits
from .overrides import Settings, override_number
from .pose import LARGEST, Free, OverPoses, Pose, Rotation, Value
from .robots import build_model
from .settings import Expectation, ExpectedValue, Published, Search
from .task import Method, Sense, Task

_SHIPPED = Path(screwsynth.cases.__file__).parent


def shipped_cases() -> tuple[str, ...]:
    """Names of the cases that come with the package, in order."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def find_case(name: str) -> Path:
    """File of a case given by its path or, for a shipped one, its bare name.

    Raises:
        InputError: there is no such file.
    """
    try:
        path = _existing(name)
    except OSError as error:  # such as a name that is too long
        raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    if path is None:
        beside = Path(f"{name}.toml")
        hint = f"did you mean {beside}?" if name and beside.is_file() else nearest(name, shipped_cases())
        raise InputError(
            f"{name or 'an empty name'}: no such file, and no case of this name comes with screwsynth; {hint}"
        )
    return path


def _existing(name: str) -> Path | None:
    path = Path(name)
    if name and path.is_dir():
        raise InputError(f"{name}: is a folder, not a case file")
    if name and path.exists():
        return path
    return _SHIPPED / f"{name}.toml" if name in shipped_cases() else None


def load_case(name: str, settings: Settings | None = None) -> Case:
    """Read a case.

    Args:
        name: path of a TOML file, or the bare name of a shipped case.
        settings: numbers by name that replace those of the file, in the file's units: a parameter or one of its
            components (``base_1_x``), ``p_x``, ``p_y``, ``p_z``, ``angle``, or ``axis`` with three numbers. A
            parameter with the name of a number of the pose is called ``robot.p_x`` and the like.

    Raises:
        InputError: the file cannot be read or says something that is not allowed.
    """
    path = find_case(name)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: it is not UTF-8 text") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    return case_from_tables(tables, name=path.stem, source=path.name, settings=settings or {})


def case_from_tables(
    tables: dict[str, Any], *, name: str, source: str, settings: Settings | None = None
) -> Case:
    """The case that the tables of a parsed TOML document describe.

    Args:
        tables: the document, as ``tomllib`` returns it.
        name: name of the case in results.
        source: what error messages call the document.
        settings: as for :func:`load_case`.

    Raises:
        CaseError: something in it is not allowed.
    """
    try:
        written = document.parse_document(tables)
        if settings:
            for key, value in settings.items():
                override_number(tables, key, value)
            written = document.parse_document(tables)
        return _case(written, name, source)
    except CaseError as error:
        raise error.within(source) from None


def _case(written: document.Document, name: str, source: str) -> Case:
    units = Units(written.units.length, written.units.angle)
    model = build_model(written.robot.model, written.robot.options)
    if not model.has_couples and "characteristic_length" in written.robot.model_fields_set:
        raise CaseError("robot.characteristic_length", f"means nothing for {model.name!r}, which has no couple rows")
    dimensions = {parameter.name: parameter.dimension for parameter in model.parameters}
    search = written.solve
    poses = written.pose if isinstance(written.pose, list) else [written.pose]
    tasks = _tasks(written.task)
    steps = [displacements(pose, tasks, units, key) for pose, key in zip(poses, _pose_keys(written), strict=True)]
    method, over_poses = _combination(written, sum(map(len, steps)))
    first, *further = [
        Pose([_value(part, units, Dimension.LENGTH) for part in pose.position], _rotation(pose.rotation, units), moves)
        for pose, moves in zip(poses, steps, strict=True)
    ]
    return Case(
        model=model,
        parameters={
            key: _parameter(key, given, units, dimensions.get(key, Dimension.NUMBER))
            for key, given in written.robot.parameters.items()
        },
        position=first.position,
        rotation=first.rotation,
        displacements=first.displacements,
        further=further,
        over_poses=over_poses,
        limits=Limits.from_table(written.limits, model, units),
        joint_centre_tolerance=None if written.tolerance is None else written.tolerance.joint_centre,
        tasks=tasks,
        units=units,
        characteristic_length=written.robot.characteristic_length,
        search=Search(search.starts, search.seed, search.max_iterations),
        method=method,
        title=written.title,
        name=name,
        expect=_expectation(written.expect),
        published=tuple(
            Published(
                row.quantity,
                tuple(row.value) if isinstance(row.value, list) else (row.value,),
                row.source,
                row.reproduced,
                row.because,
                row.decimals,
                row.over,
            )
            for row in written.published
        ),
        source=source,
    )


def _pose_keys(written: document.Document) -> list[str]:
    return [f"pose[{k}]" for k in range(len(written.pose))] if isinstance(written.pose, list) else ["pose"]


def _combination(written: document.Document, poses: int) -> tuple[Method, OverPoses]:
    """How tasks and poses are brought together; what means nothing for the case is refused."""
    combine = written.combine
    if combine is None:
        return Method.AVERAGE, OverPoses.SUM
    if len(written.task) == 1 and (combine.method is not None or combine.over_poses is None):
        key = "combine" if combine.over_poses is None else "combine.method"
        raise CaseError(key, "means nothing for one task; take it out, or give another [[task]]")
    if poses == 1 and combine.over_poses is not None:
        raise CaseError("combine.over_poses", "means nothing for one pose; take it out, or give another [[pose]]")
    return Method(combine.method or "average"), OverPoses(combine.over_poses or "sum")


def _expectation(written: document.ExpectTable) -> Expectation:
    values = tuple(ExpectedValue(row.quantity, row.value, row.within) for row in written.value)
    return Expectation(written.F, written.tolerance, written.singular, values)


def _parameter(
    key: str, given: float | document.Range | list[float | document.Range], units: Units, dimension: Dimension
) -> Value | list[Value]:
    if not isinstance(given, list):
        return _value(given, units, dimension)
    if len(given) == 1:
        raise CaseError(f"robot.parameters.{key}", "must be a number or { min, max }, without brackets")
    return [_value(part, units, dimension) for part in given]


def _value(written: float | document.Range, units: Units, dimension: Dimension) -> Value:
    if not isinstance(written, document.Range):
        return units.to_internal(written, dimension)
    start = None if written.start is None else units.to_internal(written.start, dimension)
    return Free(units.to_internal(written.min, dimension), units.to_internal(written.max, dimension), start)


def _rotation(written: document.RotationTable | None, units: Units) -> Rotation:
    if written is None:
        return Rotation()
    return Rotation(written.axis, _value(written.angle, units, Dimension.ANGLE))


def _tasks(written: list[document.TaskTable]) -> list[Task]:
    return [_task(task, index) for index, task in enumerate(written)]


def _task(written: document.TaskTable, index: int) -> Task:
    key, name = f"task[{index}]", written.name or f"task {index + 1}"
    if written.twist is None:
        return Task(_screw(written, key), Sense(written.sense), name, written.weight)
    for part in ("axis", "point", "pitch"):
        if getattr(written, part) is not None:
            raise CaseError(f"{key}.{part}", "cannot stand beside twist; say the motion in one way")
    return Task(written.twist, Sense(written.sense), name, written.weight)


def _screw(written: document.TaskTable, key: str) -> FloatArray:
    """The unit twist of a task that is given by axis, point and pitch."""
    axis, point, pitch = written.axis, written.point, written.pitch
    if axis is None:
        raise CaseError(f"{key}.axis", "is missing: give axis, point and pitch, or twist")
    if not any(axis):
        raise CaseError(f"{key}.axis", "must not be zero: it gives no direction", axis)
    if pitch is None:
        raise CaseError(f"{key}.pitch", "is missing: a number, 0 for a rotation, inf for a translation")
    if pitch == math.inf:
        return screw_from_axis(axis, point or (0.0, 0.0, 0.0), pitch)
    if not math.isfinite(pitch):
        raise CaseError(f"{key}.pitch", "must be a number or inf", pitch)
    if point is None:
        raise CaseError(f"{key}.point", "is missing: any point on the axis")
    for part, number in (("pitch", pitch), *((f"point[{i}]", each) for i, each in enumerate(point))):
        if abs(number) > LARGEST:
            raise CaseError(f"{key}.{part}", f"must be at most {LARGEST:g} in size", number)
    return screw_from_axis(axis, point, pitch)
