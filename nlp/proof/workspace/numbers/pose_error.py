"""Largest error of the platform's pose over a workspace, for every machine within its tolerances.

A leg's length changes by at most ``eps = leg error + 2 joint error`` when its joint centres and its length are in
error, at every pose: by the triangle inequality. To first order the platform's origin and its rotation are off by
``J^-1 d`` with ``|d_i| <= eps``, and the largest size is met where every ``d_i`` is eps or -eps.

Over a box ``J^-1`` is affine in the coordinates but for a rest (:mod:`.left_inverse`). Sizes are convex, and so largest
at a corner of the box.

For the rest of the pose error, let the error found be P eps in position and Q eps in rotation. By Taylor's formula the
lengths at the true pose differ from those to first order by at most

    r = ((p + a w)^2 / l + a w^2) / 2,      p = P (eps + r),  w = Q (eps + r),

with l the shortest length of a leg on the way and a the largest distance of a joint from the platform's origin. The
machine comes continuously from the one without errors, and so its errors are those of the smallest such r.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from .....models import Dimension, FloatArray
from ....case.task import Sense
from ...enclosure.forms import Forms
from ...statement.machine import LEGS, Legs
from ..ranks.krawczyk import inverses
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import ToleranceModel
from ..verdict import Outcome
from .bound_search import Bounds, smallest_number
from .extremes import Extreme
from .left_inverse import left_inverses, rows_over

if TYPE_CHECKING:
    from ..proof_writer import PaperRecord

#: Part of its size by which a computed bound is moved outwards: rounding.
_ROUNDING = 1e-10
#: Signs (6, 32) of the errors of legs: a pair of opposite signs has one size.
_ERRORS = np.array(list(itertools.product((-1.0, 1.0), repeat=LEGS)))[: 2 ** (LEGS - 1)].T
#: Steps in the search of the smallest r.
_STEPS = 200
#: Steps of Newton's method for a pose whose errors are small.
_NEWTON = 8
#: Part of the longest leg by which lengths may differ from those that are wanted: rounding.
_CLOSED = 1e-10
#: Gap of an error of the pose as a part of that at the middle of the workspace: a finer one takes many more boxes.
_GAP = 0.1


def pose_errors(
    legs: Legs, problem: Problem, eps: float, shortest: float, *, paper: PaperRecord | None = None
) -> Iterator[Extreme]:
    """Yield the largest errors of the platform's position and rotation, for every machine within its tolerances.

    Args:
        legs: joint centres.
        problem: the robot.
        eps: largest error of a leg's length, those of its joint centres included, length.
        shortest: proven shortest length of a leg over the poses.
        paper: records the searches for a proof.
    """
    names = (("position error", Dimension.LENGTH), ("rotation error", Dimension.ANGLE))
    searches, found, box = [WorstError(problem, is_rotation=which) for which in (False, True)], [], problem.box
    for each, (name, _) in zip(searches, names, strict=True):
        middle = (0.5 * (box.lower + box.upper))[None, list(problem.free)]
        recorder = None if paper is None else paper.own(name)
        gap = _GAP * abs(float(each.values(middle)[0]))
        found.append(smallest_number(each, problem, gap=gap, recorder=recorder))
        if paper is not None:
            paper.firsts[name] = -found[-1].bound
    first = PoseErrors(*(-eps * each.bound for each in found))
    reach = float(np.linalg.norm(legs.platform, axis=1).max())
    whole = with_rest(first, eps, shortest, reach) if all(map(math.isfinite, first)) else PoseErrors(math.inf, math.inf)
    for k, (name, dimension) in enumerate(names):
        y, bound = found[k].at, whole[k]
        worst = eps * searches[k].worst(y[list(problem.free)])
        # To first order both signs give the same error.
        both = [displaced(legs, box, y, sign * worst) for sign in (-1.0, 1.0)]
        reached = max((each[k] for each in both if each is not None), default=math.nan)
        is_proved = math.isfinite(bound) and not found[k].reason
        reason = found[k].reason or "the errors are too large for a bound of their terms of second order"
        yield Extreme(
            name=name,
            sense=Sense.MAX,
            dimension=dimension,
            key="",
            limit=None,
            bound=bound,
            reached=reached,
            pose=None if math.isnan(reached) else box.pose(y),
            outcome=Outcome.PROVED if is_proved else Outcome.OPEN,
            boxes=found[k].boxes,
            seconds=found[k].seconds,
            reason="" if is_proved else reason,
        )


class WorstError:
    """Minus the largest error of the pose to first order, for unit errors of legs: its smallest value is the worst.

    Args:
        problem: six straight legs.
        is_rotation: whether the rotation is meant, and not the position of the platform's origin.

    Attributes:
        entries: (42, 1) the rows of J, column by column, and their sizes.
    """

    def __init__(self, problem: Problem, *, is_rotation: bool) -> None:
        self.family: ToleranceModel | None = None
        self._part = slice(3, 6) if is_rotation else slice(0, 3)
        self._scale = np.array([1.0, 1.0, 1.0, *[problem.length] * 3])
        self.entries = ca.vertcat(ca.vec(ca.densify(problem.scaled.rows)), problem.scaled.sizes)
        self._jacobian = ca.Function("J", [problem.z], [ca.densify(problem.scaled.jacobian)])

    def values(self, z: FloatArray) -> FloatArray:
        """Return minus the error (K,) at points (K, n)."""
        return np.asarray(-np.linalg.norm(self.responses(z) @ _ERRORS, axis=1).max(axis=1))

    def worst(self, z: FloatArray) -> FloatArray:
        """Return the signs (6,) of the errors of legs that are worst at a point (n,)."""
        sizes = np.linalg.norm(self.responses(z[None])[0] @ _ERRORS, axis=0)
        return np.asarray(_ERRORS[:, int(np.argmax(sizes))])

    def responses(self, z: FloatArray) -> FloatArray:
        """Return the rows (K, 3, 6) of the inverses of J."""
        J = self._jacobian(z.T).full().reshape(LEGS, len(z), 6).transpose(1, 0, 2) * self._scale
        return inverses(J)[:, self._part]

    def over(self, forms: Forms, count: int, errors: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        inverse = left_inverses(rows_over(forms, self._scale, count, errors))
        with np.errstate(all="ignore"):
            corners = inverse.at_corners(self._part)
            worst = np.linalg.norm(corners @ _ERRORS, axis=2).max(axis=(1, 2))
            worst += np.linalg.norm(inverse.rest[:, self._part].sum(axis=2), axis=1)
        return Bounds(np.where(np.isfinite(worst), -worst * (1 + _ROUNDING), -np.inf), inverse.shares)


class PoseErrors(NamedTuple):
    """Largest errors of a platform's pose: of its origin's position, length, and of its rotation, radians."""

    position: float
    rotation: float


def with_rest(first: PoseErrors, eps: float, shortest: float, reach: float) -> PoseErrors:
    """Return bounds of the whole errors from bounds to first order.

    Args:
        first: bounds to first order, for errors of legs of at most eps.
        eps: largest error of a leg, length.
        shortest: shortest length of a leg over the workspace.
        reach: largest distance of a joint from the platform's origin.

    Returns:
        Infinite errors where no bound is found: errors are then too large for the machine.
    """
    r = 0.0
    for _ in range(_STEPS):
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


def displaced(legs: Legs, box: PoseBox, y: FloatArray, errors: FloatArray) -> PoseErrors | None:
    """Return the errors of the pose of a machine whose legs are longer by given lengths, by Newton's method.

    None where it finds no pose with these lengths, as about a singular one.

    Args:
        legs: joint centres.
        box: the poses.
        y: (6,) the pose without errors.
        errors: (6,) of the lengths of the legs.
    """
    pose = box.pose(y)
    wanted = np.linalg.norm(pose.position + legs.platform @ pose.rotation.T - legs.base, axis=1) + errors
    position, rotation = np.array(pose.position), np.array(pose.rotation)
    for k in range(_NEWTON + 1):
        arm = legs.platform @ rotation.T
        span = position + arm - legs.base
        lengths = np.linalg.norm(span, axis=1)
        if k == _NEWTON:
            break
        unit = span / lengths[:, None]
        try:
            step = np.linalg.solve(np.hstack([unit, np.cross(arm, unit)]), wanted - lengths)
        except np.linalg.LinAlgError:
            return None
        position = position + step[:3]
        rotation = _turned(step[3:]) @ rotation
    if not np.abs(lengths - wanted).max() <= _CLOSED * wanted.max():
        return None
    turned = rotation @ pose.rotation.T
    sine = np.linalg.norm([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    angle = math.atan2(float(sine), (float(np.trace(turned)) - 1) / 2)
    return PoseErrors(float(np.linalg.norm(position - pose.position)), angle)


def _turned(w: FloatArray) -> FloatArray:
    """Return the rotation matrix of a rotation vector (3,)."""
    angle = float(np.linalg.norm(w))
    if angle == 0:
        return np.eye(3)
    x, y, z = w / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)
