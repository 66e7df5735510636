"""Strict reading of JSON: plain values first, then typed values by their annotations.

The text is not trusted: its depth and number of values are limited, every number is finite, keys are unique, and every
text can be written again. A fault is a ``ValueError`` of one sentence.
"""

from __future__ import annotations

import dataclasses
import enum
import json
import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

from ..errors import listing, nearest

#: Largest nesting depth, and largest number of commas and brackets: each stands for a value that takes many times its
#: bytes.
_DEPTH, _MOST = 64, 1_000_000
#: Largest integer that is exact as a floating-point number.
_LARGEST_INTEGER = 2**53
_WORDS: dict[object, str] = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a text",
    NoneType: "null",
}

Kind = TypeVar("Kind")


class Size(NamedTuple):
    """Mark of an annotated list: number of its entries."""

    entries: int


class Made(NamedTuple):
    """Mark of an annotation for a field with a value that differs from JSON's.

    Attributes:
        of: function from the annotated value to the field's value.
    """

    of: Callable[[Any], object]


class Entry(NamedTuple):
    """Declaration of a field of a class, of which JSON writes objects.

    Attributes:
        name: name of the attribute.
        key: key in JSON.
        kind: annotation of the value.
        default: value for a missing key; ``dataclasses.MISSING`` for a required key.
        inline: class of a value whose fields are written in its place; otherwise None.
    """

    name: str
    key: str
    kind: object
    default: object = dataclasses.MISSING
    inline: type | None = None

    @property
    def is_required(self) -> bool:
        """True if the key is required."""
        return self.default is dataclasses.MISSING


class WrongValueError(ValueError):
    """Error for a value that its declared type does not allow.

    Attributes:
        key: dotted key of the value.
    """

    def __init__(self, key: str, fault: str) -> None:
        self.key = key
        super().__init__(f"{key}: {fault}" if key else fault)


def json_tree(content: str | bytes) -> object:
    """Return the value of a JSON text, which may begin with a byte order mark.

    Raises:
        ValueError: the text is not valid JSON, or is refused as in the description of this module.
    """
    try:
        text = content.decode("utf-8-sig") if isinstance(content, bytes) else content
        if sum(map(text.count, ",[{")) > _MOST:
            raise ValueError(f"it has more than {_MOST:,} commas and brackets")
        tree = json.loads(
            text, parse_constant=_number, parse_float=_number, parse_int=_integer, object_pairs_hook=_unique
        )
        # An escape may be half of a surrogate pair, which no file can contain.
        if "\\ud" in text or "\\uD" in text:
            json.dumps(tree, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ValueError("a text contains half of a character (a lone surrogate)") from None
    except RecursionError:
        raise ValueError("lists or objects are nested too deeply") from None
    level = [tree]
    for _ in range(_DEPTH):
        level = [part for each in level if isinstance(each, list | dict) for part in _parts(each)]
        if not any(isinstance(each, list | dict) for each in level):
            return tree
    raise ValueError("lists or objects are nested too deeply")


def _parts(value: list[object] | dict[str, object]) -> Iterable[object]:
    return value.values() if isinstance(value, dict) else value


def _number(text: str) -> float:
    """Return a finite number; ``NaN`` and ``Infinity`` are not JSON."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{_short(text)} is not a finite number")
    return value


def _integer(text: str) -> int:
    """Return an integer of a size that other number types can represent."""
    if len(text) > len(str(-_LARGEST_INTEGER)) or abs(int(text)) > _LARGEST_INTEGER:
        raise ValueError(f"the integer {_short(text)} is too large")
    return int(text)


def _short(text: str) -> str:
    return text if len(text) <= 24 else f"{text[:21]}..."


def _unique(pairs: Iterable[tuple[str, object]]) -> dict[str, object]:
    """Return an object with unique keys."""
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {_short(key)!r} occurs twice in an object")
        found[key] = value
    return found


def value_of(kind: object, value: object, key: str = "") -> Any:  # noqa: ANN401 - kind's
    """Return a JSON value converted to the type of an annotation; a list becomes a tuple.

    Args:
        kind: the annotation: a plain type, an enumeration, a class of :func:`object_of`, ``Literal``, a union, a tuple
            of one kind, or a mapping from texts.
        value: value that :func:`json_tree` returns.
        key: its dotted key, for messages.

    Raises:
        WrongValueError: the annotation does not allow the value.
    """
    if kind is object:
        return value
    if kind in _WORDS:
        return _plain(kind, value, key)
    if isinstance(kind, type) and get_origin(kind) is None:
        return object_of(kind, value, key) if not issubclass(kind, enum.Enum) else _member(kind, value, key)
    return _compound(kind, value, key)


def _plain(kind: object, value: object, key: str) -> object:
    """Return a number, a text, true, false or null; the errors are those of :func:`value_of`."""
    if kind is float and type(value) is int and abs(value) <= _LARGEST_INTEGER:
        return float(value)
    if type(value) is not kind or (isinstance(value, float) and not math.isfinite(value)):
        raise WrongValueError(key, f"must be {_WORDS[kind]}")
    return value


def _member(kind: type[enum.Enum], value: object, key: str) -> enum.Enum:
    """Return the member of an enumeration with a value; the errors are those of :func:`value_of`."""
    words = {member.value: member for member in kind}
    if not isinstance(value, str) or value not in words:
        raise WrongValueError(key, f"must be one of {listing(map(repr, words))}")
    return words[value]


def _compound(kind: object, value: object, key: str) -> object:
    """Return a value of an annotation with arguments; the errors are those of :func:`value_of`."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        found = value_of(arguments[0], value, key)
        return _marked(arguments[1:], found, key)
    if origin is Literal:
        if not any(type(value) is type(each) and value == each for each in arguments):
            raise WrongValueError(key, f"must be one of {listing(map(repr, arguments))}")
        return value
    if origin in (Union, UnionType):
        return _one_of(arguments, value, key)
    if origin is tuple:
        if not isinstance(value, list):
            raise WrongValueError(key, "must be a list")
        return tuple(value_of(arguments[0], each, f"{key}[{index}]") for index, each in enumerate(value))
    if not isinstance(value, dict):
        raise WrongValueError(key, "must be an object")
    return MappingProxyType({name: value_of(arguments[1], each, below(key, name)) for name, each in value.items()})


def _marked(marks: tuple[object, ...], found: object, key: str) -> object:
    """Return a value converted by the marks of its annotation; the errors are those of :func:`value_of`."""
    for mark in marks:
        if isinstance(mark, Size) and isinstance(found, tuple) and len(found) != mark.entries:
            raise WrongValueError(key, f"must have {mark.entries} entries, got {len(found)}")
        if isinstance(mark, Made):
            found = mark.of(found)
    return found


def _one_of(kinds: tuple[object, ...], value: object, key: str) -> object:
    """Return a value of the first of several annotations that allows it.

    Raises:
        WrongValueError: no annotation allows the value; the error names the deepest fault.
    """
    faults = []
    # An exact type comes before a number type to which an integer could be converted.
    for kind in sorted(kinds, key=lambda each: each is not type(value)):
        try:
            return value_of(kind, value, key)
        except WrongValueError as error:
            faults.append(error)
    raise max(faults, key=lambda error: len(error.key))


def entries_of(kind: Any) -> tuple[Entry, ...]:  # noqa: ANN401 - a data class, or a class that declares its entries
    """Return the fields of a class, in their order."""
    return _entries_of(kind)


@cache
def _entries_of(kind: Any) -> tuple[Entry, ...]:  # noqa: ANN401 - as above
    """Return the fields as :func:`entries_of`, cached, because every object of the class needs them."""
    if not dataclasses.is_dataclass(kind):
        found: tuple[Entry, ...] = kind.entries()
        return found
    hints = get_type_hints(kind)
    return tuple(Entry(each.name, each.name, hints[each.name], each.default) for each in dataclasses.fields(kind))


def keys_of(kind: Any, *, required: bool = False) -> tuple[str, ...]:  # noqa: ANN401 - as above
    """Return the keys of the objects of a class, including keys of inline parts.

    Args:
        kind: the class.
        required: If true, only required keys are returned.
    """
    keys: list[str] = []
    for each in entries_of(kind):
        if each.is_required or not required:
            keys += [each.key] if each.inline is None else keys_of(each.inline, required=required)
    return tuple(keys)


def object_of(kind: type[Kind], table: object, key: str = "") -> Kind:
    """Return a value of a class from an object with the keys of its fields.

    Args:
        kind: a data class, or a :class:`~.jsonvalues.JsonObject`.
        table: the object, as :func:`json_tree` returns it.
        key: its dotted key, for messages.

    Raises:
        WrongValueError: a key is missing or unknown, or a value is not allowed.
    """
    if not isinstance(table, dict):
        raise WrongValueError(key, "must be an object")
    allowed = keys_of(kind)
    for name in table:
        if name not in allowed:
            raise WrongValueError(below(key, name), f"no such key; {nearest(name, allowed)}")
    return _object_of_fields(kind, table, key)


def _object_of_fields(kind: type[Kind], table: Mapping[str, object], key: str) -> Kind:
    """Return a value from a table that may hold other keys too; the errors are those of :func:`object_of`."""
    values: dict[str, object] = {}
    for each in entries_of(kind):
        if each.inline is not None and (each.is_required or not table.keys().isdisjoint(keys_of(each.inline))):
            values[each.name] = _object_of_fields(each.inline, table, key)
        elif each.inline is None and each.key in table:
            values[each.name] = value_of(each.kind, table[each.key], below(key, each.key))
        elif each.is_required:
            raise WrongValueError(below(key, each.key), "is missing")
        else:
            values[each.name] = each.default
    return kind(**values)


def below(key: str, name: str) -> str:
    """Return the dotted key of a name in the object with a key."""
    return f"{key}.{name}" if key else name
