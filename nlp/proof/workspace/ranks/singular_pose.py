"""A singular pose by Newton's method, from poses at which the smallest singular value is small.

A pose is singular where ``M(z) v = 0`` for a unit vector v, with closed loops: equations in z and v, solved by Newton's
method with steps of least squares. It converges where the determinant changes its sign, and more slowly where it
touches 0 without a change of sign. What it finds is computed, not proved: J at the pose, with unit rows and moments
divided by a length, has a singular value of at most 1e-10 of the largest.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from .....models import FloatArray
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family

#: Singular value, in parts of the largest, below which a pose counts as singular.
SINGULAR = 1e-10
#: Steps of Newton's method: where a determinant touches 0, each one halves the distance.
_STEPS = 60
#: Steps in which the smallest singular value must become smaller by a tenth: at the edge of a workspace it does not.
_PATIENCE = 8
#: Singular value of M, in parts of the largest, below which J is looked at.
_NEAR = 1e-6
#: Largest step of a coordinate, in parts of its size.
_STEP = 0.25
#: Largest residual of closed loops.
_CLOSED = 1e-9
#: Singular values below this part of the largest are zero in a step.
_DEPENDENT = 1e-12
#: Smallest part of the platform's motion in the null vector: below, passive joints alone move.
_MOVES = 1e-3


class SingularPose:
    """Newton's method for a singular pose of one matrix of a robot, or of a machine within a tolerance.

    Args:
        problem: the robot.
        matrix: whose rank is judged.
        family: all machines, whose errors are further coordinates; None for the design alone.
    """

    def __init__(self, problem: Problem, matrix: RankMatrix, family: Family | None = None) -> None:
        self._problem, self._matrix, self._family = problem, matrix, family
        meant = problem if family is None else family
        self._size = meant.size
        z = problem.z if family is None else family.coordinates
        M = ca.densify(matrix.matrix)
        v = ca.SX.sym("v", M.shape[1])
        product = M @ v
        self._values = ca.Function("values", [z], [M])
        self._equations = ca.Function(
            "singular", [z, v], [meant.equations, product, ca.jacobian(meant.equations, z), ca.jacobian(product, z)]
        )
        self._jacobian = ca.Function("J", [z], [ca.densify(meant.scaled.jacobian)])

    def smallest(self, z: FloatArray) -> float:
        """Return the singular value that is 0 at a singular pose, in parts of the largest; infinite without one."""
        M = self._values(z).full()
        J = self._jacobian(z).full()
        rank = M.shape[1] - self._matrix.nullity
        if not (np.isfinite(M).all() and np.isfinite(J).all()) or rank < 1 or len(M) < rank:
            return float("inf")
        values, right = np.linalg.svd(M)[1:]
        found = float(values[rank - 1] / values[0])
        if not self._matrix.nullity:
            values = np.linalg.svd(J, compute_uv=False)
            found = float(values[5] / values[0]) if len(values) > 5 else 0.0
        return found if float(np.abs(right[rank - 1, :6]).max()) > _MOVES else float("inf")

    def search(self, z: FloatArray) -> FloatArray | None:
        """Return a singular pose (n,) of the workspace near a point (n,); None where none is found.

        Points of a family are (n + 3 m,), with the errors of a machine within the tolerance.
        """
        z, size = z.copy(), self._size
        M = self._values(z).full()
        if not np.isfinite(M).all():
            return None
        v = self._direction(M)
        seen: list[float] = []
        for _ in range(_STEPS):
            _, values, right = np.linalg.svd(M)
            rank = len(v) - self._matrix.nullity
            seen.append(float(values[rank - 1] / values[0]) if len(values) >= rank else 0.0)
            if seen[-1] <= _NEAR and self.is_singular(z):
                return z
            if len(seen) > _PATIENCE and not seen[-1] < 0.9 * seen[-1 - _PATIENCE]:
                return None
            parts = [each.full() for each in self._equations(z, v)]
            if not all(np.isfinite(each).all() for each in parts):
                return None
            g, r, by_z, turned = parts
            k, n, c = len(g), len(z), len(v)
            basis = right[c - self._matrix.nullity :]
            rows = np.zeros((k + len(r) + 1 + len(basis), n + c))
            rows[:k, :n], rows[k : k + len(r), :n], rows[k : k + len(r), n:] = by_z * size, turned * size, M
            rows[k + len(r), n:], rows[k + len(r) + 1 :, n:] = v, basis
            right = np.concatenate([g.ravel(), r.ravel(), [0.5 * (v @ v - 1)], basis @ v])
            step = np.linalg.lstsq(rows, -right, rcond=_DEPENDENT)[0]
            step *= min(1.0, _STEP / max(float(np.abs(step[:n]).max(initial=0.0)), 1e-300))
            z, v = self._inside(z + size * step[:n]), v + step[n:]
            v /= np.linalg.norm(v)
            M = self._values(z).full()
            if not np.isfinite(M).all():
                return None
        return z if self.is_singular(z) else None

    def slopes(self, z: FloatArray) -> FloatArray | None:
        """Return the derivatives (n + 3 m,) of the smallest singular value at a closed point; None without any.

        To first order it is ``u . M v`` with its vectors u and v; dependent coordinates follow from the others.
        """
        M = self._values(z).full()
        if not np.isfinite(M).all():
            return None
        rank = M.shape[1] - self._matrix.nullity
        left, _, right = np.linalg.svd(M)
        _, _, by_z, turned = (each.full() for each in self._equations(z, right[rank - 1]))
        found = left[:, rank - 1] @ turned
        dependent = list(self._problem.dependent)
        if dependent:
            found = found - found[dependent] @ np.linalg.pinv(by_z[:, dependent]) @ by_z
        return found if np.isfinite(found).all() else None

    def is_singular(self, z: FloatArray) -> bool:
        """Return whether a point (n,) is a pose of the workspace, with closed loops, that is singular."""
        problem = self._problem
        if problem.equations.numel():
            g = self._equations(z, np.zeros(problem_columns(self._matrix)))[0].full()
            if not float(np.abs(g).max()) <= _CLOSED:
                return False
        return problem.box.holds(problem.pose_of(z)) and self.smallest(z) <= SINGULAR

    def _direction(self, M: FloatArray) -> FloatArray:
        """Return the unit vector that a matrix shrinks most, among those across its null space."""
        return np.asarray(np.linalg.svd(M)[2][M.shape[1] - self._matrix.nullity - 1])

    def _inside(self, z: FloatArray) -> FloatArray:
        """Return a point with the numbers of its pose moved into the workspace."""
        free = self._problem.free
        z = z.copy()
        z[: len(free)] = self._problem.box.clipped(self._problem.pose_of(z)[None])[0][list(free)]
        return z if self._family is None else self._family.within(z)


def problem_columns(matrix: RankMatrix) -> int:
    """Return the number of columns of a matrix."""
    return int(matrix.matrix.shape[1])
