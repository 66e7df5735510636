"""Speeds of actuators along a path that states its times: proven largest sizes, in place of those by [motion]."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ....models.statics import driven_joints
from ...errors import UncoveredError
from ..statement.claims import ACTUATED, Claim
from ..statement.motors import speed_claims
from .numbers.bound_search import Minimum, smallest_values
from .numbers.extremes import goal_of, verdict_of
from .numbers.machines import Machines
from .numbers.path_speeds import PathSpeeds, with_rates
from .robot.path_cover import PathCover
from .robot.posed_robot import NotJudgedError
from .verdict import Verdict

#: Number of places at which the width of a bound over machines is taken.
_POINTS, _SEED = 64, 0


class SpeedsOnPath(NamedTuple):
    """Largest speeds of actuators, and what they were searched with: None where nothing is known of them."""

    claims: Sequence[Claim]
    verdicts: Sequence[Verdict]
    number: PathSpeeds | None


def speeds_on_path(machines: Machines, cover: PathCover, gap: float) -> SpeedsOnPath:
    """Return the largest speed of each actuator of all machines along a path with times.

    Args:
        machines: all machines that are meant.
        cover: of the path.
        gap: as a part of a speed.
    """
    claims, number = list(speed_claims(machines.case)), None
    try:
        number = PathSpeeds(with_rates(machines.family, cover), coordinates_of(machines))
        goals = [
            goal_of(claim, wider, gap, is_enough=False)
            for claim, wider in zip(claims, _wider(number, cover).tolist(), strict=True)
        ]
        every = smallest_values(number, goals)
    except (NotJudgedError, UncoveredError) as error:
        every = [Minimum(reason=str(error))] * len(claims)
    found = []
    for claim, each in zip(claims, every, strict=True):
        problem = machines.family.problem
        pose = problem.box.pose(problem.pose_of(each.at)) if math.isfinite(each.value) else None
        found.append(verdict_of(claim, each, pose))
    return SpeedsOnPath(claims, found, number)


def _wider(number: PathSpeeds, cover: PathCover) -> FloatArray:
    """Return by how much bounds at places are beyond the values of the design there, (K,): no smaller boxes help.

    They are those of all machines.
    """
    problem = number.problem
    if not problem.names or problem.problem.dependent:
        return np.zeros(number.count)
    z = problem.path_points(cover, cover.random(_POINTS, np.random.default_rng(_SEED)), 0.0)
    beyond = number.values(problem.exact(z)) - number.bounds(z, z)
    return np.asarray(np.nan_to_num(beyond, posinf=0.0).max(axis=0))


def coordinates_of(machines: Machines) -> SX:
    """Return the coordinates (a, 1) of all actuators in those of machines: lengths of legs, or from home.

    Raises:
        NotJudgedError: they are not known.
    """
    layout, family = machines.symbols.layout, machines.family
    model, robot = layout.case.model, layout.robots[0]
    found = {} if model.actuators else {leg.name: ca.norm_2(leg.span) for leg in robot.legs}
    for quantity, values in zip(model.quantities, robot.quantities, strict=True):
        if model.actuators and quantity.name in ACTUATED:
            found |= {owner: values[k] for k, owner in enumerate(quantity.owners)}
    names = [each.name for each in driven_joints(model)]
    if not names or not found.keys() >= set(names):
        raise NotJudgedError("the positions of its actuators are not known")
    return machines.symbols.of(ca.vertcat(*[found[name] for name in names]), family.errors, family.problem.z)
