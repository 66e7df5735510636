"""A singular pose by Newton's method, from poses at which the smallest singular value is small.

A pose is singular where ``M(z) v = 0`` for a unit vector v, with closed loops: equations in z and v, solved by Newton's
method with steps of least squares. It converges where the determinant changes its sign, and more slowly where it
touches 0 without a change of sign. What it finds is computed, not proved: J at the pose, with unit rows and moments
divided by a length, has a singular value of at most 1e-10 of the largest.

Source: 1. M. Frank, P. Wolfe, *An algorithm for quadratic programming*, Naval Research Logistics Quarterly 3 (1956).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import casadi as ca
import numpy as np

from .....models import FloatArray, frozen_array
from ...statement.machine import CentreErrors, JointErrors
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import ToleranceModel
from .loop_boxes import Examined, LoopBoxes

#: Singular value, in parts of the largest, below which a pose counts as singular.
SINGULAR = 1e-10
#: Steps of Newton's method: where a determinant touches 0, each one halves the distance.
_STEPS = 60
#: Steps in which the smallest singular value must become smaller by a tenth: at the edge of a workspace it does not.
_PATIENCE = 8
#: Singular value of M, in parts of the largest, below which J is looked at.
_NEAR = 1e-6
#: Steps toward machines with smaller singular values.
_MACHINES = 6
#: Largest step of a coordinate, in parts of its size.
_STEP = 0.25
#: Largest residual of closed loops.
_CLOSED = 1e-9
#: Singular values below this part of the largest are zero in a step.
_DEPENDENT = 1e-12
#: Smallest part of the platform's motion in the null vector: below, passive joints alone move.
_MOVES = 1e-3


#: Smallest singular value, in parts of the largest, from which Newton's method looks for a singular pose, and most
#: attempts.
_SMALL, _MOST = 0.1, 24
#: Number of boxes after which a singular machine is looked for first; later ones are twice as many each.
_FIRST = 64
#: Part of the value before at which it tries again.
_SMALLER = 0.6
#: Random poses from which Newton's method looks for a singular one, and number of the worst that are tried.
_POSES, _TRIED, _SEED = 2048, 8, 0
#: How a singular pose of Newton's method is known.
BY_NEWTON = "found singular to 1e-10 by Newton's method"


class SingularPose:
    """Newton's method for a singular pose of one matrix of a robot, or of a machine within a tolerance.

    Args:
        problem: the robot.
        matrix: whose rank is judged.
        family: all machines, whose errors are further coordinates; None for the design alone.
    """

    def __init__(self, problem: Problem, matrix: RankMatrix, family: ToleranceModel | None = None) -> None:
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
        # The direction that M shrinks most, among those across its null space.
        v = np.linalg.svd(M)[2][M.shape[1] - self._matrix.nullity - 1]
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
            g = self._equations(z, np.zeros(self._matrix.matrix.shape[1]))[0].full()
            if not float(np.abs(g).max()) <= _CLOSED:
                return False
        return problem.box.holds(problem.pose_of(z)) and self.smallest(z) <= SINGULAR

    def _inside(self, z: FloatArray) -> FloatArray:
        """Return a point with the numbers of its pose moved into the workspace."""
        free = self._problem.free
        z = z.copy()
        z[: len(free)] = self._problem.box.clipped(self._problem.pose_of(z)[None])[0][list(free)]
        return z if self._family is None else self._family.within(z)


class SingularMachine:
    """Search for a machine within a tolerance that is singular at a pose.

    The smallest singular value of the design is made smaller by errors of the joint centres, each along its derivative:
    the method of Frank and Wolfe [1], whose steps stay within the tolerance. From each machine on the way Newton's
    method looks for a singular one, at the pose or near it.

    Args:
        family: the machines.
        matrix: whose rank is judged, one of the two of the family.
    """

    def __init__(self, family: ToleranceModel, matrix: RankMatrix) -> None:
        self._family, self._newton, self._loops = family, SingularPose(family.problem, matrix, family), family.loops

    def search(self, z: FloatArray) -> FloatArray | None:
        """Return the coordinates (n + 3 m,) of a singular machine and its pose, near a pose (n,); None without one."""
        family, n = self._family, len(self._family.problem.start)
        dependent = list(family.problem.dependent)
        machine: FloatArray | None = family.exact(z)
        for step in range(_MACHINES):
            if dependent and machine is not None:
                machine = self._loops.closed(machine, dependent)
            slopes = None if machine is None else self._newton.slopes(machine)
            if machine is None or slopes is None:
                return None
            parts = slopes[n:].reshape(-1, 3)
            sizes = np.linalg.norm(parts, axis=1, keepdims=True)
            unit = np.divide(parts, sizes, out=np.zeros_like(parts), where=sizes > 0)
            machine = machine.copy()
            machine[n:] += 2 / (step + 2) * (-family.tolerance * unit.ravel() - machine[n:])
            found = self._newton.search(family.within(machine))
            if found is not None:
                return found
        return None


class Singular(NamedTuple):
    """A singular pose.

    Attributes:
        y: (6,) its coordinates.
        reason: how it is known, where that is no proof; else empty.
        sides: (2, 6) two poses at which the determinant has opposite signs, without rounding; None without them.
        errors: of the joint centres of the machine that is singular, of six straight legs; None for the design.
        centres: the same for another robot.
    """

    y: FloatArray
    reason: str = ""
    sides: FloatArray | None = None
    errors: JointErrors | None = None
    centres: CentreErrors | None = None


class Refuter(Protocol):
    """Search for a singular pose."""

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose, or None.

        Args:
            found: the boxes that were examined last.
            boxes: number of all that were examined.
        """


class NewtonRefuter:
    """Newton's method from the boxes whose matrices are nearest to a singular one.

    Args:
        problem: the robot.
        matrix: whose rank is judged.
        family: all machines that are meant; None for the design alone.
        is_shown: whether a singular point (n,), or (n + 3 m,) of another machine, is one in home's assembly.
    """

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: ToleranceModel | None = None,
        is_shown: Callable[[FloatArray], bool] = lambda _: True,
    ) -> None:
        self._problem, self._family, self._is_shown = problem, family, is_shown
        self._newton = SingularPose(problem, matrix)
        self._machine = None if family is None else SingularMachine(family, family.matrix(matrix))
        self._attempts, self._last = 0, _SMALL
        # Number of boxes from which a singular machine is looked for, although no pose of the design is near to one.
        self._due = _FIRST

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose from the worst of these boxes."""
        values = np.where(found.is_regular, np.inf, found.smallest)
        order = np.argsort(values)[:2]
        for k in order:
            if not values[k] < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            near = self._newton.search(self._middle(found.boxes, k))
            shown = self._if_shown(near)
            if shown is not None:
                return shown
            # A singular pose of another assembly says nothing about where one of home's is.
            self._last = _SMALLER * float(values[k]) if near is None else self._last
        if self._machine is None or boxes < self._due or not np.isfinite(values[order[0]]):
            return None
        self._due = 2 * boxes
        return self._if_shown(self._machine.search(self._middle(found.boxes, order[0])))

    def from_random(self) -> Singular | None:
        """Return a singular pose near random ones, from those with the smallest singular values."""
        points = self._problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(self._problem.free)]
        values = np.array([self._newton.smallest(each) for each in points])
        worst = [points[k] for k in np.argsort(values)[:_TRIED] if np.isfinite(values[k])]
        searches: list[Callable[[FloatArray], FloatArray | None]] = [self._newton.search]
        if self._machine is not None:
            searches.append(self._machine.search)
        for search in searches:
            for point in worst:
                shown = self._if_shown(search(point))
                if shown is not None:
                    return shown
        return None

    def _if_shown(self, z: FloatArray | None) -> Singular | None:
        """Return a singular pose if it is one in home's assembly: Newton's method may end in another one."""
        return singular_at(self._problem, self._family, z) if z is not None and self._is_shown(z) else None

    def _middle(self, boxes: LoopBoxes, k: np.int64) -> FloatArray:
        """Return a point (n,) in the middle of a box, with closed loops or near them."""
        z: FloatArray = boxes.near[k].copy()
        own = [*self._problem.independent, *self._problem.dependent]
        z[own] = boxes.centre[k, own]
        return z


def singular_at(problem: Problem, family: ToleranceModel | None, z: FloatArray) -> Singular:
    """Return the singular pose at a point (n,), or (n + 3 m,) of another machine."""
    is_machine = family is not None and len(z) > len(problem.start)
    centres = family.errors_of(z) if family is not None and is_machine else None
    return Singular(frozen_array(problem.pose_of(z), (6,)), BY_NEWTON, centres=centres)
