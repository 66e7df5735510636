"""Loads and motions of a platform in NumPy: random ones, and the numbers of actuators that follow from them.

A number is the largest value at a pose: of a force, of minus a force, of a speed, and of powers in both senses. Loads
of any direction are support functions of balls: ``max W . x = a |v| + b |omega|``, with v at the load's point.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from legs import Array, Tables


class Key(NamedTuple):
    """A number: index of the actuator, word, and load case; the word is a largest value that is meant."""

    place: int
    word: str
    load: str = ""


#: Words of the numbers that depend on loads: the force and minus the force, and the power of both.
FORCES, POWERS = ("force", "backwards"), ("power", "braking")


class Loading:
    """Loads and motions of a case's tables.

    Attributes:
        cases: loads that act together, with the sign of each, by their name in results.
        linear, angular: largest speeds of the platform; both 0 where none are stated.
    """

    def __init__(self, tables: Tables) -> None:
        unit = 1.0 if tables.get("units", {}).get("angle") == "rad" else np.pi / 180
        self.linear = tables.get("motion", {}).get("linear", 0.0)
        self.angular = tables.get("motion", {}).get("angular", 0.0) * unit
        self.gravity = np.array(tables.get("gravity", {}).get("acceleration", [0, 0, -9.81]), float)
        always = [each for each in tables["load"] if each.get("always")]
        self.cases: dict[str, list[tuple[Tables, float]]] = {}
        for own in [[each] for each in tables["load"] if not each.get("always")] or [[]]:
            together = own + always
            title = " and ".join(each["name"] for each in own or always)
            for signs in itertools.product(*[(1, -1) if each.get("sign") == "both" else (1,) for each in together]):
                turned = [each["name"] for each, sign in zip(together, signs, strict=True) if sign < 0]
                name = (
                    f"{title} reversed" if turned == [title] else "".join([title, *(f", {x} reversed" for x in turned)])
                )
                self.cases[name] = [(each, float(sign)) for each, sign in zip(together, signs, strict=True)]

    def keys(self, count: int) -> list[Key]:
        """Return the numbers of a robot with as many actuators, in the order of :meth:`numbers`."""
        moves = self.linear > 0 or self.angular > 0
        words = (*FORCES, *(POWERS if moves else ()))
        found = [Key(k, word, load) for k in range(count) for load in self.cases for word in words]
        return found + [Key(k, "speed") for k in range(count) if moves]

    def numbers(self, motions: Array, R: Array) -> Array:
        """Return the numbers (N, K) of actuators at poses.

        Args:
            motions: (N, 6, a) of the platform by unit rates of actuators: velocity of its origin, then the angular one.
            R: (N, 3, 3) rotations.
        """
        v, omega, count = motions[:, :3], motions[:, 3:], motions.shape[2]
        speeds = self._speeds(motions)
        columns: dict[Key, Array] = {Key(k, "speed"): speeds[:, k] for k in range(count)}
        for name, parts in self.cases.items():
            held, spread = np.zeros_like(speeds), np.zeros_like(speeds)
            for load, sign in parts:
                arm = R @ np.array(load.get("point", load.get("centre", [0, 0, 0])), float)
                at = v + np.cross(omega, arm[:, :, None], axis=1)
                force, moment = (np.array(load.get(key, [0, 0, 0]), float) for key in ("force", "moment"))
                force = force + load.get("mass", 0.0) * self.gravity
                turn = R if load.get("frame") == "platform" else np.broadcast_to(np.eye(3), R.shape)
                held -= sign * np.einsum("ni,nik->nk", turn @ force, at)
                held -= sign * np.einsum("ni,nik->nk", turn @ moment, omega)
                most = load.get("any", {})
                spread += most.get("force", 0.0) * np.linalg.norm(at, axis=1)
                spread += most.get("moment", 0.0) * np.linalg.norm(omega, axis=1)
            for k in range(count):
                for word, power, each in zip(FORCES, POWERS, (held + spread, spread - held), strict=True):
                    columns[Key(k, word, name)] = each[:, k]
                    columns[Key(k, power, name)] = np.maximum(each[:, k], 0) * speeds[:, k]
        return np.stack([columns[key] for key in self.keys(count)], axis=1)

    def _speeds(self, motions: Array) -> Array:
        """Return the largest speeds (N, a), from the factors of least size of rates in motions of the platform."""
        length = self.linear / self.angular if self.linear and self.angular else 1.0
        scaled = motions * np.repeat([1.0, length], 3)[:, None]
        g = (np.linalg.inv if motions.shape[2] == 6 else np.linalg.pinv)(scaled) * np.repeat([1.0, length], 3)
        return np.asarray(
            self.linear * np.linalg.norm(g[..., :3], axis=2) + self.angular * np.linalg.norm(g[..., 3:], axis=2)
        )


def random_loading(rng: np.random.Generator, size: float, unit: float = np.pi / 180) -> Tables:
    """Return tables of loads, of motions, mostly, and of gravity for a robot of a size; angles are of a unit."""

    def vector(by: float) -> list[float]:
        return (by * rng.normal(size=3) * (rng.random(3) < 0.8)).tolist()

    def made(name: str, *, always: bool) -> Tables:
        load: Tables = {"name": name}
        if rng.random() < 0.35:
            load |= {"mass": float(rng.uniform(0.5, 20)), "centre": vector(0.2 * size)}
            return load | ({"always": True} if always else {})
        kinds = rng.random(3) < 0.6
        if kinds[0] or not kinds.any():
            load["force"] = (10 * rng.normal(size=3)).tolist()
        if kinds[1]:
            load["moment"] = vector(3 * size)
        if kinds[2]:
            sizes = {"force": float(rng.uniform(1, 20)), "moment": float(rng.uniform(0.2, 5) * size)}
            kept = [key for key in sizes if rng.random() < 0.7] or ["force"]
            load["any"] = {key: sizes[key] for key in kept}
        if rng.random() < 0.7:
            load["point"] = vector(0.3 * size)
        if rng.random() < 0.3:
            load["frame"] = "platform"
        if rng.random() < 0.3 and any(any(load.get(key, [])) for key in ("force", "moment")):
            load["sign"] = "both"
        return load | ({"always": True} if always else {})

    kind = rng.integers(3)
    loads = [made("push", always=False), made("carried", always=True)][: 1 + int(kind > 0)]
    if kind == 2 and not any("sign" in each for each in loads):
        loads.append(made("other", always=False))
    found: Tables = {"load": loads}
    acceleration = 9.81 * np.array([0, 0, -1.0]) if rng.random() < 0.6 else rng.normal(size=3) * 5
    found["gravity"] = {"acceleration": acceleration.tolist()}
    both = {"linear": float(size * rng.uniform(0.1, 2)), "angular": float(np.radians(rng.uniform(5, 120)) / unit)}
    if rng.random() < 0.85:
        found["motion"] = {key: both[key] for key in both if rng.random() < 0.8} or both
    return found


def actuator_limits(rng: np.random.Generator, keys: list[Key], values: Array, names: list[str], unit: Any) -> Tables:  # noqa: ANN401
    """Return limits near the largest of some values (N, K): on the actuators of one kind together, or on one.

    Args:
        rng: random numbers.
        keys: K numbers.
        values: finite ones, of random poses.
        names: of the actuators.
        unit: radians of the angle in the speeds of each actuator; 1 for lengths.
    """
    limits: Tables = {}
    for name, words in (("force", FORCES), ("speed", ("speed",)), ("power", POWERS)):
        if rng.random() < 0.4 or not any(key.word == words[0] for key in keys):
            continue
        one = int(rng.integers(len(names)))
        is_all = len(set(unit)) == 1 and rng.random() < 0.5
        most = [
            max(
                float(values[:, j].max())
                for j, key in enumerate(keys)
                if key.word == word and is_all | (key.place == one)
            )
            for word in words
        ]
        factor = float(rng.choice([0.97, 1.001, 1.006, 1.03, 1.3]))
        own: Tables = {"max": max(most) * factor / (unit[one] if name == "speed" else 1.0)}
        if name == "force" and rng.random() < 0.5:  # signed ones
            room = 0.05 * max(abs(each) for each in most) * rng.choice([-0.3, 0.05, 1.0], 2)
            own = {"max": most[0] + float(room[0]), "min": -most[1] - float(room[1])}
            own = own if own["min"] < own["max"] else {"max": own["max"]}
        if own["max"] > 0 or "min" in own:
            limits[f"actuator_{name}"] = own if is_all else {f'"{names[one]}"': own}
    return limits
