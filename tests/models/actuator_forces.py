"""Forces of actuators as numbers: from the code under test, and by virtual work from MuJoCo's constrained Jacobian.

The engine knows the closed mechanism alone: its loops are constraints, whose Jacobian has the feasible motions as null
space. With actuator forces tau, a load W and a feasible motion with rates qdot and the platform's twist chi,

    tau . qdot + W . chi = 0,        W . chi = force . v + moment . omega    (moments and v about the platform's origin)

which is solved for tau over a basis of all feasible motions, spins of rods included.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from builders import Array
from casadi import SX
from mujoco_robots import Oracle, null_space
from robot_gallery import LENGTH, model_of

from screwsynth.models import Model, Substitution
from screwsynth.models.instance import instantiate
from screwsynth.models.statics import posed_statics
from screwsynth.nlp.case.forces import forces_at
from screwsynth.nlp.case.loads import Load, Loading, Motion

LOADS = 20


class Package:
    """The forces of a robot under some loads and its speeds, as numbers, from the code under test."""

    def __init__(self, model: Model, loading: Loading) -> None:
        own = Substitution.identity(model)
        posed = instantiate(model, own, SX(LENGTH), [SX.zeros(6)])
        found = forces_at(model, posed_statics(model, posed), posed.rotation, loading, posed.size)
        self.model, self.unknowns = model, len(model.unknowns)
        self.names = [joint.name for joint in found.joints]
        self.typical = np.concatenate([np.ravel(item.typical) for item in model.parameters] or [np.zeros(0)])
        outputs = [ca.horzcat(*(getattr(each, part) for each in found.cases)) for part in ("smallest", "largest")]
        self.numbers = ca.Function("numbers", own.all, [*outputs, found.speeds])
        slopes = ca.jacobian(posed.closure, own.unknowns)
        self.closing = ca.Function("closing", own.all, [ca.densify(posed.closure), ca.densify(slopes)])

    def close(self, x: Array, R: Array, p: Array, start: Array | None = None) -> Array:
        """The unknowns at a pose, by Newton's method from home."""
        found = np.zeros(self.unknowns) if start is None else start
        if not self.unknowns:
            return found
        for _ in range(40):
            values, slopes = (each.full() for each in self.closing(x, found, R, p))
            if np.abs(values).max() < 1e-15:
                break
            step = np.linalg.lstsq(slopes, values.ravel(), rcond=1e-12)[0]
            found = found - step
            if np.abs(step).max() < 1e-16:
                break
        assert np.abs(values).max() < 1e-12
        return found

    def at(self, R: Array, p: Array, x: Array | None = None) -> tuple[Array, Array, Array]:
        """Smallest and largest forces (a, loads), and largest speeds (a,), at a pose."""
        x = self.typical if x is None else x
        smallest, largest, speeds = (each.full() for each in self.numbers(x, self.close(x, R, p), R, p))
        return smallest, largest, speeds.ravel()


def random_loads(rng: np.random.Generator, count: int = LOADS) -> list[Load]:
    return [Load(f"{k}", *(tuple(rng.normal(size=3).tolist()) for _ in range(3))) for k in range(count)]


@cache
def scene(name: str) -> tuple[Package, list[Load]]:
    loads = random_loads(np.random.default_rng([11, *name.encode()]))
    return Package(model_of(name), Loading(tuple(loads), Motion(0.7, 0.4))), loads


class Feasible(NamedTuple):
    """A basis of the engine's feasible motions: actuator rates (n, a), twists (n, 6) about the platform's origin."""

    rates: Array
    twists: Array

    def forces(self, wrenches: Array) -> Array:
        """Actuator forces (a, k) that hold wrenches (6, k), force and moment about the platform's origin."""
        work = self.twists @ np.vstack([wrenches[3:], wrenches[:3]])
        tau = np.linalg.lstsq(self.rates, -work, rcond=1e-9)[0]
        np.testing.assert_allclose(self.rates @ tau, -work, rtol=0, atol=1e-11 * np.abs(work).max())
        assert np.linalg.matrix_rank(self.rates, tol=1e-9) == self.rates.shape[1]
        return np.asarray(tau)


def feasible(oracle: Oracle) -> Feasible:
    motions = null_space(oracle.J)
    twists = oracle.from_platform @ motions[oracle.platform_dofs]
    omega, v = twists[:3].T, twists[3:].T
    return Feasible(motions[oracle.actuated].T, np.hstack([omega, v + np.cross(omega, oracle.position)]))


def wrenches_of(loads: Sequence[Load], R: Array) -> Array:
    """Force and moment (6, k) about the platform's origin."""
    force, moment, point = (np.array([getattr(each, key) for each in loads]) for key in ("force", "moment", "point"))
    return np.vstack([force.T, (moment + np.cross(point @ R.T, force)).T])


def directions(rng: np.random.Generator, count: int) -> Array:
    found = rng.normal(size=(count, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])
