"""Proved largest actuator speeds along a tool path with times; they replace the speeds that [motion] implies."""

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
from ..boxes.tree import TreeRecord
from ..statement.claims import Claim
from ..statement.motors import actuator_coordinates, speed_claims
from .numbers.bound_search import Minimum, smallest_values
from .numbers.extremes import goal_of, verdict_of
from .numbers.path_speeds import PathSpeeds, with_rates
from .numbers.within_tolerance import RobotsWithinTolerance
from .proof_record import ProofRecord
from .robot.path_cover import PathCover
from .robot.posed_robot import NotJudgedError
from .verdict import Verdict

#: Number of places at which the width of a bound over the robots within the tolerance is sampled.
_POINTS, _SEED = 64, 0


class SpeedsOnPath(NamedTuple):
    """Verdicts on the largest actuator speeds.

    Attributes:
        claims: claims about the speeds.
        verdicts: verdict on each claim.
        number: the speeds as quantities of the search; None if the speeds are not known.
    """

    claims: Sequence[Claim]
    verdicts: Sequence[Verdict]
    number: PathSpeeds | None


def speeds_on_path(
    robots: RobotsWithinTolerance, cover: PathCover, gap: float, record: ProofRecord | None = None
) -> SpeedsOnPath:
    """Return the largest speed of each actuator along a path with times, over all robots within the tolerance.

    Args:
        robots: robots within the tolerance.
        cover: boxes of the path.
        gap: allowed relative gap of a speed.
        record: recorder of the search for a proof file.
    """
    claims, number = list(speed_claims(robots.case)), None
    recorder = None if record is None else TreeRecord()
    try:
        number = PathSpeeds(with_rates(robots.family, cover), coordinates_of(robots))
        goals = [
            goal_of(claim, wider, gap, is_enough=False)
            for claim, wider in zip(claims, _wider(number, cover).tolist(), strict=True)
        ]
        every = smallest_values(number, goals, recorder)
        if record is not None and recorder is not None:
            record.boxes |= dict.fromkeys((claim.name for claim in claims), recorder)
    except (NotJudgedError, UncoveredError) as error:
        every = [Minimum(reason=str(error))] * len(claims)
    found = []
    for claim, each in zip(claims, every, strict=True):
        problem = robots.family.problem
        pose = problem.box.pose(problem.pose_of(each.at)) if math.isfinite(each.value) else None
        found.append(verdict_of(claim, each, pose))
    return SpeedsOnPath(claims, found, number)


def _wider(number: PathSpeeds, cover: PathCover) -> FloatArray:
    """Return by how much (K,) bounds for all robots within the tolerance exceed values of the nominal robot.

    The differences are those at single points of the path; smaller boxes do not reduce them.
    """
    problem = number.problem
    if not problem.names or problem.problem.dependent:
        return np.zeros(number.count)
    z = problem.path_points(cover, cover.random(_POINTS, np.random.default_rng(_SEED)), 0.0)
    beyond = number.values(problem.exact(z)) - number.bounds(z, z)
    return np.asarray(np.nan_to_num(beyond, posinf=0.0).max(axis=0))


def coordinates_of(robots: RobotsWithinTolerance) -> SX:
    """Return the coordinates (a, 1) of all actuators, as expressions: leg lengths, or displacements from home.

    Raises:
        NotJudgedError: the position of an actuator is not known.
    """
    layout, family = robots.symbols.layout, robots.family
    found = actuator_coordinates(layout)
    if not found or len(found) < len(driven_joints(layout.case.model)):
        raise NotJudgedError("the positions of the robot's actuators are not known")
    return robots.symbols.of(ca.vertcat(*found.values()), family.errors, family.problem.z)
