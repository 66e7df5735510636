"""Verdicts on claims about every pose of a domain: a box of poses, or a tool path."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import NamedTuple

from ....models import Dimension, FloatArray
from ...case.motors import Motor
from ...case.task import Sense
from ...evidence.singularities import SingularityKind
from ..statement.claims import RANKS, Claim, ClaimKind
from ..statement.machine import JointErrors
from .robot.path_cover import Place
from .robot.pose_box import PoseNumbers

#: Part of a limit by which a value may be beyond it and still count as on it: rounding.
_ON_LIMIT = 1e-9
#: Reason for a structure that is singular at every pose.
EVERYWHERE = SingularityKind.ARCHITECTURE.clause


class Outcome(enum.Enum):
    """Outcome of a claim about every pose; each value is the word in results."""

    PROVED = "proved"
    REFUTED = "refuted"
    OPEN = "open"


class Fault(NamedTuple):
    """A point of a path that refutes a limit: its place, the value, and the pose."""

    place: Place
    value: float
    pose: PoseNumbers


@dataclass(frozen=True, eq=False)
class Verdict:
    """Verdict on one claim about every pose of a domain.

    Attributes:
        claim: the claim: a rank, or the smallest or the largest value of a number, with its limit.
        outcome: outcome of the rank or the limit; of a number without a limit, whether the requested gap was reached.
        bound: proven bound of the number: no pose has a smaller, or a larger, value. Radians for angles; infinite where
            nothing is proved; NaN of a rank.
        reached: smallest or largest known value of the number; NaN without one, and of a rank.
        pose: pose with this value. Of a rank: a singular pose, or the centre of the widest open box. None without one.
        reason: reason for an open outcome, or how a singular pose was computed; else empty.
        boxes: number of examined boxes.
        open: number of open boxes at the end.
        share: volume of the open boxes of a rank, as a part of the domain's.
        seconds: wall time.
        place: place of the pose on a path; None on a box of poses.
        errors: joint-centre errors of the robot with this value, or of the singular one; None for the exact robot.
        sides: (2, 6) coordinates of two poses, or (2, 1) places of a path, segment plus parameter, at which the
            determinant of the rows is proved to have opposite signs, where a rank is refuted so; else None.
        fault: first known point of a path that refutes the limit; None where it is not before ``place``.
    """

    claim: Claim
    outcome: Outcome
    bound: float = math.nan
    reached: float = math.nan
    pose: PoseNumbers | None = None
    reason: str = ""
    boxes: int = 0
    open: int = 0
    share: float = 0.0
    seconds: float = 0.0
    place: Place | None = None
    errors: JointErrors | None = None
    sides: FloatArray | None = None
    fault: Fault | None = None

    @property
    def name(self) -> str:
        """Name of the claim, in the words of a case."""
        return self.claim.name

    @property
    def sense(self) -> Sense:
        """Whether the claim is about the smallest or the largest value."""
        return self.claim.sense

    @property
    def dimension(self) -> Dimension:
        """Dimension of the number."""
        return self.claim.reading.dimension

    @property
    def key(self) -> str:
        """Dotted key, below ``limits``, of the limit in the case; empty without one."""
        return self.claim.key

    @property
    def limit(self) -> float | None:
        """The limit, radians for angles; None without one."""
        return None if self.claim.limit is None else self.claim.reading.from_value(self.claim.limit)

    @property
    def motor(self) -> Motor | None:
        """Actuator and its quantity, of claims about actuators; else None."""
        return self.claim.motor

    @property
    def is_rank(self) -> bool:
        """Whether the claim is about a rank."""
        return self.claim.kind is ClaimKind.RANK

    @property
    def fails(self) -> bool:
        """Whether a rank or a limit is not proved; a number without a limit is information."""
        return (self.is_rank or self.claim.limit is not None) and self.outcome is not Outcome.PROVED

    @property
    def first_fault(self) -> Fault | None:
        """First known point of a path that refutes the claim; None of other outcomes, and of a box of poses."""
        if self.outcome is not Outcome.REFUTED:
            return None
        at = None if self.place is None or self.pose is None else Fault(self.place, self.reached, self.pose)
        return self.fault or at


def slack_of(limit: float) -> float:
    """Return how far a value may be beyond a limit and still count as on it: a part of the limit, for rounding.

    It is a part of the limit and not of the value: a value far from its limit decides it without any slack.
    """
    return _ON_LIMIT * abs(limit)


def not_judged(name: str, reason: str) -> Verdict:
    """Return the open verdict on a rank where no search was made."""
    return Verdict(RANKS[name], Outcome.OPEN, reason=reason, open=1, share=1.0)
