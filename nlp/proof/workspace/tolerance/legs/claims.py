"""Claims about every machine within a tolerance on joint centres, from those about the exact machine."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray, matrix_from_axis_angle
from .....case.limits.actuator_rate import ActuatorRate
from .....case.limits.constraint import BoundedConstraint
from .....case.limits.joints import BaseJointAngle, JointAngle, MountingPose, unit_axes
from .....case.limits.legs import Actuator
from .....case.limits.limit import Design, Plate, PlateJoint, PosedRobot
from .....case.limits.plates import Footprint, JointSpacing, RadiusRatio
from .....case.limits.rate_share import RateShare
from .....case.limits.relation import Relations
from .....case.task import Sense
from .....case.workspace import Workspace
from .....program.layout import Layout
from ....statement.claims import Claim, claims_of_items, with_limits
from ....statement.machine import LEGS, Legs
from ....statement.tolerance_bound import Worst
from ...robot.pose_box import PoseNumbers, pose_box
from .worst import (
    LegAngle,
    Rates,
    rates_of,
    spans,
    worst_angle,
    worst_length,
    worst_rate,
    worst_share,
    worst_sum,
)
from .worst_plates import worst_radius, worst_ratio, worst_spacing

#: Reasons for claims that are open because errors of joint centres are not covered.
_NO_RULE = "this number has no rule for errors of joint centres; without [tolerance] the exact machine is judged"
_SHORT = "no length of legs above the errors of joint centres is proved"


#: The worst machines of a number: the largest for a sign of 1, the smallest for -1.
_Rule = Callable[[float], Worst]


class _Limited(NamedTuple):
    """A constraint of a limit with the worst machines of its number, and whether the number changes with the pose."""

    item: BoundedConstraint
    rule: _Rule
    changes: bool = False


def built_claims(
    layout: Layout, workspace: Workspace, legs: Legs, claims: Sequence[Claim], shortest: float
) -> list[Claim]:
    """Return claims about every machine within the legs' tolerance.

    A claim about a number that has no rule for the errors says so, and is never proved.

    Args:
        layout: the case as symbols of the pose.
        workspace: the poses.
        legs: joint centres, with their tolerance.
        claims: about the exact machine.
        shortest: proven shortest length of a leg of the exact machine.
    """
    if not shortest > 2 * legs.tolerance:
        return [replace(each, uncovered=_SHORT) for each in claims]
    context = _Context(layout, workspace, legs, shortest)
    limited = {each.item.constraint.name: each for each in context.limited()}
    found = [context.built(each, limited) for each in claims]
    # Of limits that are the same number of the exact machine, one is a claim about it. Where a number changes with the
    # pose, those of other machines may differ. A measure that is asked for has the name of the limit on it, and is no
    # claim about the limit.
    known = {each.name for each in claims if each.key}
    missing = [each for name, each in limited.items() if name not in known and each.changes]
    added = [context.built(each, limited) for each in claims_of_items([each.item for each in missing])]
    return with_limits(found, added)


class _Context:
    """The case, its legs and its tasks.

    Args:
        layout, workspace, legs, shortest: as for :func:`built_claims`.
    """

    def __init__(self, layout: Layout, workspace: Workspace, legs: Legs, shortest: float) -> None:
        self.layout, self.case, self.robot, self.legs = layout, layout.case, layout.robots[0], legs
        box = pose_box(workspace)
        farthest = float(np.linalg.norm(np.maximum(np.abs(box.lower[:3]), np.abs(box.upper[:3]))))
        twists = [[float(part) for part in np.asarray(task.twist)] for task in self.case.tasks]
        self.rates: list[Rates] = [
            rates_of(legs, twist, self.robot, j, shortest, farthest) for j, twist in enumerate(twists)
        ]
        self.names = [leg.name for leg in self.robot.legs]
        # Relations are about the case's numbers, which no machine changes.
        relations = [limit for limit in self.case.limits if isinstance(limit, Relations)]
        self.of_numbers = {f"custom: {text.strip()}" for limit in relations for text in limit.texts}

    def built(self, claim: Claim, limited: dict[str, _Limited]) -> Claim:
        """Return a claim about every machine."""
        sign = 1.0 if claim.sense is Sense.MAX else -1.0
        # A measure that is asked for has the name of the limit on it, in other terms.
        if claim.key and claim.name in limited:
            return replace(claim, worst=limited[claim.name].rule(sign))
        if claim.name in self.of_numbers:
            return claim
        if claim.leg is not None:
            return replace(claim, worst=worst_length(self.legs, claim.leg, sign))
        if claim.task is not None:
            return replace(claim, worst=worst_sum(self.rates[claim.task], self.robot.F[claim.task], sign))
        if claim.quantity:
            worst = self._of_quantity(claim.quantity, claim.name, sign)
            if worst is not None:
                return replace(claim, worst=worst)
        return replace(claim, uncovered=_NO_RULE)

    def _of_quantity(self, name: str, claim: str, sign: float) -> Worst | None:
        """Return the worst machines of a measure of legged robots; None for another measure."""
        owner = claim.partition(" limb ")[2]
        if name not in ("leg_length", "base_joint_angle", "platform_joint_angle") or owner not in self.names:
            return None
        i = self.names.index(owner)
        if name == "leg_length":
            return worst_length(self.legs, i, sign)
        angle = LegAngle(i, np.array([0.0, 0.0, 1.0]), name == "platform_joint_angle")
        return worst_angle(self.legs, angle, self.robot, sign, is_cosine=False)

    def limited(self) -> Iterator[_Limited]:
        """Yield every constraint of the limits that have a rule."""
        robot, legs = self.robot, self.legs
        posed = PosedRobot(self.case.model, robot, tuple(task.name for task in self.case.tasks))
        for limit in self.case.limits:
            if isinstance(limit, JointSpacing | Footprint):
                yield from self._of_plates(limit)
            elif isinstance(limit, Actuator):
                for i, item in enumerate(limit.of_design(Design(self.case.as_limited, (robot,), {}))):
                    yield _Limited(item, partial(worst_length, legs, i))
            elif isinstance(limit, RadiusRatio):
                for item in limit.of_design(Design(self.case.as_limited, (robot,), {})):
                    yield _Limited(item, partial(worst_ratio, legs))
            elif isinstance(limit, JointAngle):
                axes, on_platform = _mounting_axes(limit, legs), not isinstance(limit, BaseJointAngle)
                for i, item in enumerate(limit.at_pose(posed)):
                    angle = LegAngle(i, axes[i], on_platform)
                    yield _Limited(item, partial(worst_angle, legs, angle, robot, is_cosine=True), changes=True)
            elif isinstance(limit, RateShare | ActuatorRate):
                yield from self._of_rates(limit, posed)

    def _of_plates(self, limit: JointSpacing | Footprint) -> Iterator[_Limited]:
        """Yield the limits on the joint centres of the plates."""
        for name in ("base", "platform"):
            plate = Plate(name, tuple(PlateJoint(leg.name, getattr(leg, name)) for leg in self.robot.legs))
            pairs = list(itertools.combinations(range(LEGS), 2))
            for k, item in enumerate(limit.on_plate(plate)):
                spacing = partial(worst_spacing, self.legs, name, *pairs[k])
                radius = partial(worst_radius, self.legs, name, min(k, LEGS - 1))
                worst = spacing() if isinstance(limit, JointSpacing) else radius()
                yield _Limited(item, partial(_same, worst))

    def _of_rates(self, limit: RateShare | ActuatorRate, posed: PosedRobot) -> Iterator[_Limited]:
        """Yield the limits on rates: of each limb, for each task."""
        limbs, tasks = self.case.model.limbs, range(len(self.rates))
        places = [(limb, j) for limb in limbs for j in tasks]
        if isinstance(limit, RateShare):
            places = [(limb, j) for j in tasks for limb in limbs]
        for item, (limb, j) in zip(limit.at_pose(posed), places, strict=True):
            i, rates, F = self.names.index(limb), self.rates[j], self.robot.F[j]
            worst = worst_share(rates, F, i) if isinstance(limit, RateShare) else worst_rate(rates, i)
            yield _Limited(item, partial(_same, worst), changes=True)


def _same(worst: Worst, sign: float) -> Worst:  # noqa: ARG001 - the limit has one side
    """Return the worst machines of a number that is limited from one side."""
    return worst


def _mounting_axes(limit: JointAngle, legs: Legs) -> FloatArray:
    """Return the unit mounting axes (6, 3) of the design's joints, in the frame of their plate."""
    if limit.about is None:
        return np.tile([0.0, 0.0, 1.0], (LEGS, 1))
    if not isinstance(limit.about, MountingPose):
        return unit_axes(limit.about, LEGS)
    home = limit.about
    (axis,) = unit_axes((home.axis,), 1)
    rotation = np.array(ca.evalf(matrix_from_axis_angle(SX(axis.tolist()), SX(home.angle))))
    n = spans(legs, PoseNumbers(np.array(home.position), rotation, axis, home.angle)).n
    return n if isinstance(limit, BaseJointAngle) else np.asarray(n @ rotation)
