"""Robots with fewer than six degrees of freedom, closed from home: every sample keeps the home assembly mode.

A robot is a set of chains of turns and slides, closed in pairs. The independent coordinates of the pose are given, and
Newton's method over joint coordinates finds the rest: from home to the middle of a box, and from there to each sample.
MuJoCo then measures the same joint coordinates (``engine.py``). Angles are radians.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from legs import Array, turned
from robots import Chain, Robot, Turn, cross_matrix, evaluated

Tables = dict[str, Any]
#: Coordinates of a pose: with the rotation ``Rz(yaw) Ry(pitch) Rx(roll)``, or with its Cayley vector.
POSE = ("x", "y", "z", "roll", "pitch", "yaw")
BALL = ("x", "y", "z", "cayley_x", "cayley_y", "cayley_z")
#: Residual of loops, in parts of the robot's size and radians, at which a sample is closed.
CLOSED = 1e-12
#: Steps of Newton's method at each point of a path.
NEWTON = 12
#: Largest change of a joint, in radians or parts of the robot's size, between two points of a path.
JUMP = 0.5
#: Singular values below this part of the largest one are zero.
ZERO = 1e-7
#: Samples that are closed at once: more do not fit into a processor's cache.
BLOCK = 1024


class Assembly(NamedTuple):
    """Closed configurations: joint coordinates (N, joints), poses (N, 6), and whether each one is closed (N,)."""

    q: Array
    pose: Array
    closed: Array


class Spectra(NamedTuple):
    """Singular values (N, 6) of the platform's motions with actuators locked, and with actuators free, and signs (N,).

    The sign is that of the determinant of loops and platform with actuators locked, where these equations are as many
    as the unknowns; else 0.
    """

    locked: Array
    free: Array
    sign: Array


class Mechanism:
    """A robot of a robot file, by limbs or by links and joints, with numbers for its dimensions.

    Attributes:
        robot: its chains, joint coordinates and centres.
        pairs: pairs of chains whose ends are one link; the first chain ends at the platform.
        couplings: (c, count) coefficients of couplings between joint coordinates.
        size: length by which lengths are divided.
        owners: limb or name of each actuator, in the order of ``robot.actuated``.
        is_ball: whether rotations have the components of a Cayley vector in the place of roll, pitch and yaw.
    """

    is_ball = False

    def __init__(self, tables: Tables, values: dict[str, float]) -> None:
        dimensions = tables.get("dimensions", {})
        numbers = {key: values.get(key, item["typical"]) for key, item in dimensions.items()}
        numbers = {
            key: np.radians(each) if dimensions[key].get("kind") == "angle" else each for key, each in numbers.items()
        }
        self.couplings = np.zeros((0, 0))
        if "limb" in tables:
            self.robot: Robot = Robot(tables["name"], numbers, tables)
            self.pairs = [(k, 0) for k in range(1, len(self.robot.chains))]
            self.couplings = np.zeros((0, self.robot.count))
            words = [table.get("name") for table in tables["limb"] for _ in range(_copies(table))]
            self.owners = [
                words[int(self.robot.places[k].partition(":")[0]) - 1] or self.robot.places[k].partition(":")[0]
                for k in self.robot.actuated
            ]
        else:
            linked = LinkRobot(tables, numbers)
            self.robot, self.pairs, self.couplings = linked, linked.pairs, linked.couplings
            self.owners = [linked.places[k] for k in linked.actuated]
        points = np.concatenate([self.robot.points_array, self.robot.home[None]])
        self.size = float(np.abs(points - points.mean(0)).max())
        self.scale = np.where(self.robot.slides, self.size, 1.0)

    @property
    def exact(self) -> Array:
        """Errors (1, c, 3) of joint centres of the design: none."""
        return np.zeros((1, *self.robot.points_array.shape))

    @property
    def home(self) -> Array:
        """Joint coordinates (1, count) at home."""
        return np.zeros((1, self.robot.count))

    @property
    def freedoms(self) -> int:
        """Number of degrees of freedom of the platform at home."""
        return 6 - int((self.ranks(self.home, self.exact).free[0] > ZERO).sum())

    def moved(self, q: Array, errors: Array) -> tuple[Array, Array]:
        """Return displacements (N, chains, 4, 4) and screws (N, chains, 6, count) of all chains.

        Args:
            q: (N, count) joint coordinates.
            errors: (N, c, 3) of joint centres, or (1, c, 3) of all.
        """
        points = np.broadcast_to(self.robot.points_array + errors, (len(q), *self.robot.points_array.shape))
        T, S, _ = self.robot.moved(q, points)
        return T, S

    def poses(self, T: Array) -> Array:
        """Return the coordinates (N, 6) of the platform, displaced by T."""
        R = T[:, 0, :3, :3]
        p = np.einsum("nij,j->ni", R, self.robot.home) + T[:, 0, :3, 3]
        return np.concatenate([p, cayley_of(R) if self.is_ball else angles_of(R)], 1)

    def rates(self, T: Array, S: Array) -> Array:
        """Return the derivatives (N, 6, count) of the platform's coordinates."""
        pose, screws = self.poses(T), S[:, 0]
        linear = screws[:, :3] + np.cross(screws[:, 3:], pose[:, :3, None], axis=1)
        if self.is_ball:
            r = pose[:, 3:]
            turning = (np.eye(3) + r[:, :, None] * r[:, None] - cross_matrix(r)) @ screws[:, 3:] / 2
        else:
            z = turned(np.broadcast_to([0.0, 0.0, 1.0], (len(pose), 3)), pose[:, 5])
            y = z @ turned(np.broadcast_to([0.0, 1.0, 0.0], (len(pose), 3)), pose[:, 4])
            axes = np.stack([y[:, :, 0], z[:, :, 1], np.broadcast_to([0.0, 0.0, 1.0], (len(pose), 3))], 2)
            turning = np.linalg.solve(axes, screws[:, 3:])
        return np.concatenate([linear, turning], 1)

    def loops(self, q: Array, T: Array, S: Array) -> tuple[Array, Array]:
        """Return the residuals (N, e) of loops and couplings, and their derivatives (N, e, count)."""
        r, A = [q @ self.couplings.T], [np.broadcast_to(self.couplings, (len(q), *self.couplings.shape))]
        parts = np.repeat([1 / self.size, 1.0], 3)
        for one, other in self.pairs:
            Q = T[:, other, :3, :3] @ np.swapaxes(T[:, one, :3, :3], 1, 2)
            v = T[:, other, :3, 3] - np.einsum("nij,nj->ni", Q, T[:, one, :3, 3])
            w = np.stack([Q[:, 2, 1] - Q[:, 1, 2], Q[:, 0, 2] - Q[:, 2, 0], Q[:, 1, 0] - Q[:, 0, 1]], 1) / 2
            r.append(np.concatenate([v, w], 1) * parts)
            A.append((S[:, other] - S[:, one]) * parts[:, None])
        return np.concatenate(r, 1), np.concatenate(A, 1)

    def close(self, chosen: Sequence[int], targets: Array, q: Array, errors: Array) -> tuple[Array, Array]:
        """Return joint coordinates near q at which loops close and the chosen coordinates have their targets.

        Args:
            chosen: indices of the independent coordinates of the pose.
            targets: (N, k) their values.
            q: (N, count) joint coordinates to start from.
            errors: (N, c, 3) of joint centres.

        Returns:
            joint coordinates, and whether each sample is closed and near its start.
        """
        first, q, off = q, q.copy(), np.full(len(q), np.inf)
        parts = np.array([1 / self.size if k < 3 else 1.0 for k in chosen])
        todo = np.arange(len(q))
        for last in range(NEWTON + 1):
            T, S = self.moved(q[todo], errors[todo])
            r, A = self.loops(q[todo], T, S)
            more = (self.poses(T)[:, chosen] - targets[todo]) * parts
            r = np.concatenate([r, more], 1)
            A = np.concatenate([A, self.rates(T, S)[:, chosen] * parts[:, None]], 1) * self.scale
            off[todo] = np.abs(r).max(1)
            left = off[todo] > CLOSED / 100
            if not left.any() or last == NEWTON:
                break
            todo, A, r = todo[left], A[left], r[left]
            step = _least(A, r)
            large = np.abs(step).max(1, keepdims=True)
            q[todo] -= step * np.minimum(1.0, JUMP / np.maximum(large, 1e-300)) * self.scale
        near = np.abs((q - first) / self.scale).max(1) < JUMP
        return q, (off < CLOSED) & near

    def follow(
        self, chosen: Sequence[int], start: Array, targets: Array, q: Array, errors: Array, steps: int
    ) -> tuple[Array, Array]:
        """Return joint coordinates at targets along straight lines from a start, and whether each point closed."""
        good, before = np.ones(len(targets), bool), q
        for k in range(1, steps + 1):
            # The change of the step before is a first guess of the next one: a secant.
            guess, before = (q if k == 1 else 2 * q - before), q
            q, closed = self.close(chosen, start + (targets - start) * (k / steps), guess, errors)
            good &= closed
        return q, good

    def assembled(
        self, chosen: Sequence[int], middle: Array, targets: Array, errors: Array | None = None, steps: int = 6
    ) -> Assembly:
        """Return the robot in its home assembly mode at targets of its independent coordinates.

        Args:
            chosen: indices of the independent coordinates of the pose.
            middle: (k,) their values in the middle of the box.
            targets: (N, k) values of the samples.
            errors: (N, c, 3) of joint centres of the samples; none if left out.
            steps: from home to the middle of the box, and from there to each sample. A sample that does not close
                takes eight times as many.
        """
        chosen, n = list(chosen), len(targets)
        errors = np.broadcast_to(self.exact, (n, *self.exact.shape[1:])) if errors is None else errors
        home = self.poses(self.moved(self.home, self.exact)[0])[:, chosen]
        q, good, pose = np.zeros((n, self.robot.count)), np.zeros(n, bool), np.zeros((n, 6))

        def through(which: Any, number: int) -> tuple[Array, Array]:  # noqa: ANN401 - indices
            at, reached = self.follow(
                chosen, home, np.repeat(middle[None], len(targets[which]), 0), begin(which), errors[which], number
            )
            end, closed = self.follow(chosen, middle, targets[which], at, errors[which], number)
            return end, reached & closed

        def begin(which: Any) -> Array:  # noqa: ANN401
            return np.zeros((len(targets[which]), self.robot.count))

        for block in _blocks(n):
            q[block], good[block] = through(block, steps)
            bad = block.start + np.flatnonzero(~good[block])
            if bad.size:
                q[bad], good[bad] = through(bad, 8 * steps)
            pose[block] = self.poses(self.moved(q[block], errors[block])[0])
        return Assembly(q, pose, good)

    def ranks(self, q: Array, errors: Array) -> Spectra:
        """Return what holds the platform with actuators locked, and with actuators free.

        A twist of the platform, with rotations times the size, less what passive joints, or all joints, can follow. It
        is held where the least value is above 0.
        """
        found: list[list[Array]] = [[], [], []]
        passive = [k for k in range(self.robot.count) if k not in self.robot.actuated]
        errors = np.broadcast_to(errors, (len(q), *errors.shape[1:]))
        for block in _blocks(len(q)):
            T, S = self.moved(q[block], errors[block])
            _, A = self.loops(q[block], T, S)
            pose, n = self.poses(T), len(T)
            linear = S[:, 0, :3] + np.cross(S[:, 0, 3:], pose[:, :3, None], axis=1)
            platform = np.concatenate([linear / self.size, S[:, 0, 3:]], 1)
            M = np.concatenate([A, -platform], 1) * self.scale
            X = np.concatenate([np.zeros((n, A.shape[1], 6)), np.tile(np.eye(6), (n, 1, 1))], 1)
            for place, columns in enumerate((passive, list(range(self.robot.count)))):
                U, s, _ = np.linalg.svd(M[:, :, columns], full_matrices=False)
                U = U * (s > ZERO * s[:, :1])[:, None]
                found[place].append(np.linalg.svd(X - U @ (np.swapaxes(U, 1, 2) @ X), compute_uv=False))
            square = np.concatenate([X, M[:, :, passive]], 2)
            is_square = square.shape[1] == square.shape[2]
            found[2].append(np.linalg.slogdet(square)[0] if is_square else np.zeros(n))
        return Spectra(*(np.concatenate(each) for each in found))

    def leg_lengths(self, q: Array) -> dict[str, Array]:
        """Return the lengths (N,) of driven legs by owner: slides along the line of the joints before and behind."""
        found: dict[str, Array] = {}
        for (k, owner), chain in itertools.product(
            zip(self.robot.actuated, self.owners, strict=True), self.robot.chains
        ):
            places = [each.coordinate for each in chain.turns]
            place = places.index(k) if k in places else 0
            if not (0 < place < len(places) - 1 and chain.turns[place].slides) or chain.turns[place - 1].slides:
                continue
            one, other = (self.robot.points_array[chain.turns[place + by].centre] for by in (-1, 1))
            if np.linalg.norm(np.cross(other - one, chain.turns[place].axis)) < 1e-9 * self.size:
                found[owner] = np.abs((other - one) @ chain.turns[place].axis + q[:, k])
        return found


class LinkRobot(Robot):
    """A robot of a file with links and joints: chains along a spanning tree, a pair for each joint that closes a loop.

    Attributes:
        pairs: pairs of chains whose ends are one link.
        couplings: (c, count) coefficients of couplings.
    """

    def __init__(self, tables: Tables, numbers: dict[str, float]) -> None:
        names: dict[str, Any] = dict(numbers)
        for key, text in tables.get("derived", {}).items():
            names[key] = evaluated(text, names)
        self.home = evaluated(tables["home"], names)
        self.limbs = []
        for key, text in tables.get("points", {}).items():
            names[key] = evaluated(text, names)
        self.points: list[Array] = []
        self.labels: list[tuple[str, int]] = []
        self.actuated: list[int] = []
        self.slides: list[bool] = []
        self.places: list[str] = []
        joints = [(each["between"], self._joint(each, names)) for each in tables["joint"]]
        base, platform = tables.get("base", "base"), tables.get("platform", "platform")
        trees: dict[str, list[Turn]] = {base: []}
        chords = joints
        grown = True
        while grown:
            grown = False
            for each in list(chords):
                (inner, outer), turns = each
                if inner in trees and outer not in trees:
                    trees[outer] = trees[inner] + turns
                elif outer in trees and inner not in trees:
                    trees[inner] = trees[outer] + _reversed(turns)
                else:
                    continue
                chords = [other for other in chords if other is not each]
                grown = True
        self.chains = [self._chain(trees[platform])]
        self.pairs = []
        for (inner, outer), turns in chords:
            self.pairs.append((len(self.chains), len(self.chains) + 1))
            self.chains += [self._chain(trees[inner] + turns), self._chain(trees[outer])]
        self.count, self.points_array = len(self.labels), np.array(self.points)
        self.couplings = np.zeros((len(tables.get("coupling", [])), self.count))
        for row, each in zip(self.couplings, tables.get("coupling", []), strict=True):
            for name, factor in each["factors"].items():
                row[self.places.index(name)] = evaluated(factor, names)

    def _joint(self, table: Tables, names: dict[str, Any]) -> list[Turn]:
        """Return the turns of a joint, from its first link to its second one."""
        kind, found = table["type"], list[Turn]()
        if kind == "weld":
            return found
        self.points.append(np.asarray(evaluated(table["at"], names), float))
        texts = {"U": table.get("axes"), "S": ["x", "y", "z"]}.get(kind) or [table["axis"]]
        for k, text in enumerate(texts):
            axis = np.array(evaluated(text, names), float)
            axis = axis / np.linalg.norm(axis)
            if kind == "U" and k == 1:
                axis = axis - found[0].axis * (axis @ found[0].axis)
                axis /= np.linalg.norm(axis)
            self.labels.append((table["name"] if kind != "S" else "", k if kind == "U" else -1))
            self.slides.append(kind == "P")
            self.places.append(table["name"])
            if table.get("actuated"):
                self.actuated.append(len(self.labels) - 1)
            found.append(Turn(len(self.labels) - 1, 1.0, len(self.points) - 1, axis, kind == "P"))
        return found

    @staticmethod
    def _chain(turns: list[Turn]) -> Chain:
        return Chain(turns, 1, (0, turns[0].centre if turns else 0))


def mechanism_of(path: Path, values: dict[str, float] | None = None) -> Mechanism:
    """Return the robot of a file, its dimensions typical where they are not given; angles are degrees."""
    return Mechanism(tomllib.loads(path.read_text(encoding="utf-8")), values or {})


def angles_of(R: Array) -> Array:
    """Return roll, pitch and yaw (N, 3) of rotations."""
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 2, 1], R[:, 2, 2]))
    return np.stack([np.arctan2(R[:, 2, 1], R[:, 2, 2]), pitch, np.arctan2(R[:, 1, 0], R[:, 0, 0])], 1)


def cayley_of(R: Array) -> Array:
    """Return the Cayley vectors (N, 3) of rotations, ``tan(angle / 2) axis``."""
    v = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], 1)
    return np.asarray(v / (1 + np.trace(R, axis1=1, axis2=2))[:, None])


def rotation_of(angles: Array) -> Array:
    """Return the rotations (N, 3, 3) with roll, pitch and yaw (N, 3)."""
    x, y, z = (turned(np.broadcast_to(axis, angles.shape), angles[:, k]) for k, axis in enumerate(np.eye(3)))
    return np.asarray(z @ y @ x)


def choices(mechanism: Mechanism, q: Array, least: float = 0.05) -> Iterator[tuple[int, ...]]:
    """Yield the sets of coordinates of the pose that a robot can choose at joint coordinates (1, count).

    Args:
        mechanism: the robot.
        q: joint coordinates.
        least: of the smallest singular value of the chosen coordinates' rates, beside that of all six.
    """
    T, S = mechanism.moved(q, mechanism.exact)
    _, A = mechanism.loops(q, T, S)
    _, s, V = np.linalg.svd(A[0] * mechanism.scale)
    rank = int((s > ZERO * s.max(initial=1e-300)).sum())
    motions = mechanism.rates(T, S)[0] * mechanism.scale @ V[rank:].T
    motions[:3] /= mechanism.size
    _, s, V = np.linalg.svd(motions, full_matrices=False)
    freedoms = int((s > ZERO * s[0]).sum())
    basis = motions @ V[:freedoms].T / s[:freedoms]
    for chosen in itertools.combinations(range(6), freedoms):
        if np.linalg.svd(basis[list(chosen)], compute_uv=False)[-1] > least:
            yield chosen


def _least(A: Array, r: Array) -> Array:
    """Return the least steps (N, n) with ``A step = r``, where equations may follow from each other."""
    if A.shape[1] <= A.shape[2]:
        G = A @ np.swapaxes(A, 1, 2)
        G += 1e-12 * np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(G.shape[1])
        return np.asarray(np.einsum("nij,ni->nj", A, np.linalg.solve(G, r[:, :, None])[:, :, 0]))
    G = np.swapaxes(A, 1, 2) @ A
    G += 1e-12 * np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(G.shape[1])
    return np.asarray(np.linalg.solve(G, np.einsum("nij,ni->nj", A, r)[:, :, None])[:, :, 0])


def _blocks(count: int) -> list[slice]:
    return [slice(k, min(k + BLOCK, count)) for k in range(0, count, BLOCK)]


def _copies(table: Tables) -> int:
    repeat = table.get("repeat", {"count": 1})
    return len(repeat["angles"]) if "angles" in repeat else int(repeat["count"])


def _coordinates(chain: Chain) -> list[int]:
    return [each.coordinate for each in chain.turns]


def _reversed(turns: Sequence[Turn]) -> list[Turn]:
    return [each._replace(factor=-each.factor) for each in reversed(turns)]
