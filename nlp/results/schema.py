"""The JSON Schema of results, made from their types."""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Annotated, Literal, NamedTuple, TypeAlias, Union, get_args, get_origin

from ..system.strictjson import Size
from .certified import CertifiedResult
from .checks import ChecksResult
from .comparison import ComparisonResult
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .front import FrontResult
from .jsondata import JsonObject, JsonValue, Mark, kinds_of
from .sweep import SweepResult
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
        mark = kind.marks[name]
        if mark is Mark.INLINE:
            _add_inline(fields, annotation, definitions)
            continue
        schema = _schema(annotation if mark is None else _type_without_none(annotation), definitions)
        fields.properties[name] = {**schema, **({"description": descriptions[name]} if name in descriptions else {})}
        if mark is None:
            fields.required.append(name)
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
    text = inspect.cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2]
    found = re.findall(r"^    (\w+): (.*(?:\n        .*)*)", text, flags=re.MULTILINE)
    return {name: re.sub(r"\s+", " ", words) for name, words in found}
