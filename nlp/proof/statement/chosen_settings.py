"""Cases with chosen values of settings, and the ranges of settings of which any value may do at a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...case.case import Case
from ...case.pose import Free, Value
from ...case.workspace import Workspace

#: Name of the claim that at every pose some value of the settings satisfies all limits.
SETTINGS = "settings"


def ranges_of_settings(case: Case) -> dict[str, Free]:
    """Return the range of each setting that is not fixed, by its name in the robot."""
    names = set() if case.workspace is None else set(case.workspace.setting_names)
    return {
        name: value
        for item in case.model.parameters
        for name, value in zip(item.components, case.components(item.name), strict=True)
        if name in names and isinstance(value, Free)
    }


def with_settings(case: Case, values: Mapping[str, Value]) -> Case:
    """Return a case with other values of its settings, by their names in the robot."""
    return case.with_components({case.parameter_name(name): value for name, value in values.items()})


def part_of(workspace: Workspace, ends: tuple[list[float], list[float]]) -> Workspace:
    """Return the part of a workspace with other ends of its coordinates; fixed coordinates stay.

    Args:
        workspace: the workspace.
        ends: lower and upper ends (3 + a,) of the position and of the angles.
    """
    stated = (*workspace.position, *workspace.turns.angles)
    values = [
        each if not isinstance(each, Free) else Free(low, high) if low < high else low
        for each, low, high in zip(stated, *ends, strict=True)
    ]
    return replace(workspace, position=tuple(values[:3]), turns=replace(workspace.turns, angles=tuple(values[3:])))
