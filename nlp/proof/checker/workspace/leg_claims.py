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
from fractions import Fraction
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ..polynomials import UNIT
from .forms import PRODUCT, UP, FormArithmetic, Forms, are_positive, contraction, inverses, off_identity
from .motion_matrix import PosedRobot
from .pose_boxes import Attempt

#: Part of a bound by which a number at a pose must be beyond it to show that a claim is wrong: far more than rounding.
_WRONG = 1e-6
#: Part by which the solution of a system is enlarged, so that it is a bound: its rounding is far below.
_ENLARGED = 1e-6
#: Signs (6, 32) of the errors of legs: a pair of opposite signs has one size.
_ERRORS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))[:32].T
#: Steps in the search of the part of second order of errors, and of the nearest points of two legs.
_STEPS, _NEAREST = 200, 12


class AffineMatrix(NamedTuple):
    """Matrices over B boxes: in ``M + sum_k A_k e_k + [-E, E]``, with (B, 6, 6), (B, n, 6, 6) and (B, 6, 6)."""

    M: FloatArray
    A: FloatArray
    E: FloatArray

    def at_corners(self, part: slice) -> FloatArray:
        """Return the affine parts of some rows at the corners of the boxes, (B, rows, corners, 6)."""
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=self.A.shape[1])))
        moved = self.A[:, :, part].transpose(0, 2, 3, 1) @ corners.T
        return np.asarray((self.M[:, part, :, None] + moved).transpose(0, 1, 3, 2))

    def size_at_centre(self) -> FloatArray:
        """Return the spectral norms (B,) at the centres: computed numbers, 0 where they are not known."""
        return np.asarray(np.linalg.norm(np.where(np.isfinite(self.M), self.M, 0.0), 2, axis=(1, 2)))

    def size_is_at_most(self, most: FloatArray) -> NDArray[np.bool_]:
        """Return whether the spectral norm is shown to be at most numbers (B,)."""
        rest = self.E + PRODUCT * (np.abs(self.M) + np.abs(self.A).sum(axis=1))
        room = most * (1 - 8 * UNIT) - np.sqrt((rest * rest).sum(axis=(1, 2))) * UP
        corners = self.at_corners(slice(0, 6)).transpose(0, 2, 1, 3)
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
        # The line of a leg passes its platform joint: u x (s (p - b) + u) / s is its moment about the origin.
        spans = [(robot.position - foot, arm) for foot, arm in robot.legs]
        A = ca.vertcat(*[ca.vertcat(robot.scale * d + u, ca.cross(u, d) / length).T for d, u in spans])
        sizes = ca.vertcat(*[ca.norm_2(A[k, :3]) for k in range(6)])
        unit = A / ca.repmat(sizes, 1, 6) if is_unit else SX(6, 0)
        self.free, self._forms = list(robot.free), FormArithmetic(robot.z, ca.vertcat(ca.vec(A), sizes, ca.vec(unit)))

    def __call__(
        self, lower: FloatArray, upper: FloatArray
    ) -> tuple[AffineMatrix, NDArray[np.bool_], FloatArray, AffineMatrix]:
        """Return P over boxes (B, 6), where it is known, shares (B, n) of coordinates in its rest, and J if meant."""
        values, leg = self._forms(lower[:, self.free], upper[:, self.free]), np.arange(6)
        (M, A, E), J = (_affine(values.forms(part)) for part in (slice(0, 36), slice(42, None)))
        sizes = values.forms(slice(36, 42))
        C = inverses(M)
        size, moved = np.abs(C), np.abs(C[:, None] @ A)
        terms = np.abs(M) + np.abs(A).sum(axis=1)
        bound = (off_identity(C, M) + size @ (E + PRODUCT * terms) + moved.sum(axis=1)) * UP
        P = C * sizes.c[:, None, :]
        # F - A P_0 at the centre, its slopes, and what both may be off by.
        centre, slopes, radius = -(M @ P), -(A @ P[:, None]), (E + 4 * PRODUCT * terms) @ np.abs(P)
        centre[:, leg, leg] += sizes.c
        slopes[:, :, leg, leg] += sizes.a.transpose(0, 2, 1)
        radius[:, leg, leg] += sizes.r + PRODUCT * (np.abs(sizes.c) + np.abs(sizes.a).sum(axis=2))
        T = C[:, None] @ slopes
        rest = (np.abs(C @ centre) + size @ (radius + PRODUCT * (np.abs(centre) + np.abs(slopes).sum(axis=1)))) * UP
        Q = (rest + np.abs(T).sum(axis=1)) * UP
        holds, v = contraction(np.where(np.isfinite(bound), bound, np.inf))
        known = holds & np.isfinite(Q).all(axis=(1, 2))
        system = np.where(known[:, None, None], np.eye(6) - bound, np.eye(6))
        right = np.where(known[:, None, None], bound @ Q, 0.0) * UP
        X = np.linalg.solve(system, right) * (1 + _ENLARGED) + _ENLARGED * right
        # (I - B) X >= B Q with a spectral radius below 1: X is a bound.
        known = known & (X >= 0).all(axis=(1, 2)) & ((bound @ X) * UP + right <= X).all(axis=(1, 2))
        shares = (moved * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
        return AffineMatrix(P, T, (rest + X) * UP), np.asarray(known), shares, J

    def attempt(self, holds: NDArray[np.bool_], shares: FloatArray, is_wrong: NDArray[np.bool_]) -> Attempt:
        """Return an attempt on boxes of poses, from shares (B, n)."""
        every = np.zeros((len(shares), 6))
        every[:, self.free] = shares
        return Attempt(np.asarray(holds), every, np.asarray(is_wrong))


def _affine(forms: Forms) -> AffineMatrix:
    """Return matrices from the forms of their 36 entries, column after column."""
    M, E = (each.reshape(-1, 6, 6).transpose(0, 2, 1) for each in (forms.c, forms.r))
    return AffineMatrix(M, forms.a.reshape(-1, 6, 6, forms.a.shape[2]).transpose(0, 3, 2, 1), E)


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
        self._inverse = LegInverse(robot, length, is_unit=is_condition)
        self._bound, self._change, self._is_condition = bound, change, is_condition

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6), from the sizes of P, and for the condition number those of J."""
        inverse, known, shares, J = self._inverse(lower, upper)
        low, high = 1 / inverse.size_at_centre(), J.size_at_centre()
        shares = np.abs(inverse.A).sum(axis=(2, 3)) + shares * inverse.E.sum(axis=(1, 2))[:, None]
        if self._is_condition:
            # The smallest singular value changes more: most of the room between the two is left to it.
            least = (high + self._change) / self._bound
            t = least * np.sqrt(np.sqrt((low - self._change) / least))
            flat = J.size_is_at_most((t * self._bound * (1 - 4 * UNIT) - self._change) * (1 - 4 * UNIT))
            shares += np.where(flat, 0.0, 1.0)[:, None] * np.abs(J.A).sum(axis=(2, 3))
            known, is_wrong = known & flat, known & (high > low * self._bound * (1 + _WRONG))
        else:
            t = np.full(len(low), self._bound)
            is_wrong = known & (low < self._bound * (1 - _WRONG))
        holds = known & inverse.size_is_at_most((1 - 8 * UNIT) / (t + self._change))
        return self._inverse.attempt(holds, shares, is_wrong)


class ErrorClaim:
    """The claim that errors of legs of at most 1 move the platform, to first order, by at most a number.

    Args:
        robot: six straight legs.
        most: the size claimed.
        is_rotation: whether the rotation is meant, and not the position of the platform's origin.
    """

    def __init__(self, robot: PosedRobot, most: float, *, is_rotation: bool) -> None:
        self._inverse = LegInverse(robot, robot.length)
        self._most = most * robot.length * (1 - 2 * UNIT) if is_rotation else most
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6), at all corners of the boxes and of the errors."""
        inverse, known, shares, _ = self._inverse(lower, upper)
        corners = np.ascontiguousarray(inverse.at_corners(self._part))
        moves = (corners.reshape(-1, 6) @ _ERRORS).reshape(len(corners), 3, -1)
        worst = np.sqrt((moves * moves).sum(axis=1).max(axis=1))
        sums, sizes = inverse.E[:, self._part].sum(axis=2), np.abs(inverse.A[:, :, self._part]).sum(axis=(2, 3))
        terms = np.abs(inverse.M[:, self._part]).sum(axis=(1, 2)) + sizes.sum(axis=1)
        worst = (worst + np.sqrt((sums * sums).sum(axis=1)) + 64 * UNIT * terms) * UP
        at_centre = np.linalg.norm(inverse.M[:, self._part] @ _ERRORS, axis=1).max(axis=1)
        is_wrong = known & (at_centre > self._most * (1 + _WRONG))
        return self._inverse.attempt(
            known & (worst <= self._most), sizes + shares * sums.sum(axis=1)[:, None], is_wrong
        )


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
    P, Q, limit, a, r = position, rotation, shortest, reach, 0.0
    for _ in range(_STEPS):
        p, w = P * (eps + r), Q * (eps + r)
        along = p + a * w
        if not along < limit:
            break
        needed = 0.5 * (along * along / (limit - along) + a * w * w)  # infinite where a power would overflow
        if needed <= r and _is_enough(*map(Fraction, (r, P, Q, eps, limit, a))):
            return p * (1 + 8 * UNIT), w * (1 + 8 * UNIT)
        r = needed * (1 + _ENLARGED)
    return math.inf, math.inf


def _is_enough(r: Fraction, P: Fraction, Q: Fraction, eps: Fraction, shortest: Fraction, reach: Fraction) -> bool:
    """Return whether errors of second order are at most r."""
    p, w = P * (eps + r), Q * (eps + r)
    along = p + reach * w
    return along < shortest and (along**2 / (shortest - along) + reach * w**2) / 2 <= r


class ClearanceClaim:
    """The claim that two legs are at least a distance apart.

    Args:
        robot: six straight legs.
        pair: indices of the legs.
        least: the distance, length.
    """

    def __init__(self, robot: PosedRobot, pair: tuple[int, int], least: float) -> None:
        self._free, self._least = list(robot.free), least
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
        c, a, r = self._forms(lower[:, self._free], upper[:, self._free]).forms()
        gaps = (c[:, :9] / c[:, 9:]).reshape(-1, 3, 3)
        n = _between(self._feet, gaps[:, 0], gaps[:, 1])
        size = np.sqrt((n * n).sum(axis=1))
        needed = max(self._least, 0.0) * size * UP
        along = (n * self._feet).sum(axis=1)
        holds = along - needed >= PRODUCT * (np.abs(n) @ np.abs(self._feet) + needed)
        shares = np.zeros((len(lower), 6))
        for k in range(3):
            part, factors = [*range(3 * k, 3 * k + 3), 9], np.column_stack([n, -needed])
            slopes = (factors[:, :, None] * a[:, part]).sum(axis=1)
            terms = r[:, part] + PRODUCT * (np.abs(c[:, part]) + np.abs(a[:, part]).sum(axis=2))
            rest = np.abs(slopes).sum(axis=1) + (np.abs(factors) * terms).sum(axis=1)
            fine = (factors * c[:, part]).sum(axis=1) >= rest * UP
            holds &= fine
            shares[:, self._free] += np.where(fine[:, None], 0.0, np.abs(slopes))
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
