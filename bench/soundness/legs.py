"""Straight legs between joint centres, in NumPy from a case's tables: numbers of many poses and machines at once."""

from __future__ import annotations

import itertools
import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Tables = dict[str, Any]
Z = np.array([0.0, 0.0, 1.0])


class Poses(NamedTuple):
    """Positions (N, 3) and rotations (N, 3, 3)."""

    p: Array
    R: Array


def turned(axis: Array, angle: Array) -> Array:
    """Return rotations (N, 3, 3) about axes (N, 3) by angles (N,)."""
    n = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-300)
    K = np.zeros((*n.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -n[..., 2], n[..., 1], -n[..., 0]
    K = K - np.swapaxes(K, -1, -2)
    s, c = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.eye(3) + s * K + (1 - c) * (K @ K)


def ends(value: Any) -> tuple[float, float]:  # noqa: ANN401 - a number or a table of two
    """Return the ends of a number of a case file."""
    return (float(value["min"]), float(value["max"])) if isinstance(value, dict) else (float(value), float(value))


class Box:
    """The poses of a case's workspace: coordinates between 0 and 1, and poses of them."""

    def __init__(self, tables: Tables) -> None:
        self.unit = 1.0 if tables.get("units", {}).get("angle") == "rad" else np.pi / 180
        self.position = np.array([ends(each) for each in tables["workspace"]["position"]])
        rotation = tables["workspace"].get("rotation", {"axis": [0, 0, 1], "angle": 0})
        self.kind = (
            "ball" if "axis" not in rotation and "angle" in rotation else "axis" if "axis" in rotation else "rpy"
        )
        self.axis = np.array(rotation.get("axis", [0, 0, 1]), float)
        if self.kind == "rpy":
            self.angles = np.array([ends(rotation.get(name, 0.0)) for name in ("roll", "pitch", "yaw")]) * self.unit
        else:
            self.angles = np.array([ends(rotation["angle"])]) * self.unit
        self.size = 3 + (1 if self.kind == "axis" else 3)

    @property
    def ends(self) -> tuple[Array, Array]:
        """Smallest and largest values (size,) of positions and angles; of components of a rotation vector in a ball."""
        angles = np.repeat(self.angles, self.size - 2 - len(self.angles), 0)
        return np.concatenate([self.position, angles]).T[0], np.concatenate([self.position, angles]).T[1]

    def poses(self, u: Array) -> Poses:
        """Return the poses of coordinates (N, size) between 0 and 1; a ball's corners are brought to its surface."""
        lower, upper = self.ends
        p, a = np.split(lower + u * (upper - lower), [3], axis=1)
        if self.kind == "ball":
            size = np.linalg.norm(a, axis=1)
            a *= np.minimum(1.0, self.angles[0, 1] / np.maximum(size, 1e-300))[:, None]
            return Poses(p, turned(a, np.linalg.norm(a, axis=1)))
        if self.kind == "axis":
            return Poses(p, turned(np.broadcast_to(self.axis, p.shape), a[:, 0]))
        x, y, z = (turned(np.broadcast_to(axis, p.shape), a[:, k]) for k, axis in enumerate(np.eye(3)))
        return Poses(p, z @ y @ x)

    def turns(self, R: Array) -> Array:
        """Return the angles (N, size - 3) of rotations: the nearest ones where they are about one axis."""
        if self.kind == "rpy":
            roll, yaw = np.arctan2(R[:, 2, 1], R[:, 2, 2]), np.arctan2(R[:, 1, 0], R[:, 0, 0])
            return np.stack([roll, np.arcsin(np.clip(-R[:, 2, 0], -1, 1)), yaw], 1)
        v = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], 1) / 2
        c = (np.trace(R, axis1=1, axis2=2) - 1) / 2
        if self.kind == "ball":
            s = np.linalg.norm(v, axis=1)
            return v * (np.arctan2(s, c) / np.maximum(s, 1e-300))[:, None]
        n = self.axis / np.linalg.norm(self.axis)
        along = np.einsum("i,nij,j->n", n, R, n)  # 1 about this axis
        return np.arctan2(v @ n, c + (1 - along) / 2)[:, None]

    def within(self, poses: Poses) -> Array:
        """Return coordinates (N, size) between 0 and 1: those of poses, or of near ones in the workspace."""
        lower, upper = self.ends
        width = upper - lower
        y = np.concatenate([poses.p, self.turns(poses.R)], 1)
        return np.asarray(np.clip((y - lower) / np.where(width > 0, width, 1.0), 0, 1))

    def outside(self, poses: Poses) -> tuple[Array, Array]:
        """Return how far poses (N,) are outside of the workspace, lengths in parts of its size and radians."""
        near, size = self.poses(self.within(poses)), np.abs(self.position).max() or 1.0
        turn = np.linalg.norm(poses.R - near.R, axis=(1, 2)) / np.sqrt(2)
        return np.abs(poses.p - near.p).max(1) / size, turn

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Return coordinates: a half uniform, a quarter with most at ends, a quarter with some at ends."""
        u = rng.random((count, self.size))
        ended = np.zeros_like(u, dtype=bool)
        ended[count // 2 : 3 * count // 4] = rng.random((3 * count // 4 - count // 2, self.size)) < 0.9
        ended[3 * count // 4 :] = rng.random((count - 3 * count // 4, self.size)) < 0.4
        return np.where(ended, np.round(u), u)

    def has(self, pose: dict[str, Any]) -> bool:
        """Whether a pose of a result is in the workspace, up to rounding."""
        length, turn = self.outside(pose_of(pose, self.unit))
        return bool(length[0] < 1e-9 and turn[0] < 1e-7)


def pose_of(pose: dict[str, Any], unit: float) -> Poses:
    """Return a pose of a result, with angles of a unit in radians."""
    R = turned(np.array([pose["axis"]], float), np.array([pose["angle"] * unit]))
    return Poses(np.array([pose["position"]], float), R)


def twist_of(task: Tables) -> Array:
    """Return the twist (6,) of a task: angular velocity, then the velocity at the world's origin."""
    s = np.array(task["axis"], float)
    s /= np.linalg.norm(s)
    if np.isinf(task["pitch"]):
        return np.concatenate([np.zeros(3), s])
    return np.concatenate([s, np.cross(task.get("point", [0, 0, 0]), s) + task["pitch"] * s])


class Legs:
    """Robots with straight legs: six of them, or the three of ``three-upu`` with couples.

    Attributes:
        base, platform: (m, 3) joint centres.
        names: of the legs.
        couples: (k, 3) normals of couples in the platform's frame, or None: of the axes of ``three-upu``.
    """

    def __init__(self, tables: Tables) -> None:
        robot = tables["robot"]
        self.unit = 1.0 if tables.get("units", {}).get("angle") == "rad" else np.pi / 180
        given = robot["parameters"]
        self.first: Array | None = None
        if robot["model"] == "stewart-gough":
            x3, x4 = given["x3"] * self.unit, given["x4"] * self.unit
            base, platform, self.names = [], [], []
            for k, sign in itertools.product(range(3), (-1, 1)):
                centre = 2 * np.pi / 3 * k
                other = centre + sign * (x4 if robot.get("layout", "aligned") == "aligned" else np.pi / 3 - x4)
                base.append(given["x1"] * np.array([np.cos(centre + sign * x3), np.sin(centre + sign * x3), 0]))
                platform.append(given["x2"] * np.array([np.cos(other), np.sin(other), 0]))
                self.names.append(f"{k + 1}{'+' if sign > 0 else '-'}")
        elif robot["model"] == "hexapod":
            base = [given[f"base_{k + 1}"] for k in range(6)]
            platform = [given[f"platform_{k + 1}"] for k in range(6)]
            self.names = [str(k + 1) for k in range(6)]
        else:
            azimuth = 2 * np.pi / 3 * np.arange(3)
            radial = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], 1)
            base, platform = given["base_radius"] * radial, given["platform_radius"] * radial
            self.first = radial if robot["axes"] == "snu" else np.cross(Z, radial)
            self.names = ["1", "2", "3"]
        self.base, self.platform = np.array(base, float), np.array(platform, float)
        self.length = float(robot.get("characteristic_length", 1.0))
        self.tasks = {each.get("name", "task 1"): twist_of(each) for each in tables["task"]}
        self.limits = tables.get("limits", {})
        self.parameters = given

    def values(
        self, poses: Poses, base_errors: Array | float = 0.0, platform_errors: Array | float = 0.0
    ) -> dict[str, Array]:
        """Return numbers (N,) by the names that results give them; angles are radians."""
        p, R = poses
        a = self.platform + np.zeros((len(p), 1, 1)) + platform_errors
        b = self.base + np.zeros((len(p), 1, 1)) + base_errors
        arms = np.einsum("nij,nkj->nki", R, a)
        d = p[:, None] + arms - b
        length = np.linalg.norm(d, axis=2)
        n = d / length[:, :, None]
        found: dict[str, Array] = {}
        for k, name in enumerate(self.names):
            found[f"leg_length limb {name}"] = length[:, k]
        for plate in ("base", "platform"):
            limit = self.limits.get(f"{plate}_joint_angle", 0)
            axis = self.mounting(plate, limit.get("about", "normal") if isinstance(limit, dict) else "normal")
            axes = np.broadcast_to(axis, n.shape) if plate == "base" else np.einsum("nij,kj->nki", R, axis)
            for key, those in (
                ("", axes),
                ("of", np.broadcast_to(Z, n.shape) if plate == "base" else np.broadcast_to(R[:, None, :, 2], n.shape)),
            ):
                angle = np.arctan2(np.linalg.norm(np.cross(those, n), axis=2), (those * n).sum(2))
                for k, name in enumerate(self.names):
                    found[f"{key}{plate}_joint_angle limb {name}"] = angle[:, k]
            centres = a if plate == "platform" else b
            for i, j in itertools.combinations(range(len(self.names)), 2):
                found[f"joint_spacing {plate} joints {self.names[i]} and {self.names[j]}"] = np.linalg.norm(
                    centres[:, i] - centres[:, j], axis=1
                )
            radii = np.linalg.norm(centres[:, :, :2], axis=2)
            for k, name in enumerate(self.names):
                found[f"footprint {plate} joint {name}"] = radii[:, k]
            found[f"radius {plate}"] = np.sqrt((radii**2).mean(1))
        found["radius_ratio"] = found["radius platform"] / found["radius base"]
        J, J_platform = self.rows(n, b, arms, R)
        for task, chi in self.tasks.items():
            rates = J[:, :, :3] @ chi[3:] + J[:, :, 3:] @ chi[:3]
            F = (rates**2).sum(1)
            words = (f" of {task}", f" task {task}") if len(self.tasks) > 1 else ("", "")
            found[f"F{words[0]}"] = F
            for k, name in enumerate(self.names):
                own = rates[:, k] ** 2 + (rates[:, k + 3] ** 2 if self.first is not None else 0.0)
                found[f"rate_share limb {name}{words[1]}"] = own / F
                found[f"actuator_rate actuator {name}{words[1]}"] = abs(rates[:, k])
        for key in ("condition_number", "smallest_singular_value"):
            for name, size in (
                (key, self.limits.get(key, {}).get("length", self.length)),
                (f"{key} with the characteristic length", self.length),
            ):
                scaled = J_platform.copy()
                scaled[:, :, 3:] /= size
                s = np.linalg.svd(scaled, compute_uv=False)
                found[name] = s[:, 0] / np.maximum(s[:, 5], 1e-300) if key == "condition_number" else s[:, 5]
        scaled = J_platform.copy()
        scaled[:, :, 3:] /= np.linalg.norm(self.platform, axis=1).mean()
        sign, size = np.linalg.slogdet(scaled)
        found["det"] = sign * np.exp(size)
        s = np.linalg.svd(scaled, compute_uv=False)
        found["regular"] = s[:, 5] / s[:, 0]
        names = {f"p_{x}": p[:, k] for k, x in enumerate("xyz")}
        for relation in self.limits.get("custom", ()):
            left, right = re.split(r"<=|>=", relation)
            own = {name: value for name, value in self.parameters.items() if isinstance(value, (int, float))}
            value = eval(left.replace("^", "**"), {"sqrt": np.sqrt}, own | names) - float(right)  # noqa: S307 - our own text
            found[f"custom: {relation}"] = value + np.zeros(len(p))
        return found

    def clearance(
        self, name: str, poses: Poses, base_errors: Array | float = 0.0, platform_errors: Array | float = 0.0
    ) -> Array:
        """Return the distance of two legs as segments, by the least of the ends' and of the inner points'."""
        one, other = (self.names.index(each) for each in name.removeprefix("leg_clearance limbs ").split(" and "))
        a = (
            np.einsum("nij,nkj->nki", poses.R, self.platform + np.zeros((len(poses.p), 1, 1)) + platform_errors)
            + poses.p[:, None]
        )
        b = self.base + np.zeros_like(a) + base_errors
        return segment_distance(b[:, one], a[:, one], b[:, other], a[:, other])

    def mounting(self, plate: str, about: Any) -> Array:  # noqa: ANN401 - a word, a direction, or several
        """Return mounting axes (m, 3) in the frame of a plate; from home they are along the legs of the design."""
        if about == "normal":
            return np.broadcast_to(Z, self.base.shape)
        if about == "home":
            home = self.limits["home"]
            R = turned(
                np.array(home.get("axis", [0, 0, 1.0]), float)[None], np.array([home.get("angle", 0.0) * self.unit])
            )[0]
            d = np.array(home["position"], float) + self.platform @ R.T - self.base
            d /= np.linalg.norm(d, axis=-1, keepdims=True)
            return d if plate == "base" else d @ R
        axes = np.array(about, float)
        axes = axes / np.linalg.norm(axes, axis=-1, keepdims=True)
        return np.broadcast_to(axes, self.base.shape)

    def rows(self, n: Array, b: Array, arms: Array, R: Array) -> tuple[Array, Array]:
        """Return J (N, 6, 6) with moments about the world's origin, and about the platform's."""
        world, own = np.concatenate([n, np.cross(b, n)], 2), np.concatenate([n, np.cross(arms, n)], 2)
        if self.first is None:
            return world, own
        u = np.einsum("nij,kj->nki", R, self.first)
        normal = n - u * (u * n).sum(2, keepdims=True)
        normal *= self.length / np.linalg.norm(normal, axis=2, keepdims=True)
        couples = np.concatenate([0 * normal, normal], 2)
        return np.concatenate([world, couples], 1), np.concatenate([own, couples], 1)


def segment_distance(p: Array, q: Array, r: Array, s: Array) -> Array:
    """Return distances (N,) of segments from p to q and from r to s."""

    def to_segment(x: Array, a: Array, b: Array) -> Array:
        d = b - a
        t = np.clip(((x - a) * d).sum(1) / np.maximum((d * d).sum(1), 1e-300), 0, 1)
        return np.linalg.norm(x - a - t[:, None] * d, axis=1)

    best = np.minimum.reduce([to_segment(p, r, s), to_segment(q, r, s), to_segment(r, p, q), to_segment(s, p, q)])
    d, e, w = q - p, s - r, p - r
    A, B, C, D, E = (d * d).sum(1), (d * e).sum(1), (e * e).sum(1), (d * w).sum(1), (e * w).sum(1)
    det = A * C - B * B
    with np.errstate(divide="ignore", invalid="ignore"):
        t, o = (B * E - C * D) / det, (A * E - B * D) / det
    inner = (det > 1e-14 * A * C) & (t > 0) & (t < 1) & (o > 0) & (o < 1)
    t, o = np.where(inner, t, 0)[:, None], np.where(inner, o, 0)[:, None]
    return np.where(inner, np.linalg.norm(w + t * d - o * e, axis=1), best)
