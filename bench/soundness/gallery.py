"""Random workspaces of the gallery's robots: proved claims attacked by closed poses, refuting poses closed from home.

    python bench/soundness/gallery.py COUNT FIRST [JOURNAL]

The joints, ranks and F are those of ``robots.py``. Not judged are reach, rates of actuators, cones, clearances and
singular values.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from typing import Any

import numpy as np
from campaign import Row, campaign, judged
from legs import Array, Box, Poses, pose_of, turned, twist_of
from randomcases import random_rotation, random_tasks, text_of
from robots import FOLDER, Robot, close, numbers

Tables = dict[str, Any]
POSES, STEPS = 512, 5
NAMES = sorted(each.stem for each in FOLDER.glob("*.toml"))


def random_gallery(rng: np.random.Generator, name: str) -> Tables:
    """Return a case of a robot with random dimensions and its workspace about home, without limits."""
    robot, values = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8")), {}
    part = rng.choice([0.0, 0.1])
    for key, item in robot["dimensions"].items():
        values[key] = float(item["typical"] * (1 + part * rng.uniform(-1, 1)))
    made = built(name, values)
    size = float(np.abs(made.points_array).max())
    wide, largest = rng.choice([0.01, 0.04, 0.12]), np.radians(rng.choice([2, 6, 20]))
    planar = name.startswith(("planar", "five"))
    half = wide * size * np.where([True, True, not planar], 1.0, 0.0)
    place: list[Any] = []
    for at, by in zip(made.home + rng.uniform(-0.3, 0.3, 3) * half, half, strict=True):
        place.append(
            {"min": float(at - by * rng.uniform(0.3, 1)), "max": float(at + by * rng.uniform(0.3, 1))}
            if by
            else float(at)
        )
    angle = float(np.degrees(largest) * rng.uniform(0.2, 1))
    both = {"min": -angle, "max": angle}
    if name.startswith("6-") and rng.random() < 0.7:
        rotation = random_rotation(rng, largest, np.pi / 180)
    elif planar:
        rotation = {"yaw": both}
    elif name in ("3-puu", "3-upu", "delta", "delta-parallelogram", "orthoglide", "tripteron") and rng.random() < 0.5:
        rotation = {"axis": [0, 0, 1], "angle": 0}
    else:
        rotation = {"roll": both, "pitch": both, "yaw": both}
    tables: Tables = {
        "robot": {"model": name, "parameters": values},
        "pose": {"position": made.home.tolist()},
        "task": random_tasks(rng, size)[:1],
        "limits": {},
    }
    if rng.random() < 0.3 and name not in ("spherical-3-rrr", "exechon"):
        tables["tolerance"] = {"joint_centre": float(size * rng.choice([1e-5, 1e-4, 1e-3]))}
    tables["workspace"] = {"position": place, "rotation": rotation}
    return tables


def built(name: str, values: dict[str, float]) -> Robot:
    """Return the robot of a case's dimensions, degrees."""
    items = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))["dimensions"]
    return Robot(
        name, {key: np.radians(each) if items[key].get("kind") == "angle" else each for key, each in values.items()}
    )


class Sampled:
    """Closed poses of a workspace and machines, with the numbers there."""

    def __init__(self, tables: Tables, rng: np.random.Generator) -> None:
        self.robot, self.box, self.rng = (
            built(tables["robot"]["model"], tables["robot"]["parameters"]),
            Box(tables),
            rng,
        )
        self.t = tables.get("tolerance", {}).get("joint_centre", 0.0)
        (task,) = tables["task"]
        self.chi = twist_of(task)

    def at(self, u: Array, errors: Array) -> tuple[dict[str, Array], Array]:
        """Return numbers at coordinates, and which are those of closed poses of the workspace."""
        return self.at_poses(self.box.poses(u), errors)

    def at_poses(self, meant: Poses, errors: Array) -> tuple[dict[str, Array], Array]:
        """Return numbers at poses whose loops are closed along ways from home through the middle of the workspace."""
        points = self.robot.points_array + errors
        poses, q, good = self.closed(meant, points)
        self.poses = poses
        return self.values(poses, q, points), good & self.inside(poses)

    def closed(self, meant: Poses, points: Array) -> tuple[Poses, Array, Array]:
        """Return closed poses, joint coordinates and whether each is closed, along such ways."""
        n, robot = len(meant.p), self.robot
        middle = self.box.poses(np.full((1, self.box.size), 0.5))
        # From home to the middle, and on to each pose, in equal steps of both numbers of a pose.
        way = [between(Poses(robot.home[None], np.eye(3)[None]), middle, s) for s in np.linspace(0, 1, STEPS + 1)[1:]]
        path = [Poses(np.repeat(each.p, n, 0), np.repeat(each.R, n, 0)) for each in way]
        path += [between(path[-1], meant, s) for s in np.linspace(0, 1, STEPS + 1)[1:]]
        path += path[-1:]  # what a pose gave way to joints that were far from closed is taken back
        return close(robot, path, points)

    def values(self, poses: Poses, q: Array, points: Array) -> dict[str, Array]:
        """Return the numbers of machines at closed poses with joint coordinates."""
        robot = self.robot
        values = numbers(robot, poses, q, points, self.chi)
        for k, (label, which) in enumerate(robot.labels):
            word = "length" if robot.slides[k] else "angle"
            if k in robot.actuated:
                values[f"actuator_{word} limb {label.partition(':')[0]}"] = q[:, k]
            if label:
                values[f"joint.{label}{('', ' first', ' second')[which + 1]}"] = q[:, k]
        for k in range(values["shares"].shape[1]):
            values[f"rate_share limb {k + 1}"] = values["shares"][:, k]
        return values

    def inside(self, poses: Poses) -> Array:
        """Return which poses (N,) are in the workspace, up to rounding."""
        length, turn = self.box.outside(poses)
        return np.asarray((length < 1e-9) & (turn < 1e-7))

    def errors(self, count: int) -> Array:
        found = self.rng.normal(size=(count, *self.robot.points_array.shape))
        return self.t * found / np.linalg.norm(found, axis=2, keepdims=True)


def between(one: Poses, other: Poses, s: float) -> Poses:
    """Return the poses at a part of the way."""
    Q = other.R @ np.swapaxes(one.R, 1, 2)
    v = np.stack([Q[:, 2, 1] - Q[:, 1, 2], Q[:, 0, 2] - Q[:, 2, 0], Q[:, 1, 0] - Q[:, 0, 1]], 1)
    angle = np.arctan2(np.linalg.norm(v, axis=1) / 2, (np.trace(Q, axis1=1, axis2=2) - 1) / 2)
    return Poses(one.p + s * (other.p - one.p), turned(v, s * angle) @ one.R)


def limited(rng: np.random.Generator, tables: Tables) -> Tables:
    """Return a case with limits about the values at random poses of its workspace."""
    sampled = Sampled(tables, rng)
    values, inside = sampled.at(sampled.box.sample(rng, 64), np.zeros((64, *sampled.robot.points_array.shape)))
    if not inside.any():
        return tables
    limits: Tables = {}

    def end(name: str, *, largest: bool) -> float:
        found = values[name][inside]
        low, high = found.min(), found.max()
        at, way = (high, 1) if largest else (low, -1)
        return float(at + way * (high - low + 1e-3) * rng.choice([-0.05, 0.002, 0.03, 0.2, 1.0]))

    names = [each for each in values if each.startswith("joint.")]
    for name in rng.permutation(names)[: rng.integers(0, 4)].tolist():
        key, _, which = name.removeprefix("joint.").partition(" ")
        unit = (
            1.0
            if sampled.robot.slides[
                [f"joint.{a}{('', ' first', ' second')[b + 1]}" for a, b in sampled.robot.labels].index(name)
            ]
            else np.pi / 180
        )
        ends = {side: end(name, largest=side == "max") / unit for side in ("min", "max") if rng.random() < 0.7}
        if (
            not ends
            or any(abs(each) > 175 for each in ends.values())
            or (len(ends) == 2 and not ends["min"] < ends["max"])
        ):
            continue
        limits[f'joint."{key}"'] = {which: ends} if which else ends
    drives = [each for each in values if each.startswith("actuator_")]
    if rng.random() < 0.5:
        kind = drives[0].split(" ")[0]
        unit = np.pi / 180 if kind == "actuator_angle" else 1.0
        limits[kind] = {"max": max(end(each, largest=True) for each in drives if each.startswith(kind)) / unit}
    if rng.random() < 0.3:
        limits["rate_share"] = {"max": float(np.clip(end("rate_share limb 1", largest=True), 0.05, 0.99))}
    return tables | {"limits": limits}


def judge_gallery(tables: Tables, result: Tables, rng: np.random.Generator) -> tuple[Counter[str], list[str]]:
    """Attack the claims of a result."""
    counts, faults, name = Counter[str](), [], tables["robot"]["model"]
    sampled = Sampled(tables, rng)
    count = POSES if sampled.t == 0 else POSES // 2
    u, errors = sampled.box.sample(rng, count), sampled.errors(count)
    values, inside = sampled.at(u, errors)
    built = " with tolerance" if sampled.t else ""
    counts["poses"] += int(inside.sum())
    middle, _ = sampled.at(np.full((1, sampled.box.size), 0.5), 0 * errors[:1])
    for key, matrix in (("regular", "locked"), ("constraints", "free")):
        if key not in result:
            continue
        verdict = result[key]
        counts[f"{name}: {key} {verdict['outcome']}{built}"] += 1
        rank = int((middle[matrix][0] > 1e-9).sum())
        if verdict["outcome"] == "proved":

            def least(v: Array, e: Array, matrix: str = matrix, rank: int = rank) -> Array:
                found, good = sampled.at(v, e)
                return np.where(good, found[matrix][:, rank - 1] / found[matrix][:, 0], np.inf)

            signs = set(np.sign(values[f"{matrix} sign"][inside]).tolist()) if f"{matrix} sign" in values else set()
            if len(signs) > 1:
                faults.append(f"{key} is proved, and determinants have both signs")
            at = np.where(inside, values[matrix][:, rank - 1] / values[matrix][:, 0], np.inf)
            value = descend(sampled, u, errors, at, least)
            if value < 1e-9:
                faults.append(f"{key} is proved, and the least singular value is {value:.2e}")
            if rank < 6 and key == "regular":
                faults.append("regular is proved, and the middle is singular")
        elif verdict["outcome"] == "refuted":
            found, good = sampled.at_poses(pose_of(verdict["pose"], sampled.box.unit), machine(sampled, verdict))
            at = found[matrix][0, (6 if key == "regular" else rank) - 1] / found[matrix][0, 0]
            if not (good[0] and at < 1e-6):
                faults.append(f"{key} is refuted, and the ratio there is {at:.2e}, closed and inside: {good[0]}")
    near = []
    for k, each in enumerate(result["extremes"]):
        sign, scale = 1.0 if each["sense"] == "max" else -1.0, sampled.box.unit if each["unit"] == "deg" else 1.0
        own = (
            "F"
            if each["name"].startswith("F")
            else re.sub(
                r"(joint\.\S+?)(\.first|\.second)? joint .*",
                lambda m: m[1] + (m[2] or "").replace(".", " "),
                each["name"],
            )
        )
        counts[f"{name}: {re.split(' limb|joint|actuator ', own)[0] or 'joint'} {each['outcome']}{built}"] += 1
        if own not in values or not inside.any():
            counts[f"not judged: {re.sub('[0-9:]+', '', own)}"] += 1
            continue
        found = float((sign * values[own][inside]).max() * sign)
        slack = 1e-8 * (abs(found) + 1e-2)
        if each["bound"] is not None:
            if sign * (found - each["bound"] * scale) > slack:
                faults.append(
                    f"{each['name']} {each['sense']}: bound {each['bound'] * scale:.12g}, sampled {found:.12g}"
                )
            near.append((sign * (each["bound"] * scale - found), k, own))
        if each["outcome"] == "proved" and "limit" in each and sign * (found - each["limit"] * scale) > slack:
            faults.append(
                f"{each['name']} {each['sense']}: proved within {each['limit'] * scale:.12g}, sampled {found:.12g}"
            )
        if each["pose"] is not None:
            there, good = sampled.at_poses(pose_of(each["pose"], sampled.box.unit), machine(sampled, each))
            if not good[0] or abs(there[own][0] - each["reached"] * scale) > 1e-5 * (abs(found) + 1e-1):
                word = "REFUTED" if each["outcome"] == "refuted" else "reached"
                said = f"{each['name']} {each['sense']}: {word} {each['reached'] * scale:.12g}"
                faults.append(f"{said}, and {there[own][0]:.12g} there, closed and inside: {good[0]}")
    near.sort()
    for _, k, own in near[:2]:
        each = result["extremes"][k]
        sign, scale = 1.0 if each["sense"] == "max" else -1.0, sampled.box.unit if each["unit"] == "deg" else 1.0

        def value_of(v: Array, e: Array, own: str = own, sign: float = sign) -> Array:
            found, good = sampled.at(v, e)
            return np.where(good, -sign * found[own], np.inf)

        value = -descend(sampled, u, errors, np.where(inside, -sign * values[own], np.inf), value_of)
        counts["descents"] += 1
        if value - sign * each["bound"] * scale > 1e-8 * (abs(value) + 1e-2):
            faults.append(
                f"{each['name']} {each['sense']}: bound {each['bound'] * scale:.12g}, descent {sign * value:.12g}"
            )
    return counts, faults


def machine(sampled: Sampled, found: Tables) -> Array:
    """Return the errors (1, centres, 3) of a result's machine."""
    own = np.zeros((1, *sampled.robot.points_array.shape))
    robot = sampled.robot
    for each in found.get("machine", {}).get("centres", ()):
        for chain in robot.chains:
            for turn in chain.turns:
                end = ", other end" if turn.factor < 0 else ""
                if robot.places[turn.coordinate] + end == each["joint"]:
                    own[0, turn.centre] = each["error"]
    return own


def descend(sampled: Sampled, u: Array, errors: Array, at: Array, function: Any) -> float:  # noqa: ANN401
    """Return the least value of a function of coordinates and errors, by shrinking samples about the best ones."""
    best = np.argsort(at)[:4]
    u, errors, at, width = u[best], errors[best], at[best], 0.15
    for _ in range(8):
        v = np.clip(np.repeat(u, 6, 0) + width * sampled.rng.normal(size=(6 * len(u), u.shape[1])), 0, 1)
        e = np.repeat(errors, 6, 0) + 2 * width * sampled.errors(6 * len(u))
        e *= np.minimum(1, sampled.t / np.maximum(np.linalg.norm(e, axis=2, keepdims=True), 1e-300))
        u, errors, at = np.concatenate([u, v]), np.concatenate([errors, e]), np.concatenate([at, function(v, e)])
        best = np.argsort(at)[:4]
        u, errors, at, width = u[best], errors[best], at[best], 0.5 * width
    return float(at[0])


def examine(seed: int) -> Row:
    """Judge a random workspace of a robot, and attack what is claimed."""
    rng = np.random.default_rng(seed)
    tables = limited(rng, random_gallery(rng, NAMES[seed % len(NAMES)]))
    words = ["--gap", str(rng.choice([0.3, 0.1, 0.02])), "--time", str(rng.choice([6, 12])), "--jobs", "1"]
    result, row = judged(text_of(tables), *words)
    if result is None:
        return row
    counts, faults = judge_gallery(tables, result, rng)
    return {"counts": counts, "faults": faults}


if __name__ == "__main__":
    campaign(examine)
