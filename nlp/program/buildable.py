"""Limits as named smooth constraints on the robot's expressions.

Each limit becomes constraints whose expression grows with the measured number, so that a lower limit is a lower bound:
squared lengths, ``-cos`` of angles, ``-1/c^2`` of a condition number. Readings bring values, limits and multipliers
back to the words of the case. How each is written, and why it is exact:

* ``leg_length``: the squared length between its squared limits;
* ``actuator``: by pairs of poses, since ``longest - shortest <= s`` means ``l_i - l_j <= s`` for all of them, and
  ``shortest >= d + stroke`` means ``2 l_i - l_j >= d``; no extra unknowns;
* joint angles: ``n . s / |s| >= cos(limit)``;
* ``joint_spacing``, ``footprint``, ``radius_ratio``: squared;
* ``leg_clearance``: a smooth function of the exact distance of segments (:mod:`screwsynth.nlp.case.limits.segments`);
* singular values: eigenvalues of ``J'J`` (:mod:`screwsynth.nlp.case.limits.spectrum`);
* ``rate_share``: a limb's part of F.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, RobotInstance, WrenchKind, matrix_from_axis_angle
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.limits.grammar import expression, parse
from ..case.limits.limits import Cone, Homogenised, Interval, MountingPose, unit_axes
from ..case.limits.segments import squared_distance
from ..case.limits.spectrum import largest_eigenvalue, smallest_eigenvalue


def _squared(dimension: Dimension) -> Reading:
    """A square read as the number itself."""
    return Reading(
        dimension,
        from_value=lambda value: math.sqrt(max(value, 0.0)),
        slope=lambda value: 2 * math.sqrt(max(value, 0.0)),
        to_value=lambda number: number * number,
    )


_LENGTH, _NUMBER = Reading(Dimension.LENGTH), Reading(Dimension.NUMBER)
_SQUARED_LENGTH, _SQUARED_NUMBER = _squared(Dimension.LENGTH), _squared(Dimension.NUMBER)
#: ``-cos(angle)`` read as the angle.
_ANGLE = Reading(
    Dimension.ANGLE,
    from_value=lambda value: math.acos(min(max(-value, -1.0), 1.0)),
    slope=lambda value: math.sqrt(max(1 - value * value, 0.0)),
    to_value=lambda number: -ca.cos(number),
)
#: ``-1 / c^2`` read as the condition number c.
_CONDITION = Reading(
    Dimension.NUMBER,
    from_value=lambda value: 1 / math.sqrt(-value) if value < 0 else math.inf,
    slope=lambda value: 2 * max(-value, 0.0) ** 1.5,
    to_value=lambda number: -1 / (number * number),
)
#: Relative difference of two limits that are the same: rounding.
_SAME = 1e-12
#: Keeps a limb's share of F defined where F is 0, in parts of F's size without cancellation.
_SHARELESS = 1e-14


def limits_of(case: Case, robots: Sequence[RobotInstance], numbers: Mapping[str, SX]) -> list[BoundedConstraint]:
    """Every limit of a case as constraints.

    Args:
        case: the case.
        robots: the robot at each pose.
        numbers: the case's numbers by name, angles in radians, for ``custom``.
    """
    return [
        *_of_plates(case, robots[0]),
        *_of_custom(case, numbers),
        *_of_actuators(case, robots),
        *(
            replace(item, constraint=replace(item.constraint, pose=k))
            for k, robot in enumerate(robots)
            for item in _at_pose(case, robot, f" pose {k + 1}" if len(robots) > 1 else "")
        ),
    ]


def _sided(name: str, measured: SX, reading: Reading, key: str, interval: Interval) -> BoundedConstraint:
    """A limit whose numbers are written as ``key.min`` and ``key.max``."""
    keys = ("" if interval.min is None else f"{key}.min", "" if interval.max is None else f"{key}.max")
    return _bounded(name, measured, reading, keys, interval)


def _bounded(name: str, measured: SX, reading: Reading, keys: tuple[str, str], interval: Interval) -> BoundedConstraint:
    """A constraint from the numbers of its limit as people write them."""
    lower = -math.inf if interval.min is None else float(reading.to_value(SX(interval.min)))
    upper = math.inf if interval.max is None else float(reading.to_value(SX(interval.max)))
    return BoundedConstraint(Constraint(name, measured, reading, keys), lower, upper)


def _at_pose(case: Case, robot: RobotInstance, where: str) -> Iterator[BoundedConstraint]:
    limits = case.limits
    if limits.leg_length is not None:
        for leg in robot.legs:
            name = f"leg_length limb {leg.name}{where}"
            yield _sided(name, ca.sumsqr(leg.span), _SQUARED_LENGTH, "leg_length", limits.leg_length)
    yield from _of_joints(case, robot, where)
    if limits.leg_clearance is not None:
        for one, other in itertools.combinations(robot.legs, 2):
            name = f"leg_clearance limbs {one.name} and {other.name}{where}"
            yield _apart(name, squared_distance(one.base, one.span, other.base, other.span), limits.leg_clearance)
    yield from _of_singular_values(case, robot, where)
    if limits.rate_share is not None:
        yield from _of_rates(case, robot, limits.rate_share, where)
    for quantity, values in zip(case.model.quantities, robot.quantities, strict=True):
        if quantity.name in limits.quantities:
            for i, owner in enumerate(quantity.owners):
                name, interval = f"{quantity.name} limb {owner}{where}", limits.quantities[quantity.name]
                yield _sided(name, values[i], Reading(quantity.dimension), quantity.name, interval)


def _apart(name: str, squared: SX, limit: float) -> BoundedConstraint:
    """A limit on a distance from below: ``1 - (1 - d^2/D^2)^3`` for d below D, which is twice the limit, and 1 beyond.

    It grows with d and is smooth to second order, and legs that are far apart have no part in any derivative: where
    such legs happen to be parallel, second derivatives of their distance are not finite.
    """
    far = 4 * limit**2

    def near(squared: SX) -> SX:
        return 1 - ca.fmax(0, 1 - squared / far) ** 3

    def distance(value: float) -> float:
        return math.sqrt(far * (1 - max(1 - value, 0.0) ** (1 / 3)))

    reading = Reading(
        Dimension.LENGTH,
        from_value=lambda value: distance(max(value, 0.0)),
        slope=lambda value: 6 * max(1 - value, 0.0) ** (2 / 3) * distance(max(value, 0.0)) / far,
        to_value=lambda number: near(number * number),
    )
    whole = _sided(name, near(squared), reading, "leg_clearance", Interval(min=limit))
    return replace(whole, constraint=replace(whole.constraint, exact=ca.sqrt(squared)))


def _of_joints(case: Case, robot: RobotInstance, where: str) -> Iterator[BoundedConstraint]:
    """Cones of the passive joints."""
    R = robot.rotation
    for key, cone in (
        ("base_joint_angle", case.limits.base_joint_angle),
        ("platform_joint_angle", case.limits.platform_joint_angle),
    ):
        if cone is None:
            continue
        for i, (leg, axis) in enumerate(zip(robot.legs, _mounting_axes(cone, key, robot), strict=True)):
            in_world = axis if key == "base_joint_angle" else R @ axis
            cosine = ca.dot(in_world, leg.span) / ca.norm_2(leg.span)
            name = f"{key} limb {robot.legs[i].name}{where}"
            yield _sided(name, -cosine, _ANGLE, key, Interval(max=cone.max))


def _mounting_axes(cone: Cone, key: str, robot: RobotInstance) -> list[SX]:
    """Unit mounting axis of each joint in its plate's frame, (3, 1)."""
    if cone.about is None:
        return [SX([0, 0, 1])] * len(robot.legs)
    if isinstance(cone.about, MountingPose):
        (axis,) = unit_axes((cone.about.axis,), 1)
        R, p = matrix_from_axis_angle(SX(axis.tolist()), SX(cone.about.angle)), SX(list(cone.about.position))
        spans = [p + R @ leg.platform - leg.base for leg in robot.legs]
        spans = [span / ca.norm_2(span) for span in spans]
        return spans if key == "base_joint_angle" else [R.T @ span for span in spans]
    return [SX(axis.tolist()) for axis in unit_axes(cone.about, len(robot.legs))]


def _of_singular_values(case: Case, robot: RobotInstance, where: str) -> Iterator[BoundedConstraint]:
    smallest, condition = case.limits.smallest_singular_value, case.limits.condition_number
    if smallest is not None:
        squared = smallest_eigenvalue(_gram(case, robot, smallest))
        interval = Interval(min=smallest.limit)
        name = f"smallest_singular_value{where}"
        yield _sided(name, squared, _SQUARED_NUMBER, "smallest_singular_value", interval)
    if condition is not None:
        gram = _gram(case, robot, condition)
        ratio = -smallest_eigenvalue(gram) / largest_eigenvalue(gram)
        interval = Interval(max=condition.limit)
        yield _sided(f"condition_number{where}", ratio, _CONDITION, "condition_number", interval)


def _gram(case: Case, robot: RobotInstance, homogenised: Homogenised) -> SX:
    """``J'J`` of J with its moments about the platform's origin, divided by a length."""
    rows = []
    for i, row in enumerate(case.model.wrenches):
        force, moment = robot.jacobian[i, :3], robot.jacobian[i, 3:]
        if row.kind is WrenchKind.FORCE:
            moment = moment - ca.cross(robot.position, force.T).T
        rows.append(ca.horzcat(force, moment / homogenised.length))
    J = ca.vertcat(*rows)
    return J.T @ J


def _of_rates(case: Case, robot: RobotInstance, share: float, where: str) -> Iterator[BoundedConstraint]:
    for j, task in enumerate(case.tasks if robot.rates.shape[1] > 1 else [None]):
        whose = "" if task is None else f" task {task.name}"
        whole = robot.F[j] + _SHARELESS * robot.magnitude[j]
        for limb in case.model.limbs:
            own = [robot.rates[i, j] for i, row in enumerate(case.model.wrenches) if row.limb == limb]
            part = sum((rate**2 for rate in own), SX(0)) / whole
            yield _sided(f"rate_share limb {limb}{whose}{where}", part, _NUMBER, "rate_share", Interval(max=share))


def _of_plates(case: Case, robot: RobotInstance) -> Iterator[BoundedConstraint]:
    """Limits on where joint centres are, which no pose changes."""
    limits = case.limits
    plates = {
        "base": [(leg.name, leg.base) for leg in robot.legs],
        "platform": [(leg.name, leg.platform) for leg in robot.legs],
    }
    for plate, joints in plates.items():
        if limits.joint_spacing is not None:
            for (one, a), (other, b) in itertools.combinations(joints, 2):
                name, interval = f"joint_spacing {plate} joints {one} and {other}", Interval(min=limits.joint_spacing)
                yield _sided(name, ca.sumsqr(a - b), _SQUARED_LENGTH, "joint_spacing", interval)
        largest = getattr(limits.footprint, plate, None)
        if largest is not None:
            for name, joint in joints:
                radius = ca.sumsqr(joint[:2])
                where = f"footprint {plate} joint {name}"
                yield _bounded(where, radius, _SQUARED_LENGTH, ("", f"footprint.{plate}"), Interval(max=largest))
    if limits.radius_ratio is not None:
        radii = [sum((ca.sumsqr(joint[:2]) for _, joint in plates[plate]), SX(0)) for plate in ("platform", "base")]
        yield _sided("radius_ratio", radii[0] / radii[1], _SQUARED_NUMBER, "radius_ratio", limits.radius_ratio)


def _of_actuators(case: Case, robots: Sequence[RobotInstance]) -> Iterator[BoundedConstraint]:
    actuator = case.limits.actuator
    if actuator is None:
        return
    for i, leg in enumerate(robots[0].legs):
        lengths = [ca.norm_2(robot.legs[i].span) for robot in robots]
        for (a, shorter), (b, longer) in itertools.product(enumerate(lengths), repeat=2):
            pair = f" limb {leg.name}" + (f" poses {a + 1} and {b + 1}" if len(robots) > 1 else "")
            if actuator.stroke_max is not None and a != b:
                name, interval = f"actuator.stroke_max{pair}", Interval(max=actuator.stroke_max)
                yield _bounded(name, longer - shorter, _LENGTH, ("", "actuator.stroke_max"), interval)
            if actuator.dead_length is not None and (a != b or len(robots) == 1):
                name, interval = f"actuator.dead_length{pair}", Interval(min=actuator.dead_length)
                yield _bounded(name, 2 * shorter - longer, _LENGTH, ("actuator.dead_length", ""), interval)


def _of_custom(case: Case, numbers: Mapping[str, SX]) -> Iterator[BoundedConstraint]:
    dimensions = case.scalars
    unit = case.units.to_internal(1.0, Dimension.ANGLE)
    shown = {name: numbers[name] / (unit if dimensions[name] is Dimension.ANGLE else 1.0) for name in dimensions}
    for k, text in enumerate(case.limits.custom):
        relation = parse(text, dimensions)
        difference = expression(relation.left, shown, unit) - expression(relation.right, shown, unit)
        lower = -math.inf if relation.sign == "<=" else 0.0
        upper = math.inf if relation.sign == ">=" else 0.0
        key = f"custom[{k}]"
        keys = ("" if relation.sign == "<=" else key, "" if relation.sign == ">=" else key)
        yield BoundedConstraint(Constraint(f"custom: {text.strip()}", difference, _NUMBER, keys), lower, upper)


def distinct(
    limits: Sequence[BoundedConstraint], x: SX, p: SX, values: Sequence[float], at: FloatArray
) -> list[BoundedConstraint]:
    """The limits without those that only repeat another.

    Symmetric robots have limits that are the same function of the variables ``x`` and the arguments ``p``, and would
    share one multiplier. Two limits of one key are the same where they agree, with the arguments' values, at every one
    of a few points (k, n).
    """
    if not limits:
        return []
    constraints = [item.constraint for item in limits]
    measured = [each.expression if each.exact is None else each.exact for each in constraints]
    function = ca.Function("limits", [x, p], [ca.densify(ca.vertcat(*measured))])
    columns = np.column_stack([function(point, values).full().ravel() for point in at])
    kept: list[int] = []
    for i, row in enumerate(columns):
        like = (j for j in kept if limits[j].constraint.keys == limits[i].constraint.keys)
        if not any(np.allclose(columns[j], row, rtol=_SAME, atol=0.0) for j in like):
            kept.append(i)
    return [limits[i] for i in kept]
