"""Forces and speeds of actuators at a point, and the wrenches by which limbs' constraints hold the loads.

The wrenches of a limb's constraints are those that do no work in its actuators: the part of its row forces that is
orthogonal to what its actuators drive. Statics determines them where the wrenches of the limb are independent of those
of all others; else limbs can load each other with wrenches that no load determines.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, rank_of_rows
from ...models.basis import is_apart
from ...models.instance import length_of
from ...models.statics import Statics, statics_of
from ..case.forces import CaseForces, PosedForces, forces_at
from ..program.nlp import Nlp
from .paths import velocities_at
from .state import RobotState

#: Work rates of a limb's rows below this part of the largest are none of its actuators'.
_DRIVES = 1e-9


class LoadState(NamedTuple):
    """What holds one load case.

    Attributes:
        name: of the load case.
        wrench: (6,) its fixed part, force, then moment about the world origin.
        smallest, largest: (a,) forces of the actuators, torques of those that turn; not numbers at a singular pose.
        constraints: (6,) wrench of each limb's constraints on the platform for the fixed part, force, then moment about
            the world origin; None where statics does not determine it. Limbs without constraints are left out.
        displacement: (6,) of the platform for the fixed part, turn, radians, then translation of its origin; empty
            where the actuators' stiffness is not known.
        deflection: upper bound of the translation, with loads of any direction; not a number where it is not known.
    """

    name: str
    wrench: FloatArray
    smallest: FloatArray
    largest: FloatArray
    constraints: Mapping[str, FloatArray | None]
    displacement: FloatArray
    deflection: float

    @property
    def forces(self) -> FloatArray:
        """Force (a,) of each actuator with the largest size."""
        return np.where(np.abs(self.largest) >= np.abs(self.smallest), self.largest, self.smallest)


class PoseLoads(NamedTuple):
    """Forces of all load cases at a pose, and what does not depend on loads.

    Attributes:
        loads: the load cases.
        speeds: (a,) the largest speeds of the actuators; empty without a motion.
        compliance: (6, 6) displacement of the platform, turn and translation of its origin, by moment and force about
            it; empty where the actuators' stiffness is not known.
    """

    loads: tuple[LoadState, ...]
    speeds: FloatArray
    compliance: FloatArray


def loads_at(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> PoseLoads:
    """Return forces and speeds of the actuators of a robot at a pose.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there.
        pose: index of the pose.
    """
    model, loading = nlp.program.model, nlp.case.loading
    at = velocities_at(nlp, x, nlp.program.kernels.robot_states[pose](x, nlp.arguments), pose)
    J, D, p, R = (SX(ca.DM(each)) for each in (at.jacobian, at.driven, state.position, state.rotation))
    statics = statics_of(model, J, D, p)
    values = [float(each) for item in model.parameters for each in np.ravel(state.parameters[item.name])]
    found = forces_at(model, statics, R, loading, SX(length_of(model, values)))
    held = {} if state.is_singular else _constraints(nlp, statics)
    loads = tuple(_load(case, state, found, held) for case in found.cases)
    is_elastic = bool(found.stiffness.numel())
    compliance = _numbers(ca.vec(found.compliance), state).reshape(6, 6) if is_elastic else np.zeros((0, 0))
    return PoseLoads(loads, _numbers(found.speeds, state), compliance)


def largest_of(found: PoseLoads, measure: str) -> float:
    """Return the largest number of the actuators at a pose: ``actuator_force``, ``actuator_speed`` or ``..._power``."""
    if measure == "actuator_speed":
        return float(found.speeds.max())
    factor = found.speeds if measure == "actuator_power" else 1.0
    return float((factor * np.abs([each.forces for each in found.loads])).max())


def _load(case: CaseForces, state: RobotState, posed: PosedForces, held: Mapping[str, FloatArray | None]) -> LoadState:
    """Return what holds one load case; ``held`` has the matrix from row forces to the wrench of each limb."""
    phi = _numbers(posed.statics.row_forces(case.wrench), state) if held else np.zeros(0)
    is_elastic = bool(posed.stiffness.numel())
    return LoadState(
        case.case.name,
        _about_world(np.array(ca.DM(case.wrench)).ravel(), state.position),
        _numbers(case.smallest, state),
        _numbers(case.largest, state),
        {limb: None if matrix is None else _about_world(matrix @ phi, state.position) for limb, matrix in held.items()},
        _numbers(posed.displacement(case), state) if is_elastic else np.zeros(0),
        float(_numbers(posed.deflection(case), state)[0]) if is_elastic else math.nan,
    )


def _numbers(expression: SX, state: RobotState) -> FloatArray:
    """Return the values (k,) of a constant expression (k, 1), not numbers at a singular pose."""
    values = np.array(ca.DM(expression), dtype=np.float64).reshape(-1)
    return np.full(values.shape, np.nan) if state.is_singular else values


def _about_world(wrench: FloatArray, position: FloatArray) -> FloatArray:
    """Return a wrench (6,) about the platform's origin with its moment about the world origin."""
    return np.concatenate([wrench[:3], wrench[3:] + np.cross(position, wrench[:3])])


def _constraints(nlp: Nlp, statics: Statics) -> dict[str, FloatArray | None]:
    """Return the matrix (6, m) from row forces to the wrench of each limb's constraints; None where not determined."""
    model = nlp.program.model
    rows, driven = (np.array(ca.DM(each), dtype=np.float64) for each in (statics.rows, statics.driven))
    limbs = np.array([row.limb for row in model.frame_rows])
    wrenches = rows[:, [3, 4, 5, 0, 1, 2]]
    origin, length = np.zeros(3), float(np.abs(wrenches[:, 3:]).max(initial=0.0)) or 1.0
    found: dict[str, FloatArray | None] = {}
    for limb in model.limbs:
        own = limbs == limb
        left, values, _ = np.linalg.svd(driven[own])
        free = left[:, int(np.count_nonzero(values > _DRIVES * values.max(initial=0.0))) :]
        rank = rank_of_rows(free.T @ wrenches[own], origin, length)
        if not rank:
            continue
        matrix = np.zeros((6, len(limbs)))
        matrix[:, own] = wrenches[own].T @ free @ free.T
        found[limb] = matrix if is_apart(wrenches, own, origin, length) else None
    return found
