"""A solved case as a mechanism: every joint at its place, at one pose of the platform."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism
from ...case.case import Case
from ...evidence.state import RobotState, evaluate
from ...program.nlp import Nlp
from .given import GivenRobot, given_mechanism, tables_of
from .legs import PosedLeg, axes_of, check_legs, leg_mechanism
from .ranges import joint_range
from .words import ExportedJoint


@dataclass(frozen=True, eq=False)
class Exported:
    """A solved case as a mechanism, with what its files say about it.

    Attributes:
        case: the case.
        pose: number of the pose, from 1.
        mechanism: at that pose.
        joints: its joints in the words of the case, in the mechanism's order.
        size: largest extent of the joints' centres, length.
        notes: sentences for people about choices that the case leaves open.
    """

    case: Case
    pose: int
    mechanism: Mechanism
    joints: tuple[ExportedJoint, ...]
    size: float
    notes: tuple[str, ...]


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
    lengths: dict[str, float] = {}
    if tables_of(model):
        coordinates = _coordinates(nlp, x, pose - 1)
        given = GivenRobot(model, state.parameters, known, coordinates, state.rotation, state.position)
        found = given_mechanism(given)
    else:
        check_legs(model)
        legs = _legs(nlp, x, pose - 1, state)
        lengths = {leg.name: float(np.linalg.norm(leg.platform - leg.base)) for leg in legs}
        found = leg_mechanism(model.name, legs, state.rotation, state.position)
    labelled = {joint.label: joint for joint in known}
    joints = tuple(
        replace(joint, range=joint_range(nlp.case, joint, words, labelled.get(words.label), lengths, found.size))
        for joint, words in zip(found.mechanism.joints, found.joints, strict=True)
    )
    mechanism = replace(found.mechanism, joints=joints)
    return Exported(nlp.case, pose, mechanism, found.joints, found.size, found.notes)


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
    numbers = ca.Function("legs", [nlp.program.x, nlp.program.p], [ca.horzcat(*[each.base for each in legs])])
    spans = ca.Function("spans", [nlp.program.x, nlp.program.p], [ca.horzcat(*[each.span for each in legs])])
    base, span = (each(x, nlp.arguments).full() for each in (numbers, spans))
    own = [each.symbol for each in model.parameters]
    vectors = [each.vector for each in model.scene.directions]
    directions = ca.Function(
        "directions",
        [ca.vertcat(*own), model.pose.rotation, model.pose.position],
        [ca.horzcat(ca.SX(3, 0), *vectors)],
    )
    parameters = np.concatenate([state.parameters[each.name] for each in model.parameters])
    axes = directions(parameters, state.rotation, state.position).full()
    return [
        PosedLeg(leg.name, base[:, k], base[:, k] + span[:, k], tuple(axes[:, i] for i in axes_of(model, leg.name)))
        for k, leg in enumerate(legs)
    ]
