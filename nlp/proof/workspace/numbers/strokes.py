"""Limits on telescoping legs over a workspace, from the proven lengths of each leg."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from ....case.task import Sense
from ...statement.claims import Claim, length_claims
from ...statement.machine import JointErrors, Legs
from ...statement.tolerance import Directions
from ..robot.pose_box import PoseNumbers
from ..robot.posed_robot import steepest
from ..verdict import Outcome
from .bound_search import Minimum
from .extremes import Extreme, extreme_of, slack_of
from .searched import Subject

#: Smallest gap of a length, as a part of it, and part of the room that lengths may leave: that of rounding.
_FINEST, _SHARE = 1e-11, 0.9

#: Gaps of lengths with which a limit is tried that the triangle inequality leaves open.
_GAPS = (1e-4, 1e-6)

#: Proves the smallest or largest length of a leg, by its index, to a finer gap; with directions, the length less the
#: part of its errors that is the same at every pose. None where it cannot.
Refine = Callable[[int, Sense, float, Directions | None], Extreme | None]


def with_strokes(subject: Subject, extremes: Sequence[Extreme], refine: Refine) -> list[Extreme]:
    """Return extremes, and after them those of the case's limits on telescoping legs.

    A stroke is the longest length less the shortest, at whichever poses: both are poses of the workspace. Where a limit
    lies between its bound and the value reached, the two lengths are proved more finely, and stand in the place of
    those given.

    Args:
        subject: the robot.
        extremes: among them the smallest and the largest length of each leg.
        refine: proves a length more finely.
    """
    found, added = list(extremes), list[Extreme]()
    place = {(each.name, each.sense): k for k, each in enumerate(found)}
    for claim in length_claims(subject.case):
        (leg,) = claim.legs
        name = f"leg_length limb {subject.case.model.legs[leg].name}"
        own = [place[name, sense] for sense in (Sense.MIN, Sense.MAX)]
        number = _Combined(subject, subject.legs, claim, leg, np.array(claim.weights[::-1]), refine)
        ends, extreme = number.refined([found[k] for k in own])
        for k, each in zip(own, ends, strict=True):
            found[k] = each
        added.append(extreme)
    return [*found, *added]


class _Combined(NamedTuple):
    """A number of a leg, its shortest and its longest length times factors.

    Attributes:
        subject: the robot.
        legs: joint centres, with their tolerance.
        claim: the number, with its limit.
        leg: index of the leg.
        factors: (2,).
        refine: proves a length more finely.
    """

    subject: Subject
    legs: Legs
    claim: Claim
    leg: int
    factors: FloatArray
    refine: Refine

    @property
    def sign(self) -> float:
        """1 for a largest value, -1 for a smallest one."""
        return self.claim.sense.sign

    def refined(self, ends: list[Extreme]) -> tuple[list[Extreme], Extreme]:
        """Return the two lengths as fine as the limit needs, and the extreme of the number."""
        extreme = self.extreme(ends)
        while (gap := self.finer_gap(extreme, ends)) is not None:
            finer = self.lengths(gap, None)
            if finer is None:
                break
            ends = [_better(one, other) for one, other in zip(ends, finer, strict=True)]
            before, extreme = extreme, self.extreme(ends)
            if extreme.bound == before.bound:
                break
        return ends, self.of_one_machine(extreme, ends)

    def lengths(self, gap: float, about: Directions | None) -> list[Extreme] | None:
        """Return the shortest and the longest length, proved to a gap; None where one cannot."""
        found = [self.refine(self.leg, sense, gap, about) for sense in (Sense.MIN, Sense.MAX)]
        known = [each for each in found if each is not None]
        return known if len(known) == len(found) else None

    def extreme(self, ends: Sequence[Extreme], bound: float | None = None) -> Extreme:
        """Return the extreme from the shortest and the longest length, or from a bound, at the pose of one of them."""
        if bound is None:
            bound = float(self.factors @ [each.bound for each in ends])
        reached, errors = self.reached(ends)
        reason = next((each.reason for each in ends if each.reason), "")
        reason = reason if math.isfinite(bound) else "the leg's lengths are not bounded"
        found = Minimum(-self.sign * bound, -self.sign * reached, reason=reason)
        return extreme_of(self.claim, found, ends[self.claim.sense is Sense.MAX].pose, errors=errors)

    def reached(self, ends: Sequence[Extreme]) -> tuple[float, JointErrors | None]:
        """Return the value from the two lengths of one machine, and its errors; of the design without a tolerance."""
        poses = [each.pose for each in ends if each.pose is not None]
        if not self.legs.tolerance or len(poses) < len(ends):
            return float(self.factors @ [each.reached for each in ends]), None
        # The errors are along the change of the number, to first order.
        at, turned = self.directions(poses)
        errors = np.zeros((2 * len(self.legs.base), 3))
        slopes = self.sign * np.stack([-self.factors @ at, self.factors @ turned])
        e, f = errors[2 * self.leg : 2 * self.leg + 2] = steepest(slopes, self.legs.tolerance)
        moved = self._spans(poses) + [pose.rotation @ f - e for pose in poses]
        return float(self.factors @ np.linalg.norm(moved, axis=1)), self.subject.errors(errors)

    def _spans(self, poses: Sequence[PoseNumbers]) -> FloatArray:
        """Return the vectors (K, 3) along the leg at poses, in the world frame."""
        return np.array([self.legs.spans(pose.position, pose.rotation)[self.leg] for pose in poses])

    def directions(self, poses: Sequence[PoseNumbers]) -> tuple[FloatArray, FloatArray]:
        """Return the unit directions (K, 3) of the leg at poses, in the world frame and in that of the platform."""
        d = self._spans(poses)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        return d, np.array([n @ pose.rotation for n, pose in zip(d, poses, strict=True)])

    def of_one_machine(self, extreme: Extreme, ends: Sequence[Extreme]) -> Extreme:
        """Return an extreme that is open with a bound for machines whose errors are the same at both poses."""
        poses = [each.pose for each in ends if each.pose is not None]
        if not self.legs.tolerance or extreme.outcome is not Outcome.OPEN or len(poses) < len(ends):
            return extreme
        about = Directions(extreme.name, *(0.5 * each.sum(axis=0) for each in self.directions(poses)))
        # What does not cancel: nothing in a stroke.
        left = abs(self.factors.sum()) * self.legs.tolerance * sum(float(np.linalg.norm(each)) for each in about[1:])
        for gap in _GAPS:
            lengths = self.lengths(gap, about) if extreme.outcome is Outcome.OPEN else None
            if lengths is None:
                break
            bound = float(self.factors @ [each.bound for each in lengths]) + self.sign * left
            if math.isfinite(bound) and self.sign * bound < self.sign * extreme.bound:
                extreme = self.extreme(ends, bound)
        return extreme

    def finer_gap(self, extreme: Extreme, ends: Sequence[Extreme]) -> float | None:
        """Return the gap of squared lengths that decides the limit; None where it is decided, or cannot be."""
        if extreme.outcome is not Outcome.OPEN or not math.isfinite(extreme.bound):
            return None
        # Each length is that of its own worst machine here, as in the bound.
        reached, limit = float(self.factors @ [each.reached for each in ends]), self.claim.limit or 0.0
        room = self.sign * (limit - reached) + slack_of(limit) / 2
        # A length is off by half the gap of its square.
        gap = _SHARE * 2 * room / float(np.abs(self.factors).sum()) / ends[1].bound
        return gap if gap >= _FINEST else None


def _better(one: Extreme, finer: Extreme) -> Extreme:
    """Return a length that was proved more finely, with the boxes and seconds of both proofs."""
    sign = one.sense.sign
    best = finer if sign * finer.bound <= sign * one.bound else replace(finer, bound=one.bound)
    return replace(best, boxes=one.boxes + finer.boxes, seconds=one.seconds + finer.seconds, outcome=one.outcome)
