"""Bounds of the singular values of J over boxes of poses, for any robot.

The smallest singular value of J is at least 1 over the norm of any left inverse, whose part of first order in the
coordinates is known (:mod:`.left_inverse`). The norm ``(tr (P P')^n)^(1/2n)`` is convex in P, not below the largest
singular value and close to it, so that its largest value over the affine part is that at a corner of a box. The largest
singular value of J itself is bounded likewise. The Frobenius norm of a rest bounds what it adds.

Errors of joint centres count as further terms of the rows. Those of six straight legs, up to t, change J by a matrix
whose Frobenius norm bounds the change of every singular value (H. Weyl). With l the shortest length of a leg of any
machine, the unit force of a leg changes by at most ``h = 2 t / l``, and its moment about the platform's origin by
``|a| h + t``.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from .....models import FloatArray
from ...enclosure.forms import Forms
from ...statement.machine import JointErrors, Legs
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import ToleranceModel
from ..tolerance.leg_errors import change_of_rows, worst_rows
from .bound_search import Bounds
from .left_inverse import ROUNDING, RowsOver, at_corners, left_inverses, rows_over

#: Squarings in the norm of an inverse: its n is 2 to this power. Two equal singular values make it 2 % too large.
_SQUARINGS = 4


class SingularValues:
    """Smallest singular value of J, or minus its condition number, over boxes and at points.

    Bounds are those of all machines that are meant. Values are those of the design; with legs, of the machine that is
    worst to first order at each point.

    Args:
        problem: the robot.
        length: by which moments about the platform's origin are divided.
        is_condition: whether minus the condition number is meant, whose smallest value is that of the worst pose.
        family: all machines that are meant, whose errors count entry by entry; None for the design alone.
        legs: joint centres of six straight legs with the tolerance that is meant; None for another robot.
        shortest: no leg of any machine is shorter over the workspace; used with a tolerance of legs alone.

    Attributes:
        entries: (7 m, 1) the rows of J, column by column, and their sizes.
    """

    def __init__(
        self,
        problem: Problem,
        length: float,
        *,
        is_condition: bool,
        family: ToleranceModel | None = None,
        legs: Legs | None = None,
        shortest: float = 0.0,
    ) -> None:
        self._problem, self._length, self._is_condition = problem, length, is_condition
        self._legs = legs if legs is not None and legs.tolerance else None
        self._change = 0.0 if self._legs is None else change_of_rows(self._legs, length, shortest)
        self._scale = np.array([1.0, 1.0, 1.0, *[problem.length / length] * 3])
        self.family, meant = family, problem.scaled if family is None else family.scaled
        self.entries = ca.vertcat(ca.vec(ca.densify(meant.rows)), meant.sizes)
        self._jacobian = ca.Function("J", [problem.z], [ca.densify(problem.scaled.jacobian)])

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, n) of the problem."""
        if self._legs is not None:
            J = worst_rows(self._legs, self._problem.box, self._problem.pose_of(z), self._length, self._is_condition)[0]
            with np.errstate(all="ignore"):
                J = J / np.linalg.norm(J[:, :, :3], axis=2, keepdims=True) / [1, 1, 1, *[self._length] * 3]
        else:
            flat = self._jacobian(z.T).full()
            J = flat.reshape(len(flat), len(z), 6).transpose(1, 0, 2) * self._scale
        known = np.asarray(np.isfinite(J).all(axis=(1, 2)))
        values = np.linalg.svd(np.where(known[:, None, None], J, 0.0), compute_uv=False)
        with np.errstate(all="ignore"):
            found = -values[:, 0] / values[:, -1] if self._is_condition else values[:, -1]
        return np.asarray(np.where(known, found, np.nan))

    def errors(self, z: FloatArray) -> JointErrors | None:
        """Return the errors of the legs that are worst at a point (n,) to first order; None for the design."""
        if self._legs is None:
            return None
        y = self._problem.pose_of(z[None])
        _, base, platform = worst_rows(self._legs, self._problem.box, y, self._length, self._is_condition)
        return JointErrors(base[0], platform[0])

    def over(self, forms: Forms, count: int, errors: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        rows = rows_over(forms, self._scale, count, errors)
        inverse = left_inverses(rows)
        with np.errstate(all="ignore"):
            norm = _schatten(inverse.at_corners(slice(0, 6))) + _frobenius(inverse.rest)
            least = np.maximum(1 / norm - self._change, 0.0) if self._change else 1 / norm
            found = least
            if self._is_condition:
                largest = _largest(rows) + self._change
                found = -largest / least if self._change else -largest * norm
        floor = -np.inf if self._is_condition else 0.0
        return Bounds(np.where(np.isfinite(found), found, floor), inverse.shares)


def _schatten(matrices: FloatArray) -> FloatArray:
    """Return the largest norm (B,) of matrices (B, S, 6, m): convex, and not below the largest singular value."""
    square = matrices @ matrices.transpose(0, 1, 3, 2)
    trace = np.trace(square, axis1=2, axis2=3)
    power = square / trace[:, :, None, None]
    for _ in range(_SQUARINGS):
        power = power @ power
    norm = np.sqrt(trace) * np.trace(power, axis1=2, axis2=3) ** (0.5 / 2**_SQUARINGS)
    return np.asarray(norm.max(axis=1) * (1 + ROUNDING))


def _largest(rows: RowsOver) -> FloatArray:
    """Return an upper bound (B,) of the largest singular value of J."""
    d = rows.spread(rows.bend) + rows.slack
    # 1 / (1 + e) = 1 - e + e^2 / (1 + e) for the deviation e of a size from 1.
    room = np.where(d < 1, 1 - d, np.nan)
    linear = rows.terms - rows.A[:, None] * rows.bend[..., None]
    rest = rows.rest / room[..., None] + (rows.spread(rows.terms) * (d / room)[..., None])
    rest += np.abs(rows.A) * (rows.slack + d * d / room)[..., None]
    rest += rows.spread(linear[:, rows.count :])
    corners = rows.A[:, None] + at_corners(linear[:, : rows.count])
    known = np.asarray(np.isfinite(corners).all(axis=(1, 2, 3)) & np.isfinite(rest).all(axis=(1, 2)))
    values = np.linalg.norm(np.where(known[:, None, None, None], corners, 0.0), ord=2, axis=(2, 3)).max(axis=1)
    return np.where(known, values * (1 + ROUNDING) + _frobenius(rest), np.inf)


def _frobenius(r: FloatArray) -> FloatArray:
    """Return the Frobenius norms (B,) of matrices (B, r, c), not below their exact values."""
    return np.asarray(np.sqrt((r * r).sum(axis=(1, 2))) * (1 + ROUNDING))
