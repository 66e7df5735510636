"""The JSON of results: its schema, made from their types, and its reader, which makes a typed value of it again."""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias, Union, get_args, get_origin

from ...models.fileversions import RESULT_FILES, VERSION_KEY
from ..errors import InputError, listing
from ..system.jsonvalues import JsonObject, JsonValue, Mark, kinds_of
from ..system.reading import check_version, read_limited
from ..system.strictjson import Size, WrongValueError, below, json_tree, value_of
from .axisranges import AxisRangesResult
from .checks import ChecksResult
from .comparison import ComparisonResult
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .evidence import CertifiedResult
from .explorations import FrontResult, SweepResult
from .path import PathResult
from .tradeoff import TradeoffResult
from .workspace import WorkspaceResult

#: Every kind of result.
RESULTS: tuple[type[JsonObject], ...] = (
    SolveResult,
    CombinedResult,
    EvaluationResult,
    CertifiedResult,
    ChecksResult,
    TradeoffResult,
    WorkspaceResult,
    PathResult,
    AxisRangesResult,
    ComparisonResult,
    FrontResult,
    SweepResult,
)

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_SCALARS: dict[object, str] = {bool: "boolean", int: "integer", float: "number", str: "string", NoneType: "null"}

Schema: TypeAlias = dict[str, JsonValue]


def result_schema() -> Schema:
    """Return the JSON Schema of everything that ``--json`` writes: one of the kinds of result."""
    definitions: Schema = {}
    kinds: list[JsonValue] = [_schema(kind, definitions) for kind in RESULTS]
    return {
        "$schema": _DIALECT,
        "title": "Result of screwsynth",
        "description": "What --json writes of a solve or another command with this option.",
        "anyOf": kinds,
        "$defs": definitions,
    }


def _schema(kind: object, definitions: Schema) -> Schema:
    """Return the schema of an annotation; objects are added to the definitions, and referred to.

    Raises:
        TypeError: JSON has no type for it.
    """
    if kind in _SCALARS:
        return {"type": _SCALARS[kind]}
    if kind is object:
        return {}
    if isinstance(kind, type) and issubclass(kind, JsonObject):
        return _reference(kind, definitions)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return {"enum": [member.value for member in kind]}
    return _compound(kind, definitions)


def _compound(kind: object, definitions: Schema) -> Schema:
    """Return the schema of an annotation with arguments."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is Annotated:
        sizes = [mark.entries for mark in arguments[1:] if isinstance(mark, Size)]
        entries: Schema = {"minItems": sizes[0], "maxItems": sizes[0]} if sizes else {}
        return {**_schema(arguments[0], definitions), **entries}
    if origin in (Union, UnionType):
        return {"anyOf": [_schema(part, definitions) for part in arguments]}
    if origin is tuple and arguments[1:] == (Ellipsis,):
        return {"type": "array", "items": _schema(arguments[0], definitions)}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _schema(arguments[1], definitions)}
    raise TypeError(f"JSON has no type for {kind!r}")


def _reference(kind: type[JsonObject], definitions: Schema) -> Schema:
    """Return a reference to the schema of an object type, which is added to the definitions."""
    name = kind.__name__
    if name not in definitions:
        fields = _fields(kind, definitions)
        definitions[name] = {
            "type": "object",
            "description": inspect.cleandoc(kind.__doc__ or "").partition("\n")[0],
            "properties": fields.properties,
            "required": [*fields.required],
            **(
                {"dependentRequired": {key: [*names] for key, names in fields.together.items()}}
                if fields.together
                else {}
            ),
            "additionalProperties": False,
        }
    return {"$ref": f"#/$defs/{name}"}


class _Fields(NamedTuple):
    """Fields of a JSON object, those of inline parts among them.

    Attributes:
        properties: schema of each, by name.
        required: names of those that are never absent.
        together: names of the fields that must be there beside a field of an inline part that may be absent.
    """

    properties: Schema
    required: list[str]
    together: dict[str, list[str]]


def _fields(kind: type[JsonObject], definitions: Schema) -> _Fields:
    """Return the fields of an object type, those of its inline parts among them."""
    fields, descriptions = _Fields({}, [], {}), _descriptions(kind)
    for name, annotation in kinds_of(kind).items():
        key, mark, *_ = kind.fields[name]
        if mark is Mark.INLINE:
            _add_inline(fields, annotation, definitions)
            continue
        schema = _schema(annotation if mark is None else _type_without_none(annotation), definitions)
        fields.properties[key] = {**schema, **({"description": descriptions[name]} if name in descriptions else {})}
        if mark is None:
            fields.required.append(key)
    return fields


def _add_inline(fields: _Fields, annotation: object, definitions: Schema) -> None:
    """Add the fields of an inline part; where the part may be absent, its fields are present together or not at all."""
    kind = _type_without_none(annotation)
    if not (isinstance(kind, type) and issubclass(kind, JsonObject)):
        raise TypeError(f"only an object can stand inline, which {kind!r} is not")
    part = _fields(kind, definitions)
    fields.properties.update(part.properties)
    fields.together.update(part.together)
    if kind is get_args(annotation)[0]:
        fields.required.extend(part.required)
    elif part.required:
        first, *others = part.required
        for name in part.properties:
            fields.together[name] = [*fields.together.get(name, []), *(others if name == first else [first])]


def _type_without_none(annotation: object) -> object:
    """Return the type of a marked field, without None."""
    kind = get_args(annotation)[0]
    if get_origin(kind) not in (Union, UnionType):
        return kind
    kinds = [part for part in get_args(kind) if part is not NoneType]
    return kinds[0] if len(kinds) == 1 else Union[tuple(kinds)]  # noqa: UP007 - the types are known at run time only


def _descriptions(kind: type[JsonObject]) -> dict[str, str]:
    """Return the descriptions of a type's fields by name, from the attributes in its docstring."""
    found: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        text = inspect.cleandoc(each.__doc__ or "").partition("Attributes:\n")[2]
        rows = re.findall(r"^    (\w+): (.*(?:\n        .*)*)", text, flags=re.MULTILINE)
        found |= {name: re.sub(r"\s+", " ", words) for name, words in rows}
    return found


Result: TypeAlias = (
    SolveResult
    | CombinedResult
    | EvaluationResult
    | CertifiedResult
    | ChecksResult
    | TradeoffResult
    | WorkspaceResult
    | PathResult
    | AxisRangesResult
    | ComparisonResult
    | FrontResult
    | SweepResult
)

#: Largest file of a result, bytes: a case with hundreds of poses writes a few million.
_LARGEST = 64 * 2**20


def load_result(file: str | Path) -> Result:
    """Read a result that a command, such as ``solve``, ``evaluate`` or ``workspace``, wrote with ``--json``.

    Args:
        file: path of the file.

    Returns:
        The typed value; :func:`~screwsynth.nlp.json_data` makes the same JSON of it again.

    Raises:
        InputError: the file cannot be read, holds no result, or one of a version that is not read.
    """
    try:
        tables = json_tree(read_limited(file, _LARGEST))
    except ValueError as error:
        raise InputError(f"{file}: is not valid JSON: {error}") from None
    return result_from_json(tables, str(file))


def result_from_json(tables: object, source: str) -> Result:
    """Return the typed value of a result as JSON's own types.

    Args:
        tables: the document.
        source: name of the document, for messages.

    Raises:
        InputError: it is no result, or one of a version that is not read.
    """
    if isinstance(tables, dict):
        check_version(RESULT_FILES, tables, source)
    try:
        return _result(tables)
    except WrongValueError as error:
        raise InputError(f"{source}: is no result of screwsynth: {error}") from None


def _result(tables: object) -> Result:
    """Return the result of a JSON document.

    Raises:
        WrongValueError: the document is no result.
    """
    if not isinstance(tables, dict):
        raise WrongValueError("", "must be an object")
    if VERSION_KEY not in tables:
        raise WrongValueError(VERSION_KEY, "is missing")
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
    for name, annotation in kinds_of(kind).items():
        key, mark, *_ = kind.fields[name]
        if mark is Mark.INLINE:
            part = _inline_kind(annotation)
            if not (required and part is not get_args(annotation)[0]):
                keys += _keys(part, required=required)
        elif mark is None or not required:
            keys.append(key)
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
        WrongValueError: a key is missing or unknown, or a value is not allowed.
    """
    if not isinstance(table, dict):
        raise WrongValueError(key, "must be an object")
    allowed = _keys(kind, required=False)
    for name in table:
        if name not in allowed:
            raise WrongValueError(below(key, name), f"no such key; allowed: {listing(allowed)}")
    return _object_of_fields(kind, table, key)


def _object_of_fields(kind: type[JsonObject], table: Mapping[str, object], key: str) -> JsonObject:
    """Return an object from a table that may hold other keys too; the errors are those of :func:`_object`."""
    values: dict[str, object] = {}
    for name, annotation in kinds_of(kind).items():
        name_in_json, mark, *_ = kind.fields[name]
        if mark is Mark.INLINE:
            part = _inline_kind(annotation)
            may_miss = part is not get_args(annotation)[0]
            missing = may_miss and table.keys().isdisjoint(_keys(part, required=False))
            values[name] = None if missing else _object_of_fields(part, table, key)
        elif name_in_json in table:
            values[name] = value_of(annotation, table[name_in_json], below(key, name_in_json), _object)
        elif mark is Mark.ABSENT:
            values[name] = None
        else:
            raise WrongValueError(below(key, name_in_json), "is missing")
    return kind(**values)
