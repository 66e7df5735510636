"""The manifest of a folder of C, read again as a typed value."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import InputError
from .manifest import FORMAT, MANIFEST


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
        data = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        found = data["format"]
    except OSError as error:
        why = f"{MANIFEST} cannot be read: {error.strerror or error}"
        raise InputError(f"{folder}: is no folder that `screwsynth codegen` wrote: {why}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{folder}: {MANIFEST} is not as `screwsynth codegen` writes it") from None
    if found != FORMAT:
        fault = f"format = {found!r} is not the format {FORMAT} of this version: generate the folder again"
        raise InputError(f"{folder}: {MANIFEST}: {fault}")
    try:
        return _manifest(data, folder)
    except OSError as error:
        raise InputError(f"{folder}: {error.filename} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{folder}: {MANIFEST} is not as `screwsynth codegen` writes it") from None


def _manifest(data: Mapping[str, Any], folder: Path) -> Manifest:
    """Return the manifest from its data, which raise any error of a wrong key or type."""
    names = [str(name) for name in (*data["sources"], *data["headers"])]
    if any(Path(name).name != name for name in names):
        raise ValueError
    return Manifest(
        name=str(data["name"]),
        prefix=str(data["prefix"]),
        variables=tuple(
            CompiledNumber(each["name"], each["unit"], float(each["lower"]), float(each["upper"]), float(each["start"]))
            for each in data["variables"]
        ),
        parameters=tuple(
            CompiledNumber(each["name"], each["unit"], -math.inf, math.inf, float(each["default"]))
            for each in data["parameters"]
        ),
        limits=tuple(
            CompiledLimit(
                each["key"],
                each["unit"],
                float(each["default"]),
                -math.inf if each["above"] is None else float(each["above"]),
                math.inf if each["most"] is None else float(each["most"]),
            )
            for each in data["limits"]
        ),
        constraints=tuple(str(each["name"]) for each in data["constraints"]),
        statuses=tuple(str(each["name"]) for each in data["statuses"]),
        seeds=int(data["seeds"]),
        files={name: (folder / name).read_text(encoding="utf-8") for name in names},
    )
