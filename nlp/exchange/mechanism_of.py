"""A solved case as a mechanism: every joint at its place, at one pose of the platform."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...models import FloatArray
from ...models.limbjoints import LimbJoint
from ...models.mechanism import Coupling, Mechanism, MechanismJoint, MechanismLink
from ..case.case import Case
from ..errors import EvaluationError
from ..evidence.state import RobotState, evaluate
from ..program.nlp import Nlp
from .chains import STILL, Chain, Chains, Moved, Step
from .jointchains import is_given_by_joints, joint_chains
from .legchains import PosedLeg, axes_of, check_legs, leg_chains
from .linkframes import link_rotation
from .placing import Values, displacements, place
from .ranges import joint_range, joints_by_label

#: Names of the two links that every robot has.
BASE, PLATFORM = "base", "platform"


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
        InputError: the joints of the robot's limbs are not known, or a leg has zero length.
        EvaluationError: a number is not finite at the point, or a loop is open.
    """
    state = evaluate(nlp, x, pose - 1)
    model = nlp.program.model
    labelled: Mapping[str, LimbJoint] = {}
    lengths: Mapping[str, float] = {}
    if is_given_by_joints(model):
        dimensions = np.concatenate([np.zeros(0), *[state.parameters[each.name] for each in model.parameters]])
        chains = joint_chains(model, dimensions, _coordinates(nlp, x, pose - 1))
        labelled = joints_by_label(nlp.program.robots[pose - 1].joints)
    else:
        check_legs(model)
        legs = _legs(nlp, x, pose - 1, state)
        chains = leg_chains(legs, state.rotation, state.position)
        lengths = {leg.name: float(np.linalg.norm(leg.platform - leg.base)) for leg in legs}
    size = _size(chains)
    values, moved = place(chains, state.rotation, state.position, size)
    ranges = {
        step.name: joint_range(nlp.case, step, labelled.get(step.label), _number(values, step), lengths, size)
        for chain in chains.chains
        for step in chain.steps
    }
    mechanism = _assembled(model.name, chains, values, moved, ranges, size)
    steps = {step.name: step for chain in chains.chains for step in chain.steps}
    joints = tuple(
        ExportedJoint(name, step.label, step.part, step.actuator, None if lengths else _coordinate(values, step))
        for name, step in steps.items()
    )
    return Exported(nlp.case, pose, mechanism, joints, size, chains.notes)


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


def _assembled(
    name: str,
    chains: Chains,
    values: Values,
    moved: Moved,
    ranges: Mapping[str, tuple[float, float] | None],
    size: float,
) -> Mechanism:
    """Return the mechanism of chains at a configuration."""
    links: dict[str, MechanismLink] = {BASE: MechanismLink(BASE)}
    joints: dict[str, MechanismJoint] = {}
    couplings: list[Coupling] = []
    for chain in chains.chains:
        bodies = displacements(chain, values)
        for k, step in enumerate(chain.steps):
            if step.name in joints:
                continue
            before = bodies[k - 1] if k else STILL
            inner = _link_behind(chain, k - 1) if k else BASE
            outer = _link_behind(chain, k)
            joints[step.name] = _joint(step, inner, outer, before, ranges[step.name])
            if step.follows:
                leader = chain.steps[k - 1].name
                couplings.append(Coupling(f"{leader}_coupling", ((leader, 1.0), (step.name, 1.0))))
    for chain in chains.chains:
        bodies = displacements(chain, values)
        for k, step in enumerate(chain.steps[:-1]):
            link = _link_behind(chain, k)
            if link not in links:
                origin = bodies[k].point(step.point)
                links[link] = MechanismLink(link, origin, _frame(origin, step, link, joints.values(), bodies[k], size))
    position, rotation = moved.point(chains.origin), moved.R @ chains.rotation
    links[PLATFORM] = MechanismLink(PLATFORM, position, rotation)
    found = tuple(joints.values())
    return Mechanism(name, tuple(links.values()), found, BASE, PLATFORM, tuple(couplings))


def _link_behind(chain: Chain, k: int) -> str:
    """Return the name of the link behind a joint of a chain."""
    last = k == len(chain.steps) - 1
    return PLATFORM if last else chain.steps[k].name.replace("joint_", "link_", 1)


def _joint(
    step: Step, inner: str, outer: str, before: Moved, limits: tuple[float, float] | None
) -> MechanismJoint:
    """Return a joint at its place, carried by the body before it."""
    point = before.point(step.point)
    axis = before.R @ step.axis
    return MechanismJoint(step.name, step.kind, inner, outer, point, axis, step.pitch, step.actuated, limits)


def _frame(
    origin: FloatArray, step: Step, link: str, joints: Sequence[MechanismJoint], body: Moved, size: float
) -> FloatArray:
    """Return the axes of a link's frame."""
    others = [joint for joint in joints if joint.inner == link]
    points = [origin, *(joint.point for joint in others)]
    return link_rotation(points, [body.R @ step.axis, *(joint.axis for joint in others)], size)
