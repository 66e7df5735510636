"""Chains at a pose of the platform: coordinates of all joints with which every chain ends at the platform.

Most coordinates follow from the program. The rotation of a spherical joint follows from its two sides, and that of a
rod between two of them is the shortest one that points it from the one to the other. What is still unknown, and
rounding errors, are found by Newton's method with steps of least norm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ....models import FloatArray
from ...errors import EvaluationError
from .chains import STILL, Chain, Chains, Moved, Step, cross_matrix, rotation_by, step_motion

#: Largest difference of a chain's end from the platform, radians and parts of the robot's size: rounding leaves 1e-15
#: for chains of a dozen joints.
_CLOSED = 1e-13
#: Largest difference with which a chain counts as closed, where rounding stops the steps before.
ACCEPTED = 1e-11
#: Largest number of Newton steps, and of parts of the way to the pose for chains whose coordinates are not known.
_STEPS = 30
_PARTS = 8
#: Singular values below this part of the largest are zero: such a joint moves without the platform, as a rod's spin.
_ZERO = 1e-9
#: Longest step, radians and parts of the robot's size: Newton's method improves a configuration and does not search.
_LONGEST = 0.5
#: Weight of the pose beside a coordinate: it moves only where a pose that is closed to the solver's accuracy needs it.
_POSE_WEIGHT = 1e-3

#: Coordinate of a joint: radians or length; of an ``S`` its rotation matrix (3, 3).
Value: TypeAlias = "float | FloatArray"
#: Coordinates by the name of the joint.
Values: TypeAlias = "dict[str, Value]"


def place(chains: Chains, rotation: FloatArray, position: FloatArray, size: float) -> tuple[Values, Moved]:
    """Return the coordinates at a pose by the joint's name, and the displacement of the platform from the stated pose.

    Args:
        chains: the robot's chains.
        rotation: (3, 3) ``R`` of the pose, platform to world coordinates.
        position: (3,) ``p`` of the pose, length.
        size: length of the order of the robot's own.

    Raises:
        EvaluationError: a chain does not end at the platform.
    """
    R = rotation @ chains.rotation.T
    target = Moved(R, position - R @ chains.origin)
    values: Values = {}
    for chain in chains.chains:
        free = [step for step in chain.steps if step.name not in values]
        _begin(chain, values, target)
        unknown = [step for step in free if step.kind != "S" and step.coordinate is None]
        if unknown and _difference(chain, values, target, size) > _CLOSED:
            _approach(chain, values, free, target, size)
        else:
            _newton([chain], values, free, target, size)
    if max(_difference(chain, values, target, size) for chain in chains.chains) > _CLOSED:
        every = list({step.name: step for chain in chains.chains for step in chain.steps}.values())
        target = _newton(chains.chains, values, every, target, size, move_pose=True)
    for chain in chains.chains:
        found = _difference(chain, values, target, size)
        if not found <= ACCEPTED:
            fault = f"ends {found:.2g} of the robot's size away from the platform, so that its loop is open"
            raise EvaluationError(f"limb {chain.name}: {fault}")
    return values, target


def displacements(chain: Chain, values: Values) -> list[Moved]:
    """Return the displacement of the body behind each joint of a chain."""
    found, at = [], STILL
    for step in chain.steps:
        at = at.after(step_motion(step, values[step.name]))
        found.append(at)
    return found


def _begin(chain: Chain, values: Values, target: Moved) -> None:
    """Set the coordinates that are not set yet: known ones, those of spherical joints, and 0 for the others."""
    balls = []
    for k, step in enumerate(chain.steps):
        if step.name in values:
            continue
        if step.kind == "S":
            balls.append(k)
            values[step.name] = np.eye(3)
        else:
            values[step.name] = 0.0 if step.coordinate is None else step.coordinate
    if not balls or len(balls) > 2:
        return
    steps = chain.steps
    first, last = balls[0], balls[-1]
    before, behind = _product(steps[:first], values), _product(steps[last + 1 :], values)
    side = target.after(behind.inverse())
    if len(balls) == 2:
        at_home = _product(steps[first + 1 : last], values).point(steps[last].point) - steps[first].point
        now = before.inverse().point(side.point(steps[last].point)) - steps[first].point
        values[steps[first].name] = _shortest_rotation(at_home, now)
        before = _product(steps[:last], values)
    values[steps[last].name] = before.R.T @ side.R


def _product(steps: Sequence[Step], values: Values) -> Moved:
    """Return the displacement by joints one after the other."""
    at = STILL
    for step in steps:
        at = at.after(step_motion(step, values[step.name]))
    return at


def _shortest_rotation(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) by the least angle that turns the direction of one vector (3,) to that of another."""
    across = np.cross(one, other)
    sine, cosine = float(np.linalg.norm(across)), float(one @ other)
    if sine == 0.0:
        return np.eye(3)
    return rotation_by(across / sine * np.arctan2(sine, cosine))


def _approach(chain: Chain, values: Values, free: Sequence[Step], target: Moved, size: float) -> None:
    """Close a chain with unknown coordinates along a way from the stated pose, or from where it is."""
    start = dict(values)
    _newton([chain], values, free, target, size)
    if _difference(chain, values, target, size) <= ACCEPTED:
        return
    values.update(start | {step.name: np.eye(3) if step.kind == "S" else 0.0 for step in free})
    turn = _rotation_vector(target.R)
    for part in np.linspace(0.0, 1.0, _PARTS + 1)[1:]:
        _newton([chain], values, free, Moved(rotation_by(part * turn), part * target.t), size)


def _newton(
    chains: Sequence[Chain],
    values: Values,
    free: Sequence[Step],
    target: Moved,
    size: float,
    *,
    move_pose: bool = False,
) -> Moved:
    """Move coordinates until every chain ends at the platform, and return the platform's displacement.

    Args:
        chains: that end there.
        values: coordinates, which are changed.
        free: joints whose coordinates may change.
        target: displacement of the platform.
        size: length of the order of the robot's own.
        move_pose: whether the platform may move too.
    """
    leaders = [step for step in free if not step.follows]
    for _ in range(_STEPS):
        errors = np.concatenate([_error(chain, values, target, size) for chain in chains])
        if float(np.abs(errors).max()) <= _CLOSED:
            break
        columns = np.hstack([np.vstack([_column(chain, values, step, size) for chain in chains]) for step in leaders])
        if move_pose:
            columns = np.hstack([columns, -_POSE_WEIGHT * np.tile(np.eye(6), (len(chains), 1))])
        change = np.linalg.lstsq(columns, errors, rcond=_ZERO)[0]
        change *= min(1.0, _LONGEST / max(float(np.abs(change).max()), _LONGEST))
        at = 0
        for step in leaders:
            width = 3 if step.kind == "S" else 1
            _move(chains, values, step, change[at : at + width], size)
            at += width
        if move_pose:
            target = Moved(
                rotation_by(_POSE_WEIGHT * change[at : at + 3]), _POSE_WEIGHT * size * change[at + 3 :]
            ).after(target)
    return target


def _move(chains: Sequence[Chain], values: Values, step: Step, change: FloatArray, size: float) -> None:
    """Change the coordinate of a joint, and that of the joint that follows it; lengths in parts of the size."""
    value = values[step.name]
    if isinstance(value, np.ndarray):
        values[step.name] = rotation_by(change) @ value
        return
    values[step.name] = value + float(change[0]) * (size if step.kind == "P" else 1.0)
    follower = _follower(chains, step)
    if follower is not None:
        values[follower.name] = -values[step.name]


def _follower(chains: Sequence[Chain], step: Step) -> Step | None:
    """Return the joint that follows another one."""
    for chain in chains:
        for one, other in zip(chain.steps, chain.steps[1:], strict=False):
            if one.name == step.name and other.follows:
                return other
    return None


def _column(chain: Chain, values: Values, step: Step, size: float) -> FloatArray:
    """Return the twists (6, 1 or 3) of the chain's end per change of a coordinate: rotation, then velocity / size.

    Velocities are those of the platform's point at the world's origin.
    """
    at = STILL
    found = np.zeros((6, 3 if step.kind == "S" else 1))
    follower = _follower([chain], step)
    for each in chain.steps:
        if each.name == step.name:
            found += _screws(each, at, size)
        elif follower is not None and each.name == follower.name:
            found -= _screws(each, at, size)
        at = at.after(step_motion(each, values[each.name]))
    return found


def _screws(step: Step, at: Moved, size: float) -> FloatArray:
    """Return the current screws (6, 1 or 3) of a joint on a displaced body; a slide's is for a way of the size."""
    point, axis = at.point(step.point), at.R @ step.axis
    if step.kind == "P":
        return np.concatenate([np.zeros(3), axis])[:, None]
    if step.kind == "S":
        return np.vstack([at.R, cross_matrix(point) @ at.R / size])
    return np.concatenate([axis, (np.cross(point, axis) + step.pitch * axis) / size])[:, None]


def _error(chain: Chain, values: Values, target: Moved, size: float) -> FloatArray:
    """Return the twist (6,) from the chain's end to the platform: rotation vector, then displacement / size."""
    rest = target.after(_product(chain.steps, values).inverse())
    return np.concatenate([_rotation_vector(rest.R), rest.t / size])


def _difference(chain: Chain, values: Values, target: Moved, size: float) -> float:
    """Return the largest entry of the error."""
    return float(np.abs(_error(chain, values, target, size)).max())


def _rotation_vector(R: FloatArray) -> FloatArray:
    """Return the rotation vector (3,) of a rotation matrix (3, 3), radians below half a turn."""
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    norm, cosine = float(np.linalg.norm(sine)), (float(np.trace(R)) - 1) / 2
    if norm == 0.0:
        return np.zeros(3)
    return np.asarray(sine / norm * np.arctan2(norm, cosine))
