"""Limits of a case on legs and joints, as functions of a point of its kinematics."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import Dimension
from ..case.limits.constraint import BoundedConstraint, Reading
from ..case.limits.limit import PosedRobot
from .kinematics import Kinematics

#: Limits that depend on loads, motions or the whole Jacobian.
_NOT_OF_JOINTS = frozenset(
    ("condition_number", "smallest_singular_value", "actuator_rate", "actuator_force", "actuator_speed", "actuator_power")
    + ("deflection", "rate_share", "custom")
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
        if limit.needs_motion or limit.name.partition(".")[0] in _NOT_OF_JOINTS:
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
        ValueError: the reading has another form.
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
    raise ValueError(f"no expression is known for the reading {reading}")


def limit_texts(robot: Kinematics, limits: tuple[KinematicLimit, ...], kin: str) -> dict[str, str]:
    """Return the texts for the placeholders about limits."""
    from .ctext import comment_text, name_cases  # noqa: PLC0415 - short names beside those of the templates

    KIN, u = kin.upper(), "double *u, " if robot.unknowns else ""
    pass_u = "u, " if robot.unknowns else ""
    if not limits:
        return {"nlimits": "0", "limits_declarations": "", "limits_bodies": "", "limits_prototype": ""}
    lines = "\n".join(f" *   {k}: {comment_text(each.name)} ({each.unit or 'number'})" for k, each in enumerate(limits))
    names = name_cases([each.name for each in limits])
    return {
        "nlimits": str(len(limits)),
        "limits_declarations": f"""
/* Margins of the case's limits on legs and joints: distances to the limits, negative where one is violated. violated is their
 * number, and may be 0 for none. The margins are
{lines}
 */
int {kin}_limits(const {kin}_real position[3], const {kin}_real rotation[9], {u}{kin}_real margins[{KIN}_LIMITS], int *violated);
const char *{kin}_limit_name(int limit);
""",
        "limits_prototype": f"int {kin}_CASADI_limits(const real **arg, real **res, int *iw, real *w, int mem);",
        "limits_bodies": f"""
const char *{kin}_limit_name(int limit) {{
    switch (limit) {{
{names}
        default: return "";
    }}
}}

int {kin}_limits(const {kin}_real position[3], const {kin}_real rotation[9], {u}{kin}_real margins[{KIN}_LIMITS], int *violated) {{
    double z[Z];
    real point[Z], q[A], found[{KIN}_LIMITS], w[WORK + 1];
    const real *arg[ARGUMENTS];
    real *res[RESULTS];
    int i, count = 0, status = get_point(position, rotation, {pass_u}z);
    if (status == {KIN}_OK) status = motors_at(z, q);
    if (status != {KIN}_OK) return status;
    to_real(z, point, Z);
    arg[0] = point;
    res[0] = found;
    if ({kin}_CASADI_limits(arg, res, 0, w, 0)) return {KIN}_SINGULAR;
    for (i = 0; i < {KIN}_LIMITS; ++i)
        if (!is_finite(found[i])) return {KIN}_SINGULAR;
    for (i = 0; i < {KIN}_LIMITS; ++i) {{
        margins[i] = found[i];
        count += found[i] < 0;
    }}
    if (violated) *violated = count;
    KEEP(z);
    return {KIN}_OK;
}}
""",
    }
