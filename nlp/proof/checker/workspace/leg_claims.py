"""Claims about six straight legs: singular values of J, errors of the pose to first order, and distances between legs.

With A the rows of the legs, F the diagonal matrix of the sizes of their forces, and J = F^-1 A with unit rows, the
columns of ``P = A^-1 F`` are the platform's motions for unit changes of the legs' lengths. With C near the inverse of A
at the centre of a box, ``P_0 = C F_0`` and ``B >= |I - C A|``,

    P - P_0 = C (F - A P_0) + (C A)^-1 (I - C A) C (F - A P_0).

The first part is affine in the coordinates but for a rest, the second at most ``(I - B)^-1 B |C (F - A P_0)|``. Sizes
of affine matrices and vectors are convex: the corners of the box decide.

* The smallest singular value of J is at least t where ``|P| <= 1 / t``, and the largest at most t where ``|J| <= t``.
  The condition number is at most k where they are t and k t for any t.
* Errors of legs d move the platform by ``P d`` to first order.
* Two legs, as segments between their joints, are at least ``n.(x - y) / |n|`` apart, for any vector n and the least of
  it over their ends x and y.

With a tolerance on joint centres every singular value changes by at most a number (:mod:`.tolerance`), so that the
smallest is claimed to be larger by it, and the largest to be smaller by it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ...statement.machine import Legs
from ..polynomials import UNIT
from .forms import PRODUCT, UP, AffineMatrix, FormArithmetic, inverses
from .motion_matrix import PosedRobot
from .pose_boxes import Attempt

#: Part of a bound by which a number at a pose must be beyond it to show that a claim is wrong: far more than rounding.
_WRONG = 1e-6
#: Part by which the solution of a system is enlarged, so that it is a bound: its rounding is far below.
_ENLARGED = 1e-6
#: Signs (6, 32) of the errors of legs: a pair of opposite signs has one size.
_ERRORS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))[:32].T
#: Part of the trace that is taken off before Cholesky's factorisation: many times the bound of its rounding for
#: matrices (6, 6), which is 8 roundings. A factorisation that ends proves the matrix positive definite (S. M. Rump,
#: *Verification of positive definiteness*, BIT 46 (2006)).
_CHOLESKY = 1e-13
#: Steps in the search of the part of second order of errors, and of the nearest points of two legs.
_STEPS, _NEAREST = 200, 12
#: A float or a fraction.
_Number = TypeVar("_Number", float, Fraction)


def are_positive(matrices: FloatArray) -> NDArray[np.bool_]:
    """Return whether symmetric matrices (..., n, n) are positive definite; their lower triangles are read."""
    M = np.array(matrices)
    n = M.shape[-1]
    good = np.asarray(np.isfinite(M).all(axis=(-2, -1)))
    shift = _CHOLESKY * np.abs(np.trace(M, axis1=-2, axis2=-1))
    for k in range(n):
        M[..., k, k] -= shift
    with np.errstate(all="ignore"):
        for k in range(n):
            pivot = M[..., k, k]
            good = np.asarray(good & (pivot > 0))
            column = M[..., k + 1 :, k] / np.sqrt(np.where(good, pivot, 1.0))[..., None]
            M[..., k + 1 :, k + 1 :] -= column[..., :, None] * column[..., None, :]
    return good


def _at_corners(matrices: AffineMatrix, part: slice = slice(None)) -> FloatArray:
    """Return the affine parts of some rows at the corners of the boxes, (B, rows, corners, 6)."""
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=matrices.A.shape[1])))
    moved = matrices.A[:, :, part].transpose(0, 2, 3, 1) @ corners.T
    return np.asarray((matrices.M[:, part, :, None] + moved).transpose(0, 1, 3, 2))


def _size_at_centre(matrices: AffineMatrix) -> FloatArray:
    """Return the spectral norms (B,) at the centres: computed numbers, 0 where they are not known."""
    return np.asarray(np.linalg.norm(np.where(np.isfinite(matrices.M), matrices.M, 0.0), 2, axis=(1, 2)))


def _size_is_at_most(matrices: AffineMatrix, most: FloatArray) -> NDArray[np.bool_]:
    """Return whether the spectral norm is shown to be at most numbers (B,)."""
    room = most * (1 - 8 * UNIT) - np.sqrt((matrices.rest**2).sum(axis=(1, 2))) * UP
    corners = _at_corners(matrices).transpose(0, 2, 1, 3)
    square = corners @ corners.transpose(0, 1, 3, 2)
    # The product rounds by a part of the square of the Frobenius norm.
    free = (room * room * (1 - 8 * UNIT))[:, None] - PRODUCT * np.trace(square, axis1=2, axis2=3)
    return np.asarray((room > 0) & are_positive(free[..., None, None] * np.eye(6) - square).all(axis=1))


class LegInverse:
    """The inverse P of J of six straight legs over boxes of poses.

    Args:
        robot: six straight legs.
        length: by which moments are divided, and rotations multiplied.
        is_unit: whether J itself is meant too.
    """

    def __init__(self, robot: PosedRobot, length: float, *, is_unit: bool = False) -> None:
        A = ca.vertcat(*[ca.vertcat(row.force, row.moment / length).T for row in robot.rows])
        sizes, at = (
            ca.vertcat(*[ca.norm_2(A[k, :3]) for k in range(6)]),
            np.indices((6, 6), dtype=np.intp).reshape(2, -1),
        )
        self._at = at if is_unit else at[:, :0]
        unit = A / ca.repmat(sizes, 1, 6) if is_unit else SX(0, 6)
        self._dense, self._forms = at, FormArithmetic(robot.z, ca.vertcat(sizes, ca.vec(A.T), ca.vec(unit.T)))

    def __call__(
        self, lower: FloatArray, upper: FloatArray
    ) -> tuple[AffineMatrix, NDArray[np.bool_], FloatArray, AffineMatrix]:
        """Return P over boxes (B, n), where it is known, shares (B, n) of coordinates in its rest, and J if meant."""
        values, leg = self._forms(lower, upper), np.arange(6)
        sizes, matrix = values.forms(slice(0, 6)), values.forms(slice(6, 42)).matrix(self._dense, (6, 6))
        C = inverses(matrix.M)
        holds, bound, shares = matrix.contracted(C)
        P = C * sizes.c[:, None, :]
        # F - A P_0.
        gap = AffineMatrix(-(matrix.M @ P), -(matrix.A @ P[:, None]), matrix.rest @ np.abs(P))
        gap.M[:, leg, leg] += sizes.c
        gap.A[:, :, leg, leg] += sizes.a.transpose(0, 2, 1)
        gap.E[:, leg, leg] += sizes.r
        T = C[:, None] @ gap.A
        rest = (np.abs(C @ gap.M) + np.abs(C) @ gap.rest) * UP
        Q = (rest + np.abs(T).sum(axis=1)) * UP
        known = holds & np.isfinite(Q).all(axis=(1, 2))
        bound, Q = (np.where(known[:, None, None], each, 0.0) for each in (bound, Q))
        right = bound @ Q * UP
        X = np.linalg.solve(np.eye(6) - bound, right) * (1 + _ENLARGED) + _ENLARGED * right
        # (I - B) X >= B Q with a spectral radius below 1: X is a bound.
        known = known & (X >= 0).all(axis=(1, 2)) & ((bound @ X) * UP + right <= X).all(axis=(1, 2))
        J = values.forms(slice(42, None)).matrix(self._at, (6, 6))
        return AffineMatrix(P, T, (rest + X) * UP), np.asarray(known), shares, J


class SingularClaim:
    """The claim that the smallest singular value of J is at least a number, or its condition number at most.

    Args:
        robot: six straight legs.
        length: by which moments are divided.
        bound: the number that is claimed.
        is_condition: whether the condition number is meant.
        change: by how much a singular value changes in the machines that are meant.
    """

    def __init__(
        self, robot: PosedRobot, length: float, bound: float, *, is_condition: bool, change: float = 0.0
    ) -> None:
        self.free, self._inverse = robot.free, LegInverse(robot, length, is_unit=is_condition)
        self._bound, self._change, self._is_condition = bound, change, is_condition

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6), from the sizes of P, and for the condition number those of J."""
        inverse, known, shares, J = self._inverse(lower[:, self.free], upper[:, self.free])
        low, high = 1 / _size_at_centre(inverse), _size_at_centre(J)
        shares = np.abs(inverse.A).sum(axis=(2, 3)) + shares * inverse.E.sum(axis=(1, 2))[:, None]
        if self._is_condition:
            # The smallest singular value changes more: most of the room between the two is left to it.
            least = (high + self._change) / self._bound
            t = least * np.sqrt(np.sqrt((low - self._change) / least))
            flat = _size_is_at_most(J, (t * self._bound * (1 - 4 * UNIT) - self._change) * (1 - 4 * UNIT))
            shares += np.where(flat, 0.0, 1.0)[:, None] * np.abs(J.A).sum(axis=(2, 3))
            known, is_wrong = known & flat, known & (high > low * self._bound * (1 + _WRONG))
        else:
            t = np.full(len(low), self._bound)
            is_wrong = known & (low < self._bound * (1 - _WRONG))
        holds = known & _size_is_at_most(inverse, (1 - 8 * UNIT) / (t + self._change))
        return Attempt(np.asarray(holds), shares, np.asarray(is_wrong))


class ErrorClaim:
    """The claim that errors of legs of at most 1 move the platform, to first order, by at most a number.

    Args:
        robot: six straight legs.
        most: the size claimed.
        is_rotation: whether the rotation is meant, and not the position of the platform's origin.
    """

    def __init__(self, robot: PosedRobot, most: float, *, is_rotation: bool) -> None:
        self.free, self._inverse = robot.free, LegInverse(robot, robot.length)
        self._most = most * robot.length * (1 - 2 * UNIT) if is_rotation else most
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6), at all corners of the boxes and of the errors."""
        inverse, known, shares, _ = self._inverse(lower[:, self.free], upper[:, self.free])
        corners = np.ascontiguousarray(_at_corners(inverse, self._part))
        moves = (corners.reshape(-1, 6) @ _ERRORS).reshape(len(corners), 3, -1)
        worst = np.sqrt((moves * moves).sum(axis=1).max(axis=1))
        sums, sizes = inverse.E[:, self._part].sum(axis=2), np.abs(inverse.A[:, :, self._part]).sum(axis=(2, 3))
        terms = np.abs(inverse.M[:, self._part]).sum(axis=(1, 2)) + sizes.sum(axis=1)
        worst = (worst + np.sqrt((sums * sums).sum(axis=1)) + 64 * UNIT * terms) * UP
        at_centre = np.linalg.norm(inverse.M[:, self._part] @ _ERRORS, axis=1).max(axis=1)
        is_wrong = known & (at_centre > self._most * (1 + _WRONG))
        return Attempt(known & (worst <= self._most), sizes + shares * sums.sum(axis=1)[:, None], is_wrong)


def whole_errors(position: float, rotation: float, eps: float, shortest: float, reach: float) -> tuple[float, float]:
    """Return bounds of the whole errors of a pose, position and rotation; infinite where none is found.

    With errors of second order r in the lengths, ``p = P (eps + r)`` and ``w = Q (eps + r)``, r must be at least
    ``((p + a w)^2 / (l - p - a w) + a w^2) / 2``. A candidate is checked in fractions.

    Args:
        position: P, error of the position to first order for errors of legs of 1.
        rotation: Q, that of the rotation.
        eps: largest error of a leg, length.
        shortest: l, a length below which no leg is.
        reach: a, the largest distance of a joint from the platform's origin.
    """
    numbers, r = (position, rotation, eps, shortest, reach), 0.0
    for _ in range(_STEPS):
        needed = _second_order(r, *numbers)
        if needed <= r < math.inf and _second_order(*map(Fraction, (r, *numbers))) <= r:
            return position * (eps + r) * (1 + 8 * UNIT), rotation * (eps + r) * (1 + 8 * UNIT)
        r = float(needed) * (1 + _ENLARGED)
    return math.inf, math.inf


def _second_order(
    r: _Number, P: _Number, Q: _Number, eps: _Number, shortest: _Number, reach: _Number
) -> float | _Number:
    """Return the errors of second order that these bounds of all errors leave; infinite where they take up a leg."""
    p, w = P * (eps + r), Q * (eps + r)
    along = p + reach * w
    if not along < shortest:
        return math.inf
    return (along * along / (shortest - along) + reach * w * w) / 2


def change_of_jacobian(joints: Legs, tolerance: float, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J, by which every singular value changes at most.

    The unit force of a leg changes by at most ``h = 2 t / l``, and its moment by ``|a| h + t``.

    Args:
        joints: joint centres of the design.
        tolerance: t.
        length: by which moments are divided.
        shortest: l: no leg of any machine is shorter.

    Returns:
        Infinite where the errors may take up a whole leg.
    """
    if not shortest > 0:
        return math.inf
    turned = 2 * tolerance / shortest * UP
    moments = (np.linalg.norm(joints.platform, axis=1) * UP * turned + tolerance) / length * UP
    return float(np.sqrt((turned * turned + moments * moments).sum()) * UP)


class ClearanceClaim:
    """The claim that two legs are at least a distance apart.

    Args:
        robot: six straight legs.
        pair: indices of the legs.
        least: the distance, length.
    """

    def __init__(self, robot: PosedRobot, pair: Sequence[int], least: float) -> None:
        self.free, self._least = robot.free, least
        (foot, arm), (other_foot, other_arm) = (robot.legs[k] for k in pair)
        self._feet = np.array(ca.DM(foot - other_foot)).ravel()
        # Differences of the ends of the two legs, times the scale: from foot to tip, tip to foot, and tip to tip.
        ends = [
            -robot.scale * (robot.position - foot) - other_arm,
            robot.scale * (robot.position - other_foot) + arm,
            arm - other_arm,
        ]
        self._forms = FormArithmetic(robot.z, ca.vertcat(*ends, robot.scale))

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        c, a, r = self._forms(lower[:, self.free], upper[:, self.free]).forms()
        gaps = (c[:, :9] / c[:, 9:]).reshape(-1, 3, 3)
        n = _between(self._feet, gaps[:, 0], gaps[:, 1])
        size = np.sqrt((n * n).sum(axis=1))
        needed = max(self._least, 0.0) * size * UP
        along = (n * self._feet).sum(axis=1)
        holds = along - needed >= PRODUCT * (np.abs(n) @ np.abs(self._feet) + needed)
        shares = np.zeros(a.shape[::2])
        for k in range(3):
            part, factors = [*range(3 * k, 3 * k + 3), 9], np.column_stack([n, -needed])
            slopes = (factors[:, :, None] * a[:, part]).sum(axis=1)
            terms = r[:, part] + PRODUCT * (np.abs(c[:, part]) + np.abs(a[:, part]).sum(axis=2))
            rest = np.abs(slopes).sum(axis=1) + (np.abs(factors) * terms).sum(axis=1)
            fine = (factors * c[:, part]).sum(axis=1) >= rest * UP
            holds &= fine
            shares += np.where(fine[:, None], 0.0, np.abs(slopes))
        # The distance is at most that of two points of the legs.
        return Attempt(holds, shares, np.asarray(size < self._least * (1 - _WRONG)))


def _between(feet: FloatArray, foot_to_tip: FloatArray, tip_to_foot: FloatArray) -> FloatArray:
    """Return vectors (B, 3) from the nearest point of the second leg to that of the first, from those of their ends.

    Any vector is allowed, and a good one shows larger boxes: Newton's step for both, then one after the other.
    """
    d, e = tip_to_foot - feet, feet - foot_to_tip
    dd, ee, de, dg, eg = ((x * y).sum(axis=1) for x, y in ((d, d), (e, e), (d, e), (d, feet), (e, feet)))
    with np.errstate(all="ignore"):
        s = np.clip(np.nan_to_num((de * eg - ee * dg) / (dd * ee - de * de), nan=0.5), 0.0, 1.0)
        for _ in range(_NEAREST):
            t = np.clip(np.nan_to_num((de * s + eg) / ee), 0.0, 1.0)
            s = np.clip(np.nan_to_num((de * t - dg) / dd), 0.0, 1.0)
    return np.asarray(feet + s[:, None] * d - t[:, None] * e)
