"""Random mechanisms as tables of robot files: graphs of links, and stages one after another and beside each other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from builders import Array

Table = dict[str, Any]

FREEDOMS = {"R": 1, "P": 1, "H": 1, "C": 2, "U": 2, "S": 3}


def unit(rng: np.random.Generator) -> Array:
    found = rng.normal(size=3)
    return np.asarray(found / np.linalg.norm(found))


def frame(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Three random directions, perpendicular to each other."""
    a, b, c = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    return a, b, c


@dataclass
class Builder:
    """Links and joints while stages are added."""

    rng: np.random.Generator
    links: list[str] = field(default_factory=lambda: ["base"])
    joints: list[Table] = field(default_factory=list)
    couplings: list[Table] = field(default_factory=list)

    def link(self) -> str:
        self.links.append(f"link{len(self.links)}")
        return self.links[-1]

    def joint(
        self, kind: str, ends: tuple[str, str], at: Array, *axes: Array, actuated: bool = False, pitch: float = 0.0
    ) -> str:
        name = f"j{len(self.joints) + 1}"
        table: Table = {"name": name, "type": kind, "between": list(ends), "at": list(map(float, at))}
        if kind == "U":
            table["axes"] = [list(map(float, axis)) for axis in axes]
        elif axes:
            table["axis"] = list(map(float, axes[0]))
        if kind == "H":
            table["pitch"] = pitch
        if actuated:
            table["actuated"] = True
        self.joints.append(table)
        return name

    def chain(self, start: str, end: str, steps: list[tuple[str, Array, list[Array], bool]]) -> list[str]:
        """A row of joints from one link to another; return their names."""
        names, at = [], start
        for k, (kind, point, axes, actuated) in enumerate(steps):
            following = end if k == len(steps) - 1 else self.link()
            names.append(self.joint(kind, (at, following), point, *axes, actuated=actuated, pitch=0.3))
            at = following
        return names

    # -- stages: from one link to another one, around a place

    def hinge(self, start: str, end: str, at: Array) -> None:
        """A driven hinge, slide or screw."""
        kind = self.rng.choice(["R", "R", "P", "H"])
        self.joint(str(kind), (start, end), at, unit(self.rng), actuated=True, pitch=0.3)

    def planar(self, start: str, end: str, at: Array, *, motors: int = 2) -> None:
        """A five-bar with two motors, or a four-bar with one, whose coupler is the stage's end."""
        x, y, z = frame(self.rng)

        def place(a: float, b: float) -> Array:
            return np.asarray(at + (a + 0.1 * self.rng.normal()) * x + (b + 0.1 * self.rng.normal()) * y)

        self.chain(start, end, [("R", place(-0.5, 0), [z], True), ("R", place(-0.7, 0.6), [z], False)])
        second = [("R", place(0.5, 0), [z], motors > 1), ("R", place(0.7, 0.6), [z], False)]
        if motors > 1 or self.rng.random() < 0.3:
            second.append(("R", place(0.0, 0.9), [z], False))
        if len(second) == 3 and motors == 1:
            second[0] = ("R", second[0][1], [z], True)
        self.chain(start, end, second)

    def ankle(self, start: str, end: str, at: Array) -> None:
        """A universal joint with two driven rods beside it: cranks with rods, or struts."""
        x, y, z = frame(self.rng)
        self.joint("U", (start, end), at, x, y)
        for side in (-1, 1):
            foot = at + side * 0.3 * x + (0.25 + 0.05 * self.rng.random()) * y
            top = at + side * (0.3 + 0.05 * self.rng.random()) * x + 0.3 * y + 0.8 * z
            if self.rng.random() < 0.5:
                motor = at + side * 0.3 * x + 0.75 * z
                self.chain(start, end, [("R", motor, [x], True), ("S", top, [], False), ("S", foot, [], False)])
            else:
                steps = [("U", top, [x, y], False), ("P", top, [foot - top], True), ("S", foot, [], False)]
                self.chain(start, end, steps)

    def delta(self, start: str, end: str, at: Array) -> None:
        """Three arms, each with two rods."""
        x, y, z = frame(self.rng)
        for k in range(3):
            angle = 2 * np.pi * k / 3 + 0.2 * self.rng.normal()
            r, t = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
            motor, elbow, hand = at + 0.4 * r, at + 0.9 * r - 0.1 * z, at + 0.2 * r - 0.9 * z
            arm = self.link()
            self.joint("R", (start, arm), motor, t, actuated=True)
            for side in (-0.1, 0.1):
                self.chain(arm, end, [("S", elbow + side * t, [], False), ("S", hand + side * t, [], False)])

    def tripod(self, start: str, end: str, at: Array) -> None:
        """Three limbs with a driven slide between hinge and ball joint, or a driven hinge and a second one."""
        x, y, z = frame(self.rng)
        kind = self.rng.integers(2)
        for k in range(3):
            angle = 2 * np.pi * k / 3 + 0.2 * self.rng.normal()
            r, t = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
            low, high = at + 0.8 * r, at + 0.5 * r + 0.9 * z
            if kind:
                steps = [("R", low, [t], False), ("P", low, [high - low], True), ("S", high, [], False)]
            else:
                steps = [("R", low, [t], True), ("R", low + 0.3 * r + 0.5 * z, [t], False), ("S", high, [], False)]
            self.chain(start, end, steps)

    def geared(self, start: str, end: str, at: Array) -> None:
        """A planar limb of two hinges that a gear couples with its motor's, beside a driven slide with two hinges."""
        x, y, z = frame(self.rng)
        steps = [("R", at - 0.5 * x, [z], True), ("R", at - 0.6 * x + 0.5 * y, [z], False)]
        names = self.chain(start, end, [*steps, ("R", at + 0.8 * y, [z], False)])
        pair = names[:2] if self.rng.random() < 0.5 else names[1:]
        self.couplings.append({"factors": {pair[0]: 1.0, pair[1]: float(self.rng.uniform(-1, -0.4))}})
        steps = [("P", at + 0.6 * x, [x + 0.2 * y], True), ("R", at + 0.7 * x + 0.1 * y, [z], False)]
        self.chain(start, end, [*steps, ("R", at + 0.3 * x + 0.9 * y, [z], False)])

    def crossed(self, start: str, end: str, at: Array) -> None:
        """A driven four-bar whose coupler carries a driven strut, and a limb from the start: loops in loops."""
        middle = self.link()
        self.planar(start, middle, at, motors=1)
        x, y, z = frame(self.rng)
        hand = at + 0.9 * z
        self.joint("S", (middle, end), hand)
        self.chain(middle, end, [("S", at + 0.5 * x, [], False), ("S", hand + 0.4 * x, [], False)])
        for side in (0.5 * y + 0.3 * x, -0.5 * y - 0.2 * x):
            foot, top = at + side + 0.2 * self.rng.normal(size=3), hand + 0.6 * side
            steps = [("U", foot, [x, y], False), ("P", foot, [top - foot], True)]
            self.chain(start, end, [*steps, ("S", top, [], False)])

    def graph(self, start: str, end: str, at: Array) -> None:
        """Any links in any loops with any joints."""
        rng, own = self.rng, [start]
        own += [self.link() for _ in range(int(rng.integers(2, 5)))] + [end]
        edges = [(own[int(rng.integers(k))], own[k]) for k in range(1, len(own))]
        loops = int(rng.integers(1, 4))
        while len(edges) < len(own) - 1 + loops:
            one, other = (str(each) for each in rng.choice(own, 2, replace=False))
            edges.append((one, other))
        kinds = [str(each) for each in rng.choice(list("RPSUHC"), len(edges), p=[0.4, 0.15, 0.2, 0.15, 0.05, 0.05])]
        wanted = int(rng.integers(1, 5))
        kinds[0] = "R"  # of a robot something is driven
        for k in 1 + rng.permutation(len(kinds) - 1):
            if sum(FREEDOMS[kind] for kind in kinds) < 6 * loops + wanted:
                kinds[k] = str(rng.choice(["U", "S"]))
        drivable = [k for k, kind in enumerate(kinds) if kind in "RPH"]
        count = min(len(drivable), max(1, wanted + int(rng.choice([-1, 0, 0, 0, 0, 1]))))
        driven = set(rng.choice(drivable, count, replace=False).tolist()) if drivable else set()
        for k, (one, other) in enumerate(edges):
            axes = frame(rng)[:2] if kinds[k] == "U" else (unit(rng),) if kinds[k] != "S" else ()
            point = at + rng.uniform(-1, 1, 3)
            self.joint(kinds[k], (one, other), point, *axes, actuated=k in driven, pitch=0.3)


#: Freedoms of a stage, about: more than six in a row leave actuators idle.
STAGES = {"hinge": 1, "planar": 2, "ankle": 2, "delta": 3, "tripod": 3, "geared": 2, "crossed": 3, "graph": 2}


def random_mechanism(seed: int) -> Table:
    """Stages in a row from base to platform, and for some robots a second row beside them."""
    rng = np.random.default_rng(seed)
    builder = Builder(rng)
    if seed % 4 == 0:
        builder.graph("base", "platform", np.zeros(3))
    else:
        rows = 2 if rng.random() < 0.25 else 1
        for _ in range(rows):
            stages = [str(each) for each in rng.choice(list(STAGES), int(rng.integers(1, 4)))]
            while seed % 8 != 1 and sum(STAGES[each] for each in stages) > 6:
                stages.pop()
            if stages == ["hinge"] * len(stages):
                stages[0] = "planar"
            if stages.count("delta") > 1:
                stages = [each for each in stages if each != "delta"] + ["delta"]
            at, place = "base", 0.3 * rng.normal(size=3)
            for k, stage in enumerate(stages):
                following = "platform" if k == len(stages) - 1 else builder.link()
                getattr(builder, stage)(at, following, place)
                at, place = following, place + 0.8 * unit(rng)
    return {
        "name": f"random {seed}",
        "home": list(map(float, rng.uniform(-0.5, 0.5, 3))),
        "links": [*builder.links, "platform"],
        "joint": builder.joints,
        **({"coupling": builder.couplings} if builder.couplings else {}),
    }
