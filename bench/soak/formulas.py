"""Geometry of the robots of the soak in NumPy, written down from their drawings: no expression is the program's.

All functions take m points at a time. Lengths are in the case's unit, angles in radians.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

Array = np.ndarray
THIRD = 2 * np.pi / 3


class State(NamedTuple):
    """A robot at m points.

    Attributes:
        F: (m, poses, tasks) sum of squared rates.
        limits: by key, the numbers (m, k) that a limit bounds, such as ``leg_length.max``.
        equations: (m, e) residuals of closed loops, lengths.
        is_home: (m,) whether the joints are assembled as at home.
    """

    F: Array
    limits: Mapping[str, Array]
    equations: Array
    is_home: Array


def rotation(numbers: Mapping[str, Array], prefix: str = "") -> Array:
    """Return the rotations (m, 3, 3) from a quaternion's vector part, or from axis and angle; the identity else."""
    some = next(iter(numbers.values()))
    if f"{prefix}q_x" in numbers:
        q = np.stack([numbers[f"{prefix}q_{c}"] for c in "xyz"], axis=-1)
        angle_sine = np.sqrt(np.sum(q * q, axis=-1))
        cosine = np.sqrt(1 - angle_sine**2)
        K = cross_matrix(q)
        return np.eye(3) + 2 * cosine[:, None, None] * K + 2 * K @ K
    axis = np.stack([numbers[f"{prefix}axis_{c}"] for c in "xyz"], axis=-1)
    angle = numbers[f"{prefix}angle"]
    size = np.linalg.norm(axis, axis=-1)
    K = cross_matrix(axis / np.where(size > 0, size, 1.0)[:, None])
    turn = np.eye(3) + np.sin(angle)[:, None, None] * K + (1 - np.cos(angle))[:, None, None] * K @ K
    return np.where((size > 0)[:, None, None], turn, np.broadcast_to(np.eye(3), (len(some), 3, 3)))


def cross_matrix(v: Array) -> Array:
    """Return the matrices (m, 3, 3) of the cross products with vectors (m, 3)."""
    x, y, z = v.T
    zero = np.zeros_like(x)
    return np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)


def on_circle(radius: Array, azimuth: Array) -> Array:
    """Return points (m, 3) of circles about the origin in the plane z = 0."""
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), 0 * radius], axis=-1)


def about_z(angle: Array) -> Array:
    """Return rotations (m, 3, 3) about the z axis."""
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.stack([zero, zero, one], -1)], -2)


def turned(R: Array, v: Array) -> Array:
    """Return R v for matrices (m, 3, 3) and vectors (m, 3)."""
    return np.einsum("mij,mj->mi", R, v)


def twists_of(numbers: Mapping[str, Array]) -> list[Array]:
    """Return the twists (m, 6) of the tasks."""
    names = ["twist", *(f"twist{j}" for j in range(1, 10) if f"twist{j}_0" in numbers)]
    return [np.stack([numbers[f"{name}_{i}"] for i in range(6)], axis=-1) for name in names]


def velocity(twist: Array, point: Array) -> Array:
    """Return the velocities (m, 3) of points of the platform."""
    return twist[:, 3:] + np.cross(twist[:, :3], point)


def platform_of_legs(numbers: Mapping[str, Array], layout: str, home: Array | None) -> State:
    """Return the state of a platform with six legs between joints in pairs on two circles.

    Args:
        numbers: variables and fixed numbers by name, (m,) each.
        layout: ``aligned`` or ``octahedral``.
        home: (3,) position at which the joints are mounted straight, the platform parallel to the base; or None.
    """
    poses = [f"pose{k}_" for k in range(1, 20) if f"pose{k}_p_x" in numbers] or [""]
    x1, x2, x3, x4 = (numbers[f"x{i}"] for i in range(1, 5))
    legs = [(k, sign) for k in range(3) for sign in (-1, 1)]
    base = [on_circle(x1, THIRD * k + sign * x3) for k, sign in legs]
    local = [on_circle(x2, THIRD * k + sign * (x4 if layout == "aligned" else np.pi / 3 - x4)) for k, sign in legs]
    F, lengths, shares, tilts, gaps = [], [], [], ([], []), []
    for prefix in poses:
        R, p = rotation(numbers, prefix), np.stack([numbers[f"{prefix}p_{c}"] for c in "xyz"], axis=-1)
        ends = [p + turned(R, a) for a in local]
        spans = [a - b for a, b in zip(ends, base, strict=True)]
        own = [np.linalg.norm(span, axis=-1) for span in spans]
        rates = np.stack(
            [
                [np.sum(span * velocity(twist, b), axis=-1) / length for twist in twists_of(numbers)]
                for span, b, length in zip(spans, base, own, strict=True)
            ]
        )
        F.append(np.sum(rates**2, axis=0).T)
        lengths += own
        shares += [rates[i, 0] ** 2 / F[-1][:, 0] for i in range(6)]
        if home is not None:
            straight = [home + a - b for a, b in zip(local, base, strict=True)]
            for k, mount in enumerate(straight):
                tilts[0].append(angle_between(spans[k], mount))
                tilts[1].append(angle_between(spans[k], turned(R, mount)))
            gaps += [distance(base[i], ends[i], base[j], ends[j]) for i, j in itertools.combinations(range(6), 2)]
    apart = [
        np.linalg.norm(one - other, axis=-1) for row in (base, local) for one, other in itertools.combinations(row, 2)
    ]
    limits = {"leg_length.min": lengths, "leg_length.max": lengths, "joint_spacing.min": apart}
    limits |= {"footprint.base": [x1], "footprint.platform": [x2], "radius_ratio.max": [x2 / x1]}
    limits |= {"rate_share.max": shares, "angle.max": [angle_of(numbers)]}
    limits |= {"base_joint_angle.max": tilts[0], "platform_joint_angle.max": tilts[1], "leg_clearance.min": gaps}
    found = {key: np.stack(values, axis=-1) for key, values in limits.items() if values}
    m = len(x1)
    return State(np.stack(F, axis=1), found, np.zeros((m, 0)), np.ones(m, dtype=bool))


def angle_of(numbers: Mapping[str, Array]) -> Array:
    """Return the angle (m,) of the platform's rotation about any axis; 0 where its axis is fixed."""
    if "q_x" not in numbers:
        return np.zeros_like(next(iter(numbers.values())))
    return 2 * np.arcsin(np.sqrt(sum(numbers[f"q_{c}"] ** 2 for c in "xyz")))


def angle_between(one: Array, other: Array) -> Array:
    """Return the angles (m,) between vectors (m, 3)."""
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), np.sum(one * other, axis=-1))


def distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return the distances (m,) of segments a-b and c-d: the least over the inner point and the eight edges' points."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (np.sum(x * y, axis=-1) for x, y in ((u, u), (v, v), (u, v)))
    uw, vw = np.sum(u * w, axis=-1), np.sum(v * w, axis=-1)
    det = uu * vv - uv**2
    safe = np.where(det > 0, det, 1.0)
    s = np.where(det > 0, (uv * vw - vv * uw) / safe, 0.0)
    pairs = [(s, (uv * s + vw) / vv)]
    pairs += [(np.full_like(s, end), (uv * end + vw) / vv) for end in (0.0, 1.0)]
    pairs += [((uv * end - uw) / uu, np.full_like(s, end)) for end in (0.0, 1.0)]
    pairs = [(np.clip(s, 0, 1), np.clip(t, 0, 1)) for s, t in pairs]
    return np.min([np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=-1) for s, t in pairs], axis=0)


def delta(numbers: Mapping[str, Array]) -> State:
    """Return the state of a Delta: arms that turn about tangents of the base, two rods from each to the platform."""
    R, p = rotation(numbers), np.stack([numbers[f"p_{c}"] for c in "xyz"], axis=-1)
    rb, rp, arm, rod, w, tilt = (numbers[name] for name in ("rb", "rp", "arm", "rod", "w", "tilt"))
    F, gaps, bends = 0.0, [], []
    zero = np.zeros_like(rb)
    for k in range(3):
        turn = about_z(zero + THIRD * k)
        angle = tilt + numbers[f"q{k + 1}_1"]
        elbow = np.stack([rb + arm * np.cos(angle), zero, -arm * np.sin(angle)], axis=-1)
        reach = np.stack([np.cos(angle), zero, -np.sin(angle)], axis=-1)
        bend = 0.0
        for side in (-0.5, 0.5):
            offset = np.stack([zero, side * w, zero], axis=-1)
            at = p + turned(R, turned(turn, np.stack([rp, zero, zero], axis=-1) + offset))
            span = at - turned(turn, elbow + offset)
            length = np.linalg.norm(span, axis=-1)
            gaps.append(length - rod)
            rates = [np.sum(span * velocity(twist, at), axis=-1) / length for twist in twists_of(numbers)]
            F = F + np.stack(rates, axis=-1) ** 2
            bend = bend + np.sum(np.cross(turned(turn, reach), span) * turned(turn, np.array([[0.0, 1.0, 0.0]])), axis=-1)
        bends.append(bend)
    # At home the rods hang from the ends of the arms, on one side of them.
    is_home = np.all(np.stack(bends) > 0, axis=0)
    return State(F[:, None, :], {"angle.max": angle_of(numbers)[:, None]}, np.stack(gaps, axis=-1), is_home)


def planar(numbers: Mapping[str, Array]) -> State:
    """Return the state of a planar robot with three cranks and rods: l, the characteristic length, weighs rotations."""
    R, p = rotation(numbers), np.stack([numbers[f"p_{c}"] for c in "xyz"], axis=-1)
    rb, rp, turn, bend = (numbers[name] for name in ("rb", "rp", "turn", "bend"))
    zero = np.zeros_like(rb)
    tip = np.stack([rp * np.cos(turn), rp * np.sin(turn), zero], axis=-1)
    start = np.stack([rb, zero, zero], axis=-1)
    knee = (start + tip) / 2 + np.stack([zero, bend, zero], axis=-1)
    F, gaps, bends = 0.0, [p[:, 2], R[:, 0, 2], R[:, 1, 2]], []
    for k in range(3):
        image = about_z(zero + THIRD * k)
        crank = about_z(numbers[f"q{k + 1}_1"])
        rod = about_z(-numbers[f"q{k + 1}_2"])  # the second angle is that of the platform's hinge
        elbow = turned(image, start + turned(crank, knee - start))
        along = turned(R, turned(image, turned(rod, tip - knee)))
        at = p + turned(R, turned(image, tip))
        gaps += list((at - elbow - along).T)
        across = np.cross(turned(image, turned(crank, knee - start)), along)[:, 2]
        bends.append(across)
        parts = []
        for twist in twists_of(numbers):
            v = velocity(twist, at)
            pull = np.sum(v * along, axis=-1) / np.linalg.norm(along, axis=-1)
            turning = numbers["characteristic_length"] ** 2 * (twist[:, 0] ** 2 + twist[:, 1] ** 2)
            parts.append(pull**2 + v[:, 2] ** 2 + turning)
        F = F + np.stack(parts, axis=-1)
    # The typical dimensions bend all rods to this side of the cranks.
    is_home = np.all(np.stack(bends) > 0, axis=0)
    return State(F[:, None, :], {"angle.max": angle_of(numbers)[:, None]}, np.stack(gaps, axis=-1), is_home)


def tripod(numbers: Mapping[str, Array]) -> State:
    """Return the state of a 3-RPS: slides that turn about tangents of the base and end in balls of the platform."""
    R, p = rotation(numbers), np.stack([numbers[f"p_{c}"] for c in "xyz"], axis=-1)
    rb, rp, h = (numbers[name] for name in ("rb", "rp", "h"))
    zero = np.zeros_like(rb)
    first = np.stack([rp - rb, zero, h], axis=-1)
    length = np.linalg.norm(first, axis=-1)
    F, gaps, reaches = 0.0, [], []
    for k in range(3):
        image = about_z(zero + THIRD * k)
        angle = np.arctan2(h, rp - rb) - numbers[f"q{k + 1}_1"]
        along = turned(image, np.stack([np.cos(angle), zero, np.sin(angle)], axis=-1))
        axis = turned(image, np.array([[0.0, 1.0, 0.0]]) + 0 * first)
        reach = length + numbers[f"q{k + 1}_2"]
        at = p + turned(R, turned(image, np.stack([rp, zero, zero], axis=-1)))
        gaps += list((at - turned(image, np.stack([rb, zero, zero], axis=-1)) - reach[:, None] * along).T)
        reaches.append(reach)
        v = [velocity(twist, at) for twist in twists_of(numbers)]
        F = F + np.stack([np.sum(along * u, axis=-1) ** 2 + np.sum(axis * u, axis=-1) ** 2 for u in v], axis=-1)
    is_home = np.all(np.stack(reaches) > 0, axis=0)
    return State(F[:, None, :], {"angle.max": angle_of(numbers)[:, None]}, np.stack(gaps, axis=-1), is_home)
