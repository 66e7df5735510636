"""The manifest of a folder of C: names, units, bounds, limits and sizes as JSON, for programs that call the library.

It is written with the folder, and read again as a typed value.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..errors import InputError
from ..program.nlp import Nlp
from ..system.reading import read_limited
from ..system.strictjson import json_tree, value_of
from ..units import Units, objective_unit, rate_unit, twist_units
from .runtimelimits import RunTimeLimit
from .subject import bounds_in_c


@dataclass(frozen=True)
class UnitData:
    """Units of a program's numbers in C, for the case's own tasks; empty for a plain number."""

    nlp: Nlp

    @cached_property
    def of_case(self) -> Units:
        """Units of lengths and angles: angles are radians in C."""
        return replace(self.nlp.case.units, angle="rad")

    @property
    def _twists(self) -> list[list[float]]:
        return [np.asarray(task.twist, dtype=np.float64).tolist() for task in self.nlp.case.tasks]

    @property
    def F(self) -> str:  # noqa: N802 - as everywhere
        """Unit of F; empty where the tasks do not agree in it."""
        return objective_unit(self._twists, self.of_case)

    @property
    def rates(self) -> tuple[str, ...]:
        """Unit of the rates of each task."""
        return tuple(rate_unit(twist, self.of_case) for twist in self._twists)

    @property
    def variables(self) -> tuple[str, ...]:
        """Unit of each variable; that of a level is F's."""
        program = self.nlp.program
        found = [self.of_case.label(each.dimension) for each in program.variables]
        if program.places.epigraph is not None:
            found[program.places.epigraph.level] = self.F
        return tuple(found)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Unit of each fixed number."""
        program = self.nlp.program
        found = [self.of_case.label(each.dimension) for each in program.arguments]
        for twist, places in zip(self._twists, program.places.twists, strict=False):
            found[places.start : places.stop] = twist_units(twist, self.of_case)
        epigraph = program.places.epigraph
        for index in () if epigraph is None else (epigraph.ceiling, *epigraph.best):
            found[index] = self.F
        return tuple(found)

    @property
    def variable_multipliers(self) -> tuple[str, ...]:
        """Unit of the multipliers of each variable's bounds."""
        return tuple(self._multiplier(unit) for unit in self.variables)

    @property
    def constraint_multipliers(self) -> tuple[str, ...]:
        """Unit of the multipliers of each constraint's bounds."""
        readings = [each.reading for each in self.nlp.program.constraints]
        units = [self.of_case.label(each.dimension) if each.power else "" for each in readings]
        squares = [f"{unit}²" if unit and each.power == 2 else unit for unit, each in zip(units, readings, strict=True)]
        return tuple(map(self._multiplier, squares))

    def limit_multipliers(self, limits: Sequence[RunTimeLimit]) -> tuple[str, ...]:
        """Return the unit of each limit's multiplier."""
        return tuple(self._multiplier(self.of_case.label(each.dimension)) for each in limits)

    def _multiplier(self, unit: str) -> str:
        """Return the unit of F over another one; empty where F has none."""
        if unit == self.F:
            return ""
        return f"{self.F}/{unit}" if self.F and unit else self.F


#: Name of the manifest in the folder.
MANIFEST = "manifest.json"
#: Version of the manifest's keys and of the functions for many problems; another one is refused.
FORMAT = 2
#: A status in the header: its name, and a comment that says what it means.
_STATUS = re.compile(r"^    SCREWSYNTH_(\w+)(?: = 0)?,? +/\* (.*) \*/$", flags=re.MULTILINE)


def manifest_text(nlp: Nlp, limits: Sequence[RunTimeLimit], names: Mapping[str, str], files: Mapping[str, str]) -> str:
    """Return the manifest's text, from the texts of the templates' placeholders and of all other files by name."""
    case, program, prefix = nlp.case, nlp.program, names["id"]
    bounds = bounds_in_c(nlp)
    units = UnitData(nlp)
    header = files[f"{prefix}.h"]
    statuses = _STATUS.findall(header[header.index("typedef enum") : header.index("} screwsynth_status;")])
    manifest = {
        "format": FORMAT,
        "screwsynth": __version__,
        "casadi": names["casadi"],
        "name": case.name,
        "title": case.title,
        "prefix": prefix,
        "sense": nlp.sense.value,
        "F_unit": units.F,
        "variables": _objects(
            name=[each.name for each in program.variables],
            unit=units.variables,
            multiplier_unit=units.variable_multipliers,
            lower=bounds.lower,
            upper=bounds.upper,
            start=nlp.start,
        ),
        "parameters": _objects(
            name=[each.name for each in program.arguments], unit=units.parameters, default=nlp.arguments
        ),
        "limits": _objects(
            key=[each.key for each in limits],
            c_name=[f"{prefix.upper()}_LIMIT_{each.name}" for each in limits],
            unit=[units.of_case.label(each.dimension) for each in limits],
            multiplier_unit=units.limit_multipliers(limits),
            default=[each.default for each in limits],
            above=[each.above for each in limits],
            most=[each.most for each in limits],
        ),
        "constraints": _objects(
            name=[each.name for each in program.constraints],
            multiplier_unit=units.constraint_multipliers,
            lower=nlp.g_lower,
            upper=nlp.g_upper,
        ),
        "rows": [{"limb": row.limb, "kind": row.kind.value} for row in program.model.frame_rows],
        "tasks": [
            {"name": task.name, "twist": np.asarray(task.twist).tolist(), "rate_unit": unit}
            for task, unit in zip(case.tasks, units.rates, strict=True)
        ],
        "notice": "" if case.workspace is None else case.workspace.stated_pose_notice,
        "seeds": int(names["nseeds"]),
        "statuses": [{"code": code, "name": name, "meaning": text} for code, (name, text) in enumerate(statuses)],
        "measured": [],
        "sources": sorted(name for name in files if name.startswith(prefix) and name.endswith(".c")),
        "headers": sorted(name for name in files if name.startswith(prefix) and name.endswith((".h", ".hpp"))),
        "files": sorted([*files, MANIFEST]),
    }
    return json_text(manifest)


def json_text(manifest: Mapping[str, object]) -> str:
    """Return a manifest as JSON."""
    return json.dumps(manifest, indent=1, ensure_ascii=True, allow_nan=False) + "\n"


def _objects(**columns: Iterable[str | float]) -> list[dict[str, str | float | None]]:
    """Return objects of JSON from their values by key; None where a number is infinite."""
    rows = zip(*columns.values(), strict=True)
    return [{key: _plain(value) for key, value in zip(columns, row, strict=True)} for row in rows]


def _plain(value: str | float) -> str | float | None:
    if isinstance(value, str):
        return value
    return float(value) if math.isfinite(value) else None


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
