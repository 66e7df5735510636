"""Freedoms, actuator rates and kinds of singularity of a robot given joint by joint, at one point.

With ``C`` the wrenches that do no work in the actuated joints, the platform of a robot with free actuators has ``6 -
rank C`` freedoms, and can make a twist where ``C`` does no work in it. The rates of a limb's actuators for a twist are
those that leave least of the motion that the limb resists: the least squares solution of ``r = sum rho_a qdot_a``.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import casadi as ca
import numpy as np

from ...models import FloatArray, Model, Substitution, constraint_rows, rank_of_rows
from ..program.nlp import Nlp
from .state import RobotState

#: A twist is feasible where the constraints carry less than this part of F's size: the rates are then below 1e-6.
_FEASIBLE = 1e-12
#: Screws of unit size whose singular values are below this part of the largest are dependent, as for the rank of J.
_DEPENDENT = 1e-7
#: Screws below this part of the largest are rounding errors of projected ones, and must not be scaled up.
_NEGLIGIBLE = 1e-9


class SingularityKind(enum.Enum):
    """Kind of a singularity; each value is a clause for people."""

    PASSIVE = "its passive joints are dependent: F jumps here, and the point is no optimum to build"
    SERIAL = "its joints are dependent: its actuator cannot drive the platform, which loses a freedom"
    CONSTRAINT = "the constraints are dependent: the platform gains a freedom even with free actuators"
    ACTUATION = "the platform can move with every actuator locked"
    ARCHITECTURE = "the rank is below six at all dimensions and poses: the platform can always move"


@dataclass(frozen=True)
class Singularity:
    """A singularity: its kind, and the limb that it belongs to, if any."""

    kind: SingularityKind
    limb: str | None = None


@dataclass(frozen=True, eq=False)
class Mobility:
    """Freedoms and rates at a point.

    Attributes:
        freedoms: of the platform with free actuators.
        constraint_rank: rank of the constraints.
        actuator_rates: rate of each actuator for the program's task: rad or length per unit of time; infinite where the
            actuator cannot drive the platform.
        constrained: part of F that the constraints carry, 0 to 1; 0 where the platform can make the motion.
        singularities: all that were found.
    """

    freedoms: int
    constraint_rank: int
    actuator_rates: Mapping[str, float]
    constrained: float
    singularities: tuple[Singularity, ...]


def mobility_of(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> Mobility | None:
    """Return the mobility of a robot given joint by joint; None for a robot given by its rows.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there.
        pose: index of the pose.
    """
    model = nlp.program.model
    if model.generic is None:
        return None
    numbers = nlp.program.kernels.robot_states[pose](x, nlp.arguments)
    J, screws, length = numbers.jacobian, numbers.actuators, nlp.case.characteristic_length
    reach = float(np.abs(J[:, 3:]).max(initial=0.0)) or length
    constraints = constraint_rows(model, J, screws)
    constraint_rank = rank_of_rows(constraints, state.position, reach)
    rates, left = _actuator_rates(model, J, screws, numbers.rates[:, 0])
    found = list(_limb_singularities(nlp, x, state, pose))
    regular = not found
    if regular and constraint_rank < model.generic.constraints:
        found.append(Singularity(SingularityKind.CONSTRAINT))
    elif regular and state.rank < model.generic.jacobian:
        found.append(Singularity(SingularityKind.ACTUATION))
    if model.generic.jacobian < 6:
        found.append(Singularity(SingularityKind.ARCHITECTURE))
    return Mobility(
        freedoms=6 - constraint_rank,
        constraint_rank=constraint_rank,
        actuator_rates=MappingProxyType(rates),
        constrained=left / state.F if left > _FEASIBLE * state.size else 0.0,
        singularities=tuple(found),
    )


def _actuator_rates(
    model: Model, J: FloatArray, screws: FloatArray, rates: FloatArray
) -> tuple[dict[str, float], float]:
    """Return the rate of each actuator by name, and the part of F that no actuator moves with."""
    found: dict[str, float] = {}
    left = 0.0
    for limb in model.limbs:
        rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
        driven = J[rows] @ np.vstack([screws[3:, own], screws[:3, own]])
        values: FloatArray = np.zeros(len(own))
        residual, resisted = rates[rows], np.linalg.norm(driven, axis=0)
        if own and float(np.linalg.norm(driven)) > _DEPENDENT * float(np.abs(J[rows]).max()):
            values = np.asarray(np.linalg.lstsq(driven, rates[rows], rcond=_DEPENDENT)[0], dtype=np.float64)
            residual = rates[rows] - driven @ values
        left += float(residual @ residual)
        for k, value, size in zip(own, values, resisted, strict=True):
            found[model.actuators[k].name] = float(value) if size > 0 else float("inf")
    return {each.name: found.get(each.name, float("inf")) for each in model.actuators}, left


def _limb_singularities(nlp: Nlp, x: FloatArray, state: RobotState, pose: int) -> list[Singularity]:
    """Return the singularities of limbs: screws of their joints with a smaller rank than at almost all other points."""
    model = nlp.program.model
    parts = [part for each in model.joint_screws for part in (each.passive, each.all)]
    if not parts:
        return []
    function = ca.Function("screws", Substitution.identity(model).all, [ca.densify(part) for part in parts])
    parameters = np.concatenate([np.zeros(0), *[state.parameters[item.name] for item in model.parameters]])
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    values = function.call([parameters, unknowns, state.rotation, state.position])
    matrices = [np.array(each) for each in values]
    found: list[Singularity] = []
    for each, passive, every in zip(model.joint_screws, matrices[::2], matrices[1::2], strict=True):
        if not np.isfinite(passive).all() or _rank(passive, state.position) < each.passive_rank:
            found.append(Singularity(SingularityKind.PASSIVE, each.limb))
        elif _rank(every, state.position) < each.all_rank:
            found.append(Singularity(SingularityKind.SERIAL, each.limb))
    return list(dict.fromkeys(found))


def _rank(screws: FloatArray, centre: FloatArray) -> int:
    """Return the rank of twists (6, n) with velocities of a centre (3,) in parts of the largest, each of unit size."""
    velocities = screws[3:] + np.cross(screws[:3].T, centre).T
    turning = np.linalg.norm(screws[:3], axis=0) > 0
    reach = float(np.linalg.norm(velocities[:, turning], axis=0).max(initial=0.0)) or 1.0
    scaled = np.vstack([screws[:3], velocities / reach])
    lengths = np.linalg.norm(scaled, axis=0)
    moving = lengths > _NEGLIGIBLE * lengths.max(initial=0.0)
    values = np.linalg.svd(scaled[:, moving] / lengths[moving], compute_uv=False)
    return int(np.count_nonzero(values > _DEPENDENT * values.max(initial=1.0)))
