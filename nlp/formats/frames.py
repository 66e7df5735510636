"""Frames of bodies, and conversions between rotation matrices, quaternions and the angles of URDF."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...models.arrays import FloatArray

#: Sine of a rotation angle below which the axis is not computed from the skew part of the matrix.
_SMALL = 1e-9


@dataclass(frozen=True, eq=False)
class Frame:
    """Frame of a body, or frame on a body.

    Attributes:
        position: (3,) origin of the frame, length.
        rotation: (3, 3) axes of the frame as columns.
    """

    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def __matmul__(self, inner: Frame) -> Frame:
        """Return a frame, given relative to this frame, in the coordinates in which this frame is given."""
        return Frame(self.position + self.rotation @ inner.position, self.rotation @ inner.rotation)

    def inverse(self) -> Frame:
        """Return the world frame in the coordinates of this frame."""
        return Frame(-self.rotation.T @ self.position, self.rotation.T)


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation (3, 3) about a unit axis (3,) by an angle in radians (Rodrigues)."""
    K = cross_matrix(axis)
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def rotation_from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the rotation (3, 3) of URDF's ``rpy``, radians: about the fixed axes x, then y, then z."""
    x, y, z = np.eye(3)
    return rotation_about(z, yaw) @ rotation_about(y, pitch) @ rotation_about(x, roll)


def rotation_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) of a quaternion (4,), scalar part first, of any length."""
    w, *v = quaternion / np.linalg.norm(quaternion)
    K = cross_matrix(np.array(v))
    return np.asarray(np.eye(3) + 2 * w * K + 2 * K @ K)


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Return axis times angle (3,) of a rotation (3, 3), radians, angle from 0 to pi."""
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine, cosine = float(np.linalg.norm(skew)) / 2, (float(np.trace(rotation)) - 1) / 2
    angle = float(np.arctan2(sine, cosine))
    if sine > _SMALL:
        return np.asarray(skew / (2 * sine) * angle)
    if cosine > 0:
        return np.asarray(skew / 2)
    column = (rotation + np.eye(3))[:, int(np.argmax(np.diag(rotation)))]
    return np.asarray(column / np.linalg.norm(column) * angle)


def cross_matrix(v: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) of the cross product with a vector (3,)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def axis_frame(point: FloatArray, axis: FloatArray) -> Frame:
    """Return a frame at a point (3,) with z along an axis (3,) of any length but zero."""
    z = axis / np.linalg.norm(axis)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return Frame(point, np.column_stack([x, np.cross(z, x), z]))


def roll_pitch_yaw_of(R: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw (3,) of URDF, radians, with ``R = Rz(yaw) Ry(pitch) Rx(roll)``.

    The roll is computed after the yaw is removed, so that the result stays accurate at a pitch of 90 degrees.
    """
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    yaw = np.arctan2(R[1, 0], R[0, 0]) if np.hypot(R[0, 0], R[1, 0]) > 0 else 0.0
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])
