"""Workspaces of robots with fewer than six degrees of freedom, held against closed samples.

A workspace is a box of the coordinates of the pose that the robot can choose. The others follow, and samples are closed
from home with them unknown (``assemblies.py``); MuJoCo measures every sample (``engine.py``). No sample may lie outside
of a proved range. The robot must be able to take each pose that refutes a claim, in its home assembly mode, and must
violate the claim there.
"""

from __future__ import annotations

import itertools
import re
import tempfile
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from assemblies import BALL, POSE, Assembly, Mechanism, angles_of, cayley_of, choices
from engine import Engine
from legs import Array, Poses, twist_of
from randomcases import text_of
from robots import FOLDER, numbers

from screwsynth.nlp import Judgement, Outcome, Verdict, judge_workspace, load_case

Tables = dict[str, Any]
BLOCK = 2048
#: Names of coordinates of a rotation about z, the only axis of workspaces here.
ABOUT_Z = {"angle": "yaw", "tilt_1": "roll", "tilt_2": "pitch"}
#: Part by which a value may be beyond a bound: closing and rounding.
ROUNDING = 1e-9
#: Distance in parts of the robot's size and radians by which a pose of an answer may be off the closed one.
SAME = 1e-7
#: Singular value, in parts of the robot, that a singular pose of an answer has at most.
SINGULAR = 1e-4
#: Part of a sampled range by which a bound is wide: counted, no fault.
WIDE = 0.05
ROOT = Path(__file__).parents[2]
SPECIAL = ("3-hps", "3-rprrr", "3-rps-ups", "planar-centre", "planar-loose")
FILES = {
    **{each.stem: each for each in sorted(FOLDER.glob("*.toml")) if not each.stem.startswith("6-")},
    **{name: ROOT / "tests" / "models" / "special" / f"{name}.toml" for name in SPECIAL},
    **{each.stem: each for each in sorted((Path(__file__).parent / "machines").glob("*.toml"))},
}


@dataclass
class Asked:
    """A workspace: the case's tables, its robot, and the box of the coordinates that the robot chooses.

    Attributes:
        tables: of the case; its robot's file is beside it.
        mechanism: the robot.
        chosen: indices of the independent coordinates.
        ends: (6, 2) of coordinates; of dependent ones those that are stated, NaN where there are none.
        errors: largest error of a joint centre.
        radius: largest size of a Cayley vector; infinite without.
    """

    tables: Tables
    mechanism: Mechanism
    chosen: list[int]
    ends: Array
    errors: float = 0.0
    radius: float = np.inf

    @property
    def names(self) -> tuple[str, ...]:
        return BALL if self.mechanism.is_ball else POSE

    @property
    def units(self) -> Array:
        """Sizes (6,) in parts of which coordinates are compared."""
        return np.array([self.mechanism.size] * 3 + [1.0] * 3)

    def targets(self, u: Array) -> Array:
        """Return values (N, k) of the independent coordinates of numbers between 0 and 1, brought into a ball."""
        lower, upper = self.ends[self.chosen].T
        found = lower + u * (upper - lower)
        turns = [j for j, k in enumerate(self.chosen) if k >= 3]
        size = np.linalg.norm(found[:, turns], axis=1, keepdims=True)
        found[:, turns] *= np.minimum(1.0, self.radius / np.maximum(size, 1e-300))
        return np.asarray(found)

    def assembled(self, u: Array, errors: Array | None = None) -> Assembly:
        middle = self.targets(np.full((1, len(self.chosen)), 0.5))[0]
        return self.mechanism.assembled(self.chosen, middle, self.targets(u), errors)

    def has(self, pose: Array) -> bool:
        """Whether the independent coordinates of a pose (6,) are in the box, up to rounding."""
        lower, upper = self.ends[self.chosen].T
        at, room = pose[self.chosen], SAME * self.units[self.chosen]
        turns = [k for k in self.chosen if k >= 3]
        inside = (at >= lower - room) & (at <= upper + room)
        return bool(inside.all() and np.linalg.norm(pose[turns]) <= self.radius + SAME)


def samples_of(rng: np.random.Generator, count: int, size: int) -> Array:
    """Return numbers (count, size) between 0 and 1: all corners, a half anywhere, a quarter each on faces and edges."""
    u = rng.random((count, size))
    part = rng.random(u.shape)
    at_end = np.where(
        np.arange(count)[:, None] % 4 == 0, part < 0.9, (np.arange(count)[:, None] % 4 == 1) & (part < 0.5)
    )
    u = np.where(at_end, np.round(u), u)
    corners = list(itertools.product((0.0, 1.0), repeat=size))
    u[: len(corners)] = corners[:count]
    return u


def asked_of(tables: Tables, name: str, chosen: Sequence[str] = ()) -> Asked:
    """Return the workspace of a case's tables, of a robot of :data:`FILES`; angles are degrees.

    Args:
        tables: of the case.
        name: of the robot's file.
        chosen: names of the independent coordinates; if left out, the last ones with the most ranges that the robot can
            choose. An answer may name other ones.
    """
    file = FILES[name]
    mechanism = Mechanism(tomllib.loads(file.read_text(encoding="utf-8")), tables["robot"]["parameters"])
    ends, rotation = np.full((6, 2), np.nan), dict(tables["workspace"].get("rotation", {}))
    if "axis" in rotation:
        rotation = {"yaw": rotation["angle"]}
    for k, value in enumerate([*tables["workspace"]["position"], *(rotation.get(name, 0.0) for name in POSE[3:])]):
        own = [value["min"], value["max"]] if isinstance(value, dict) else [value, value]
        ends[k] = own if k < 3 else np.radians(own)
    ranged = ends[:, 1] > ends[:, 0]
    every = list(choices(mechanism, mechanism.home))
    likely = max(reversed(every), key=lambda each: int(ranged[list(each)].sum()))
    return Asked(tables, mechanism, [POSE.index(each) for each in chosen] or list(likely), ends)


class Values:
    """Numbers of closed configurations by the names that answers give them; angles are radians."""

    def __init__(self, asked: Asked) -> None:
        self.asked, self.mechanism, self.engine = asked, asked.mechanism, Engine(asked.mechanism)
        (task,) = asked.tables["task"]
        self.chi = twist_of(task)

    def of(self, found: Assembly, errors: Array) -> dict[str, Array]:
        """Return the numbers (N,) of assemblies of robots with errors (N, c, 3) of joint centres."""
        mechanism, robot = self.mechanism, self.mechanism.robot
        values = {name: found.pose[:, k] for k, name in enumerate(self.asked.names)}
        for k, owner in zip(robot.actuated, mechanism.owners, strict=True):
            values[f"actuator_{'length' if robot.slides[k] else 'angle'} limb {owner}"] = found.q[:, k]
        for k, (label, which) in enumerate(robot.labels):
            if label:
                values[f"joint.{label}{('', ' first', ' second')[which + 1]}"] = found.q[:, k]
        if not self.asked.errors:
            values |= {f"leg_length limb {name}": each for name, each in mechanism.leg_lengths(found.q).items()}
        forces = self.forces(found, errors)
        for name, each in zip(mechanism.owners, forces.T, strict=True) if "load" in self.asked.tables else ():
            values[f"actuator_force actuator {name} load push"] = each
            values[f"actuator_force actuator {name} smallest load push"] = each
        if robot.limbs and self.asked.tables["robot"].get("file") != "planar-centre.toml":
            values["F"] = np.concatenate(
                [self._objective(found.q[k : k + BLOCK], errors[k : k + BLOCK]) for k in range(0, len(errors), BLOCK)]
            )
        return values

    def _objective(self, q: Array, errors: Array) -> Array:
        robot = self.mechanism.robot
        T, _ = self.mechanism.moved(q, errors)
        R = T[:, 0, :3, :3]
        p = np.einsum("nij,j->ni", R, robot.home) + T[:, 0, :3, 3]
        return numbers(robot, Poses(p, R), q, robot.points_array + errors, self.chi)["F"]

    def forces(self, found: Assembly, errors: Array) -> Array:
        """Return the forces (N, a) of actuators that hold the load, by the work in motions of one actuator alone."""
        if "load" not in self.asked.tables:
            return np.zeros((len(found.q), len(self.mechanism.owners)))
        (load,), mechanism = self.asked.tables["load"], self.mechanism
        passive = [k for k in range(mechanism.robot.count) if k not in mechanism.robot.actuated]
        every = []
        for k in range(0, len(errors), BLOCK):
            T, S = mechanism.moved(found.q[k : k + BLOCK], errors[k : k + BLOCK])
            _, A = mechanism.loops(found.q[k : k + BLOCK], T, S)
            A = A * mechanism.scale
            own = np.zeros((len(T), mechanism.robot.count, len(mechanism.owners)))
            own[:, passive] = -np.linalg.pinv(A[:, :, passive], rcond=1e-9) @ A[:, :, mechanism.robot.actuated]
            own[:, mechanism.robot.actuated] = np.eye(len(mechanism.owners))
            twists = S[:, 0] @ (mechanism.scale[:, None] * own) / mechanism.scale[mechanism.robot.actuated]
            R = T[:, 0, :3, :3]
            p = np.einsum("nij,j->ni", R, mechanism.robot.home) + T[:, 0, :3, 3]
            v = twists[:, :3] + np.cross(twists[:, 3:], p[:, :, None], axis=1)
            every.append(
                -np.einsum("i,nik->nk", load["force"], v) - np.einsum("i,nik->nk", load["moment"], twists[:, 3:])
            )
        return np.concatenate(every)

    def at(self, u: Array, errors: Array) -> tuple[dict[str, Array], Assembly]:
        found = self.asked.assembled(u, errors)
        return self.of(found, errors), found

    def random_errors(self, rng: np.random.Generator, count: int) -> Array:
        found = rng.normal(size=(count, *self.mechanism.exact.shape[1:]))
        return np.asarray(self.asked.errors * found / np.maximum(np.linalg.norm(found, axis=2, keepdims=True), 1e-300))


def name_of(extreme: Verdict) -> str:
    """Return the name of an answer's number among :class:`Values`."""
    name = re.sub(
        r"(joint\.\S+?)(\.first|\.second)? joint .*", lambda m: m[1] + (m[2] or "").replace(".", " "), extreme.name
    )
    return ABOUT_Z.get(name, name)


def dependent_of(judgement: Judgement) -> set[int] | None:
    """Return the indices of the coordinates that an answer says to follow from the others; None without."""
    found = getattr(judgement.workspace, "dependent", None)
    if found is None:
        return None
    names = [judgement.workspace.names[each.index] for each in found]
    return {BALL.index(name) if name in BALL else POSE.index(ABOUT_Z.get(name, name)) for name in names}


class Taken(NamedTuple):
    """The robot at a pose of an answer.

    Attributes:
        there: the robot at the independent coordinates of the pose; None of a verdict without a pose.
        errors: (1, c, 3) of its joint centres.
        at: (6,) the pose's coordinates.
        away: how far these are off, in parts of the robot's size and radians; infinite where it does not close.
    """

    there: Assembly | None
    errors: Array
    at: Array
    away: float


class Attack:
    """An answer held against samples of its workspace.

    Args:
        asked: the workspace.
        judgement: the answer, whose independent coordinates are taken.
        rng: of the samples.
        count: number of samples.
        ascents: numbers with the tightest bounds from which ascents begin.

    Attributes:
        counts: of verdicts and samples.
        faults: contradictions, in words.
    """

    def __init__(
        self, asked: Asked, judgement: Judgement, rng: np.random.Generator, count: int, ascents: int = 4
    ) -> None:
        self.asked, self.judgement, self.rng, self.ascents = asked, judgement, rng, ascents
        self.counts, self.faults = Counter[str](), list[str]()
        self._choose()
        self.numbers, self.mechanism = Values(asked), asked.mechanism
        self.robot = asked.tables["robot"].get("model") or asked.tables["robot"]["file"].removesuffix(".toml")
        u = samples_of(rng, count, len(asked.chosen))
        errors = self.numbers.random_errors(rng, count) * (1.0 if asked.errors else 0.0)
        values, found = self.numbers.at(u, errors)
        self.is_whole = bool(found.closed.all())
        self._measure(u, found)
        self.u, self.errors, self.q = (each[found.closed] for each in (u, errors, found.q))
        self.values = {name: each[found.closed] for name, each in values.items()}
        if len(self.u):
            self.taken = self._taken()
            self._ranks()
            self._extremes()

    def _choose(self) -> None:
        """Take the independent coordinates of the answer where it names the dependent ones."""
        asked, follows = self.asked, dependent_of(self.judgement)
        if follows is None:
            return
        middle = asked.assembled(np.full((1, len(asked.chosen)), 0.5))
        legal = list(choices(asked.mechanism, middle.q, 1e-4))
        mine, at_home = (
            sorted({k for each in legal for k in each} - follows),
            list(choices(asked.mechanism, asked.mechanism.home)),
        )
        words = [", ".join(asked.names[k] for k in each) for each in (sorted(follows), mine)]
        if tuple(mine) not in legal:
            self.faults.append(f"{words[0]} are said to follow, and {words[1]} cannot be chosen")
            return
        if len(at_home) == 1 and tuple(mine) not in at_home:
            self.faults.append(f"{words[1]} are taken, which the robot cannot choose at home")
        self.counts["another set"] += tuple(mine) != tuple(asked.chosen)
        asked.chosen = mine
        home = asked.mechanism.poses(asked.mechanism.moved(asked.mechanism.home, asked.mechanism.exact)[0])[0]
        for k in mine:
            asked.ends[k] = home[k] if np.isnan(asked.ends[k, 0]) else asked.ends[k]

    def _measure(self, u: Array, found: Assembly) -> None:
        """Let MuJoCo measure all samples of the design, and compare reach with what closes."""
        asked, closed = self.asked, found.closed
        self.counts["samples"] += int(closed.sum())
        if closed.any() and not asked.errors:
            pose, off = self.numbers.engine.measured(found.q[closed])
            away = np.abs(pose[:, asked.chosen] - asked.targets(u)[closed]) / asked.units[asked.chosen]
            wrong = np.abs(pose - found.pose[closed]) / asked.units
            self.counts["samples measured by MuJoCo"] += len(pose)
            if max(wrong.max(), away.max(), off.max()) > ROUNDING:
                words = (
                    f"loops are open by {off.max():.1e}, poses off by {wrong.max():.1e}, targets by {away.max():.1e}"
                )
                self.faults.append(f"MuJoCo contradicts the samples: {words}")
        is_reached = not any(each.name.startswith("reach") and each.fails for each in self.judgement.extremes)
        if self.judgement.is_regular and is_reached and not closed.all():
            at = asked.targets(u[~closed][:1])[0].tolist()
            self.faults.append(f"reach is proved, and {int((~closed).sum())} samples do not close, such as {at}")

    def _taken(self) -> list[Taken]:
        """Return the robot at the poses of all verdicts, in their order."""
        found: list[Taken] = [Taken(None, self.mechanism.exact, np.zeros(6), np.inf)] * len(self.judgement.verdicts)
        places = [k for k, each in enumerate(self.judgement.verdicts) if each.pose is not None]
        if not places:
            return found
        poses = [self.judgement.verdicts[k].pose for k in places]
        errors = np.concatenate([self._errors(self.judgement.verdicts[k].errors) for k in places])
        R = np.array([each.rotation for each in poses if each is not None])
        turns = cayley_of(R) if self.mechanism.is_ball else angles_of(R)
        at = np.concatenate([[each.position for each in poses if each is not None], turns], 1)
        middle = self.asked.targets(np.full((1, len(self.asked.chosen)), 0.5))[0]
        there = self.mechanism.assembled(self.asked.chosen, middle, at[:, self.asked.chosen], errors)
        away = np.where(there.closed, np.abs((there.pose - at) / self.asked.units).max(1), np.inf)
        for j, k in enumerate(places):
            own = Assembly(*(each[j : j + 1] for each in there))
            found[k] = Taken(own, errors[j : j + 1], at[j], float(away[j]))
        return found

    def _ranks(self) -> None:
        """Attack verdicts on ranks: by all samples, and at the poses that refute them."""
        spectra = self.mechanism.ranks(self.q, self.errors)
        for word, verdict, taken in zip(("regular", "constraints"), self.judgement.ranks, self.taken, strict=False):
            key, last = ("locked", 5) if word == "regular" else ("free", 5 - self.mechanism.freedoms)
            self.counts[f"{self.robot}: {word} {verdict.outcome.value}"] += 1
            least, signs = getattr(spectra, key)[:, last].min(), set(spectra.sign.tolist())
            if verdict.outcome is Outcome.PROVED and (least < ROUNDING or (key == "locked" and len(signs) > 1)):
                self.faults.append(f"{word} is proved, the least singular value is {least:.2e}, and signs are {signs}")
            elif verdict.outcome is Outcome.REFUTED and taken.there is not None:
                value = getattr(self.mechanism.ranks(taken.there.q, taken.errors), key)[0, last]
                # Closing at a singular pose is exact to the square root of rounding.
                if not self.asked.has(taken.at) or value > SINGULAR:
                    words = f"{self._said(taken)}, where the value is {value:.2e}"
                    self.faults.append(f"{word} is refuted {words}")

    def _extremes(self) -> None:
        """Attack bounds and limits of numbers, by all samples and by ascents from the best, and poses of the answer."""
        near = []
        for each, taken in zip(self.judgement.extremes, self.taken[len(self.judgement.ranks) :], strict=True):
            name, sign, what = name_of(each), each.sense.sign, f"{each.name} {each.sense.value}"
            kind = re.split(r" limb| actuator |\.", name)[0]
            self.counts[f"{self.robot}: {kind} {each.outcome.value}"] += 1
            if kind == "reach" and each.outcome is Outcome.REFUTED and self.is_whole:
                self.faults.append(f"{name} is refuted {self._said(taken)}, and all samples close")
            if name not in self.values:
                self.counts[f"not judged: {kind}"] += 1
                continue
            best, scale = float((sign * self.values[name]).max() * sign), self._scale(name)
            slack = ROUNDING * (abs(best) + scale)
            if np.isfinite(each.bound):
                if sign * (best - each.bound) > slack:
                    self.faults.append(f"{what}: bound {each.bound:.12g}, sampled {best:.12g}")
                near.append((sign * (each.bound - best) / scale, len(near), each))
            limit = each.limit
            if (
                limit is not None
                and each.outcome is Outcome.PROVED
                and sign * (best - limit) > slack + 1e-9 * abs(limit)
            ):
                self.faults.append(f"{what}: proved within {limit:.12g}, sampled {best:.12g}")
            self._pose_of(each, name, taken, f"{what} {each.outcome.value}")
        near.sort(key=lambda item: item[:2])
        for room, place, each in near:
            name, sign = name_of(each), each.sense.sign
            self.counts["bounds"] += 1
            if place in [item[1] for item in near[: self.ascents]]:
                best, self.counts["ascents"] = self._ascended(name, sign), self.counts["ascents"] + 1
                if sign * (best - each.bound) > ROUNDING * (abs(best) + self._scale(name)):
                    what = f"{each.name} {each.sense.value}"
                    self.faults.append(f"{what}: bound {each.bound:.12g}, ascended {best:.12g}")
            if room * self._scale(name) > WIDE * (np.ptp(self.values[name]) + self._scale(name)):
                self.counts["wide bounds"] += 1

    def _said(self, taken: Taken) -> str:
        return f"at {taken.at.tolist()} (inside: {self.asked.has(taken.at)}, off by {taken.away:.1e})"

    def _pose_of(self, each: Verdict, name: str, taken: Taken, what: str) -> None:
        """Attack the pose of a number: it is in the workspace, the robot takes it, and has the number there."""
        if taken.there is None:
            return
        if not self.asked.has(taken.at) or taken.away > SAME:
            self.faults.append(f"{what}: no pose of the robot in the workspace, {self._said(taken)}")
            return
        value = float(self.numbers.of(taken.there, taken.errors)[name][0])
        if abs(value - each.reached) > 1e-6 * (abs(each.reached) + self._scale(name)):
            self.faults.append(f"{what}: reached {each.reached:.12g}, and {value:.12g} there")
        is_violated = each.limit is None or each.sense.sign * (value - each.limit) > -1e-12 * abs(each.limit)
        if each.outcome is Outcome.REFUTED and not is_violated:
            self.faults.append(f"{what}: the limit is {each.limit:.12g}, and the value {value:.12g} there")

    def _scale(self, name: str) -> float:
        """Return the size of a number beside which its rounding counts."""
        if name in self.asked.names:
            return 1e-2 * float(self.asked.units[self.asked.names.index(name)])
        if "length" in name:
            return 1e-2 * self.mechanism.size
        return 1e-2 * float(np.abs(self.values[name]).max()) if name == "F" or "force" in name else 1e-2

    def _errors(self, machine: Any) -> Array:  # noqa: ANN401 - errors by name, or None
        """Return the errors (1, c, 3) of a robot of the answer."""
        own, robot = self.mechanism.exact.copy(), self.mechanism.robot
        turns = [turn for chain in robot.chains for turn in chain.turns]
        names = [robot.places[turn.coordinate] + (", other end" if turn.factor < 0 else "") for turn in turns]
        for name, vector in zip(machine.names, machine.vectors, strict=True) if machine is not None else ():
            for turn in (each for each, known in zip(turns, names, strict=True) if known == name):
                own[0, turn.centre] = vector
        return own

    def _ascended(self, name: str, sign: float) -> float:
        """Return the largest value, or the smallest one, from shrinking samples about the best ones."""
        at, width, largest = sign * self.values[name], 0.1, self.asked.errors
        best = np.argsort(-at)[:6]
        u, errors, at = self.u[best], self.errors[best], at[best]
        for _ in range(10):
            v = np.clip(np.repeat(u, 8, 0) + width * self.rng.normal(size=(8 * len(u), u.shape[1])), 0, 1)
            e = np.repeat(errors, 8, 0) + 2 * width * self.numbers.random_errors(self.rng, 8 * len(u))
            e *= np.minimum(1, largest / np.maximum(np.linalg.norm(e, axis=2, keepdims=True), 1e-300))
            values, found = self.numbers.at(v, e)
            u, errors = np.concatenate([u, v]), np.concatenate([errors, e])
            at = np.concatenate([at, np.where(found.closed, sign * values[name], -np.inf)])
            best = np.argsort(-at)[:6]
            u, errors, at, width = u[best], errors[best], at[best], 0.5 * width
        return sign * float(at[0])


def judged(asked: Asked, **options: Any) -> Judgement:  # noqa: ANN401 - of judge_workspace
    """Return the package's answer; the robot's file is put beside the case."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        case.write_text(text_of(asked.tables), encoding="utf-8")
        name = asked.tables["robot"].get("file")
        if name:
            (Path(folder) / name).write_bytes(FILES[Path(name).stem].read_bytes())
        return judge_workspace(load_case(str(case)), jobs=1, **options)
