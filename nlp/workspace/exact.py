"""Determinants of the rows of six legs without rounding, and the singular pose between two poses of opposite sign.

The coordinates of a pose and the joint centres are doubles, hence fractions, and the rows of :mod:`.rows` are
polynomials in them: the sign of their determinant is computed with whole numbers. The rows are built here from a
quaternion and not from the formulas of the search.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from ...models import FloatArray
from ..case.workspace import TurnKind
from .machine import Legs
from .posebox import PoseBox

#: Halvings of a segment between two poses: more than a double has digits.
_HALVINGS = 60


def determinant_sign(legs: Legs, box: PoseBox, y: FloatArray) -> int:
    """Return the sign of the determinant of the rows at a point (6,), without rounding."""
    return _sign_of_determinant(_rows(legs, box, [Fraction(float(each)) for each in y]))


def singular_between(legs: Legs, box: PoseBox, positive: FloatArray, negative: FloatArray) -> FloatArray:
    """Return the point (6,) of a segment at which the determinant changes its sign, to the last digits.

    Args:
        legs: joint centres.
        box: the whole box.
        positive: (6,) a point at which the determinant is positive.
        negative: (6,) one at which it is negative.
    """
    for _ in range(_HALVINGS):
        middle = 0.5 * positive + 0.5 * negative
        sign = determinant_sign(legs, box, middle)
        if sign == 0 or (middle == positive).all() or (middle == negative).all():
            return middle
        if sign > 0:
            positive = middle
        else:
            negative = middle
    return 0.5 * positive + 0.5 * negative


def _rows(legs: Legs, box: PoseBox, y: Sequence[Fraction]) -> list[list[Fraction]]:
    """Return the scaled rows at a point."""
    w, i, j, k = _quaternion(box, y[3:])
    scale = w * w + i * i + j * j + k * k
    turn = (
        (w * w + i * i - j * j - k * k, 2 * (i * j - w * k), 2 * (i * k + w * j)),
        (2 * (i * j + w * k), w * w - i * i + j * j - k * k, 2 * (j * k - w * i)),
        (2 * (i * k - w * j), 2 * (j * k + w * i), w * w - i * i - j * j + k * k),
    )
    rows = []
    for base, platform in zip(legs.base.tolist(), legs.platform.tolist(), strict=True):
        a = [Fraction(each) for each in platform]
        d = [each - Fraction(b) for each, b in zip(y[:3], base, strict=True)]
        u = [sum((each * part for each, part in zip(row, a, strict=True)), Fraction(0)) for row in turn]
        moment = [u[1] * d[2] - u[2] * d[1], u[2] * d[0] - u[0] * d[2], u[0] * d[1] - u[1] * d[0]]
        rows.append([*(scale * part + each for part, each in zip(d, u, strict=True)), *moment])
    return rows


def _quaternion(box: PoseBox, turn: Sequence[Fraction]) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """Return a quaternion of the rotation with these coordinates, of any size."""
    a, b, c = turn
    one = Fraction(1)
    if box.kind is TurnKind.ANY_AXIS:
        return one, a, b, c
    if box.kind is TurnKind.AXIS:
        x, y, z = (Fraction(each) * a for each in box.axis.tolist())
        return one, x, y, z
    roll, pitch, yaw = (one, a, 0 * one, 0 * one), (one, 0 * one, b, 0 * one), (one, 0 * one, 0 * one, c)
    return _product(_product(yaw, pitch), roll)


_Quaternion = tuple[Fraction, Fraction, Fraction, Fraction]


def _product(p: _Quaternion, q: _Quaternion) -> _Quaternion:
    """Return the product of two quaternions, w first."""
    a, b, c, d = p
    e, f, g, h = q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def _sign_of_determinant(rows: list[list[Fraction]]) -> int:
    """Return the sign of a determinant by elimination; the rows are changed."""
    sign = 1
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            rows[k], rows[pivot], sign = rows[pivot], rows[k], -sign
        if rows[k][k] < 0:
            sign = -sign
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [each - factor * other for each, other in zip(rows[i], rows[k], strict=True)]
    return int(np.sign(sign))
