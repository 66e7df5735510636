"""The manifest of a folder of C, read again as a typed value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import InputError
from ..system.reading import read_limited
from ..system.strictjson import json_tree, value_of
from .manifest import FORMAT, MANIFEST

#: Largest manifest, bytes.
_LARGEST = 2**26


class CompiledNumber(NamedTuple):
    """A free variable of x or a fixed number of p.

    Attributes:
        name: for people.
        unit: ``rad`` for angles, empty for a plain number.
        lower: its bound as a variable; -inf for a fixed number.
        upper: likewise.
        default: the case's value of a fixed number; for a variable, where the case's first search starts.
    """

    name: str
    unit: str
    lower: float
    upper: float
    default: float


class CompiledLimit(NamedTuple):
    """A limit that can be set at run time.

    Attributes:
        key: dotted key, such as ``leg_length.max``.
        unit: of its number: ``rad`` for angles, empty for a plain number.
        default: the case's number.
        above: the number must be larger than this.
        most: the number may be at most this.
    """

    key: str
    unit: str
    default: float
    above: float
    most: float


class Manifest(NamedTuple):
    """A folder of C: names, units, bounds, limits, statuses and the texts to compile.

    Attributes:
        name: of the case.
        prefix: of the names in C.
        variables: the free variables, in the order of x.
        parameters: the fixed numbers, in the order of p.
        limits: the limits that can be set.
        constraints: names of the constraints.
        statuses: names of the statuses by code.
        seeds: largest number of searches from the table of starting points.
        files: sources and headers of the library by file name.
    """

    name: str
    prefix: str
    variables: tuple[CompiledNumber, ...]
    parameters: tuple[CompiledNumber, ...]
    limits: tuple[CompiledLimit, ...]
    constraints: tuple[str, ...]
    statuses: tuple[str, ...]
    seeds: int
    files: Mapping[str, str]


def read_manifest(folder: Path) -> Manifest:
    """Return a folder's manifest, with the texts of the library.

    Raises:
        InputError: the folder is no folder of generated C, is of another version, or lacks a file.
    """
    try:
        text = read_limited(folder / MANIFEST, _LARGEST)
    except InputError as error:
        raise InputError(f"{folder}: is no folder that `screwsynth codegen` wrote: {error}") from None
    try:
        data = value_of(Mapping[str, object], json_tree(text))
        if data["format"] == FORMAT:
            return _manifest(data, folder)
        fault = f": format = {data['format']!r} is not the format {FORMAT} of this version: generate the folder again"
    except OSError as error:
        raise InputError(f"{folder}: {error.filename} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else f"{error}"
        fault = f" is not as `screwsynth codegen` writes it: {why}"
    raise InputError(f"{folder}: {MANIFEST}{fault}")


def _manifest(data: Mapping[str, object], folder: Path) -> Manifest:
    """Return the manifest from its data.

    Raises:
        ValueError: a value is wrong.
        KeyError: a key is missing.
        OSError: a file cannot be read.
    """
    names = [name for key in ("sources", "headers") for name in value_of(tuple[str, ...], data[key], key)]
    if any(Path(name).name != name for name in names):
        raise ValueError("a name in sources or headers is no name of a file")
    prefix, seeds = value_of(str, data["prefix"], "prefix"), value_of(int, data["seeds"], "seeds")
    if not prefix.isidentifier() or seeds < 0:
        raise ValueError("prefix must be a name in C, and seeds not negative")

    def rows(where: str, /, **kinds: object) -> list[list[Any]]:
        """Return the values of some keys of the objects in a list."""
        tables = value_of(tuple[Mapping[str, object], ...], data[where], where)
        return [
            [value_of(kind, each[name], f"{where}[{index}].{name}") for name, kind in kinds.items()]
            for index, each in enumerate(tables)
        ]

    end = float | None
    return Manifest(
        name=value_of(str, data["name"], "name"),
        prefix=prefix,
        variables=tuple(
            CompiledNumber(*each)
            for each in rows("variables", name=str, unit=str, lower=float, upper=float, start=float)
        ),
        parameters=tuple(
            CompiledNumber(name, unit, -math.inf, math.inf, default)
            for name, unit, default in rows("parameters", name=str, unit=str, default=float)
        ),
        limits=tuple(
            CompiledLimit(key, unit, default, -math.inf if above is None else above, math.inf if most is None else most)
            for key, unit, default, above, most in rows("limits", key=str, unit=str, default=float, above=end, most=end)
        ),
        constraints=tuple(name for (name,) in rows("constraints", name=str)),
        statuses=tuple(name for (name,) in rows("statuses", name=str)),
        seeds=seeds,
        files={name: (folder / name).read_text(encoding="utf-8") for name in names},
    )
