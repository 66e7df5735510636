"""Search for singular poses: by signs of determinants, and by Newton's method from poses with a small singular value.

A pose is singular if ``M(z) v = 0`` for a unit vector v, with closed loops. Newton's method with least-squares steps
solves these equations in z and v. It converges quickly where the determinant changes its sign, and slowly where it
touches 0. The result is computed, not proved: J at the pose, with unit rows and moments divided by a length, has a
singular value of at most 1e-10 times the largest.

The workspace is convex in its coordinates. If the determinant of six rows is positive at one pose and negative at
another, and the rows are defined along the segment between them, a pose of the segment is singular. With C near the
inverse of the rows at a pose, their determinant has the sign of det C if every row sum of ``|I - C M|`` is less than 1.
det C is computed in integers.

A robot within the joint-centre tolerance may be singular although the nominal robot is not. The method of Frank and
Wolfe [1], with steps within the tolerance, reduces the smallest singular value by errors along its derivatives. Each
iterate starts a search for a singular robot.

Source: 1. M. Frank, P. Wolfe, *An algorithm for quadratic programming*, Naval Research Logistics Quarterly 3 (1956).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from .....models import FloatArray, frozen_array
from .....models.arrays import first_largest, values_at
from .....models.newton import Linear, newton
from ....evidence.closed_loops import inverses
from ...enclosure.forms import Encloser
from ...statement.fixed_robot import JointErrors
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from ..verdict import EVERYWHERE
from .krawczyk import ROUNDING
from .loop_boxes import Examined

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative singular value below which a pose counts as singular.
SINGULAR = 1e-10
#: Reasons of verdicts: pose of Newton's method; change of sign where a set may not contain the line of two poses.
BY_NEWTON = "found singular to 1e-10 by Newton's method"
BY_SIGNS = "the determinant changes its sign at the pose, on the line between two poses"
#: Largest number of Newton steps: where a determinant touches 0, each step halves the distance.
_STEPS = 60
#: Number of steps in which the smallest singular value must decrease by a tenth. At the boundary of a workspace it may
#: not decrease.
_PATIENCE = 8
#: Relative singular value of M below which J is tested too.
_NEAR = 1e-6
#: Largest relative step of a coordinate.
_STEP = 0.25
#: Largest residual of closed loops.
_CLOSED = 1e-9
#: Relative singular value that counts as zero in a step.
_DEPENDENT = 1e-12
#: Smallest share of the platform's motion in the null vector; below this share, only passive joints move.
_MOVES = 1e-3
#: Largest relative singular value at the start of Newton's method, and largest number of attempts.
_SMALL, _MOST = 0.1, 24
#: Factor of the singular value after which Newton's method is tried again.
_SMALLER = 0.6
#: Number of random poses for Newton's method, and number of the worst poses from which it begins.
_POSES, _TRIED, _SEED = 2048, 8, 0
#: Number of steps to robots with smaller singular values, and number of boxes before the first steps; the number
#: doubles each time.
_ROBOTS, _FIRST = 6, 64
#: Number of random poses with determinants; number of extreme ones of each sign that begin a descent, and of its steps;
#: distance for derivatives, relative to the workspace.
_SAMPLES, _KEPT, _DESCENTS, _APART = 256, 8, 6, 1e-4
#: Number of poses of each sign that are kept, and of points between two poses that are tested first.
_SIGNED, _ON_WAY = 4, 64
#: Distances from a computed singular pose, relative to the workspace, at which both signs are searched.
_DISTANCES = (1e-4, 1e-3, 1e-2, 1e-1)
#: Number of bisections between two points, more than the digits of a double; and largest number of parts between them.
_HALVINGS, _PARTS = 60, 1024
#: Relative rounding error of a sum of products of a row and a column.
_PRODUCT = 2.0**-48


class Singular(NamedTuple):
    """Singular pose of the nominal robot, or of a robot within the tolerance.

    Attributes:
        y: (6,) coordinates of the pose.
        reason: method that computed the pose, if its singularity is not proved; otherwise empty.
        sides: (2, 6) two poses at which the determinant provably has opposite signs; None without such poses.
        errors: joint-centre errors of the singular robot; None for the nominal robot.
    """

    y: FloatArray
    reason: str = ""
    sides: FloatArray | None = None
    errors: JointErrors | None = None


class SingularPose:
    """Newton's method for a singular point of a matrix: a pose, and joint-centre errors within the tolerance.

    Args:
        problem: the robot.
        matrix: the matrix, as expressions of the robot's coordinates.
    """

    def __init__(self, problem: Problem, matrix: RankMatrix) -> None:
        self.problem, self.rank = problem, matrix.matrix.shape[1] - matrix.nullity
        z, M = problem.z, ca.densify(matrix.matrix)
        v = ca.SX.sym("v", M.shape[1])
        product = M @ v
        self._values = ca.Function("values", [z], [M])
        self.equations = ca.Function(
            "singular", [z, v], [problem.equations, product, ca.jacobian(problem.equations, z), ca.jacobian(product, z)]
        )
        self._jacobian = ca.Function("J", [z], [ca.densify(problem.posed.scaled.jacobian)])

    def smallest(self, z: FloatArray) -> float:
        """Return the relative singular value that is 0 at a singular pose; infinite if the matrix is not finite."""
        decomposed, J, rank = self.decomposed(z), self._jacobian(z).full(), self.rank
        if decomposed is None or not np.isfinite(J).all() or rank < 1:
            return float("inf")
        M, values, right = decomposed
        if not float(np.abs(right[rank - 1, :6]).max()) > _MOVES:
            return float("inf")
        if rank == M.shape[1]:
            values = np.linalg.svd(J, compute_uv=False)
            return float(values[5] / values[0]) if len(values) > 5 else 0.0
        return float(values[rank - 1] / values[0]) if len(values) >= rank else 0.0

    def search(self, z: FloatArray, moving: int | None = None) -> FloatArray | None:
        """Return a singular point (n,) of the workspace near a point (n,); None if none is found.

        Args:
            z: start of the search.
            moving: number of first coordinates that may move; all coordinates if left out.
        """
        decomposed = self.decomposed(z)
        if decomposed is None:
            return None
        # The direction with the smallest singular value, orthogonal to the constant null space of M.
        v = decomposed[2][self.rank - 1]
        found, _ = newton(_NullVector(self, moving), (z, v), steps=_STEPS, zeros=[_DEPENDENT])
        return found if self.is_singular(found) else None

    def decomposed(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Return M at a point (n,), its singular values and its right singular vectors; None if M is not finite."""
        M = self._values(z).full()
        if not np.isfinite(M).all():
            return None
        _, values, right = np.linalg.svd(M)
        return M, values, right

    def slopes(self, z: FloatArray) -> FloatArray | None:
        """Return derivatives (n,) of the smallest singular value at a point (n,) with closed loops; None if undefined.

        To first order the singular value is ``u . M v`` with singular vectors u and v. The independent coordinates
        determine the dependent coordinates.
        """
        M = self._values(z).full()
        if not np.isfinite(M).all():
            return None
        left, _, right = np.linalg.svd(M)
        _, _, by_z, turned = (each.full() for each in self.equations(z, right[self.rank - 1]))
        found: FloatArray = left[:, self.rank - 1] @ turned
        dependent = list(self.problem.dependent)
        if dependent:
            found -= found[dependent] @ np.linalg.pinv(by_z[:, dependent]) @ by_z
        return found if np.isfinite(found).all() else None

    def is_singular(self, z: FloatArray) -> bool:
        """Return whether a point (n,) is a singular pose of the workspace with closed loops."""
        problem = self.problem
        closed = np.abs(problem.loops.values(z[:, None])).max(initial=0.0) <= _CLOSED
        return bool(closed and problem.box.holds(problem.pose_of(z))) and self.smallest(z) <= SINGULAR

    def robots(self, z: FloatArray) -> Iterator[FloatArray]:
        """Yield points (n,) with joint-centre errors and ever smaller singular values, from a point without errors."""
        problem, robot = self.problem, z
        for step in range(_ROBOTS):
            closed = problem.loops.all_closed(robot[:, None], problem.dependent)[:, 0]
            slopes = self.slopes(closed)
            if slopes is None:
                return
            end = problem.with_errors(closed[None], -slopes[None, problem.of_errors])[0]
            robot = closed + 2 / (step + 2) * (end - closed)
            yield robot


class _NullVector:
    """Equations ``M(z) v = 0`` with closed loops, for a unit vector v orthogonal to the constant null space of M.

    A point is z (n,) with v.

    Args:
        pose: the matrix.
        moving: number of first coordinates that may move; None for all coordinates.
    """

    def __init__(self, pose: SingularPose, moving: int | None) -> None:
        self._pose, self._size = pose, pose.problem.size[:moving]
        self._seen: list[float] = []

    def linear(self, at: tuple[FloatArray, FloatArray]) -> Linear | None:
        """Return the linearised equations; None if z is singular, or if the steps do not approach a singular point."""
        (z, v), pose, seen, n = at, self._pose, self._seen, len(self._size)
        decomposed, rank = pose.decomposed(z), pose.rank
        if decomposed is None:
            return None
        M, values, right = decomposed
        seen.append(float(values[rank - 1] / values[0]) if len(values) >= rank else 0.0)
        if seen[-1] <= _NEAR and pose.is_singular(z):
            return None
        if len(seen) > _PATIENCE and not seen[-1] < 0.9 * seen[-1 - _PATIENCE]:
            return None
        basis = right[rank:]
        g, r, by_z, turned = (each.full() for each in pose.equations(z, v))
        rows = np.block(
            [
                [by_z[:, :n] * self._size, np.zeros((len(g), len(v)))],
                [turned[:, :n] * self._size, M],
                [np.zeros((1 + len(basis), n)), np.vstack([v, basis])],
            ]
        )
        residual = np.concatenate([g.ravel(), r.ravel(), [0.5 * (v @ v - 1)], basis @ v])
        return Linear(residual, rows) if np.isfinite(residual).all() and np.isfinite(rows).all() else None

    def moved(self, at: tuple[FloatArray, FloatArray], step: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the point after a step, limited in each coordinate and to the workspace, with a unit vector."""
        (z, v), n = at, len(self._size)
        step = step * min(1.0, _STEP / max(float(np.abs(step[:n]).max(initial=0.0)), 1e-300))
        z = z.copy()
        z[:n] += self._size * step[:n]
        v = v + step[n:]
        return self._pose.problem.within(z), v / np.linalg.norm(v)


class DeterminantSigns:
    """Signs of the determinant of six rows at points of a robot without dependent coordinates.

    Args:
        problem: the robot.
        matrix: the rows (6, 6).
    """

    def __init__(self, problem: Problem, matrix: RankMatrix) -> None:
        self._problem, self._matrix = problem, matrix
        self._values = ca.Function("rows", [problem.z], [ca.densify(matrix.matrix)])

    @cached_property
    def _encloser(self) -> Encloser:
        return Encloser(self._problem.z, ca.vec(self._matrix.matrix.T))

    def computed(self, points: FloatArray) -> FloatArray:
        """Return computed determinants (K,) of unit rows at points (K, n); 0 where rows are not defined."""
        rows = np.nan_to_num(values_at(self._values, points)[0], posinf=0.0, neginf=0.0)
        sizes = np.linalg.norm(rows, axis=2).prod(axis=1)
        return np.asarray(np.linalg.det(rows) / np.where(sizes > 0, sizes, 1.0))

    def has_values(self, lower: FloatArray, upper: FloatArray) -> bool:
        """Return whether the rows are provably defined everywhere in boxes (B, n)."""
        return bool(np.isfinite(self._encloser(lower.T, upper.T).r).all())

    def proved(self, z: FloatArray) -> int:
        """Return the proved sign at a point (n,); 0 if it is not proved."""
        forms = self._encloser(z[:, None], z[:, None])
        M, R = (each.reshape(1, 6, 6) for each in (forms.c, forms.r))
        C = inverses(M)
        with np.errstate(all="ignore"):
            bound = np.abs(C @ M - np.eye(6)) + np.abs(C) @ (R + _PRODUCT * np.abs(M))
        return _sign_of_determinant(C[0]) if bound.sum(axis=2).max() < 1 - ROUNDING else 0

    def change(self, one: FloatArray, other: FloatArray) -> FloatArray | None:
        """Return a point (n,) near the change of sign between two points, with the sign of the second point.

        The result is None if opposite signs are not proved, or if the rows are not provably defined between the two
        points.
        """
        values = self.computed(one + np.linspace(0, 1, _ON_WAY)[:, None] * (other - one))
        if not (values.all() and values[0] * values[-1] < 0 and self.proved(one) * self.proved(other) < 0):
            return None
        waiting, parts = [(one, other)], 0
        while waiting:
            begin, end = waiting.pop()
            parts += 1
            ends = np.minimum(begin, end)[:, None], np.maximum(begin, end)[:, None]
            if not np.isfinite(self._encloser(*ends).r).all():
                if parts > _PARTS:
                    return None
                middle = 0.5 * begin + 0.5 * end
                waiting += [(begin, middle), (middle, end)]
        low, high, sign = 0.0, 1.0, self.proved(other)
        for _ in range(_HALVINGS):
            share = 0.5 * (low + high)
            is_beyond = sign * self.computed((one + share * (other - one))[None])[0] > 0
            low, high = (low, share) if is_beyond else (share, high)
        # Signs cannot be proved very near to the change.
        shares = np.minimum(high + 2.0 ** np.arange(-52, 1), 1.0)
        points = (one + share * (other - one) for share in shares)
        return next((z for z in points if self.proved(z) == sign), other)

    def extremes(self) -> FloatArray:
        """Return points (K, n) with small and large determinants, after a few steps from random poses.

        The determinant is nearly linear over a box: each step tests the corners in the direction of its derivatives.
        """
        box = self._problem.box
        width, parts = box.upper - box.lower, np.array([1.0, 0.5, 0.25])[:, None, None]
        every = box.random(_SAMPLES, np.random.default_rng(_SEED))

        def values(y: FloatArray) -> FloatArray:
            """Return the determinants (...) at poses (..., 6)."""
            return self.computed(self._points(y.reshape(-1, 6))).reshape(y.shape[:-1])

        order = np.argsort(values(every))
        y, sign = every[np.r_[order[:_KEPT], order[-_KEPT:]]], np.repeat([1.0, -1.0], _KEPT)
        for _ in range(_DESCENTS):
            # Derivatives, with the sign for which the determinant must fall.
            near = sign * values(y + _APART * width * np.eye(7, 6)[:, None])
            slopes = (near[:6] - near[6]).T
            end = np.where(slopes > 0, box.lower, box.upper)
            if box.ball < np.inf:
                size = np.linalg.norm(slopes[:, 3:], axis=1, keepdims=True)
                end[:, 3:] = -slopes[:, 3:] / np.maximum(size, np.finfo(float).tiny) * np.sqrt(box.ball)
            tried = np.concatenate([y[None], y + parts * (end - y)])
            best = np.argmin(sign * values(tried), axis=0)
            if not best.any():
                break
            y = tried[best, np.arange(len(y))]
        return self._points(y)

    def around(self, z: FloatArray) -> FloatArray:
        """Return random points (K, n) of the nominal robot around a point, at several distances."""
        y, box = self._problem.pose_of(z), self._problem.box
        away = np.random.default_rng(_SEED).uniform(-1, 1, (len(_DISTANCES), _SAMPLES, 6)) * (box.upper - box.lower)
        return self._points((y + np.array(_DISTANCES)[:, None, None] * away).reshape(-1, 6))

    def _points(self, y: FloatArray) -> FloatArray:
        """Return the points (K, n) of the nominal robot at poses (K, 6) moved into the workspace."""
        return self._problem.exact(self._problem.box.clipped(y)[:, list(self._problem.free)])


def _sign_of_determinant(matrix: FloatArray) -> int:
    """Return the exact sign of a determinant, by integer elimination (Bareiss)."""
    ratios = [[each.as_integer_ratio() for each in row] for row in matrix.tolist()]
    # Denominators are powers of two, so the largest of a row is a multiple of the others.
    common = [max(denominator for _, denominator in row) for row in ratios]
    whole = [[a * (by // b) for a, b in row] for row, by in zip(ratios, common, strict=True)]
    sign, before = 1, 1
    for k in range(len(whole) - 1):
        pivot = next((i for i in range(k, len(whole)) if whole[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            whole[k], whole[pivot], sign = whole[pivot], whole[k], -sign
        for i in range(k + 1, len(whole)):
            for j in range(k + 1, len(whole)):
                whole[i][j] = (whole[i][j] * whole[k][k] - whole[i][k] * whole[k][j]) // before
        before = whole[k][k]
    last: int = whole[-1][-1]
    return sign * ((last > 0) - (last < 0))


class SingularSearch:
    """Search for a singular pose from boxes: by signs if the matrix has six rows, else by Newton's method.

    Args:
        problem: the robot.
        matrix: the matrix, as expressions of the robot's coordinates.
        is_shown: function that tests whether a pose is singular in the home assembly mode.
    """

    def __init__(
        self, problem: Problem, matrix: RankMatrix, is_shown: Callable[[Singular], bool] = lambda _: True
    ) -> None:
        self._problem, self._matrix, self._is_shown = problem, matrix, is_shown
        has_signs = matrix.matrix.shape == (6, 6) and not (matrix.nullity or problem.dependent)
        self._signs = DeterminantSigns(problem, matrix) if has_signs else None
        # Poses by the sign of the determinant.
        self._signed: dict[int, list[FloatArray]] = {1: [], -1: []}
        self._is_sampled = False
        self._attempts, self._last, self._due = 0, _SMALL, _FIRST
        self._count = len(problem.problem.start)  # coordinates of the nominal robot

    @cached_property
    def _newton(self) -> SingularPose:
        return SingularPose(self._problem, self._matrix)

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose from the last examined boxes; the first call also tests random poses."""
        worst = np.argsort(np.where(found.is_regular, np.inf, found.smallest))[:2].tolist()
        singular = self._by_newton(found, worst) if self._signs is None else self._by_signs(self._signs, found)
        if singular is not None or not self._problem.names or boxes < self._due or found.is_regular.all():
            return singular
        self._due = 2 * boxes
        return self._singular_robot(self._middle(found, worst[0]))

    def everywhere(self) -> Singular | None:
        """Return the start pose as singular pose, for a robot that is singular at every pose."""
        start = self._problem.start
        return self._shown(start, EVERYWHERE) if self._newton.smallest(start) <= SINGULAR else None

    def from_random(self) -> Singular | None:
        """Return a singular pose near the random poses with the smallest singular values."""
        problem = self._problem
        y = problem.box.random(_POSES, np.random.default_rng(_SEED))
        points = problem.exact(y[:, list(problem.free)])
        values = np.array([self._newton.smallest(each) for each in points])
        worst = [points[k] for k in np.argsort(values)[:_TRIED] if np.isfinite(values[k])]
        found = (self._pose(point) for point in worst)
        robots = (self._singular_robot(point) for point in worst if problem.names)
        return next((each for each in itertools.chain(found, robots) if each is not None), None)

    def _by_signs(self, signs: DeterminantSigns, found: Examined) -> Singular | None:
        """Return a singular pose between two poses with opposite signs, among random poses and centres of boxes."""
        if self._is_sampled:
            return self._between(signs, found.boxes.centre, found.signs)
        self._is_sampled = True
        values = signs.computed(points := signs.extremes())
        between = self._between(signs, points, values)
        if between is not None or not self._problem.names:
            return between
        nearest = first_largest(1 / np.where(values, np.abs(values), np.inf))
        return self._singular_robot(points[nearest])

    def _between(
        self, signs: DeterminantSigns, points: FloatArray, values: FloatArray | NDArray[np.int32]
    ) -> Singular | None:
        """Return a singular pose between two points with determinants of opposite sign; None without such points.

        The points are (K, n) with computed determinants (K,), or points of earlier calls.
        """
        problem = self._problem
        for sign, known in self._signed.items():
            new = points[np.sign(values) == sign][:_SIGNED]
            known[:] = [*new[problem.box.holds(problem.pose_of(new))], *known][:_SIGNED]
        for ends in itertools.product(*self._signed.values()):
            change = signs.change(*ends)
            sides = frozen_array(problem.pose_of(np.stack(ends)), (2, 6)) if problem.box.is_convex else None
            if sides is None and change is not None and not problem.box.holds(problem.pose_of(change)):
                continue
            shown = self._shown(change, BY_SIGNS if sides is None else "", sides)
            if shown is not None:
                return shown
        return None

    def _by_newton(self, found: Examined, worst: Sequence[int]) -> Singular | None:
        """Return a singular pose from the boxes with the matrices nearest to a singular matrix."""
        for k in worst:
            value = float(found.smallest[k])
            if found.is_regular[k] or not value < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            near = self._newton.search(self._middle(found, k), self._count)
            shown = self._shown(near, BY_NEWTON)
            if shown is not None:
                return shown
            # A singular pose in another assembly mode tells nothing about the home assembly mode.
            self._last = _SMALLER * value if near is None else self._last
        return None

    def _pose(self, z: FloatArray) -> Singular | None:
        """Return a singular pose of the nominal robot near a point, if possible between poses with opposite signs."""
        near = self._newton.search(z, self._count)
        if near is None:
            return None
        between = None
        if self._signs is not None:
            points = self._signs.around(near)
            between = self._between(self._signs, points, self._signs.computed(points))
        return between or self._shown(near, BY_NEWTON)

    def _singular_robot(self, z: FloatArray) -> Singular | None:
        """Return a singular pose of a robot within the tolerance, at or near a point of the nominal robot."""
        signs, is_held = self._signs, self._problem.box.holds(self._problem.pose_of(z))
        for robot in self._newton.robots(z):
            if signs is None:
                found = self._shown(self._newton.search(robot), BY_NEWTON)
            else:
                found = self._shown(signs.change(z, robot) if is_held else None, "")
            if found is not None:
                return found
        return None

    def _shown(self, z: FloatArray | None, reason: str, sides: FloatArray | None = None) -> Singular | None:
        """Return the singular pose at a point (n,) if it is in the home assembly mode; None otherwise.

        ``sides`` (2, 6) has two poses with opposite signs of the determinant.
        """
        if z is None:
            return None
        errors = self._problem.errors_of(z)
        y = frozen_array(self._problem.pose_of(z), (6,))
        found = Singular(y, reason, sides, errors if errors.vectors.any() else None)
        return found if self._is_shown(found) else None

    def _middle(self, found: Examined, k: int) -> FloatArray:
        """Return a point (n,) in the middle of a box, at which the loops are closed or nearly closed."""
        z: FloatArray = found.boxes.near[k].copy()
        own = [*self._problem.independent, *self._problem.dependent]
        z[own] = found.boxes.centre[k, own]
        return z
