"""Largest pose error over a workspace, from leg-length errors and joint-centre errors within the tolerances.

By the triangle inequality, errors of joint centres and of a leg's length act as a leg-length error of at most ``eps =
leg error + 2 joint error``. To first order the pose error is ``J^-1 d`` with ``|d_i| <= eps``; its position or rotation
is largest with every ``d_i`` equal to eps or -eps.

For second-order terms, let the first-order error be P eps in position and Q eps in rotation. By Taylor's formula the
leg lengths at the true pose differ from the first-order ones by at most

    r = ((p + a w)^2 / l + a w^2) / 2,      p = P (eps + r),  w = Q (eps + r),

with l the shortest leg length in between and a the largest distance of a joint from the platform's origin. The true
pose depends continuously on the errors, from 0, so the smallest such r applies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Dimension, FloatArray
from ....evidence.closed_loops import Loops
from ...statement.claims import ERRORS
from ...statement.fixed_robot import Legs
from ..robot.pose_box import PoseNumbers, cayley_rotation
from ..verdict import Verdict
from .bound_search import Goal, Minimum, smallest_values
from .extremes import verdict_of
from .jacobian_numbers import WorstError
from .searched import Subject

if TYPE_CHECKING:
    from ..proof_record import ProofRecord

#: Relative outward shift of a computed bound, for rounding.
_ROUNDING = 1e-10
#: Largest number of steps in the iteration for the smallest r.
_STEPS = 200
#: Gap of a pose error relative to its value at the workspace centre; a smaller gap takes many more boxes.
_GAP = 0.1
#: Reason for errors without a proved bound.
_TOO_LARGE = "the errors are too large for a bound of their second-order terms"


def pose_errors(subject: Subject, leg_error: float, record: ProofRecord | None = None) -> Iterator[Verdict]:
    """Yield the verdicts on the platform's largest position and rotation errors; none without tolerances.

    Args:
        subject: robot with six straight legs.
        leg_error: largest leg-length error, length.
        record: recorder of the searches for a proof file.
    """
    legs, shortest = subject.legs, subject.shortest
    eps = leg_error + 2 * legs.tolerance
    if not eps > 0:
        return
    problem = subject.problem
    searches: list[tuple[WorstError, Minimum]] = []
    for claim in ERRORS:
        number = WorstError(problem, is_rotation=claim.reading.dimension is Dimension.ANGLE)
        goal = Goal(_GAP * abs(float(number.values(problem.start[None])[0, 0])))
        recorder = None if record is None else record.tree(claim.name)
        (found,) = smallest_values(number, [goal], recorder)
        searches.append((number, found))
        if record is not None:
            record.firsts[claim.name] = -found.bound
    first = PoseErrors(*(-eps * found.bound for _, found in searches))
    reach = float(np.linalg.norm(legs.platform, axis=1).max())
    # Legs of the nominal robot may be longer than the legs of a robot within the tolerance.
    exact = shortest + 2 * legs.tolerance if shortest > 0 else -math.inf
    whole = with_rest(first, eps, exact, reach)
    for k, (claim, (number, found)) in enumerate(zip(ERRORS, searches, strict=True)):
        pose, worst = problem.box.pose(problem.pose_of(found.at)), eps * number.worst(found.at)
        # To first order both signs give the same error.
        both = displaced(legs, pose, np.stack([-worst, worst], axis=1))[k]
        reached = float(np.nan_to_num(both, nan=-math.inf).max())
        reason = found.reason or ("" if math.isfinite(whole[k]) else _TOO_LARGE)
        shown = pose if math.isfinite(reached) else None
        yield verdict_of(claim, found._replace(bound=-whole[k], value=-reached, reason=reason), shown)


class PoseErrors(NamedTuple):
    """Largest pose errors.

    Attributes:
        position: largest error of the position of the platform's origin, length.
        rotation: largest angle of the rotation error, radians.
    """

    position: float
    rotation: float


def with_rest(first: PoseErrors, eps: float, shortest: float, reach: float) -> PoseErrors:
    """Return bounds of the full pose errors from first-order bounds.

    Args:
        first: first-order bounds, for leg-length errors of at most eps.
        eps: largest leg-length error, length.
        shortest: shortest leg length over the workspace, length.
        reach: largest distance of a joint from the platform's origin, length.

    Returns:
        Bounds of the pose errors; infinite if leg-length errors are too large for a bound.
    """
    r = 0.0
    for _ in range(_STEPS if all(map(math.isfinite, first)) else 0):
        grown = (eps + r) / eps * (1 + _ROUNDING)
        position, rotation = first.position * grown, first.rotation * grown
        along = position + reach * rotation
        if not along < shortest:
            break
        needed = 0.5 * (along**2 / (shortest - along) + reach * rotation**2) * (1 + _ROUNDING)
        if needed <= r:
            return PoseErrors(position, rotation)
        r = needed * (1 + 1e-6)
    return PoseErrors(math.inf, math.inf)


def displaced(legs: Legs, pose: PoseNumbers, errors: FloatArray) -> FloatArray:
    """Return the errors (2, K) of position and rotation for given leg-length errors.

    The errors are NaN where Newton's method finds no pose with these lengths, for example near a singular pose.

    Args:
        legs: joint centres.
        pose: pose without errors.
        errors: (6, K) leg-length errors, length.
    """
    z, lengths = SX.sym("z", 12), np.linalg.norm(legs.spans(pose.position, pose.rotation), axis=1, keepdims=True)
    # Unknowns: motion of the platform's origin, and a Cayley vector of the rotation.
    size = float(lengths.max())
    move, (turned, scale), wanted = z[:3], cayley_rotation(z[3:6]), z[6:]
    ends = ca.repmat(pose.position + move, 1, 6) + turned @ (pose.rotation @ legs.platform.T) / scale
    equations = (ca.sqrt(ca.sum1((ends - legs.base.T) ** 2)).T - wanted) / size
    loops = Loops(z, equations, equations, SX(0, 1), np.repeat([size, 1.0, size], [3, 3, 6]))
    found = loops.all_closed(np.vstack([np.zeros(errors.shape), lengths + errors]), list(range(6)))
    return np.stack([np.linalg.norm(found[:3], axis=0), 2 * np.arctan(np.linalg.norm(found[3:6], axis=0))])
