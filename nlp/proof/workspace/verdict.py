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
from ..statement.fixed_robot import JointErrors
from .robot.path_cover import Place
from .robot.pose_box import PoseNumbers

#: Relative violation of a limit that counts as rounding.
_ON_LIMIT = 1e-9
#: Reason for a structure that is singular at every pose.
EVERYWHERE = SingularityKind.ARCHITECTURE.clause


class Outcome(enum.Enum):
    """Outcome of a claim about every pose; the values are the words in results."""

    PROVED = "proved"
    REFUTED = "refuted"
    OPEN = "open"


class Fault(NamedTuple):
    """Point of a tool path at which a quantity violates its limit.

    Attributes:
        place: place on the path: segment and parameter.
        value: value of the quantity.
        pose: pose of the platform.
    """

    place: Place
    value: float
    pose: PoseNumbers


@dataclass(frozen=True, eq=False)
class Verdict:
    """Verdict on one claim about every pose of a domain.

    Attributes:
        claim: the claim: a rank, or the smallest or largest value of a quantity, with its limit.
        outcome: outcome for the rank or the limit; for a quantity without a limit, whether the gap was reached.
        bound: proved bound of the quantity over all poses. Radians for angles; infinite if nothing is proved; NaN for a
            rank.
        reached: smallest or largest known value of the quantity; NaN for a rank, and if no value is known.
        pose: pose at which the quantity has the value ``reached``. For a rank: a singular pose, or the centre of the
            widest open box. None without a known pose.
        reason: reason for an open outcome, or method that computed a singular pose; otherwise empty.
        boxes: number of examined boxes.
        open: number of open boxes at the end.
        share: fraction of the domain's volume that is in open boxes, for a rank.
        seconds: wall time.
        place: place of the pose on a path; None over a box of poses.
        errors: joint-centre errors of the robot with the value ``reached``, or of the singular robot; None for the
            nominal robot.
        sides: proof of a refuted rank: two poses (2, 6), or two places on a path (2, 1) (segment plus parameter), at
            which the determinant provably has opposite signs. None without such a proof.
        fault: first known point of a path that refutes the limit; None if no such point precedes ``place``.
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
        """Name of the claim, in the terms of case files."""
        return self.claim.name

    @property
    def sense(self) -> Sense:
        """Whether the claim is about the smallest or the largest value."""
        return self.claim.sense

    @property
    def dimension(self) -> Dimension:
        """Dimension of the quantity."""
        return self.claim.reading.dimension

    @property
    def key(self) -> str:
        """Dotted key of the limit below ``limits`` in the case; empty without a limit."""
        return self.claim.key

    @property
    def limit(self) -> float | None:
        """Value of the limit, radians for angles; None without a limit."""
        return None if self.claim.limit is None else self.claim.reading.from_value(self.claim.limit)

    @property
    def motor(self) -> Motor | None:
        """Actuator and its quantity, for a claim about an actuator; None for other claims."""
        return self.claim.motor

    @property
    def is_rank(self) -> bool:
        """Whether the claim is about a rank."""
        return self.claim.kind is ClaimKind.RANK

    @property
    def fails(self) -> bool:
        """Whether a rank or a limit is not proved. Quantities without a limit do not count."""
        return (self.is_rank or self.claim.limit is not None) and self.outcome is not Outcome.PROVED

    @property
    def first_fault(self) -> Fault | None:
        """First known point of a path that refutes the claim; None for other outcomes, and over a box of poses."""
        if self.outcome is not Outcome.REFUTED:
            return None
        at = None if self.place is None or self.pose is None else Fault(self.place, self.reached, self.pose)
        return self.fault or at


def slack_of(limit: float) -> float:
    """Return the violation of a limit that counts as rounding.

    The slack is relative to the limit, not to the value, because a value far from the limit needs no slack.
    """
    return _ON_LIMIT * abs(limit)


def not_judged(name: str, reason: str) -> Verdict:
    """Return an open verdict on a rank that was not searched, with the reason."""
    return Verdict(RANKS[name], Outcome.OPEN, reason=reason, open=1, share=1.0)
