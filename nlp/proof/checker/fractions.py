"""Exact fractions: bounds of tangents of half angles, of sine and cosine, and signs of determinants.

Doubles are fractions. Sine and cosine of a half angle lie between two partial sums of their series, whose terms
alternate and decrease for angles up to 150 degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

#: Number of terms of the series of sine and cosine: the last one is below 1e-24 for half of 150 degrees.
_TERMS = 14


def tangent_ends(angle: float) -> tuple[Fraction, Fraction]:
    """Return two fractions that bound the tangent of half an angle.

    Args:
        angle: angle as a double, radians, between -150 and 150 degrees.
    """
    x = abs(Fraction(angle)) / 2
    (sine_low, sine_high), (cosine_low, cosine_high) = _partial_sums(x, x, 1), _partial_sums(Fraction(1), x, 0)
    low, high = sine_low / cosine_high, sine_high / cosine_low
    return (low, high) if angle >= 0 else (-high, -low)


def sine_cosine_ends(angle: float) -> tuple[tuple[Fraction, Fraction], tuple[Fraction, Fraction]]:
    """Return two fractions that bound the sine of an angle, and two that bound its cosine.

    Args:
        angle: angle as a double, radians, at most two whole turns.
    """
    # Sixteenths of the angle are small enough for the series; doublings multiply the width of the ends.
    x, doublings = abs(Fraction(angle)) / 16, 4
    sine, cosine = _partial_sums(x, x, 1), _partial_sums(Fraction(1), x, 0)
    for _ in range(doublings):
        products = [2 * a * b for a in sine for b in cosine]
        squares = [a * a for a in sine]
        least = Fraction(0) if sine[0] <= 0 <= sine[1] else min(squares)
        sine, cosine = (min(products), max(products)), (1 - 2 * max(squares), 1 - 2 * least)
    return (sine if angle >= 0 else (-sine[1], -sine[0])), cosine


def _partial_sums(first: Fraction, x: Fraction, order: int) -> tuple[Fraction, Fraction]:
    """Return a lower and an upper bound of sin x (first = x, order 1) or cos x (first = 1, order 0).

    The bounds are consecutive partial sums of the Taylor series.
    """
    term, total, before = first, first, first
    for k in range(_TERMS):
        term = -term * x * x / ((order + 2 * k + 1) * (order + 2 * k + 2))
        before, total = total, total + term
    return min(before, total), max(before, total)


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
