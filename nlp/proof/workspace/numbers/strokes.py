"""Limits on telescoping legs over a workspace, from the proven lengths of each leg."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .....models import Dimension, FloatArray
from ....case.limits.legs import Actuator
from ....case.task import Sense
from ...statement.machine import Legs
from ...statement.tolerance import Directions
from ..robot.pose_box import PoseNumbers
from ..tolerance.leg_errors import along, spans
from ..verdict import Outcome
from .extremes import Extreme, slack_of
from .searched import Subject

#: Smallest gap of a length, as a part of it, and part of the room that lengths may leave: that of rounding.
_FINEST, _SHARE = 1e-11, 0.9

#: Gaps of lengths with which a limit is tried that the triangle inequality leaves open.
_GAPS = (1e-4, 1e-6)

#: Proves the smallest or largest length of a leg, by its index, to a finer gap; with directions, the length less the
#: part of its errors that is the same at every pose. None where it cannot.
Refine = Callable[[int, Sense, float, Directions | None], Extreme | None]


class _Kind(NamedTuple):
    """A number made from the lengths of a leg: ``long * longest + short * shortest``."""

    key: str
    sense: Sense
    limit: float
    long: float
    short: float


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
    if limit is None or legs is None:
        return found
    kinds = [
        _Kind(f"actuator.{name}", sense, value, long, short)
        for name, sense, value, long, short in (
            ("stroke_max", Sense.MAX, limit.stroke_max, 1.0, -1.0),
            ("dead_length", Sense.MIN, limit.dead_length, -1.0, 2.0),
        )
        if value is not None
    ]
    place = {(each.name, each.sense): k for k, each in enumerate(found)}
    for i, leg in enumerate(subject.case.model.legs):
        short, long = (place[f"leg_length limb {leg.name}", sense] for sense in (Sense.MIN, Sense.MAX))
        for kind in kinds:
            name = f"{kind.key} limb {leg.name}"
            extreme = _of_lengths(name, kind, legs, i, found[short], found[long])
            while (gap := _finer_gap(kind, extreme, found[short], found[long])) is not None:
                finer = [refine(i, sense, gap, None) for sense in (Sense.MIN, Sense.MAX)]
                if finer[0] is None or finer[1] is None:
                    break
                found[short], found[long] = _better(found[short], finer[0]), _better(found[long], finer[1])
                before, extreme = extreme, _of_lengths(name, kind, legs, i, found[short], found[long])
                if extreme.bound == before.bound:
                    break
            extreme = _of_one_machine(kind, legs, i, extreme, (found[short], found[long]), refine)
            errors, centres = subject.shown(extreme.errors)
            added.append(replace(extreme, errors=errors, centres=centres))
    return [*found, *added]


def _of_one_machine(
    kind: _Kind, legs: Legs, i: int, extreme: Extreme, ends: tuple[Extreme, Extreme], refine: Refine
) -> Extreme:
    """Return an extreme that is open with a bound for machines whose errors are the same at both poses.

    Args:
        kind: the number.
        legs: joint centres, with their tolerance.
        i: index of the leg.
        extreme: with the bound of the triangle inequality.
        ends: the shortest and the longest length.
        refine: proves a length more finely.
    """
    poses = [each.pose for each in ends if each.pose is not None]
    if not legs.tolerance or extreme.outcome is not Outcome.OPEN or len(poses) < 2:
        return extreme
    at = [_directions(legs, pose)[i] for pose in poses]
    turned = [n @ pose.rotation for n, pose in zip(at, poses, strict=True)]
    about = Directions(extreme.name, 0.5 * (at[0] + at[1]), 0.5 * (turned[0] + turned[1]))
    sign = 1.0 if kind.sense is Sense.MAX else -1.0
    # What does not cancel: nothing in a stroke.
    left = abs(kind.long + kind.short) * legs.tolerance * sum(float(np.linalg.norm(each)) for each in about[1:])
    for gap in _GAPS:
        short, long = (refine(i, sense, gap, about) for sense in (Sense.MIN, Sense.MAX))
        if short is None or long is None:
            break
        bound = kind.long * long.bound + kind.short * short.bound + sign * left
        if math.isfinite(bound) and sign * bound < sign * extreme.bound:
            extreme = replace(extreme, bound=bound)
        if sign * (extreme.bound - kind.limit) <= slack_of(kind.limit):
            return replace(extreme, outcome=Outcome.PROVED, reason="")
    return extreme


def _directions(legs: Legs, pose: PoseNumbers) -> FloatArray:
    """Return the unit directions (6, 3) of the legs at a pose."""
    d = spans(legs, pose)
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def _finer_gap(kind: _Kind, extreme: Extreme, short: Extreme, long: Extreme) -> float | None:
    """Return the gap of squared lengths that decides a limit; None where it is decided, or cannot be."""
    if extreme.outcome is not Outcome.OPEN or not math.isfinite(extreme.bound):
        return None
    sign = 1.0 if kind.sense is Sense.MAX else -1.0
    # Each length is that of its own worst machine here, as in the bound.
    reached = kind.long * long.reached + kind.short * short.reached
    room = sign * (kind.limit - reached) + slack_of(kind.limit) / 2
    # A length is off by half the gap of its square.
    gap = _SHARE * 2 * room / (abs(kind.long) + abs(kind.short)) / long.bound
    return gap if gap >= _FINEST else None


def _better(one: Extreme, finer: Extreme) -> Extreme:
    """Return a length that was proved more finely, with the boxes and seconds of both proofs."""
    sign = 1.0 if one.sense is Sense.MAX else -1.0
    best = finer if sign * finer.bound <= sign * one.bound else replace(finer, bound=one.bound)
    return replace(best, boxes=one.boxes + finer.boxes, seconds=one.seconds + finer.seconds, outcome=one.outcome)


def _of_lengths(name: str, kind: _Kind, legs: Legs, i: int, short: Extreme, long: Extreme) -> Extreme:
    """Return the extreme of a number made from two lengths, with the pose of one of them."""
    sign = 1.0 if kind.sense is Sense.MAX else -1.0
    bound = kind.long * long.bound + kind.short * short.bound
    reached, errors = kind.long * long.reached + kind.short * short.reached, None
    if legs.tolerance and short.pose is not None and long.pose is not None:
        # One machine has both lengths: its errors are along the change of the number, to first order.
        at = [_directions(legs, pose) for pose in (long.pose, short.pose)]
        turned = [n @ pose.rotation for n, pose in zip(at, (long.pose, short.pose), strict=True)]
        base, platform = np.zeros_like(legs.base), np.zeros_like(legs.base)
        base[i] = -sign * (kind.long * at[0][i] + kind.short * at[1][i])
        platform[i] = sign * (kind.long * turned[0][i] + kind.short * turned[1][i])
        errors = along(legs, np.eye(3), base, platform)
        machine = errors.applied(legs)
        lengths = [float(np.linalg.norm(spans(machine, pose)[i])) for pose in (long.pose, short.pose)]
        reached = kind.long * lengths[0] + kind.short * lengths[1]
    slack, outcome = slack_of(kind.limit), Outcome.OPEN
    if sign * (reached - kind.limit) > slack:
        outcome = Outcome.REFUTED
    elif math.isfinite(bound) and sign * (bound - kind.limit) <= slack:
        outcome = Outcome.PROVED
    reason = short.reason or long.reason or "the limit is closer to the value reached than bounds can tell"
    if not math.isfinite(bound):
        reason = "the leg's lengths are not bounded"
    return Extreme(
        name=name,
        sense=kind.sense,
        dimension=Dimension.LENGTH,
        key=kind.key,
        limit=kind.limit,
        bound=bound,
        reached=reached,
        pose=(long if kind.sense is Sense.MAX else short).pose,
        outcome=outcome,
        boxes=0,
        seconds=0.0,
        reason=reason if outcome is Outcome.OPEN else "",
        errors=errors,
    )
