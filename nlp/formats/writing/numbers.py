"""Numbers as text: the shortest text from which the same double is read again."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ....models import FloatArray

#: Entries of a unit vector or rotation below this are rounding errors of zero.
_NOISE = 1e-16


def number(value: float) -> str:
    """Return a number as text; minus zero is zero, and a whole number has no point."""
    text = repr(float(value) + 0.0)
    return text.removesuffix(".0")


def numbers(values: Iterable[float]) -> str:
    """Return numbers with spaces between them."""
    return " ".join(number(value) for value in values)


def direction(vector: FloatArray) -> str:
    """Return a unit vector (3,) as text, without entries that are rounding errors."""
    return numbers(np.where(np.abs(vector) < _NOISE, 0.0, vector))


def quaternion(R: FloatArray) -> FloatArray:
    """Return the unit quaternion (4,), scalar part first and not negative, of a rotation matrix (3, 3).

    The largest component is found from the diagonal, the others by division by it (S. W. Shepperd, "Quaternion from
    rotation matrix", 1978), so that no digits are lost.
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


def roll_pitch_yaw(R: FloatArray) -> FloatArray:
    """Return the angles (3,), radians, with which ``R = Rz(yaw) Ry(pitch) Rx(roll)``, as URDF has them.

    The roll is computed after the yaw is taken out, so that the three together stay accurate at a pitch of 90 degrees.
    """
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    yaw = np.arctan2(R[1, 0], R[0, 0]) if np.hypot(R[0, 0], R[1, 0]) > 0 else 0.0
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])
