"""Random workspaces: case files as tables, with limits near the values that samples reach."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from legs import Box, Legs

Tables = dict[str, Any]


def text_of(tables: Tables) -> str:
    """Return tables as TOML: tables of a table are written inline below the first level."""

    def value(given: object) -> str:
        if isinstance(given, dict):
            return "{ " + ", ".join(f"{key} = {value(each)}" for key, each in given.items()) + " }"
        if isinstance(given, list | tuple | np.ndarray):
            return f"[{', '.join(map(value, given))}]"
        return (
            json.dumps(given)
            if isinstance(given, str | bool)
            else str(given)
            if isinstance(given, int)
            else repr(float(given))
        )

    lines = []
    for name, table in tables.items():
        for each in table if isinstance(table, list) else [table]:
            lines.append(f"[[{name}]]" if isinstance(table, list) else f"[{name}]")
            lines += [f"{key} = {value(inner)}" for key, inner in each.items()]
    return "\n".join(lines) + "\n"


def spans(rng: np.random.Generator, middle: Any, half: Any) -> list[Any]:  # noqa: ANN401 - numbers
    """Return numbers of a case, a fifth of them fixed, others free about a middle."""
    found: list[Any] = []
    for m, h in zip(middle, half, strict=True):
        at, by = m + rng.uniform(-0.5, 0.5) * h, h * rng.uniform(0.1, 1)
        found.append(float(at) if rng.random() < 0.2 else {"min": float(at - by), "max": float(at + by)})
    return found


def random_rotation(rng: np.random.Generator, largest: float, unit: float) -> Tables:
    """Return a rotation of one of the kinds, with angles of at most ``largest`` radians."""
    kind, size = rng.integers(3), largest * rng.uniform(0.05, 1) / unit
    if kind == 0:
        return {"angle": {"min": -float(size), "max": float(size)}}
    if kind == 1:
        axis = rng.normal(size=3) if rng.random() < 0.7 else np.eye(3)[rng.integers(3)]
        low = -size * rng.uniform(-0.9, 1)
        return {"axis": axis.tolist(), "angle": {"min": float(low), "max": float(low + size)}}
    names = [name for name in ("roll", "pitch", "yaw") if rng.random() < 0.75] or ["yaw"]
    low = {name: -size * rng.uniform(-0.2, 1) for name in names}
    return {name: {"min": float(low[name]), "max": float(low[name] + size * rng.uniform(0.3, 1.2))} for name in names}


def random_tasks(rng: np.random.Generator, size: float) -> list[Tables]:
    """Return one or two tasks."""
    found = []
    for name in ("push", "turn")[: 1 + int(rng.random() < 0.25)]:
        pitch = float("inf") if rng.random() < 0.3 else float(rng.choice([0.0, 1.0]) * rng.normal() * size)
        task = {
            "name": name,
            "sense": str(rng.choice(["max", "min"])),
            "axis": rng.normal(size=3).tolist(),
            "pitch": pitch,
        }
        found.append(task if np.isinf(pitch) else task | {"point": (rng.normal(size=3) * size).tolist()})
    return found


def random_legs(rng: np.random.Generator) -> Tables:
    """Return a case of a robot with straight legs and its workspace, without limits."""
    in_radians = rng.random() < 0.3
    unit = 1.0 if in_radians else np.pi / 180
    label, size = [("m", 0.3), ("mm", 300.0), ("in", 12.0)][rng.integers(3)]
    kind = rng.choice(["stewart-gough", "hexapod", "three-upu"], p=[0.35, 0.4, 0.25])
    height = size * rng.uniform(1, 3)
    robot: Tables = {"model": str(kind)}
    if kind == "stewart-gough":
        robot["layout"] = str(rng.choice(["aligned", "octahedral"], p=[0.25, 0.75]))
        angles = [float(np.radians(rng.uniform(0, 25)) / unit) for _ in range(2)]
        robot["parameters"] = {
            "x1": size * rng.uniform(0.8, 1.6),
            "x2": size * rng.uniform(0.4, 1),
            "x3": angles[0],
            "x4": angles[1],
        }
    elif kind == "hexapod":
        azimuth = np.pi / 3 * (np.arange(6) // 2 * 2) + np.radians(10) * (2 * (np.arange(6) % 2) - 1)
        other = np.pi / 3 * ((np.arange(6) + 1) // 2 * 2 - 1) + np.radians(10) * (1 - 2 * (np.arange(6) % 2))
        noise = rng.choice([0.02, 0.15, 0.5])
        parameters: Tables = {}
        for plate, radius, place in (
            ("base", rng.uniform(0.8, 1.6), azimuth),
            ("platform", rng.uniform(0.4, 1), other),
        ):
            centres = radius * np.stack([np.cos(place), np.sin(place), 0 * place], 1) + noise * rng.normal(
                size=(6, 3)
            ) * [1, 1, 0.4]
            parameters |= {f"{plate}_{k + 1}": (size * each).tolist() for k, each in enumerate(centres)}
        robot["parameters"] = parameters
    else:
        robot["axes"] = str(rng.choice(["snu", "tsai"]))
        robot["parameters"] = {
            "base_radius": size * rng.uniform(0.8, 1.6),
            "platform_radius": size * rng.uniform(0.3, 0.75),
        }
        robot["characteristic_length"] = float(size * rng.uniform(0.3, 1))
    wide = rng.choice([0.03, 0.15, 0.5])
    home = np.array([0, 0, height])
    tables: Tables = {
        "units": {"length": label, "angle": "rad" if in_radians else "deg"},
        "robot": robot,
        "pose": {"position": home.tolist()},
        "task": random_tasks(rng, size),
        "limits": {},
    }
    if rng.random() < 0.4:
        tables["tolerance"] = {"joint_centre": float(size * rng.choice([1e-4, 1e-3, 1e-2]))}
    tables["workspace"] = {
        "position": spans(rng, home, wide * size * np.ones(3)),
        "rotation": random_rotation(rng, np.radians(rng.choice([3, 15, 50])), unit),
    }
    if isinstance(robot["parameters"].get("x1"), np.floating | float):
        robot["parameters"] = {name: float(each) for name, each in robot["parameters"].items()}
    return tables


def limited_legs(rng: np.random.Generator, tables: Tables) -> Tables:
    """Return a case with limits about the values that are reached at random poses of its workspace."""
    unit = Legs(tables).unit
    limits: Tables = {"home": {"position": tables["pose"]["position"]}}
    for plate in ("base", "platform"):
        about = [None, "normal", "home", rng.normal(size=3) * [0.3, 0.3, 0] + [0, 0, 1], "list"][rng.integers(5)]
        if isinstance(about, str) and about == "list":
            about = (rng.normal(size=(len(Legs(tables).names), 3)) * 0.3 + [0, 0, 1]).tolist()
        if about is not None:
            limits[f"{plate}_joint_angle"] = {
                "about": about if isinstance(about, str) else np.array(about).tolist(),
                "max": 1.0,
            }
    size = float(np.linalg.norm(Legs(tables).platform, axis=1).mean())
    for key in ("condition_number", "smallest_singular_value"):
        if rng.random() < 0.25:
            limits[key] = {"length": size * float(rng.uniform(0.5, 2))}
    if rng.random() < 0.3:
        limits["custom"] = ["p_x^2 + p_y*p_z <= 0", "sqrt(p_x^2 + p_y^2 + p_z^2) >= 0"][: 1 + int(rng.random() < 0.5)]
    tables = tables | {"limits": limits}
    legs, box = Legs(tables), Box(tables)
    poses = box.poses(box.sample(rng, 256))
    values = legs.values(poses)

    def about_end(names: str, *, largest: bool) -> float:
        found = [each for name, each in values.items() if name.startswith(names)]
        low, high = min(map(np.min, found)), max(map(np.max, found))
        at, way = (high, 1) if largest else (low, -1)
        return float(at + way * (high - low + 1e-3 * abs(at)) * rng.choice([-0.05, 0.002, 0.03, 0.2, 1.0]))

    if rng.random() < 0.7:
        both = {"min": about_end("leg_length", largest=False), "max": about_end("leg_length", largest=True)}
        limits["leg_length"] = {key: both[key] for key in both if rng.random() < 0.8} or both
    if rng.random() < 0.4:
        stroke = max(np.ptp(each) for name, each in values.items() if name.startswith("leg_length"))
        limits["actuator"] = {"stroke_max": float(stroke * rng.uniform(0.95, 1.5)) + 1e-3 * size}
        if rng.random() < 0.5:
            dead = min(2 * each.min() - each.max() for name, each in values.items() if name.startswith("leg_length"))
            limits["actuator"]["dead_length"] = float(max(dead, size * 0.1) * rng.uniform(0.7, 1.02))
    for plate in ("base", "platform"):
        if f"{plate}_joint_angle" in limits:
            limits[f"{plate}_joint_angle"]["max"] = float(
                min(about_end(f"{plate}_joint_angle", largest=True), 3.0) / unit
            )
    if rng.random() < 0.4:
        limits["rate_share"] = {"max": float(np.clip(about_end("rate_share", largest=True), 0.2, 0.99))}
    if rng.random() < 0.4:
        limits["actuator_rate"] = {"max": float(abs(about_end("actuator_rate", largest=True)) + 1e-6)}
    for key in ("condition_number", "smallest_singular_value"):
        if key in limits:
            end = about_end(key, largest=key == "condition_number")
            limits[key]["max" if key == "condition_number" else "min"] = max(
                float(end), 1.01 if key == "condition_number" else 1e-6
            )
    if rng.random() < 0.2:
        limits["joint_spacing"] = {"min": float(abs(about_end("joint_spacing", largest=False)) + 1e-3 * size)}
    if rng.random() < 0.2:
        limits["footprint"] = {
            "base": about_end("footprint base", largest=True),
            "platform": about_end("footprint platform", largest=True),
        }
    if rng.random() < 0.2:
        ratio = float(values["radius_ratio"][0])
        limits["radius_ratio"] = {
            "min": ratio * float(rng.uniform(0.9, 1.0001)),
            "max": ratio * float(rng.uniform(0.9999, 1.1)),
        }
    if rng.random() < 0.3 and len(legs.names) == 6:
        least = min(
            legs.clearance(f"leg_clearance limbs {one} and {other}", poses).min()
            for k, one in enumerate(legs.names)
            for other in legs.names[k + 1 :]
        )
        limits["leg_clearance"] = {"min": float(max(least, 1e-3 * size) * rng.uniform(0.5, 1.05))}
    if "custom" in limits:
        limits["custom"] = [
            f"{each[:-1]}{about_end(f'custom: {each}', largest='<=' in each)!r}" for each in limits["custom"]
        ]
    if not any(isinstance(each, dict) and each.get("about") == "home" for each in limits.values()):
        del limits["home"]
    return tables
