"""Motor sheets of random workspaces: proved forces, speeds and powers attacked by samples and local ascents.

    python bench/soundness/motors.py hexapods COUNT FIRST [JOURNAL]
    python bench/soundness/motors.py gallery COUNT FIRST [JOURNAL]

Straight legs are those of ``legs.py``, robots of the gallery those of ``robots.py``: closed loops, and motions of the
platform from screws of joints. A row has ``tightness``: distances of bounds from values reached, and from values
sampled, in parts of the largest bound of the number in both senses; and ``open``: seconds that each open number took.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from campaign import Row, campaign
from gallery import NAMES, STEPS, Sampled, between, random_gallery
from legs import Array, Box, Poses, Tables, turned
from loads import Key, Loading, actuator_limits, random_loading
from randomcases import random_legs, text_of
from robots import close, motions
from workspaces import Machines

from screwsynth.nlp import CaseError, Judgement, Verdict, judge_workspace, load_case

SAMPLES, BLOCK, ROUNDING = 100_000, 4096, 1e-9
#: Poses that are tried at most: those of fewer freedoms may close outside of the workspace.
MOST = 250_000
#: Part of a load times a motion below which numbers are parts of this: those that are 0 at every pose are rounding.
SMALL = 1e-3
#: How far outside of the workspace, in parts of it and radians, a pose still counts as inside: closed by rounding.
INSIDE = 1e-10
#: How far outside a closed pose may be for a further one near it in the workspace.
NEAR = 0.05
#: Best points of each number from which ascents begin, children of each, and steps.
PARENTS, CHILDREN, ASCENTS = 4, 6, 20
#: Poses from which other ones are closed.
ANCHORS = 512


class Points(NamedTuple):
    """Coordinates (N, n) of poses between 0 and 1, errors (N, ..., 3) of joint centres, and joints (N, j)."""

    u: Array
    errors: Array
    q: Array

    def some(self, which: Array) -> Points:
        return Points(*(each[which] for each in self))


def joined(parts: list[Points]) -> Points:
    return Points(*(np.concatenate(each) for each in zip(*parts, strict=True)))


class Subject(Protocol):
    """Poses and machines of a case.

    Attributes:
        keys, names: numbers, and actuators.
        products: (K,) sizes of loads and motions that the numbers are compared with.
    """

    box: Box
    t: float
    keys: list[Key]
    names: list[str]
    products: Array

    def sample(self, rng: np.random.Generator, count: int) -> Points: ...

    def at(self, points: Points) -> tuple[Points, Array]:
        """Return points with closed loops, and numbers (N, K), which are -inf outside of the workspace."""

    def at_pose(self, poses: Poses) -> tuple[Array, bool]:
        """Return the numbers (K,) of the design at a pose of a result, and whether its loops are closed."""


class LegSubject:
    """Straight legs."""

    def __init__(self, tables: Tables, rng: np.random.Generator) -> None:
        self.machines, self.loading = Machines(tables, rng), Loading(tables)
        self.box, self.t, self.names = self.machines.box, self.machines.t, self.machines.legs.names
        self.keys = self.loading.keys(len(self.names))
        poses = self.box.poses(self.box.sample(np.random.default_rng(0), ANCHORS))
        length = float(np.linalg.norm(self.machines.legs.platform, axis=1).mean())
        self.products = self.loading.products(self.motions(poses, np.zeros((1, 2, 1, 3))), length)

    def sample(self, rng: np.random.Generator, count: int) -> Points:  # noqa: ARG002 - machines have the same ones
        u, errors = self.machines.sample(count)
        return Points(u, errors * bool(self.t), np.zeros((count, 0)))

    def at(self, points: Points) -> tuple[Points, Array]:
        return points, self.of(self.box.poses(points.u), points.errors)

    def at_pose(self, poses: Poses) -> tuple[Array, bool]:
        return self.of(poses, np.zeros((1, 2, len(self.names), 3)))[0], True

    def of(self, poses: Poses, errors: Array) -> Array:
        """Return the numbers (N, K) of poses and machines."""
        return self.loading.numbers(self.motions(poses, errors), poses.R)

    def motions(self, poses: Poses, errors: Array) -> Array:
        """Return the motions (N, 6, a) of the platform by each leg alone, columns of J's inverse."""
        legs = self.machines.legs
        base, arms = legs.base + errors[:, 0], np.einsum("nij,nkj->nki", poses.R, legs.platform + errors[:, 1])
        d = poses.p[:, None] + arms - base
        J = legs.rows(d / np.linalg.norm(d, axis=2, keepdims=True), base, arms, poses.R)[1]
        return np.asarray(np.linalg.inv(J)[:, :, : len(self.names)])


class GallerySubject:
    """A robot of the gallery."""

    def __init__(self, tables: Tables, rng: np.random.Generator) -> None:
        self.sampled, self.loading = Sampled(tables, rng), Loading(tables)
        self.robot, self.box, self.t = self.sampled.robot, self.sampled.box, self.sampled.t
        self.names = [self.robot.places[k].partition(":")[0] for k in self.robot.actuated]
        self.keys = self.loading.keys(len(self.names))
        # A pose of six freedoms need not give way; others have to, and close sooner where they do.
        self.weight = 1e-3 if len(self.names) == 6 else 1e-2
        self.anchors = self._anchors()
        own = self.robot.points_array + self.anchors.errors
        X, _ = motions(self.robot, self.box.poses(self.anchors.u), self.anchors.q, own)
        self.products = self.loading.products(X, float(np.abs(self.robot.points_array).max()))

    def _anchors(self) -> Points:
        """Return closed points, from home through the middle of the workspace."""
        u = self.box.sample(self.sampled.rng, ANCHORS)
        errors = self.sampled.errors(len(u)) * (np.arange(len(u)) % 2)[:, None, None]
        poses, q, good = self._from_home(self.box.poses(u), errors)
        return Points(self.box.within(poses), errors, q).some(good)

    def _from_home(self, meant: Poses, errors: Array) -> tuple[Poses, Array, Array]:
        home, n = Poses(self.robot.home[None], np.eye(3)[None]), len(meant.p)
        middle = self.box.poses(np.full((1, self.box.size), 0.5))
        parts = np.linspace(0, 1, STEPS + 1)[1:]
        path = [Poses(*(np.repeat(part, n, 0) for part in between(home, middle, s))) for s in parts]
        path += [between(path[-1], meant, s) for s in parts]
        return close(self.robot, [*path, meant], self.robot.points_array + errors)

    def sample(self, rng: np.random.Generator, count: int) -> Points:
        u, own = self.box.sample(rng, count), self.anchors.u
        near = np.argmin((own**2).sum(axis=1) - 2 * u @ own.T, axis=1)
        errors = self.sampled.errors(count)
        return Points(u, errors, self.anchors.q[near])

    def at(self, points: Points) -> tuple[Points, Array]:
        """Return points that are closed; a pose that left the workspace as it gave way to its loops is brought back."""
        robot, box = self.robot, self.box
        own = robot.points_array + points.errors
        poses, q, good = close(robot, [box.poses(points.u)], own, self.weight, points.q)
        for _ in range(2):
            off = np.add(*box.outside(poses))
            left = np.flatnonzero(good & (off > INSIDE) & (off < NEAR))
            if left.size:
                back = box.poses(box.within(Poses(poses.p[left], poses.R[left])))
                there, q[left], good[left] = close(robot, [back], own[left], self.weight, q[left])
                poses.p[left], poses.R[left] = there
        good &= np.add(*box.outside(poses)) < INSIDE
        values = np.full((len(q), len(self.keys)), -np.inf)
        if good.any():
            found, residual = self._numbers(poses, q, own, good)
            values[good] = np.where((residual < 1e-8)[:, None], found, -np.inf)
        return Points(self.box.within(poses), points.errors, q), values

    def _numbers(self, poses: Poses, q: Array, own: Array, good: Array) -> tuple[Array, Array]:
        there = Poses(poses.p[good], poses.R[good])
        X, residual = motions(self.robot, there, q[good], own[good])
        return self.loading.numbers(X, there.R), residual

    def differs(self, h: float = 1e-5) -> float:
        """Return how far actuators' rates are from 1 and 0, by differences of closed poses along each motion."""
        points = self.anchors.some(np.arange(8))
        own, worst = self.robot.points_array + points.errors, 0.0
        poses, q, _ = close(self.robot, [self.box.poses(points.u)], own, start=points.q)
        X, _ = motions(self.robot, poses, q, own)
        for k in range(X.shape[2]):
            ends = []
            for x in (h * X[:, :, k], -h * X[:, :, k]):
                R = turned(x[:, 3:], np.linalg.norm(x[:, 3:], axis=1)) @ poses.R
                there, joints, _ = close(self.robot, [Poses(poses.p + x[:, :3], R)], own, start=q)
                ends.append(joints[:, self.robot.actuated])
                worst = max(worst, float(np.abs(there.R - R).max()) / h)
            rates = (ends[0] - ends[1]) / (2 * h)
            worst = max(worst, float(np.abs(rates - np.eye(X.shape[2])[k]).max()))
        return worst

    def at_pose(self, poses: Poses) -> tuple[Array, bool]:
        errors = np.zeros((1, *self.robot.points_array.shape))
        there, q, good = self._from_home(poses, errors)
        size = np.abs(self.robot.points_array).max()
        moved = max(float(np.abs(there.p - poses.p).max() / size), float(np.abs(there.R - poses.R).max()))
        if not good[0] or moved > 1e-7:
            return np.full(len(self.keys), np.nan), False
        return self._numbers(there, q, self.robot.points_array + errors, good)[0][0], True


def attacked(subject: Subject, rng: np.random.Generator) -> tuple[Array, int]:
    """Return the largest values (K,) of samples and of ascents from the best ones, and the number of samples inside."""
    best, values, inside, drawn = [], [], 0, 0
    while inside < SAMPLES and drawn < MOST:
        points, found = subject.at(subject.sample(rng, BLOCK))
        drawn += BLOCK
        inside += int(np.isfinite(found[:, 0]).sum())
        kept = np.unique(np.argsort(-found, axis=0)[:PARENTS])
        best.append(points.some(kept))
        values.append(found[kept])
    return ascended(subject, joined(best), np.concatenate(values), rng), inside


def ascended(subject: Subject, points: Points, values: Array, rng: np.random.Generator) -> Array:
    """Return the largest values (K,), by shrinking samples about the best points of each number."""
    K = len(subject.keys)
    first = np.argsort(-values, axis=0)[:PARENTS].T  # (K, parents)
    at, level = points.some(first.ravel()), np.take_along_axis(values.T, first, axis=1)
    number, width = np.repeat(np.arange(K), PARENTS), 0.2
    for step in range(ASCENTS):
        if subject.t and step % 7 == 0:
            at, level = steepest(subject, at, level, number)
        u, errors, q = (np.repeat(each, CHILDREN, 0) for each in at)
        u = np.clip(u + width * rng.normal(size=u.shape) * (rng.random(u.shape) < 0.6), 0, 1)
        if subject.t:
            errors = within(errors + 2 * width * subject.t * rng.normal(size=errors.shape), subject.t)
        new, found = subject.at(Points(u, errors, q))
        every = joined([at, new])
        whole = np.concatenate([level.ravel(), found[np.arange(len(found)), np.repeat(number, CHILDREN)]])
        rows = np.concatenate(
            [np.arange(K * PARENTS).reshape(K, -1), K * PARENTS + np.arange(len(u)).reshape(K, -1)], 1
        )
        order = np.argsort(-whole[rows], axis=1)[:, :PARENTS]
        chosen = np.take_along_axis(rows, order, axis=1)
        at, level = every.some(chosen.ravel()), whole[chosen]
        width *= 0.72
    return np.asarray(level[:, 0])


def within(errors: Array, t: float) -> Array:
    """Return errors no larger than the tolerance."""
    return errors * np.minimum(1.0, t / np.maximum(np.linalg.norm(errors, axis=-1, keepdims=True), 1e-300))


def steepest(subject: Subject, at: Points, level: Array, number: Array) -> tuple[Points, Array]:
    """Return points with errors along the differences of each number, where it is larger with them."""
    n, shape = len(at.u), at.errors.shape[1:]
    slopes = np.zeros((n, int(np.prod(shape))))
    rows = np.arange(n)
    for j in range(slopes.shape[1]):
        step = np.zeros(slopes.shape[1])
        step[j] = 0.5 * subject.t
        _, found = subject.at(at._replace(errors=at.errors + step.reshape(shape)))
        slopes[:, j] = np.nan_to_num(found[rows, number] - level.ravel(), posinf=0, neginf=0)
    own = slopes.reshape(n, *shape)
    own = subject.t * own / np.maximum(np.linalg.norm(own, axis=-1, keepdims=True), 1e-300)
    new, found = subject.at(at._replace(errors=own))
    better = found[rows, number] > level.ravel()
    both = joined([at, new]).some(np.where(better, n + rows, rows))
    return both, np.where(better, found[rows, number], level.ravel()).reshape(level.shape)


def key_of(each: Verdict) -> Key:
    """Return the number of a claim."""
    motor = each.motor
    opposite = {"force": "backwards", "power": "braking"} if motor.is_backwards or each.sense.sign < 0 else {}
    return Key(motor.place, opposite.get(motor.number.value, motor.number.value), motor.load)


def compare(subject: Subject, judged: Judgement, rng: np.random.Generator, name: str) -> Row:
    """Attack the numbers of actuators of a judgement."""
    counts, faults, tight, left = Counter[str](), [], [], []
    every = [each for each in judged.extremes if each.motor is not None]
    found = {key_of(each) for each in every}
    if found != set(subject.keys):
        faults.append(f"the numbers differ: {sorted(found ^ set(subject.keys))}")
        return {"counts": counts, "faults": faults}
    best, inside = attacked(subject, rng)
    counts["samples"], counts["numbers"] = inside, len(every)
    if inside < 1000:
        counts[f"{name}: few samples"] += 1
    largest: dict[tuple[int, str], float] = {}
    for each in every:
        at = each.motor.place, "" if key_of(each).word == "speed" else each.motor.number.value + each.motor.load
        known = [abs(value) for value in (each.bound, each.reached) if np.isfinite(value)]
        largest[at] = max([largest.get(at, 0.0), *known])
    for each in every:
        key, sign = key_of(each), each.sense.sign
        where = subject.keys.index(key)
        size = largest[key.place, "" if key.word == "speed" else each.motor.number.value + key.load]
        size = max(size, SMALL * subject.products[where])
        counts[f"{name}: {key.word} {each.outcome.value}{' with a limit' if each.limit is not None else ''}"] += 1
        bound, reached, sampled = sign * each.bound, sign * each.reached, float(best[where])
        said = f"{each.name} {each.sense.value}"
        if subject.names[key.place] != each.motor.actuator:
            faults.append(f"{said}: the actuator is {subject.names[key.place]}")
        if sampled > bound + ROUNDING * size:
            faults.append(
                f"{said}: bound {bound:.12g}, sampled {sampled:.12g}, reached {reached:.12g}, size {size:.6g}"
            )
        limit = None if each.limit is None else sign * each.limit
        if limit is not None and each.outcome.value == "proved" and sampled > limit + 2 * ROUNDING * abs(limit):
            faults.append(f"{said}: proved within {limit:.12g}, sampled {sampled:.12g}")
        if each.pose is not None:
            poses = Poses(np.array([each.pose.position], float), np.array([each.pose.rotation], float))
            there, closed = subject.at_pose(poses)
            length, turn = subject.box.outside(poses)
            # Near a singular pose numbers are large, and their relative errors too.
            slack = (1e-8 if isinstance(subject, LegSubject) else 1e-5) * size
            slack *= 1 + abs(reached) / subject.products[where]
            if not (closed and abs(there[where] - reached) <= slack and length[0] < 1e-8 and turn[0] < 1e-7):
                value = f"{there[where]:.12g} there, closed: {closed}, outside by {length[0]:.1e}, {turn[0]:.1e}"
                faults.append(f"{said}: {each.outcome.value}, reached {reached:.12g}, and {value}")
            elif limit is not None and each.outcome.value == "refuted" and not there[where] > limit:
                faults.append(f"{said}: refuted with the limit {limit:.12g}, and {there[where]:.12g} there")
        elif each.outcome.value == "refuted":
            faults.append(f"{said}: refuted without a pose")
        if np.isfinite(bound) and size > 0:
            tight.append([round((bound - reached) / size, 7), round((bound - sampled) / size, 7)])
        if each.outcome.value == "open":
            left.append([key.word, round(each.seconds, 2), each.reason])
    return {"counts": counts, "faults": faults, "tightness": tight, "open": left}


def judged_case(tables: Tables, seconds: float) -> Judgement:
    """Return the judgement of a case."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(text_of(tables), encoding="utf-8")
        case = load_case(str(path))
    return judge_workspace(case, gap=0.3, time_limit=seconds, jobs=1)


def examined(tables: Tables, subject: Subject, rng: np.random.Generator, name: str, seconds: float) -> Row:
    """Judge a case with random limits near values of its own, and attack the result."""
    if subject.keys and rng.random() < 0.4:
        _, values = subject.at(subject.sample(rng, 512))
        values = values[np.isfinite(values).all(axis=1)]
        if len(values):
            unit = [1.0] * len(subject.names)
            if isinstance(subject, GallerySubject):
                unit = [1.0 if subject.robot.slides[k] else subject.box.unit for k in subject.robot.actuated]
            tables["limits"] = actuator_limits(rng, subject.keys, values, subject.names, unit)
    began = time.perf_counter()
    try:
        judged = judged_case(tables, seconds)
    except CaseError as error:
        return {"counts": {f"refused: {str(error)[:60]}": 1}, "faults": []}
    took = time.perf_counter() - began
    row = compare(subject, judged, rng, name)
    row["counts"][f"{name}: regular {judged.regularity.outcome.value}"] += 1
    return row | {"judged": round(took, 2), "robot": name, "tolerance": subject.t}


def hexapods(seed: int) -> Row:
    """Judge random straight legs over a workspace that is regular at samples, mostly."""
    rng = np.random.default_rng([7, seed])
    while True:
        tables = random_legs(rng)
        size = float(np.abs(Machines(tables, rng).legs.base).max())
        unit = Machines(tables, rng).legs.unit
        tables |= random_loading(rng, size, unit)
        subject = LegSubject(tables, rng)
        values = subject.machines.values(*subject.machines.sample(256))
        if (values["regular"].min() > 0.02 and len(set(np.sign(values["det"]))) == 1) or rng.random() < 0.02:
            break
    return examined(tables, subject, rng, tables["robot"]["model"], 60.0 if subject.t else 40.0)


def gallery(seed: int) -> Row:
    """Judge a random workspace of a robot of the gallery."""
    rng = np.random.default_rng([8, seed])
    tables = random_gallery(rng, NAMES[seed % len(NAMES)])
    size = float(np.abs(Sampled(tables, rng).robot.points_array).max())
    while len(Loading(tables | (loading := random_loading(rng, size))).cases) > 2:
        pass
    tables |= loading
    subject = GallerySubject(tables, rng)
    row = examined(tables, subject, rng, tables["robot"]["model"], 40.0)
    if subject.differs() > 1e-3:
        row["faults"].append(f"motions of the platform differ from closed poses by {subject.differs():.1e}")
    return row


def summary(rows: list[Row]) -> None:
    """Print how far bounds are from values, and how long numbers took that stay open."""
    tight = np.array([each for row in rows for each in row.get("tightness", ())])
    seconds = [each[1] for row in rows for each in row.get("open", ())]
    if len(tight):
        reached, sampled = np.median(tight, axis=0)
        print(f"{len(tight)} bounds, in the median {reached:.2%} from values reached, {sampled:.2%} from samples")
    if seconds:
        print(f"{len(seconds)} numbers open after {np.median(seconds):.1f} s in the median")


if __name__ == "__main__":
    summary(campaign({"hexapods": hexapods, "gallery": gallery}[sys.argv.pop(1)]))
