"""Reader of results: what ``--json`` wrote becomes a typed value again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any, TypeAlias, get_args

from ..errors import InputError, listing
from ..system.reading import read_limited
from ..system.strictjson import WrongValueError, below, json_tree, value_of
from .certified import CertifiedResult
from .checks import ChecksResult
from .comparison import ComparisonResult
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .front import FrontResult
from .jsondata import JsonObject, Mark, kinds_of
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
_LARGEST = 64 * 2**20


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
        InputError: it is no result of this version of the format.
    """
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
    if tables.get("schema") != SCHEMA:
        raise WrongValueError("schema", f"must be {SCHEMA}, the version of the format, got {tables.get('schema')!r}")
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
        WrongValueError: a key is missing or unknown, or a value is not allowed.
    """
    if not isinstance(table, dict):
        raise WrongValueError(key, "must be an object")
    allowed = _keys(kind, required=False)
    for name in table:
        if name not in allowed:
            raise WrongValueError(below(key, name), f"no such key; allowed: {listing(allowed)}")
    return _fields(kind, table, key)


def _fields(kind: type[JsonObject], table: Mapping[str, object], key: str) -> JsonObject:
    """Return an object from a table that may hold other keys too; the errors are those of :func:`_object`."""
    values: dict[str, object] = {}
    for name, annotation in kinds_of(kind).items():
        mark = kind.marks[name]
        if mark is Mark.INLINE:
            part = _inline_kind(annotation)
            may_miss = part is not get_args(annotation)[0]
            missing = may_miss and table.keys().isdisjoint(_keys(part, required=False))
            values[name] = None if missing else _fields(part, table, key)
        elif name in table:
            values[name] = value_of(annotation, table[name], below(key, name), _object)
        elif mark is Mark.ABSENT:
            values[name] = None
        else:
            raise WrongValueError(below(key, name), "is missing")
    return kind(**values)
