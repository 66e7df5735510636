"""The manifest of a folder of C: names, units, bounds, limits and sizes as JSON, for programs that call the library."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from .. import __version__
from ..program.nlp import Nlp
from .runtimelimits import RunTimeLimit
from .subject import bounds_in_c
from .unitdata import UnitData

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
