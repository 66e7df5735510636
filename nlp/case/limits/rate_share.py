"""A limit on the part of F that one limb carries: the squared rates of its rows over F, for every task and pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca
from casadi import SX

from ....models import Dimension
from ..table import Table
from .constraint import BoundedConstraint, Reading, between
from .form import Call, Form
from .interval import AtMost
from .limit import Limit, LimitedCase, PosedRobot, Written

#: Keeps a limb's share of F defined where F is 0, in parts of F's size without cancellation.
_SHARELESS = 1e-14
#: A part of a whole read as it is.
_PART = Reading(Dimension.NUMBER, above=0.0, most=1.0)


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
    order: ClassVar[int] = 1

    @classmethod
    def from_table(cls, written: Written[AtMost]) -> Self:
        """Return the limit that a case file writes."""
        return cls(written.value.max)

    def check(self, case: LimitedCase) -> None:
        """Refuse a part that is not above 0 and at most 1.

        Raises:
            CaseError: in the words of a case file.
        """
        case.check_number("rate_share.max", self.max, Dimension.NUMBER, most=1.0)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the share of each limb in each task's F."""
        robot = pose.robot
        for j, task in enumerate(pose.tasks):
            whose = f" task {task}" if len(pose.tasks) > 1 else ""
            for limb in pose.model.limbs:
                own = [robot.rates[i, j] for i, row in enumerate(pose.model.frame_rows) if row.limb == limb]
                part = Call(Form(_share), ca.vertcat(robot.F[j], robot.magnitude[j], *own))
                yield between(f"rate_share limb {limb}{whose}{pose.where}", part, _PART, "rate_share", upper=self.max)
