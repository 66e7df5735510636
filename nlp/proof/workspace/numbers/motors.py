"""Force, speed and power of an actuator over boxes of poses, for every load case.

With ``A y = D u`` for the rates u of the actuators, a unit rate of actuator k moves the platform by ``x_k``, a part of
the solution of ``A y_k = D_k``. By virtual work, the actuator holds a load W with the force ``-(W . x_k)``. For a
robot without given actuators, A has the rows of J times their norms, and D the norms of the rows of legs. For other
robots, y has the platform's motion and the rates of passive joints, and D the screws of the actuators. Second-order
forms of the solution are kept; the remainder is of third order in the widths of a box.

Loads of any direction add the norm of a velocity. All quantities are bounded from above; a smallest force is negated.
Rotations about any axis lie in a ball, ``|r|^2 <= b``, so a multiple of ``b - |r|^2`` may be added to a bound.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, rate_relations
from .....models.arrays import values_at
from .....models.statics import degrees_of_freedom
from ....case.case import Case
from ....case.loads import Motion
from ....case.motors import ActuatorQuantity, Motor
from ....case.task import Sense
from ....case.workspace import TurnKind
from ....program.layout import robot_length
from ...enclosure.forms import Forms
from ...statement.claims import Claim
from ..ranks.krawczyk import ROUNDING
from ..robot.posed_robot import NotJudgedError, Problem
from .bound_search import Bounds, Number
from .quadratic_forms import Quadratics, solved

#: Upper bound of the underflow error of a sum.
_TINY = 1e-290


class _Part(NamedTuple):
    """Factor of an actuator quantity: a force in one direction under a load, or the speed.

    Attributes:
        sense: ``MAX`` for the largest force, ``MIN`` for the smallest force; None for the speed.
        load: index of the load.
    """

    sense: Sense | None = None
    load: int = 0


class Motors(Number):
    """Bounds of forces, speed and powers of one actuator; largest values are negated.

    Args:
        problem: the nominal robot, or all robots within the tolerance.
        case: case with loads and motions.
        claims: claims about quantities of one actuator.

    Raises:
        NotJudgedError: the loops impose relations between the actuators' rates.
    """

    def __init__(self, problem: Problem, case: Case, claims: Sequence[Claim]) -> None:
        posed, self._loading = problem.posed, case.loading
        if rate_relations(case.model.actuators).shape[0]:
            raise NotJudgedError(
                "the actuator rates of this robot are not independent, because its loops impose equations on them; "
                "such robots are not supported"
            )
        motor, R = claims[0].motor or Motor(), posed.turned[0]
        self._actuator, self._length, self._is_six = motor.place, problem.length, degrees_of_freedom(case.model) == 6
        self._size = robot_length(case)
        self._numbers = [_parts_of(case, claim) for claim in claims]
        self._parts = list(dict.fromkeys(itertools.chain(*self._numbers)))
        A, D = posed.driven_rows
        row_of_leg = SX(6, 0)
        if not case.model.actuators and self._is_six:
            # A leg's speed follows from its row of J, and its force from its column of the solution.
            row = [each.limb for each in posed.limbs.wrenches].index(motor.actuator)
            row_of_leg, D = posed.scaled.jacobian[row, :].T, D[:, row]
            if problem.rates and problem.of_settings:
                # The length also changes by the dimensions: one more component, whose rate is 1.
                of_settings = problem.of_settings
                length = ca.sqrt(posed.plain(posed.limbs.wrenches[row].square))
                rates = problem.z[list(problem.rates)[-len(of_settings) :], :]
                row_of_leg = ca.vertcat(row_of_leg, ca.jtimes(length, problem.z[of_settings, :], rates))
        self._column = 0 if D.shape[1] == 1 else self._actuator
        free, loading = problem.free, self._loading
        is_ball = problem.box.is_ball
        turn = [problem.z[j] for j, k in enumerate(free) if k >= 3 and is_ball]
        # Negative cross-product matrices of arms, divided by the length that multiplies rotations.
        arms = [-ca.skew(R @ SX([float(part) for part in each.point])) / problem.length for each in loading.loads]
        loads = [each.wrench(R) for each in loading.cases]
        scaled = [ca.vertcat(each[:3], each[3:] / problem.length) for each in loads]
        twist = path_twist(problem) if problem.rates else SX(6, 0)
        if row_of_leg.numel() > 6:
            twist = ca.vertcat(twist, 1)
        parts = [A, D, row_of_leg, twist, ca.horzcat(SX(3, 0), *arms), ca.horzcat(SX(6, 0), *scaled)]
        parts = [ca.densify(each) for each in (*parts, ca.horzcat(SX(1, 0), *turn))]
        self._shapes = [each.shape for each in parts]
        super().__init__(problem, ca.vertcat(SX(0, 1), *map(ca.vec, parts)), len(claims))
        self._entries = ca.Function("entries", [problem.z], [self.entries])

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, K) at points (P, n) with closed loops."""
        with np.errstate(all="ignore"):
            found = self._bounded(self._at(z))[0]
        return -self._of_claims([np.where(np.isfinite(each.r), each.c, np.nan)[0, 0] for each in found])

    def products(self, z: FloatArray) -> FloatArray:
        """Return products (P, K) of the norms of loads and motions at points (P, n) with closed loops.

        These products are typical magnitudes of the quantities. A quantity itself may be 0 for single directions of a
        load or a motion.
        """
        motion = self._loading.motion or Motion()
        with np.errstate(all="ignore"):
            A, D, _, twist, _, wrenches, _ = self._at(z)
            x = np.linalg.norm(solved(A, D).c[:6, self._column], axis=0)
            fast = np.asarray(motion.linear + motion.angular * self._length)
            if twist.c.size:
                fast = np.linalg.norm(twist.c[:3, 0], axis=0) + np.linalg.norm(twist.c[3:6, 0], axis=0)
            ends = [fast / x for _ in self._parts]
            for j, (sense, load) in enumerate(self._parts):
                if sense is not None:
                    parts = [each for each, _ in self._loading.cases[load].parts]
                    spread = sum(each.any_force + each.any_moment / self._length for each in parts)
                    ends[j] = x * (np.linalg.norm(wrenches.c[:, load], axis=0) + spread)
            return self._of_claims(ends)

    def _at(self, z: FloatArray) -> list[Quadratics]:
        """Return the matrices of :meth:`_matrices` at points (P, n)."""
        c = values_at(self._entries, z)[0][:, :, 0]
        return self._matrices(Forms(c, np.zeros((*c.shape, 0)), np.zeros_like(c)), 0)

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        matrices = self._matrices(forms, count)
        with np.errstate(all="ignore"):
            found, of = self._bounded(matrices)
            upper = self._of_claims([self._upper(each, matrices[-1]) for each in found])
            every = [_shares(each, of, count) for each in found]
        shares = np.stack([every[self._parts.index(number[0])] for number in self._numbers])
        return Bounds(np.where(np.isfinite(upper), -upper, -np.inf), shares.transpose(2, 0, 1))

    def _of_claims(self, ends: Sequence[FloatArray]) -> FloatArray:
        """Return upper bounds (B, K) of the quantities from upper bounds (B,) of their factors."""
        every = dict(zip(self._parts, ends, strict=True))
        columns = []
        for first, *others in self._numbers:
            found = every[first]
            for other in others:
                # The power of a negative force counts as 0.
                found = np.maximum(found, 0.0) * every[other]
            columns.append(found)
        return np.asarray(np.stack(columns, axis=1))

    def _upper(self, of: Quadratics, turn: Quadratics) -> FloatArray:
        """Return upper bounds (B,) of a quantity; if ``turn`` has rotations, only those in the ball count."""
        upper, ball = of.upper()[0, 0], self.problem.box.ball
        which = np.flatnonzero((turn.size**2).sum(axis=(0, 1)) > ball)
        if not (which.size and of.q.shape[2] and turn.c.size):
            return np.asarray(upper)
        of, turn = of[..., which], turn[..., which]
        inside = turn.by(turn).sums(1).times(-1.0)
        inside = replace(inside, c=inside.c + ball, r=inside.r + ROUNDING * ball)
        # The multiple for which the derivative with respect to r is zero at the centre of the box.
        r, half = turn.c[0], turn.a[0]
        slopes = (of.a[0, 0] * half / np.maximum((half**2).sum(axis=0), _TINY)).sum(axis=1)
        factor = (slopes * r).sum(axis=0) / np.maximum(2 * (r**2).sum(axis=0), _TINY)
        factor = np.where(np.isfinite(factor), np.maximum(factor, 0.0), 0.0)
        upper[which] = np.fmin(upper[which], of.plus(inside.times(factor[None, None])).upper()[0, 0])
        return np.asarray(upper)

    def _matrices(self, forms: Forms, count: int) -> list[Quadratics]:
        """Return matrices from forms of their entries.

        In order: A, D, row of the leg, twist on the path, arms of loads, wrenches of loads, and rotations.
        """
        ends = np.cumsum([0, *(rows * columns for rows, columns in self._shapes)]).tolist()
        errors = len(self.problem.of_errors) if count else 0
        return [
            Quadratics.of(forms.part(slice(begin, end)), count, errors, shape)
            for begin, end, shape in zip(ends, ends[1:], self._shapes, strict=False)
        ]

    def _bounded(self, matrices: Sequence[Quadratics]) -> tuple[list[Quadratics], FloatArray]:
        """Return the speeds and forces (1, 1) whose upper bounds are needed, and shares of coordinates in remainders.

        The shares (t, B) are those of each coordinate in the remainders of each box.
        """
        A, D, row, twist, arms, wrenches, _ = matrices
        every, k = solved(A, D)[:6], self._column
        x = every[:, k : k + 1]
        found = []
        for sense, load in self._parts:
            if sense is None:
                found.append(self._speed(every, row, twist))
                continue
            held = wrenches[:, load : load + 1].by(x).sums(0).times(-sense.sign)
            found.append(held.plus(self._spread(load, x, arms)))
        return found, (A.a**2).sum(axis=(0, 1))

    def _spread(self, case: int, x: Quadratics, arms: Quadratics) -> Quadratics:
        """Return the largest change (1, 1) of the force due to loads of any direction in a load case."""
        found, turned = x[:1].times(0.0), x[3:]
        for load, _ in self._loading.cases[case].parts:
            k = self._loading.loads.index(load)
            if load.any_force:
                moved = x[:3].plus(arms[:, 3 * k : 3 * k + 3].matmul(turned))
                found = found.plus(moved.lengths().times(load.any_force))
            if load.any_moment:
                found = found.plus(turned.lengths().times(load.any_moment / self._length))
        return found

    def _speed(self, x: Quadratics, row: Quadratics, twist: Quadratics) -> Quadratics:
        """Return the largest speed (1, 1) in the motions of the case, or in the motion of the path.

        Args:
            x: motions of the platform for unit rates of all actuators.
            row: (6, 1) row of the leg; (6, 0) for other actuators.
            twist: (6, 1) twist of the platform in the motion of a path; (6, 0) for the motions of the case.
        """
        motion = self._loading.motion or Motion()
        linear, angular = motion.linear, motion.angular * self._length
        if row.c.size:
            if twist.c.size:
                return row.by(twist).sums(0).lengths()
            # The wrench of a leg has a unit force.
            speed = row[3:].lengths().times(angular)
            return replace(speed, c=speed.c + linear, r=speed.r + ROUNDING * linear)
        if self._is_six:
            eye = np.broadcast_to(np.eye(6)[:, :, None], x.c.shape)
            rates = solved(x, Quadratics(eye, 0 * x.a, 0 * x.q, 0 * x.r, x.errors)).transposed
        else:
            length = motion.length(self._size) / self._length
            weighted = x.times(np.repeat([1.0, length**2], 3)[:, None, None])
            rates = solved(x.transposed.matmul(weighted), weighted.transposed).transposed
        own = rates[:, self._actuator : self._actuator + 1]
        if twist.c.size:
            return own.by(twist).sums(0).lengths()
        moved, turned = (part.lengths() for part in (own[:3], own[3:]))
        return moved.times(linear).plus(turned.times(angular))


def _parts_of(case: Case, claim: Claim) -> list[_Part]:
    """Return the factors of a claim's quantity: a force, the speed, or both for a power."""
    motor, cases = claim.motor or Motor(), case.loading.cases
    if motor.number is ActuatorQuantity.SPEED:
        return [_Part()]
    load = next(k for k, each in enumerate(cases) if each.name == motor.load)
    sense = Sense.MIN if motor.is_backwards else claim.sense
    if not any(each.is_fixed for each, _ in cases[load].parts):
        sense = Sense.MAX  # loads of any direction give the same force in both directions
    return [_Part(sense, load), *([_Part()] if motor.number is ActuatorQuantity.POWER else [])]


def path_twist(problem: Problem) -> SX:
    """Return the platform's twist ``(v, length omega)`` (6, 1) from the rates of its pose on a path.

    Raises:
        NotJudgedError: a coordinate of the pose is dependent.
    """
    if problem.box.dependent:
        raise NotJudgedError(
            "the path does not determine the platform's twist, because some pose coordinates are dependent"
        )
    box = problem.box
    rates = SX(6 + len(box.settings), 1)
    rates[problem.rated] = problem.z[list(problem.rates), :]
    if box.kind is not TurnKind.ROLL_PITCH_YAW:
        return ca.vertcat(rates[:3], problem.length * rates[3:6])
    _, b, c = (2 * ca.atan(t) for t in ca.vertsplit(box.symbols(problem.z)[3 : box.of_pose]))
    about_x = ca.vertcat(ca.cos(c) * ca.cos(b), ca.sin(c) * ca.cos(b), -ca.sin(b))
    about_y = ca.vertcat(-ca.sin(c), ca.cos(c), 0)
    omega = about_x * rates[3] + about_y * rates[4] + ca.vertcat(0, 0, rates[5])
    return ca.vertcat(rates[:3], problem.length * omega)


def _shares(found: Quadratics, of: FloatArray, count: int) -> FloatArray:
    """Return the shares (f, B) of coordinates in the overestimation of a bound of a quantity (1, 1)."""
    shares = found.r[0, 0] * (of / np.maximum(of.sum(axis=0), _TINY))[:count] + 1e-200 * of[:count]
    q = np.abs(found.q[0, 0])
    rows, columns = np.triu_indices(count if len(q) else 0)
    for i in range(count if len(q) else 0):
        shares[i] += q[(rows == i) | (columns == i)].sum(axis=0)
    return np.asarray(np.nan_to_num(shares, posinf=0.0))
