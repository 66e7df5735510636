"""Screws of joints and velocity equations of nested loops at one point, and the robot's state with these loops."""

from __future__ import annotations

import numpy as np

from ...models import FloatArray, Velocities
from ...models.actuation import PathScrews, paths_of, with_loops
from ..program.nlp import Nlp
from ..program.program import RobotNumbers


def paths_at(nlp: Nlp, x: FloatArray, numbers: RobotNumbers, pose: int = 0) -> list[PathScrews]:
    """Return the screws of each chain of joints of a robot at a point; empty if the model does not give them.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        numbers: values of the robot at the point.
        pose: index of the pose.
    """
    paths = nlp.program.model.joint_screws
    if not paths:
        return []
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    given = numbers.parameters, unknowns, numbers.rotation, numbers.position
    values = [np.array(each, dtype=np.float64) for each in nlp.program.kernels.joint_screws.call(given)]
    return paths_of(paths, values)


def velocities_at(nlp: Nlp, x: FloatArray, numbers: RobotNumbers, pose: int = 0) -> Velocities:
    """Return the velocity equations of the platform and the actuators; for arguments see :func:`paths_at`."""
    model = nlp.program.model
    is_nested = any(each.is_nested for each in model.joint_screws)
    nested = [each for each in paths_at(nlp, x, numbers, pose) if each.path.is_nested] if is_nested else []
    return with_loops(model, numbers.velocities, nested, nlp.case.characteristic_length)


def numbers_at(nlp: Nlp, x: FloatArray, pose: int = 0) -> RobotNumbers:
    """Return the robot's values at a point, with the rank of nested loops at this point.

    Where loops lose rank, the program's expressions are 0 / 0, and their values are rounding errors.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        pose: index of the pose.
    """
    numbers = nlp.program.kernels.robot_states[pose](x, nlp.arguments)
    jacobian, driven, relations = velocities_at(nlp, x, numbers, pose)
    if np.array_equal(jacobian, numbers.jacobian, equal_nan=True):
        return numbers._replace(driven=driven, relations=relations)
    twists = np.array([nlp.arguments[list(each)] for each in nlp.program.places.twists])
    rates = jacobian @ np.hstack([twists[:, 3:], twists[:, :3]]).T
    F = np.sum(rates**2, axis=0)[:, None]
    return numbers._replace(jacobian=jacobian, rates=rates, F=F, driven=driven, relations=relations)
