"""Robots by name, with checks of their options.

Any error in a robot of another package becomes a message that names its function.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ConfigDict, PydanticSchemaGenerationError, TypeAdapter, ValidationError

from ...models import AmbiguousModelError, Model, RobotFunction, UnknownModelError, model_names, robot_function
from ..errors import CaseError, listing, nearest
from .schema import RobotTable
from .source import shipped_cases
from .toml import option_text


def build_model(name: str, options: Mapping[str, Any] | None = None) -> Model:
    """Return a robot by name.

    Args:
        name: name of the robot.
        options: options of the robot by name, as ``tomllib`` returns them; checked against its function's signature.

    Raises:
        CaseError: there is no such robot or option, or an option has a value that is not allowed.
    """
    options = options or {}
    function = _find_function(name)
    declared, hints = _signature(name, function)
    for key, value in options.items():
        if key not in declared:
            allowed = [*declared, *RobotTable.model_fields]
            raise CaseError(f"robot.{key}", f"no such key; {nearest(key, allowed)}")
        try:
            adapter = TypeAdapter(hints.get(key, Any), config=ConfigDict(strict=True, allow_inf_nan=False))
            adapter.validate_python(value)
        except PydanticSchemaGenerationError as error:
            raise _error(name, function, f"the type of its option {key!r} cannot be checked") from error
        except ValidationError as error:
            fault = error.errors()[0]["msg"].replace("Input should be", "must be")
            raise CaseError(f"robot.{key}", fault, value) from None
    for key, option in declared.items():
        if option.default is option.empty and key not in options:
            raise CaseError(f"robot.{key}", f"is missing: the robot {name!r} needs this option")
    try:
        model = function(**options)
    except (Exception, SystemExit) as error:  # another package's function may raise any exception
        raise _error(name, function, f"{type(error).__name__}: {error}") from error
    if not isinstance(model, Model):
        raise _error(name, function, f"expected a Model as result, got {type(model).__name__}")
    if model.name != name:
        raise _error(name, function, f"expected a model with this name, got {model.name!r}")
    return model


def model_of_table(table: RobotTable, robot_file: str | None = None) -> Model:
    """Return the robot of the table ``[robot]``, by its name or by its definition.

    Args:
        table: the table.
        robot_file: name of the file of the definition; None if the case file contains the definition.

    Raises:
        CaseError: there is no such robot or option, or the definition has an error.
    """
    if table.definition is None:
        return build_model(table.model or "", table.options)
    from .robotfile import model_of_definition  # noqa: PLC0415 - few cases have a robot of their own

    for key in table.options:
        raise CaseError(f"robot.{key}", f"no such key; {nearest(key, RobotTable.model_fields)}")
    return model_of_definition(table.definition, robot_file)


def insert_robot_file(tables: dict[str, Any], folder: Path) -> str | None:
    """Replace the name of a robot file in a case by the content of the file.

    Args:
        tables: the case, as ``tomllib`` returns it; ``file`` of its table ``robot`` becomes ``definition``.
        folder: folder of the case file, from which the name begins.

    Returns:
        Name of the robot file; None if the case has none.

    Raises:
        CaseError: the file cannot be read or has an error, or the case also gives the robot in another way.
    """
    table = tables.get("robot")
    if not isinstance(table, dict) or "file" not in table:
        return None
    from .robotfile import insert_robot  # noqa: PLC0415 - few cases have a robot of their own

    return insert_robot(tables, folder)


def _error(name: str, function: RobotFunction, fault: str) -> CaseError:
    """Return the error for a robot function that cannot be used."""
    origin = f"{getattr(function, '__module__', '?')}:{getattr(function, '__qualname__', '?')}"
    return CaseError("robot.model", f"cannot be used: {origin}: {fault}", name)


class ModelOption(NamedTuple):
    """Option of a robot.

    Attributes:
        name: name of the option.
        allowed: description of the allowed values.
        default: default value as TOML; None if the option must be given.
        choices: allowed values, if they can be listed; otherwise empty.
        meaning: meaning of the values; empty if the robot's function does not annotate it.
    """

    name: str
    allowed: str
    default: str | None
    choices: tuple[Any, ...] = ()
    meaning: str = ""


def model_options(name: str) -> list[ModelOption]:
    """Return the options of a robot.

    Raises:
        CaseError: there is no such robot, or its function cannot be used.
    """
    declared, hints = _signature(name, _find_function(name))
    rows = []
    for key, option in declared.items():
        hint, meaning = _meaning_of(hints.get(key, Any))
        choices = typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()
        allowed = listing(map(option_text, choices)) if choices else getattr(hint, "__name__", str(hint))
        default = None if option.default is option.empty else option_text(option.default)
        rows.append(ModelOption(key, allowed, default, choices, meaning))
    return rows


def _meaning_of(hint: object) -> tuple[Any, str]:
    """Return the type of an option, and its meaning: the first text of its ``Annotated``, or empty."""
    if typing.get_origin(hint) is not typing.Annotated:
        return hint, ""
    kind, *notes = typing.get_args(hint)
    return kind, next((note for note in notes if isinstance(note, str)), "")


def _signature(name: str, function: RobotFunction) -> tuple[Mapping[str, inspect.Parameter], dict[str, Any]]:
    """Return the parameters of a robot function, and their types.

    Raises:
        CaseError: the function cannot be used.
    """
    try:
        declared = inspect.signature(function).parameters
        hints = typing.get_type_hints(function, include_extras=True)
    except Exception as error:  # a hint may name anything
        raise _error(name, function, f"{type(error).__name__}: {error}") from error
    for key, option in declared.items():
        if option.kind not in (option.KEYWORD_ONLY, option.POSITIONAL_OR_KEYWORD):
            raise _error(name, function, f"its parameter {key!r} must be a keyword parameter")
    return declared, hints


def _hint(name: str) -> str:
    """Return a hint for the name of a robot that does not exist."""
    if name.endswith(".toml"):
        return f'for a robot file, write file = "{name}" instead of model'
    if name in shipped_cases():
        return f"{name!r} is a case; use it with screwsynth solve"
    return nearest(name, model_names())


def _find_function(name: str) -> RobotFunction:
    """Return the function of a robot.

    Raises:
        CaseError: there is no such robot, or its entry point is not a function.
    """
    try:
        function = robot_function(name)
    except UnknownModelError:
        raise CaseError("robot.model", f"no such robot; {_hint(name)}", name) from None
    except AmbiguousModelError as error:
        raise CaseError("robot.model", f"is ambiguous: {error}", name) from None
    except (Exception, SystemExit) as error:  # importing another package may raise anything
        raise CaseError("robot.model", f"cannot be used: {type(error).__name__}: {error}", name) from error
    if not callable(function) or isinstance(function, Model):
        fault = f"cannot be used: its entry point must be a function, got {type(function).__name__}"
        raise CaseError("robot.model", fault, name)
    return function
