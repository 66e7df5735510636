"""A solved case as a mechanism: every joint at its place, at one pose of the platform.

Joints have ranges from ``leg_length``, from ``actuator_angle`` and ``actuator_length``, and from ranges of joints, all
counted from the exported pose. Other limits (cones, strokes, clearances, rates) are no ranges of one joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.limbjoints import LimbJoint
from ....models.mechanism import Mechanism, MechanismJoint
from ....models.mechanism.topology import reached
from ...case.case import Case
from ...evidence.state import RobotState, evaluate
from ...program.nlp import Nlp
from .given import GivenRobot, given_mechanism, tables_of
from .legs import PosedLeg, axes_of, check_legs, leg_mechanism
from .words import ExportedJoint, RobotMechanism

#: A slide with one side of a range has this many times the robot's size as the other: no loop of the robot is as long.
_FAR = 100.0


@dataclass(frozen=True, eq=False)
class Exported(RobotMechanism):
    """A solved case as a mechanism, with what its files say about it.

    Attributes:
        case: the case.
        pose: number of the pose, from 1.
    """

    case: Case
    pose: int


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
    if tables_of(model):
        coordinates = _coordinates(nlp, x, pose - 1)
        given = GivenRobot(model, state, known, coordinates)
        found = given_mechanism(given)
    else:
        check_legs(model)
        found = leg_mechanism(model.name, legs, state.rotation, state.position)
    labelled = {joint.label: joint for joint in known}
    spans, joints = {leg.name: leg.platform - leg.base for leg in legs}, []
    for joint, words in zip(found.mechanism.joints, found.joints, strict=True):
        own = labelled.get(words.label)
        span = spans.get(words.actuator if own is None else own.limb)
        length = None if span is None or not joint.actuated else _signed_length(found.mechanism, joint, span)
        joints.append(replace(joint, range=_joint_range(nlp.case, joint, words, own, length, found.size)))
    mechanism = replace(found.mechanism, joints=tuple(joints))
    return Exported(mechanism, found.joints, found.size, found.notes, nlp.case, pose)


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


def _legs(nlp: Nlp, x: FloatArray, pose: int, state: RobotState) -> list[PosedLeg]:
    """Return the legs at a pose, with the axes of upper universal joints from the drawing."""
    model, legs = nlp.program.model, nlp.program.robots[pose].legs
    ends = [ca.horzcat(ca.SX(3, 0), *[getattr(leg, each) for leg in legs]) for each in ("base", "span")]
    function = ca.Function("legs", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in ends])
    base, span = (each.full() for each in function(x, nlp.arguments))
    vectors = [each.vector for each in model.scene.directions]
    directions = ca.Function(
        "directions",
        [model.symbols, model.pose.rotation, model.pose.position],
        [ca.horzcat(ca.SX(3, 0), *vectors)],
    )
    parameters = np.concatenate([np.zeros(0), *[state.parameters[each.name] for each in model.parameters]])
    axes = directions(parameters, state.rotation, state.position).full()
    return [
        PosedLeg(leg.name, base[:, k], base[:, k] + span[:, k], tuple(axes[:, i] for i in axes_of(model, leg.name)))
        for k, leg in enumerate(legs)
    ]


def _signed_length(mechanism: Mechanism, slide: MechanismJoint, span: FloatArray) -> float:
    """Return the length of a leg from its base joint by a vector (3,); negative where its slide shortens it."""
    ends = ((each.inner, each.outer) for each in mechanism.joints if each is not slide)
    on_base = reached(mechanism.base, [each for each in ends if mechanism.platform not in each])
    is_longer = bool(slide.axis @ span > 0) == (slide.inner in on_base)
    return float(np.linalg.norm(span)) * (1 if is_longer else -1)


def _joint_range(
    case: Case,
    joint: MechanismJoint,
    words: ExportedJoint,
    given: LimbJoint | None,
    length: float | None,
    size: float,
) -> tuple[float, float] | None:
    """Return the smallest and the largest coordinate of a joint from the exported pose; None without a limit.

    Args:
        case: with its limits.
        joint: the joint.
        words: the same in the words of the case.
        given: the joint of the robot file that it is part of; None for a leg.
        length: of the leg that it drives at that pose, negative where it shortens it; None for another joint.
        size: length of the order of the robot's own.
    """
    if not case.limits or joint.kind in ("S", "weld") or words.follows:
        return None
    # The classes of limits need pydantic, which a case without limits does not load.
    from ...case.limits.interval import QuantityLimit  # noqa: PLC0415
    from ...case.limits.joint_motion import JointMotion  # noqa: PLC0415
    from ...case.limits.legs import LegLength  # noqa: PLC0415

    is_slide = joint.kind == "P"
    measure = "actuator_angle" if words.lever is None and not is_slide else "actuator_length"
    lower, upper, lever, value = -math.inf, math.inf, words.lever or 1.0, words.coordinate or 0.0
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
    if math.isinf(lower) and math.isinf(upper):
        return None
    # Formats have ranges with two sides; a limit of an angle counts within half a turn from home.
    far = _FAR * size if is_slide else math.pi
    middle = 0.0 if is_slide else -value
    return max(lower, middle - far), min(upper, middle + far)
