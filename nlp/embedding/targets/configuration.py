"""Configuration of kinematics that a controller has: dimensions, zeros and world frame in its conventions.

The controller's formula is computed here with the numbers as they are printed, and compared with inverse kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np

from ....models import Dimension, FloatArray
from ...case.case import Case
from ...case.controller import Controller
from ...errors import CaseError
from ..kinematics import Kinematics
from .kinds import TOLERANCE, Delta, Legs, OtherKindError, Struts, delta_of, equal_rods, legs_of, struts_of
from .samples import Range, Samples, ranges_of, samples_of

#: Part of the robot's size, or radians, below which an origin or an angle is rounding.
_ROUNDING = 1e-11
#: Largest difference between the controller's formula and inverse kinematics, in the tolerances of dimensions.
_DIFFERENCE = 20


class Rules(NamedTuple):
    """Conventions of a controller for one kind of robot.

    Attributes:
        target: name of the target, for messages.
        kind: name of the controller's kinematics, for messages.
        turns: If true, a Delta with arms; if false, one with carriages.
        angle: unit of the coordinates of arms.
        down: If true, the angle of an arm is positive downwards.
        first: direction of the first limb in the controller's frame, degrees; None if the axes are those of the case.
        has_height: If true, the controller knows the height of the motor axes; otherwise the motor axes are at height
            0.
        equal: If true, all limbs have the same arms and rods, and are 120 degrees apart.
        hint: advice for other robots, as the last clause of a message.
    """

    target: str
    kind: str
    turns: bool
    angle: Literal["deg", "rad"]
    down: bool
    first: float | None
    has_height: bool
    equal: bool
    hint: str


class Configuration(NamedTuple):
    """Dimensions of a robot of a known kind, in the conventions and the unit of length of a controller.

    Attributes:
        case: case with these conventions.
        robot: kinematics of the robot.
        order: index of the robot's actuator for each joint of the controller.
        radius, height: dimensions of a Delta; 0 for other robots.
        angles: (a,) direction of each limb in the controller's frame, degrees; empty for other robots.
        arms, rods: (a,) lengths of a Delta; empty for others.
        base: (a, 3) base joints of legs and struts; empty for a Delta.
        platform: (a, 3) platform joints of legs, or (a, 2) radius and height of the rings of struts.
        ranges: limits of each joint.
        home: (a,) coordinates at home.
        difference: largest difference between formula and inverse kinematics, as a fraction of the robot's size or in
            radians.
    """

    case: Case
    robot: Kinematics
    order: tuple[int, ...]
    ranges: tuple[Range, ...]
    home: tuple[float, ...]
    difference: float
    radius: float = 0.0
    height: float = 0.0
    angles: tuple[float, ...] = ()
    arms: tuple[float, ...] = ()
    rods: tuple[float, ...] = ()
    base: FloatArray = np.zeros((0, 3))
    platform: FloatArray = np.zeros((0, 3))


def printed(value: float) -> str:
    """Return a number for a file: 12 digits, which hide rounding errors of the fit."""
    return f"{value + 0.0:.12g}"


def printed_home(value: float, size: float) -> str:
    """Return a coordinate at home for a file: with fewer digits, because Newton's method limits its accuracy."""
    return f"{_plain(round(value / size, 10), 1.0) * size + 0.0:.9g}"


def rounded(value: float) -> float:
    """Round a number to the digits with which it is printed."""
    return float(printed(value))


def delta_configuration(case: Case, rules: Rules) -> Configuration:
    """Return the dimensions of a Delta for a controller.

    Raises:
        CaseError: the robot is of another kind, or the formula of the controller gives other coordinates.
    """

    def fitted(plain: Kinematics, samples: Samples) -> Configuration:
        delta = delta_of(plain, samples)
        if delta.turns != rules.turns:
            raise OtherKindError(f"the robot has {'arms that turn' if delta.turns else 'carriages that slide'}")
        if rules.equal:
            equal_rods(delta, plain)
        return _delta(case, rules, plain, delta, samples)

    return _recognised(case, rules.target, rules.kind, rules.hint, fitted)


def leg_configuration(case: Case, target: str, kind: str, hint: str) -> Configuration:
    """Return the joints of six straight legs, in the world frame that the case states for its controller.

    Raises:
        CaseError: the robot does not consist of such legs.
    """
    return _recognised(case, target, kind, hint, lambda plain, at: _legs(case, plain, legs_of(plain, at), at))


def strut_configuration(case: Case, target: str, kind: str, hint: str) -> Configuration:
    """Return the joints of five struts at a spindle, in the world frame that the case states for its controller.

    Raises:
        CaseError: the robot does not consist of such struts.
    """
    return _recognised(case, target, kind, hint, lambda plain, at: _struts(case, plain, struts_of(plain, at), at))


def _recognised(
    case: Case, target: str, kind: str, hint: str, fitted: Callable[[Kinematics, Samples], Configuration]
) -> Configuration:
    """Return the configuration that a function fits to a robot and its poses near home.

    Raises:
        CaseError: the robot is of another kind.
    """
    plain = Kinematics(case)
    try:
        return fitted(plain, samples_of(plain))
    except OtherKindError as error:
        raise refused(case, target, kind, str(error), hint) from None


def refused(case: Case, target: str, kind: str, fault: str, hint: str) -> CaseError:
    """Return the error of a robot that a controller's kinematics does not describe."""
    return CaseError("--target", f"the robot does not fit {kind}: {fault}; {hint}", target, case.source)


def _delta(case: Case, rules: Rules, plain: Kinematics, delta: Delta, samples: Samples) -> Configuration:
    order = delta.anticlockwise if rules.first is not None else (0, 1, 2)
    limbs = [delta.limbs[k] for k in order]
    first = None if rules.first is None else math.radians(rules.first)
    yaw = 0.0 if first is None else math.remainder(limbs[0].outward - first, 2 * math.pi)
    size = plain.size / plain.transform.scale
    base = case.controller.origin[2] if rules.has_height or not rules.turns else delta.height
    origin = [rounded(_plain(float(each), size)) for each in (*delta.axis, base)]
    sense = {each.actuator: float(each.sign if rules.down or not rules.turns else -each.sign) for each in limbs}
    zeros = {each.actuator: _angle(each.zero if rules.down else -each.zero) for each in limbs}
    if not rules.turns:
        zeros = dict.fromkeys(zeros, rounded(_plain(delta.height - base, size)))
    controller = Controller(
        length=length_unit(case),
        angle=rules.angle,
        zero=_shared(zeros, 0.0),
        sign=_shared(sense, 1.0),
        origin=(origin[0], origin[1], origin[2]),
        rpy=(0.0, 0.0, _angle(yaw)),
    )
    own = replace(case, controller=controller)
    robot = Kinematics(own)
    scale = robot.transform.scale
    angles = [rounded(math.degrees(_angle(each.outward - yaw))) % 360 for each in limbs]
    ranges, home = ranges_of(robot, samples), robot.home_coordinates
    found = Configuration(
        own,
        robot,
        order,
        tuple(ranges[k] for k in order),
        tuple(float(home[k]) for k in order),
        0.0,
        rounded(scale * delta.radius),
        rounded(_plain(scale * (delta.height - base), robot.size)),
        tuple(angles),
        tuple(rounded(scale * each.arm) for each in limbs),
        tuple(rounded(scale * each.rod) for each in limbs),
    )
    if found.radius <= 0:
        raise OtherKindError(f"its radius is {_shown(found, found.radius)}; the radius of a Delta must be positive")
    return _checked(found, samples, delta_coordinates(found, rules, _positions(found, samples)))


def _positions(found: Configuration, samples: Samples) -> FloatArray:
    return found.robot.transform.poses(samples.positions, samples.rotations)[:, 9:]


def delta_coordinates(found: Configuration, rules: Rules, positions: FloatArray) -> FloatArray:
    """Return the joint coordinates (N, 3) of a Delta by the controller's formula; NaN out of reach.

    Args:
        found: the dimensions.
        rules: conventions of the controller.
        positions: (N, 3) origin of the platform frame in the controller's frame.
    """
    columns = []
    for k, angle in enumerate(np.radians(found.angles)):
        outward = positions[:, :2] @ [math.cos(angle), math.sin(angle)] - found.radius
        across = positions[:, :2] @ [-math.sin(angle), math.cos(angle)]
        rod, arm = found.rods[k], found.arms[k]
        with np.errstate(invalid="ignore"):
            if not rules.turns:
                columns.append(positions[:, 2] + np.sqrt(rod**2 - outward**2 - across**2))
                continue
            drop = found.height - positions[:, 2] if rules.has_height else -positions[:, 2]
            square = outward**2 + drop**2
            cosine = (square + arm**2 - rod**2 + across**2) / (2 * arm * np.sqrt(square))
            down = np.arctan2(drop, outward) - np.arccos(cosine)
        columns.append((down if rules.down else -down) / found.robot.transform.degrees)
    return np.column_stack(columns)


def _legs(case: Case, plain: Kinematics, legs: Legs, samples: Samples) -> Configuration:
    found = _lengths(case, plain, legs.base, legs.zero, np.ones(len(legs.zero)), samples)
    # The platform frame is turned with the world frame: a rotation of the controller is T' R T.
    transform = found.robot.transform
    platform = _round(transform.scale * legs.platform @ transform.turn, found.robot.size)
    poses = transform.poses(samples.positions, samples.rotations)
    ends = poses[:, None, 9:] + np.einsum("nij,kj->nki", poses[:, :9].reshape(-1, 3, 3), platform)
    return _checked(found._replace(platform=platform), samples, np.linalg.norm(ends - found.base, axis=2))


def _struts(case: Case, plain: Kinematics, struts: Struts, samples: Samples) -> Configuration:
    found = _lengths(case, plain, struts.base, struts.zero, struts.sign, samples)
    transform = found.robot.transform
    rings = _round(transform.scale * struts.rings, found.robot.size)
    poses = transform.poses(samples.positions, samples.rotations)
    seen = np.einsum("nji,nkj->nki", poses[:, :9].reshape(-1, 3, 3), found.base - poses[:, None, 9:])
    around = np.hypot(seen[:, :, 0], seen[:, :, 1])
    lengths = np.hypot(around - rings[:, 0], seen[:, :, 2] - rings[:, 1])
    return _checked(found._replace(platform=rings), samples, lengths)


def _lengths(
    case: Case, plain: Kinematics, base: FloatArray, zero: FloatArray, sign: FloatArray, samples: Samples
) -> Configuration:
    """Return the configuration of actuators whose coordinates are lengths, without its platform joints."""
    size = plain.size / plain.transform.scale
    names = [each.name for each in plain.drives]
    zeros = {name: rounded(_plain(float(each), size)) for name, each in zip(names, zero, strict=True)}
    senses = dict(zip(names, sign.tolist(), strict=True))
    given = replace(case.controller, length=length_unit(case), angle="deg")
    own = replace(case, controller=replace(given, zero=_shared(zeros, 0.0), sign=_shared(senses, 1.0)))
    robot = Kinematics(own)
    transform = robot.transform
    points = _round(transform.scale * (base - transform.offset) @ transform.turn, robot.size)
    home = tuple(float(each) for each in robot.home_coordinates)
    return Configuration(own, robot, tuple(range(len(names))), ranges_of(robot, samples), home, 0.0, base=points)


def _round(points: FloatArray, size: float) -> FloatArray:
    """Return points as they are printed, without rounding errors."""
    return np.array([[rounded(_plain(float(value), size)) for value in row] for row in points])


def _checked(found: Configuration, samples: Samples, computed: FloatArray) -> Configuration:
    """Return the configuration with its difference from inverse kinematics.

    Raises:
        OtherKindError: the formula gives other coordinates.
    """
    robot = found.robot
    order = list(found.order)
    off = np.abs(computed - robot.transform.coordinates(samples.coordinates)[:, order]) / robot.motor_sizes[order]
    off = np.where(np.isfinite(off), off, np.inf).max(axis=0)
    if off.max() > _DIFFERENCE * TOLERANCE:
        k = int(off.argmax())
        drive = robot.drives[order[k]]
        units, size = robot.case.units, robot.size / robot.transform.scale
        angle = drive.dimension is Dimension.ANGLE
        shown = units.text(float(off[k]) * (1.0 if angle else size), drive.dimension)
        raise OtherKindError(
            f"the coordinate of {drive.name} differs by {shown}: the robot may be in another working mode"
        )
    return found._replace(difference=float(off.max()))


def length_unit(case: Case) -> str:
    """Return the unit of length of a controller: millimetres, or inches if the case states them."""
    return "in" if case.controller.length == "in" else "mm"


def _shared(values: Mapping[str, float], usual: float) -> Mapping[str, float]:
    """Return values by actuator as a controller states them: one value if all are equal, no value if all are usual."""
    every = set(values.values())
    if len(every) > 1:
        return MappingProxyType(dict(values))
    first = next(iter(values.values()))
    return MappingProxyType({} if first == usual else {"": first})


def _angle(value: float) -> float:
    """Return an angle, radians; rounding errors of an angle that is round in degrees are removed."""
    return math.radians(rounded(math.degrees(_plain(value, 1.0))))


def _plain(value: float, size: float) -> float:
    """Return a value without rounding errors; ``size`` is the magnitude of the quantity."""
    return 0.0 if abs(value) <= _ROUNDING * size else float(value)


def _shown(found: Configuration, value: float) -> str:
    return f"{value:.6g} {found.case.controller.length}"
