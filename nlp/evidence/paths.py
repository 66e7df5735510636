"""Screws of joints and equations of nested loops at one point, and the velocity equations with these loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...models import FloatArray, JointScrews, Velocities
from ...models.actuation import with_loops
from ..program.nlp import Nlp
from ..program.program import RobotNumbers


class PathScrews(NamedTuple):
    """A path of joints with its screws (6, k) and loops (m, k) at a point."""

    path: JointScrews
    screws: FloatArray
    loops: FloatArray


def paths_at(nlp: Nlp, x: FloatArray, numbers: RobotNumbers, pose: int = 0) -> list[PathScrews]:
    """Return the paths of joints of a robot, of those whose screws are known, at a point.

    Args:
        nlp: the program.
        x: (n,) the point.
        numbers: of the robot there.
        pose: index of the pose.
    """
    paths = nlp.program.model.joint_screws
    if not paths:
        return []
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    given = numbers.parameters, unknowns, numbers.rotation, numbers.position
    values = [np.array(each, dtype=np.float64) for each in nlp.program.kernels.joint_screws.call(given)]
    return [PathScrews(*each) for each in zip(paths, values[::2], values[1::2], strict=True)]


def velocities_at(nlp: Nlp, x: FloatArray, numbers: RobotNumbers, pose: int = 0) -> Velocities:
    """Return the velocity equations of the platform and the actuators; the arguments are those of :func:`paths_at`."""
    model = nlp.program.model
    is_nested = any(each.is_nested for each in model.joint_screws)
    nested = [each for each in paths_at(nlp, x, numbers, pose) if each.path.is_nested] if is_nested else []
    return with_loops(model, Velocities(numbers.jacobian, numbers.driven, numbers.relations), nested)
