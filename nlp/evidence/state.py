"""State of the robot at one point: pose, Jacobian, rates, F, rank and free twists."""

from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Annotated

import casadi as ca
import numpy as np

from ...models import (
    Dimension,
    Displacement,
    FloatArray,
    Model,
    axis_angle_from_matrix,
    frozen_array,
    homogenised,
    reason_for_zero_row,
    reporting_matrix,
)
from ...models.basis import settled_basis
from ...models.linalg import echelon_basis
from ...models.values import dataclass
from ..case.case import Case
from ..case.existence import assembly_fault
from ..errors import EvaluationError
from ..program.nlp import Nlp
from ..program.places import HeldRotation
from ..system.jsonvalues import JsonObject, Key, Vector3, matrix, vector
from ..system.strictjson import Size
from .paths import numbers_at

#: Relative value, compared with F without cancellation, below which F is zero: the rates are then below 1e-6.
ZERO_F = 1e-12
#: Singular values below this fraction of the largest, with moments divided by the longest one, are zero: this is the
#: square root of the rounding unit of double precision: points are known to rounding error only.
ZERO_SINGULAR_VALUE = 1.5e-8
#: Largest residual of a closed loop's equation, of magnitude about 1: in another assembly mode it is about 0.1.
CLOSED = 1e-6


@dataclass(frozen=True, eq=False)
class RobotState:
    """State of the robot at one point.

    Attributes:
        parameters: components of each parameter, by parameter name; radians for angles.
        position: (3,) ``p``, origin of the platform frame in the world frame, length.
        rotation: (3, 3) ``R``, platform to world coordinates.
        axis: unit axis of the rotation (3,).
        angle: angle of the rotation, radians; signed if the axis is fixed.
        jacobian: (m, 6) unit wrenches, force, then moment about the world origin.
        rates: (m,) work rates ``L_i ^ chi``; for a leg driven along its axis, the rate of its length.
        F: ``sum(rates^2)``.
        size: sum of the magnitudes of the terms of F; an F that is small compared with ``size`` counts as zero.
        singular_values: (min(m, 6),) singular values of the Jacobian with moments about the platform's origin, divided
            by the longest moment of any unit wrench of a limb, largest first: plain numbers, the same in every unit of
            length.
        rank: number of non-zero singular values.
        free_twists: (6 - rank, 6) basis of the twists that no row of the Jacobian resists, in reduced echelon form. The
            largest component of each angular velocity, or of the velocity of a translation, is 1 or -1.
        quantities: quantities of the model by name, each (n,); radians for angles.
    """

    parameters: Mapping[str, FloatArray]
    position: FloatArray
    rotation: FloatArray
    axis: FloatArray
    angle: float
    jacobian: FloatArray
    rates: FloatArray
    F: float
    size: float
    singular_values: FloatArray
    rank: int
    free_twists: FloatArray
    quantities: Mapping[str, FloatArray]

    @property
    def is_zero(self) -> bool:
        """True if F is zero: the platform can make the task's motion with every actuator locked."""
        return ZERO_F * self.size >= self.F

    @property
    def is_singular(self) -> bool:
        """True if the platform has a motion that no row of the Jacobian resists."""
        return self.rank < 6


class WorkspacePose(JsonObject):
    """A pose of the platform.

    Attributes:
        position: origin of the platform frame in the world frame.
        axis: unit axis of the rotation; z without rotation.
        angle: angle of the rotation about the axis.
    """

    position: Vector3
    axis: Vector3
    angle: Annotated[float, Dimension.ANGLE]


class PlatformPose(WorkspacePose):
    """A pose of the platform with its rotation matrix.

    Attributes:
        position: position of the platform's origin in the world frame.
        axis: unit axis of the rotation.
        angle: angle of the rotation about the axis; signed if the axis is fixed.
        rotation: rows of the rotation matrix.
    """

    rotation: Annotated[tuple[Vector3, ...], Size(3), Key("rotation_matrix")]


def evaluate(nlp: Nlp, x: FloatArray, pose: int = 0) -> RobotState:
    """Return the state of the robot at a point of the program.

    Args:
        nlp: the nonlinear program.
        x: (n,) values of its free variables.
        pose: index of the pose, in a case with several poses.

    Returns:
        The state with the rates of the program's task; for combined tasks, of the first task.

    Raises:
        EvaluationError: a value is not finite at this point, for example because a limb has zero length.
    """
    model, case = nlp.program.model, nlp.case
    where = f"{case.source}: " if case.source else ""
    numbers = numbers_at(nlp, x, pose)
    rotation, position = numbers.rotation, numbers.position
    sizes = [len(parameter.typical) for parameter in model.parameters]
    parts = np.split(numbers.parameters.ravel(), np.cumsum(sizes)[:-1]) if sizes else []
    if not all(np.isfinite(each).all() for each in (numbers.squares, numbers.jacobian, numbers.rates, rotation)):
        dimensions = {item.name: part for item, part in zip(model.parameters, parts, strict=True)}
        if fault := assembly_fault(model, dimensions, case.units):
            raise EvaluationError(f"{where}{fault}")
    for row, square in zip(model.wrenches, numbers.squares.ravel(), strict=True):
        if square == 0:
            raise EvaluationError(f"{where}{reason_for_zero_row(row)} at this point")
    if not all(np.isfinite(each).all() for each in (numbers.squares, numbers.jacobian, numbers.rates, rotation)):
        raise EvaluationError(f"{where}the robot's equations give no finite Jacobian at this point")
    reporting = reporting_matrix(model, numbers.velocities, position)
    jacobian, rates = reporting @ numbers.jacobian, reporting @ numbers.rates
    axis, angle = axis_angle_from_matrix(rotation)
    stated, step = _pose_displacements(case)[pose]
    if step.is_identity:
        axis, angle = _stated_axis_angle(nlp, x, stated, rotation)
    rank, free_twists, singular_values = _rank_and_free_twists(
        jacobian, position.ravel(), _longest_moment(model, numbers.jacobian, position.ravel())
    )
    return RobotState(
        parameters=MappingProxyType(
            {item.name: frozen_array(part, part.shape) for item, part in zip(model.parameters, parts, strict=True)}
        ),
        position=frozen_array(position.ravel(), (3,)),
        rotation=frozen_array(rotation, (3, 3)),
        axis=axis,
        angle=angle,
        jacobian=frozen_array(jacobian, jacobian.shape),
        rates=frozen_array(rates[:, 0], (len(model.rows),)),
        F=float(numbers.F[0, 0]),
        size=float(numbers.magnitude[0, 0]),
        singular_values=frozen_array(singular_values, singular_values.shape),
        rank=rank,
        free_twists=frozen_array(free_twists, free_twists.shape),
        quantities=MappingProxyType(
            {
                item.name: frozen_array(values.ravel(), (len(item.owners),))
                for item, values in zip(model.quantities, numbers.quantities, strict=True)
            }
        ),
    )


def legs_at(nlp: Nlp, x: FloatArray, pose: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return the base joints (k, 3) of straight legs, and the vectors (k, 3) from them to the platform joints."""
    legs = nlp.program.robots[pose].legs
    ends = [ca.horzcat(ca.SX(3, 0), *[getattr(leg, each) for leg in legs]) for each in ("base", "span")]
    function = ca.Function("legs", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in ends])
    base, span = (each.full().T for each in function(x, nlp.arguments))
    return base, span


def loops_are_closed(nlp: Nlp, x: FloatArray) -> bool:
    """Return whether all loop equations of the robot hold at a point (n,), including those that the program omits.

    The program has independent equations only, which other assembly modes satisfy too.
    """
    if not nlp.program.model.loops:
        return True
    states = (kernel(x, nlp.arguments) for kernel in nlp.program.kernels.robot_states)
    return all(float(np.abs(each.loops).max(initial=0.0)) <= CLOSED for each in states)


def loses_forces(nlp: Nlp, x: FloatArray) -> bool:
    """Return whether J is singular at a point (n,) of a case that limits or minimises actuator forces under loads.

    The loads do not determine the actuator forces there, and next to the point the forces have no common limit.
    """
    if not nlp.case.uses_forces:
        return False
    with suppress(EvaluationError):  # a point without a Jacobian is refused for that
        return any(evaluate(nlp, x, pose).is_singular for pose in range(len(nlp.program.robots)))
    return False


def stated_poses(nlp: Nlp, x: FloatArray) -> list[PlatformPose]:
    """Return the poses that a case states at a point (n,), before their displacements."""
    found: dict[int, PlatformPose] = {}
    for k, (stated, step) in enumerate(_pose_displacements(nlp.case)):
        if stated not in found:
            numbers = nlp.program.kernels.robot_states[k](x, nlp.arguments)
            rotation = step.rotation.T @ numbers.rotation
            position = step.rotation.T @ (numbers.position.ravel() - step.translation)
            axis, angle = _stated_axis_angle(nlp, x, stated, rotation)
            found[stated] = PlatformPose(
                position=vector(position), axis=vector(axis), angle=angle, rotation=matrix(rotation)
            )
    return list(found.values())


def _stated_axis_angle(nlp: Nlp, x: FloatArray, stated: int, rotation: FloatArray) -> tuple[FloatArray, float]:
    """Return a stated pose's rotation as unit axis (3,) and angle in radians; signed if the axis is fixed.

    Args:
        nlp: the program.
        x: (n,) values of the free variables.
        stated: index of the stated pose.
        rotation: (3, 3) ``R`` of the stated pose.
    """
    places, axis = nlp.program.places.rotations[stated], nlp.case.poses[stated].rotation.axis
    if axis is None or not isinstance(places, HeldRotation):
        return axis_angle_from_matrix(rotation)
    vector = x if places.angle.vector == "x" else nlp.arguments
    return frozen_array(axis, (3,)), float(vector[places.angle.index])


def _pose_displacements(case: Case) -> list[tuple[int, Displacement]]:
    """Return the index of the stated pose and the displacement from it, for each pose of the robot."""
    return [(station.pose, station.step) for station in case.stations]


def _longest_moment(model: Model, rows: FloatArray, centre: FloatArray) -> float:
    """Return the longest moment of any unit wrench of a limb, length; 1 without moments.

    A limb member resists with a whole space of wrenches, so its longest moment is that of any unit combination of its
    rows: it does not depend on their basis.

    Args:
        model: the robot.
        rows: (m, 6) rows of a :class:`~screwsynth.models.instance.RobotInstance`, moments about the world origin.
        centre: (3,) the platform's origin in the world frame, length.
    """
    moments = np.array(homogenised(rows, centre, 1.0))[3:].T
    at = len(model.wrenches)
    longest = float(np.linalg.norm(moments[:at], axis=1).max(initial=0.0))
    for member in model.members:
        longest = max(longest, float(np.linalg.norm(moments[at : at + member.size], ord=2)))
        at += member.size
    return longest or 1.0


def _rank_and_free_twists(jacobian: FloatArray, centre: FloatArray, arm: float) -> tuple[int, FloatArray, FloatArray]:
    """Return the rank, the free twists (6 - rank, 6) and the singular values of J.

    Args:
        jacobian: (m, 6) rows force, then moment about the world origin.
        centre: (3,) the platform's origin in the world frame, length: moments are taken about it.
        arm: length by which moments are divided.
    """
    # Columns in the order of a twist (omega, v), so that a null vector is a twist: omega in units of v / arm.
    forces, moments = np.split(np.array(homogenised(jacobian, centre, arm)), 2)
    resistance = np.vstack([moments, forces]).T
    _, values, rows = np.linalg.svd(resistance)
    rank = int(np.count_nonzero(values > ZERO_SINGULAR_VALUE * values[0]))
    null = settled_basis(rows[rank:])
    null[:, 3:] -= np.cross(null[:, :3], centre / arm)
    free = echelon_basis(null) if len(null) else np.zeros((0, 6))
    # Twists of unit rotation about an axis, or else of unit translation, in every unit of length.
    free[:, 3:] *= arm
    parts = np.where(free[:, :3].any(axis=1, keepdims=True), free[:, :3], free[:, 3:])
    return rank, free / np.abs(parts).max(axis=1, keepdims=True, initial=0.0), values


def state_or_none(nlp: Nlp, x: FloatArray) -> RobotState | None:
    """Return the state of the robot at a point (n,), or None if the equations of the robot have no finite value."""
    try:
        return evaluate(nlp, x)
    except EvaluationError:
        return None
