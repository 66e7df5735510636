"""Smallest and largest eigenvalue of a symmetric positive semidefinite matrix, as smooth expressions.

No closed form exists, and an eigenvalue itself has a corner where two of them meet, which is just where an optimum
likes to lie. What stands here is smooth everywhere, made of ``+ - * /`` and square roots alone, and never on the unsafe
side. For a positive definite matrix A,

    mu(A) = (tr A^-m)^(-1/m) <= lambda_min(A),

short of it by the factor ``r^(-1/m)`` where r eigenvalues are smallest and by little where one is. Shifting A almost by
what is found and looking again multiplies that error by ``1 - r^(-1/m)`` once more:

    theta <- theta + mu(A - theta I),        theta < lambda_min(A) throughout.

The largest eigenvalue is ``c - lambda_min(c I - A)`` for any larger c, and is estimated from above.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

#: Squarings of the inverse: ``m = 2 ** _SQUARINGS``.
_SQUARINGS = 3
#: Rounds of shifting. Two leave an error of 0.083^2 = 0.7 % of a double eigenvalue (0.35 % of the singular value), and
#: next to none of one whose neighbour is half as large again. More would be closer, and the rounded corner so sharp
#: that Newton steps across it fail: with four rounds two thirds of the searches did.
_ROUNDS = 2
#: The next shift goes this part of the way, so that what is inverted stays well away from singular.
_CLOSE = 0.999
#: A first shift below zero, in parts of the mean eigenvalue, so that a singular matrix can be inverted.
_FLOOR = 1e-10


def smallest_eigenvalue(A: SX) -> SX:
    """(1, 1) estimate from below of the smallest eigenvalue of a symmetric positive semidefinite (n, n)."""
    n = A.shape[0]
    scale = ca.trace(A) / n
    theta = -_FLOOR * scale
    found = theta
    for _ in range(_ROUNDS):
        found = theta + _root_of_inverse(A - theta * SX.eye(n), scale)
        theta = theta + _CLOSE * (found - theta)
    return found


def largest_eigenvalue(A: SX) -> SX:
    """(1, 1) estimate from above of the largest eigenvalue of a symmetric positive semidefinite (n, n)."""
    n = A.shape[0]
    scale = ca.trace(A)
    # (tr A^m)^(1/m) is above, by no more than n^(1/m).
    power = A / scale
    for _ in range(_SQUARINGS):
        power = power @ power
    ceiling = _rooted(ca.trace(power)) * scale
    above = ceiling * (2 - _CLOSE)
    found = above
    for _ in range(_ROUNDS):
        gap = _root_of_inverse(above * SX.eye(n) - A, scale)
        found = above - gap
        above = above - _CLOSE * gap
    return found


def _root_of_inverse(A: SX, scale: SX) -> SX:
    """``(tr A^-m)^(-1/m)`` of a positive definite matrix, its numbers first brought to order 1 by a scale."""
    inverse = _inverse(A / scale)
    size = ca.trace(inverse)
    power = inverse / size
    for _ in range(_SQUARINGS):
        power = power @ power
    return scale / (size * _rooted(ca.trace(power)))


def _rooted(value: SX) -> SX:
    for _ in range(_SQUARINGS):
        value = ca.sqrt(value)
    return value


def _inverse(A: SX) -> SX:
    """Inverse of a positive definite matrix by Gauss and Jordan; no pivoting is needed."""
    n = A.shape[0]
    rows = [[A[i, j] for j in range(n)] for i in range(n)]
    for k in range(n):
        pivot = 1 / rows[k][k]
        scaled = [each * pivot for each in rows[k]]
        for i in range(n):
            if i == k:
                continue
            factor = rows[i][k]
            rows[i] = [rows[i][j] - factor * scaled[j] if j != k else -factor * pivot for j in range(n)]
        rows[k] = [scaled[j] if j != k else pivot for j in range(n)]
    return ca.blockcat(rows)
