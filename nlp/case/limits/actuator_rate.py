"""A limit on the rates of actuators for the task's motion.

A straight leg's rate is the work rate of its force. The rates of a limb given joint by joint are those that leave least
of the part of the task's twist that the limb resists. The constraint is on ``qdot^2``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

from casadi import SX

from ....models import Dimension, Model, WrenchKind, rates_expression
from ...errors import CaseError
from .constraint import SQUARED_NUMBER, BoundedConstraint, between
from .interval import AtMost
from .limit import Limit, LimitedCase, PosedRobot, Written


class _Rates(NamedTuple):
    """Rates (n, tasks) of actuators by name."""

    names: tuple[str, ...]
    values: SX


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
    order: ClassVar[int] = 1

    @classmethod
    def is_for(cls, model: Model) -> bool:
        """Return whether a robot's actuators are known: those of straight legs, or of limbs given joint by joint."""
        return bool(model.legs or model.actuators)

    @classmethod
    def from_table(cls, written: Written[AtMost]) -> Self:
        """Return the limit that a case file writes."""
        return cls(written.value.max)

    def check(self, case: LimitedCase) -> None:
        """Refuse a rate that is not positive, and a robot whose rates its motion does not determine.

        Raises:
            CaseError: in the words of a case file.
        """
        case.check_number("actuator_rate.max", self.max, Dimension.NUMBER)
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


def _rates(pose: PosedRobot, limb: str) -> _Rates:
    """Return the rates of the actuators of a limb for every task."""
    model, robot = pose.model, pose.robot
    rows = [i for i, row in enumerate(model.frame_rows) if row.limb == limb]
    if model.legs:
        rows = [i for i in rows if model.frame_rows[i].kind is WrenchKind.FORCE]
        return _Rates((limb,), robot.rates[rows[:1], :])
    own = [a for a, each in enumerate(model.actuators) if each.limb == limb]
    if not own:
        return _Rates((), SX(0, robot.rates.shape[1]))
    values = rates_expression(robot.driven[rows, own], robot.relations[:, own], robot.rates[rows, :])
    return _Rates(tuple(model.actuators[a].name for a in own), values)
