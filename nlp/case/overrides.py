"""Numbers of a case file replaced by name, as ``--set`` does."""

from __future__ import annotations

from typing import Any

from ...models import component_names
from ..errors import CaseError, nearest


def _set(tables: dict[str, Any], name: str, value: Any) -> None:  # noqa: ANN401 - whatever TOML can hold
    """Replace one number in the document's tables; what it cannot find it refuses."""
    parameters = tables.get("robot", {}).get("parameters", {})
    given = tables.setdefault("pose", {})
    poses = given if isinstance(given, list) else [given]
    prefixes = [""] if len(poses) == 1 else [f"pose{k + 1}_" for k in range(len(poses))]
    places: dict[str, tuple[Any, int | str]] = {}
    for key, value_there in parameters.items():
        places[key] = (parameters, key)
        if isinstance(value_there, list):
            places.update({part: (value_there, i) for i, part in enumerate(component_names(key, len(value_there)))})
    for prefix, pose in zip(prefixes, poses, strict=True):
        if isinstance(pose.get("position"), list):
            names = component_names(f"{prefix}p", 3)
            places.update({part: (pose["position"], i) for i, part in enumerate(names)})
        for part in ("angle", "axis"):
            if name == f"{prefix}{part}":
                places[name] = (pose.setdefault("rotation", {"axis": [0, 0, 1], "angle": 0}), part)
    turns = [f"{prefix}{part}" for prefix in prefixes for part in ("angle", "axis")]
    if name not in places:
        raise CaseError(name, f"cannot be set; {nearest(name, [*places, *turns])}")
    table, place = places[name]
    table[place] = value
