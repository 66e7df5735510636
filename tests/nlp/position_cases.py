"""A printer with vertical carriages over sets of positions: its case, and its measures and sets by plain formulas."""

import math
from pathlib import Path

import numpy as np
from builders import case_from

from screwsynth.models import FloatArray
from screwsynth.nlp import Case
from screwsynth.nlp.case.pose import ends_of
from screwsynth.nlp.case.positionsets import PositionSet, SetKind

#: Linear Delta with the dimensions of LinuxCNC's lineardeltakins, and its carriages' stroke.
DELTA = """
name = "Linear delta"
description = "three vertical carriages, each with two rods to the platform"
home = [0, 0, "h"]
[dimensions]
R = { typical = 130.25, description = "radius of the carriage joints less that of the platform joints" }
rp = { typical = 33, description = "radius of the platform joints" }
L = { typical = 269, description = "length of the rods" }
w = { typical = 50, description = "distance between the rods" }
[derived]
h = "-sqrt(L^2 - R^2)"
[[limb]]
repeat = { count = 3 }
points = { E = ["R + rp", 0, 0], A = ["rp", 0, "h"] }
joints = [{ type = "P", at = "E", axis = "z", actuated = true }]
branch = [
    { joints = [{ type = "S", at = "E + w/2*y" }, { type = "S", at = "A + w/2*y" }] },
    { joints = [{ type = "S", at = "E - w/2*y" }, { type = "S", at = "A - w/2*y" }] },
]
"""
RADIUS, ROD = 130.25, 269.0
HOME = -math.sqrt(ROD**2 - RADIUS**2)
#: Pillars of the printer about the vertical axis.
PILLARS = np.array([[math.cos(k), math.sin(k)] for k in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)])
LOWEST = -120.0


def delta(folder: Path, position: object, *, unit: float = 1.0, limited: bool = True) -> Case:
    """Linear Delta over positions, with a lowest and a highest place of carriages; all lengths times a unit."""
    (folder / "delta.toml").write_text(DELTA)
    tables = {
        "robot": {
            "file": str(folder / "delta.toml"),
            "parameters": {"R": RADIUS * unit, "rp": 33 * unit, "L": ROD * unit, "w": 50 * unit},
        },
        "pose": {"position": [0, 0, HOME * unit]},
        "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "workspace": {"position": position},
    }
    if limited:
        tables["limits"] = {"actuator_length": {"min": LOWEST * unit, "max": 500 * unit}}
    return case_from(tables, "printer")


def heights(points: FloatArray) -> FloatArray:
    """Heights (N, 3) of the carriages at positions (N, 3), in closed form."""
    off = RADIUS * PILLARS - points[:, None, :2]
    return np.asarray(points[:, 2:] + np.sqrt(ROD**2 - (off**2).sum(axis=2)))


def excess(given: PositionSet, points: FloatArray) -> FloatArray:
    """How far points (N, 3) are outside of a set, by plain formulas; negative inside."""
    p = points - np.array(given.shift)
    d = p - np.array(given.centre)
    parts = [(p - each.point) @ np.array(each.normal) / math.hypot(*each.normal) for each in given.half_spaces]
    low, high = np.array([ends_of(each) for each in given.spans]).T
    if given.kind is SetKind.BOX:
        parts += [*(low - p).T, *(p - high).T]
    elif given.kind is SetKind.BALL:
        parts.append(np.linalg.norm(d, axis=1) - given.radius)
    elif given.kind in (SetKind.DISC, SetKind.RING):
        parts += [np.hypot(d[:, 0], d[:, 1]) - given.radius, low[2] - p[:, 2], p[:, 2] - high[2]]
    if given.kind is SetKind.RING:
        size = np.hypot(d[:, 0], d[:, 1])
        parts.append(given.inner - size)
        if given.angles:
            first, last = given.angles
            at = np.mod(np.arctan2(d[:, 1], d[:, 0]) - first, 2 * math.pi)
            beyond = np.minimum(at - (last - first), 2 * math.pi - at)
            parts.append(np.where(at <= last - first, -np.minimum(at, last - first - at), beyond) * size)
    if given.kind in (SetKind.CYLINDER, SetKind.CONE):
        axis = np.subtract(given.end, given.centre)
        length = np.linalg.norm(axis)
        along = d @ axis / length
        across = np.linalg.norm(np.cross(d, axis), axis=1) / length
        radius = given.radius * (np.clip(along / length, 0, 1) if given.kind is SetKind.CONE else 1.0)
        parts += [across - radius, -along, along - length]
    return np.max(parts, axis=0)
