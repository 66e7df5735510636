"""A solved case as a mechanism: every joint at its place, at one pose of the platform.

Joints have ranges from ``leg_length``, from ``actuator_angle`` and ``actuator_length``, and from ranges of joints, all
counted from the exported pose. Other limits (cones, strokes, clearances, rates) are no ranges of one joint.
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

#: A slide with one side of a range has this many times the robot's size as the other: no loop of the robot is as long.
_FAR = 100.0


@dataclass(frozen=True, eq=False)
class Exported(RobotMechanism):
    """A solved case as a mechanism, with what its files say about it.

    Attributes:
        case: the case.
        pose: number of the pose, from 1.
        travels: of the slides whose lengths or coordinates are known.
    """

    case: Case
    pose: int
    travels: tuple[Travel, ...] = ()


def mechanism_of(nlp: Nlp, x: FloatArray, pose: int = 1) -> Exported:
    """Return a robot at a point of its program as a mechanism.

    Args:
        nlp: the program, of one task.
        x: (n,) the point.
        pose: number of the pose, from 1.

    Raises:
        InputError: the joints of the robot's limbs are not known, a leg has zero length, or the configuration is not
            reached from home.
        MechanismError: a loop does not close.
        EvaluationError: a number is not finite at the point.
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
        own = labelled.get(words.label)
        leg = words.actuator if own is None else own.limb
        length = _signed_length(found.mechanism, joint, spans[leg]) if leg in spans and joint.actuated else None
        limits = _limits_of_joint(nlp.case, joint, words, own, length)
        joints.append(replace(joint, range=_range_of(joint, words, limits, found.size)))
        key = (words.label, words.part) if length is None else (leg, "length")
        if joint.kind == "P" and all(key in each for each in at_poses):
            travels.append(_travel(nlp.case, joint.name, length, [each[key] for each in at_poses], pose, limits))
    mechanism = replace(found.mechanism, joints=tuple(joints))
    return Exported(mechanism, found.joints, found.size, found.notes, nlp.case, pose, tuple(travels))


def _coordinates(nlp: Nlp, x: FloatArray, pose: int) -> dict[tuple[str, str], float]:
    """Return the coordinates from home that the program knows, by label and part of the joint."""
    robot = nlp.program.robots[pose]
    known = [(joint.label, each) for joint in robot.joints for each in joint.coordinates]
    function = ca.Function(
        "coordinates", [nlp.program.x, nlp.program.p], [ca.vertcat(0, *[each.measured for _, each in known])]
    )
    numbers = function(x, nlp.arguments).full().ravel()[1:]
    pairs = zip(known, numbers.tolist(), strict=True)
    return {(label, each.part): value for (label, each), value in pairs if np.isfinite(value)}


def _values_at(nlp: Nlp, x: FloatArray, pose: int) -> dict[tuple[str, str], float]:
    """Return coordinates from home by label and part of the joint, and lengths of legs by limb and the word length."""
    spans = zip(nlp.program.model.legs, legs_at(nlp, x, pose)[1], strict=True)
    lengths = {(leg.name, "length"): float(np.linalg.norm(span)) for leg, span in spans}
    return {**_coordinates(nlp, x, pose), **lengths}


def _travel(
    case: Case, joint: str, length: float | None, values: Sequence[float], pose: int, limits: tuple[float, float]
) -> Travel:
    """Return the travel of a slide.

    Args:
        case: with its limits.
        joint: name of the slide.
        length: of the leg that it drives at the exported pose, negative where it shortens it; None for another slide.
        values: its length or its coordinate from home at every pose.
        pose: number of the exported pose, from 1.
        limits: smallest and largest coordinate from the exported pose, infinite without a limit.
    """
    at, (lower, upper) = values[pose - 1], limits
    ends = (at - upper, at - lower) if length is not None and length < 0 else (at + lower, at + upper)
    stroke = _largest_stroke(case, ends, min(values), is_leg=length is not None)
    least, most, largest = (None if math.isinf(each) else each for each in (*ends, stroke))
    return Travel(joint, length is not None, at, (min(values), max(values)), (least, most), largest)


def _largest_stroke(case: Case, ends: tuple[float, float], shortest: float, *, is_leg: bool) -> float:
    """Return the largest stroke within the limits of a case from a length of at most the shortest one used.

    Args:
        case: with its limits.
        ends: smallest and largest value of the slide within them, infinite without a limit.
        shortest: smallest value used.
        is_leg: whether the values are lengths of a leg, of which limits on telescoping legs speak.
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
    # The stroke is at most the way up to the largest length, and the retracted length beside the dead one.
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
    """Return the length of a leg from its base joint by a vector (3,); negative where its slide shortens it."""
    ends = ((each.inner, each.outer) for each in mechanism.joints if each is not slide)
    on_base = reached(mechanism.base, [each for each in ends if mechanism.platform not in each])
    is_longer = bool(slide.axis @ span > 0) == (slide.inner in on_base)
    return float(np.linalg.norm(span)) * (1 if is_longer else -1)


def _limits_of_joint(
    case: Case, joint: MechanismJoint, words: ExportedJoint, given: LimbJoint | None, length: float | None
) -> tuple[float, float]:
    """Return the smallest and the largest coordinate of a joint from the exported pose, infinite without a limit.

    Args:
        case: with its limits.
        joint: the joint.
        words: the same in the words of the case.
        given: the joint of the robot file that it is part of; None for a leg.
        length: of the leg that it drives at that pose, negative where it shortens it; None for another joint.
    """
    lower, upper, lever, value = -math.inf, math.inf, words.lever or 1.0, words.coordinate or 0.0
    if not case.limits or joint.kind in ("S", "weld") or words.follows:
        return lower, upper
    # The classes of limits need pydantic, which a case without limits does not load.
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
    """Return limits as formats have them, with two sides; None without a limit.

    Args:
        joint: the joint.
        words: the same in the words of the case.
        limits: smallest and largest coordinate from the exported pose, infinite without a limit.
        size: length of the order of the robot's own.
    """
    if math.isinf(limits[0]) and math.isinf(limits[1]):
        return None
    # A limit of an angle counts within half a turn from home.
    is_slide = joint.kind == "P"
    far = _FAR * size if is_slide else math.pi
    middle = 0.0 if is_slide else -(words.coordinate or 0.0)
    return max(limits[0], middle - far), min(limits[1], middle + far)
