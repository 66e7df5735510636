"""The claim that a matrix of motions keeps its rank at every pose of a box, with closed loops.

With forms ``M = M_0 + sum_k A_k e_k + [-E, E]`` of the matrix over a box, in which :mod:`.closed_loops` replaces the
dependent coordinates, and C near a pseudo-inverse of M_0, every ``C M`` has an inverse where

    |I - C M_0| + sum_k |C A_k| + |C| E     has a spectral radius below 1.

M has full column rank then. A matrix with d freedoms gets d further rows first, a basis of the null space of M_0: full
column rank then says that there are no more freedoms anywhere in the box.

Of six straight legs, with e and f the errors of both joints of a leg in the world frame, the row
``(s (p - b) + u, u x (p - b))`` changes by ``(s (f - e), s f x (p - b) - u x e - s f x e)``. A component of a vector
product with f is at most the tolerance times the size of the two other components of the other vector. The errors of
other robots are coordinates of the forms, which are never cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray, Model
from .....models.member import scaled_twists
from ....case.case import Case
from ....errors import UncoveredError
from ...statement.claims import CONSTRAINTS
from ...statement.tolerance import BuiltModel
from ..fractions import sign_of_determinant
from ..proof_file import ProofError
from .closed_loops import Assembly, Enclosed, needed_equations, start_of
from .forms import UP, AffineMatrix, FormArithmetic, inverses
from .motion_matrix import PosedRobot, motion_matrix
from .pose_boxes import COORDINATES, Attempt, PoseRoot

#: Errors at which equations and screws that were left out are tested, in parts of the robot's length, part of the
#: workspace about its middle in which the poses lie, number of tests, and largest residual of a closed loop.
_OFF, _SPREAD, _TESTS, _CLOSED, _SEED = 1e-2, 0.5, 4, 1e-9, 2
#: Singular values below this part of the largest are zero.
_ZERO = 1e-9
#: Part of the size of a row by which its entries may be off: numbers of a robot that should be 0 are rounding error.
_CONSTANTS = 1e-13
#: Numbers of parts of the way between two poses that are tried.
_PARTS = (1, 16, 256, 4096)
#: Indices after a component, and before it, of a vector.
_AFTER, _BEFORE = [1, 2, 0], [2, 0, 1]


def rank_claim(
    case: Case, model: Model, root: PoseRoot, name: str, tolerance: float = 0.0, built: BuiltModel | None = None
) -> RankClaim:
    """Return the claim that a robot's J, or its constraint wrenches alone, keep their rank.

    Loop equations that hold at all closed points by themselves are left out. That is found by their ranks at a few
    points: where it is wrong, the claim is about more than the closed loops, and says more.

    Args:
        case: with fixed dimensions.
        model: its robot without unknowns that follow in closed form.
        root: the box of coordinates.
        name: ``regular``, or ``constraints regular``.
        tolerance: largest error of each joint centre in the machines that are meant.
        built: the robot with errors of its joint centres; None for six straight legs, and for the design.

    Raises:
        ProofError: no closed loops are found in the middle of the workspace, they are singular there or leave a joint
            free, an expression has an operation without a rule, or errors take freedoms from the robot.
    """
    robot = PosedRobot(case, model, root)
    start = start_of(robot)
    needed = needed_equations(robot, start)
    if built is not None:
        robot = PosedRobot(case, built.model, root)
        start = np.concatenate([start, np.zeros(robot.errors)])
    try:
        assembly = Assembly(robot, robot.equations[needed] if needed else SX(0, 1), start)
        matrix, freedoms = motion_matrix(robot, start, is_locked=name != CONSTRAINTS)
        if built is not None:
            _refuse_other_freedoms(robot, assembly)
        return RankClaim(robot, matrix, freedoms, assembly, tolerance)
    except UncoveredError as error:
        raise ProofError(f"the check has no rule for {error}") from None


def _refuse_other_freedoms(robot: PosedRobot, assembly: Assembly) -> None:
    """Refuse machines in which, at random errors, equations or screws that were left out do not follow from others."""
    rng, n = np.random.default_rng(_SEED), len(assembly.start) - robot.errors
    poses = [j for j in assembly.independent if j < n]
    for _ in range(_TESTS):
        to = assembly.start[None].copy()
        to[:, poses] += _SPREAD * robot.size[poses] * rng.uniform(-1, 1, len(poses))
        to[:, n:] = _OFF * robot.length * rng.uniform(-1, 1, robot.errors)
        (z,) = assembly.moved(assembly.start[None], to[:, assembly.independent])
        every = robot.at(ca.vertcat(robot.equations, robot.loops), z)
        if not (np.isfinite(z).all() and np.abs(every).max(initial=0.0) <= _CLOSED):
            raise ProofError("with errors of joint centres the robot does not have the poses of the workspace")
        for each in (one for one in robot.members if one.rank < one.screws.shape[1]):
            columns = scaled_twists(each.screws, each.centre, SX(robot.length), each.size)
            sizes = np.linalg.svd(robot.at(columns, z), compute_uv=False)
            if int(np.count_nonzero(sizes > _ZERO * sizes.max(initial=0.0))) != each.rank:
                raise ProofError("errors of joint centres take freedoms from the robot")


class RankClaim:
    """The claim that a sparse matrix of motions (m, c) has no more freedoms than it is claimed to have.

    Errors of joint centres within a tolerance are those of six straight legs, or coordinates of the robot.

    Raises:
        UncoveredError: an entry holds an operation without a rule.
    """

    def __init__(
        self, robot: PosedRobot, matrix: SX, freedoms: int, assembly: Assembly, tolerance: float = 0.0
    ) -> None:
        self._freedoms, self._assembly, self._tolerance, self._length = freedoms, assembly, tolerance, robot.length
        # Independent coordinates as those of poses.
        self.free = [robot.free[j] for j in assembly.independent if j < len(robot.free)]
        self._errors, self._shape = robot.errors, matrix.shape
        self._at = np.array(matrix.sparsity().get_triplet(), dtype=np.intp)
        self._off = np.zeros(matrix.shape)
        self._off[tuple(self._at)] = [0.0 if each.is_zero() else _CONSTANTS for each in ca.vertsplit(matrix.nz[:])]
        # The errors of joint centres change rows of legs by a part of these.
        of_rows = bool(tolerance) and not robot.errors
        parts = [ca.vec(each) for foot, arm in robot.legs * of_rows for each in (robot.position - foot, arm)]
        self._entries = FormArithmetic(robot.z, ca.vertcat(matrix.nz[:], *([robot.scale, *parts] if parts else [])))
        self._shown: list[Enclosed] = []

    @np.errstate(all="ignore")
    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        closed = self._closed(lower, upper)
        holds, shares = closed.is_known.copy(), closed.shares[:, : len(self.free)].copy()
        if holds.any():
            known = closed.only(holds)
            good, shares[holds] = self._examined(self._matrices(known))
            holds[holds] = good
            if self._assembly.dependent:
                self._shown.append(known.only(good))
        return Attempt(holds, shares)

    def finish(self) -> None:
        """Refuse boxes with closed loops that are not shown to be those of one assembly, after all were shown."""
        if self._shown:
            every = zip(*(vars(each).values() for each in self._shown), strict=True)
            self._assembly.refuse_apart(Enclosed(*map(np.concatenate, every)))

    def show_sign_change(self, root: PoseRoot, sides: Sequence[Sequence[float]]) -> None:
        """Show that the determinant has opposite signs at two points (6 + e,): a pose, and errors of joint centres.

        The entries have values along the whole way between them, and poses and errors are convex in their coordinates:
        the determinant changes continuously, and is 0 at a point.
        """
        # The matrix is J itself, with rows that are neither normalised nor zero, over poses without loops.
        if self._shape != (6, 6) or self._freedoms or self._assembly.dependent:
            raise ProofError("only robots with six rows and without loops have proofs of singular poses")
        points = [np.array(each, dtype=float) for each in sides]
        if len(points) != 2 or any(y.shape != (COORDINATES + self._errors,) for y in points):
            raise ProofError("the claim has no two poses")
        if not all(np.isfinite(y).all() and root.holds(y[:COORDINATES]) for y in points):
            raise ProofError("a pose is not one of the workspace")
        for error in np.concatenate([y[COORDINATES:] for y in points]).reshape(-1, 3).tolist():
            if sum(Fraction(each) ** 2 for each in error) > Fraction(self._tolerance) ** 2:
                raise ProofError("a joint centre of the machine is off by more than the tolerance")
        signs = self._signs_at(np.stack(points))
        if signs[0] * signs[1] >= 0:
            raise ProofError("the determinants at the two poses do not have opposite signs")
        for count in _PARTS:
            way = points[0] + np.linspace(0, 1, count + 1)[:, None] * (points[1] - points[0])
            way[[0, -1]] = points
            matrices = self._matrices(self._closed(np.minimum(way[:-1], way[1:]), np.maximum(way[:-1], way[1:])))
            if all(np.isfinite(each).all() for each in matrices) and all(root.holds(y[:COORDINATES]) for y in way):
                return
        raise ProofError("the determinant is not shown to change continuously between the two poses")

    @np.errstate(all="ignore")
    def _signs_at(self, y: FloatArray) -> list[int]:
        """Return the signs of the determinant at points (K, 6 + e); 0 where a sign is not shown.

        Where ``C M`` is near I its determinant is positive: that of M has the sign of that of C, in fractions.
        """
        matrices = self._matrices(self._closed(y, y))
        C = inverses(matrices.M)
        known = matrices.contracted(C)[0]
        return [sign_of_determinant(each.tolist()) if good else 0 for each, good in zip(C, known, strict=True)]

    def _closed(self, lower: FloatArray, upper: FloatArray) -> Enclosed:
        """Return the closed loops over boxes (B, 6) for all errors, or over boxes (B, 6 + e) of poses and errors."""
        if lower.shape[1] == COORDINATES:
            errors = np.full((len(lower), self._errors), self._tolerance)
            lower, upper = np.hstack([lower, -errors]), np.hstack([upper, errors])
        own = [*self.free, *range(COORDINATES, COORDINATES + self._errors)]
        return self._assembly.enclosed(lower[:, own], upper[:, own])

    @np.errstate(all="ignore")
    def _matrices(self, closed: Enclosed) -> AffineMatrix:
        """Return the forms of the matrix, whose coordinates are the independent ones."""
        values, count = self._entries(closed.lower, closed.upper), self._at.shape[1]
        matrices = self._assembly.followed(values.forms(slice(0, count)), closed).matrix(self._at, self._shape)
        if self._tolerance and not self._errors:
            most = np.abs(values.ends(slice(count, None))).max(axis=0).T
            legs = most[:, 1:].reshape(len(most), -1, 2, 3)
            change = change_of_rows(most[:, 0], legs[:, :, 0], legs[:, :, 1], self._tolerance, self._length)
            matrices = matrices._replace(E=matrices.E + change)
        return matrices

    def _examined(self, matrices: AffineMatrix) -> tuple[NDArray[np.bool_], FloatArray]:
        """Return where the rank is shown (B,), and shares (B, f), from the forms of the matrix."""
        M, A, E = matrices
        # Rows are made comparable by a power of two, which rounds nothing.
        sizes = np.sqrt((M * M).sum(axis=2, keepdims=True))
        scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        M, E, A = M * scale, E * scale + self._off, A * scale[:, None]
        if self._freedoms:
            known = np.asarray(np.isfinite(M).all(axis=(1, 2)))
            null = np.linalg.svd(np.where(known[:, None, None], M, 0.0), full_matrices=True)[2][:, -self._freedoms :]
            none = np.zeros((len(M), A.shape[1], *null.shape[1:]))
            rows = (M, null), (E, np.zeros_like(null)), (A, none)
            M, E, A = (np.concatenate(each, axis=-2) for each in rows)
        C, p = inverses(M), len(self.free)
        moved = np.abs(C[:, None] @ A)
        # The error of a centre is no larger than the tolerance in any direction.
        centres = np.sqrt((moved[:, p:].reshape(len(M), -1, 3, *moved.shape[2:]) ** 2).sum(axis=2))
        holds, _, shares = AffineMatrix(M, A, E).contracted(C, np.concatenate([moved[:, :p], centres], axis=1))
        return holds, shares[:, :p]


def change_of_rows(
    scale: FloatArray, span: FloatArray, arm: FloatArray, tolerance: float, length: float = 1.0
) -> FloatArray:
    """Return bounds (B, 6, 6) of the change of the rows of six legs, entry by entry, by errors within a tolerance.

    Args:
        scale: (B,) largest s.
        span: (B, 6, 3) largest sizes of ``p - b``.
        arm: (B, 6, 3) largest sizes of ``u``.
        tolerance: of each joint centre.
        length: by which moments are divided.
    """
    s = scale[:, None, None]
    across, along = (np.hypot(each[..., _AFTER], each[..., _BEFORE]) for each in (span, arm))
    # The size of f x e is at most the tolerance squared, and so is each of its components.
    moments = (s * (across + tolerance) + along) * UP / length
    return np.concatenate([np.broadcast_to(2 * s, moments.shape), moments], axis=2) * tolerance * UP
