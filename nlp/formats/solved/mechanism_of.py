"""A solved case as a mechanism: every joint at its place, at one pose of the platform."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.joints.chain import HomeRobot
from ....models.limbjoints import LimbJoint
from ....models.mechanism import Mechanism
from ...case.case import Case
from ...evidence.state import RobotState, evaluate
from ...program.nlp import Nlp
from .assembled import BASE, PLATFORM, assembled
from .chains import Chains, Step, with_unique_names
from .jointchains import is_given_by_joints, joint_chains, robot_at_home
from .legchains import PosedLeg, axes_of, check_legs, leg_chains
from .nested import has_networks, nested_mechanism
from .placing import Values, place
from .ranges import joint_range, joints_by_label


@dataclass(frozen=True)
class ExportedJoint:
    """A joint of an exported mechanism in the words of the case.

    Attributes:
        name: in the mechanism.
        label: of the joint in the robot file, such as ``2:3``; limb and number for a leg.
        part: name of its coordinate, such as ``first``; empty for the only one.
        actuator: name of its actuator in results; empty for none.
        coordinate: its coordinate from home at the pose, radians or length; None for a ball or a leg's joint.
    """

    name: str
    label: str
    part: str
    actuator: str
    coordinate: float | None


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
        InputError: the joints of the robot's limbs are not known, a leg has zero length, or the configuration of nested
            loops is not reached from home.
        MechanismError: nested loops do not close.
        EvaluationError: a number is not finite at the point, or a loop is open.
    """
    state = evaluate(nlp, x, pose - 1)
    model = nlp.program.model
    labelled: Mapping[str, LimbJoint] = {}
    lengths: Mapping[str, float] = {}
    if is_given_by_joints(model):
        robot = robot_at_home(model)
        if has_networks(robot):
            return _nested(nlp, x, pose, robot, state)
        dimensions = np.concatenate([np.zeros(0), *[state.parameters[each.name] for each in model.parameters]])
        chains = joint_chains(model, robot, dimensions, _coordinates(nlp, x, pose - 1))
        labelled = joints_by_label(nlp.program.robots[pose - 1].joints)
    else:
        check_legs(model)
        legs = _legs(nlp, x, pose - 1, state)
        chains = leg_chains(legs, state.rotation, state.position)
        lengths = {leg.name: float(np.linalg.norm(leg.platform - leg.base)) for leg in legs}
    chains = with_unique_names(chains)
    size = _size(chains)
    values, moved = place(chains, state.rotation, state.position, size)
    ranges = {
        step.name: joint_range(nlp.case, step, labelled.get(step.label), _number(values, step), lengths, size)
        for chain in chains.chains
        for step in chain.steps
    }
    placed = assembled(chains, values, moved, size)
    joints = tuple(
        replace(joint, range=ranges[step.name] if joint.actuated or step.side is None else None)
        for joint, step in placed.joints
    )
    words = tuple(
        ExportedJoint(
            joint.name,
            step.label,
            step.part,
            step.actuator if joint.actuated else "",
            None if lengths else _coordinate(values, step),
        )
        for joint, step in placed.joints
    )
    mechanism = Mechanism(model.name, placed.links, joints, BASE, PLATFORM)
    return Exported(nlp.case, pose, mechanism, words, size, chains.notes)


def _nested(nlp: Nlp, x: FloatArray, pose: int, robot: HomeRobot, state: RobotState) -> Exported:
    """Return a robot with nested loops at a point of its program as a mechanism."""
    known = nlp.program.robots[pose - 1].joints
    found = nested_mechanism(
        nlp.program.model,
        robot,
        state.parameters,
        known,
        _coordinates(nlp, x, pose - 1),
        (state.rotation, state.position),
    )
    size = float(np.linalg.norm(np.ptp([joint.point for joint in found.mechanism.joints], axis=0))) or 1.0
    labelled, joints, words = joints_by_label(known), [], []
    for joint, step in zip(found.mechanism.joints, found.steps, strict=True):
        value = step.coordinate or 0.0
        own = joint_range(nlp.case, step, labelled.get(step.label), value, {}, size)
        joints.append(replace(joint, range=own))
        words.append(ExportedJoint(joint.name, step.label, step.part, step.actuator, step.coordinate))
    return Exported(nlp.case, pose, replace(found.mechanism, joints=tuple(joints)), tuple(words), size, ())


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


def _size(chains: Chains) -> float:
    """Return the largest extent of the joints' centres, or 1 where all are at one place."""
    points = np.array([chains.origin, *(step.point for chain in chains.chains for step in chain.steps)])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def _number(values: Values, step: Step) -> float:
    """Return the coordinate of a joint; 0 for a ball."""
    value = values[step.name]
    return 0.0 if isinstance(value, np.ndarray) else value


def _coordinate(values: Values, step: Step) -> float | None:
    """Return the coordinate of a joint; None for a ball."""
    return None if step.kind == "S" else _number(values, step)
