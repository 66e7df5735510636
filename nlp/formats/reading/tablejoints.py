"""Joints in the tables of a robot file, in numbers: their places and axes as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....models.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class LimbNumbers:
    """A limb in numbers, its joints in the order of the file.

    Attributes:
        index: of the limb in the file.
        shape: types, actuation and branches: limbs of one shape may be copies of each other.
        names: of the joints.
        points: (n, 3) their places.
        axes: (m, 3) the axes of its joints, in order.
        driven: whether each axis is that of an actuated joint, whose sign counts.
    """

    index: int
    shape: tuple[Any, ...]
    names: tuple[str, ...]
    points: FloatArray
    axes: FloatArray
    driven: tuple[bool, ...]


def joints_of_limb(limb: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the tables of all joints of a limb: those that its branches share, then those of each branch."""
    return [*limb.get("joints", []), *(joint for branch in limb.get("branch", []) for joint in branch["joints"])]


def joints_of(tables: Mapping[str, Any]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the index of the limb and the table of every joint; the index is 0 in a file without limbs."""
    for joint in tables.get("joint", []):
        if "at" in joint:
            yield 0, joint
    for index, limb in enumerate(tables.get("limb", [])):
        for joint in joints_of_limb(limb):
            yield index, joint


def limbs_in_numbers(tables: Mapping[str, Any]) -> list[LimbNumbers]:
    """Return the limbs of a robot file that has numbers only."""
    found = []
    for index, limb in enumerate(tables.get("limb", [])):
        joints = joints_of_limb(limb)
        shape = (
            tuple((joint["type"], bool(joint.get("actuated"))) for joint in joints),
            len(limb.get("joints", [])),
            tuple(len(branch["joints"]) for branch in limb.get("branch", [])),
        )
        points = [point for joint in joints for point in (joint["at"], *([joint["to"]] if "to" in joint else []))]
        axes = [(axis, bool(joint.get("actuated"))) for joint in joints for axis in _axes(joint)]
        names = tuple(name for joint in joints for name in [joint.get("name", "")] * (2 if "to" in joint else 1))
        found.append(
            LimbNumbers(
                index,
                shape,
                names,
                np.array(points, dtype=np.float64).reshape(-1, 3),
                np.array([axis for axis, _ in axes], dtype=np.float64).reshape(-1, 3),
                tuple(driven for _, driven in axes),
            )
        )
    return found


def _axes(joint: Mapping[str, Any]) -> list[Any]:
    """Return the axes of a joint."""
    return [joint["axis"]] if "axis" in joint else list(joint.get("axes", []))
