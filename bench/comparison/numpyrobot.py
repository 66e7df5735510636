"""F of the paper's Section 4.1 and its gradient in NumPy, for many points in one call, as a user would write them."""

from __future__ import annotations

import numpy as np

from screwsynth.models import FloatArray

_AZIMUTHS = np.repeat(np.radians([0.0, 120.0, 240.0]), 2)
_SIGNS = np.array([-1.0, 1.0] * 3)
_OMEGA, _VELOCITY = np.array([2.0, 2.0, 1.0]) / 3, np.array([-7.0, 12.0, -1.0]) / 3


def _circle(radius: float, half_angle: float) -> FloatArray:
    """Return six joint centres (6, 3) in the plane of their plate."""
    angles = _AZIMUTHS + _SIGNS * np.radians(half_angle)
    return radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(6)])


BASE, PLATFORM = _circle(12.0, 30.0), _circle(8.0, 8.0)
#: ``v + omega x b`` (6, 3): the work rate of leg i is its product with the leg's unit direction.
_G = _VELOCITY + np.cross(_OMEGA, BASE)


def values(x: FloatArray) -> FloatArray:
    """Return F (N,) at points (N, 6): position, then the vector part of the unit quaternion."""
    p, q = x[:, None, :3], x[:, None, 3:]
    q0 = np.sqrt(1 - np.sum(q * q, axis=-1, keepdims=True))
    turned = np.cross(q, PLATFORM)
    d = p + PLATFORM + 2 * (q0 * turned + np.cross(q, turned)) - BASE
    return np.asarray((np.sum(d * _G, axis=-1) ** 2 / np.sum(d * d, axis=-1)).sum(axis=-1))


def gradients(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return F (N,) and its gradient (N, 6)."""
    p, q = x[:, None, :3], x[:, None, 3:]
    q0 = np.sqrt(1 - np.sum(q * q, axis=-1, keepdims=True))
    turned = np.cross(q, PLATFORM)
    d = p + PLATFORM + 2 * (q0 * turned + np.cross(q, turned)) - BASE
    rate, square = np.sum(d * _G, axis=-1, keepdims=True), np.sum(d * d, axis=-1, keepdims=True)
    share = rate / square
    w = 2 * share * (_G - share * d)
    along = np.sum(turned * w, axis=-1, keepdims=True)
    by_q = 2 * (q0 * np.cross(PLATFORM, w) + np.cross(turned, w) + np.cross(PLATFORM, np.cross(w, q)) - along / q0 * q)
    return (share * rate).sum(axis=(1, 2)), np.hstack([w.sum(axis=1), by_q.sum(axis=1)])
