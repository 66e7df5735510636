"""What inexact joint centres may cost.

Every joint centre may be built off by a vector of at most a given length. To first order F changes by
``sum_j grad_j F . e_j`` over the joints, and the most that it can lose is the tolerance times ``sum_j |grad_j F|``,
when each error points along its joint's gradient. The platform is taken to stand at the same pose: a machine that is
calibrated has legs of other lengths then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, frozen_array, objective
from ..case.pose import OverPoses
from ..program.epigraph import total_over_poses, worst
from ..program.nlp import Nlp

#: Poses whose F is within this part of the worst one's are the worst together.
_LEVEL = 1e-7


@dataclass(frozen=True, eq=False)
class ToleranceLoss:
    """The worst that a tolerance on every joint centre can do.

    Attributes:
        tolerance: largest error of each joint centre, length.
        loss: how much worse F can become, to first order.
        loss_there: how much worse F really becomes with the errors that are worst to first order.
        joints: names of the joints: the leg's, and the plate's.
        gradients: (k, 3) derivatives of F by each joint's error, base joints in the world frame and platform joints in
            the platform's.
    """

    tolerance: float
    loss: float
    loss_there: float
    joints: tuple[tuple[str, str], ...]
    gradients: FloatArray


class BuiltRobot:
    """F of a program's first task at a point, as a function of the errors of the joint centres."""

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
        """``e -> (F, dF/de)`` at one pose, whose parameters, R and p are numbers."""
        model, length = self._nlp.program.model, self._nlp.case.characteristic_length
        F = objective(model.built, SX(twist.tolist()), SX(length))
        symbols = [ca.vertcat(SX(0, 1), *[item.symbol for item in model.parameters])]
        symbols += [model.pose.rotation, model.pose.position, e]
        whole = ca.Function("built", symbols, [F])
        at = whole.call([*(ca.DM(value) for value in values), e])[0]
        return ca.Function("built", [e], [at, ca.gradient(at, e)])

    def evaluate(self, errors: FloatArray) -> tuple[float, list[FloatArray]]:
        """F over the poses, and its gradients (k, 3): one, or one for each of the worst poses.

        Args:
            errors: (k, 3) of the joints.
        """
        results = [function(errors.ravel()) for function in self._functions]
        values = [float(F) for F, _ in results]
        gradients: list[FloatArray] = [gradient.full().reshape(-1, 3) for _, gradient in results]
        case = self._nlp.case
        if case.over_poses is OverPoses.WORST and len(values) > 1:
            level = worst(values, self._nlp.sense)
            return level, [
                gradient
                for value, gradient in zip(values, gradients, strict=True)
                if abs(value - level) <= _LEVEL * abs(level)
            ]
        return total_over_poses(values, case.over_poses), [total_over_poses(gradients, case.over_poses)]


def tolerance_loss(nlp: Nlp, x: FloatArray, tolerance: float) -> ToleranceLoss:
    """The worst first-order loss of F at a point (n,) with every joint centre off by up to a length."""
    robot = BuiltRobot(nlp, x)
    exact, gradients = robot.evaluate(np.zeros((len(robot.joints), 3)))
    worst = max(gradients, key=lambda gradient: float(np.linalg.norm(gradient, axis=1).sum()))
    sizes = np.linalg.norm(worst, axis=1, keepdims=True)
    # A maximum loses by going down, a minimum by going up.
    errors = nlp.sign * tolerance * np.divide(worst, sizes, out=np.zeros_like(worst), where=sizes > 0)
    there, _ = robot.evaluate(errors)
    return ToleranceLoss(
        tolerance=tolerance,
        loss=tolerance * float(sizes.sum()),
        loss_there=nlp.sign * (there - exact),
        joints=robot.joints,
        gradients=frozen_array(worst, worst.shape),
    )
