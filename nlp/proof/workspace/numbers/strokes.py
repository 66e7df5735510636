"""Limits on telescoping legs over a workspace, from the proved shortest and longest length of each leg."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from .....models import FloatArray
from ....case.task import Sense
from ...statement.claims import Claim, length_claims
from ...statement.fixed_robot import JointErrors, Legs
from ...statement.tolerance import Directions
from ..robot.pose_box import PoseNumbers
from ..robot.posed_robot import steepest
from ..verdict import Outcome, Verdict, slack_of
from .bound_search import Minimum
from .extremes import verdict_of
from .searched import Subject

#: Smallest relative gap of a length, near rounding; and largest gap as a fraction of the margin to a limit.
_FINEST, _SHARE = 1e-11, 0.9

#: Gaps of lengths that are tried in turn for a limit that the triangle inequality leaves open.
_GAPS = (1e-4, 1e-6)

#: Function that proves the smallest or largest length of a leg, by its index, to a smaller gap. With directions, the
#: length is without the part of the errors that is the same at every pose. None without a proof.
Refine = Callable[[int, Sense, float, Directions | None], Verdict | None]


def stroke_verdicts(subject: Subject, lengths: Iterable[Verdict], refine: Refine) -> Iterator[Verdict]:
    """Yield the verdicts on the case's limits on telescoping legs.

    A stroke is the longest minus the shortest length over all poses of the workspace. If a limit lies between the
    bound and the known value, the two lengths are proved with a smaller gap, and yielded again before the stroke.

    Args:
        subject: the robot.
        lengths: verdicts on the smallest and largest length of each leg.
        refine: function that proves a length with a smaller gap.
    """
    known = {(*each.claim.legs, each.sense): each for each in lengths}
    for claim in length_claims(subject.case):
        keys = [(*claim.legs, sense) for sense in (Sense.MIN, Sense.MAX)]
        ends, verdict = _Combined(subject, claim, refine).refined([known[key] for key in keys])
        for key, each in zip(keys, ends, strict=True):
            if each is not known[key]:
                known[key] = each
                yield each
        yield verdict


class _Combined:
    """Linear combination of the shortest and the longest length of a leg.

    Args:
        subject: the robot.
        claim: claim about the combination, with its limit.
        refine: function that proves a length with a smaller gap.
    """

    def __init__(self, subject: Subject, claim: Claim, refine: Refine) -> None:
        self._subject, self._claim, self._refine = subject, claim, refine
        (self._leg,), self._factors, self._sign = claim.legs, np.array(claim.weights[::-1]), claim.sense.sign

    @property
    def _legs(self) -> Legs:
        """Joint centres of the legs, for a robot whose dimensions are fixed."""
        return self._subject.legs

    def refined(self, ends: list[Verdict]) -> tuple[list[Verdict], Verdict]:
        """Return the verdicts on both lengths, with the gap that the limit requires, and on their combination."""
        extreme = self.extreme(ends)
        while (gap := self.finer_gap(extreme, ends)) is not None:
            finer = self.lengths(gap, None)
            if finer is None:
                break
            ends = [_better(one, other) for one, other in zip(ends, finer, strict=True)]
            before, extreme = extreme, self.extreme(ends)
            # The bound may stop improving before a value near the bound is known.
            tighter, nearer = before.bound - extreme.bound, extreme.reached - before.reached
            if not (self._sign * tighter > 0 or self._sign * nearer > 0):
                break
        return ends, self.of_one_robot(extreme, ends)

    def lengths(self, gap: float, about: Directions | None) -> list[Verdict] | None:
        """Return the shortest and the longest length, proved to a gap; None if one cannot be proved."""
        found = [self._refine(self._leg, sense, gap, about) for sense in (Sense.MIN, Sense.MAX)]
        known = [each for each in found if each is not None]
        return known if len(known) == len(found) else None

    def extreme(self, ends: Sequence[Verdict], bound: float | None = None) -> Verdict:
        """Return the verdict on the combination, with the pose of one of the two lengths.

        Its bound is ``bound`` if given; otherwise it follows from the bounds of both lengths.
        """
        if bound is None:
            bound = float(self._factors @ [each.bound for each in ends])
        reached, errors = self.reached(ends)
        reason = next((each.reason for each in ends if each.reason), "")
        reason = reason if math.isfinite(bound) else "no bound of the leg length was proved"
        end = ends[self._claim.sense is Sense.MAX]
        found = Minimum(-self._sign * bound, -self._sign * reached, reason=reason, place=end.place)
        return verdict_of(self._claim, found, end.pose, errors=errors)

    def reached(self, ends: Sequence[Verdict]) -> tuple[float, JointErrors | None]:
        """Return the value of the combination for one robot at the poses of both lengths.

        Also return the joint-centre errors of this robot; None for the nominal robot.
        """
        poses = [each.pose for each in ends if each.pose is not None]
        if not self._subject.case.joint_centre_tolerance or len(poses) < len(ends):
            return float(self._factors @ [each.reached for each in ends]), None
        if self._subject.family is None or self._subject.family.has_following:
            # The two poses belong to different robots.
            return math.nan, None
        # The errors with the largest first-order change.
        at, turned = self.directions(poses)
        errors = np.zeros((2 * len(self._legs.base), 3))
        slopes = self._sign * np.stack([-self._factors @ at, self._factors @ turned])
        e, f = errors[2 * self._leg : 2 * self._leg + 2] = steepest(slopes, self._legs.tolerance)
        moved = self._spans(poses) + [pose.rotation @ f - e for pose in poses]
        return float(self._factors @ np.linalg.norm(moved, axis=1)), self._subject.errors(errors, of_legs=True)

    def _spans(self, poses: Sequence[PoseNumbers]) -> FloatArray:
        """Return the vectors (K, 3) along the leg at poses, in the world frame."""
        return np.array([self._legs.spans(pose.position, pose.rotation)[self._leg] for pose in poses])

    def directions(self, poses: Sequence[PoseNumbers]) -> tuple[FloatArray, FloatArray]:
        """Return the unit directions (K, 3) of the leg at poses, in the world frame and in the platform frame."""
        d = self._spans(poses)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        return d, np.array([n @ pose.rotation for n, pose in zip(d, poses, strict=True)])

    def of_one_robot(self, extreme: Verdict, ends: Sequence[Verdict]) -> Verdict:
        """Improve the bound of an open verdict; return any other verdict unchanged.

        One robot has the same joint-centre errors at the poses of the leg's longest and shortest length, so parts of
        the errors cancel.
        """
        poses = [each.pose for each in ends if each.pose is not None]
        if not self._legs.tolerance or extreme.outcome is not Outcome.OPEN or len(poses) < len(ends):
            return extreme
        about = Directions(extreme.name, *(0.5 * each.sum(axis=0) for each in self.directions(poses)))
        # The part that does not cancel; it is 0 for a stroke.
        left = abs(self._factors.sum()) * self._legs.tolerance * sum(float(np.linalg.norm(each)) for each in about[1:])
        for gap in _GAPS:
            lengths = self.lengths(gap, about) if extreme.outcome is Outcome.OPEN else None
            if lengths is None:
                break
            bound = float(self._factors @ [each.bound for each in lengths]) + self._sign * left
            if math.isfinite(bound) and self._sign * bound < self._sign * extreme.bound:
                extreme = self.extreme(ends, bound)
        return extreme

    def finer_gap(self, extreme: Verdict, ends: Sequence[Verdict]) -> float | None:
        """Return the gap of squared lengths that decides the limit.

        The result is None if the limit is decided already, or if no gap can decide it.
        """
        if extreme.outcome is not Outcome.OPEN or not math.isfinite(extreme.bound):
            return None
        # Each length is the length of its worst robot here, as in the bound.
        reached, limit = float(self._factors @ [each.reached for each in ends]), self._claim.limit or 0.0
        room = self._sign * (limit - reached) + slack_of(limit) / 2
        # The relative gap of a length is half the gap of its square.
        gap = _SHARE * 2 * room / float(np.abs(self._factors).sum()) / ends[1].bound
        return gap if gap >= _FINEST else None


def _better(one: Verdict, finer: Verdict) -> Verdict:
    """Return the better of two verdicts on a length, with the boxes and seconds of both searches."""
    sign = one.sense.sign
    best = finer if sign * finer.bound <= sign * one.bound else replace(finer, bound=one.bound)
    boxes, seconds = one.boxes + finer.boxes, one.seconds + finer.seconds
    return replace(best, claim=one.claim, boxes=boxes, seconds=seconds, outcome=one.outcome)
