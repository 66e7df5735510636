"""Degrees of freedom, actuator rates and singularities of a robot with given joints, at one point.

With ``C`` the constraint wrenches, which do no work in the actuated joints, the platform has ``6 - rank C`` degrees of
freedom if the actuators are unlocked, and can make a twist in which ``C`` does no work. The actuator rates of a limb
for a twist minimise the motion that the limb resists (:mod:`screwsynth.models.actuation`).
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ...models import FloatArray, GenericRanks, LimbDrive, constraint_rows, limb_drive, rank_of_rows
from ...models.values import dataclass
from ..program.nlp import Nlp
from ..system.jsonvalues import JsonObject
from .paths import numbers_at
from .singularities import (
    Singularity,
    SingularityKind,
    limb_singularities,
    platform_singularities,
    singularity,
)
from .state import RobotState

#: A twist is feasible where the constraint part of F is below this fraction of F's size: the rates are then below 1e-6.
_FEASIBLE = 1e-12


class LimbPart(JsonObject):
    """Contribution of one limb to F.

    Attributes:
        limb: name of the limb.
        F: sum of the squared work rates of the limb's wrenches: ``actuation`` plus ``constraints``.
        actuation: part of F from the motion that the limb's actuators can follow.
        constraints: part of F from the rest of the motion: 0 in every limb for a motion that the platform can make.
    """

    limb: str
    F: float
    actuation: float
    constraints: float


@dataclass(frozen=True, eq=False)
class Mobility:
    """Degrees of freedom and actuator rates at a point.

    Attributes:
        freedoms: degrees of freedom of the platform with unlocked actuators.
        constraint_rank: rank of the constraint wrenches.
        actuator_rates: rate of each actuator for the program's task: rad or length per unit of time; infinite if the
            actuator cannot drive the platform, NaN if the motion does not determine the rate.
        constrained: fraction of F from constraint wrenches, 0 to 1; 0 if the platform can make the motion.
        parts: actuation and constraint part of F for each limb.
        singularities: all singularities at the point.
    """

    freedoms: int
    constraint_rank: int
    actuator_rates: Mapping[str, float]
    constrained: float
    parts: tuple[LimbPart, ...]
    singularities: tuple[Singularity, ...]


def mobility_of(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> Mobility | None:
    """Return the mobility of a robot with given joints; None for a robot given by rows of J.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point.
        pose: index of the pose.
    """
    model = nlp.program.model
    if model.generic is None:
        return None
    numbers = numbers_at(nlp, x, pose)
    J, length = numbers.jacobian, nlp.case.characteristic_length
    reach = float(np.abs(J[:, 3:]).max(initial=0.0)) or length
    velocities = numbers.velocities
    constraints = constraint_rows(model, velocities, state.position)
    constraint_rank = rank_of_rows(constraints, state.position, reach)
    drives = {limb: limb_drive(model, velocities, state.position, limb) for limb in model.limbs}
    rates = dict.fromkeys([each.name for each in model.actuators], float("inf"))
    by_limb: dict[str, tuple[float, float]] = {}
    for limb, (rows, actuators, drive) in drives.items():
        resisted = numbers.rates[rows, 0]
        moved = drive.driven_part(resisted)
        by_limb[limb] = float(moved @ moved), float(np.sum((resisted - moved) ** 2))
        rates |= {
            model.actuators[k].name: float(rate) for k, rate in zip(actuators, drive.rates(resisted), strict=True)
        }
    left = sum(constraint for _, constraint in by_limb.values())
    is_feasible = left <= _FEASIBLE * state.size
    if is_feasible:  # the rest is rounding
        by_limb = {limb: (actuation, 0.0) for limb, (actuation, _) in by_limb.items()}
    found = limb_singularities(nlp, x, state, pose)
    if not found:
        found = _idle_limb(drives, model.generic)
    # A limb with dependent passive joints has other wrenches than its model, so J is not valid there.
    if all(each.kind is not SingularityKind.PASSIVE for each in found):
        generic = model.generic.constraints, model.generic.jacobian
        found += platform_singularities(state, constraints, (constraint_rank, state.rank), generic)
    if model.rank < 6:
        found.append(singularity(SingularityKind.ARCHITECTURE, gained=state.free_twists))
    return Mobility(
        freedoms=6 - constraint_rank,
        constraint_rank=constraint_rank,
        actuator_rates=MappingProxyType(rates),
        constrained=0.0 if is_feasible else left / state.F,
        parts=tuple(
            LimbPart(limb=limb, F=actuation + constraint, actuation=actuation, constraints=constraint)
            for limb, (actuation, constraint) in by_limb.items()
        ),
        singularities=tuple(found),
    )


def _idle_limb(drives: Mapping[str, LimbDrive], generic: GenericRanks) -> list[Singularity]:
    """Return the serial singularity of a limb whose actuators have more idle rates than at almost all points.

    Nevertheless, the joints of each member of the limb may be independent.
    """
    idle = {limb: each.drive.idle.shape[1] for limb, each in drives.items() if each.drive.idle.shape[1]}
    if sum(idle.values()) <= generic.idle:
        return []
    return [singularity(SingularityKind.SERIAL, next(iter(idle)) if len(idle) == 1 else None)]
