"""Loss of F from errors of the joint centres.

Every joint centre may have an error vector up to a given length. To first order F changes by ``sum_j grad_j F . e_j``
over the joints. The largest loss is the tolerance times ``sum_j |grad_j F|``, where each error is parallel to the
gradient of its joint. The pose of the platform is the nominal one: a calibrated robot reaches it with other leg
lengths.
"""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, objective
from ..case.pose import OverPoses
from ..program.epigraph import total_over_poses, worst_value
from ..program.nlp import Nlp
from ..system.jsonvalues import JsonObject, Key, Vector3, vector

#: Largest relative difference from the worst F at which a pose also counts as worst.
_SAME_VALUE = 1e-7


class JointGradient(JsonObject):
    """Derivatives of F with respect to the error of a joint centre.

    Attributes:
        limb: name of the joint's limb.
        plate: body that carries the joint: base or platform.
        gradient: derivatives of F in the frame of this body.
    """

    limb: str
    plate: str
    gradient: Vector3


class ToleranceLoss(JsonObject):
    """Loss of F from errors of the joint centres.

    Attributes:
        tolerance: largest error of every joint centre.
        loss: largest loss of F, to first order.
        loss_there: exact loss of F with the errors that are worst to first order.
        joints: derivatives of F with respect to each joint's error.
    """

    tolerance: Annotated[float, Key("joint_centre")]
    loss: float
    loss_there: float
    joints: tuple[JointGradient, ...]


class ToleranceEvaluation(NamedTuple):
    """F with errors of the joint centres.

    Attributes:
        F: objective over the poses.
        gradients: (k, 3) derivatives with respect to the errors at each of the worst poses.
    """

    F: float
    gradients: tuple[FloatArray, ...]


class BuiltRobot:
    """F of a program's first task at a point, as a function of the errors of the joint centres.

    Args:
        nlp: nonlinear program whose model gives rows with errors (``built``).
        x: (n,) the point.
    """

    def __init__(self, nlp: Nlp, x: FloatArray) -> None:
        self._nlp = nlp
        model = nlp.program.model
        errors = [error for leg in model.legs for error in (leg.base_error, leg.platform_error)]
        self.joints = tuple((leg.name, plate) for leg in model.legs for plate in ("base", "platform"))
        e = ca.vertcat(*errors)
        twist = nlp.arguments[nlp.program.places.twists[0]]
        states = [kernel(x, nlp.arguments) for kernel in nlp.program.kernels.robot_states]
        self._functions = [
            self._function((state.parameters, state.rotation, state.position), e, twist) for state in states
        ]

    def _function(self, values: Sequence[FloatArray], e: SX, twist: FloatArray) -> ca.Function:
        """Return the function ``e -> (F, dF/de)`` at one pose.

        Args:
            values: parameters (k, 1), ``R`` (3, 3) and ``p`` (3, 1) at the pose.
            e: (3 k, 1) symbols of the joint errors.
            twist: (6,) twist of the task.
        """
        model, length = self._nlp.program.model, self._nlp.case.characteristic_length
        F = objective(model.built, SX(twist.tolist()), SX(length))
        symbols = [model.symbols]
        symbols += [model.pose.rotation, model.pose.position, e]
        whole = ca.Function("built", symbols, [F])
        at = whole.call([*(ca.DM(value) for value in values), e])[0]
        return ca.Function("built", [e], [at, ca.gradient(at, e)])

    def evaluate(self, errors: FloatArray) -> ToleranceEvaluation:
        """Return F over the poses, and its gradients.

        Args:
            errors: (k, 3) errors of the joint centres, length, each in the frame of its joint.
        """
        results = [function(errors.ravel()) for function in self._functions]
        values = [float(F) for F, _ in results]
        gradients: list[FloatArray] = [gradient.full().reshape(-1, 3) for _, gradient in results]
        case = self._nlp.case
        if case.over_poses is OverPoses.WORST and len(values) > 1:
            level = worst_value(values, self._nlp.sense)
            near = [abs(value - level) <= _SAME_VALUE * abs(level) for value in values]
            return ToleranceEvaluation(level, tuple(each for each, kept in zip(gradients, near, strict=True) if kept))
        whole = total_over_poses(gradients, case.over_poses)
        return ToleranceEvaluation(total_over_poses(values, case.over_poses), (whole,))


def tolerance_loss(nlp: Nlp, x: FloatArray, tolerance: float) -> ToleranceLoss:
    """Return the largest first-order loss of F for a tolerance on every joint centre.

    Args:
        nlp: nonlinear program whose model gives rows with errors (``built``).
        x: (n,) the point.
        tolerance: largest error of each joint centre, length.
    """
    robot = BuiltRobot(nlp, x)
    exact, gradients = robot.evaluate(np.zeros((len(robot.joints), 3)))
    steepest = max(gradients, key=lambda gradient: float(np.linalg.norm(gradient, axis=1).sum()))
    sizes = np.linalg.norm(steepest, axis=1, keepdims=True)
    # A decrease of F is a loss where F is maximised, an increase where F is minimised.
    errors = nlp.sign * tolerance * np.divide(steepest, sizes, out=np.zeros_like(steepest), where=sizes > 0)
    there, _ = robot.evaluate(errors)
    return ToleranceLoss(
        tolerance=tolerance,
        loss=tolerance * float(sizes.sum()),
        loss_there=nlp.sign * (there - exact),
        joints=tuple(
            JointGradient(limb=limb, plate=plate, gradient=vector(gradient))
            for (limb, plate), gradient in zip(robot.joints, steepest, strict=True)
        ),
    )
