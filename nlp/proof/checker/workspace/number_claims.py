"""Claims about second-order terms, and about quantities of six straight legs that are not single expressions.

For six straight legs, with A their rows, F the diagonal matrix of their force norms, and J = F^-1 A with unit rows, the
columns of ``P = A^-1 F`` are the platform's motions for unit changes of the leg lengths, affine up to a remainder
(:func:`.forms.solved`). Norms of affine matrices and vectors are convex: the corners of the box decide.

* The smallest singular value of J is at least t where ``|P| <= 1 / t``, and the largest at most t where ``|J| <= t``.
  The condition number is at most k if, for some t, these bounds are t and k t.
* Leg errors d move the platform by ``P d`` to first order.
* Two legs, as segments between their joints, have at least the distance of the least ``n.(x - y) / |n|`` over their
  ends x and y, for any vector n.

A joint-centre tolerance changes every singular value by at most a known number; so the claims about the nominal robot
have margins: a larger smallest value, and a smaller largest value.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ....case.pose import Free
from ....case.task import Sense
from ....errors import UncoveredError
from ...statement.fixed_robot import Legs
from ...statement.tolerance import is_smooth
from ..polynomials import UNIT
from ..proof_file import ProofError
from .closed_loops import Enclosed
from .forms import ENLARGED, PRODUCT, UP, AffineMatrix, FormArithmetic, solved
from .loop_claims import LoopClaim, PosedLoops
from .motion_matrix import PosedRobot
from .pose_boxes import Attempt
from .statement import RobotsWithinTolerance

#: Relative excess over a bound by which the value at a pose refutes a claim: far more than rounding.
_WRONG = 1e-6
#: Rows and columns of the entries of a diagonal matrix (6, 6).
_DIAGONAL = np.stack([np.arange(6)] * 2)
#: Signs (6, 32) of the leg errors: vectors of opposite signs have the same norm.
_ERRORS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))[:32].T
#: Rows and columns of the entries of matrices (6, 6) and (3, 4).
_DENSE, _ENDS = (np.indices(shape, dtype=np.intp).reshape(2, -1) for shape in ((6, 6), (3, 4)))
#: Fraction of the trace that is subtracted before Cholesky's factorisation: many times the bound of its rounding for
#: matrices (6, 6), which is 8 roundings. A completed factorisation proves the matrix positive definite (S. M. Rump,
#: *Verification of positive definiteness*, BIT 46 (2006)).
_CHOLESKY = 1e-13
#: Steps in the search for the second-order part of errors, and for the nearest points of two legs.
_STEPS, _NEAREST = 200, 12


class NumberClaim(LoopClaim):
    """Claim that a quantity (1, 1) of a robot with closed loops is at most, or at least, a bound.

    Args:
        loops: robot with closed loops.
        number: (1, 1) quantity as an expression of the robot's coordinates.
        sense: sense of the bound: largest or smallest value.
        bound: value of the bound.
    """

    def __init__(self, loops: PosedLoops, number: SX, sense: Sense, bound: float) -> None:
        super().__init__(loops, number)
        self._sign, self._most = sense.sign, sense.sign * bound

    def examined(self, closed: Enclosed) -> Attempt:
        """Try to prove the claim over closed loops."""
        forms, p = self.assembly.followed(self.values(closed).forms(), closed), len(self.free)
        slopes = np.abs(forms.a[:, 0])
        errors = np.sqrt((slopes[:, p:].reshape(len(slopes), -1, 3) ** 2).sum(axis=2)).sum(axis=1)
        middle, spread = self._sign * forms.c[:, 0], slopes[:, :p].sum(axis=1) + errors
        rest = (forms.r[:, 0] + PRODUCT * (np.abs(middle) + spread)) * UP
        holds = middle + spread * UP + rest <= self._most
        return Attempt(np.asarray(holds), closed.shares[:, :p] + slopes[:, :p], np.asarray(middle - rest > self._most))


class SecondOrderClaim:
    """Claim that the second-order terms of a quantity (1, 1), within the tolerance, are at most a bound.

    Raises:
        UncoveredError: an expression has an operation without a rule.
    """

    def __init__(self, robots: RobotsWithinTolerance, expression: SX, bound: float) -> None:
        symbols = robots.symbols
        self.free = [k for k, each in enumerate(robots.root.values) if isinstance(each, Free)]
        self._bound, self._tolerance = bound, symbols.tolerance
        pose, errors = SX.sym("pose", len(self.free)), SX.sym("errors", symbols.errors.numel())
        number = symbols.of(expression, errors, pose)
        if not is_smooth(number):
            raise UncoveredError("a quantity whose derivatives jump")
        second = ca.hessian(number, errors)[0]
        rows, columns = (np.array(each, dtype=int) for each in second.sparsity().get_triplet())
        # Errors that do not occur in the second derivatives are not variables of the forms.
        entries = ca.vertcat(SX(0, 1), second.nz[:])
        own = [k for k in range(errors.numel()) if ca.depends_on(entries, errors[k])]
        _, self._block = np.unique(rows // 3 * errors.numel() + columns // 3, return_inverse=True)
        self._errors, self._entries = len(own), FormArithmetic(ca.vertcat(pose, errors[own]), entries)

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6)."""
        errors = np.full((len(lower), self._errors), self._tolerance)
        values = self._entries(np.hstack([lower[:, self.free], -errors]), np.hstack([upper[:, self.free], errors]))
        squares = np.zeros((self._block.max(initial=-1) + 1, len(lower)))
        np.add.at(squares, self._block, np.abs(values.ends()).max(axis=0) ** 2)
        whole = 0.5 * self._tolerance**2 * np.sqrt(squares).sum(axis=0) * UP
        return Attempt(np.asarray(whole <= self._bound), np.zeros((len(lower), len(self.free))))


@np.errstate(all="ignore")
def are_positive(matrices: FloatArray) -> NDArray[np.bool_]:
    """Return whether symmetric matrices (..., n, n) are positive definite; their lower triangles are read."""
    n, good = matrices.shape[-1], np.asarray(np.isfinite(matrices).all(axis=(-2, -1)))
    M = matrices - _CHOLESKY * np.abs(np.trace(matrices, axis1=-2, axis2=-1))[..., None, None] * np.eye(n)
    for k in range(n):
        pivot = M[..., k, k]
        good = np.asarray(good & (pivot > 0))
        column = M[..., k + 1 :, k] / np.sqrt(np.where(good, pivot, 1.0))[..., None]
        M[..., k + 1 :, k + 1 :] -= column[..., :, None] * column[..., None, :]
    return good


def _size_at_centre(matrices: AffineMatrix) -> FloatArray:
    """Return the spectral norms (B,) at the centres, computed in doubles; 0 where a norm is not known."""
    return np.asarray(np.linalg.norm(np.where(np.isfinite(matrices.M), matrices.M, 0.0), 2, axis=(1, 2)))


def _size_is_at_most(matrices: AffineMatrix, most: FloatArray) -> NDArray[np.bool_]:
    """Return whether the spectral norm is proved to be at most the given numbers (B,)."""
    room = most * (1 - 8 * UNIT) - np.sqrt((matrices.rest**2).sum(axis=(1, 2))) * UP
    corners = matrices.corners()
    square = corners @ corners.transpose(0, 1, 3, 2)
    # The rounding of the product is bounded by a fraction of the squared Frobenius norm.
    free = (room * room * (1 - 8 * UNIT))[:, None] - PRODUCT * np.trace(square, axis1=2, axis2=3)
    return np.asarray((room > 0) & are_positive(free[..., None, None] * np.eye(6) - square).all(axis=1))


class LegInverse:
    """Inverse P of J of six straight legs over boxes of poses.

    A length divides moments and multiplies rotations. If ``is_unit`` is true, J with unit rows is enclosed too.
    """

    def __init__(self, robot: PosedRobot, length: float, *, is_unit: bool = False) -> None:
        self.free = robot.free
        A = ca.vertcat(*[ca.vertcat(row.force, row.moment / length).T for row in robot.rows])
        sizes = ca.vertcat(*[ca.norm_2(A[k, :3]) for k in range(6)])
        unit = A / ca.repmat(sizes, 1, 6) if is_unit else SX(0, 6)
        self._is_unit, self._forms = is_unit, robot.forms(ca.vertcat(sizes, ca.vec(A.T), ca.vec(unit.T)))

    def inverse(
        self, lower: FloatArray, upper: FloatArray
    ) -> tuple[AffineMatrix, NDArray[np.bool_], FloatArray, AffineMatrix]:
        """Return P over boxes (B, 6), whether P is known, and shares (B, n) of the coordinates in its remainder.

        The last result is J if ``is_unit`` is true; otherwise it has rows of J times the norms of their forces.
        """
        values = self._forms(lower[:, self.free], upper[:, self.free])
        sizes, matrix = values.forms(slice(0, 6)), values.forms(slice(6, 42)).matrix(_DENSE, (6, 6))
        inverse, known, shares = solved(matrix, sizes.matrix(_DIAGONAL, (6, 6)))
        J = values.forms(slice(42, None)).matrix(_DENSE, (6, 6)) if self._is_unit else matrix
        return inverse, known, shares, J


class SingularClaim(LegInverse):
    """Claim that the smallest singular value of J is at least a bound, or that its condition number is at most a bound.

    A length divides moments. Within the tolerance singular values change by at most ``change``.
    """

    def __init__(
        self, robot: PosedRobot, length: float, bound: float, *, is_condition: bool, change: float = 0.0
    ) -> None:
        super().__init__(robot, length, is_unit=is_condition)
        self._bound, self._change, self._is_condition = bound, change, is_condition

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6), from the norm of P, and for the condition number also that of J."""
        inverse, known, shares, J = self.inverse(lower, upper)
        low, high = 1 / _size_at_centre(inverse), _size_at_centre(J)
        shares = np.abs(inverse.A).sum(axis=(2, 3)) + shares * inverse.E.sum(axis=(1, 2))[:, None]
        if self._is_condition:
            # The smallest singular value varies more, so it gets most of the room between both bounds.
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


class ErrorClaim(LegInverse):
    """Bound on the first-order pose error: ``|P d|`` over a box of poses for all leg errors ``|d_i| <= 1``.

    The pose error is the rotation error, or the position error of the platform's origin.
    """

    def __init__(self, robot: PosedRobot, most: float, *, is_rotation: bool) -> None:
        super().__init__(robot, robot.length)
        self._most = most * robot.length * (1 - 2 * UNIT) if is_rotation else most
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6), at all corners of a box and for all signs of the six leg errors."""
        inverse, known, shares, _ = self.inverse(lower, upper)
        moves = np.ascontiguousarray(inverse.part(self._part).corners()) @ _ERRORS
        worst = np.sqrt((moves * moves).sum(axis=2).max(axis=(1, 2)))
        sums, sizes = inverse.E[:, self._part].sum(axis=2), np.abs(inverse.A[:, :, self._part]).sum(axis=(2, 3))
        terms = np.abs(inverse.M[:, self._part]).sum(axis=(1, 2)) + sizes.sum(axis=1)
        worst = (worst + np.sqrt((sums * sums).sum(axis=1)) + 64 * UNIT * terms) * UP
        at_centre = np.linalg.norm(inverse.M[:, self._part] @ _ERRORS, axis=1).max(axis=1)
        is_wrong = known & (at_centre > self._most * (1 + _WRONG))
        return Attempt(known & (worst <= self._most), sizes + shares * sums.sum(axis=1)[:, None], is_wrong)


def whole_errors(position: float, rotation: float, eps: float, shortest: float, reach: float) -> tuple[float, float]:
    """Return bounds of the whole pose errors, position and rotation; infinite where none is known.

    With second-order errors r in the lengths, ``p = P (eps + r)`` and ``w = Q (eps + r)``, where r must be at least
    ``((p + a w)^2 / (l - p - a w) + a w^2) / 2``. Iteration in fractions finds such an r.

    Args:
        position: P, bound of the first-order position error for leg errors of 1.
        rotation: Q, bound of the first-order rotation error for leg errors of 1.
        eps: largest error of a leg, length.
        shortest: l, lower bound of all leg lengths.
        reach: a, largest distance of a joint from the platform's origin.
    """
    P, Q, error, leg, arm = map(Fraction, (position, rotation, eps, shortest, reach))
    r = 0.0
    for _ in range(_STEPS):
        p, w = P * (error + Fraction(r)), Q * (error + Fraction(r))
        along = p + arm * w
        if along >= leg:
            break
        needed = (along**2 / (leg - along) + arm * w**2) / 2
        if needed <= r:
            return float(p) * (1 + 8 * UNIT), float(w) * (1 + 8 * UNIT)
        if needed > leg:
            break
        r = float(needed) * (1 + ENLARGED)
    return math.inf, math.inf


def change_of_jacobian(joints: Legs, tolerance: float, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J, and so of the change of every singular value.

    Within a tolerance t the unit force of a leg changes by at most ``h = 2 t / l``, with l the shortest length of a leg
    of all robots, and its moment by ``|a| h + t``. A length divides moments. The bound is infinite if errors may be as
    long as a leg.
    """
    if not shortest > 0:
        return math.inf
    turned = 2 * tolerance / shortest * UP
    moments = (np.linalg.norm(joints.platform, axis=1) * UP * turned + tolerance) / length * UP
    return float(np.sqrt((turned * turned + moments * moments).sum()) * UP)


class ClearanceClaim:
    """Claim that two legs, given by their indices, have at least a distance."""

    def __init__(self, robot: PosedRobot, pair: Sequence[int], least: float) -> None:
        self.free, self._least = robot.free, least
        (foot, arm), (other_foot, other_arm) = (robot.legs[k] for k in pair)
        if not (foot - other_foot).is_constant():
            raise ProofError("leg clearances cannot be proved while a dimension changes along the path")
        self._feet = np.array(ca.DM(foot - other_foot)).ravel()
        # Vectors between the ends of the two legs, times the scale: from foot to tip, tip to foot, and tip to tip.
        spans = robot.scale * (robot.position - foot), robot.scale * (robot.position - other_foot)
        ends = -spans[0] - other_arm, spans[1] + arm, arm - other_arm
        self._forms = robot.forms(ca.vertcat(*[ca.vertcat(end, robot.scale) for end in ends]))

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6)."""
        matrix = self._forms(lower[:, self.free], upper[:, self.free]).forms().matrix(_ENDS, (3, 4))
        gaps = matrix.M[:, :, :3] / matrix.M[:, :, 3:]
        n = _between(self._feet, gaps[:, 0], gaps[:, 1])
        distance, largest = np.sqrt((n * n).sum(axis=1)), np.abs(n).max(axis=1)
        # Any vector but zero is valid. Its largest component becomes 1, so that its size does not underflow.
        is_vector = largest > 0
        n = n / np.where(is_vector, largest, 1.0)[:, None]
        needed = max(self._least, 0.0) * np.sqrt((n * n).sum(axis=1)) * UP
        along = (n * self._feet).sum(axis=1)
        holds = along - needed >= PRODUCT * (np.abs(n) @ np.abs(self._feet) + needed)
        holds &= is_vector | (self._least <= 0)
        factors = np.column_stack([n, -needed])[:, :, None]
        slopes, rest = np.abs(matrix.A @ factors[:, None])[..., 0], (matrix.rest @ np.abs(factors))[..., 0]
        fine = (matrix.M @ factors)[..., 0] >= (slopes.sum(axis=1) + rest) * UP
        shares = np.where(fine[:, None], 0.0, slopes).sum(axis=2)
        # The distance of the legs is at most that of any two of their points.
        return Attempt(holds & fine.all(axis=1), shares, np.asarray(distance < self._least * (1 - _WRONG)))


def _between(feet: FloatArray, foot_to_tip: FloatArray, tip_to_foot: FloatArray) -> FloatArray:
    """Return vectors (B, 3) between the nearest points of two legs, towards the first leg, from the legs' end points.

    Any vector is valid, but a good one proves larger boxes: a joint Newton step, then one step for each leg.
    """
    d, e = tip_to_foot - feet, feet - foot_to_tip
    dd, ee, de, dg, eg = ((x * y).sum(axis=1) for x, y in ((d, d), (e, e), (d, e), (d, feet), (e, feet)))
    with np.errstate(all="ignore"):
        s = np.clip(np.nan_to_num((de * eg - ee * dg) / (dd * ee - de * de), nan=0.5), 0.0, 1.0)
        for _ in range(_NEAREST):
            t = np.clip(np.nan_to_num((de * s + eg) / ee), 0.0, 1.0)
            s = np.clip(np.nan_to_num((de * t - dg) / dd), 0.0, 1.0)
    return np.asarray(feet + s[:, None] * d - t[:, None] * e)
