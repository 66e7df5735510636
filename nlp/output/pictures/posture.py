"""Geometry of a robot's drawing at one pose, at each pose of a case, and after a motion of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from ....models import (
    FloatArray,
    Model,
    Substitution,
    Velocities,
    displacement,
    driven,
    frozen_array,
    jacobian,
    rate_relations,
    reporting_matrix,
)
from ....models.actuation import expressions_of_paths, paths_of, with_loops
from ....models.newton import VectorEquations, newton
from ...case.task import Sense
from ...errors import EvaluationError, InputError
from ...evidence.state import RobotState, evaluate
from ...program.epigraph import worst_value
from ...program.nlp import Nlp
from ...program.program import Kernel, tuple_of
from ...solver.solution import TaskOutcome


def pose_index(nlp: Nlp, pose: int) -> int:
    """Return the index of a pose from its number, 1 for the first.

    Raises:
        InputError: the case has no such pose.
    """
    count = len(nlp.program.robots)
    if not 1 <= pose <= count:
        allowed = "the only pose is 1" if count == 1 else f"it must be 1 to {count}"
        raise InputError(f"{nlp.case.source or nlp.case.name}: pose {pose} does not exist: {allowed}")
    return pose - 1


def states_at_poses(outcome: TaskOutcome) -> list[RobotState | None]:
    """Return the robot's state at every pose, for the outcome of a task; None where the robot does not exist."""
    nlp, x = outcome.own.nlp, outcome.at
    return [outcome.state, *(state_at_pose(nlp, x, k) for k in range(1, len(nlp.program.robots)))]


def worst_pose(states: Sequence[RobotState | None], sense: Sense) -> int | None:
    """Return the index of the pose with the worst F; None for a single pose, or if F is missing at a pose."""
    values = [state.F for state in states if state is not None]
    if len(values) < max(2, len(states)):
        return None
    return values.index(worst_value(values, sense))


def state_at_pose(nlp: Nlp, x: FloatArray, pose: int) -> RobotState | None:
    """Return the robot's state at one pose of a point (n,); None if the robot does not exist there."""
    try:
        return evaluate(nlp, x, pose)
    except EvaluationError:
        return None


#: Largest number of Newton steps for the loops after a small motion, and the final residual, near rounding errors.
_STEPS = 20
_ROUNDING = 1e-11


@dataclass(frozen=True, eq=False)
class Posture:
    """Geometry of a drawing at one pose, in the order of the model's scene; world coordinates, the case's length unit.

    Attributes:
        rotation: (3, 3) rotation ``R`` of the platform.
        position: (3,) position ``p`` of the platform.
        unknowns: values of the model's internal unknowns.
        points: (n, 3) points of the scene.
        circles: (c, 3, 3) centre, point and normal of each circle.
        directions: (d, 2, 3) origin and unit vector of each direction.
        marks: points of each mark, (k, 3) each.
        joints: (1 + a, 3) for each joint: position, and unit vectors of its axes.
        jacobian: (m, 6) unit wrenches, couple rows scaled by the characteristic length.
        driving: (m,) largest work rate of each row for a unit rate of an actuator; zero for a constraint, and for a
            robot without actuated joints.
        quantities: values of the model's quantities, radians for angles.
    """

    rotation: FloatArray
    position: FloatArray
    unknowns: FloatArray
    points: FloatArray
    circles: FloatArray
    directions: FloatArray
    marks: tuple[FloatArray, ...]
    joints: tuple[FloatArray, ...]
    jacobian: FloatArray
    driving: FloatArray
    quantities: tuple[FloatArray, ...]


class Linkage:
    """Robot with its dimensions, for any pose of its platform.

    Args:
        model: model of the robot.
        parameters: components of all parameters in the model's order; radians for angles.
        characteristic_length: factor between couples and forces in the Jacobian, length.
    """

    def __init__(self, model: Model, parameters: FloatArray, characteristic_length: float = 1.0) -> None:
        self.model = model
        self._parameters, self._length = parameters, characteristic_length
        own = Substitution.identity(model)
        self._nested = [each for each in model.joint_screws if each.is_nested]
        outputs = [
            ca.horzcat(SX(3, 0), *[expression for _, expression in model.scene.expressions]),
            jacobian(model.wrenches, SX(characteristic_length), model.members),
            driven(model.wrenches, model.actuators, SX(characteristic_length), model.members),
            rate_relations(model.actuators),
            *expressions_of_paths(self._nested),
            *[quantity.values for quantity in model.quantities],
        ]
        self._drawing = Kernel(ca.Function("drawing", own.all, [ca.densify(each) for each in outputs]), tuple_of)
        closure = ca.vertcat(SX(0, 1), *[equation.scaled for equation in model.closure])
        self._determined = [k for k, each in enumerate(model.unknowns) if not each.is_free]
        slopes = ca.jacobian(closure, own.unknowns)
        self._loops = Kernel(ca.Function("loops", own.all, [ca.densify(closure), ca.densify(slopes)]), tuple_of)

    def posture_at(
        self, rotation: FloatArray, position: FloatArray, unknowns: FloatArray, parameters: FloatArray | None = None
    ) -> Posture:
        """Return the drawing at a pose.

        Args:
            rotation: (3, 3) rotation ``R``.
            position: (3,) position ``p``, length.
            unknowns: values of the model's internal unknowns, which must close its loops.
            parameters: components of all parameters, for dimensions that change; those of the robot if left out.
        """
        scene = self.model.scene
        arguments = (
            self._parameters if parameters is None else parameters,
            unknowns,
            rotation.ravel(order="F"),
            position,
        )
        columns, rows, works, relations, *quantities = self._drawing(*arguments)
        screws, quantities = quantities[: 3 * len(self._nested)], quantities[3 * len(self._nested) :]
        paths = paths_of(self._nested, screws)
        velocities = with_loops(self.model, Velocities(rows, works, relations), paths, self._length)
        matrix = reporting_matrix(self.model, velocities, position)
        rows, works = matrix @ velocities.jacobian, np.abs(matrix @ velocities.driven)
        sizes = [mark.kind.size for mark in scene.marks]
        counts = [len(scene.points), 3 * len(scene.circles), 2 * len(scene.directions), sum(sizes)]
        points, circles, directions, marks, joints = np.split(columns.T, np.cumsum(counts))
        directions = directions.reshape(-1, 2, 3)
        directions[:, 1] /= np.linalg.norm(directions[:, 1], axis=1, keepdims=True)
        ends = np.cumsum(sizes)[:-1]
        return Posture(
            rotation=frozen_array(rotation, (3, 3)),
            position=frozen_array(position, (3,)),
            unknowns=frozen_array(unknowns, (len(self.model.unknowns),)),
            points=frozen_array(points, points.shape),
            circles=frozen_array(circles.reshape(-1, 3, 3), (len(scene.circles), 3, 3)),
            directions=frozen_array(directions, directions.shape),
            marks=tuple(frozen_array(part, part.shape) for part in np.split(marks, ends)) if scene.marks else (),
            joints=_joints(joints, [1 + len(each.axes) for each in scene.joints]),
            jacobian=frozen_array(rows, (len(self.model.rows), 6)),
            driving=frozen_array(works.max(axis=1, initial=0.0), (len(self.model.rows),)),
            quantities=tuple(frozen_array(each.ravel(), (each.size,)) for each in quantities),
        )

    def posture_after(self, start: Posture, twist: FloatArray, t: float) -> Posture | None:
        """Return the drawing after a motion of the platform from a posture along a twist (6,) for a time ``t``.

        Newton's method on the loops gives the internal unknowns, so a robot with internal unknowns needs small motions.
        Free actuator coordinates stay constant.

        Returns:
            Posture after the motion; None if the loops do not close, or a limb has zero length.
        """
        turn, shift = displacement(twist, t)
        rotation, position = turn @ start.rotation, turn @ start.position + shift
        unknowns = start.unknowns
        if self._determined:
            pose = rotation.ravel(order="F"), position
            equations = VectorEquations(
                lambda at: self._loops(self._parameters, at, *pose), _ROUNDING, self._determined
            )
            found = newton(equations, equations.at(unknowns), steps=_STEPS)
            if not found.error <= np.sqrt(_ROUNDING):
                return None
            unknowns = found.z
        reached = self.posture_at(rotation, position, unknowns)
        return reached if np.isfinite(reached.jacobian).all() else None


def _joints(columns: FloatArray, sizes: Sequence[int]) -> tuple[FloatArray, ...]:
    """Return position and unit axes of each joint from the stacked vectors (n, 3) of all joints."""
    found = []
    for part in np.split(columns, np.cumsum(sizes)[:-1]) if sizes else ():
        lengths = np.linalg.norm(part[1:], axis=1, keepdims=True)
        # An axis has no direction if the two lines that define it are parallel.
        axes = np.divide(part[1:], lengths, out=np.zeros_like(part[1:]), where=lengths > 0)
        found.append(frozen_array(np.vstack([part[:1], axes]), part.shape))
    return tuple(found)
