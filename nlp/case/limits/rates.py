"""Limits on rates in the task's motion: of every actuator, and the part of F that one limb carries.

A straight leg's rate is the work rate of its force. The rates of a limb given joint by joint minimise the part of the
task's twist that the limb resists. The constraint is on ``qdot^2``. A limb's part of F is the sum of the squared rates
of its rows over F.
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

#: Keeps a limb's share of F defined where F is 0, in parts of F's size without cancellation.
_SHARELESS = 1e-14
#: A part of a whole read as it is.
_PART = Reading(Dimension.NUMBER, above=0.0, most=1.0)


@dataclass(frozen=True)
class ActuatorRate(Limit[AtMost]):
    """Largest rate of every actuator for every task's twist, at every pose.

    Attributes:
        max: length or radians of the actuator, per radian of a task that turns, or per length of a translation.
    """

    max: float

    key: ClassVar[str] = "actuator_rate"
    table: ClassVar[type[AtMost]] = AtMost
    description: ClassVar[str] = "of every actuator for the task's unit twist"
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.NUMBER)}
    order: ClassVar[int] = 1

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether a robot's actuators are known: those of straight legs, or of limbs given joint by joint."""
        return bool(model.legs or model.actuators)

    def check(self, case: LimitedCase) -> None:
        """Refuse a rate that is not positive, and a robot whose rates its motion does not determine.

        Raises:
            CaseError: in the words of a case file.
        """
        super().check(case)
        names = () if case.model.generic is None else case.model.generic.undetermined
        if names:
            fault = "is not for this robot: its actuators can move while its platform stands still, so that its motion"
            raise CaseError("limits.actuator_rate", f"{fault} does not determine the rates of {', '.join(names)}")

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the squared rate of each actuator for each task."""
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
    own = [a for a, each in enumerate(model.actuators) if each.limb == limb]
    if not own:
        return (), SX(0, robot.rates.shape[1])
    values = rates_expression(robot.driven[rows, own], robot.relations[:, own], robot.rates[rows, :])
    return tuple(model.actuators[a].name for a in own), values


def _share(numbers: SX) -> SX:
    """Return a limb's share of F, (1, 1), from F, F without cancellation and the limb's rates, (2 + rates, 1)."""
    rates = numbers[2:]
    squares = sum((rates[i] ** 2 for i in range(rates.numel())), SX(0))
    return squares / (numbers[0] + _SHARELESS * numbers[1])


@dataclass(frozen=True)
class RateShare(Limit[AtMost]):
    """Largest part of F that one limb carries."""

    max: float

    key: ClassVar[str] = "rate_share"
    table: ClassVar[type[Table]] = AtMost
    description: ClassVar[str] = "part of F that one limb carries"
    numbers: ClassVar[Ranges] = {"max": NumberRange(Dimension.NUMBER, most=1.0)}
    order: ClassVar[int] = 1

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the share of each limb in each task's F."""
        robot = pose.robot
        for j, task in enumerate(pose.tasks):
            whose = f" task {task}" if len(pose.tasks) > 1 else ""
            for limb in pose.model.limbs:
                own = [robot.rates[i, j] for i, row in enumerate(pose.model.frame_rows) if row.limb == limb]
                part = Call(Form(_share), ca.vertcat(robot.F[j], robot.magnitude[j], *own))
                yield between(f"rate_share limb {limb}{whose}{pose.where}", part, _PART, "rate_share", upper=self.max)
