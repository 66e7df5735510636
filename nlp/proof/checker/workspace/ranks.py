"""Claim that a matrix of motion conditions keeps its rank at every pose of a box, with closed loops.

With forms ``M = M_0 + sum_k A_k e_k + [-E, E]`` of the matrix over a box, in which :mod:`.closed_loops` replaces the
dependent coordinates, and C near a pseudo-inverse of M_0, every ``C M`` is invertible if

    |I - C M_0| + sum_k |C A_k| + |C| E     has a spectral radius below 1.

M then has full column rank. If the matrix has d degrees of freedom, d rows are added first: a basis of the null space
of M_0. Full column rank then proves that there are no further degrees of freedom anywhere in the box.

For six straight legs with joint-centre errors e and f of a leg in the world frame, the row
``(s (p - b) + u, u x (p - b))`` changes by ``(s (f - e), s f x (p - b) - u x e - s f x e)``. A component of a vector
product with f is at most the tolerance times the norm of the other vector's two other components. For other robots the
errors are coordinates of the forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model
from ....case.case import Case
from ...statement.claims import CONSTRAINTS
from ...statement.tolerance import BuiltModel
from ..fractions import sign_of_determinant
from ..proof_file import ProofError
from .closed_loops import Enclosed
from .forms import UP, AffineMatrix, inverses
from .loop_claims import LoopClaim, PosedLoops, posed_loops
from .motion_matrix import Root, motion_matrix
from .pose_boxes import Attempt

#: Relative error of the entries of a row: a constant of a robot that should be 0 may be a rounding error.
_CONSTANTS = 1e-13
#: Numbers of parts, tried in turn, into which the path between two poses is divided.
_PARTS = (1, 16, 256, 4096)
#: Indices after and before a component of a vector.
_AFTER, _BEFORE = [1, 2, 0], [2, 0, 1]


def rank_claim(
    case: Case, model: Model, root: Root, name: str, tolerance: float = 0.0, built: BuiltModel | None = None
) -> RankClaim:
    """Return the claim that a robot's J, or its constraint wrenches, keep their rank.

    Args:
        case: case with fixed dimensions.
        model: model of its robot without the unknowns in closed form.
        root: box of coordinates.
        name: name of the claim: ``regular``, or ``constraints regular``.
        tolerance: largest error of each joint centre; 0 for the nominal robot.
        built: model with joint-centre errors; None for six straight legs, and for the nominal robot.

    Raises:
        ProofError: the loops cannot be closed at the workspace centre, are singular there or leave a joint free;
            an expression has an operation without a rule; or joint-centre errors remove degrees of freedom.
    """
    loops = posed_loops(case, model, root, tolerance, built)
    return RankClaim(loops, *motion_matrix(loops.robot, loops.start, is_locked=name != CONSTRAINTS))


class RankClaim(LoopClaim):
    """Claim that the nullity of a sparse matrix of motion conditions (m, c) is at most a stated number.

    Within a tolerance, joint-centre errors of six straight legs change the rows. For other robots, the errors are
    further coordinates of the box.
    """

    def __init__(self, loops: PosedLoops, matrix: SX, nullity: int) -> None:
        robot = loops.robot
        self._nullity, self._length, self._shape = nullity, robot.length, matrix.shape
        self._at = np.array(matrix.sparsity().get_triplet(), dtype=np.intp)
        self._off = np.zeros(matrix.shape)
        self._off[tuple(self._at)] = [0.0 if each.is_zero() else _CONSTANTS for each in ca.vertsplit(matrix.nz[:])]
        # Joint-centre errors change the rows of legs in proportion to these norms.
        of_rows = bool(loops.tolerance) and not robot.errors
        parts = [ca.vec(each) for foot, arm in robot.legs * of_rows for each in (robot.position - foot, arm)]
        super().__init__(loops, ca.vertcat(matrix.nz[:], *([robot.scale, *parts] if parts else [])))

    def examined(self, closed: Enclosed) -> Attempt:
        """Try to prove the claim over closed loops."""
        return self._examined(self._matrices(closed))

    def show_sign_change(self, root: Root, sides: Sequence[Sequence[float]]) -> None:
        """Prove that the determinant has opposite signs at two points (c + e,): a pose, and joint-centre errors.

        The entries are defined along the whole line between them, and poses and errors are convex in their coordinates:
        the determinant changes continuously, and is 0 at some point.
        """
        # The matrix must be J itself, with rows that are neither normalised nor zero, for a robot without loops.
        if self._shape != (6, 6) or self._nullity or self.assembly.dependent:
            raise ProofError("a singular pose can be proved only for a robot with six rows of J and without loops")
        if not root.is_convex:
            raise ProofError(
                "a singular pose can be proved only in a workspace that contains the line between any two of its poses"
            )
        points, poses = [np.array(each, dtype=float) for each in sides], self.coordinates
        if len(points) != 2 or any(y.shape != (poses + self.errors,) for y in points):
            raise ProofError("the proof must state two poses for the claim that a pose is singular")
        if not all(np.isfinite(y).all() and root.holds(y[:poses]) for y in points):
            raise ProofError("a pose that the proof states is outside the workspace")
        for error in np.concatenate([y[poses:] for y in points]).reshape(-1, 3).tolist():
            if sum(Fraction(each) ** 2 for each in error) > Fraction(self.tolerance) ** 2:
                raise ProofError("a joint-centre error that the proof states exceeds the tolerance")
        signs = self._signs_at(np.stack(points))
        if signs[0] * signs[1] >= 0:
            raise ProofError(
                "det J does not have opposite signs at the two poses, so they do not prove a singular pose between them"
            )
        for count in _PARTS:
            way = points[0] + np.linspace(0, 1, count + 1)[:, None] * (points[1] - points[0])
            way[[0, -1]] = points
            matrices = self._matrices(self.closed(np.minimum(way[:-1], way[1:]), np.maximum(way[:-1], way[1:])))
            if all(np.isfinite(each).all() for each in matrices) and all(root.holds(y[:poses]) for y in way):
                return
        raise ProofError("it is not proved that det J changes continuously between the two poses")

    @np.errstate(all="ignore")
    def _signs_at(self, y: FloatArray) -> list[int]:
        """Return the signs of the determinant at points (K, 6 + e); 0 where a sign is not proved.

        C is an approximate inverse of the matrix M. If ``C M`` is proved near I, its determinant is positive, and det M
        has the sign of det C, which is computed exactly in fractions.
        """
        matrices = self._matrices(self.closed(y, y))
        C = inverses(matrices.M)
        known = matrices.contracted(C)[0]
        return [sign_of_determinant(each.tolist()) if good else 0 for each, good in zip(C, known, strict=True)]

    @np.errstate(all="ignore")
    def _matrices(self, closed: Enclosed) -> AffineMatrix:
        """Return the forms of the matrix in the independent coordinates."""
        values, count = self.values(closed), self._at.shape[1]
        matrices = self.assembly.followed(values.forms(slice(0, count)), closed).matrix(self._at, self._shape)
        if self.tolerance and not self.errors:
            most = np.abs(values.ends(slice(count, None))).max(axis=0).T
            legs = most[:, 1:].reshape(len(most), -1, 2, 3)
            change = change_of_rows(most[:, 0], legs[:, :, 0], legs[:, :, 1], self.tolerance, self._length)
            matrices = matrices._replace(E=matrices.E + change)
        return matrices

    def _examined(self, matrices: AffineMatrix) -> Attempt:
        """Try to prove the rank over boxes, from the forms of the matrix."""
        M, A, E = matrices
        # Powers of two make rows comparable without rounding.
        sizes = np.sqrt((M * M).sum(axis=2, keepdims=True))
        scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        M, E, A = M * scale, E * scale + self._off, A * scale[:, None]
        if self._nullity:
            known = np.asarray(np.isfinite(M).all(axis=(1, 2)))
            null = np.linalg.svd(np.where(known[:, None, None], M, 0.0), full_matrices=True)[2][:, -self._nullity :]
            none = np.zeros((len(M), A.shape[1], *null.shape[1:]))
            rows = (M, null), (E, np.zeros_like(null)), (A, none)
            M, E, A = (np.concatenate(each, axis=-2) for each in rows)
        C, p = inverses(M), len(self.free)
        moved = np.abs(C[:, None] @ A)
        # The error of a centre is at most the tolerance in any direction.
        centres = np.sqrt((moved[:, p:].reshape(len(M), -1, 3, *moved.shape[2:]) ** 2).sum(axis=2))
        holds, _, shares = AffineMatrix(M, A, E).contracted(C, np.concatenate([moved[:, :p], centres], axis=1))
        return Attempt(holds, shares[:, :p])


def change_of_rows(
    scale: FloatArray, span: FloatArray, arm: FloatArray, tolerance: float, length: float = 1.0
) -> FloatArray:
    """Return bounds (B, 6, 6) of the changes of all entries of six leg rows due to errors within a tolerance.

    The leg is ``s (p - b) + u``, with the position p, the base joint b, and the platform joint u turned and times s.

    Args:
        scale: (B,) largest values of the scale s of the rotation.
        span: (B, 6, 3) largest absolute values of ``p - b``.
        arm: (B, 6, 3) largest absolute values of ``u``.
        tolerance: largest error of each joint centre.
        length: length that divides moments.
    """
    s = scale[:, None, None]
    across, along = (np.hypot(each[..., _AFTER], each[..., _BEFORE]) for each in (span, arm))
    # The norm of f x e is at most the tolerance squared, and so is each of its components.
    moments = (s * (across + tolerance) + along) * UP / length
    return np.concatenate([np.broadcast_to(2 * s, moments.shape), moments], axis=2) * tolerance * UP
