"""The worst machine within a tolerance on joint centres, for each number that a workspace is judged by.

A base joint centre is off by e, and a platform joint centre by f in the world frame, each up to the tolerance t.
With d the vector of a leg, l its length and n = d / l:

* a length changes by at most 2 t, where e and f are along the leg: the triangle inequality is met;
* the angle of a leg to a fixed axis changes by at most ``asin(2 t / l)``, where the leg turns in the plane of both;
* the work rate ``w . n`` of a leg in a twist (omega, v) has the derivatives ``(w_b - n n.w_b) / l`` with respect to f
  and ``-(w_a - n n.w_a) / l`` with respect to e, with w_a and w_b the velocities of the platform at the platform joint
  and, extended, at the base joint. On the way from the exact machine l is at least l - 2 t, n is off by at most
  ``2 t / (l - 2 t)``, and w by ``|omega| t``. So the rate changes by at most

      t ((|w_a x n| + |w_b x n| + (|w_a| + |w_b|) 2 t / (l - 2 t) + 2 |omega| t) / (l - 2 t).

The errors of different legs are independent, so that sums and shares of squared rates are worst where every rate is.
The mounting axes of joints are those of the design.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray, RobotInstance
from ....statement.machine import INSIDE, LEGS, JointErrors, Legs
from ....statement.tolerance_bound import Worst
from ...robot.pose_box import PoseNumbers

#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12


class Spans(NamedTuple):
    """Legs at a pose.

    Attributes:
        d: (6, 3) vectors from base to platform joint in the world frame.
        l: (6,) their lengths.
        n: (6, 3) their directions.
    """

    d: FloatArray
    l: FloatArray  # noqa: E741 - the symbol of a length in the formulas above
    n: FloatArray


def spans(legs: Legs, pose: PoseNumbers) -> Spans:
    """Return the legs of an exact machine at a pose."""
    d = pose.position + legs.platform @ pose.rotation.T - legs.base
    lengths = np.linalg.norm(d, axis=1)
    return Spans(d, lengths, d / lengths[:, None])


def along(legs: Legs, pose: PoseNumbers, base: FloatArray, platform: FloatArray) -> JointErrors:
    """Return errors as large as the tolerance along vectors (6, 3) in the world frame, none for a vector of zero."""
    size = legs.tolerance * INSIDE
    return JointErrors(size * unit(base), size * unit(platform) @ pose.rotation)


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (6, 3) of length 1, or zero."""
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, sizes, out=np.zeros_like(vectors), where=sizes > 0))


def of_leg(i: int, vector: FloatArray) -> FloatArray:
    """Return vectors (6, 3) of which only that of a leg is not zero."""
    found = np.zeros((LEGS, 3))
    found[i] = vector
    return found


def worst_length(legs: Legs, i: int, sign: float) -> Worst:
    """Return the longest (sign 1) or the shortest (sign -1) length of a leg."""

    def errors(pose: PoseNumbers) -> JointErrors:
        n = of_leg(i, sign * spans(legs, pose).n[i])
        return along(legs, pose, -n, n)

    def value(machine: Legs, pose: PoseNumbers) -> float:
        return float(spans(machine, pose).l[i])

    return Worst(errors, value, allowance=2 * legs.tolerance, least=0.0)


class Directions(NamedTuple):
    """Vectors that stand for a leg's direction over a workspace: (3,) in the world frame, and in the platform frame.

    The last attribute is the name of the claim that they serve.
    """

    base: FloatArray
    platform: FloatArray
    claim: str


def length_beside(legs: Legs, i: int, robot: RobotInstance, sign: float, shortest: float, about: Directions) -> SX:
    """Return a bound (1, 1) of the length of a leg less ``f.c_p - e.c_b``, which is the same at every pose.

    Errors change a length by ``f.(R' n) - e.n`` and by at most ``(2 t)^2 / 2 (l - 2 t)`` more, never less. In the
    difference of two lengths of one machine the part with the fixed vectors c_p and c_b cancels, and the rest is small
    where the direction of the leg changes little.

    Args:
        legs: joint centres, with their tolerance.
        i: index of the leg.
        robot: the exact machine in symbols of the pose.
        sign: 1 for an upper bound, -1 for a lower one.
        shortest: no leg of the exact machine is shorter over the workspace; more than twice the tolerance.
        about: c_b and c_p.
    """
    d, t = robot.legs[i].span, legs.tolerance
    length = ca.norm_2(d)
    off = ca.norm_2(d / length - SX(about.base.tolist()))
    off += ca.norm_2(robot.rotation.T @ d / length - SX(about.platform.tolist()))
    bend = 2 * t**2 / (shortest - 2 * t) if sign > 0 else 0.0
    return length + sign * (t * off + bend) * _OUTWARDS


class LegAngle(NamedTuple):
    """The angle of a leg to an axis: index of the leg, unit axis (3,), and whether it turns with the platform."""

    leg: int
    axis: FloatArray
    on_platform: bool

    def world(self, pose: PoseNumbers) -> FloatArray:
        """Return the axis in the world frame."""
        return np.asarray(pose.rotation @ self.axis if self.on_platform else self.axis)

    def value(self, machine: Legs, pose: PoseNumbers) -> float:
        """Return the angle of a machine, radians."""
        axis, d = self.world(pose), spans(machine, pose).d[self.leg]
        return math.atan2(float(np.linalg.norm(np.cross(axis, d))), float(axis @ d))


def worst_angle(legs: Legs, angle: LegAngle, robot: RobotInstance, sign: float, *, is_cosine: bool) -> Worst:
    """Return the largest (sign 1) or smallest (sign -1) angle of a leg to an axis.

    Args:
        legs: joint centres, with their tolerance.
        angle: the angle.
        robot: the exact machine in symbols of the pose.
        sign: which end is meant.
        is_cosine: whether minus the cosine is bounded, for the largest angle, or the angle itself.
    """
    off, d = 2 * legs.tolerance, robot.legs[angle.leg].span
    axis = SX(angle.axis.tolist())
    axis = robot.rotation @ axis if angle.on_platform else axis
    square, across, dot = ca.sumsqr(d), ca.norm_2(ca.cross(axis, d)), ca.dot(axis, d)
    if is_cosine:
        # -cos(angle + asin(off / l)), and at least 1 where the sum is beyond half a turn: the first two terms are
        # concave in the cosine there, and the third is the chord that they lack.
        minus, level = -(dot / ca.sqrt(square)), ca.sqrt(1 - off**2 / square)
        expression = minus * level + off * across / square + ca.fmax(minus - level, 0)
    else:
        expression = ca.atan2(across, dot) + sign * ca.atan2(off, ca.sqrt(square - off**2))

    def errors(pose: PoseNumbers) -> JointErrors:
        at = spans(legs, pose)
        n, length = at.n[angle.leg], float(at.l[angle.leg])
        away = n * float(n @ angle.world(pose)) - angle.world(pose)
        size = float(np.linalg.norm(away))
        # A leg along its axis is as far off in any direction across it.
        away = away / size if size > 0 else np.linalg.svd(n[None])[2][-1]
        sine = min(off / length, 1.0)
        moved = sign * math.sqrt(1 - sine * sine) * away - sine * n
        return along(legs, pose, of_leg(angle.leg, -moved), of_leg(angle.leg, moved))

    return Worst(errors, angle.value, expression, least=0.0, most=math.pi)


class Rates(NamedTuple):
    """Work rates of the legs in one task over all machines.

    Attributes:
        legs: joint centres, with their tolerance.
        twist: (6,) omega and v of the world's origin.
        rates: (6, 1) of the exact machine.
        changes: largest change of each rate, (6, 1).
    """

    legs: Legs
    twist: FloatArray
    rates: SX
    changes: SX

    @property
    def rises(self) -> list[SX]:
        """Largest growth of each squared rate."""
        return [2 * ca.fabs(self.rates[i]) * self.changes[i] + self.changes[i] ** 2 for i in range(LEGS)]

    @property
    def falls(self) -> list[SX]:
        """Largest fall of each squared rate."""
        return [2 * ca.fabs(self.rates[i]) * self.changes[i] for i in range(LEGS)]

    def at(self, machine: Legs, pose: PoseNumbers) -> FloatArray:
        """Return the rates (6,) of a machine."""
        omega, v = self.twist[:3], self.twist[3:]
        return np.asarray(((v + np.cross(omega, machine.base)) * spans(machine, pose).n).sum(axis=1))

    def errors(self, pose: PoseNumbers, signs: FloatArray) -> JointErrors:
        """Return the errors that make each squared rate larger or smaller, by signs (6,); 0 for none."""
        omega, v = self.twist[:3], self.twist[3:]
        at, rates = spans(self.legs, pose), self.at(self.legs, pose)
        ends = self.legs.base + at.d, self.legs.base
        of_base, of_platform = (
            w - at.n * (w * at.n).sum(axis=1, keepdims=True) for w in (v + np.cross(omega, end) for end in ends)
        )
        signs = (signs * np.where(rates < 0, -1.0, 1.0))[:, None]
        return along(self.legs, pose, -signs * of_base, signs * of_platform)


def rates_of(
    legs: Legs, twist: Sequence[float], robot: RobotInstance, task: int, shortest: float, farthest: float
) -> Rates:
    """Return the work rates of one task over all machines.

    Args:
        legs: joint centres, with their tolerance.
        twist: the task's.
        robot: the exact machine in symbols of the pose.
        task: index of the task.
        shortest: no leg of the exact machine is shorter over the workspace; more than twice the tolerance.
        farthest: largest distance of the platform's origin from the world's.
    """
    t, omega, v = legs.tolerance, SX(list(twist[:3])), SX(list(twist[3:]))
    turning, moving = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    least = shortest - 2 * t
    reach = np.linalg.norm(legs.base, axis=1) + farthest + np.linalg.norm(legs.platform, axis=1)
    changes = []
    for i, leg in enumerate(robot.legs):
        ends = (leg.base, leg.base + leg.span)
        across = sum((ca.norm_2(ca.cross(v + ca.cross(omega, end), leg.span)) for end in ends), SX(0))
        speeds = 2 * moving + turning * float(reach[i])
        second = t * (speeds * 2 * t / least + 2 * turning * t) / least
        changes.append((t * shortest / least * across / ca.sumsqr(leg.span) + second) * _OUTWARDS)
    return Rates(legs, np.array(twist, dtype=np.float64), robot.rates[:, task], ca.vertcat(*changes))


def worst_sum(rates: Rates, total: SX, sign: float) -> Worst:
    """Return the largest (sign 1) or smallest (sign -1) F of a task, whose exact machine has a total (1, 1)."""
    change = sum(rates.rises, SX(0)) if sign > 0 else -sum(rates.falls, SX(0))

    def value(machine: Legs, pose: PoseNumbers) -> float:
        return float((rates.at(machine, pose) ** 2).sum())

    return Worst(lambda pose: rates.errors(pose, np.full(LEGS, sign)), value, total + change, least=0.0)


def worst_rate(rates: Rates, i: int) -> Worst:
    """Return the largest size of a rate, whose square is bounded."""

    def value(machine: Legs, pose: PoseNumbers) -> float:
        return abs(float(rates.at(machine, pose)[i]))

    signs = np.eye(LEGS)[i]
    return Worst(lambda pose: rates.errors(pose, signs), value, rates.rates[i] ** 2 + rates.rises[i], least=0.0)


def worst_share(rates: Rates, total: SX, i: int) -> Worst:
    """Return the largest share of a leg in F of a task, whose exact machine has a total (1, 1)."""
    own = rates.rates[i] ** 2 + rates.rises[i]
    others = sum((fall for k, fall in enumerate(rates.falls) if k != i), SX(0))

    def value(machine: Legs, pose: PoseNumbers) -> float:
        squares = rates.at(machine, pose) ** 2
        return float(squares[i] / squares.sum())

    signs = 2 * np.eye(LEGS)[i] - 1
    expression = own / (total + rates.rises[i] - others)
    return Worst(lambda pose: rates.errors(pose, signs), value, expression, least=0.0, most=1.0)
