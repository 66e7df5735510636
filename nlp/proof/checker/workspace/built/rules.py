"""How far numbers of straight legs go at a pose, over all machines within a tolerance t on joint centres.

A leg from b to a has the vector d, the length l and the direction n = d / l in the exact machine. Its base joint is off
by e, and its platform joint by f in the world frame, each up to t; d becomes ``d + f - e``.

* Its direction turns by at most ``asin(2 t / l)``, and n moves by at most ``2 t / (l - 2 t)``.
* Its rate ``(v + omega x b).n`` has the derivative ``(w - n n.w) / l`` with respect to f, for w the velocity of the
  platform at b, and minus that of the velocity at a with respect to e. On the way from the exact machine lengths are at
  least ``l - 2 t``, and velocities change by at most ``|omega| t``. The rate changes by at most the integral of the
  derivatives' sizes.
* The length less ``f.c_p - e.c_b``, f in the platform's frame, changes by ``f.(R'n - c_p) - e.(n - c_b)`` to first
  order, never by less, and by at most ``(2 t)^2 / 2 (l - 2 t)`` more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray, RobotInstance
from ....statement.machine import LEGS, Legs

#: Part of itself by which a change moves outwards: the rounding of its constants.
_OUTWARDS = 1 + 1e-12
#: Part of a vector's scale that is added to its size, which only makes bounds wider: slopes of a size of 0 are not
#: bounded, and no box around such a pose could be shown.
_APART = 1e-9


class Machines(NamedTuple):
    """All machines within a tolerance.

    Attributes:
        legs: joint centres of the exact machine, with the tolerance.
        robot: the exact machine in symbols of the pose.
        shortest: no leg of the exact machine is shorter over the workspace; more than twice the tolerance.
        farthest: largest distance of the platform's origin from the world's.
    """

    legs: Legs
    robot: RobotInstance
    shortest: float
    farthest: float


def _size(vector: SX, scale: SX | float) -> SX:
    """Return an upper bound (1, 1) of the size of a vector, above 0.

    Args:
        vector: (n, 1).
        scale: the square of a size that it may have.
    """
    return ca.sqrt(ca.sumsqr(vector) + _APART**2 * scale)


def minus_cosine(machines: Machines, leg: int, axis: SX) -> SX:
    """Return a bound (1, 1) of minus the cosine of the largest angle of a leg to a unit axis (3, 1) of the world.

    With alpha the turn and c minus the cosine of the exact angle it is ``c cos(alpha) + sqrt(1 - c^2) sin(alpha)``,
    concave in c, which rises from c = -1 up to the c of ``pi - alpha``, where it is 1. From there on the difference
    of c and that one is added: the sum is concave and 1 at both ends, so that it is never below 1.
    """
    span, off = machines.robot.legs[leg].span, 2 * machines.legs.tolerance
    square = ca.sumsqr(span)
    cosine = -ca.dot(axis, span) / ca.sqrt(square)
    turned = ca.sqrt(1 - off**2 / square)
    across = _size(ca.cross(axis, span), square)
    return cosine * turned + off * across / square + ca.fmax(cosine - turned, 0)


def angle(machines: Machines, leg: int, axis: SX, sign: float) -> SX:
    """Return a bound (1, 1) of the largest (sign 1) or smallest (sign -1) angle of a leg to an axis of the world."""
    span, off = machines.robot.legs[leg].span, 2 * machines.legs.tolerance
    across = ca.cross(axis, span)
    size = _size(across, ca.sumsqr(span)) if sign > 0 else ca.norm_2(across)
    exact = ca.atan2(size, ca.dot(axis, span))
    return exact + sign * ca.atan2(off, ca.sqrt(ca.sumsqr(span) - off**2))


class TaskRates(NamedTuple):
    """Rates of the legs in one task.

    Attributes:
        squares: (6, 1) of the exact machine.
        rises, falls: (6, 1) bounds of how far a square grows, and of how far it falls.
        F: (1, 1) of the exact machine.
    """

    squares: SX
    rises: SX
    falls: SX
    F: SX

    def total(self, sign: float) -> SX:
        """Return a bound (1, 1) of the largest (sign 1) or smallest (sign -1) F."""
        return self.F + ca.sum1(self.rises) if sign > 0 else self.F - ca.sum1(self.falls)

    def square(self, leg: int) -> SX:
        """Return an upper bound (1, 1) of a squared rate."""
        return self.squares[leg] + self.rises[leg]

    def share(self, leg: int) -> SX:
        """Return an upper bound (1, 1) of the share of a leg in F: its square is largest, and all others smallest."""
        others = ca.sum1(self.falls) - self.falls[leg]
        return self.square(leg) / (self.F + self.rises[leg] - others)


def task_rates(machines: Machines, twist: Sequence[float], task: int) -> TaskRates:
    """Return the rates of the legs in a task, which is a twist (6,), omega and v of the world's origin."""
    legs, robot, t = machines.legs, machines.robot, machines.legs.tolerance
    omega, v = SX(list(twist[:3])), SX(list(twist[3:]))
    turning, moving = (float(np.linalg.norm(part)) for part in (twist[:3], twist[3:]))
    least = machines.shortest - 2 * t
    changes = []
    for i, leg in enumerate(robot.legs):
        at_base = v + ca.cross(omega, leg.base)
        at_platform = at_base + ca.cross(omega, leg.span)
        # |w x n| / l = |w x d| / l^2, and l / (l - 2 t) is largest for the shortest leg.
        square, far = ca.sumsqr(leg.span), float(np.linalg.norm(legs.base[i]) + np.linalg.norm(legs.platform[i]))
        # Both velocities together.
        speeds = 2 * moving + turning * (far + machines.farthest)
        across = sum((_size(ca.cross(w, leg.span), speeds**2 * square) for w in (at_base, at_platform)), SX(0))
        first = machines.shortest / least * across / square
        second = (speeds * 2 * t / least + 2 * turning * t) / least
        changes.append(t * (first + second) * _OUTWARDS)
    rates, change = robot.rates[:LEGS, task], ca.vertcat(*changes)
    falls = 2 * ca.fabs(rates) * change
    return TaskRates(rates**2, falls + change**2, falls, robot.F[task])


def radius_ratio(machines: Machines, sign: float) -> SX:
    """Return the largest (sign 1) or smallest (sign -1) squared ratio of the platform's radius to the base's."""
    t = sign * machines.legs.tolerance * _OUTWARDS
    platform, base = (np.hypot(joints[:, 0], joints[:, 1]) for joints in machines.legs[:2][::-1])
    squares = [float((np.maximum(each, 0.0) ** 2).sum()) for each in (platform + t, base - t)]
    return SX(squares[0] / squares[1] if squares[1] > 0 else np.inf)


def length_beside(machines: Machines, leg: int, sign: float, base: FloatArray, platform: FloatArray) -> SX:
    """Return a bound (1, 1), upper for a sign of 1, of the length of a leg less ``f.c_p - e.c_b``.

    Args:
        machines: the machines.
        leg: index of the leg.
        sign: 1 for an upper bound, -1 for a lower one.
        base: (3,) c_b, in the world frame.
        platform: (3,) c_p, in the platform frame.
    """
    span, t = machines.robot.legs[leg].span, machines.legs.tolerance
    length = ca.norm_2(span)
    n = span / length
    turned = machines.robot.rotation.T @ n
    off = _size(n - SX(base.tolist()), 1.0) + _size(turned - SX(platform.tolist()), 1.0)
    bend = 2 * t**2 / (machines.shortest - 2 * t) if sign > 0 else 0.0
    return length + sign * (t * off + bend) * _OUTWARDS
