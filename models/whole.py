"""Values with parts that share symbols: expressions, pickles and copies.

A CasADi symbol is known by its identity: expressions that are pickled one by one lose shared symbols, and CasADi
pickles none outside a context that is global to the process. A :class:`Whole` is therefore pickled at once: all its
expressions in one piece, in which shared symbols stay shared, and everything else in another.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, Self, TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from .arrays import FloatArray

Value = TypeVar("Value")


def expressions_of(value: object) -> list[SX]:
    """Return all expressions of a value and its parts: data classes, tuples and dicts, in the order of their fields."""
    if isinstance(value, SX):
        return [value]
    return [expression for part in _parts(value).values() for expression in expressions_of(part)]


def with_expressions(value: Value, expressions: Iterator[SX]) -> Value:
    """Return a value whose expressions, see :func:`expressions_of`, are replaced by the next ones of an iterator."""
    parts = {key: with_expressions(part, expressions) for key, part in _parts(value).items()}
    found: Any = value
    if isinstance(value, SX):
        found = next(expressions)
    elif isinstance(value, tuple):
        found = tuple.__new__(type(value), parts.values())
    elif isinstance(value, dict):
        found = parts
    elif parts:
        found = replace(found, **parts)
    same_type: Value = found
    return same_type


def _parts(value: object) -> dict[Any, object]:
    """Return the parts of a value: fields, items of a dict, or elements of a tuple by index."""
    if isinstance(value, tuple):
        return dict(enumerate(value))
    if isinstance(value, dict):
        return value
    return {each.name: getattr(value, each.name) for each in fields(value)} if is_dataclass(value) else {}


class Whole:
    """Frozen dataclass that is pickled and deep-copied as a whole, without cached values.

    Its fields may hold symbols, read-only arrays and mappings, and other values of this kind. A pickle is valid only
    for the version of the package that made it.
    """

    def __reduce_ex__(self, protocol: object) -> tuple[Any, ...]:
        content = io.BytesIO()
        pickler = _Pickler(content)
        pickler.dump(self)
        return _unpacked, (content.getvalue(), _packed_expressions(pickler.expressions))

    def __copy__(self) -> Self:
        """Return the value itself, which is immutable."""
        return self


class _Pickler(pickle.Pickler):
    """Pickler that collects expressions in a list outside the pickle.

    Attributes:
        expressions: all expressions, each once.
    """

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self.expressions: list[SX] = []
        self._places: dict[int, int] = {}

    def persistent_id(self, value: object) -> int | None:
        """Return the index of an expression in the list; None for any other value."""
        if not isinstance(value, SX):
            return None
        if id(value) not in self._places:
            self._places[id(value)] = len(self.expressions)
            self.expressions.append(value)
        return self._places[id(value)]

    def reducer_override(self, value: object) -> Any:  # noqa: ANN401 - a tuple, or the constant NotImplemented
        """Return the reduction of a value where Python's own rules would change it."""
        if isinstance(value, Whole):
            state = {item.name: getattr(value, item.name) for item in fields(value)}  # type: ignore[arg-type]
            return object.__new__, (type(value),), state
        if isinstance(value, MappingProxyType):
            return _read_only_mapping, (dict(value),)
        if isinstance(value, np.ndarray) and not value.flags.writeable:
            return _read_only, (value.copy(),)
        return NotImplemented


class _Unpickler(pickle.Unpickler):
    """The inverse of :class:`_Pickler`."""

    def __init__(self, file: io.BytesIO, expressions: list[SX]) -> None:
        super().__init__(file)
        self._expressions = expressions

    def persistent_load(self, place: Any) -> SX:  # noqa: ANN401 - pickle's own signature
        expression: SX = self._expressions[place]
        return expression


def _unpacked(content: bytes, expressions: str) -> object:
    return _Unpickler(io.BytesIO(content), _unpacked_expressions(expressions)).load()


def _packed_expressions(expressions: list[SX]) -> str:
    """Return expressions as one text; empty for no expressions."""
    if not expressions:
        return ""
    serializer = ca.StringSerializer()
    serializer.pack(expressions)
    text: str = serializer.encode()
    return text


def _unpacked_expressions(text: str) -> list[SX]:
    if not text:
        return []
    found: list[SX] = ca.StringDeserializer(text).unpack()
    return found


def _read_only_mapping(values: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a read-only mapping; pickle needs this function because the type has no importable name."""
    return MappingProxyType(values)


def _read_only(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array
