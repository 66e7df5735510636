"""Solved cases as mechanisms: every joint at one pose of the platform, with its range.

Ranges of joints come from ``leg_length``, ``actuator_angle``, ``actuator_length`` and limits on joints, measured from
the exported pose. Other limits, such as cones, strokes, clearances and rates, do not give the range of a single joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.catalog import definition_of
from ....models.limbjoints import LimbJoint
from ....models.mechanism import Mechanism, MechanismJoint
from ....models.mechanism.topology import reached
from ...case.case import Case
from ...evidence.state import RobotState, evaluate, legs_at
from ...program.nlp import Nlp
from .given import GivenRobot, given_mechanism
from .legs import PosedLeg, axes_of, check_legs, leg_mechanism
from .words import ExportedJoint, RobotMechanism, Travel

#: Missing limit of a prismatic joint with only one limit, as a multiple of the robot's size: no loop is that long.
_FAR = 100.0


@dataclass(frozen=True, eq=False)
class Exported(RobotMechanism):
    """Solved case as a mechanism, with the data of its files.

    Attributes:
        case: the case.
        pose: number of the pose, from 1.
        travels: travel of each prismatic joint with a known length or coordinate.
    """

    case: Case
    pose: int
    travels: tuple[Travel, ...] = ()


def mechanism_of(nlp: Nlp, x: FloatArray, pose: int = 1) -> Exported:
    """Return a robot at a point of its nonlinear program as a mechanism.

    Args:
        nlp: nonlinear program of one task.
        x: (n,) point of the program.
        pose: number of the pose, from 1.

    Raises:
        InputError: the joints of the robot's limbs are not known, a leg has zero length, or the actuators do not move
            the robot from home to the configuration.
        MechanismError: a loop cannot be closed.
        EvaluationError: a value is not finite at the point.
    """
    state = evaluate(nlp, x, pose - 1)
    model, known = nlp.program.model, nlp.program.robots[pose - 1].joints
    legs = _legs(nlp, x, pose - 1, state)
    if definition_of(model):
        coordinates = _coordinates(nlp, x, pose - 1)
        given = GivenRobot(model, state, known, coordinates)
        found = given_mechanism(given)
    else:
        check_legs(model)
        found = leg_mechanism(model.name, legs, state.rotation, state.position)
    labelled = {joint.label: joint for joint in known}
    spans, joints, travels = {leg.name: leg.platform - leg.base for leg in legs}, [], []
    at_poses = [_values_at(nlp, x, k) for k in range(nlp.case.pose_count)]
    for joint, words in zip(found.mechanism.joints, found.joints, strict=True):
        given_joint = labelled.get(words.label)
        leg = words.actuator if given_joint is None else given_joint.limb
        length = _signed_length(found.mechanism, joint, spans[leg]) if leg in spans and joint.actuated else None
        limits = _limits_of_joint(nlp.case, joint, words, given_joint, length)
        joints.append(replace(joint, range=_range_of(joint, words, limits, found.size)))
        key = (words.label, words.part) if length is None else (leg, "length")
        if joint.kind == "P" and all(key in each for each in at_poses):
            travels.append(_travel(nlp.case, joint.name, length, [each[key] for each in at_poses], pose, limits))
    mechanism = replace(found.mechanism, joints=tuple(joints))
    return Exported(mechanism, found.joints, found.size, found.notes, nlp.case, pose, tuple(travels))


def _coordinates(nlp: Nlp, x: FloatArray, pose: int) -> dict[tuple[str, str], float]:
    """Return the joint coordinates from home that the program can compute, by label and part of the joint."""
    robot = nlp.program.robots[pose]
    known = [(joint.label, each) for joint in robot.joints for each in joint.coordinates]
    function = ca.Function(
        "coordinates", [nlp.program.x, nlp.program.p], [ca.vertcat(0, *[each.measured for _, each in known])]
    )
    numbers = function(x, nlp.arguments).full().ravel()[1:]
    pairs = zip(known, numbers.tolist(), strict=True)
    return {(label, each.part): value for (label, each), value in pairs if np.isfinite(value)}


def _values_at(nlp: Nlp, x: FloatArray, pose: int) -> dict[tuple[str, str], float]:
    """Return joint coordinates from home by label and part, and leg lengths by limb name and ``length``."""
    spans = zip(nlp.program.model.legs, legs_at(nlp, x, pose)[1], strict=True)
    lengths = {(leg.name, "length"): float(np.linalg.norm(span)) for leg, span in spans}
    return {**_coordinates(nlp, x, pose), **lengths}


def _travel(
    case: Case, joint: str, length: float | None, values: Sequence[float], pose: int, limits: tuple[float, float]
) -> Travel:
    """Return the travel of a prismatic joint.

    Args:
        case: the case, for its limits.
        joint: name of the joint.
        length: length of the leg that the joint drives, at the exported pose; negative if a positive coordinate
            shortens the leg; None for a joint that does not drive a leg.
        values: length of the leg, or coordinate from home, at every pose.
        pose: number of the exported pose, from 1.
        limits: smallest and largest coordinate from the exported pose; infinite for no limit.
    """
    at, (lower, upper) = values[pose - 1], limits
    ends = (at - upper, at - lower) if length is not None and length < 0 else (at + lower, at + upper)
    stroke = _largest_stroke(case, ends, min(values), is_leg=length is not None)
    least, most, largest = (None if math.isinf(each) else each for each in (*ends, stroke))
    return Travel(joint, length is not None, at, (min(values), max(values)), (least, most), largest)


def _largest_stroke(case: Case, ends: tuple[float, float], shortest: float, *, is_leg: bool) -> float:
    """Return the largest stroke within the limits of a case that includes the smallest used length.

    Args:
        case: the case, for its limits.
        ends: smallest and largest allowed value of the prismatic joint; infinite for no limit.
        shortest: smallest used value.
        is_leg: True if the values are leg lengths, to which limits on telescoping legs apply.
    """
    (least, most), stroke, dead = ends, math.inf, -math.inf
    if is_leg and case.limits:
        from ...case.limits.legs import Actuator  # noqa: PLC0415 - see :func:`_limits_of_joint`

        for limit in case.limits:
            if isinstance(limit, Actuator):
                stroke = min(stroke, math.inf if limit.stroke_max is None else limit.stroke_max)
                dead = max(dead, -math.inf if limit.dead_length is None else limit.dead_length)
    if math.isinf(dead):
        return min(stroke, most - least)
    # The stroke is bounded by the largest length, and by retracted length minus dead length.
    retracted = shortest if math.isinf(most) else max(least, min(shortest, (most + dead) / 2))
    return min(stroke, most - retracted, retracted - dead)


def _legs(nlp: Nlp, x: FloatArray, pose: int, state: RobotState) -> list[PosedLeg]:
    """Return the legs at a pose, with the axes of upper universal joints from the drawing."""
    model = nlp.program.model
    base, span = legs_at(nlp, x, pose)
    vectors = [each.vector for each in model.scene.directions]
    directions = ca.Function(
        "directions",
        [model.symbols, model.pose.rotation, model.pose.position],
        [ca.horzcat(ca.SX(3, 0), *vectors)],
    )
    parameters = np.concatenate([np.zeros(0), *[state.parameters[each.name] for each in model.parameters]])
    axes = directions(parameters, state.rotation, state.position).full()
    return [
        PosedLeg(leg.name, base[k], base[k] + span[k], tuple(axes[:, i] for i in axes_of(model, leg.name)))
        for k, leg in enumerate(model.legs)
    ]


def _signed_length(mechanism: Mechanism, slide: MechanismJoint, span: FloatArray) -> float:
    """Return the length of a leg with a span (3,); negative if a positive coordinate of its slide shortens it."""
    ends = ((each.inner, each.outer) for each in mechanism.joints if each is not slide)
    on_base = reached(mechanism.base, [each for each in ends if mechanism.platform not in each])
    is_longer = bool(slide.axis @ span > 0) == (slide.inner in on_base)
    return float(np.linalg.norm(span)) * (1 if is_longer else -1)


def _limits_of_joint(
    case: Case, joint: MechanismJoint, words: ExportedJoint, given: LimbJoint | None, length: float | None
) -> tuple[float, float]:
    """Return the smallest and the largest coordinate of a joint from the exported pose; infinite for no limit.

    Args:
        case: the case, for its limits.
        joint: elementary joint of the mechanism.
        words: names and coordinate of the elementary joint.
        given: joint of the robot file that contains the elementary joint; None for a leg.
        length: length of the leg that the joint drives, at this pose; negative if a positive coordinate shortens the
            leg; None for a joint that does not drive a leg.
    """
    lower, upper, lever, value = -math.inf, math.inf, words.lever or 1.0, words.coordinate or 0.0
    if not case.limits or joint.kind in ("S", "weld") or words.follows:
        return lower, upper
    # Classes of limits need pydantic, which is not imported for a case without limits.
    from ...case.limits.interval import QuantityLimit  # noqa: PLC0415
    from ...case.limits.joint_motion import JointMotion  # noqa: PLC0415
    from ...case.limits.legs import LegLength  # noqa: PLC0415

    is_slide = joint.kind == "P"
    measure = "actuator_angle" if words.lever is None and not is_slide else "actuator_length"
    for limit in case.limits:
        at = None
        if isinstance(limit, LegLength) and is_slide:
            at = length
        elif isinstance(limit, QuantityLimit) and joint.actuated and given is not None:
            at = value if limit.measure == measure else None
        elif isinstance(limit, JointMotion) and given is not None and given.is_called(limit.joint):
            at = value if limit.part == words.part else None
        if at is not None and isinstance(limit, LegLength | QuantityLimit | JointMotion):
            ends = -math.inf if limit.min is None else limit.min, math.inf if limit.max is None else limit.max
            if isinstance(limit, LegLength) and at < 0:
                ends = -ends[1], -ends[0]
            lower, upper = max(lower, ends[0] / lever - at), min(upper, ends[1] / lever - at)
    return lower, upper


def _range_of(
    joint: MechanismJoint, words: ExportedJoint, limits: tuple[float, float], size: float
) -> tuple[float, float] | None:
    """Return the range of a joint with two finite ends, as file formats need it; None without a limit.

    Args:
        joint: elementary joint of the mechanism.
        words: names and coordinate of the elementary joint.
        limits: smallest and largest coordinate from the exported pose; infinite for no limit.
        size: length comparable to the robot's size.
    """
    if math.isinf(limits[0]) and math.isinf(limits[1]):
        return None
    # Limits on angles hold up to half a turn from home.
    is_slide = joint.kind == "P"
    far = _FAR * size if is_slide else math.pi
    middle = 0.0 if is_slide else -(words.coordinate or 0.0)
    return max(limits[0], middle - far), min(limits[1], middle + far)
