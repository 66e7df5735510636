"""Orientations of a path, radians: three angles about the axes x, y and z, quaternions, and rotation matrices.

Convention ``rpy`` (roll, pitch and yaw) is the rotation ``Rz(C) Ry(B) Rx(A)`` of the angles A, B and C, as in a case
file and in LinuxCNC's kinematics of hexapods. Other names list the factors from left to right: ``xyz`` is ``Rx(A) Ry(B)
Rz(C)``. A quaternion is ``(w, x, y, z)``.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray
from ..errors import InputError, nearest

#: Axes of the factors of a rotation from left to right: 0, 1, 2 for x, y, z.
Order: TypeAlias = "tuple[int, int, int]"
#: Orders of the factors, by name of the convention.
ORDERS: Mapping[str, Order] = {
    "rpy": (2, 1, 0),
    **{"".join("xyz"[axis] for axis in (a, b, c)): (a, b, c) for a, b, c in itertools.permutations(range(3))},
}


def order_named(name: str) -> Order:
    """Return the order of a rotation's factors by the name of the convention.

    Raises:
        InputError: the convention is unknown.
    """
    if name not in ORDERS:
        raise InputError(f"angles = {name!r}: no such convention; {nearest(name, ORDERS)}")
    return ORDERS[name]


def quaternions_from_angles(angles: FloatArray, order: Order) -> FloatArray:
    """Return the quaternions (n, 4) of three angles (n, 3)."""
    half = angles / 2
    product = np.zeros((len(angles), 4))
    product[:, 0] = 1
    for axis in order:
        factor = np.zeros_like(product)
        factor[:, 0], factor[:, 1 + axis] = np.cos(half[:, axis]), np.sin(half[:, axis])
        product = quaternion_products(product, factor)
    return product


def quaternion_products(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the products (n, 4) of quaternions: the rotation on the right acts first."""
    w, v, q, u = left[:, :1], left[:, 1:], right[:, :1], right[:, 1:]
    scalar = w * q - np.sum(v * u, axis=1, keepdims=True)
    return np.hstack([scalar, w * u + q * v + np.cross(v, u)])


def matrices_from_quaternions(quaternions: FloatArray) -> FloatArray:
    """Return the rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    w, x, y, z = quaternions.T
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def roll_pitch_yaw(quaternions: FloatArray) -> FloatArray:
    """Return the ``rpy`` angles (n, 3) of unit quaternions (n, 4), with a pitch of at most a right angle.

    At a pitch of a right angle only one combination of roll and yaw is determined. The roll is the remaining angle
    after removal of the yaw, so that the three angles give the rotation there too.
    """
    R = matrices_from_quaternions(quaternions)
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    sine, cosine = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(sine * R[:, 0, 2] - cosine * R[:, 1, 2], cosine * R[:, 1, 1] - sine * R[:, 0, 1])
    return np.stack([roll, pitch, yaw], axis=1)


def shortest_turns(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the axes (n, 3), world frame, and angles (n,), in [0, pi], of the rotations between orientations.

    Args:
        start: (n, 4) unit quaternions.
        end: (n, 4) unit quaternions after the rotations.
    """
    turn = quaternion_products(end, start * [1, -1, -1, -1])
    turn[turn[:, 0] < 0] *= -1
    sine = np.linalg.norm(turn[:, 1:], axis=1)
    axes = np.where(sine[:, None] > 0, turn[:, 1:], [0, 0, 1]) / np.where(sine > 0, sine, 1)[:, None]
    return axes, 2 * np.arctan2(sine, turn[:, 0])


def turned(start: FloatArray, axes: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the quaternions (n, 4) after rotations about world axes (n, 3) by angles (n,)."""
    return quaternion_products(np.hstack([np.cos(angles / 2)[:, None], np.sin(angles / 2)[:, None] * axes]), start)


def symbolic_rotation(angles: SX, order: Order) -> SX:
    """Return the rotation matrix (3, 3) of three angles (3, 1)."""
    factors = [_about(axis, angles[axis]) for axis in order]
    return factors[0] @ factors[1] @ factors[2]


def _about(axis: int, angle: SX) -> SX:
    """Return the rotation matrix about a coordinate axis, with entries sine, cosine, 0 and 1 only."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix = SX.eye(3)
    matrix[first, first] = matrix[second, second] = ca.cos(angle)
    matrix[second, first], matrix[first, second] = ca.sin(angle), -ca.sin(angle)
    return matrix
