"""Properties of a robot's model: ranks measured at closed configurations, parameters, quantities and structure.

The structure of a chain is for people: joints of the chain, the joint at which its loop is opened, and dimensions of
its wrench spaces.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...actuation import LimbDrive, Velocities, limb_drive
from ...arrays import FloatArray
from ...basis import basis_of_member, constraint_rows, is_apart, rank_of_rows
from ...instance import Substitution, driven, jacobian
from ...member import Member, resisted_parts, scaled_twists
from ...model import Model
from ...parts import (
    Actuator,
    Closure,
    Dimension,
    GenericRanks,
    JointScrews,
    Parameter,
    PathStructure,
    PlatformMotions,
    Quantity,
    rate_relations,
)
from ...rows import column_groups
from ..home.chain import HomeRobot, Joint, Limb
from ..posed.loops import ClosedPoint
from ..posed.opened import OpenedPath
from ..posed.resistance import Ranks

#: Number of wrenches from which a member resists nearly all motions equally.
_MANY_WRENCHES = 5
#: Rank of J of a robot whose platform has one motion with all actuators locked.
_ONE_MOTION_LEFT = 5
#: Magnitude below which components of orthonormal motions are zero.
_ROUNDING = 1e-9


def generic_ranks(model: Model, robot: HomeRobot, points: Sequence[ClosedPoint]) -> GenericRanks:
    """Return the generic ranks of a robot's rows and constraints, and its mobility, over closed configurations.

    Args:
        model: the robot.
        robot: robot at home.
        points: closed configurations.
    """
    own = Substitution.identity(model)
    size = ca.Function("size", [robot.symbols], [robot.size])
    length = SX.sym("length")
    rows = jacobian(model.wrenches, length, model.members)
    works = driven(model.wrenches, model.actuators, length, model.members)
    outputs = [ca.densify(each) for each in (rows, works, rate_relations(model.actuators))]
    function = ca.Function("rows", [*own.all, length], outputs)
    ranks, idle, motions = [], [], []
    is_shared = True
    for point in points:
        reach = float(size(point.dimensions))
        values = function(*point, reach)
        velocities = Velocities(*[each.full() for each in values])
        if all(np.isfinite(each).all() for each in velocities):
            constraints = constraint_rows(model, velocities, point.position)
            ranks.append([rank_of_rows(each, point.position, reach) for each in (velocities.jacobian, constraints)])
            motions.append(_platform_motions(constraints, ranks[-1][1], point, reach))
            limbs = [limb_drive(model, velocities, point.position, limb) for limb in model.limbs]
            known = {limb.actuators[k] for limb in limbs for k in np.flatnonzero(~limb.drive.is_undetermined)}
            count = len(model.actuators) - sum(len(limb.actuators) - limb.drive.idle.shape[1] for limb in limbs)
            names = tuple(each.name for k, each in enumerate(model.actuators) if k not in known)
            idle.append((count, names))
            is_shared = is_shared and ranks[-1][1] > 0 and not _is_determined(model, velocities, limbs, point, reach)
    jacobian_rank, constraints_rank = (int(most) for most in np.max(np.array(ranks).reshape(-1, 2), axis=0, initial=0))
    usual = [each for each, (_, rank) in zip(motions, ranks, strict=True) if rank and rank == constraints_rank]
    count, names = min(idle, default=(0, ()))
    return GenericRanks(jacobian_rank, constraints_rank, count, names, tuple(usual), is_shared and bool(usual))


def _platform_motions(constraints: FloatArray, rank: int, point: ClosedPoint, reach: float) -> PlatformMotions:
    """Return the platform motions in which the constraints (k, 6) do no work."""
    moments = constraints[:, 3:] - np.cross(point.position, constraints[:, :3])
    _, _, right = np.linalg.svd(np.hstack([moments / reach, constraints[:, :3]]))
    twists = right[rank:].T
    # Rounding errors are not motions: a platform without rotations has angular velocities of exactly 0.
    twists = np.where(np.abs(twists) > _ROUNDING, twists, 0.0)
    return PlatformMotions(point.rotation, np.vstack([twists[:3] / reach, twists[3:]]))


def _is_determined(
    model: Model, velocities: Velocities, drives: Sequence[LimbDrive], point: ClosedPoint, reach: float
) -> bool:
    """Return True if, for at least one limb, statics alone determines the constraint wrenches."""
    J, names = velocities.jacobian, np.array([row.limb for row in model.frame_rows])
    for limb, (rows, _, drive) in zip(model.limbs, drives, strict=True):
        constraints = drive.constraints @ J[rows]
        if rank_of_rows(constraints, point.position, reach) and is_apart(J, names == limb, point.position, reach):
            return True
    return False


def actuator_name(robot: HomeRobot, limb: Limb, joint: Joint, number: int) -> str:
    """Return the name of one of several actuators of a limb: the name of its joint, if this is unique.

    Args:
        robot: robot at home.
        limb: the limb.
        joint: actuated joint.
        number: number of the actuator in the limb, from 1 on.
    """
    taken = {each.name for each in robot.limbs if each is not limb}
    taken |= {each.name for each in robot.joints if each.actuated and each is not joint}
    return joint.name if joint.name and joint.name not in taken else f"{limb.name}.{number}"


def with_kinds(
    member: Member, actuators: Sequence[Actuator], size: SX, numbers: Sequence[SX], points: Sequence[ClosedPoint]
) -> Member:
    """Return a member with the kinds of its wrenches and groups of its screws, measured at closed configurations.

    Args:
        member: the member.
        actuators: actuators of all limbs.
        size: (1, 1) size of the robot, length.
        numbers: symbols of dimensions, unknowns, rotation and position.
        points: closed configurations; the first one determines the kinds.
    """
    columns = scaled_twists(member.screws, member.centre, size, member.size)
    if member.rank < columns.shape[1]:
        measured = ca.Function("screws", list(numbers), [ca.densify(columns / size)])
        values = [measured(*each).full() for each in points]
        groups = column_groups([each for each in values if np.isfinite(each).all()], member.rank)
        member = replace(member, groups=groups)
    driving = [screw for each in actuators if (screw := each.screw_in(member.label)) is not None]
    actuated = scaled_twists(ca.horzcat(SX(6, 0), *driving), member.centre, size, member.size)
    vectors = resisted_parts(columns, member.rank, ca.horzcat(SX.eye(member.size), actuated), member.groups)
    found = ca.Function("kinds", list(numbers), [ca.densify(vectors)])(*points[0]).full()
    basis = basis_of_member(found[:, : member.size], found[:, member.size :], member.size - member.rank)
    return replace(member, kinds=basis.kinds)


def parameters(robot: HomeRobot) -> tuple[Parameter, ...]:
    """Return the dimensions of a robot as parameters of its model."""
    return tuple(
        Parameter(name, robot.symbols[k], item.kind, item.description or "dimension", (float(robot.typical[k]),))
        for k, (name, item) in enumerate(robot.words.dimensions.items())
    )


def quantities(actuators: Sequence[Actuator], positions: Sequence[SX]) -> tuple[Quantity, ...]:
    """Return the actuator coordinates as quantities, angles and lengths separately."""
    found = []
    for dimension, name in ((Dimension.ANGLE, "actuator_angle"), (Dimension.LENGTH, "actuator_length")):
        own = [
            (each.name, position)
            for each, position in zip(actuators, positions, strict=True)
            if each.dimension is dimension
        ]
        if own:
            owners, values = zip(*own, strict=True)
            words = f"{dimension.value} of an actuator from home"
            found.append(Quantity(name, owners, ca.vertcat(*values), dimension, words))
    return tuple(found)


def with_all_relations(actuators: Sequence[Actuator]) -> tuple[Actuator, ...]:
    """Return the actuators with a coefficient in each relation of all limbs: 0 for relations of other limbs."""
    counts = {each.limb: each.relations.shape[0] for each in actuators}
    found = []
    for each in actuators:
        parts = [each.relations if limb == each.limb else SX.zeros(count) for limb, count in counts.items()]
        found.append(replace(each, relations=ca.vertcat(*parts)))
    return tuple(found)


def structure_of(limb: str, name: str, path: OpenedPath, ranks: Ranks, unknowns: int) -> PathStructure:
    """Return the structure of a chain with all its loop equations counted as kept.

    Args:
        limb: name of the limb.
        name: name of the chain: that of the limb, with the number of the branch if there are several.
        path: the chain.
        ranks: ranks of the chain's screws.
        unknowns: number of joint coordinates that are unknowns and belong to no earlier chain.
    """
    written = [part for joint in path.joints for part in (joint.parts or (joint,))]
    count = len(path.equations)
    return PathStructure(
        limb=limb,
        name=name,
        joints=" ".join(f"{joint.type}*" if joint.actuated else joint.type for joint in written),
        opened=_opened(path),
        wrenches=6 - ranks.passive,
        constraints=6 - ranks.all,
        unknowns=unknowns,
        equations=count,
        kept=count,
    )


def joint_screws(limb: str, path: OpenedPath, ranks: Ranks, labels: Mapping[int, str]) -> JointScrews | None:
    """Return the current screws of the joints of a chain; None if a joint has unknown screws.

    Args:
        limb: name of the limb.
        path: the chain.
        ranks: ranks of the chain's screws.
        labels: labels of the written joints, by identity.
    """
    if any(len(own) != len(joint.axes) for joint, own in zip(path.joints, path.screws, strict=True)):
        return None
    names = [name for joint in path.joints for name in _column_labels(joint, labels)]
    driven = [joint.actuated for joint in path.joints for _ in joint.axes]
    screws = ca.horzcat(SX(6, 0), *[screw for own in path.screws for screw in own])
    indices = tuple(k for k, is_driven in enumerate(driven) if is_driven)
    return JointScrews(limb, tuple(names), screws, indices, ranks.passive, ranks.all)


def _column_labels(joint: Joint, labels: Mapping[int, str]) -> list[str]:
    """Return the label of the joint of each axis; the axes of a spherical joint are along the world axes."""
    written = joint.parts or (joint,)
    if joint.type == "S" and len(written) > 1:
        return [f"{labels[id(written[0])]} to {labels[id(written[-1])]}"] * len(joint.axes)
    return [labels[id(part)] for part in written for _ in part.axes]


def with_kept(structures: Iterable[PathStructure], kept: Collection[Closure]) -> tuple[PathStructure, ...]:
    """Return the structures of chains with the number of loop equations that the nonlinear program keeps."""
    names = {each.name for each in kept}
    return tuple(
        replace(each, kept=sum(f"loop {each.name} ({k + 1})" in names for k in range(each.equations)))
        for each in structures
    )


def member_remarks(structures: Sequence[PathStructure]) -> list[str]:
    """Return remarks on members with many wrenches, and on a robot with one member, for which F is not informative.

    F is a sum over orthonormal wrenches of members: within one member it weighs all directions alike.
    """
    members = [each for each in structures if each.wrenches > 0]
    if len(members) == 1:
        text = "the robot has one member only, so F is not informative: within a member F weighs all directions alike"
        return [text]
    names = [each.name for each in members if each.wrenches >= _MANY_WRENCHES]
    if not names:
        return []
    who = f"member {names[0]} resists" if len(names) == 1 else f"members {', '.join(names)} resist"
    words = f"{who} with {_MANY_WRENCHES} wrenches or more, so their part of F is not informative"
    return [f"{words}: within a member F weighs all directions alike"]


def rank_remarks(rank: int, structures: Sequence[PathStructure]) -> list[str]:
    """Return a remark if the platform has one motion with all actuators locked, at all poses; empty otherwise."""
    if rank != _ONE_MOTION_LEFT or sum(each.wrenches > 0 for each in structures) == 1:
        return []
    words = f"J has rank {rank} at all poses: with all actuators locked, the platform still moves"
    advice = "add a passive limb that allows all other motions, as in the robot pentapod"
    return [f"{words}; if that motion does not matter, such as a turn of a spindle about itself, {advice}"]


def _opened(path: OpenedPath) -> str:
    """Return in words where a chain is opened, with the numbers of the joints as they are written."""
    first: list[int] = [1]
    for joint in path.joints:
        first.append(first[-1] + (len(joint.parts) or 1))
    cut = path.cut
    if cut.far is not None:
        start, end = sorted((cut.far, cut.joint))
        words = "actuated rod" if cut.slide is not None else "rod"
        return f"{words} between joints {first[start]} and {first[end]}"
    if not cut.type:
        return f"behind joint {first[cut.first] - 1}"
    last = first[cut.joint + 1] - 1
    joints = f"joint {last}" if last == first[cut.joint] else f"joints {first[cut.joint]} to {last}"
    return f"{joints} ({cut.type})"
