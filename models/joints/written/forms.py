"""Checks of the form of each value in a robot file; an error names the place of the value in the file."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TypeAlias

from ...expression import CONSTANTS, FUNCTIONS
from ...model import ModelError

#: A scalar expression: a number or a text.
Expression: TypeAlias = str | float
#: A vector expression: a text, or three scalar expressions.
VectorExpression: TypeAlias = str | Sequence[Expression]

#: Allowed names of dimensions, points and joints.
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class RobotError(ModelError):
    """Error in a robot given joint by joint.

    Attributes:
        place: place in the robot file: limb, joint and key, such as ``limb 2, joint 1 (R), axis``; empty for the whole
            robot.
        fault: description of the fault, with the value read and the values allowed.
    """

    def __init__(self, place: str, fault: str) -> None:
        super().__init__(f"{place}: {fault}" if place else fault)
        self.place, self.fault = place, fault


class UndefinedError(RobotError):
    """Error of a point without a finite value, or of a direction that is zero, at these dimensions.

    Attributes:
        values: values of the names in the failing operation, one or three numbers each.
    """

    def __init__(self, place: str, fault: str, values: Mapping[str, tuple[float, ...]]) -> None:
        super().__init__(place, fault)
        self.values = values


def plain(value: object) -> object:
    """Return a value with lists and dicts, as in TOML, in place of other sequences and mappings."""
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(each) for each in value]
    return value


def check_names(names: Sequence[str] | Mapping[str, object], what: str, place: str = "") -> None:
    """Refuse names that are not identifiers, or that are functions or constants of expressions."""
    for name in names:
        where = f"{place}, {name}" if place else name
        if not NAME.fullmatch(name):
            raise RobotError(where, f"cannot be the name of {what}: letters, digits and _ are allowed, a letter first")
        if name in CONSTANTS or name in FUNCTIONS:
            raise RobotError(where, f"cannot be the name of {what}: it is a function or a constant of expressions")
        if list(names).count(name) > 1:
            raise RobotError(where, "is given twice")


def refuse_other_keys(place: str, table: Mapping[str, object], allowed: Sequence[str]) -> None:
    """Refuse a key that is not allowed."""
    for key in table:
        if key not in allowed:
            where = f"{place}, {key}" if place else str(key)
            raise RobotError(where, f"no such key; allowed are {', '.join(allowed)}")


def table_of(place: str, value: object) -> Mapping[str, object]:
    """Return a table, empty for None; refuse anything else."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise RobotError(place, f"is {value!r}; a table is needed")
    return value


def list_of(place: str, value: object) -> Sequence[object]:
    """Return a list; refuse anything else."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise RobotError(place, f"is {value!r}; a list is needed")
    return value


def text_of(place: str, value: object) -> str:
    """Return a text; refuse anything else."""
    if not isinstance(value, str):
        raise RobotError(place, f"is {value!r}; a text is needed")
    return value


def name_of(place: str, value: object) -> str:
    """Return a text without control characters; refuse anything else."""
    text = text_of(place, value)
    for letter in text:
        if not letter.isprintable():
            raise RobotError(place, f"has the character {letter!r}; only printable characters are allowed")
    return text


def real_of(place: str, value: object) -> float:
    """Return a finite number; refuse anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise RobotError(place, f"is {value!r}; a finite number is needed")
    return float(value)


def triple_of(place: str, value: object) -> tuple[float, float, float]:
    """Return three finite numbers; refuse anything else."""
    numbers = [real_of(place, each) for each in list_of(place, value)]
    if len(numbers) != 3:
        raise RobotError(place, f"has {len(numbers)} numbers; 3 are needed")
    return numbers[0], numbers[1], numbers[2]


def expression_of(place: str, value: object) -> Expression:
    """Return a scalar expression: a finite number or a text; refuse anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise RobotError(place, f"is {value!r}; a number or an expression is needed")
    if isinstance(value, float) and not math.isfinite(value):
        raise RobotError(place, f"is {value!r}; a finite number is needed")
    return value


def vector_of(place: str, value: object) -> VectorExpression:
    """Return a vector expression: a text, or three scalar expressions; refuse anything else."""
    if isinstance(value, str):
        return value
    parts = [expression_of(place, each) for each in list_of(place, value)]
    if len(parts) != 3:
        raise RobotError(place, f"has {len(parts)} components; a vector has 3, or is an expression")
    return parts
