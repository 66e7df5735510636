"""JSON of results: the schema, derived from the types of results, and the reader."""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias, Union, get_args, get_origin

from ...models.fileversions import RESULT_FILES, VERSION_KEY
from ..errors import InputError
from ..system.jsonvalues import JsonObject, JsonValue, without_none
from ..system.reading import check_version, read_limited
from ..system.strictjson import Size, WrongValueError, entries_of, json_tree, keys_of, object_of
from . import schedule  # noqa: F401 - its types stand as text in results of a solve
from .axisranges import AxisRangesResult
from .checks import ChecksResult
from .comparison import ComparisonResult
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .evidence import CertifiedResult
from .explorations import FrontResult, SweepResult
from .path import PathResult
from .posesettings import PoseSettingsResult
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
    PoseSettingsResult,
    AxisRangesResult,
    ComparisonResult,
    FrontResult,
    SweepResult,
)

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_SCALARS: dict[object, str] = {bool: "boolean", int: "integer", float: "number", str: "string", NoneType: "null"}

Schema: TypeAlias = dict[str, JsonValue]


def result_schema() -> Schema:
    """Return the JSON Schema of the files of ``--json``: one of the kinds of result."""
    definitions: Schema = {}
    kinds: list[JsonValue] = [_schema(kind, definitions) for kind in RESULTS]
    return {
        "$schema": _DIALECT,
        "title": "Result of screwsynth",
        "description": "Result of a command, as --json writes it.",
        "anyOf": kinds,
        "$defs": definitions,
    }


def _schema(kind: object, definitions: Schema) -> Schema:
    """Return the schema of an annotation; objects are added to the definitions, and referenced.

    Raises:
        TypeError: JSON has no type for the annotation.
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
    """Return a reference to the schema of an object type, and add this schema to the definitions."""
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
    """Fields of a JSON object, with the fields of inline parts.

    Attributes:
        properties: schema of each field, by name.
        required: names of the fields that are never absent.
        together: for a field of an inline part that may be absent, names of the fields that must be present with it.
    """

    properties: Schema
    required: list[str]
    together: dict[str, list[str]]


def _fields(kind: type[JsonObject], definitions: Schema) -> _Fields:
    """Return the fields of an object type, with the fields of its inline parts."""
    fields, descriptions = _Fields({}, [], {}), _descriptions(kind)
    for each in entries_of(kind):
        if each.inline is not None:
            _add_inline(fields, each.inline, definitions, is_required=each.is_required)
            continue
        schema = _schema(each.kind if each.is_required else without_none(each.kind), definitions)
        described = {"description": descriptions[each.name]} if each.name in descriptions else {}
        fields.properties[each.key] = {**schema, **described}
        if each.is_required:
            fields.required.append(each.key)
    return fields


def _add_inline(fields: _Fields, kind: type[JsonObject], definitions: Schema, *, is_required: bool) -> None:
    """Add the fields of an inline part; where the part may be absent, its fields are present together or not at all."""
    part = _fields(kind, definitions)
    fields.properties.update(part.properties)
    fields.together.update(part.together)
    if is_required:
        fields.required.extend(part.required)
    elif part.required:
        first, *others = part.required
        for name in part.properties:
            fields.together[name] = [*fields.together.get(name, []), *(others if name == first else [first])]


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
    | PoseSettingsResult
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
        InputError: the file cannot be read, is no result, or has a version that is not supported.
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
        InputError: the document is no result, or has a version that is not supported.
    """
    if isinstance(tables, dict):
        check_version(RESULT_FILES, tables, source)
    try:
        return _result(tables)
    except WrongValueError as error:
        raise InputError(f"{source}: is not a result of screwsynth: {error}") from None


def _result(tables: object) -> Result:
    """Return the result of a JSON document.

    Raises:
        WrongValueError: the document is no result.
    """
    if not isinstance(tables, dict):
        raise WrongValueError("", "the file must contain one JSON object, { ... }")
    if VERSION_KEY not in tables:
        raise WrongValueError(VERSION_KEY, "is missing")
    required = {kind: set(keys_of(kind, required=True)) for kind in RESULTS}
    # The kinds have different keys: the document is taken as the kind with the fewest missing keys.
    kind = min(RESULTS, key=lambda each: (len(required[each] - tables.keys()), -len(required[each])))
    found: Any = object_of(kind, tables)
    return found  # type: ignore[no-any-return]
