"""Random workspaces of straight legs: proved claims attacked by samples and descents, refuting poses evaluated.

    python bench/soundness/workspaces.py COUNT FIRST [JOURNAL]

Six legs of two robots, and ``three-upu``; the robots of the gallery are in ``gallery.py``.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np
from campaign import Row, campaign, judged
from legs import Array, Box, Legs, pose_of, turned
from randomcases import limited_legs, random_legs, text_of

POSES, DESCENTS, ROUNDING = 2048, 10, 1e-9


class Machines:
    """Random poses and machines of a case: coordinates of both, and their numbers."""

    def __init__(self, tables: dict[str, Any], rng: np.random.Generator) -> None:
        self.legs, self.box, self.rng = Legs(tables), Box(tables), rng
        self.t = tables.get("tolerance", {}).get("joint_centre", 0.0)

    def errors_along(self, u: Array, sign: Array) -> Array:
        """Return errors (N, 2, m, 3) that make each leg longer or shorter by twice the tolerance."""
        p, R = self.box.poses(u)
        d = p[:, None] + np.einsum("nij,kj->nki", R, self.legs.platform) - self.legs.base
        n = self.t * sign[:, :, None] * d / np.linalg.norm(d, axis=2, keepdims=True)
        return np.stack([-n, np.einsum("nji,nkj->nki", R, n)], 1)

    def within(self, errors: Array) -> Array:
        """Return errors no larger than the tolerance."""
        size = np.linalg.norm(errors, axis=-1, keepdims=True)
        return errors * np.minimum(1.0, self.t / np.maximum(size, 1e-300))

    def sample(self, count: int) -> tuple[Array, Array]:
        u, m = self.box.sample(self.rng, count), len(self.legs.names)
        errors = self.rng.normal(size=(count, 2, m, 3))
        errors *= self.t / np.linalg.norm(errors, axis=-1, keepdims=True)
        along = self.errors_along(u, self.rng.choice([-1.0, 1.0], (count, m)))
        errors[::2] = along[::2]
        return u, errors

    def values(self, u: Array, errors: Array, name: str = "") -> dict[str, Array]:
        poses = self.box.poses(u)
        if name.startswith("leg_clearance"):
            return {name: self.legs.clearance(name, poses, errors[:, 0], errors[:, 1])}
        return self.legs.values(poses, errors[:, 0], errors[:, 1])

    def descend(self, name: str, sign: float, u: Array, errors: Array) -> tuple[float, Array, Array]:
        """Return the largest value of a number times a sign, from the best of some points, with its point."""
        at = sign * self.values(u, errors, name)[name]
        best = np.argsort(-at)[:8]
        u, errors, at = u[best], errors[best], at[best]
        width = 0.2
        for _ in range(28):
            v = np.clip(
                np.repeat(u, 8, 0)
                + width
                * self.rng.normal(size=(8 * len(u), u.shape[1]))
                * (self.rng.random((8 * len(u), u.shape[1])) < 0.6),
                0,
                1,
            )
            e = self.within(
                np.repeat(errors, 8, 0) + 2 * width * self.t * self.rng.normal(size=(8 * len(u), *errors.shape[1:]))
            )
            values = sign * self.values(v, e, name)[name]
            u, errors, at = np.concatenate([u, v]), np.concatenate([errors, e]), np.concatenate([at, values])
            best = np.argsort(-at)[:8]
            u, errors, at = u[best], errors[best], at[best]
            width *= 0.75
        return float(at[0]), u[0], errors[0]


def value_name(extreme: dict[str, Any]) -> str:
    """Return the name of a result's number in :meth:`Legs.values`: without a limit angles are from plates' normals."""
    name = extreme["name"]
    return f"of{name}" if re.match("(base|platform)_joint_angle", name) and "key" not in extreme else name


def strokes(machines: Machines, name: str, u: Array, errors: Array, lengths: Array) -> float:
    """Return the worst stroke, or least room for a dead length, of machines made for two poses of the leg."""
    legs = machines.legs
    k = legs.names.index(name.rsplit(maxsplit=1)[-1])
    worst = np.inf if "dead_length" in name else -np.inf
    for low, high in ((np.argmin(lengths), np.argmax(lengths)), *machines.rng.integers(len(u), size=(4, 2))):
        both = np.stack([u[low], u[high]])
        p, R = machines.box.poses(both)
        d = p + np.einsum("nij,j->ni", R, legs.platform[k]) - legs.base[k]
        n = d / np.linalg.norm(d, axis=1, keepdims=True)
        way = (2.0, 1.0) if "dead_length" in name else (1.0, 1.0)
        own = np.zeros_like(errors[:1])
        for plate, turn in ((0, -n), (1, np.einsum("nji,nj->ni", R, n))):
            wish = way[1] * turn[1] - way[0] * turn[0]
            own[0, plate, k] = machines.t * wish / max(np.linalg.norm(wish), 1e-300)
        sampled = machines.values(u, np.broadcast_to(own, errors.shape))[f"leg_length limb {legs.names[k]}"]
        if "dead_length" in name:
            worst = min(worst, 2 * sampled.min() - sampled.max())
        else:
            worst = max(worst, sampled.max() - sampled.min())
    return float(worst)


def pose_errors(machines: Machines, leg_error: float, u: Array) -> tuple[float, float]:
    """Return the largest errors in position and rotation of random machines, and of those with the worst signs."""
    legs, rng = machines.legs, machines.rng
    u = np.concatenate([u, u])
    p, R = machines.box.poses(u)
    arms = np.einsum("nij,kj->nki", R, legs.platform)
    d = p[:, None] + arms - legs.base
    lengths = np.linalg.norm(d, axis=2)
    n = d / lengths[:, :, None]
    inverse = np.linalg.inv(np.concatenate([n, np.cross(arms, n)], 2))
    w = rng.normal(size=(len(u), 3))
    part = np.where(np.arange(len(u))[:, None, None] < len(u) // 2, inverse[:, :3], inverse[:, 3:])
    sign = np.sign(np.einsum("ni,nij->nj", w, part))
    for _ in range(4):  # the worst signs of a direction, and the direction of these signs
        way = np.einsum("nij,nj->ni", part, sign)
        sign = np.sign(np.einsum("ni,nij->nj", way, part))
    errors = machines.errors_along(u, -sign)
    target = lengths + leg_error * sign
    q, Q = p.copy(), R.copy()
    for _ in range(12):
        arms = np.einsum("nij,nkj->nki", Q, legs.platform + errors[:, 1])
        d = q[:, None] + arms - legs.base - errors[:, 0]
        now = np.linalg.norm(d, axis=2)
        n = d / now[:, :, None]
        step = np.linalg.solve(np.concatenate([n, np.cross(arms, n)], 2), (target - now)[:, :, None])[:, :, 0]
        q = q + step[:, :3]
        Q = turned(step[:, 3:], np.linalg.norm(step[:, 3:], axis=1)) @ Q
    good = (abs(target - now).max(1) < 1e-9 * now.max()) & (np.linalg.norm(step, axis=1) < 1e-8)
    D = np.swapaxes(R, 1, 2) @ Q
    turn = (
        np.linalg.norm(np.stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]], 1), axis=1)
        / 2
    )
    near = good & (np.linalg.norm(q - p, axis=1) < 0.2 * now.min())
    if not near.any():
        return 0.0, 0.0
    return float(np.linalg.norm(q - p, axis=1)[near].max()), float(np.arcsin(np.minimum(turn, 1))[near].max())


def judge_legs(
    tables: dict[str, Any], result: dict[str, Any], rng: np.random.Generator, leg_error: float
) -> tuple[Counter[str], list[str]]:
    """Attack the claims of a result about straight legs."""
    machines, counts, faults = Machines(tables, rng), Counter[str](), []
    legs, box, robot = machines.legs, machines.box, tables["robot"]["model"]
    u, errors = machines.sample(POSES)
    if machines.t == 0:
        errors[:] = 0
    sampled = machines.values(u, errors)
    regular, reach = result["regular"], float(np.abs(legs.platform).max())
    counts[f"{robot}: regular {regular['outcome']}{' with tolerance' if machines.t else ''}"] += 1

    def machine_of(found: dict[str, Any]) -> Array:
        own = np.zeros((1, 2, len(legs.names), 3))
        if "machine" in found:
            machine = found["machine"]
            if "base" in machine:
                own[0] = machine["base"], machine["platform"]
            else:
                for each in machine["centres"]:
                    name, plate = each["joint"].split()
                    own[0, ("base", "platform").index(plate), legs.names.index(name)] = each["error"]
        if np.linalg.norm(own, axis=-1).max() > machines.t * (1 + 1e-9):
            faults.append(f"{found.get('name', 'regular')}: the machine is beyond the tolerance")
        return own

    if regular["outcome"] == "proved":
        value, v, e = machines.descend("regular", -1.0, u, errors)
        signs = {float(np.sign(each)) for each in sampled["det"]}
        signs.add(float(np.sign(machines.values(v[None], e[None])["det"][0])))
        if len(signs) > 1 or -value < 1e-10:
            faults.append(f"regular is proved, and signs are {signs}, the least singular value {-value:.2e}")
    elif regular["outcome"] == "refuted":
        poses, own = pose_of(regular["pose"], box.unit), machine_of(regular)
        value = legs.values(poses, own[:, 0], own[:, 1])["regular"][0]
        if value > 1e-7 or not box.has(regular["pose"]):
            faults.append(f"regular is refuted, and the ratio there is {value:.2e}, inside: {box.has(regular['pose'])}")
        if "between" in regular:
            one, other = (legs.values(pose_of(each, box.unit))["det"][0] for each in regular["between"])
            if not one * other < 0:
                faults.append(f"regular is refuted between poses with determinants {one:.2e} and {other:.2e}")
    order = rng.permutation(len(result["extremes"]))
    near: list[tuple[float, int]] = []
    for k in order:
        each = result["extremes"][k]
        name, sign = each["name"], 1.0 if each["sense"] == "max" else -1.0
        kind = re.split(" limb| limbs|:| actuator | base | platform | of ", name)[0]
        kind = "F" if name.startswith("F") else kind
        counts[f"{robot}: {kind} {each['outcome']}"] += 1
        scale = box.unit if each["unit"] in ("deg", "rad") else 1.0
        bound = None if each["bound"] is None else each["bound"] * scale
        if name in (
            "position error",
            "rotation error",
            "leg_clearance.min",
            "actuator.stroke_max",
            "actuator.dead_length",
        ):
            continue
        if name.startswith("actuator."):
            found = strokes(machines, name, u, errors, sampled[f"leg_length limb {name.split()[-1]}"])
        elif name.startswith("leg_clearance"):
            found = float((sign * machines.values(u, errors, name)[name]).max() * sign)
        else:
            if value_name(each) not in sampled:
                counts[f"not judged: {name}"] += 1
                continue
            found = float((sign * sampled[value_name(each)]).max() * sign)
        slack = ROUNDING * (abs(found) + (1e-3 if each["unit"] in ("deg", "rad") else 0.0)) + 1e-14
        if bound is not None and sign * (found - bound) > slack:
            faults.append(f"{name} {each['sense']}: bound {bound:.12g}, sampled {found:.12g}")
        elif bound is not None and not name.startswith("actuator."):
            near.append((sign * (bound - found) / max(abs(found), 1e-9), int(k)))
        if each["pose"] is not None and not name.startswith("actuator."):
            own = machine_of(each)
            poses = pose_of(each["pose"], box.unit)
            there = (
                legs.clearance(name, poses, own[:, 0], own[:, 1])
                if "clearance" in name
                else legs.values(poses, own[:, 0], own[:, 1])[value_name(each)]
            )
            off = abs(there[0] - each["reached"] * scale)
            if off > 1e-6 * (abs(there[0]) + (1e-2 if scale != 1 else 0)) + 1e-7 * reach or not box.has(each["pose"]):
                said = f"{name} {each['sense']}: reached {each['reached'] * scale:.12g}"
                faults.append(f"{said}, and {there[0]:.12g} there, inside: {box.has(each['pose'])}")
        if each["outcome"] == "refuted" and not sign * (each["reached"] - each["limit"]) > 0:
            faults.append(f"{name} {each['sense']}: refuted by {each['reached']}, with the limit {each['limit']}")
        if (
            each["outcome"] == "proved"
            and "limit" in each
            and sign * (found - each["limit"] * scale) > 2 * ROUNDING * abs(each["limit"] * scale) + 1e-14
        ):
            faults.append(f"{name} {each['sense']}: proved within {each['limit'] * scale:.12g}, sampled {found:.12g}")
    near.sort()
    for _, k in near[: DESCENTS // 2] + [near[j] for j in rng.permutation(len(near))[: DESCENTS // 2]]:
        each = result["extremes"][k]
        sign, scale = 1.0 if each["sense"] == "max" else -1.0, box.unit if each["unit"] in ("deg", "rad") else 1.0
        value, _, _ = machines.descend(value_name(each), sign, u[:512], errors[:512])
        counts["descents"] += 1
        if value - sign * each["bound"] * scale > ROUNDING * (abs(value) + (1e-3 if scale != 1 else 0.0)) + 1e-14:
            faults.append(
                f"{each['name']} {each['sense']}: bound {each['bound'] * scale:.12g}, descent {sign * value:.12g}"
            )
    bounds = {each["name"]: each for each in result["extremes"] if each["name"] in ("position error", "rotation error")}
    if bounds and all(each["bound"] is not None for each in bounds.values()):
        found = pose_errors(machines, leg_error, u[:512])
        for name, value in zip(("position error", "rotation error"), found, strict=True):
            scale = box.unit if name[0] == "r" else 1.0
            if value > bounds[name]["bound"] * scale * (1 + ROUNDING):
                faults.append(f"{name}: bound {bounds[name]['bound'] * scale:.12g}, sampled {value:.12g}")
    return counts, faults


def examine(seed: int) -> Row:
    """Judge a random workspace, and attack what is claimed."""
    rng = np.random.default_rng(seed)
    tables = limited_legs(rng, random_legs(rng))
    leg_error = 0.0
    words = ["--gap", str(rng.choice([0.3, 0.1, 0.02])), "--time", str(rng.choice([8, 15])), "--jobs", "1"]
    if tables["robot"]["model"] != "three-upu" and rng.random() < 0.25:
        leg_error = float(np.abs(Legs(tables).platform).max() * rng.choice([1e-4, 1e-3]))
        words += ["--leg-error", repr(leg_error)]
    for name in ("base_joint_angle", "platform_joint_angle", "condition_number", "smallest_singular_value"):
        if rng.random() < 0.15:
            words += ["--quantity", name]
    result, row = judged(text_of(tables), *words)
    if result is None:
        return row
    counts, faults = judge_legs(tables, result, rng, leg_error)
    return {"counts": counts, "faults": faults}


if __name__ == "__main__":
    campaign(examine)
