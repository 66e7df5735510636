"""Robots by name, with their options checked; whatever is wrong with another package's robot becomes a sentence."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Mapping
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from ...models import Model, RobotFunction, UnknownModelError, model_names, robot_function
from ..errors import CaseError, listing, nearest
from .schema import RobotTable
from .starter import toml_value


def build_model(name: str, options: Mapping[str, Any] | None = None) -> Model:
    """The robot of a name, with its options checked against what its function declares.

    Raises:
        CaseError: no such robot or option, or an option has a value that is not allowed.
    """
    options = options or {}
    function = _function(name)
    declared, hints = _signature(name, function)
    for key, value in options.items():
        if key not in declared:
            allowed = [*declared, *RobotTable.model_fields]
            raise CaseError(f"robot.{key}", f"no such key; {nearest(key, allowed)}")
        try:
            adapter = TypeAdapter(hints.get(key, Any), config=ConfigDict(strict=True, allow_inf_nan=False))
            adapter.validate_python(value)
        except ValidationError as error:
            fault = error.errors()[0]["msg"].replace("Input should be", "must be")
            raise CaseError(f"robot.{key}", fault, value) from None
    for key, option in declared.items():
        if option.default is option.empty and key not in options:
            raise CaseError(f"robot.{key}", f"is missing: {name!r} needs it")
    try:
        model = function(**options)
    except Exception as error:  # whatever another package's function may raise
        raise _unusable(name, function, f"{type(error).__name__}: {error}") from error
    if not isinstance(model, Model):
        raise _unusable(name, function, f"it returned a {type(model).__name__}, not a Model")
    if model.name != name:
        raise _unusable(name, function, f"its model calls itself {model.name!r}")
    return model


def _unusable(name: str, function: RobotFunction, fault: str) -> CaseError:
    origin = f"{getattr(function, '__module__', '?')}:{getattr(function, '__qualname__', '?')}"
    return CaseError("robot.model", f"cannot be used: {origin}: {fault}", name)


def model_options(name: str) -> list[tuple[str, str, str | None]]:
    """Options of a robot: name, what is allowed, default; no default when the option must be given."""
    declared, hints = _signature(name, _function(name))
    rows: list[tuple[str, str, str | None]] = []
    for key, option in declared.items():
        hint = hints.get(key, Any)
        choices = typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()
        allowed = listing(map(toml_value, choices)) if choices else getattr(hint, "__name__", str(hint))
        rows.append((key, allowed, None if option.default is option.empty else toml_value(option.default)))
    return rows


def _signature(name: str, function: RobotFunction) -> tuple[Mapping[str, inspect.Parameter], dict[str, Any]]:
    """What a robot function declares: its options, and their types."""
    try:
        declared = inspect.signature(function).parameters
        hints = typing.get_type_hints(function)
    except Exception as error:  # a hint may name anything
        raise _unusable(name, function, f"{type(error).__name__}: {error}") from error
    for key, option in declared.items():
        if option.kind not in (option.KEYWORD_ONLY, option.POSITIONAL_OR_KEYWORD):
            raise _unusable(name, function, f"its option {key!r} cannot be given by name")
    return declared, hints


def _function(name: str) -> RobotFunction:
    try:
        function = robot_function(name)
    except UnknownModelError:
        raise CaseError("robot.model", f"no such robot; {nearest(name, model_names())}", name) from None
    except Exception as error:  # importing another package may raise anything
        raise CaseError("robot.model", f"cannot be used: {type(error).__name__}: {error}", name) from error
    if not callable(function) or isinstance(function, Model):
        raise CaseError("robot.model", f"cannot be used: its entry point is a {type(function).__name__}", name)
    return function
