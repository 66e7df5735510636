"""Fixed rotations in other words than axis and angle: a matrix, a unit quaternion, or roll, pitch and yaw.

Conventions: the matrix turns platform coordinates into world coordinates; its columns are the platform's axes. A
quaternion is ``(w, x, y, z)``, the scalar part first. Roll, pitch and yaw turn about the world's fixed axes x, then y,
then z: ``R = Rz(yaw) Ry(pitch) Rx(roll)``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from ...models.rotation import AxisAngle, axis_angle_from_matrix
from ..errors import CaseError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: Largest distance of a matrix from an orthogonal one, in a component of ``R' R``, and of a quaternion's size from 1:
#: more than numbers with seven decimals leave, and far less than a slip of the pen.
_ROUNDING = 1e-6


def rotation_from_matrix(matrix: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle of a rotation matrix; what rounding left is removed.

    Args:
        matrix: (3, 3).
        key: its dotted key, for messages.

    Raises:
        CaseError: it is not three rows of three finite numbers, not orthogonal, or a reflection.
    """
    rows = _numbers(matrix, (3, 3), key, "three rows of three finite numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.max(np.abs(rows.T @ rows - np.eye(3))))
    if not error <= _ROUNDING:
        fault = "must be orthogonal: its columns must be unit vectors at right angles"
        raise CaseError(key, f"{fault}, and R' R differs from the unit matrix by {error:.3g}")
    if np.linalg.det(rows) < 0:
        raise CaseError(key, "must be a rotation: its determinant is -1, as of a reflection")
    # The nearest orthogonal matrix.
    left, _, right = np.linalg.svd(rows)
    return axis_angle_from_matrix(left @ right)


def rotation_from_quaternion(quaternion: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle, in [0, pi], of a unit quaternion.

    Args:
        quaternion: (4,) ``(w, x, y, z)``; its negative is the same rotation.
        key: its dotted key, for messages.

    Raises:
        CaseError: it is not four finite numbers, or not unit.
    """
    parts = _numbers(quaternion, (4,), key, "four finite numbers: w, x, y, z")
    size = math.hypot(*parts.tolist())
    if not abs(size - 1) <= _ROUNDING:
        raise CaseError(key, f"must be a unit quaternion (w, x, y, z): its size is {size:.7g}", parts.tolist())
    sign = -1.0 if parts[0] < 0 else 1.0
    sine = math.hypot(*parts[1:].tolist())
    if sine == 0:
        return AxisAngle(np.array([0.0, 0.0, 1.0]), 0.0)
    return AxisAngle(sign * parts[1:] / sine, 2 * math.atan2(sine, abs(float(parts[0]))))


def rotation_from_rpy(rpy: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle of roll, pitch and yaw: about the world's x, then y, then z.

    Args:
        rpy: (3,) radians.
        key: its dotted key, for messages.

    Raises:
        CaseError: it is not three finite numbers.
    """
    half = _numbers(rpy, (3,), key, "three finite numbers: roll, pitch, yaw") / 2
    (sr, sp, sy), (cr, cp, cy) = np.sin(half).tolist(), np.cos(half).tolist()
    # The product of three quaternions.
    return rotation_from_quaternion(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ),
        key,
    )


def _numbers(values: ArrayLike, shape: tuple[int, ...], key: str, words: str) -> FloatArray:
    """Return finite numbers as an array.

    Raises:
        CaseError: they are not finite, or of another shape.
    """
    try:
        numbers: FloatArray = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise CaseError(key, f"must be {words}") from None
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise CaseError(key, f"must be {words}")
    return numbers
