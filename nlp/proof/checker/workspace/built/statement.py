"""Claims about numbers of every machine within a tolerance: which there are, and the rule of each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import matrix_from_axis_angle
from .....case.limits.actuator_rate import ActuatorRate
from .....case.limits.constraint import BoundedConstraint
from .....case.limits.joints import BaseJointAngle, JointAngle, MountingPose, PlatformJointAngle, unit_axes
from .....case.limits.limit import PosedRobot
from .....case.limits.plates import Footprint, JointSpacing, RadiusRatio
from .....case.limits.rate_share import RateShare
from .....case.limits.relation import Relations
from .....case.task import Sense
from .....program.layout import Layout
from ....statement.claims import Claim, claims_of_items, with_limits
from ...proof_file import ProofError
from .rules import Machines, TaskRates, angle, minus_cosine, radius_ratio, task_rates

#: Limits on numbers that change with the pose: where those of two legs are the same number of the exact machine, they
#: differ for others.
_CHANGING = (JointAngle, RateShare, ActuatorRate)


class BuiltNumber(NamedTuple):
    """A number over all machines.

    Attributes:
        expression: (1, 1) bound of the number over the machines, in the terms of a program.
        allowance: further change of the number as people read it, not negative.
        least, most: ends of what the number can be.
    """

    expression: SX
    allowance: float = 0.0
    least: float = -math.inf
    most: float = math.inf


def with_further(layout: Layout, claims: Sequence[Claim]) -> list[Claim]:
    """Return the claims about a case, with those that other machines than the exact one need.

    Args:
        layout: the case as symbols of the pose.
        claims: about the exact machine, of whose limits with the same number one stands for all.
    """
    known = {each.name for each in claims if each.key}
    items = [item for item, _, _ in _changing(layout) if item.constraint.name not in known]
    return with_limits(claims, list(claims_of_items(items)))


class _Changing(NamedTuple):
    """A limit's constraint on a leg; for rates, in a task."""

    item: BoundedConstraint
    limit: JointAngle | RateShare | ActuatorRate
    place: tuple[int, int]


def _changing(layout: Layout) -> Iterator[_Changing]:
    """Yield the constraints of limits on numbers that change with the pose."""
    case, robot = layout.case, layout.robots[0]
    posed = PosedRobot(case.model, robot, tuple(task.name for task in case.tasks))
    names = [leg.name for leg in robot.legs]
    for limit in case.limits:
        if not isinstance(limit, _CHANGING):
            continue
        # Those on angles are one for each leg; those on rates are one for each limb and task, in two orders.
        tasks = range(1 if isinstance(limit, JointAngle) else len(case.tasks))
        order = [names.index(name) for name in (names if isinstance(limit, JointAngle) else case.model.limbs)]
        places = list(itertools.product(order, tasks))
        if isinstance(limit, RateShare):
            places = [(i, j) for j in tasks for i in order]
        for item, place in zip(limit.at_pose(posed), places, strict=True):
            yield _Changing(item, limit, place)


class BuiltNumbers:
    """The numbers of a case over all machines.

    Args:
        layout: the case as symbols of the pose.
        machines: the machines.
    """

    def __init__(self, layout: Layout, machines: Machines) -> None:
        self._machines, self._layout = machines, layout
        robot, case = layout.robots[0], layout.case
        self._names = [leg.name for leg in robot.legs]
        self._rates: list[TaskRates] = [
            task_rates(machines, [float(part) for part in np.asarray(task.twist)], j)
            for j, task in enumerate(case.tasks)
        ]
        self._rules: dict[str, Callable[[float], BuiltNumber]] = {
            each.item.constraint.name: partial(self._limited, each.limit, *each.place) for each in _changing(layout)
        }

    def of(self, claim: Claim) -> BuiltNumber:
        """Return the number of a claim.

        Raises:
            ProofError: it has no rule.
        """
        sign = 1.0 if claim.sense is Sense.MAX else -1.0
        if claim.key and claim.name in self._rules:
            return self._rules[claim.name](sign)
        found = self._of_plates(claim, sign) or self._of_pose(claim, sign)
        if found is None:
            raise ProofError("this number has no rule for errors of joint centres")
        return found

    def _of_plates(self, claim: Claim, sign: float) -> BuiltNumber | None:
        """Return the number of a limit on plates, or of a relation, that no pose changes; None for another."""
        expression, t = claim.expression, self._machines.legs.tolerance
        numbers = {
            JointSpacing.key: BuiltNumber(expression, 2 * t, least=0.0),
            Footprint.key: BuiltNumber(expression, t),
            RadiusRatio.key: BuiltNumber(radius_ratio(self._machines, sign), least=0.0),
            # About the numbers of the case, which no machine changes.
            Relations.key: BuiltNumber(expression),
        }
        return numbers.get(claim.key.partition(".")[0].partition("[")[0])

    def _of_pose(self, claim: Claim, sign: float) -> BuiltNumber | None:
        """Return a length of a leg, F, or a measure that is asked for; None for another."""
        if claim.leg is not None:
            return BuiltNumber(claim.expression, 2 * self._machines.legs.tolerance, least=0.0)
        if claim.task is not None:
            return BuiltNumber(self._rates[claim.task].total(sign), least=0.0)
        owner, normal = claim.name.partition(" limb ")[2], SX([0, 0, 1])
        axes = {BaseJointAngle.key: normal, PlatformJointAngle.key: self._machines.robot.rotation @ normal}
        if claim.quantity not in axes or owner not in self._names:
            return None
        return _angle(angle(self._machines, self._names.index(owner), axes[claim.quantity], sign))

    def _limited(
        self,
        limit: JointAngle | RateShare | ActuatorRate,
        leg: int,
        task: int,
        sign: float,  # noqa: ARG002 - one side
    ) -> BuiltNumber:
        """Return the number of a limit that changes with the pose."""
        if isinstance(limit, JointAngle):
            return _angle(minus_cosine(self._machines, leg, self._axis(limit, leg)))
        if isinstance(limit, RateShare):
            return BuiltNumber(self._rates[task].share(leg), least=0.0, most=1.0)
        return BuiltNumber(self._rates[task].square(leg), least=0.0)

    def _axis(self, limit: JointAngle, leg: int) -> SX:
        """Return the unit mounting axis (3, 1) of a joint in the world: joints are mounted as in the design."""
        legs, robot = self._machines.legs, self._machines.robot
        is_of_base = isinstance(limit, BaseJointAngle)
        if limit.about is None:
            axis = SX([0, 0, 1])
        elif isinstance(limit.about, MountingPose):
            home = limit.about
            about = SX(unit_axes((home.axis,), 1)[0].tolist())
            rotation = matrix_from_axis_angle(about, SX(home.angle))
            span = SX(list(home.position)) + rotation @ SX(legs.platform[leg].tolist()) - SX(legs.base[leg].tolist())
            axis = span / ca.norm_2(span)
            axis = axis if is_of_base else rotation.T @ axis
        else:
            axis = SX(unit_axes(limit.about, len(self._names))[leg].tolist())
        return axis if is_of_base else robot.rotation @ axis


def _angle(expression: SX) -> BuiltNumber:
    """Return an angle, which is between 0 and half a turn."""
    return BuiltNumber(expression, least=0.0, most=math.pi)
