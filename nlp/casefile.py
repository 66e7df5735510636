"""Case files: from TOML to a :class:`~screwsynth.nlp.case.Case`, the only place where degrees become radians.

A case is named by its path, or, for the ones that come with the package, by its bare name.
"""

from __future__ import annotations

import inspect
import tomllib
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

import screwsynth.cases
from screwsynth.models import Dimension, Model, RobotFunction, component_names, model_names, robot_function
from screwsynth.nlp import document
from screwsynth.nlp.case import Case, Expectation, Free, Published, Rotation, Search, Sense, Task, Value
from screwsynth.nlp.errors import CaseError, InputError, listing, nearest
from screwsynth.nlp.units import Units

_SHIPPED = Path(screwsynth.cases.__file__).parent


def shipped_cases() -> tuple[str, ...]:
    """Names of the cases that come with the package, in order."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def find_case(name: str) -> Path:
    """File of a case given by its path or, for a shipped one, its bare name.

    Raises:
        InputError: there is no such file.
    """
    path = Path(name)
    if path.is_file():
        return path
    shipped = _SHIPPED / f"{name}.toml"
    if path.name == name and path.suffix != ".toml" and shipped.is_file():
        return shipped
    if path.is_dir():
        raise InputError(f"{name}: is a folder, not a case file")
    raise InputError(
        f"{name}: no such file, and no case of this name comes with screwsynth; {nearest(name, shipped_cases())}"
    )


def load_case(name: str, settings: Mapping[str, Any] | None = None) -> Case:
    """Read a case.

    Args:
        name: path of a TOML file, or the bare name of a shipped case.
        settings: numbers by name that replace what the file says, in the file's units: a parameter or one of its
            components (``base_1_x``), ``p_x``, ``p_y``, ``p_z``, ``angle``, or ``axis`` with three numbers.

    Raises:
        InputError: the file cannot be read or says something that is not allowed.
    """
    path = find_case(name)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    return case_from_tables(tables, name=path.stem, source=path.name, settings=settings or {})


def case_from_tables(
    tables: dict[str, Any], *, name: str, source: str, settings: Mapping[str, Any] | None = None
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
        for key, value in (settings or {}).items():
            _set(tables, key, value)
        return _case(document.parse_document(tables), name)
    except CaseError as error:
        raise error.within(source) from None


def _case(written: document.Document, name: str) -> Case:
    units = Units(written.units.length, written.units.angle)
    model = build_model(written.robot.model, written.robot.options)
    if not model.has_couples and "characteristic_length" in written.robot.model_fields_set:
        raise CaseError("robot.characteristic_length", f"means nothing for {model.name!r}, which has no couple rows")
    dimensions = {parameter.name: parameter.dimension for parameter in model.parameters}
    search = written.solve
    return Case(
        model=model,
        parameters={
            key: [_value(part, units, dimensions.get(key, Dimension.NUMBER)) for part in given]
            if isinstance(given, list)
            else _value(given, units, dimensions.get(key, Dimension.NUMBER))
            for key, given in written.robot.parameters.items()
        },
        position=[_value(part, units, Dimension.LENGTH) for part in written.pose.position],
        rotation=_rotation(written.pose.rotation, units),
        tasks=_tasks(written.task),
        units=units,
        characteristic_length=written.robot.characteristic_length,
        search=Search(search.starts, search.seed, search.max_iterations),
        title=written.title,
        name=name,
        expect=Expectation(written.expect.F, written.expect.tolerance, written.expect.singular),
        published=tuple(
            Published(
                row.quantity,
                tuple(row.value) if isinstance(row.value, list) else row.value,
                row.source,
                row.reproduced,
                row.because,
            )
            for row in written.published
        ),
    )


def build_model(name: str, options: Mapping[str, Any] | None = None) -> Model:
    """The robot of a name, with its options checked against what its function declares.

    Raises:
        CaseError: no such robot or option, or an option has a value that is not allowed.
    """
    options = options or {}
    function = _function(name)
    hints = typing.get_type_hints(function)
    declared = inspect.signature(function).parameters
    for key, value in options.items():
        if key not in declared:
            allowed = [*declared, *document.RobotTable.model_fields]
            raise CaseError(f"robot.{key}", f"no such key; {nearest(key, allowed)}")
        try:
            TypeAdapter(hints.get(key, Any), config=ConfigDict(strict=True)).validate_python(value)
        except ValidationError as error:
            fault = error.errors()[0]["msg"].replace("Input should be", "must be")
            raise CaseError(f"robot.{key}", fault, value) from None
    for key, option in declared.items():
        if option.default is option.empty and key not in options:
            raise CaseError(f"robot.{key}", f"is missing: {name!r} needs it")
    return function(**options)


def model_options(name: str) -> list[tuple[str, str, str]]:
    """Options of a robot: name, what is allowed, default."""
    function = _function(name)
    hints = typing.get_type_hints(function)
    rows = []
    for key, option in inspect.signature(function).parameters.items():
        hint = hints.get(key, Any)
        choices = typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()
        allowed = listing(f'"{choice}"' for choice in choices) if choices else getattr(hint, "__name__", str(hint))
        rows.append((key, allowed, "none: must be given" if option.default is option.empty else f'"{option.default}"'))
    return rows


def _function(name: str) -> RobotFunction:
    try:
        return robot_function(name)
    except KeyError:
        raise CaseError("robot.model", f"no such robot; {nearest(name, model_names())}", name) from None


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
    if len(written) > 1:
        raise CaseError("task", "several tasks are not supported yet by this version; keep one")
    return [_task(task, index) for index, task in enumerate(written)]


def _task(written: document.TaskTable, index: int) -> Task:
    key, name = f"task[{index}]", written.name or f"task {index + 1}"
    by_axis = {"axis": written.axis, "point": written.point, "pitch": written.pitch}
    if written.twist is not None:
        for part, given in by_axis.items():
            if given is not None:
                raise CaseError(f"{key}.{part}", "cannot stand beside twist; say the motion in one way")
        return Task(written.twist, Sense(written.sense), name, written.weight)
    point = written.point
    if written.axis is None:
        raise CaseError(f"{key}.axis", "is missing: give axis, point and pitch, or twist")
    if written.pitch is None:
        raise CaseError(f"{key}.pitch", "is missing: a number, 0 for a rotation, inf for a translation")
    if point is None:
        if written.pitch != float("inf"):
            raise CaseError(f"{key}.point", "is missing: any point on the axis")
        point = [0.0, 0.0, 0.0]
    if not any(written.axis):
        raise CaseError(f"{key}.axis", "must not be zero: it gives no direction", written.axis)
    if written.pitch != written.pitch or written.pitch == float("-inf"):
        raise CaseError(f"{key}.pitch", "must be a number or inf", written.pitch)
    return Task.screw(
        written.sense, axis=written.axis, point=point, pitch=written.pitch, name=name, weight=written.weight
    )


def _set(tables: dict[str, Any], name: str, value: Any) -> None:  # noqa: ANN401 - whatever TOML can hold
    """Replace one number in the document's tables; what it cannot find it refuses."""
    parameters = tables.get("robot", {}).get("parameters", {})
    pose = tables.setdefault("pose", {})
    places: dict[str, tuple[Any, int | str]] = {}
    for key, given in parameters.items():
        if isinstance(given, list):
            places.update({part: (given, i) for i, part in enumerate(component_names(key, len(given)))})
        else:
            places[key] = (parameters, key)
    if isinstance(pose.get("position"), list):
        places.update({part: (pose["position"], i) for i, part in enumerate(component_names("p", 3))})
    if name in ("angle", "axis"):
        places |= {
            part: (pose.setdefault("rotation", {"axis": [0, 0, 1], "angle": 0}), part) for part in ("angle", "axis")
        }
    if name not in places:
        raise CaseError(name, f"cannot be set; {nearest(name, [*places, 'angle', 'axis'])}")
    table, place = places[name]
    table[place] = value
