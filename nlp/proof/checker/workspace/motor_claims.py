"""Claims about forces, speeds and powers of an actuator.

``A (x, w) = D u`` holds for the motion x of the platform, the rates w of passive joints and u of the actuators
(:func:`.motion_matrix.driven_matrices`). If ``x_k`` is the motion for a unit rate of actuator k, its force under a load
W is ``-(W . x_k)``, by virtual work. Loads of any direction add multiples of velocity magnitudes. A leg's rate in a
motion x of the platform is ``row . x / |force|`` with its row. Otherwise the motions of the platform are ``X u``, and
the speed is defined by the left inverse of X with the least norm.

Along a path with times the coordinate q of the actuator has the rate ``q_X X' + q_u u'`` with the rates X' of the pose,
and ``L_u u' = -L_X X'`` for the loop equations L and the dependent coordinates u: the speed is its absolute value.

Each quantity is an affine function of the coordinates, plus multiples of norms of affine vectors, plus a remainder.
Without the remainder it is convex, so that the corners of a box decide. Rotations about any axis lie in a ball, where
``n . r <= sqrt(b)`` for unit vectors n. A multiple of the difference is added: it is at least 0 at every pose, and
reduces the bound at corners outside of the ball.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray, WrenchKind
from ....case.case import Case
from ....case.loads import Motion
from ....case.motors import ActuatorQuantity, Motor
from ....case.task import Sense
from .closed_loops import Enclosed
from .forms import PRODUCT, UP, AffineMatrix, SparseMatrices, solved
from .loop_claims import LoopClaim, PosedLoops
from .motion_matrix import Root, driven_matrices
from .pose_boxes import COORDINATES, Attempt

#: Relative excess over a bound from which the value at a pose refutes a claim: far more than rounding.
_WRONG = 1e-6
#: Largest relative excess of a unit vector's length over 1.
_UNIT = 1e-12


class _Sum(NamedTuple):
    """A quantity over boxes: an affine function (B, 1, 1), plus factors times norms of affine vectors (B, 3, 1)."""

    affine: AffineMatrix
    sizes: Sequence[tuple[float, AffineMatrix]] = ()


class _Number(NamedTuple):
    """Force, speed or power as a product, and its largest allowed value.

    A factor is the sign of a force, or None for the speed.
    """

    parts: tuple[float | None, ...]
    most: float


def _number_of(motor: Motor, sense: Sense, bound: float) -> _Number:
    """Return the product for the claim that a bound is the largest, or the smallest, value of a quantity."""
    if motor.number is ActuatorQuantity.SPEED:
        return _Number((None,), bound)
    if motor.number is ActuatorQuantity.POWER:
        return _Number((-1.0 if motor.is_backwards else 1.0, None), bound)
    return _Number((float(sense.sign),), sense.sign * bound)


class MotorClaims(LoopClaim):
    """Claims that quantities of one actuator, under one load, are at most bounds, or forces at least bounds.

    Args:
        case: case with its loads and motions.
        loops: robot; its loops must not impose relations between actuator rates.
        root: box of poses, or the path.
        claims: quantities with their bounds.
        coordinate: (1, 1) actuator coordinate as an expression of the robot's coordinates; its rate along the path is
            the speed. None if the case's motions define the speed.
    """

    def __init__(
        self,
        case: Case,
        loops: PosedLoops,
        root: Root,
        claims: Sequence[tuple[Motor, Sense, float]],
        coordinate: SX | None = None,
    ) -> None:
        robot, motor, motion = loops.robot, claims[0][0], case.loading.motion or Motion()
        self._numbers = [_number_of(*each) for each in claims]
        self._place, self._fastest = motor.place, (motion.linear, motion.angular * robot.length)
        load = next((each for each in case.loading.cases if each.name == motor.load), None)
        parts = [] if load is None else [each.load for each in load.parts]
        self._any = [(each.any_force, each.any_moment / robot.length) for each in parts]
        arms = [-ca.skew(robot.rotation @ SX(list(map(float, each.point)))) / robot.length for each in parts]
        wrench = SX(6, 1) if load is None else load.wrench(robot.rotation)
        A, D = driven_matrices(robot, loops.start)
        forces = [row.moment / ca.norm_2(row.force) for row in robot.rows if row.kind is WrenchKind.FORCE]
        self._is_six_legs = not robot.actuators and len(forces) == COORDINATES
        self._has_speeds = any(None in each.parts for each in self._numbers)
        if self._is_six_legs or not self._has_speeds:
            D = D[:, motor.place]
        moment = forces[motor.place].T / robot.length if self._is_six_legs else SX(1, 3)
        self._ball = math.sqrt(root.ball) * (1 + _UNIT) if root.is_ball else math.inf
        turn = [z for z, k in zip(ca.vertsplit(robot.z), robot.free, strict=False) if k >= 3 and root.is_ball]
        rates = _rates(loops, coordinate if self._has_speeds else None)
        self._has_rates = coordinate is not None
        scaled = ca.vertcat(wrench[:3], wrench[3:] / robot.length)
        every = [A, D, scaled.T, moment, ca.horzcat(SX(1, 0), *turn), *rates, *arms]
        self._matrices = SparseMatrices.of([ca.sparsify(each) for each in every])
        super().__init__(loops, self._matrices.entries)

    def examined(self, closed: Enclosed) -> Attempt:
        """Try to prove the claims over closed loops."""
        forms = self.assembly.followed(self.values(closed).forms(), closed)
        A, D, wrench, moment, turn, L_u, L_t, q_u, q_t, *arms = self._matrices.forms(forms)
        y, known, shares = solved(A, D)
        x, k = y.part(slice(0, 6)), self._place if D.M.shape[2] > 1 else 0
        ends: dict[float | None, tuple[FloatArray, FloatArray]] = {}
        for part in dict.fromkeys(part for number in self._numbers for part in number.parts):
            if part is None:
                of_path = _along_path(L_u, L_t, q_u, q_t) if self._has_rates else None
                speed, is_known = of_path or self._speed(x, moment)
                known = known & is_known
                ends[part] = self._largest(speed, turn)
            else:
                force = self._force(part, x.part(slice(None), slice(k, k + 1)), wrench, arms)
                ends[part] = self._largest(force, turn)
        holds, is_wrong = known, np.zeros(len(known), dtype=bool)
        for number in self._numbers:
            (upper, middle), *others = (ends[part] for part in number.parts)
            for most, at_centre in others:
                # A negative force has the power 0.
                upper, middle = np.maximum(upper, 0.0) * most * UP, np.maximum(middle, 0.0) * at_centre
            holds = holds & (upper <= number.most)
            is_wrong |= known & (middle > number.most + _WRONG * abs(number.most))
        rest = y.E.sum(axis=(1, 2))[:, None]
        return Attempt(np.asarray(holds), (shares * rest)[:, : len(self.free)], is_wrong)

    def _force(self, sign: float, x: AffineMatrix, wrench: AffineMatrix, arms: Sequence[AffineMatrix]) -> _Sum:
        """Return the force times a sign, from the motion (B, 6, 1) for a unit rate of the actuator."""
        M, A, E = wrench.matmul(x)
        moved, turned, sizes = x.part(slice(0, 3)), x.part(slice(3, 6)), []
        for (force, moment), arm in zip(self._any, arms, strict=True):
            if force:
                along = arm.matmul(turned)
                sizes.append((force, AffineMatrix(*(one + other for one, other in zip(moved, along, strict=True)))))
            if moment:
                sizes.append((moment, turned))
        return _Sum(AffineMatrix(-sign * M, -sign * A, E), sizes)

    def _speed(self, x: AffineMatrix, moment: AffineMatrix) -> tuple[_Sum, NDArray[np.bool_]]:
        """Return the largest speed, and whether it is known, from motions (B, 6, a) for unit rates of all actuators."""
        (linear, angular), B = self._fastest, len(x.M)
        fixed = AffineMatrix(*(np.zeros((*each.shape[:-2], 1, 1)) for each in x))
        if self._is_six_legs:
            # The force of a leg has unit size.
            fixed.M[:] = linear
            return _Sum(fixed, [(angular, _transposed(moment))]), np.ones(B, dtype=bool)
        if x.M.shape[2] == COORDINATES:
            right = AffineMatrix(np.broadcast_to(np.eye(COORDINATES), x.M.shape), 0 * x.A, 0 * x.E)
            rates, known, _ = solved(x, right)
        else:
            # Rows g of the least-norm left inverse (X' S X)^-1 X' S, as used at single poses.
            length = linear / angular if linear and angular else 1.0  # length of the robot
            weights = np.repeat([1.0, length**2], 3)
            right = _transposed(AffineMatrix(*(each * weights[:, None] for each in x)))
            rates, known, _ = solved(right.matmul(x), right)
        own = _transposed(rates.part(slice(self._place, self._place + 1)))
        sizes = [(linear, own.part(slice(0, 3))), (angular, own.part(slice(3, 6)))]
        return _Sum(fixed, sizes), known

    def _largest(self, number: _Sum, turn: AffineMatrix) -> tuple[FloatArray, FloatArray]:
        """Return upper bounds (B,) of a quantity over boxes, and its values at their centres."""
        p, affine = len(self.free), number.affine
        corners, middle = affine.corners(p)[:, :, 0, 0], affine.M[:, 0, 0].copy()
        slopes, rest = affine.A[:, :p, 0, 0].copy(), affine.E[:, 0, 0] + self._of_errors(affine)
        terms = np.abs(affine.M).sum(axis=(1, 2)) + affine.spread.sum(axis=(1, 2))
        for factor, vector in number.sizes:
            size, at = np.sqrt((vector.M**2).sum(axis=(1, 2))), vector.corners(p)
            corners = corners + factor * np.sqrt((at * at).sum(axis=(2, 3)))
            rest += factor * (np.sqrt((vector.E**2).sum(axis=(1, 2))) + self._of_errors(vector))
            terms += factor * (np.abs(vector.M) + vector.spread).sum(axis=(1, 2))
            middle += factor * size
            unit = vector.M[:, None] / np.where(size > 0, size, 1.0)[:, None, None, None]
            slopes += factor * (vector.A[:, :p] * unit).sum(axis=(2, 3))
        upper = corners.max(axis=1)
        if math.isfinite(self._ball):
            upper = np.fmin(upper, (corners + self._inside(slopes, turn)).max(axis=1))
        return np.asarray(upper + (rest + PRODUCT * terms) * UP), middle

    def _inside(self, slopes: FloatArray, turn: AffineMatrix) -> FloatArray:
        """Return multiples (B, corners) of a term that is not negative where rotations lie in the ball."""
        p = len(self.free)
        r = turn.M[:, 0]
        size = np.sqrt((r * r).sum(axis=1))
        n = r / np.where(size > 0, size, 1.0)[:, None]
        along = -(turn.A[:, :p, 0] @ n[:, :, None])[:, :, 0]
        room = self._ball - (turn.corners(p)[:, :, 0] @ n[:, :, None])[:, :, 0]
        rest = turn.rest[:, 0] + np.abs(turn.A[:, p:, 0]).sum(axis=1)
        room += ((rest * np.abs(n)).sum(axis=1) * UP + PRODUCT * self._ball)[:, None]
        # Take the least bound among the multiples at which a slope vanishes.
        tried = np.nan_to_num(np.where(along != 0, -slopes / np.where(along != 0, along, 1.0), 0.0))
        tried = np.maximum(tried, 0.0)
        left = np.abs(slopes[:, None] + tried[:, :, None] * along[:, None]).sum(axis=2)
        ends = tried * (self._ball - size)[:, None] + left
        best = np.take_along_axis(tried, ends.argmin(axis=1)[:, None], axis=1)
        return np.asarray(best * room)

    def _of_errors(self, vector: AffineMatrix) -> FloatArray:
        """Return the largest change (B,) of a column due to joint-centre errors with norms of at most 1."""
        own = vector.A[:, len(self.free) :].reshape(len(vector.A), -1, 3, vector.A.shape[2])
        return np.asarray(np.sqrt((own**2).sum(axis=(2, 3))).sum(axis=1) * UP)


def _rates(loops: PosedLoops, coordinate: SX | None) -> list[SX]:
    """Return derivatives of loop equations and of a coordinate, with respect to dependent coordinates and to time.

    The time runs along the path. The list is empty without a coordinate.
    """
    robot, (D, k) = loops.robot, (loops.assembly.dependent, len(loops.needed))
    if coordinate is None:
        return [SX(k, k), SX(k, 1), SX(1, k), SX(1, 1)]
    stated, rates = robot.given[: robot.given.numel() // 2, :], robot.given[robot.given.numel() // 2 :, :]
    L, found = robot.equations[loops.needed, :], list[SX]()
    for each in (L, coordinate):
        found += [ca.jacobian(each, robot.z)[:, D], ca.jacobian(each, stated) @ rates]
    return [ca.sparsify(each) for each in found]


def _along_path(
    L_u: AffineMatrix, L_t: AffineMatrix, q_u: AffineMatrix, q_t: AffineMatrix
) -> tuple[_Sum, NDArray[np.bool_]]:
    """Return the absolute value of a coordinate's rate along the path, and whether it is known."""
    known, rate = np.ones(len(q_t.M), dtype=bool), q_t
    if L_u.M.shape[1]:
        following, known, _ = solved(L_u, L_t)
        of_loops = q_u.matmul(following)
        M, A = rate.M - of_loops.M, rate.A - of_loops.A
        # The rounding of the differences is a part of their terms.
        sizes = np.abs(rate.M) + np.abs(of_loops.M) + rate.spread + of_loops.spread
        rate = AffineMatrix(M, A, (rate.E + of_loops.E + PRODUCT * sizes) * UP)
    fixed = AffineMatrix(*(np.zeros_like(each) for each in rate))
    return _Sum(fixed, [(1.0, rate)]), known


def _transposed(matrix: AffineMatrix) -> AffineMatrix:
    """Return the transposed matrices."""
    return AffineMatrix(*(each.swapaxes(-1, -2) for each in matrix))
