"""Cases for commands that need only a robot: files without a task, robot files, and robots by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from ...models import Dimension, Model, model_names
from ..units import Units
from .overrides import Settings
from .reader import CaseFile, case_from_tables, is_robot_file
from .robotfile import model_of_definition, read_definition
from .robots import build_model
from .source import find_case, inputs_of, named_files, read_text, shipped_cases, source_name, tables_of
from .toml import toml_document

#: A motion for cases without a task, which nothing reads.
_UNREAD = {"sense": "min", "twist": [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]}


def read_robot_case(name: str, settings: Settings | None = None) -> CaseFile:
    """Read a case that may lack task and pose, a robot file, or a robot by its name.

    The dimensions of a robot file and of a robot by name are their typical values.

    Args:
        name: path of a file, name of a shipped case or of a robot, or ``-`` for standard input.
        settings: values by name that replace those of the file, as for :func:`~.reader.load_case`.

    Raises:
        InputError: the file cannot be read, or has an error.
    """
    if name in model_names() and name not in shipped_cases() and not Path(name).exists():
        tables = _typical(build_model(name), {"model": name})
        return _read(tables, name, name, settings, None, {})
    path = find_case(name)
    text = read_text(path)
    tables = tables_of(path, text)
    inputs, named = inputs_of(path, tables), named_files(tables, path.parent)
    source = source_name(path)
    if is_robot_file(tables):
        model = model_of_definition(read_definition(source, Path()), source)
        tables = _typical(model, {"file": path.name})
        return _read(tables, Path(source).stem, Path(source).name, settings, path.parent, inputs)
    found = _read(tables, Path(source).stem, Path(source).name, settings, path.parent, inputs)
    return found if named or settings else found._replace(text=text)


def _typical(model: Model, robot: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a case with the typical dimensions of a robot."""
    units = Units(length=model.length_unit or Units.length)
    parameters: dict[str, Any] = {}
    for item in model.parameters:
        angle = item.dimension is Dimension.ANGLE
        values = [units.written(each, item.dimension) if angle else float(each) for each in item.typical]
        parameters[item.name] = values if len(values) > 1 else values[0]
    return {
        "units": {"length": units.length},
        "robot": robot | {"parameters": parameters},
        "pose": {"position": [float(each) for each in model.home]},
    }


def _read(
    tables: dict[str, Any],
    name: str,
    source: str,
    settings: Settings | None,
    folder: Path | None,
    inputs: Any,  # noqa: ANN401 - that of CaseFile
) -> CaseFile:
    """Return the case of tables that may lack task and pose, with a text that states what they state."""
    lacks = []
    if not {"task", "tasks", "objective"} & tables.keys():
        tables["task"] = [dict(_UNREAD)]
        lacks.append("task")
    if not {"pose", "poses"} & tables.keys():
        tables["pose"] = {"position": [0.0, 0.0, 0.0]}
        lacks.append("pose")
    case = case_from_tables(tables, name=name, source=source, settings=settings or {}, folder=folder or Path())
    for key in lacks:
        del tables[key]
    if "pose" in lacks:
        case = replace(case, position=case.model.home)
    return CaseFile(case, toml_document(tables), inputs)
