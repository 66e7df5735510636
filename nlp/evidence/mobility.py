"""Freedoms, actuator rates and kinds of singularity of a robot given joint by joint, at one point.

With ``C`` the wrenches that do no work in the actuated joints, the platform of a robot with free actuators has ``6 -
rank C`` freedoms, and can make a twist where ``C`` does no work in it. The rates of a limb's actuators for a twist are
those that leave least of the motion that the limb resists (:mod:`screwsynth.models.actuation`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...models import FloatArray, Model, constraint_rows, limb_drive, rank_of_rows
from ..program.nlp import Nlp
from ..program.program import RobotNumbers
from .singularities import Singularity, SingularityKind, limb_singularities, platform_singularities
from .state import RobotState

#: A twist is feasible where the constraints carry less than this part of F's size: the rates are then below 1e-6.
_FEASIBLE = 1e-12


class LimbPart(NamedTuple):
    """The part of F that a limb has: of its actuators, and of its constraints, with which no actuator can move."""

    actuation: float
    constraint: float


@dataclass(frozen=True, eq=False)
class Mobility:
    """Freedoms and rates at a point.

    Attributes:
        freedoms: of the platform with free actuators.
        constraint_rank: rank of the constraints.
        actuator_rates: rate of each actuator for the program's task: rad or length per unit of time; infinite where the
            actuator cannot drive the platform, and not a number where the motion does not determine it.
        constrained: part of F that the constraints carry, 0 to 1; 0 where the platform can make the motion.
        parts: actuation and constraint in F, by limb.
        singularities: all that were found.
    """

    freedoms: int
    constraint_rank: int
    actuator_rates: Mapping[str, float]
    constrained: float
    parts: Mapping[str, LimbPart]
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
    J, length = numbers.jacobian, nlp.case.characteristic_length
    reach = float(np.abs(J[:, 3:]).max(initial=0.0)) or length
    constraints = constraint_rows(model, numbers.velocities, state.position)
    constraint_rank = rank_of_rows(constraints, state.position, reach)
    rates, parts = _actuator_rates(model, numbers, state.position)
    left = sum(part.constraint for part in parts.values())
    is_feasible = left <= _FEASIBLE * state.size
    if is_feasible:  # what is left is rounding
        parts = {limb: LimbPart(part.actuation, 0.0) for limb, part in parts.items()}
    found = limb_singularities(nlp, x, state, pose)
    # The wrenches of a limb whose passive joints are dependent are not those of its model, so J says nothing.
    if all(each.kind is not SingularityKind.PASSIVE for each in found):
        generic = model.generic.constraints, model.generic.jacobian
        found += platform_singularities(state, constraints, (constraint_rank, state.rank), generic)
    if model.generic.jacobian < 6:
        found.append(Singularity(SingularityKind.ARCHITECTURE, gained=state.free_twists))
    return Mobility(
        freedoms=6 - constraint_rank,
        constraint_rank=constraint_rank,
        actuator_rates=MappingProxyType(rates),
        constrained=0.0 if is_feasible else left / state.F,
        parts=MappingProxyType(parts),
        singularities=tuple(found),
    )


def _actuator_rates(
    model: Model, numbers: RobotNumbers, position: FloatArray
) -> tuple[dict[str, float], dict[str, LimbPart]]:
    """Return the rate of each actuator by name, and the parts of F of each limb."""
    found = {each.name: float("inf") for each in model.actuators}
    parts: dict[str, LimbPart] = {}
    for limb in model.limbs:
        rows, actuators, drive = limb_drive(model, numbers.velocities, position, limb)
        resisted = numbers.rates[rows, 0]
        moved = drive.driven_part(resisted)
        left = resisted - moved
        parts[limb] = LimbPart(float(moved @ moved), float(left @ left))
        for k, rate in zip(actuators, drive.rates(resisted), strict=True):
            found[model.actuators[k].name] = float(rate)
    return found, parts
