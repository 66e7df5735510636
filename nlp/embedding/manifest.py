"""Manifest of a folder of C: names, units, bounds, limits and sizes as JSON, for callers of the library.

The manifest is written with the folder, and read again as a typed value.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ...models.fileversions import GENERATED_C, VERSION_KEY
from .. import __version__
from ..errors import InputError
from ..program.nlp import Nlp
from ..system.reading import check_version, read_limited
from ..system.strictjson import json_tree, value_of
from ..units import objective_unit, rate_unit, twist_units
from .ctext import NO_BOUND
from .runtimelimits import RunTimeLimit

#: Values or names by the key of each column.
Columns: TypeAlias = Mapping[str, list[Any]]


class NumberColumns(NamedTuple):
    """Variables and parameters of a program in C as columns: names, units, bounds and values, for the case's tasks.

    Angles are in radians. A unit is empty for a dimensionless number, and if tasks have different units of F.

    Attributes:
        F_unit: unit of F.
        variables: free variables; the unit of a level is that of F.
        parameters: fixed parameters.
        limits: limits that can be set at run time.
        constraints: constraints with the units of their multipliers.
        rows: rows of the Jacobian.
        tasks: tasks with the units of their rates.
    """

    F_unit: str
    variables: Columns
    parameters: Columns
    limits: Columns
    constraints: Columns
    rows: Columns
    tasks: Columns


def number_columns(nlp: Nlp, limits: Sequence[RunTimeLimit], prefix: str) -> NumberColumns:
    """Return the columns of a program in C, with the limits that can be set; ``prefix`` begins the names in C."""
    case, program, epigraph = nlp.case, nlp.program, nlp.program.places.epigraph
    units = replace(case.units, angle="rad")
    twists = [np.asarray(task.twist, dtype=np.float64).tolist() for task in case.tasks]
    F = objective_unit(twists, units)
    of_variables, of_parameters, of_limits = (
        [units.label(each.dimension) for each in numbers] for numbers in (program.variables, program.arguments, limits)
    )
    for twist, places in zip(twists, program.places.twists, strict=False):
        of_parameters[places.start : places.stop] = twist_units(twist, units)
    if epigraph is not None:
        of_variables[epigraph.level] = F
        for index in (epigraph.ceiling, *epigraph.best):
            of_parameters[index] = F

    def multipliers(labels: Iterable[str]) -> list[str]:
        """Return the unit of F per unit of each label; empty if F has no unit."""
        return ["" if label == F else f"{F}/{label}" if F and label else F for label in labels]

    readings = [each.reading for each in program.constraints]
    powers = ["" if not each.power else units.label(each.dimension) for each in readings]
    squares = [f"{unit}²" if unit and each.power == 2 else unit for unit, each in zip(powers, readings, strict=True)]
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    if epigraph is not None:
        # A level has no bounds: it follows from the task, which may change.
        lower[epigraph.level], upper[epigraph.level] = -NO_BOUND, NO_BOUND
    return NumberColumns(
        F_unit=F,
        variables={
            "name": [each.name for each in program.variables],
            "unit": of_variables,
            "multiplier_unit": multipliers(of_variables),
            "lower": lower.tolist(),
            "upper": upper.tolist(),
            "start": nlp.start.tolist(),
        },
        parameters={
            "name": [each.name for each in program.arguments],
            "unit": of_parameters,
            "default": nlp.arguments.tolist(),
        },
        limits={
            "key": [each.key for each in limits],
            "c_name": [f"{prefix.upper()}_LIMIT_{each.name}" for each in limits],
            "unit": of_limits,
            "multiplier_unit": multipliers(of_limits),
            "default": [each.default for each in limits],
            "above": [each.above for each in limits],
            "most": [each.most for each in limits],
        },
        constraints={
            "name": [each.name for each in program.constraints],
            "multiplier_unit": multipliers(squares),
            "lower": nlp.g_lower.tolist(),
            "upper": nlp.g_upper.tolist(),
        },
        rows={
            "limb": [row.limb for row in program.model.frame_rows],
            "kind": [row.kind.value for row in program.model.frame_rows],
        },
        tasks={
            "name": [task.name for task in case.tasks],
            "twist": twists,
            "rate_unit": [rate_unit(twist, units) for twist in twists],
        },
    )


#: Name of the manifest in the folder.
MANIFEST = "manifest.json"
#: Pattern of a status in the header: name, and comment with its meaning.
_STATUS = re.compile(r"^    SCREWSYNTH_(\w+)(?: = 0)?,? +/\* (.*) \*/$", flags=re.MULTILINE)


def manifest_text(nlp: Nlp, columns: NumberColumns, names: Mapping[str, str], files: Mapping[str, str]) -> str:
    """Return the manifest's text, from the texts of the placeholders and of all other files by name."""
    case, prefix = nlp.case, names["id"]
    header = files[f"{prefix}.h"]
    statuses = _STATUS.findall(header[header.index("typedef enum") : header.index("} screwsynth_status;")])
    numbers = columns._asdict()
    manifest = {
        VERSION_KEY: GENERATED_C.newest,
        "screwsynth": __version__,
        "casadi": names["casadi"],
        "name": case.name,
        "title": case.title,
        "prefix": prefix,
        "sense": nlp.sense.value,
        "F_unit": numbers.pop("F_unit"),
        **{key: _objects(own) for key, own in numbers.items()},
        "notice": case.stated_pose_notice,
        "seeds": int(names["nseeds"]),
        "statuses": [{"code": code, "name": name, "meaning": text} for code, (name, text) in enumerate(statuses)],
        "measured": [],
        "sources": solver_files(files, prefix, ".c"),
        "headers": solver_files(files, prefix, ".h", ".hpp"),
        "files": sorted([*files, MANIFEST]),
    }
    return json_text(manifest)


def solver_files(files: Iterable[str], prefix: str, *endings: str) -> list[str]:
    """Return the names of the solver's files with the given endings, in order; those of the kinematics are left out."""
    own = (name for name in files if name.startswith(prefix) and name.endswith(endings))
    return sorted(name for name in own if not name.startswith(f"{prefix}-kinematics"))


def json_text(manifest: Mapping[str, object]) -> str:
    """Return a manifest as JSON."""
    return json.dumps(manifest, indent=1, ensure_ascii=True, allow_nan=False) + "\n"


def _objects(columns: Columns) -> list[dict[str, Any]]:
    """Return JSON objects from their values by key; None for infinite numbers."""
    rows = zip(*columns.values(), strict=True)
    return [{key: _plain(value) for key, value in zip(columns, row, strict=True)} for row in rows]


def _plain(value: str | float | list[float]) -> str | float | list[float] | None:
    if isinstance(value, str | list):
        return value
    return float(value) if math.isfinite(value) else None


#: Largest size of a manifest, bytes.
_LARGEST = 2**26


class CompiledNumber(NamedTuple):
    """Free variable in x or fixed parameter in p.

    Attributes:
        name: name for people.
        unit: unit of the value: ``rad`` for angles, empty for a dimensionless number.
        lower: lower bound of a variable; -inf for a parameter.
        upper: upper bound of a variable; inf for a parameter.
        default: value of a parameter in the case, or start of a variable in the first search of the case.
    """

    name: str
    unit: str
    lower: float
    upper: float
    default: float


class CompiledLimit(NamedTuple):
    """Limit that can be set at run time.

    Attributes:
        key: dotted key, such as ``leg_length.max``.
        unit: unit of the limit: ``rad`` for angles, empty for a dimensionless number.
        default: value in the case.
        above: exclusive lower bound of allowed values.
        most: largest allowed value.
    """

    key: str
    unit: str
    default: float
    above: float
    most: float


class Manifest(NamedTuple):
    """Contents of a folder of C: names, units, bounds, limits, statuses and source texts.

    Attributes:
        name: name of the case.
        prefix: prefix of the names in C.
        variables: free variables, in the order of x.
        parameters: fixed parameters, in the order of p.
        limits: limits that can be set at run time.
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
    """Return the manifest of a folder, with the texts of the library.

    Raises:
        InputError: the folder has no generated C, is of another version, or lacks a file.
    """
    try:
        text = read_limited(folder / MANIFEST, _LARGEST)
    except InputError as error:
        raise InputError(f"{folder}: is not a folder written by `screwsynth codegen`: {error}") from None
    try:
        data = value_of(Mapping[str, object], json_tree(text))
        check_version(GENERATED_C, {VERSION_KEY: data[VERSION_KEY]}, f"{folder}: {MANIFEST}")
        return _manifest(data, folder)
    except OSError as error:
        raise InputError(f"{folder}: {error.filename} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else f"{error}"
        fault = f" does not have the form that `screwsynth codegen` writes: {why}"
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
        raise ValueError("a name in sources or headers is not a file name")
    prefix, seeds = value_of(str, data["prefix"], "prefix"), value_of(int, data["seeds"], "seeds")
    if not prefix.isidentifier() or seeds < 0:
        raise ValueError("prefix must be a C identifier, and seeds at least 0")

    def rows(where: str, /, **kinds: object) -> list[list[Any]]:
        """Return the values of the given keys of the objects in a list."""
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
