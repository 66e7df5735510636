"""Angles of joints from the displacements of bodies: sine and cosine in closed form, each times one positive number."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
from casadi import SX


class Angle(NamedTuple):
    """An angle by its sine and cosine (1, 1), both times the same positive number."""

    sine: SX
    cosine: SX

    @property
    def reversed(self) -> Angle:
        """The angle with the other sign."""
        return Angle(-self.sine, self.cosine)


class TwoAngles(NamedTuple):
    """The angles of two rotations that follow each other."""

    first: Angle
    second: Angle


def angle_about(axis: SX, before: SX, after: SX) -> Angle:
    """Return the angle by which a rotation about a unit axis (3, 1) takes one vector (3, 1) to another.

    The vectors have equal parts along the axis, and parts across it that are not zero.
    """
    across, turned = before - axis * ca.dot(axis, before), after - axis * ca.dot(axis, after)
    return Angle(ca.dot(axis, ca.cross(across, turned)), ca.dot(across, turned))


def rotation_angle(axis: SX, rotation: SX) -> Angle:
    """Return the angle of a rotation (3, 3) about a unit axis (3, 1) of it: ``sin`` and ``cos`` times 2."""
    return Angle(ca.dot(axis, ca.inv_skew(rotation - rotation.T)), ca.trace(rotation) - 1)


def two_angles(axes: tuple[SX, SX], before: SX, after: SX, sign: float) -> TwoAngles:
    """Return the angles q1 and q2 with ``after = R(a1, q1) R(a2, q2) before``.

    ``a1 . after = a1 . R(a2, q2) before`` is ``A + B cos q2 + C sin q2`` and has two solutions; at home, where
    ``after = before``, one of them is 0. The solutions coincide where a1 lies in the plane of a2 and the vector.

    Args:
        axes: unit axes a1 and a2, (3, 1) each, at home.
        before: (3, 1) unit vector at home.
        after: (3, 1) current unit vector.
        sign: sign of ``C = a1 . (a2 x before)`` at home.
    """
    a1, a2 = axes
    A = ca.dot(a1, a2) * ca.dot(a2, before)
    B, C = ca.dot(a1, before) - A, ca.dot(a1, ca.cross(a2, before))
    n = ca.dot(a1, after) - A
    w = sign * ca.sqrt(B * B + C * C - n * n)
    second = Angle(C * n - B * w, B * n + C * w)
    square = B * B + C * C
    sine, cosine = second.sine / square, second.cosine / square
    turned = before + sine * ca.cross(a2, before) + (1 - cosine) * (a2 * ca.dot(a2, before) - before)
    return TwoAngles(angle_about(a1, turned, after), second)
