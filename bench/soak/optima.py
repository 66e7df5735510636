"""Whether answers are optima, by formulas that are not the program's: multipliers from differences, and random searches."""

from __future__ import annotations

from typing import Any

import numpy as np
from formulas import Array
from ticks import Robot, Tick

#: A side nearer than this, in parts of its size, is active.
_ACTIVE = 1e-6
_STEP = 1e-6


def stationarity(robot: Robot, tick: Tick, x: Array, row: int) -> float:
    """Return the KKT residual at an answer to one problem of a tick, over the sum of the gradient's sizes.

    Gradients are central differences. Multipliers are those that fit best, not negative for inequalities. The worst of several
    F is a level t, in parts of F, that each F bounds.
    """
    n, point = len(robot.names), x[row]
    half = np.where(np.arange(n) == robot.level, 0.0, 0.5 * (robot.upper - robot.lower))
    points = point + np.vstack([np.eye(n), -np.eye(n)]) * _STEP * half
    state = robot.state(points, np.tile(tick.p[row], (2 * n, 1)))

    def slopes(values: Array) -> Array:
        return (values[:n] - values[n:]) / (2 * _STEP)

    here, p = robot.state(x[row : row + 1], tick.p[row : row + 1]), np.tile(tick.p[row], (2 * n, 1))
    inequalities, equations = [], list(slopes(state.equations).T)
    size = robot.size(x[row : row + 1], tick.p[row : row + 1])[0]
    gradient = -robot.sense * slopes(robot.objective(state, p)) / size
    if robot.level is not None:
        gradient = -robot.sense * np.eye(n)[robot.level]
        values, (own,) = robot.values(state, p), robot.values(here, p[:1])
        worst = robot.objective(here, p[:1])[0]
        for k in np.flatnonzero(np.abs(own - worst) <= _ACTIVE * abs(worst)):
            inequalities.append(robot.sense * (slopes(values[:, k]) / abs(worst) - np.eye(n)[robot.level]))
    for key, limit in zip(robot.keys, tick.limits[row], strict=True):
        sign = 1.0 if key.endswith(".min") else -1.0
        for k, value in enumerate(here.limits[key][0]):
            if abs(value - limit) <= _ACTIVE * max(abs(limit), 1e-3):
                inequalities.append(sign * slopes(state.limits[key][:, k]))
    for i in robot.free:
        if point[i] - tick.lower[row, i] <= _ACTIVE * half[i]:
            inequalities.append(np.eye(n)[i])
        if tick.upper[row, i] - point[i] <= _ACTIVE * half[i]:
            inequalities.append(-np.eye(n)[i])
    rows = [*inequalities, *equations, *(-each for each in equations)]
    left = gradient - (np.array(rows).T @ multipliers(np.array(rows).T, gradient) if rows else 0.0)
    return float(np.abs(left).max())


def multipliers(A: Array, b: Array) -> Array:
    """Return the u >= 0 with the least ``|A u - b|`` (Lawson and Hanson)."""
    u, passive = np.zeros(A.shape[1]), np.zeros(A.shape[1], dtype=bool)
    for _ in range(10 * A.shape[1]):
        w = A.T @ (b - A @ u)
        w[passive] = -np.inf
        k = int(np.argmax(w))
        if w[k] <= 1e-13 * np.abs(A.T @ b).max(initial=1e-300):
            break
        passive[k] = True
        while True:
            z = np.zeros_like(u)
            z[passive] = np.linalg.lstsq(A[:, passive], b, rcond=1e-12)[0]
            if z[passive].min(initial=1.0) > 0:
                u = z
                break
            down = passive & (z <= 0)
            step = np.min(u[down] / np.where(u[down] - z[down] > 0, u[down] - z[down], 1.0))
            u = u + step * (z - u)
            passive &= u > 1e-15
            u[~passive] = 0.0
            if not passive.any():
                break
    return u


def searched(robot: Robot, p: Array, rng: np.random.Generator, starts: int, rounds: int) -> Array:
    """Return the best F (m,) that a random search finds for m tasks.

    From the best of many points a step is longer after a success and shorter after a failure (Rechenberg's rule). A third of
    the steps changes one number alone.
    """
    m, n = len(p), len(robot.names)
    lower, upper, limits = robot.lower[robot.free], robot.upper[robot.free], np.tile(robot.limits, (m, 1))
    best, at, step = np.full(m, -np.inf), np.tile((lower + upper) / 2, (m, 1)), np.full(m, 0.3)
    for k in range(starts + rounds):
        move = rng.normal(size=at.shape)
        if k % 3 == 0:
            move *= np.arange(len(lower)) == rng.integers(len(lower))
        trial = rng.uniform(lower, upper, at.shape) if k < starts else at + step[:, None] * move * (upper - lower)
        x = np.zeros((m, n))
        x[:, robot.free] = np.clip(trial, lower, upper)
        state = robot.state(x, p)
        value = np.where(robot.excess(state, limits) <= 0, robot.sense * robot.objective(state, p), -np.inf)
        is_better = value > best
        best, at = np.where(is_better, value, best), np.where(is_better[:, None], x[:, robot.free], at)
        if k >= starts:
            step = np.clip(step * np.where(is_better, 1.6, 0.93), 1e-9, 0.3)
    return robot.sense * best


def compared(robot: Robot, p: Array, rng: np.random.Generator) -> tuple[Any, Array]:
    """Return the answers of the C to m tasks, and by how much those of three random searches are better, in parts of F."""
    found = robot.compiled.solve(p=p, threads=1)
    best = robot.sense * np.max([robot.sense * searched(robot, p, rng, 1000, 2000) for _ in range(3)], axis=0)
    return found, robot.sense * (best - found.F) / np.abs(found.F)
