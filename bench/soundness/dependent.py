"""Random workspaces of robots with fewer than six degrees of freedom: proofs attacked by closed samples.

    python bench/soundness/dependent.py COUNT FIRST [JOURNAL]

A workspace states ranges of coordinates that the robot can choose, and nothing, a range that holds, or a range that is
too narrow of each other one. ``closedcases.py`` judges the answers: 10,000 samples for each workspace.
"""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
from assemblies import POSE, Assembly, Mechanism, choices
from campaign import Row, campaign
from closedcases import FILES, Asked, Attack, Values, judged, samples_of
from legs import Array
from randomcases import random_tasks
from robots import FOLDER

from screwsynth.nlp import CaseError

SAMPLES = 10_000
NAMES = list(FILES)
#: Robots with limbs whose joint centres have errors that some of their loops cannot follow.
EXACT = ("spherical-3-rrr", "exechon")


def random_asked(rng: np.random.Generator, name: str) -> Asked:
    """Return a workspace of a robot about home, without limits."""
    robot = tomllib.loads(FILES[name].read_text(encoding="utf-8"))
    part, values = rng.choice([0.0, 0.08]), {}
    for key, item in robot.get("dimensions", {}).items():
        values[key] = float(item["typical"] * (1 + part * rng.uniform(-1, 1)))
    mechanism = Mechanism(robot, values)
    chosen = list(rng.choice(np.array(list(choices(mechanism, mechanism.home)), dtype=object)))
    mechanism.is_ball = bool(rng.random() < 0.15)
    asked = Asked({}, mechanism, [int(k) for k in chosen], np.full((6, 2), np.nan))
    home = mechanism.poses(mechanism.moved(mechanism.home, mechanism.exact)[0])[0]
    wide, turn = rng.choice([0.01, 0.04, 0.12, 0.25]), np.radians(rng.choice([1, 4, 10, 20]))
    for _ in range(8):
        half = np.where(np.arange(6) < 3, wide * mechanism.size, turn) * rng.uniform(0.3, 1, 6)
        middle = home + half * rng.uniform(-0.8, 0.8, 6)
        half[rng.random(6) < 0.1] = 0.0  # an independent coordinate with a number of its own
        if not half[asked.chosen].any():
            continue
        asked.ends[:] = np.nan
        for k in asked.chosen:
            asked.ends[k] = middle[k] - half[k], middle[k] + half[k]
        if mechanism.is_ball:
            asked.radius = float(np.tan(turn / 2))
            asked.ends[3:] = -asked.radius, asked.radius
        found = asked.assembled(samples_of(rng, 64, len(asked.chosen)))
        held = (
            mechanism.ranks(found.q[found.closed], mechanism.exact).locked[:, 5] if found.closed.any() else np.zeros(1)
        )
        if (found.closed.all() and held.min() > 0.01) or rng.random() < 0.1:
            break
        wide, turn = 0.5 * wide, 0.5 * turn
    file = name not in {each.stem for each in FOLDER.glob("*.toml")}
    asked.tables = {
        "units": {"length": robot.get("length_unit", "m")},
        "robot": ({"file": f"{name}.toml"} if file else {"model": name}) | {"parameters": values},
        "pose": {"position": mechanism.robot.home.tolist()},
        "task": random_tasks(rng, mechanism.size)[:1],
        "limits": {},
    }
    if rng.random() < 0.15 and "limb" in robot and name not in EXACT:
        asked.errors = float(mechanism.size * rng.choice([1e-5, 1e-4]))
        asked.tables["tolerance"] = {"joint_centre": asked.errors}
    if rng.random() < 0.3:
        asked.tables["load"] = [
            {
                "name": "push",
                "force": rng.normal(size=3).tolist(),
                "moment": (mechanism.size * rng.normal(size=3)).tolist(),
            }
        ]
    return asked


def stated(rng: np.random.Generator, asked: Asked, found: Assembly) -> None:
    """Write the workspace: dependent coordinates have no range, one that holds, or one that is too narrow."""
    pose = found.pose[found.closed]
    home = asked.mechanism.robot.home
    for k in range(6):
        if k in asked.chosen or asked.mechanism.is_ball or not len(pose):
            continue
        low, high = pose[:, k].min(), pose[:, k].max()
        width = high - low
        if width < 1e-6 * asked.units[k] or rng.random() < 0.6:
            continue
        if rng.random() < 0.6:
            asked.ends[k] = low - width * rng.uniform(0.01, 0.5), high + width * rng.uniform(0.01, 0.5)
        else:
            asked.ends[k] = low + width * rng.uniform(-0.2, 0.3), high - width * rng.uniform(0.002, 0.3)

    def written(k: int) -> Any:  # noqa: ANN401 - a number or a table of two
        low, high = asked.ends[k].tolist() if k < 3 else np.degrees(asked.ends[k]).tolist()
        return low if low == high else {"min": low, "max": high}

    place = [float(home[k]) if np.isnan(asked.ends[k, 0]) else written(k) for k in range(3)]
    if asked.mechanism.is_ball:
        most = float(np.degrees(2 * np.arctan(asked.radius)))
        asked.tables["workspace"] = {"position": place, "rotation": {"angle": {"min": -most, "max": most}}}
        return
    rotation = {POSE[k]: written(k) for k in range(3, 6) if not np.isnan(asked.ends[k, 0])}
    # The ends that a reader has: those of degrees in decimals.
    for k in range(3, 6):
        if POSE[k] in rotation:
            own = rotation[POSE[k]]
            asked.ends[k] = np.radians([own["min"], own["max"]] if isinstance(own, dict) else [own, own])
    asked.tables["workspace"] = {"position": place} | ({"rotation": rotation} if rotation else {})


def limited(rng: np.random.Generator, values: dict[str, Array], asked: Asked) -> None:
    """Write limits near the ends of what samples reach."""
    drives = [each for each in values if each.startswith("actuator_") and "force" not in each]
    kinds = sorted({each.partition(" ")[0] for each in drives})
    for kind in kinds:
        if rng.random() < 0.3:
            continue
        both = np.concatenate([values[each] for each in drives if each.startswith(kind)])
        low, high = both.min(), both.max()
        unit = np.pi / 180 if kind == "actuator_angle" else 1.0
        room = rng.choice([-0.2, -0.02, 0.0, 1e-3, 0.05, 0.5], 2) * (high - low)
        ends = {"min": (low - room[0]) / unit, "max": (high + room[1]) / unit}
        if ends["min"] < ends["max"] and (unit == 1.0 or max(map(abs, ends.values())) < 170):
            sides = {side: float(end) for side, end in ends.items() if rng.random() < 0.8}
            asked.tables["limits"][kind] = sides or {"max": float(ends["max"])}
    legs = [each for each in values if each.startswith("leg_length")]
    if legs and rng.random() < 0.4:
        both = np.concatenate([values[each] for each in legs])
        room = rng.choice([-0.05, 1e-3, 0.2], 2) * (both.max() - both.min())
        if both.min() - room[0] < both.max() + room[1] and both.min() - room[0] > 0:
            asked.tables["limits"]["leg_length"] = {
                "min": float(both.min() - room[0]),
                "max": float(both.max() + room[1]),
            }


def examine(seed: int) -> Row:
    """Judge a random workspace, and attack what is claimed."""
    rng = np.random.default_rng(seed)
    asked = random_asked(rng, NAMES[seed % len(NAMES)])
    found = asked.assembled(samples_of(rng, 256, len(asked.chosen)))
    stated(rng, asked, found)
    if found.closed.any():
        few = Assembly(*(each[found.closed] for each in found))
        limited(rng, Values(asked).of(few, np.repeat(asked.mechanism.exact, len(few.q), 0)), asked)
    try:
        answer = judged(asked, gap=float(rng.choice([0.1, 0.01, 1e-3])), time_limit=float(rng.choice([6, 15])))
    except CaseError as error:
        return {"counts": {f"refused: {NAMES[seed % len(NAMES)]}: {str(error)[-70:]}": 1}, "faults": []}
    attack = Attack(asked, answer, rng, SAMPLES)
    return {"counts": attack.counts, "faults": attack.faults}


if __name__ == "__main__":
    campaign(examine)
