"""Limits of a case on legs and joints, as functions of a point of its kinematics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import Dimension
from ..case.limits.constraint import BoundedConstraint, Reading
from ..case.limits.limit import PosedRobot
from ..errors import InputError
from .ctext import comment_text, name_cases
from .kinematics import Kinematics
from .templates import fill_template, prototype

#: Limits that depend on the task or on the whole Jacobian.
_NOT_OF_JOINTS = frozenset(
    ("condition_number", "smallest_singular_value", "actuator_rate", "rate_share", "custom", "F")
)
#: Values at which two forms of a reading are compared, and their largest relative difference.
_VALUES, _SAME = (0.15, 0.4, 0.85), 1e-9


class KinematicLimit(NamedTuple):
    """A side of a limit.

    Attributes:
        name: name of the limit, with its side.
        margin: (1, 1) distance to the limit in the controller's unit; negative where the limit is violated.
        unit: unit of the margin; empty for a plain number.
    """

    name: str
    margin: SX
    unit: str


def limits_of(robot: Kinematics) -> tuple[KinematicLimit, ...]:
    """Return the limits of a case on legs and joints at a point of its kinematics."""
    functions, case = robot.robot, robot.case
    posed = PosedRobot(functions.model, functions.robot, ())
    found: list[KinematicLimit] = []
    for limit in case.limits:
        if limit.needs_motion or limit.needs_loads or limit.name.partition(".")[0] in _NOT_OF_JOINTS:
            continue
        for each in limit.at_pose(posed):
            found += _sides(robot, each)
    return tuple(found)


def _sides(robot: Kinematics, bounded: BoundedConstraint) -> list[KinematicLimit]:
    """Return both sides of a constraint that have a bound."""
    constraint, reading = bounded.constraint, bounded.constraint.reading
    measured = constraint.exact if constraint.exact is not None else _measured(reading)(constraint.expression)
    (value,) = ca.Function("measured", [robot.robot.z], [ca.densify(measured)]).call([robot.world])
    units = robot.case.units
    scale, unit = {
        Dimension.ANGLE: (1 / robot.transform.degrees, robot.controller.angle),
        Dimension.LENGTH: (robot.transform.scale, robot.controller.length or units.length),
    }.get(reading.dimension, (1.0, units.label(reading.dimension)))
    found = []
    for side, bound, sign in (("min", bounded.lower, 1.0), ("max", bounded.upper, -1.0)):
        if math.isfinite(bound):
            margin = scale * sign * (value - reading.from_value(bound))
            found.append(KinematicLimit(f"{constraint.name}, {side}", margin, unit))
    return found


def _measured(reading: Reading) -> Callable[[SX], SX]:
    """Return the function from the value of a constraint to the measured value.

    Raises:
        InputError: the conversion has an unsupported form.
    """
    part = reading.from_value(_VALUES[0]) / _VALUES[0]
    forms: tuple[Callable[[SX], SX], ...] = (
        lambda value: value,
        lambda value: ca.sqrt(ca.fmax(value, 0)),
        lambda value: ca.acos(ca.fmin(ca.fmax(-value, -1), 1)),
        lambda value: 2 * ca.asin(ca.fmin(ca.fmax(value, -1), 1)),
        lambda value: part * value,
    )
    for form in forms:
        values = ((float(form(SX(each))), reading.from_value(each)) for each in _VALUES)
        if all(abs(one - other) <= _SAME * max(1.0, abs(other)) for one, other in values):
            return form
    raise InputError(f"kinematics in C: a limit in {reading.dimension.value} has no expression in C")


def limit_texts(limits: tuple[KinematicLimit, ...], names: Mapping[str, str]) -> dict[str, str]:
    """Return the texts for the placeholders about limits.

    Args:
        limits: the limits.
        names: texts of the other placeholders.
    """
    if not limits:
        empty = dict.fromkeys(("limits_declarations", "limits_bodies", "limits_prototype"), "")
        return {"nlimits": "0", **empty}
    lines = (f" *   {k}: {comment_text(each.name)} ({each.unit or 'number'})" for k, each in enumerate(limits))
    own = {"limit_lines": "\n".join(lines), "limit_names": name_cases([each.name for each in limits]), **names}
    return {
        "nlimits": str(len(limits)),
        "limits_prototype": prototype(names["kin"], "limits"),
        "limits_declarations": fill_template("kinematics/limits.h.in", own),
        "limits_bodies": fill_template("kinematics/limits.c.in", own),
    }
