"""Random programmed paths: proved claims attacked by dense samples of every segment, refuting points evaluated.

    python bench/soundness/paths.py COUNT FIRST [JOURNAL]

Two of three paths are those of straight legs, with arithmetic of ``legs.py``; the others those of robots of the gallery
with that of ``robots.py``. Not judged are clearances of links, and what needs loads.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from campaign import Row, campaign, command
from gallery import Sampled, limited, random_gallery
from legs import Array, Legs, Poses, turned
from randomcases import limited_legs, random_legs, text_of
from robots import follow
from workspaces import value_name

Tables = dict[str, Any]
Values = dict[str, Array]
#: Points of each segment; those of them whose loops are closed along a way from home, and from which the joints of the
#: others are followed; poses at once; steps of a descent; and the condition number from which on a pose is singular.
POINTS, FROM_HOME, BLOCK, STEPS = 10_000, 128, 512, 12
#: Part of a coordinate's size, or radians, by which it changes between points of one assembly at most.
FAR = 0.3
SINGULAR = 1e9
GALLERY = ("6-pus", "6-rss", "6-rus", "6-ups", "delta", "orthoglide", "planar-3-rrr", "planar-3-prr", "planar-3-rpr")
#: Of the programs, by minutes.
FEED = 100
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


class Segment(NamedTuple):
    """A line, or an arc about a centre (2,) in a plane; angles are radians."""

    start: Array
    end: Array
    plane: int = 0
    centre: Array = np.zeros(2)
    sweep: float = 0.0

    def at(self, s: Array) -> Array:
        """Return positions and angles (N, 6)."""
        found = self.start + s[:, None] * (self.end - self.start)
        if self.plane:
            first, second, _ = PLANES[self.plane]
            arm = self.start[[first, second]] - self.centre
            angle = np.arctan2(arm[1], arm[0]) + s * self.sweep
            found[:, first] = self.centre[0] + np.hypot(*arm) * np.cos(angle)
            found[:, second] = self.centre[1] + np.hypot(*arm) * np.sin(angle)
        return found

    def seconds(self, scale: float) -> float:
        """Return the time of the motion, with lengths of the case times a scale in those of the program."""
        way = self.end[:3] - self.start[:3]
        length = float(np.linalg.norm(way))
        if self.plane:
            first, second, along = PLANES[self.plane]
            radius = np.hypot(*(self.start[[first, second]] - self.centre))
            length = float(np.hypot(radius * self.sweep, way[along]))
        turn = float(np.linalg.norm(np.degrees(self.end[3:] - self.start[3:])))
        return 60 / FEED * (length * scale if length else turn)

    def line(self, scale: float) -> str:
        """Return the words of a program."""
        words = [f"{name}{value * scale!r}" for name, value in zip("XYZ", self.end[:3].tolist(), strict=True)]
        words += [f"{name}{value!r}" for name, value in zip("ABC", np.degrees(self.end[3:]).tolist(), strict=True)]
        if not self.plane:
            return " ".join(["G1", *words])
        first, second, _ = PLANES[self.plane]
        arm = (self.centre - self.start[[first, second]]) * scale
        offsets = [f"{'IJK'[axis]}{value!r}" for axis, value in zip((first, second), arm.tolist(), strict=True)]
        turns = int(np.ceil(abs(self.sweep) / (2 * np.pi) - 1e-9))
        return " ".join([f"G{self.plane}", "G3" if self.sweep > 0 else "G2", *words, *offsets, f"P{turns}"])


def random_path(rng: np.random.Generator, start: Array, half: Array) -> list[Segment]:
    """Return lines and arcs about a pose (6,), within some half ranges (6,) or a little more."""
    found, here = list[Segment](), start.copy()
    for _ in range(rng.integers(1, 6)):
        end = start + half * rng.uniform(-1, 1, 6) * (rng.random(6) < 0.8)
        plane, kind = int(rng.choice([17, 18, 19])), rng.random()
        first, second, _ = PLANES[plane]
        if kind < 0.5 or not (half[first] and half[second]):
            found.append(Segment(here, end))
        else:
            radius, angle = min(half[first], half[second]) * rng.uniform(0.1, 0.8), rng.uniform(-np.pi, np.pi)
            centre = here[[first, second]] - radius * np.array([np.cos(angle), np.sin(angle)])
            is_full, turns = kind > 0.9, int(rng.integers(0, 3)) * (rng.random() < 0.3)
            part = 2 * np.pi if is_full else rng.uniform(0.05, 2 * np.pi - 0.05)
            sweep = float((part + 2 * np.pi * turns) * rng.choice([-1, 1]))
            at = angle + sweep
            end[[first, second]] = (
                here[[first, second]] if is_full else centre + radius * np.array([np.cos(at), np.sin(at)])
            )
            found.append(Segment(here, end, plane, centre, sweep))
        here = end
    return found


def poses_of(points: Array) -> Poses:
    """Return the poses of positions and angles (N, 6)."""
    about = [turned(np.broadcast_to(axis, (len(points), 3)), points[:, 3 + k]) for k, axis in enumerate(np.eye(3))]
    return Poses(points[:, :3], about[2] @ about[1] @ about[0])


def boxed(tables: Tables, path: list[Segment], unit: float) -> Tables:
    """Return a case with the box of a path as its workspace, about which limits are chosen."""
    points = np.concatenate([each.at(np.linspace(0, 1, 65)) for each in path])
    low, high = points.min(axis=0), points.max(axis=0)
    low[3:], high[3:] = low[3:] / unit, high[3:] / unit
    ends = [{"min": a, "max": b} if b > a else a for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    if not any(isinstance(each, dict) for each in ends):
        ends[0] = {"min": ends[0], "max": ends[0] + 1e-9}
    rotation = dict(zip(("roll", "pitch", "yaw"), ends[3:], strict=True))
    return tables | {"workspace": {"position": ends[:3], "rotation": rotation}}


def judged_path(tables: Tables, path: list[Segment], rng: np.random.Generator) -> tuple[Any, Row]:
    """Return the result of ``path``, or None and the row of a seed without one."""
    label = tables.get("units", {}).get("length", "m")
    scale = {"m": 1000.0, "mm": 1.0, "in": 1.0}[label]
    tables = tables | {"units": tables.get("units", {}) | {"length": label}}
    begin = Segment(path[0].start, path[0].start)
    lines = [f"{'G20' if label == 'in' else 'G21'} G90 G94 F{FEED}", begin.line(scale)]
    lines += [each.line(scale) for each in path]
    with tempfile.TemporaryDirectory() as folder:
        case, program, out = (Path(folder) / name for name in ("case.toml", "part.ngc", "result.json"))
        case.write_text(text_of(tables), encoding="utf-8")
        program.write_text("\n".join([*lines, "M2", ""]), encoding="utf-8")
        words = ["--time", str(rng.choice([8, 15])), "--gap", str(rng.choice([0.1, 0.01, 1e-3]))]
        code, _, err = command("path", str(case), "--along", str(program), *words, "--json", str(out))
        if out.exists():
            seconds = [each.seconds(scale) for each in path]
            return json.loads(out.read_text(encoding="utf-8")) | {"status": code, "seconds": seconds}, {}
    if code == 2:
        return None, {"counts": {f"refused: {err.strip()[-60:]}": 1}, "faults": []}
    return None, {"counts": {"failed": 1}, "faults": [err]}


class Attack:
    """Numbers at points of a path.

    Args:
        path: its segments.
        values: returns numbers (N,) at parameters of a segment, NaN where the robot has none, of the design or another
            machine.
        unit: radians of the case's unit of angles.
        is_design: whether the design alone is meant.
    """

    def __init__(
        self,
        path: list[Segment],
        values: Callable[[int, Array, int], Values],
        unit: float,
        *,
        is_design: bool = True,
    ) -> None:
        self.at, self.unit, self.is_design = values, unit, is_design
        self.s = np.linspace(0, 1, POINTS)
        self.sampled = [self.at(k, self.s, 1) for k in range(len(path))]

    def largest(self, name: str, sign: float) -> float:
        """Return the largest value times a sign, by a descent from the best samples; -inf without one."""
        every = np.array([np.nan_to_num(sign * each[name], nan=-np.inf).max() for each in self.sampled])
        k, best = int(np.argmax(every)), float(every.max())
        middle = self.s[int(np.argmax(np.nan_to_num(sign * self.sampled[k][name], nan=-np.inf)))]
        width = 2 * self.s[1]
        for _ in range(STEPS):
            s = np.clip(middle + width * np.linspace(-1, 1, 17), 0, 1)
            found = np.nan_to_num(sign * self.at(k, s, 1)[name], nan=-np.inf)
            middle, width = s[int(np.argmax(found))], width / 4
            best = max(best, float(found.max()))
        return best

    def speed(self, actuator: str, seconds: list[float]) -> float:
        """Return the largest mean speed between samples, of an actuator whose coordinates are known; -inf of others."""
        best = -np.inf
        for values, time in zip(self.sampled, seconds, strict=True):
            for quantity in ("leg_length", "actuator_length", "actuator_angle"):
                own = values.get(f"{quantity} limb {actuator}")
                if own is not None:
                    best = max(best, np.nanmax(np.abs(np.diff(own)), initial=-np.inf) * (len(own) - 1) / time)
        return float(best)

    def value(self, name: str, place: Tables) -> float:
        """Return the number of the design at a place of a result."""
        return float(self.at(place["segment"], np.array([place["parameter"]]), 0)[name][0])


def judge(attack: Attack, result: Tables, label: str) -> tuple[Counter[str], list[str]]:
    """Attack the claims of a result."""
    counts, faults = Counter[str](), list[str]()
    proved = True
    for each in result["path"]["claims"]:
        name, sense, outcome = each["name"], each.get("sense"), each["outcome"]
        kind = re.split(r" limb|joint|actuator |:", name)[0] or "joint"
        counts[f"{label}: {kind} {outcome}"] += 1
        proved &= outcome == "proved" or (sense is not None and "limit" not in each)
        if name.startswith("reach limb") and name in attack.sampled[0]:
            missed = sum(int((values[name] < 1).sum()) for values in attack.sampled)
            if outcome == "proved" and missed:
                faults.append(f"{name} is proved, and {missed} points are not closed")
            if outcome == "refuted" and attack.value(name, each):
                faults.append(f"{name} is refuted, and closed there")
            continue
        if sense is None:
            own = "regular" if name == "regular" else "constraints"
            if own not in attack.sampled[0]:
                continue
            if outcome == "proved":
                least = -attack.largest(own, -1.0)
                dets = np.concatenate([values["det"] for values in attack.sampled]) if own == "regular" else np.ones(1)
                signs = set(np.sign(dets[np.isfinite(dets)]).tolist())
                if least < 1e-10 or len(signs) > 1:
                    faults.append(f"{name} is proved, and the least singular value is {least:.2e}, signs {signs}")
            elif outcome == "refuted" and not attack.value(own, each) < 1e-6:
                faults.append(f"{name} is refuted, and the singular value there is {attack.value(own, each):.2e}")
            continue
        own = value_name(each | ({"key": 1} if "limit" in each else {}))
        own = re.sub(r"(joint\.\S+?)(\.first|\.second)? joint .*", lambda m: m[1] + (m[2] or "").replace(".", " "), own)
        sign, scale = 1.0 if sense == "max" else -1.0, attack.unit if each["unit"] in ("deg", "rad") else 1.0
        if own.startswith(("actuator.stroke_max", "actuator.dead_length")) and "limb" in own:
            lengths = [attack.largest(f"leg_length limb {name.split()[-1]}", way) for way in (1.0, -1.0)]
            long, short = lengths[0], -lengths[1]
            found = sign * (long - short if "stroke" in own else 2 * short - long)
        elif own.startswith("actuator_speed"):
            found = attack.speed(name.removeprefix("actuator_speed actuator "), result["seconds"])
            scale = attack.unit if each["unit"].startswith(("deg", "rad")) else 1.0
            counts[f"speeds of {label}: {'not ' * (not np.isfinite(found))}sampled"] += 1
            if np.isfinite(found) and outcome == "proved":
                counts[f"speeds proved within {'2 %' if each['bound'] * scale <= 1.02 * found else 'more'}"] += 1
        elif own not in attack.sampled[0]:
            counts[f"not judged: {re.sub('[0-9:+-]+', '', own)}"] += 1
            continue
        else:
            found = attack.largest(own, sign)
            # A condition number of a singular pose is rounding alone, and of machines the worst one reaches the value.
            if each["segment"] is not None and abs(each["reached"]) < SINGULAR and attack.is_design:
                there = attack.value(own, each)
                if not abs(there - each["reached"] * scale) <= 1e-6 * (abs(found) + 1e-2):
                    faults.append(f"{name} {sense}: reached {each['reached']}, and {there / scale} there")
            fault = each.get("fault")
            if (
                fault
                and attack.is_design
                and not sign * (attack.value(own, fault) - each["limit"] * scale) > -1e-9 * abs(found)
            ):
                faults.append(f"{name} {sense}: a fault of {fault['value']}, {attack.value(own, fault) / scale} there")
        if outcome == "refuted" and not (each.get("fault") and sign * (each["reached"] - each["limit"]) > 0):
            faults.append(f"{name} {sense}: refuted by {each['reached']} with the limit {each['limit']}")
        slack = 1e-8 * (abs(found) + 1e-2) if np.isfinite(found) else 0.0
        if each["bound"] is not None and found - sign * each["bound"] * scale > slack:
            faults.append(f"{name} {sense}: bound {each['bound'] * scale:.12g}, sampled {sign * found:.12g}")
        if outcome == "proved" and "limit" in each and found - sign * each["limit"] * scale > slack:
            faults.append(f"{name} {sense}: proved within {each['limit'] * scale:.12g}, sampled {sign * found:.12g}")
    if result["proved"] != proved or result["status"] != (0 if proved else 1):
        faults.append(f"proved is {result['proved']}, exit status {result['status']}")
    return counts, faults


def of_legs(tables: Tables, path: list[Segment]) -> Callable[[int, Array, int], Values]:
    """Return the numbers of straight legs; those of machine 1 are at the edge of the tolerance."""
    legs, t = Legs(tables), tables.get("tolerance", {}).get("joint_centre", 0.0)
    errors = np.random.default_rng(0).normal(size=(2, len(legs.names), 3))
    errors *= t / np.linalg.norm(errors, axis=2, keepdims=True)
    pairs = [f"leg_clearance limbs {a} and {b}" for k, a in enumerate(legs.names) for b in legs.names[k + 1 :]]

    def values(k: int, s: Array, machine: int) -> Values:
        poses = poses_of(path[k].at(s))
        found = legs.values(poses, *(machine * errors))
        if "leg_clearance" in legs.limits:
            found |= {name: legs.clearance(name, poses, *(machine * errors)) for name in pairs}
        return found

    return values


class Followed:
    """Numbers of the design of a gallery robot along a path: joints are followed from points closed from home."""

    def __init__(self, sampled: Sampled, path: list[Segment]) -> None:
        self.sampled, self.path, s = sampled, path, np.linspace(0, 1, FROM_HOME)
        self.known = []
        for each in path:
            poses = poses_of(each.at(s))
            _, q, _ = sampled.closed(poses, self._points(len(s)))
            # A pose that gave way to joints is taken back.
            self.known.append((s, *follow(sampled.robot, poses, q, self._points(len(s)))))

    def _points(self, count: int) -> Array:
        points = self.sampled.robot.points_array
        return np.broadcast_to(points, (count, *points.shape))

    def _start(self, k: int, s: Array) -> Array:
        """Return joints near those at parameters of a segment."""
        at, q, good = self.known[k]
        right = np.clip(np.searchsorted(at, s), 1, len(at) - 1)
        left = right - 1
        part, found = ((s - at[left]) / (at[right] - at[left]))[:, None], np.zeros((len(s), q.shape[1]))
        for limb, (_, own) in enumerate(self.sampled.robot.limbs):
            a, b = q[np.ix_(left, own)], q[np.ix_(right, own)]
            # At the edge of the reach, or where two closed points are of two assemblies, the nearer one tells.
            both = (
                good[left, limb] & good[right, limb] & (np.abs(a - b) < FAR * np.abs(q[:, own]).max(initial=1)).all(1)
            )
            is_left = good[left, limb] & ((part[:, 0] < 0.5) | ~good[right, limb])
            found[:, own] = np.where(both[:, None], a + part * (b - a), np.where(is_left[:, None], a, b))
        return found

    def __call__(self, k: int, s: Array, _: int) -> Values:
        robot, q, blocks = self.sampled.robot, self._start(k, s), []
        good = np.zeros((len(s), len(robot.limbs)), bool)
        for begin in range(0, len(s), BLOCK):
            rows = slice(begin, begin + BLOCK)
            poses = poses_of(self.path[k].at(s[rows]))
            points = self._points(len(poses.p))
            q[rows], good[rows] = follow(robot, poses, q[rows], points)
            blocks.append(self.sampled.values(poses, q[rows], points))
        if len(s) > len(self.known[k][0]):
            self.known[k] = s, q, good
        found = {name: np.concatenate([each[name] for each in blocks]) for name in blocks[0]}
        found["det"] = found.get("locked sign", np.ones(len(s)))
        found["regular"] = found["locked"][:, 5] / found["locked"][:, 0]
        values = {f"reach limb {limb + 1}": 1.0 * good[:, limb] for limb in range(len(robot.limbs))}
        for name, each in found.items():
            # The joints of a limb are those that its own loop closes by.
            limb = re.match(r"(?:joint\.|actuator_\w+ limb )(\d+)", name)
            closed = good[:, int(limb[1]) - 1] if limb else good.all(1)
            if np.ndim(each) == 1:
                values[name] = np.where(closed, each, np.nan)
        return values


def examine(seed: int) -> Row:
    """Judge a random path, and attack what is claimed."""
    rng = np.random.default_rng(seed)
    if seed % 3:
        tables = random_legs(rng)
        unit, home = Legs(tables).unit, np.array([*tables["pose"]["position"], 0, 0, 0])
        size, turn = rng.choice([0.02, 0.1, 0.4]) * home[2], np.radians(rng.choice([0, 4, 20, 80]))
        path = random_path(rng, home, np.repeat([size, turn], 3))
        tables = limited_legs(rng, boxed(tables, path, unit))
        label = tables["robot"]["model"] + " with tolerance" * ("tolerance" in tables)
        numbers: Callable[[int, Array, int], Values] = of_legs(tables, path)
    else:
        name = str(rng.choice(GALLERY))
        tables, unit = random_gallery(rng, name), np.pi / 180
        tables.pop("tolerance", None)
        home = np.array([*tables["pose"]["position"], 0, 0, 0])
        size = float(np.abs(Sampled(tables, rng).robot.points_array).max()) * rng.choice([0.01, 0.05, 0.15])
        turns = 1.0 if name.startswith("6") else np.array([0, 0, 1.0]) if name.startswith("planar") else 0.0
        flat = np.array([1, 1, 0.0]) if name.startswith("planar") else np.ones(3)
        half = np.concatenate([size * flat, np.radians(rng.choice([3, 15])) * turns * np.ones(3)])
        path = random_path(rng, home, half)
        tables = limited(rng, boxed(tables, path, unit))
        label, numbers = name, Followed(Sampled(tables, rng), path)
    result, row = judged_path(tables, path, rng)
    if result is None:
        return row
    attack = Attack(path, numbers, unit, is_design="tolerance" not in tables)
    counts, faults = judge(attack, result, label)
    return {"counts": counts, "faults": faults}


if __name__ == "__main__":
    campaign(examine)
