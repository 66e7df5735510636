"""Kinds of robots that controllers know, recognised by geometry: Deltas, six straight legs, five struts at a spindle.

A Delta's limb is an arm or a carriage with rods of a fixed length. Its dimensions are fitted to inverse kinematics at
poses near home, which is linear least squares, so every model of such a robot is recognised: with two rods, with a
parallelogram, or with universal joints.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import Dimension, FloatArray
from ..driveaxes import DriveAxis, drive_axes
from ..kinematics import Kinematics
from .samples import Samples

#: Largest difference from a kind, in parts of the robot's size or radians.
TOLERANCE = 1e-6


class OtherKindError(ValueError):
    """Error of a robot of another kind; the text is a clause with the property that differs."""


class Limb(NamedTuple):
    """Arm or carriage of a Delta with rods of a fixed length, in the conventions of the case.

    Attributes:
        actuator: name of the actuator.
        centre: (3,) position of the platform's origin at which the rods would end on the motor axis, or at the
            carriage at zero.
        outward: angle of the arm or of the carriage about the vertical axis, radians.
        arm: length of the arm; 0 for a carriage.
        rod: length of the rods.
        zero: angle of the arm below the horizontal at home, radians; 0 for a carriage.
        sign: 1 if a positive coordinate moves the arm down or the carriage up, otherwise -1.
    """

    actuator: str
    centre: FloatArray
    outward: float
    arm: float
    rod: float
    zero: float
    sign: int


class Delta(NamedTuple):
    """Delta with three equal limbs about a vertical axis, in the conventions of the case.

    Attributes:
        turns: If true, arms that turn; if false, carriages.
        limbs: the three limbs, in the order of the robot's actuators.
        axis: (2,) place of the vertical axis.
        radius: distance of motor axis or carriage from the vertical axis, minus the distance of the platform's joints
            from it.
        height: height of the motor axes, or of the carriages at zero, above the platform's joints at position 0.
    """

    turns: bool
    limbs: tuple[Limb, ...]
    axis: FloatArray
    radius: float
    height: float

    @property
    def anticlockwise(self) -> tuple[int, ...]:
        """Indices of the limbs in anticlockwise order, seen from above, beginning with the first limb."""
        first = self.limbs[0].outward
        return tuple(sorted(range(3), key=lambda k: (self.limbs[k].outward - first) % (2 * math.pi)))


class Legs(NamedTuple):
    """Six straight legs, in the conventions of the case.

    Attributes:
        base: (6, 3) base joints in the world frame.
        platform: (6, 3) platform joints in the platform frame.
        zero: (6,) length of each leg where its coordinate is 0.
    """

    base: FloatArray
    platform: FloatArray
    zero: FloatArray


class Struts(NamedTuple):
    """Five struts whose ends turn in rings about the platform's z axis, in the conventions of the case.

    Attributes:
        base: (5, 3) base joints in the world frame.
        rings: (5, 2) radius and height of the ends in the platform frame.
        zero: (5,) length of each strut where its coordinate is 0.
        sign: (5,) 1 if a positive coordinate makes the strut longer, otherwise -1.
    """

    base: FloatArray
    rings: FloatArray
    zero: FloatArray
    sign: FloatArray


def delta_of(robot: Kinematics, samples: Samples) -> Delta:
    """Return the dimensions of a Delta.

    Raises:
        OtherKindError: the robot is not a Delta.
    """
    units, size = robot.case.units, robot.size / robot.transform.scale
    drives = robot.drives
    if robot.freedoms != 3:
        raise OtherKindError(f"the platform has {robot.freedoms} degrees of freedom instead of 3")
    if len(drives) != 3 or len({each.dimension for each in drives}) != 1:
        raise OtherKindError(f"the robot has {len(drives)} actuators; 3 are needed, all revolute or all prismatic")
    if robot.coordinates != (0, 1, 2) or samples.turned > TOLERANCE:
        turned = units.text(samples.turned, Dimension.ANGLE)
        raise OtherKindError(f"the platform rotates by {turned} near home, but the platform of a Delta does not rotate")
    turns = drives[0].dimension is Dimension.ANGLE
    fit = _arm if turns else _carriage
    limbs = tuple(fit(robot, samples, k, each.direction, size) for k, each in enumerate(_drives(robot)))
    if not turns:
        limbs = _outward(limbs)
    radial = np.array([[math.cos(each.outward), math.sin(each.outward)] for each in limbs])
    centres = np.array([each.centre for each in limbs])
    # Every centre lies at the radius from the axis, in the direction of its limb.
    rows = np.vstack([np.hstack([np.eye(2), each[:, None]]) for each in radial])
    x, y, radius = np.linalg.lstsq(rows, centres[:, :2].ravel(), rcond=None)[0]
    found = Delta(turns, limbs, np.array([x, y]), float(radius), float(centres[:, 2].mean()))
    part = "motor axis" if turns else "carriage"
    for limb, centre, direction in zip(limbs, centres, radial, strict=True):
        off = math.hypot(*(centre[:2] - found.axis - radius * direction))
        if off > TOLERANCE * size:
            raise OtherKindError(
                f"the {part} of {limb.actuator} is {units.text(off, Dimension.LENGTH)} from its place on a circle"
            )
        if abs(centre[2] - centres[0, 2]) > TOLERANCE * size:
            rise = units.text(float(centre[2] - centres[0, 2]), Dimension.LENGTH)
            raise OtherKindError(f"the {part} of {limb.actuator} is {rise} above that of {limbs[0].actuator}")
    return found


def equal_rods(found: Delta, robot: Kinematics) -> None:
    """Refuse a Delta with different arms or rods, or with limbs that are not 120 degrees apart.

    Raises:
        OtherKindError: a limb differs from the first one.
    """
    units, size, first = robot.case.units, robot.size / robot.transform.scale, found.limbs[0]
    for limb in found.limbs:
        for part, one, other in (("arm", limb.arm, first.arm), ("rods", limb.rod, first.rod)):
            if abs(one - other) > TOLERANCE * size:
                shown = [units.text(each, Dimension.LENGTH) for each in (one, other)]
                verb = "have" if part == "rods" else "has"
                raise OtherKindError(
                    f"the {part} of {limb.actuator} {verb} a length of {shown[0]}, but the first limb has {shown[1]}"
                )
    for k, index in enumerate(found.anticlockwise):
        limb = found.limbs[index]
        angle = (limb.outward - first.outward) % (2 * math.pi)
        if abs(math.remainder(angle - k * 2 * math.pi / 3, 2 * math.pi)) > TOLERANCE:
            shown = [units.text(each, Dimension.ANGLE) for each in (angle, k * 2 * math.pi / 3)]
            raise OtherKindError(
                f"the limb of {limb.actuator} is at an angle of {shown[0]} from the first limb, instead of {shown[1]}"
            )


def _drives(robot: Kinematics) -> list[DriveAxis]:
    """Return the actuators at home: axis of an arm, or line of a carriage or strut.

    Raises:
        OtherKindError: an actuator is not a joint of the robot.
    """
    axes = drive_axes(robot)
    missing = [each.name for each in robot.drives if each.name not in axes]
    if missing:
        raise OtherKindError(f"the actuator {missing[0]} is not a joint with an axis")
    return [axes[each.name] for each in robot.drives]


def _arm(robot: Kinematics, samples: Samples, k: int, axis: FloatArray, size: float) -> Limb:
    """Return the arm of an actuator that turns about an axis."""
    units, name = robot.case.units, robot.drives[k].name
    if abs(axis[2]) > TOLERANCE:
        tilt = units.text(math.asin(min(abs(float(axis[2])), 1.0)), Dimension.ANGLE)
        raise OtherKindError(
            f"the motor axis of {name} is inclined by {tilt}, but the motor axes of a Delta are horizontal"
        )
    outward = np.array([axis[1], -axis[0], 0.0]) / math.hypot(axis[0], axis[1])
    upward = np.array([0.0, 0.0, 1.0])
    # Positions in sizes from home; a coordinate turns the arm from `outward` to `-upward` where the axis is left of it.
    p, q = (samples.positions - robot.start[9:12]) / size, samples.coordinates[:, k]
    sense = float(np.cross(axis, outward) @ upward)
    cosine, sine = np.cos(q)[:, None], sense * np.sin(q)[:, None]
    along, across = cosine * outward + sine * upward, cosine * upward - sine * outward
    dots = [np.sum(p * each, axis=1) for each in (along, across)]
    rows = np.column_stack([2 * p, 2 * dots[0], 2 * dots[1], cosine, sine, np.ones(len(p))])
    values = _least_squares(rows, np.sum(p**2, axis=1), f"the arm of {name}")
    centre, out, up = values[:3], values[3], values[4]
    arm = math.hypot(out, up)
    rods = np.linalg.norm(p - centre - out * along - up * across, axis=1)
    rod = _length(rods, robot, size, name)
    if out < 0:
        outward, out = -outward, -out
        sense = -sense
    # `up` counts along the unchanged vertical.
    return Limb(
        name,
        centre * size + robot.start[9:12],
        math.atan2(outward[1], outward[0]),
        arm * size,
        rod * size,
        math.atan2(-up, out),
        -1 if sense > 0 else 1,
    )


def _carriage(robot: Kinematics, samples: Samples, k: int, axis: FloatArray, size: float) -> Limb:
    """Return the carriage of an actuator that slides along a line."""
    units, name = robot.case.units, robot.drives[k].name
    slope = math.hypot(axis[0], axis[1])
    if slope > TOLERANCE:
        tilt = units.text(math.atan2(slope, abs(float(axis[2]))), Dimension.ANGLE)
        raise OtherKindError(f"the rail of {name} is inclined by {tilt}, but the rails of a Delta are vertical")
    p = (samples.positions - robot.start[9:12] - samples.coordinates[:, k, None] * axis) / size
    rows = np.column_stack([2 * p, np.ones(len(p))])
    values = _least_squares(rows, np.sum(p**2, axis=1), f"the carriage of {name}")
    rod = _length(np.linalg.norm(p - values[:3], axis=1), robot, size, name)
    sign = 1 if axis[2] > 0 else -1
    return Limb(name, values[:3] * size + robot.start[9:12], 0.0, 0.0, rod * size, 0.0, sign)


def _outward(limbs: tuple[Limb, ...]) -> tuple[Limb, ...]:
    """Return the carriages with their directions outwards from the centre of the circle through all carriages."""
    places = np.array([each.centre[:2] for each in limbs])
    sides = places[1:] - places[0]
    if abs(np.linalg.det(sides)) <= TOLERANCE * np.sum(sides**2):
        raise OtherKindError(
            "the carriages of the robot are in one plane, but the carriages of a Delta are on a circle"
        )
    centre = places[0] + np.linalg.solve(2 * sides, np.sum(sides**2, axis=1))
    angles = (math.atan2(*(each - centre)[::-1]) for each in places)
    return tuple(each._replace(outward=angle) for each, angle in zip(limbs, angles, strict=True))


def _least_squares(rows: FloatArray, values: FloatArray, part: str) -> FloatArray:
    if len(rows) < rows.shape[1]:
        raise OtherKindError(
            f"{part} cannot be determined: the robot reaches only {len(rows)} of the sampled poses near home"
        )
    return np.asarray(np.linalg.lstsq(rows, values, rcond=None)[0], dtype=np.float64)


def _length(rods: FloatArray, robot: Kinematics, size: float, name: str) -> float:
    """Return the length of rods from distances (N,) in units of the robot's size."""
    spread = float(np.ptp(rods))
    if spread > TOLERANCE:
        shown = robot.case.units.text(spread * size, Dimension.LENGTH)
        raise OtherKindError(f"limb {name} has no rods of constant length: near home the length changes by {shown}")
    return float(rods.mean())


def legs_of(robot: Kinematics, samples: Samples) -> Legs:
    """Return the joints of six straight legs.

    Raises:
        OtherKindError: the robot does not consist of six straight legs.
    """
    legs, units, size = robot.robot.robot.legs, robot.case.units, robot.size / robot.transform.scale
    slides = [each.dimension is Dimension.LENGTH for each in robot.drives]
    if len(legs) != 6 or len(slides) != 6 or not all(slides):
        raise OtherKindError(
            f"the robot has {len(legs)} straight legs and {len(slides)} actuators; "
            "6 legs and 6 prismatic actuators are needed"
        )
    centres = ca.horzcat(*[ca.vertcat(each.base, each.platform) for each in legs])
    values = np.array(ca.Function("legs", [robot.robot.z], [ca.densify(centres)])(robot.start), dtype=np.float64).T
    base, platform = values[:, :3], values[:, 3:]
    ends = samples.positions[:, None] + np.einsum("nij,kj->nki", samples.rotations, platform)
    zero = np.linalg.norm(ends - base, axis=2) - samples.coordinates
    for k, drive in enumerate(robot.drives):
        spread = float(np.ptp(zero[:, k]))
        if spread > TOLERANCE * size:
            shown = units.text(spread, Dimension.LENGTH)
            raise OtherKindError(
                f"the coordinate of actuator {drive.name} must change like the length of leg {legs[k].name}; "
                f"the changes differ by {shown}"
            )
    return Legs(base, platform, np.asarray(zero.mean(axis=0)))


def struts_of(robot: Kinematics, samples: Samples) -> Struts:
    """Return the joints of five struts at a spindle.

    Raises:
        OtherKindError: the robot does not consist of five such struts.
    """
    size, slides = robot.size / robot.transform.scale, [each.dimension is Dimension.LENGTH for each in robot.drives]
    if len(slides) != 5 or not all(slides):
        raise OtherKindError(f"the robot has {len(slides)} actuators; 5 prismatic actuators are needed")
    found = [_strut(robot, samples, k, each, size) for k, each in enumerate(_drives(robot))]
    base, rings, zero, sign = (np.array(each) for each in zip(*found, strict=True))
    return Struts(base, rings, zero, sign)


def _strut(
    robot: Kinematics, samples: Samples, k: int, drive: DriveAxis, size: float
) -> tuple[FloatArray, FloatArray, float, float]:
    """Return base joint, ring, zero and sign of a strut."""
    units, name = robot.case.units, robot.drives[k].name
    # A point on all axes between base and strut: p x omega = v.
    turning = [each for each in drive.before.T if np.linalg.norm(each[:3])]
    if len(turning) < 2:
        raise OtherKindError(f"the strut of {name} does not begin with a ball joint or a universal joint")
    rows = np.vstack([np.cross(np.eye(3), each[:3]).T for each in turning])
    values = np.concatenate([each[3:] for each in turning])
    base = np.linalg.lstsq(rows, values, rcond=None)[0]
    off = float(np.abs(rows @ base - values).max())
    if off > TOLERANCE * size:
        shown = units.text(off, Dimension.LENGTH)
        raise OtherKindError(f"the first joint axes of the strut of {name} do not meet: their distance is {shown}")
    seen = np.einsum("nji,nj->ni", samples.rotations, base - samples.positions) / size
    q = samples.coordinates[:, k] / size
    around, height = np.hypot(seen[:, 0], seen[:, 1]), seen[:, 2]
    rows = np.column_stack([2 * around, 2 * height, 2 * q, np.ones(len(q))])
    radius, level, slope, _ = _least_squares(rows, around**2 + height**2 - q**2, f"the strut of {name}")
    lengths = np.hypot(around - radius, height - level)
    zeros = lengths - math.copysign(1.0, slope) * q
    spread = float(np.ptp(zeros))
    if spread > TOLERANCE:
        shown = units.text(spread * size, Dimension.LENGTH)
        raise OtherKindError(
            f"the end of the strut of {name} does not move on a circle about the platform's z axis: "
            f"lengths differ by {shown}"
        )
    return base, size * np.array([radius, level]), size * float(zeros.mean()), math.copysign(1.0, slope)
