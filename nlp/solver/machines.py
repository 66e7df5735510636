"""A machine with errors of its joint centres, in symbols of its design: the constraints of an exchange of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from ...models import LegInstance, RobotInstance
from ...models.wrench import force_along
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint
from ..case.limits.limit import Design, Limit, Plate, PlateJoint
from ..proof.statement.machine import JointErrors


def machine_of(robot: RobotInstance, case: Case, errors: JointErrors) -> RobotInstance:
    """Return a robot of six straight legs at a pose with errors of its joint centres.

    Args:
        robot: the exact machine.
        case: the case, whose tasks the rates belong to.
        errors: of the joint centres.
    """
    legs = []
    for leg, base, platform in zip(robot.legs, *(each.tolist() for each in errors), strict=True):
        e, f = SX(base), SX(platform)
        span = leg.span + robot.rotation @ f - e
        legs.append(replace(leg, base=leg.base + e, platform=leg.platform + f, span=span))
    rows = tuple(force_along(leg.name, leg.base, leg.span) for leg in legs)
    twists = [SX(np.asarray(task.twist, dtype=np.float64).tolist()) for task in case.tasks]
    rates = ca.horzcat(*[ca.vertcat(*[row.rate(twist) / ca.sqrt(row.square) for row in rows]) for twist in twists])
    unit = [ca.vertcat(row.force, row.moment).T / ca.sqrt(row.square) for row in rows]
    totals = ca.sum1(rates * rates).T
    return replace(
        robot, legs=tuple(legs), rows=rows, rates=rates, F=totals, magnitude=totals, jacobian=ca.vertcat(*unit)
    )


def with_spans_of(exact: RobotInstance, machine: RobotInstance) -> tuple[LegInstance, ...]:
    """Return the legs of the design with the spans of a machine."""
    return tuple(replace(one, span=other.span) for one, other in zip(exact.legs, machine.legs, strict=True))


def on_plates(limit: Limit[Any], case: Case, robot: RobotInstance) -> Iterator[BoundedConstraint]:
    """Yield the constraints of a limit on the joint centres of a machine, which no pose changes."""
    for name in ("base", "platform"):
        yield from limit.on_plate(Plate(name, tuple(PlateJoint(leg.name, getattr(leg, name)) for leg in robot.legs)))
    if not limit.needs_legs:
        return
    yield from limit.of_design(Design(case.as_limited, (robot,), {}))
