"""Bounds of the singular values of J over boxes of poses, for any robot whose loops are solved in closed form.

With C the pseudo-inverse of J at the middle of a box, ``(C J)^-1 C`` is a left inverse of J; its norm is at least that
of the pseudo-inverse, which is 1 over the smallest singular value. As in :mod:`..inverse` its part of first order is
affine in the coordinates, ``C - C (J - J0) C``, and the terms of higher order are at most ``B^2 (I - B)^-1 |C|`` with
``B >= |C (J - J0)|``. A convex norm of the affine part is largest at a corner of the box.
"""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser
from ..ranks.krawczyk import by_centres
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from .bound_search import Bounds

#: Part of its size by which a computed number is moved outwards: rounding of products and of LAPACK.
_ROUNDING = 1e-10
#: Squarings in the norm of an inverse: two equal singular values make it 2 % too large.
_SQUARINGS = 4


class Spectrum:
    """Smallest singular value, or minus the condition number, of J over a workspace.

    Args:
        problem: the robot, without dependent coordinates.
        length: by which moments about the platform's origin are divided.
        is_condition: whether minus the condition number is meant, whose smallest value is that of the worst pose.
        family: all machines that are meant, whose errors count entry by entry; values are those of the design.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(
        self,
        problem: Problem,
        length: float,
        *,
        is_condition: bool,
        family: Family | None = None,
    ) -> None:
        self._problem, self._is_condition = problem, is_condition
        scale = ca.diag(ca.vertcat(SX.ones(3), problem.length / length * SX.ones(3)))
        J = ca.densify(problem.jacobian @ scale)
        self._rows = J.shape[0]
        self._function = ca.Function("J", [problem.z], [ca.vec(J)])
        own, coordinates = (J, problem.z) if family is None else (family.jacobian @ scale, family.coordinates)
        self._encloser = Encloser(coordinates, ca.vec(ca.densify(own)))
        self._errors = np.full(
            int(coordinates.numel() - problem.z.numel()), 0.0 if family is None else family.tolerance
        )
        self._corners = np.array(list(itertools.product((-1.0, 1.0), repeat=len(problem.free))))

    def values(self, points: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, 6)."""
        flat = self._function(points[:, list(self._problem.free)].T).full()
        J = flat.T.reshape(-1, 6, self._rows).transpose(0, 2, 1)
        known = np.isfinite(J).all(axis=(1, 2))
        values = np.linalg.svd(np.where(known[:, None, None], J, 0.0), compute_uv=False)
        with np.errstate(all="ignore"):
            found = -values[:, 0] / values[:, -1] if self._is_condition else values[:, -1]
        return np.asarray(np.where(known, found, np.nan))

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""
        free = list(self._problem.free)
        count, f, m = len(lower), len(free), self._rows
        errors = np.tile(self._errors, (count, 1))
        c, a, r = self._encloser(np.hstack([lower[:, free], -errors]).T, np.hstack([upper[:, free], errors]).T)
        a, r = a[:, :, :f], r + by_centres(a[:, :, f:])
        J0 = c.reshape(count, 6, m).transpose(0, 2, 1)
        R = r.reshape(count, 6, m).transpose(0, 2, 1)
        J = a.transpose(0, 2, 1).reshape(count, f, 6, m).transpose(0, 1, 3, 2)
        known = np.asarray(np.isfinite(J0).all(axis=(1, 2)) & np.isfinite(R).all(axis=(1, 2)))
        J0 = np.where(known[:, None, None], J0, np.eye(m, 6))
        with np.errstate(all="ignore"):
            C = np.linalg.pinv(J0, rcond=1e-14)
            size = np.abs(C)
            slopes = C[:, None] @ J
            second = size @ R + np.abs(C @ J0 - np.eye(6)) + _ROUNDING * (size @ np.abs(J0))
            first = np.abs(slopes).sum(axis=1)
            B = first + second
            known &= np.isfinite(B).all(axis=(1, 2))
            B = np.where(known[:, None, None], B, 0.0)
            # |(I + C (J - J0))^-1 C| <= X with (I - B) X >= |C|: an M-matrix with a nonnegative solution.
            X = _solutions(np.eye(6) - B, size) * (1 + 1e-6)
            known &= (X >= 0).all(axis=(1, 2)) & (size <= X - B @ X).all(axis=(1, 2))
            rest = np.where(known[:, None, None], (second + B @ B) @ X, np.inf)
            affine = C[:, None] - np.einsum("sf,bfij->bsij", self._corners, slopes @ C[:, None])
            norm = _schatten(affine) + np.sqrt((rest * rest).sum(axis=(1, 2))) * (1 + _ROUNDING)
            found = 1 / norm
            if self._is_condition:
                whole = J0[:, None] + np.einsum("sf,bfij->bsij", self._corners, J)
                largest = np.linalg.norm(np.nan_to_num(whole), ord=2, axis=(2, 3)).max(axis=1)
                found = -(largest * (1 + _ROUNDING) + np.sqrt((R * R).sum(axis=(1, 2))) * (1 + _ROUNDING)) * norm
        shares = np.zeros((count, 6))
        shares[:, free] = np.nan_to_num((slopes**2).sum(axis=(2, 3)))
        wide = (upper - lower) / np.where(self._problem.box.upper > self._problem.box.lower, 1.0, np.inf)
        shares = np.where(known[:, None], shares, wide)
        floor = -np.inf if self._is_condition else 0.0
        return Bounds(np.where(known & np.isfinite(found), found, floor), shares)


def _solutions(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solutions of systems (B, 6, 6) with right sides (B, 6, k); -1 for singular ones."""
    good = np.abs(np.linalg.det(matrices)) > 0
    found: FloatArray = np.full_like(right, -1.0)
    found[good] = np.linalg.solve(matrices[good], right[good])
    return found


def _schatten(matrices: FloatArray) -> FloatArray:
    """Return the largest norm (B,) of matrices (B, S, 6, m): convex, and not below the largest singular value."""
    square = matrices @ matrices.transpose(0, 1, 3, 2)
    trace = np.trace(square, axis1=2, axis2=3)
    power = square / trace[:, :, None, None]
    for _ in range(_SQUARINGS):
        power = power @ power
    norm = np.sqrt(trace) * np.trace(power, axis1=2, axis2=3) ** (0.5 / 2**_SQUARINGS)
    return np.asarray(norm.max(axis=1) * (1 + _ROUNDING))
