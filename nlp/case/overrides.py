"""Numbers of a case file replaced by name, as ``--set`` does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from ...models import component_names
from ..errors import CaseError, nearest
from .names import parameter_name, pose_prefixes

#: Numbers of a case by name, in its file's units: three numbers for a point, axis or direction.
Settings: TypeAlias = Mapping[str, float | list[float]]


def override_number(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace a number, or the three numbers of a point, axis or direction, in a document's tables.

    Args:
        tables: the document, as ``tomllib`` returns it; changed in place.
        name: the name in the case.
        value: a number, or three, in the file's units.

    Raises:
        CaseError: the case has no number of this name.
    """
    parameters = tables.get("robot", {}).get("parameters", {})
    given = tables.setdefault("pose", {})
    poses = given if isinstance(given, list) else [given]
    places: dict[str, tuple[Any, int | str]] = {}
    for key, written in parameters.items():
        places[parameter_name(key, len(poses))] = (parameters, key)
        if isinstance(written, list):
            for index, part in enumerate(component_names(key, len(written))):
                places[parameter_name(part, len(poses))] = (written, index)
    rotations = []
    for prefix, pose in zip(pose_prefixes(len(poses)), poses, strict=True):
        if isinstance(pose.get("position"), list):
            names = component_names(f"{prefix}p", 3)
            places.update({part: (pose["position"], index) for index, part in enumerate(names)})
        for part in ("angle", "axis"):
            rotations.append(f"{prefix}{part}")
            if name == f"{prefix}{part}":
                places[name] = (pose.setdefault("rotation", {"axis": [0, 0, 1], "angle": 0}), part)
    if name not in places:
        raise CaseError(name, f"cannot be set; {nearest(name, [*places, *rotations])}")
    table, place = places[name]
    table[place] = value
