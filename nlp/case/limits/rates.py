"""Limits on actuator rates for the task's twist, and on the share of a single limb in F.

The rate of a straight leg is the work rate of its force. The rates of a limb given joint by joint minimise the part of
the task's twist that the limb resists. The constraint is on ``qdot^2``. The share of a limb is the sum of the squared
work rates of its rows divided by F.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
from casadi import SX

from ....models import Dimension, Model, WrenchKind, rates_expression
from ...errors import CaseError
from ..table import Table
from .constraint import SQUARED_NUMBER, BoundedConstraint, Call, Form, Reading, between
from .interval import AtMost
from .limit import Limit, LimitedCase, NumberRange, PosedRobot, Ranges

#: Regularisation of a limb's share of F at F = 0, relative to the magnitude of F without cancellation.
_SHARELESS = 1e-14
#: Reading of a share between 0 and 1.
_PART = Reading(Dimension.NUMBER, above=0.0, most=1.0)


@dataclass(frozen=True)
class ActuatorRate(Limit[AtMost]):
    """Largest rate of every actuator for the twist of every task, at every pose.

    Attributes:
        max: largest rate: length or radians of the actuator per radian of the task, or per length of a translation.
    """

    max: float

    key: ClassVar[str] = "actuator_rate"
    table: ClassVar[type[AtMost]] = AtMost
    description: ClassVar[str] = "largest rate of every actuator for the unit twist of the task, at every pose"
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.NUMBER)}
    order: ClassVar[int] = 1

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether the actuators of a robot are known, from its legs or its joints."""
        return bool(model.legs or model.actuators)

    def check(self, case: LimitedCase) -> None:
        """Check the limit against the case.

        Raises:
            CaseError: the rate is not positive, or the robot's motion does not determine the rates of its actuators.
        """
        super().check(case)
        names = () if case.model.generic is None else case.model.generic.undetermined
        if names:
            fault = f"is not supported for this robot: its motion does not determine the rates of {', '.join(names)}"
            raise CaseError("limits.actuator_rate", f"{fault}, which can move while the platform stands still")

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the squared rate of each actuator for each task."""
        for limb in pose.model.limbs:
            names, values = _rates(pose, limb)
            for j, task in enumerate(pose.tasks):
                whose = f" task {task}" if len(pose.tasks) > 1 else ""
                for i, name in enumerate(names):
                    where = f"{self.key} actuator {name}{whose}{pose.where}"
                    yield between(where, values[i, j] ** 2, SQUARED_NUMBER, self.key, upper=self.max)


def _rates(pose: PosedRobot, limb: str) -> tuple[tuple[str, ...], SX]:
    """Return the names of the actuators of a limb, and their rates (n, tasks)."""
    model, robot = pose.model, pose.robot
    rows = [i for i, row in enumerate(model.frame_rows) if row.limb == limb]
    if model.legs and not model.actuators:
        rows = [i for i in rows if model.frame_rows[i].kind is WrenchKind.FORCE]
        return (limb,), robot.rates[rows[:1], :]
    driven = [a for a, each in enumerate(model.actuators) if each.limb == limb]
    if not driven:
        return (), SX(0, robot.rates.shape[1])
    values = rates_expression(robot.driven[rows, driven], robot.relations[:, driven], robot.rates[rows, :])
    return tuple(model.actuators[a].name for a in driven), values


def _share(numbers: SX) -> SX:
    """Return a limb's share of F (1, 1).

    The argument (2 + n, 1) has F, the magnitude that F would have if no terms cancelled, and the limb's n work rates.
    The magnitude keeps the share finite at F = 0.
    """
    rates = numbers[2:]
    squares = sum((rates[i] ** 2 for i in range(rates.numel())), SX(0))
    return squares / (numbers[0] + _SHARELESS * numbers[1])


@dataclass(frozen=True)
class RateShare(Limit[AtMost]):
    """Largest share of a single limb in F.

    Attributes:
        max: largest share, above 0 and at most 1.
    """

    max: float

    key: ClassVar[str] = "rate_share"
    table: ClassVar[type[Table]] = AtMost
    description: ClassVar[str] = "largest share of a single limb in F, at most 1"
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.NUMBER, most=1.0)}
    order: ClassVar[int] = 1

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the share of each limb in the F of each task."""
        robot = pose.robot
        for j, task in enumerate(pose.tasks):
            whose = f" task {task}" if len(pose.tasks) > 1 else ""
            for limb in pose.model.limbs:
                rates = [robot.rates[i, j] for i, row in enumerate(pose.model.frame_rows) if row.limb == limb]
                part = Call(Form(_share), ca.vertcat(robot.F[j], robot.magnitude[j], *rates))
                yield between(f"rate_share limb {limb}{whose}{pose.where}", part, _PART, "rate_share", upper=self.max)
