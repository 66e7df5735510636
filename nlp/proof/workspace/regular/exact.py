"""Determinants of the rows of six legs without rounding, and the singular pose between two poses of opposite sign.

The coordinates of a pose and the joint centres are doubles, hence fractions of whole numbers. The rows of :mod:`.rows`
are polynomials in them: the sign of their determinant is computed with whole numbers. The rows are built here from a
quaternion and not from the formulas of the search.
"""

from __future__ import annotations

from collections.abc import Sequence

from .....models import FloatArray
from ....case.workspace import TurnKind
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox

#: Halvings of a segment between two poses: more than a double has digits.
_HALVINGS = 60


def determinant_sign(legs: Legs, box: PoseBox, y: FloatArray) -> int:
    """Return the sign of the determinant of the rows at a point (6,), without rounding."""
    return _sign_of_determinant(_rows(legs, box, y))


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


def _rows(legs: Legs, box: PoseBox, y: FloatArray) -> list[list[int]]:
    """Return the scaled rows at a point (6,), each column times a positive number."""
    w, i, j, k = _quaternion(box, y[3:])
    scale = w * w + i * i + j * j + k * k
    turn = (
        (w * w + i * i - j * j - k * k, 2 * (i * j - w * k), 2 * (i * k + w * j)),
        (2 * (i * j + w * k), w * w - i * i + j * j - k * k, 2 * (j * k - w * i)),
        (2 * (i * k - w * j), 2 * (j * k + w * i), w * w - i * i - j * j + k * k),
    )
    lengths = _whole([*y[:3].tolist(), *legs.base.ravel().tolist(), *legs.platform.ravel().tolist()])[1:]
    position, base, platform = lengths[:3], lengths[3:21], lengths[21:]
    rows = []
    for leg in range(0, 18, 3):
        a, d = platform[leg : leg + 3], [p - b for p, b in zip(position, base[leg : leg + 3], strict=True)]
        u = [sum(each * part for each, part in zip(row, a, strict=True)) for row in turn]
        moment = [u[1] * d[2] - u[2] * d[1], u[2] * d[0] - u[0] * d[2], u[0] * d[1] - u[1] * d[0]]
        rows.append([*(scale * part + each for part, each in zip(d, u, strict=True)), *moment])
    return rows


_Quaternion = tuple[int, int, int, int]


def _whole(values: Sequence[float]) -> list[int]:
    """Return the least common denominator of doubles, then their numerators."""
    ratios = [each.as_integer_ratio() for each in values]
    common = max(denominator for _, denominator in ratios)
    return [common, *(numerator * (common // denominator) for numerator, denominator in ratios)]


def _quaternion(box: PoseBox, turn: FloatArray) -> _Quaternion:
    """Return a quaternion in whole numbers, of any size, of the rotation with these coordinates."""
    one, a, b, c = _whole(turn.tolist())
    if box.kind is TurnKind.ANY_AXIS:
        return one, a, b, c
    if box.kind is TurnKind.AXIS:
        whole, x, y, z = _whole(box.axis.tolist())
        return one * whole, a * x, a * y, a * z
    return _product(_product((one, 0, 0, c), (one, 0, b, 0)), (one, a, 0, 0))


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


def _sign_of_determinant(rows: Sequence[Sequence[int]]) -> int:
    """Return the sign of a determinant, by elimination in whole numbers (Bareiss)."""
    whole = [list(row) for row in rows]
    sign, before = 1, 1
    for k in range(len(whole) - 1):
        pivot = next((i for i in range(k, len(whole)) if whole[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            whole[k], whole[pivot], sign = whole[pivot], whole[k], -sign
        for i in range(k + 1, len(whole)):
            for j in range(k + 1, len(whole)):
                whole[i][j] = (whole[i][j] * whole[k][k] - whole[i][k] * whole[k][j]) // before
        before = whole[k][k]
    last = whole[-1][-1]
    return sign * ((last > 0) - (last < 0))
