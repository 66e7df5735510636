"""Distance between two line segments, as an expression.

The squared distance of the points ``p + s d`` and ``q + t e`` is a convex quadratic in s and t, and its minimum over
``0 <= s, t <= 1`` is found in closed form by three clampings: the best s for the lines, the best t for this s, the best
s for this t (V. J. Lumelsky, *On fast computation of distance between line segments*, Information Processing Letters 21
(1985); C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.9). Because the minimum is over a fixed set, its
derivative by the segments' ends is that of the quadratic at the nearest points (Danskin): the result is exact, and once
continuously differentiable wherever the nearest points are unique, which is everywhere but for parallel segments. The
second derivatives jump where a nearest point comes to an end of its segment.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

#: Keeps the division defined for parallel lines, in parts of the squared lengths; the sine of the lines' angle counts
#: squared beside it. Whatever s it gives there, t and s are improved once more; the squared distance is then too large
#: by a quarter of this part of a leg's squared length at most.
_PARALLEL = 1e-10


def squared_distance(p: SX, d: SX, q: SX, e: SX) -> SX:
    """Return the squared distance (1, 1) between the segments from p to p + d and from q to q + e.

    Args:
        p: (3, 1) start of the first segment, length.
        d: (3, 1) its span, not 0.
        q: (3, 1) start of the second segment.
        e: (3, 1) its span, not 0.
    """
    r = p - q
    a, b, c = ca.sumsqr(d), ca.dot(d, e), ca.sumsqr(e)
    f, g = ca.dot(d, r), ca.dot(e, r)
    s = _clamped((b * g - f * c) / (a * c - b * b + _PARALLEL * a * c))
    t = _clamped((b * s + g) / c)
    s = _clamped((b * t - f) / a)
    return ca.sumsqr(r + s * d - t * e)


def _clamped(value: SX) -> SX:
    return ca.fmax(0, ca.fmin(1, value))
