"""Reader of results: what ``--json`` wrote becomes a typed value again."""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Literal, TypeAlias, Union, get_args, get_origin

from ..errors import InputError, listing
from .certified import CertifiedResult
from .checks import ChecksResult
from .comparison import ComparisonResult
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .front import FrontResult
from .jsondata import JsonObject, Mark, Size
from .parts import SCHEMA
from .schema import RESULTS
from .sweep import SweepResult
from .tradeoff import TradeoffResult
from .workspace import WorkspaceResult

Result: TypeAlias = (
    SolveResult
    | CombinedResult
    | EvaluationResult
    | CertifiedResult
    | ChecksResult
    | TradeoffResult
    | WorkspaceResult
    | ComparisonResult
    | FrontResult
    | SweepResult
)

#: Largest file of a result, bytes: a case with hundreds of poses writes a few million.
_LARGEST = 64_000_000
#: Integers up to this size are numbers without loss.
_LARGEST_INTEGER = 2**53
_WORDS: dict[object, str] = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a text",
    NoneType: "null",
}


class _WrongValueError(ValueError):
    """A value that its type does not allow.

    Attributes:
        key: dotted key of the value.
    """

    def __init__(self, key: str, fault: str) -> None:
        self.key = key
        super().__init__(f"{key}: {fault}" if key else fault)


def load_result(file: str | Path) -> Result:
    """Read a result that a command, such as ``solve``, ``evaluate`` or ``workspace``, wrote with ``--json``.

    Args:
        file: path of the file.

    Returns:
        The typed value; :func:`~.jsondata.json_data` makes the same JSON of it again.

    Raises:
        InputError: the file cannot be read, or holds no result of this version of the format.
    """
    try:
        with Path(file).open("rb") as stream:
            content = stream.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise InputError(f"{file}: is larger than {_LARGEST // 1_000_000} MB, which no result is")
        tables = json.loads(content.decode("utf-8-sig"), parse_constant=_refuse_constant)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: is not valid JSON: {error}") from None
    return result_from_json(tables, str(file))


def _refuse_constant(word: str) -> None:
    """Refuse the words for infinite and undefined numbers, which are no JSON.

    Raises:
        ValueError: always.
    """
    raise ValueError(f"{word} is no number")


def result_from_json(tables: object, source: str) -> Result:
    """Return the typed value of a result as JSON's own types.

    Args:
        tables: the document.
        source: name of the document, for messages.

    Raises:
        InputError: it is no result of this version of the format.
    """
    try:
        return _result(tables)
    except _WrongValueError as error:
        raise InputError(f"{source}: is no result of screwsynth: {error}") from None


def _result(tables: object) -> Result:
    """Return the result of a JSON document.

    Raises:
        _WrongValueError: the document is no result.
    """
    if not isinstance(tables, dict):
        raise _WrongValueError("", "must be an object")
    if tables.get("schema") != SCHEMA:
        raise _WrongValueError("schema", f"must be {SCHEMA}, the version of the format, got {tables.get('schema')!r}")
    required = {kind: set(_keys(kind, required=True)) for kind in RESULTS}
    # The kinds have different keys; the one that misses least is the one that was meant.
    kind = min(RESULTS, key=lambda each: (len(required[each] - tables.keys()), -len(required[each])))
    found: Any = _object(kind, tables, "")
    return found  # type: ignore[no-any-return]


def _keys(kind: type[JsonObject], *, required: bool) -> list[str]:
    """Return the keys of an object in JSON, those of its inline parts among them.

    Args:
        kind: of the object.
        required: only the keys that are never absent.
    """
    keys = []
    for name, annotation in kind.__annotations__.items():
        mark = kind.marks[name]
        if mark is Mark.INLINE:
            part = _inline_kind(annotation)
            if not (required and part is not get_args(annotation)[0]):
                keys += _keys(part, required=required)
        elif mark is None or not required:
            keys.append(name)
    return keys


def _inline_kind(annotation: object) -> type[JsonObject]:
    """Return the type whose fields stand in the place of a field."""
    inner = get_args(annotation)[0]
    kinds = [inner] if isinstance(inner, type) else [each for each in get_args(inner) if each is not NoneType]
    kind: type[JsonObject] = kinds[0]
    return kind


def _object(kind: type[JsonObject], table: object, key: str) -> JsonObject:
    """Return an object of a type.

    Raises:
        _WrongValueError: a key is missing or unknown, or a value is not allowed.
    """
    if not isinstance(table, dict):
        raise _WrongValueError(key, "must be an object")
    allowed = _keys(kind, required=False)
    for name in table:
        if name not in allowed:
            raise _WrongValueError(_below(key, name), f"no such key; allowed: {listing(allowed)}")
    return _fields(kind, table, key)


def _fields(kind: type[JsonObject], table: Mapping[str, object], key: str) -> JsonObject:
    """Return an object from a table that may hold other keys too; the errors are those of :func:`_object`."""
    values: dict[str, object] = {}
    for name, annotation in kind.__annotations__.items():
        mark = kind.marks[name]
        if mark is Mark.INLINE:
            part = _inline_kind(annotation)
            may_miss = part is not get_args(annotation)[0]
            missing = may_miss and table.keys().isdisjoint(_keys(part, required=False))
            values[name] = None if missing else _fields(part, table, key)
        elif name in table:
            values[name] = _value(annotation, table[name], _below(key, name))
        elif mark is Mark.ABSENT:
            values[name] = None
        else:
            raise _WrongValueError(_below(key, name), "is missing")
    return kind(**values)


def _value(kind: object, value: object, key: str) -> object:
    """Return a value of an annotation.

    Raises:
        _WrongValueError: the annotation does not allow the value.
    """
    if kind is object:
        return value
    if kind in _WORDS:
        if kind is float and isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _LARGEST_INTEGER:
            return float(value)
        if type(value) is not kind:
            raise _WrongValueError(key, f"must be {_WORDS[kind]}")
        return value
    if isinstance(kind, type) and issubclass(kind, JsonObject):
        return _object(kind, value, key)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        words = {member.value: member for member in kind}
        if not isinstance(value, str) or value not in words:
            raise _WrongValueError(key, f"must be one of {listing(map(repr, words))}")
        return words[value]
    return _compound(kind, value, key)


def _compound(kind: object, value: object, key: str) -> object:
    """Return a value of an annotation with arguments; the errors are those of :func:`_value`."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        found = _value(arguments[0], value, key)
        for mark in arguments[1:]:
            if isinstance(mark, Size) and isinstance(found, tuple) and len(found) != mark.entries:
                raise _WrongValueError(key, f"must have {mark.entries} entries, got {len(found)}")
        return found
    if origin is Literal:
        if value not in arguments or isinstance(value, bool):
            raise _WrongValueError(key, f"must be one of {listing(map(repr, arguments))}")
        return value
    if origin in (Union, UnionType):
        return _one_of(arguments, value, key)
    if origin is tuple:
        if not isinstance(value, list):
            raise _WrongValueError(key, "must be a list")
        return tuple(_value(arguments[0], each, f"{key}[{index}]") for index, each in enumerate(value))
    if not isinstance(value, dict):
        raise _WrongValueError(key, "must be an object")
    return MappingProxyType({name: _value(arguments[1], each, _below(key, name)) for name, each in value.items()})


def _one_of(kinds: tuple[object, ...], value: object, key: str) -> object:
    """Return a value of the first of several annotations that allows it.

    Raises:
        _WrongValueError: none does; the fault that lies deepest is the one of the annotation that was meant.
    """
    faults = []
    # An exact type goes before a number that an integer could become.
    for kind in sorted(kinds, key=lambda each: each is not type(value)):
        try:
            return _value(kind, value, key)
        except _WrongValueError as error:
            faults.append(error)
    raise max(faults, key=lambda error: len(error.key))


def _below(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name
