"""What tests measure robots with, in NumPy alone: joint centres, distances of segments, finite motions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from builders import Array


def cross_matrix(u: Array) -> Array:
    """The matrix that multiplies as ``u x``."""
    return np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])


def exponential(twist: Array, t: float) -> Array:
    """The displacement (4, 4) of a constant twist in a time t, by the power series of its matrix."""
    M = np.zeros((4, 4))
    M[:3, :3], M[:3, 3] = cross_matrix(twist[:3]), twist[3:]
    total, term = np.eye(4), np.eye(4)
    for k in range(1, 40):
        term = term @ M * t / k
        total = total + term
    return total


def circle_joints(x: Mapping[str, float], layout: str = "octahedral") -> tuple[Array, Array]:
    """Joint centres (6, 3) on the two circles of a Stewart-Gough platform, each in its plate's frame; radians."""
    base, platform = [], []
    for centre in np.radians([0, 120, 240]):
        for side in (-1, 1):
            u = centre + side * x["x3"]
            v = centre + side * (x["x4"] if layout == "aligned" else math.radians(60) - x["x4"])
            base.append([x["x1"] * math.cos(u), x["x1"] * math.sin(u), 0.0])
            platform.append([x["x2"] * math.cos(v), x["x2"] * math.sin(v), 0.0])
    return np.array(base), np.array(platform)


def placed_joints(result: dict[str, Any], pose: dict[str, Any] | None = None) -> tuple[Array, Array, Array]:
    """Joints of base and platform in their plates' frames, and platform joints in the world, from a design alone.

    Args:
        result: an octahedral platform's result as JSON, in degrees.
        pose: another pose than the result's own.
    """
    pose = pose or result["pose"]
    x = {name: math.radians(value) if name in ("x3", "x4") else value for name, value in result["parameters"].items()}
    base, platform = circle_joints(x)
    return base, platform, np.array(pose["position"]) + platform @ np.array(pose["rotation_matrix"]).T


def segment_distance(p: Array, q: Array, r: Array, s: Array) -> float:
    """Distance between segments pq and rs: a grid over pq, refined about the point that is nearest to rs.

    The distance from rs is convex along pq, so that the nearest point lies within a step of the grid's best one.
    """
    low, high, best, along = 0.0, 1.0, math.inf, s - r
    for _ in range(12):
        u = np.linspace(low, high, 21)
        points = p + u[:, None] * (q - p)
        v = np.clip((points - r) @ along / (along @ along), 0, 1)
        distances = np.linalg.norm(points - r - v[:, None] * along, axis=1)
        nearest = int(np.argmin(distances))
        best = min(best, float(distances[nearest]))
        low, high = u[max(nearest - 1, 0)], u[min(nearest + 1, 20)]
    return best


def leg_measures(
    base: Array, platform: Array, R: Array, p: Array, base_axes: Array, platform_axes: Array
) -> dict[str, float]:
    """What limits speak of in six straight legs, each at its worst place.

    Args:
        base: (6, 3) joint centres on the base.
        platform: (6, 3) joint centres in the platform's frame.
        R: the platform's rotation.
        p: its position.
        base_axes: (6, 3) directions against which the angles of the base's joints count, radians.
        platform_axes: (6, 3) those of the platform's joints, in the world.
    """
    ends = p + platform @ R.T
    spans, pairs = ends - base, list(itertools.combinations(range(6), 2))
    lengths = np.linalg.norm(spans, axis=1)

    def lean(axes: Array) -> float:
        cosines = np.einsum("ij,ij->i", axes, spans) / np.linalg.norm(axes, axis=1) / lengths
        return float(np.arccos(np.clip(cosines, -1, 1)).max())

    return {
        "leg_length.min": lengths.min(),
        "leg_length.max": lengths.max(),
        "base_joint_angle.max": lean(base_axes),
        "platform_joint_angle.max": lean(platform_axes),
        "joint_spacing.min": min(np.linalg.norm(at[i] - at[j]) for at in (base, platform) for i, j in pairs),
        "footprint.base": np.linalg.norm(base[:, :2], axis=1).max(),
        "footprint.platform": np.linalg.norm(platform[:, :2], axis=1).max(),
        "leg_clearance.min": min(segment_distance(base[i], ends[i], base[j], ends[j]) for i, j in pairs),
    }


def scaled(value: Any, factor: float) -> Any:  # noqa: ANN401 - a part of a table
    """Numbers of a table times a factor: a number, or a list or table of numbers."""
    if isinstance(value, dict):
        return {key: scaled(each, factor) for key, each in value.items()}
    return [scaled(each, factor) for each in value] if isinstance(value, list) else value * factor
