"""The manifest of a folder of C: names, units, bounds, limits and sizes as JSON, for programs that call the library."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence

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
    """Return the manifest's text.

    Args:
        nlp: the program.
        limits: the limits that are set at run time.
        names: texts of the templates' placeholders.
        files: text of every other file of the folder by name.
    """
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
        "variables": [
            {"name": each.name, "unit": unit, "multiplier_unit": own, "lower": lower, "upper": upper, "start": start}
            for each, unit, own, lower, upper, start in zip(
                program.variables,
                units.variables,
                units.variable_multipliers,
                bounds.lower.tolist(),
                bounds.upper.tolist(),
                nlp.start.tolist(),
                strict=True,
            )
        ],
        "parameters": [
            {"name": each.name, "unit": unit, "default": default}
            for each, unit, default in zip(program.arguments, units.parameters, nlp.arguments.tolist(), strict=True)
        ],
        "limits": [
            {
                "key": each.key,
                "c_name": f"{prefix.upper()}_LIMIT_{each.name}",
                "unit": units.of_case.label(each.dimension),
                "multiplier_unit": own,
                "default": each.default,
                "above": _finite(each.above),
                "most": _finite(each.most),
            }
            for each, own in zip(limits, units.limit_multipliers(limits), strict=True)
        ],
        "constraints": [
            {"name": each.name, "multiplier_unit": own, "lower": _finite(lower), "upper": _finite(upper)}
            for each, own, lower, upper in zip(
                program.constraints,
                units.constraint_multipliers,
                nlp.g_lower.tolist(),
                nlp.g_upper.tolist(),
                strict=True,
            )
        ],
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
    return json.dumps(manifest, indent=1, ensure_ascii=True, allow_nan=False) + "\n"


def _finite(value: float) -> float | None:
    """Return a number for JSON; None where it is infinite."""
    return value if math.isfinite(value) else None
