"""Motions that a robot resists least and most at a fixed point (the task analysis of Wolf and Shoham).

F is a quadratic form in the twist, ``F = |M omega + N v|^2`` with moments ``M`` and forces ``N`` of J.
Over all twists with ``|omega| = 1``, F has no maximum, since any translation may be added. It has stationary values:
the finite eigenvalues of the generalised eigenproblem

    D J' J D chi = F diag(1, 1, 1, 0, 0, 0) chi

Its three solutions are eigenvectors of the Schur complement ``M' (I - N N^+) M``, each with the translation that
minimises F. The pure translations, with ``|v| = 1``, are eigenvectors of ``N' N``.

Source: A. Wolf and M. Shoham, *Investigation of parallel manipulators using linear complex approximation*, Journal of
Mechanical Design 125 (2003), reference [4] of the paper.
"""

import numpy as np

from ...models import FloatArray, frozen_array
from ...models.basis import settled_basis
from ..system.jsonvalues import Inline, JsonObject
from .screwvalues import ScrewMotion, motion_of

#: Singular values with a smaller relative difference count as equal.
_SAME = 1e-9


class PrincipalMotion(JsonObject):
    """A motion at which F is stationary.

    Attributes:
        F: objective for this motion.
        motion: twist of unit rotation, or a translation of unit speed.
    """

    F: float
    motion: Inline[ScrewMotion]

    @property
    def twist(self) -> FloatArray:
        """Angular velocity, then velocity at the world origin, (6,)."""
        return frozen_array(self.motion.twist, (6,))


class TaskAnalysis(JsonObject):
    """Motions at which F is stationary: three rotations and three translations, by ascending F.

    Attributes:
        rotations: stationary motions among twists of unit rotation.
        translations: stationary motions among translations of unit speed.
    """

    rotations: tuple[PrincipalMotion, ...]
    translations: tuple[PrincipalMotion, ...]


def analyse_tasks(jacobian: FloatArray) -> TaskAnalysis:
    """Return the principal motions of a robot at one point.

    Args:
        jacobian: (m, 6) rows of unit wrenches: force, then moment about the world origin.
    """
    N, M = jacobian[:, :3], jacobian[:, 3:]
    least_squares = np.linalg.pinv(N, rcond=1e-10)
    projected = M - N @ (least_squares @ M)
    rotations = []
    for axis in _right_singular_vectors(projected):
        twist = np.concatenate([axis, -least_squares @ (M @ axis)])
        rotations.append(_principal_motion(jacobian, twist))
    translations = [
        _principal_motion(jacobian, np.concatenate([np.zeros(3), axis])) for axis in _right_singular_vectors(N)
    ]
    return TaskAnalysis(rotations=tuple(rotations), translations=tuple(translations))


def _right_singular_vectors(matrix: FloatArray) -> FloatArray:
    """Return the right singular vectors of a matrix (m, 3) as rows (3, 3).

    Singular values ascend; the largest component of each vector is positive. Vectors of equal singular values are a
    basis that depends only on the space that they span.
    """
    rows, values = np.linalg.svd(matrix)[2][::-1], np.zeros(3)
    values[: len(matrix)] = np.linalg.svd(matrix, compute_uv=False)[: len(matrix)]
    apart = np.flatnonzero(np.diff(values[::-1]) > _SAME * values[0]) + 1
    return np.vstack([settled_basis(each) for each in np.split(rows, apart)])


def _principal_motion(jacobian: FloatArray, twist: FloatArray) -> PrincipalMotion:
    """Return the motion of a twist (6,), with F for a Jacobian (m, 6)."""
    rates = jacobian[:, 3:] @ twist[:3] + jacobian[:, :3] @ twist[3:]
    return PrincipalMotion(F=float(rates @ rates), motion=motion_of(twist))
