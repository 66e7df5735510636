"""Fractions: tangents of half angles between two of them, and signs of determinants of the rows of six legs.

Doubles are fractions. Sine and cosine of a half angle lie between two partial sums of their series, whose terms
alternate and fall for angles up to 150 degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ...case.workspace import TurnKind

#: Terms of the series of sine and cosine: the last one is below 1e-24 for half of 150 degrees.
_TERMS = 14

_Quaternion = tuple[Fraction, Fraction, Fraction, Fraction]


def tangent_ends(angle: float) -> tuple[Fraction, Fraction]:
    """Return two fractions between which the tangent of half an angle lies.

    Args:
        angle: a double, radians, of at most 150 degrees either way.
    """
    x = abs(Fraction(angle)) / 2
    (sine_low, sine_high), (cosine_low, cosine_high) = _partial_sums(x, x, 1), _partial_sums(Fraction(1), x, 0)
    low, high = sine_low / cosine_high, sine_high / cosine_low
    return (low, high) if angle >= 0 else (-high, -low)


def _partial_sums(first: Fraction, x: Fraction, order: int) -> tuple[Fraction, Fraction]:
    """Return two sums of an alternating series: one term apart, the lower one first."""
    term, total, before = first, first, first
    for k in range(_TERMS):
        term = -term * x * x / ((order + 2 * k + 1) * (order + 2 * k + 2))
        before, total = total, total + term
    return min(before, total), max(before, total)


def determinant_sign(
    kind: TurnKind,
    axis: Sequence[float],
    base: Sequence[Sequence[float]],
    platform: Sequence[Sequence[float]],
    y: Sequence[float],
) -> int:
    """Return the sign of the determinant of the rows at a pose.

    Args:
        kind: coordinates of rotations.
        axis: (3,) of rotations about one axis.
        base: (6, 3) joint centres on the base.
        platform: (6, 3) those on the platform.
        y: (6,) coordinates of the pose.
    """
    # Each row is scaled by the square of the quaternion's size.
    position = [Fraction(each) for each in y[:3]]
    turn = _scaled_rotation(_quaternion(kind, axis, [Fraction(each) for each in y[3:]]))
    scale = turn[3][0]
    rows = []
    for foot, joint in zip(base, platform, strict=True):
        a = [Fraction(each) for each in joint]
        arm = [sum((row[j] * a[j] for j in range(3)), Fraction(0)) for row in turn[:3]]
        span = [scale * (p - Fraction(b)) for p, b in zip(position, foot, strict=True)]
        # The moment of s (p - b) + u about the platform's origin is u x s (p - b): times s once too often.
        moment = [(arm[i - 2] * span[i - 1] - arm[i - 1] * span[i - 2]) / scale for i in range(3)]
        rows.append([*(each + part for each, part in zip(span, arm, strict=True)), *moment])
    return sign_of_determinant(rows)


def _quaternion(kind: TurnKind, axis: Sequence[float], turn: Sequence[Fraction]) -> _Quaternion:
    """Return a quaternion of any size of the rotation with these coordinates."""
    a, b, c = turn
    one = Fraction(1)
    if kind is TurnKind.ANY_AXIS:
        return one, a, b, c
    if kind is TurnKind.AXIS:
        x, y, z = (a * Fraction(each) for each in axis)
        return one, x, y, z
    # Yaw times pitch times roll.
    return one + a * b * c, a - b * c, b + a * c, c - a * b


def _scaled_rotation(q: _Quaternion) -> list[list[Fraction]]:
    """Return three rows of ``|q|^2`` times the rotation, then ``[|q|^2]``."""
    w, x, y, z = q
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        [w * w + x * x + y * y + z * z],
    ]


def sign_of_determinant(matrix: Sequence[Sequence[float | Fraction]]) -> int:
    """Return the sign of the determinant of a square matrix of doubles or fractions, by elimination."""
    rows, sign = [[Fraction(each) for each in row] for row in matrix], 1
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            rows[k], rows[pivot], sign = rows[pivot], rows[k], -sign
        sign = sign if rows[k][k] > 0 else -sign
        for row in rows[k + 1 :]:
            factor = row[k] / rows[k][k]
            for j in range(k, len(rows)):
                row[j] -= factor * rows[k][j]
    return sign
