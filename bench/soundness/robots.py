"""Robots of the gallery from their files, in NumPy: joints moved by exponentials, loops closed by Newton's method.

Every joint is one or more turns or slides about axes at home; a limb is a trunk and branches, each from the base to the
platform. Poses and joints of many machines are computed at once: a pose that a robot cannot have is projected to one
that it can. Ranks are those of velocities, as in docs/formulation.md, and F that of projectors.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from legs import Array, Poses, turned

import screwsynth.models

FOLDER = Path(screwsynth.models.__file__).parent / "robots"
#: Residual of loops, in parts of the robot and radians, that are closed.
CLOSED = 1e-12
#: Steps of Newton's method from joints near those that are meant.
NEWTON = 8


class Turn(NamedTuple):
    """A turn or slide: coordinate, factor, index of its centre, axis at home, whether it slides."""

    coordinate: int
    factor: float
    centre: int
    axis: Array
    slides: bool


class Chain(NamedTuple):
    """The turns from base to platform, the limb, and the member's centre: a turn that carries it, and its point."""

    turns: list[Turn]
    limb: int
    centre: tuple[int, int]


def evaluated(text: Any, names: dict[str, Any]) -> Any:  # noqa: ANN401 - numbers and vectors
    """Return an expression of a robot file."""
    if isinstance(text, list):
        return np.array([evaluated(each, names) for each in text], float)
    own = {name: getattr(math, name) for name in ("sin", "cos", "tan", "sqrt", "pi", "atan2", "asin", "acos")}
    axes = dict(zip("xyz", np.eye(3), strict=True))
    return eval(str(text).replace("^", "**"), own | {"cross": np.cross} | axes, names)  # noqa: S307 - our own files


class Robot:
    """A robot of a file with numbers for its dimensions, angles in radians.

    Attributes:
        home: (3,) position at home.
        points: (c, 3) centres of joints at home.
        chains: of all limbs.
        count: number of joint coordinates.
        labels: label ``limb:place`` and index among its joint's coordinates, of each coordinate; empty for balls.
        actuated: coordinates that are driven.
        slides: whether each coordinate is a length.
        places: label of each coordinate's joint, balls too.
    """

    def __init__(self, name: str, values: dict[str, float], tables: dict[str, Any] | None = None) -> None:
        if tables is None:
            tables = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
        names: dict[str, Any] = dict(values)
        for key, text in tables.get("derived", {}).items():
            names[key] = evaluated(text, names)
        self.home = evaluated(tables["home"], names)
        self.points: list[Array] = []
        self.chains: list[Chain] = []
        self.labels: list[tuple[str, int]] = []
        self.actuated: list[int] = []
        self.slides: list[bool] = []
        self.places: list[str] = []
        limb = 0
        for table in tables["limb"]:
            repeat = table.get("repeat", {"angles": [0]})
            angles = repeat.get("angles") or [360 / repeat["count"] * k for k in range(repeat["count"])]
            axis, through = (
                np.array(repeat.get("axis", [0, 0, 1.0]), float),
                np.array(repeat.get("through", [0, 0, 0.0]), float),
            )
            for angle in angles:
                limb += 1
                R = turned(axis[None], np.array([np.radians(angle)]))[0]
                own = names | {key: evaluated(each, names) for key, each in table.get("points", {}).items()}
                self._limb(table, own, limb, lambda p, R=R, o=through: o + R @ (p - o), R)
        self.count = len(self.labels)
        self.points_array = np.array(self.points)
        #: Chains and coordinates of each limb.
        self.limbs: list[tuple[list[int], list[int]]] = []
        for number in range(1, limb + 1):
            chains = [k for k, each in enumerate(self.chains) if each.limb == number]
            self.limbs.append((chains, sorted({each.coordinate for k in chains for each in self.chains[k].turns})))

    def _limb(self, table: dict[str, Any], names: dict[str, Any], limb: int, placed: Any, R: Array) -> None:  # noqa: ANN401
        centres: dict[tuple[float, ...], int] = {}

        def centre_of(point: Array) -> int:
            key = tuple(np.round(point, 9))
            if key not in centres:
                centres[key] = len(self.points)
                self.points.append(placed(point))
            return centres[key]

        def turns_of(joints: list[dict[str, Any]], prefix: str, first: int) -> list[Turn]:
            found = []
            for place, joint in enumerate(joints, first):
                at = evaluated(joint["at"], names)
                centre, kind = centre_of(at), joint["type"]
                axes = {"U": joint.get("axes"), "S": ["x", "y", "z"]}.get(kind) or [joint["axis"]]
                for k, text in enumerate(axes):
                    a = R @ np.array(evaluated(text, names), float)
                    a /= np.linalg.norm(a)
                    if kind == "S":
                        a = np.eye(3)[k]
                    elif kind == "U" and k == 1:  # perpendicular to the first one
                        b = found[-1].axis
                        a = a - b * (a @ b)
                        a /= np.linalg.norm(a)
                    coordinate = len(self.labels)
                    self.labels.append((f"{prefix}{place}" if kind != "S" else "", k if kind == "U" else -1))
                    self.slides.append(kind == "P")
                    self.places.append(f"{prefix}{place}")
                    if joint.get("actuated"):
                        self.actuated.append(coordinate)
                    found.append(Turn(coordinate, 1.0, centre, a, kind == "P"))
                    if kind == "H":
                        found.append(Turn(coordinate, float(evaluated(joint["pitch"], names)), centre, a, True))
                    if kind == "C":
                        self.labels.append((f"{prefix}{place}", 1))
                        self.slides.append(True)
                        self.places.append(f"{prefix}{place}")
                        found.append(Turn(coordinate + 1, 1.0, centre, a, True))
                    if kind == "Pa":
                        # The other end of the rods has an error of its own.
                        self.points.append(placed(evaluated(joint["to"], names)))
                        found.append(Turn(coordinate, -1.0, len(self.points) - 1, a, False))
            return found

        trunk = turns_of(table["joints"], f"{limb}:", 1)
        branches = table.get("branch") or [{"joints": []}]
        for k, branch in enumerate(branches):
            own = turns_of(branch["joints"], f"{limb}.{k + 1}:", 1 + len(table["joints"]))
            turns = trunk + own
            self.chains.append(Chain(turns, limb, self._centre(turns)))

    def _centre(self, turns: list[Turn]) -> tuple[int, int]:
        """Return the centre of a member: of its ball joint nearest the platform, or where two hinges in a row meet.

        Ends of a parallelogram are no hinges: one that meets a hinge at home is off from it in other machines.
        """
        balls = [k for k, each in enumerate(turns) if not self.labels[each.coordinate][0]]
        if balls:
            return balls[-1], turns[balls[-1]].centre
        rods = {each.coordinate for each in turns if each.factor < 0}
        for k in range(len(turns) - 1, 0, -1):
            one, other = turns[k - 1], turns[k]
            if one.slides or other.slides or rods & {one.coordinate, other.coordinate}:
                continue
            p, q = self.points[one.centre], self.points[other.centre]
            t, _, rank, _ = np.linalg.lstsq(np.stack([one.axis, -other.axis], 1), q - p, rcond=1e-9)
            at = p + t[0] * one.axis
            if rank == 2 and np.linalg.norm(at - q - t[1] * other.axis) < 1e-9:
                if one.centre == other.centre:
                    return k, one.centre
                self.points.append(at)
                return k, len(self.points) - 1
        passive = [k for k, each in enumerate(turns) if each.coordinate not in self.actuated]
        return passive[-1], turns[passive[-1]].centre

    def moved(self, q: Array, points: Array) -> tuple[Array, Array, Array]:
        """Return displacements (N, chains, 4, 4), screws (N, chains, 6, count), and centres (N, chains, 3)."""
        n, m = len(q), len(self.chains)
        T = np.tile(np.eye(4), (n, m, 1, 1))
        S, centres = np.zeros((n, m, 6, self.count)), np.zeros((n, m, 3))
        for c, chain in enumerate(self.chains):
            D = np.tile(np.eye(4), (n, 1, 1))
            for k, turn in enumerate(chain.turns):
                p, a = points[:, turn.centre], turn.axis
                axis = D[:, :3, :3] @ a
                at = np.einsum("nij,nj->ni", D[:, :3, :3], p) + D[:, :3, 3]
                if turn.slides:
                    S[:, c, :3, turn.coordinate] += turn.factor * axis
                else:
                    S[:, c, :3, turn.coordinate] += turn.factor * np.cross(at, axis)
                    S[:, c, 3:, turn.coordinate] += turn.factor * axis
                E = np.tile(np.eye(4), (n, 1, 1))
                by = turn.factor * q[:, turn.coordinate]
                if turn.slides:
                    E[:, :3, 3] = by[:, None] * a
                else:
                    E[:, :3, :3] = turned(np.broadcast_to(a, (n, 3)), by)
                    E[:, :3, 3] = p - np.einsum("nij,nj->ni", E[:, :3, :3], p)
                if k == chain.centre[0]:
                    centres[:, c] = np.einsum("nij,nj->ni", D[:, :3, :3], points[:, chain.centre[1]]) + D[:, :3, 3]
                D = D @ E
            T[:, c] = D
        return T, S, centres


def close(
    robot: Robot, path: list[Poses], points: Array, weight: float = 1e-3, start: Array | None = None
) -> tuple[Poses, Array, Array]:
    """Return closed poses, joint coordinates (N, count) and whether each is closed, along poses that begin at home.

    Args:
        robot: at home.
        path: poses (N,) each, one after another; the last ones are meant.
        points: (N, centres, 3) of machines.
        weight: how much a pose may move to close, beside joints.
        start: joint coordinates at the beginning; those of home if left out.
    """
    n = len(points)
    q = np.zeros((n, robot.count)) if start is None else start.copy()
    size = float(np.abs(robot.points_array).max())
    scale = np.concatenate([np.full(3, weight * size), np.full(3, weight), np.where(robot.slides, size, 1.0)])
    good = np.ones(n, bool)
    for target in path:
        p, R, todo, off = target.p.copy(), target.R.copy(), np.arange(n), np.zeros(n)
        for _ in range(12):
            T, S, _ = robot.moved(q[todo], points[todo])
            r = residuals(robot, Poses(p[todo], R[todo]), T).reshape(len(todo), -1)
            off[todo] = np.abs(r).max(1)
            left = off[todo] > CLOSED
            if not left.any():
                break
            todo, S, r = todo[left], S[left], r[left]
            A = S / np.array([size] * 3 + [1] * 3)[:, None]
            motion = np.zeros((len(todo), 1, 6, 6))
            motion[:, 0, :3, :3] = np.eye(3) / size
            motion[:, 0, 3:, 3:] = np.eye(3)
            # a rotation of the platform about its own origin moves the point at the world's origin
            motion[:, 0, :3, 3:] = cross_matrix(p[todo]) / size
            M = (
                np.concatenate([-np.broadcast_to(motion, (len(todo), len(robot.chains), 6, 6)), A], 3).reshape(
                    len(todo), -1, 6 + robot.count
                )
                * scale
            )
            G = M @ np.swapaxes(M, 1, 2)
            G += 1e-11 * np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(G.shape[1])
            step = np.einsum("nij,ni->nj", M, np.linalg.solve(G, r[:, :, None])[:, :, 0]) * scale
            large = np.abs(step[:, 6:] / scale[6:]).max(1, initial=0)
            step *= np.minimum(1, 0.5 / np.maximum(large, 1e-300))[:, None]
            p[todo] += step[:, :3]
            R[todo] = turned(step[:, 3:6], np.linalg.norm(step[:, 3:6], axis=1)) @ R[todo]
            q[todo] += step[:, 6:]
        good &= off < 1e-9
    return Poses(p, R), q, good


def residuals(robot: Robot, poses: Poses, T: Array) -> Array:
    """Return the twists (N, chains, 6) from each chain's end, displaced by T, to the platform, to first order.

    Velocity of the point at the world's origin in parts of the robot's size, then angular velocity.
    """
    D = np.tile(np.eye(4), (len(T), 1, 1))  # displacement of the platform from home
    D[:, :3, :3], D[:, :3, 3] = poses.R, poses.p - np.einsum("nij,j->ni", poses.R, robot.home)
    Q = D[:, None, :3, :3] @ np.swapaxes(T[:, :, :3, :3], 2, 3)
    omega = np.stack([Q[..., 2, 1] - Q[..., 1, 2], Q[..., 0, 2] - Q[..., 2, 0], Q[..., 1, 0] - Q[..., 0, 1]], -1) / 2
    v = D[:, None, :3, 3] - np.einsum("ncij,ncj->nci", Q, T[:, :, :3, 3])
    return np.concatenate([v / np.abs(robot.points_array).max(), omega], 2)


def follow(robot: Robot, poses: Poses, q: Array, points: Array) -> tuple[Array, Array]:
    """Return joint coordinates (N, count) at poses, from ones near by, and whether each limb (N, limbs) is closed."""
    q, todo, off = q.copy(), np.arange(len(q)), np.full((len(q), len(robot.limbs)), np.inf)
    size = float(np.abs(robot.points_array).max())
    scale = np.where(robot.slides, size, 1.0)
    for _ in range(NEWTON + 1):
        T, S, _ = robot.moved(q[todo], points[todo])
        r = residuals(robot, Poses(poses.p[todo], poses.R[todo]), T)
        off[todo] = np.stack([np.abs(r[:, chains]).max((1, 2)) for chains, _ in robot.limbs], 1)
        left = (off[todo] > CLOSED).any(1)
        if not left.any():
            break
        todo, S, r = todo[left], S[left], r[left]
        for chains, columns in robot.limbs:
            A = S[:, chains][..., columns] / np.array([size] * 3 + [1] * 3)[:, None]
            M = A.reshape(len(todo), -1, len(columns)) * scale[columns]
            G = M @ np.swapaxes(M, 1, 2)
            G += 1e-13 * np.trace(G, axis1=1, axis2=2)[:, None, None] * np.eye(G.shape[1])
            y = np.linalg.solve(G, r[:, chains].reshape(len(todo), -1, 1))
            step = (np.swapaxes(M, 1, 2) @ y)[:, :, 0]
            step *= np.minimum(1, 0.1 / np.maximum(np.abs(step).max(1, keepdims=True), 1e-300))
            q[np.ix_(todo, columns)] += step * scale[columns]
    return q, off < 1e-9


def cross_matrix(p: Array) -> Array:
    """Return matrices (N, 3, 3) of ``p x``."""
    K = np.zeros((len(p), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -p[:, 2], p[:, 1], -p[:, 0]
    return K - np.swapaxes(K, 1, 2)


def motions(robot: Robot, poses: Poses, q: Array, points: Array) -> tuple[Array, Array]:
    """Return motions (N, 6, a) of the platform by a unit rate of each actuator alone, and residuals (N,) of the loops.

    Velocity of the platform's origin, then angular velocity. From each chain its own passive joints are taken out: the
    wrenches that these do not feel.
    """
    n, size = len(q), float(np.abs(robot.points_array).max())
    _, S, _ = robot.moved(q, points)
    A = np.concatenate([S[:, :, :3] + np.cross(S[:, :, 3:], poses.p[:, None, :, None], axis=2), size * S[:, :, 3:]], 2)
    of = [sorted({each.coordinate for each in chain.turns}) for chain in robot.chains]
    passive = [k for k in range(robot.count) if k not in robot.actuated]
    common = [k for k in passive if sum(k in each for each in of) > 1]
    rows, sides = [], []
    for c, coordinates in enumerate(of):
        own: list[int] = []  # without those that are idle in the first pose, such as the spin of a rod
        for k in coordinates:
            if k in passive and k not in common:
                s = np.linalg.svd(
                    A[0, c][:, [*own, k]] / np.linalg.norm(A[0, c][:, [*own, k]], axis=0), compute_uv=False
                )
                own += [k] if s[-1] > 1e-6 else []
        Q = np.linalg.qr(A[:, c][:, :, own])[0]
        P = np.eye(6) - Q @ np.swapaxes(Q, 1, 2)
        rows.append(np.concatenate([P, -P @ A[:, c][:, :, common]], 2))
        sides.append(P @ A[:, c][:, :, robot.actuated])
    M, B = np.concatenate(rows, 1), np.concatenate(sides, 1)
    Q, T = np.linalg.qr(M)
    y = np.linalg.solve(T, np.swapaxes(Q, 1, 2) @ B)
    residual = np.abs(M @ y - B).reshape(n, -1).max(1) / np.abs(B).reshape(n, -1).max(1)
    return y[:, :6] * np.repeat([1.0, 1 / size], 3)[:, None], residual


def numbers(robot: Robot, poses: Poses, q: Array, points: Array, chi: Array) -> dict[str, Array]:
    """Return F, its shares, and singular values of motions with actuators locked and free, by the robot's size."""
    n, m = len(q), len(robot.chains)
    _, S, centres = robot.moved(q, points)
    size = float(np.abs(robot.points_array).max())
    passive = np.array([k for k in range(robot.count) if k not in robot.actuated])
    found: dict[str, Array] = {}
    # about the platform's origin, rotations times the size
    v = S[:, :, :3] + np.cross(S[:, :, 3:], poses.p[:, None, :, None], axis=2)
    A = np.concatenate([v, size * S[:, :, 3:]], 2)
    for name, meant in (("locked", passive), ("free", np.arange(robot.count))):
        rows, ranks = [], np.zeros(n, int)
        for chains, coordinates in robot.limbs:
            P = A[:, chains][..., [k for k in coordinates if k in meant]].reshape(n, 6 * len(chains), -1)
            X = np.tile(np.eye(6), (len(chains), 1))
            U, s, _ = np.linalg.svd(P, full_matrices=False)
            rank = s > 1e-7 * s[:, :1]
            U = U * rank[:, None]
            rows.append(X - U @ (np.swapaxes(U, 1, 2) @ X))
            ranks += rank.sum(1)
        found[name], found[f"{name} rank"] = np.linalg.svd(np.concatenate(rows, 1), compute_uv=False), ranks
        if name == "locked" and 6 * m == 6 + len(meant):
            X = np.tile(np.eye(6), (n, m, 1, 1))
            found[f"{name} sign"] = np.linalg.slogdet(np.concatenate([X, A[..., meant]], 3).reshape(n, 6 * m, 6 * m))[0]
    F, shares = np.zeros(n), np.zeros((n, max(each.limb for each in robot.chains)))
    for c, chain in enumerate(robot.chains):
        own = np.array([k for k in sorted({each.coordinate for each in chain.turns}) if k not in robot.actuated], int)
        at = centres[:, c]
        T = np.concatenate(
            [S[:, c, :3][:, :, own] + np.cross(S[:, c, 3:][:, :, own], at[:, :, None], axis=1), S[:, c, 3:][:, :, own]],
            1,
        )
        x = np.concatenate([chi[3:] + np.cross(chi[:3], at), np.broadcast_to(chi[:3], (n, 3))], 1)
        U, s, _ = np.linalg.svd(T, full_matrices=False)
        U = U * (s > 1e-9 * s[:, :1])[:, None]
        r = x - np.einsum("nij,nkj,nk->ni", U, U, x)
        F += (r * r).sum(1)
        shares[:, chain.limb - 1] += (r * r).sum(1)
    found["F"] = F
    found["shares"] = shares / F[:, None]
    return found
