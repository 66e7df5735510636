"""Rotation matrices: symbolic from three sets of coordinates, and numeric to axis and angle, and to quaternions.

The vector part ``q`` of a unit quaternion is smooth without trigonometric functions for every angle below 180 degrees,
and turns a limit on the angle into a ball, ``|q|^2 <= sin^2(angle_max / 2)``. The Cayley vector ``tan(angle / 2) n`` is
smooth on the same set and unbounded. Axis and angle (equation 9) are for a fixed axis: as variables together they are
redundant, and singular at zero angle.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .arrays import FloatArray, frozen_array

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def matrix_from_quaternion_vector(q: SX) -> SX:
    """Return the rotation matrix from the vector part of a unit quaternion.

    Args:
        q: (3, 1) ``sin(angle / 2) * axis`` with ``|q| < 1``; the scalar part is the positive root ``sqrt(1 - |q|^2)``.

    Returns:
        (3, 3) ``I + 2 q0 [q]x + 2 [q]x^2``.
    """
    q0 = ca.sqrt(1 - ca.sumsqr(q))
    cross = ca.skew(q)
    return SX.eye(3) + 2 * q0 * cross + 2 * cross @ cross


def matrix_from_cayley(c: SX) -> SX:
    """Return the rotation matrix from the Cayley (Rodrigues) vector.

    Args:
        c: (3, 1) ``tan(angle / 2) * axis``.

    Returns:
        (3, 3) ``I + 2 / (1 + |c|^2) ([c]x + [c]x^2)``.
    """
    cross = ca.skew(c)
    return SX.eye(3) + 2 / (1 + ca.sumsqr(c)) * (cross + cross @ cross)


def turn_about(about: int, cosine: SX, sine: SX, scale: SX | float = 1.0) -> SX:
    """Return the rotation matrix (3, 3) about a coordinate axis, times a scale; cosine and sine include the scale."""
    i, j = (about + 1) % 3, (about + 2) % 3
    matrix = SX.eye(3) * scale
    matrix[i, i] = matrix[j, j] = cosine
    matrix[j, i], matrix[i, j] = sine, -sine
    return matrix


def matrix_from_axis_angle(axis: SX, angle: SX) -> SX:
    """Return the rotation matrix ``exp(angle [axis]x)``, (3, 3) (equation 9, Rodrigues' formula).

    Args:
        axis: (3, 1) unit vector.
        angle: (1, 1) radians.
    """
    cross = ca.skew(axis)
    return SX.eye(3) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * cross @ cross


class AxisAngle(NamedTuple):
    """Rotation by unit axis (3,) and angle, radians."""

    axis: FloatArray
    angle: float


def axis_angle_from_matrix(matrix: ArrayLike) -> AxisAngle:
    """Return the unit axis and the angle of a rotation matrix.

    Args:
        matrix: (3, 3) rotation matrix of numbers.

    Returns:
        Unit axis, and angle in [0, pi]. Without rotation the axis is z by convention; at half a turn the
        axis's first component that is not zero is positive.

    Raises:
        ValueError: the matrix has another shape.
    """
    R = frozen_array(matrix, (3, 3))
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    size = float(np.linalg.norm(sine))
    cosine = (float(np.trace(R)) - 1) / 2
    angle = math.atan2(size, cosine)
    if cosine > 0:
        axis = sine / size if size > 0 else np.array([0.0, 0.0, 1.0])
        return AxisAngle(frozen_array(axis, (3,)), angle)
    # Beyond a right angle the symmetric part, n n' (1 - cos), gives the axis more accurately than the sine, which tends
    # to zero at half a turn.
    outer = (R + R.T) / 2 - cosine * np.eye(3)
    axis = outer[:, int(np.argmax(np.diag(outer)))]
    axis = axis / np.linalg.norm(axis)
    lead = float(axis @ sine) if size > 1e-12 else float(axis[np.flatnonzero(np.abs(axis) > 1e-12)[0]])
    return AxisAngle(frozen_array(axis if lead > 0 else -axis, (3,)), angle)


def perpendiculars(axis: FloatArray) -> FloatArray:
    """Return two unit vectors (2, 3) perpendicular to a unit axis (3,) and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first)])


def quaternion_from_matrix(R: FloatArray) -> FloatArray:
    """Return the unit quaternion (4,), scalar part first and not negative, of a rotation matrix (3, 3).

    The largest component is computed from the diagonal, and the others are divided by it, so that no digits are lost
    (S. W. Shepperd, "Quaternion from rotation matrix", 1978).
    """
    squares = np.array(
        [
            1 + R[0, 0] + R[1, 1] + R[2, 2],
            1 + R[0, 0] - R[1, 1] - R[2, 2],
            1 - R[0, 0] + R[1, 1] - R[2, 2],
            1 - R[0, 0] - R[1, 1] + R[2, 2],
        ]
    )
    w, x, y = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    a, b, c = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
    rows = np.array([[squares[0], w, x, y], [w, squares[1], a, b], [x, a, squares[2], c], [y, b, c, squares[3]]])
    q = rows[int(np.argmax(squares))]
    q = q / np.linalg.norm(q)
    return np.asarray(-q if q[0] < 0 else q)
