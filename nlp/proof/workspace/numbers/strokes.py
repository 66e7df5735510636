"""Limits on telescoping legs over a workspace, from the proven lengths of each leg."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from casadi import SX

from .....models import FloatArray
from ....case.limits.constraint import LENGTH
from ....case.limits.legs import Actuator
from ....case.task import Sense
from ...statement.claims import Claim
from ...statement.machine import JointErrors, Legs
from ...statement.tolerance import Directions
from ..robot.pose_box import PoseNumbers
from ..tolerance.leg_errors import along, spans
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
    legs = subject.legs
    limit = next((each for each in subject.case.limits if isinstance(each, Actuator)), None)
    found, added = list(extremes), list[Extreme]()
    if limit is None:
        return found
    kinds = (
        ("actuator.stroke_max", Sense.MAX, limit.stroke_max, (-1.0, 1.0)),
        ("actuator.dead_length", Sense.MIN, limit.dead_length, (2.0, -1.0)),
    )
    place = {(each.name, each.sense): k for k, each in enumerate(found)}
    for i, leg in enumerate(subject.case.model.legs):
        own = [place[f"leg_length limb {leg.name}", sense] for sense in (Sense.MIN, Sense.MAX)]
        for key, sense, value, factors in kinds:
            if value is None:
                continue
            claim = Claim(f"{key} limb {leg.name}", sense, SX(), LENGTH, key, value)
            number = _Combined(claim, legs, i, np.array(factors), refine)
            ends, extreme = number.refined([found[k] for k in own])
            for k, each in zip(own, ends, strict=True):
                found[k] = each
            errors, centres = subject.shown(extreme.errors)
            added.append(replace(extreme, errors=errors, centres=centres))
    return [*found, *added]


class _Combined(NamedTuple):
    """A number of a leg, its shortest and its longest length times factors.

    Attributes:
        claim: the number, with its limit.
        legs: joint centres, with their tolerance.
        leg: index of the leg.
        factors: (2,).
        refine: proves a length more finely.
    """

    claim: Claim
    legs: Legs
    leg: int
    factors: FloatArray
    refine: Refine

    @property
    def sign(self) -> float:
        """1 for a largest value, -1 for a smallest one."""
        return 1.0 if self.claim.sense is Sense.MAX else -1.0

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
        base, platform = np.zeros_like(self.legs.base), np.zeros_like(self.legs.base)
        at, turned = self.directions(poses)
        base[self.leg], platform[self.leg] = -self.sign * self.factors @ at, self.sign * self.factors @ turned
        errors = along(self.legs, np.eye(3), base, platform)
        machine = errors.applied(self.legs)
        return float(self.factors @ [np.linalg.norm(spans(machine, pose)[self.leg]) for pose in poses]), errors

    def directions(self, poses: Sequence[PoseNumbers]) -> tuple[FloatArray, FloatArray]:
        """Return the unit directions (K, 3) of the leg at poses, in the world frame and in that of the platform."""
        d = np.array([spans(self.legs, pose)[self.leg] for pose in poses])
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
    sign = 1.0 if one.sense is Sense.MAX else -1.0
    best = finer if sign * finer.bound <= sign * one.bound else replace(finer, bound=one.bound)
    return replace(best, boxes=one.boxes + finer.boxes, seconds=one.seconds + finer.seconds, outcome=one.outcome)
