"""Joints of a robot file that stand for several: two crossing hinges as a universal joint, hinge and slide as ``C``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ....models.arrays import FloatArray
from .elements import SAME_POINT
from .meeting import ALMOST


def with_universal_joints(tables: Mapping[str, Any], size: float) -> dict[str, Any]:
    """Return the tables of a robot file with limbs, with pairs of passive joints as one joint ``U`` or ``C``.

    Args:
        tables: of the robot file, with numbers; one with links and joints stays as it is.
        size: of the robot.
    """
    if "limb" not in tables:
        return dict(tables)
    return {**tables, "limb": [_limb(limb, size) for limb in tables["limb"]]}


def _limb(limb: Mapping[str, Any], size: float) -> dict[str, Any]:
    """Return a limb with its joints paired; those before and behind a branching are paired apart."""
    found = dict(limb)
    if "joints" in limb:
        found["joints"] = _paired(limb["joints"], size)
    if "branch" in limb:
        found["branch"] = [{**branch, "joints": _paired(branch["joints"], size)} for branch in limb["branch"]]
    return found


def _paired(joints: Sequence[Mapping[str, Any]], size: float) -> list[dict[str, Any]]:
    """Return joints with pairs as one."""
    found: list[dict[str, Any]] = []
    rest = [dict(joint) for joint in joints]
    while rest:
        first = rest.pop(0)
        pair = None if not rest else _pair(first, rest[0], size)
        if pair is not None:
            rest.pop(0)
        found.append(pair or first)
    return found


def _pair(one: Mapping[str, Any], other: Mapping[str, Any], size: float) -> dict[str, Any] | None:
    """Return two joints as one; None where they are not."""
    kinds = one["type"], other["type"]
    if one.get("actuated") or other.get("actuated") or kinds not in (("R", "R"), ("R", "P"), ("P", "R")):
        return None
    point, axis = np.array(one["at"]), np.array(one["axis"])
    second, axis_2 = np.array(other["at"]), np.array(other["axis"])
    named = {"name": one["name"]} if "name" in one else {}
    sine = float(np.linalg.norm(np.cross(axis, axis_2)))
    if kinds == ("R", "R"):
        if sine < ALMOST or _distance(point, axis, second, axis_2) > SAME_POINT * size:
            return None
        meeting = _meeting(point, axis, second, axis_2)
        at = one["at"] if float(np.linalg.norm(meeting - point)) <= SAME_POINT * size else meeting.tolist()
        return {"type": "U", **named, "at": at, "axes": [one["axis"], other["axis"]]}
    if sine > SAME_POINT:
        return None
    hinge = one if kinds[0] == "R" else other
    return {"type": "C", **named, "at": hinge["at"], "axis": hinge["axis"]}


def _distance(p: FloatArray, a: FloatArray, q: FloatArray, b: FloatArray) -> float:
    """Return the distance of two lines that are not parallel."""
    normal = np.cross(a, b)
    return abs(float((q - p) @ normal)) / float(np.linalg.norm(normal))


def _meeting(p: FloatArray, a: FloatArray, q: FloatArray, b: FloatArray) -> FloatArray:
    """Return the point of the first line that is nearest to the second."""
    normal = np.cross(a, b)
    return np.asarray(p + a * float(np.cross(q - p, b) @ normal) / float(normal @ normal))
