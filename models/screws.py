"""Lines, twists and wrenches as numbers, and the work rate between them.

Every screw is six numbers in ray order, direction first, with its moment taken about the origin of the world frame:

* a **twist** ``(omega, v)``: angular velocity (1/time) and the velocity (length/time) of the body point that coincides
  with the world origin;
* a **wrench** ``(f, m)``: force, and moment about the world origin (force * length).

A screw of intensity ``q`` about the unit axis ``s`` through the point ``s0`` with pitch ``h`` is
``q (s, s0 x s + h s)``; infinite pitch is ``q (0, s)``: a pure translation as a twist, a pure couple as a wrench.
A line is a screw of zero pitch. Twists and wrenches have the same coordinates, so the functions here serve both.

Source: R. S. Ball, *A Treatise on the Theory of Screws*, Cambridge University Press, 1900, and equations 3 to 6 of the
paper that :mod:`screwsynth.nlp.program.formulation` cites.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .arrays import FloatArray, frozen_array
from .values import dataclass

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: Relative length of the direction part below which it is a rounding error and the pitch is infinite. The ratio of both
#: lengths is about the distance of the axis from the origin, and no robot is 1e12 length units away.
_INFINITE_PITCH = 1e-12


@dataclass(frozen=True, eq=False)
class Screw:
    """A screw as axis, point, pitch and intensity.

    Attributes:
        axis: (3,) unit direction of the screw axis.
        point: (3,) point of the axis nearest to the world origin, length; the origin when the pitch is infinite, since
            the axis then has a direction but no position.
        pitch: translation per rotation (twist) or couple per force (wrench), length; ``math.inf`` for a pure
            translation or a pure couple.
        intensity: magnitude, at least 0: of the direction part, or of the moment part if the pitch is infinite.
    """

    axis: FloatArray
    point: FloatArray
    pitch: float
    intensity: float


def unit_vector(vector: ArrayLike) -> FloatArray:
    """Return a vector's direction, (3,) read-only, without overflow for very large or very small components.

    Args:
        vector: (3,) finite numbers, not all zero.

    Raises:
        ValueError: the vector has another shape, is zero or is not finite.
    """
    v = frozen_array(vector, (3,))
    if not (np.isfinite(v).all() and v.any()):
        raise ValueError("a direction must be finite and nonzero")
    scaled = v / np.abs(v).max()
    return frozen_array(scaled / np.linalg.norm(scaled), (3,))


def screw_from_axis(axis: ArrayLike, point: ArrayLike, pitch: float, intensity: float = 1.0) -> FloatArray:
    """Return the coordinates of a screw from its axis (equations 3 and 4).

    Args:
        axis: (3,) direction, any length but zero.
        point: (3,) any point of the axis, length. It has no effect when the pitch is infinite.
        pitch: length; ``math.inf`` gives the pure translation or pure couple along ``axis``.
        intensity: magnitude that multiplies the unit screw.

    Returns:
        (6,) read-only array, ``intensity * (s, point x s + pitch * s)``, or ``intensity * (0, s)``.

    Raises:
        ValueError: a shape is wrong, the axis is zero, or a number is not finite (the pitch may be ``+inf``).
    """
    s = np.array(axis, dtype=np.float64)
    s0 = np.array(point, dtype=np.float64)
    if s.shape != (3,) or s0.shape != (3,):
        raise ValueError(f"axis and point must have 3 components, got shapes {s.shape} and {s0.shape}")
    if not (np.isfinite(s).all() and s.any()):
        raise ValueError("axis must be finite and not zero")
    if not (np.isfinite(s0).all() and math.isfinite(intensity)):
        raise ValueError("point and intensity must be finite")
    if math.isnan(pitch) or pitch == -math.inf:
        raise ValueError("pitch must be a number or +inf")
    s = unit_vector(s)
    if math.isinf(pitch):
        return frozen_array(np.concatenate([np.zeros(3), intensity * s]), (6,))
    return frozen_array(intensity * np.concatenate([s, np.cross(s0, s) + pitch * s]), (6,))


def axis_from_screw(screw: ArrayLike) -> Screw:
    """Return axis, point, pitch and intensity of a twist or wrench: the inverse of :func:`screw_from_axis`.

    Args:
        screw: (6,) direction part, then moment part about the world origin.

    Raises:
        ValueError: there are not six numbers, all are zero, or one is not finite.
    """
    coordinates = frozen_array(screw, (6,))
    if not np.isfinite(coordinates).all():
        raise ValueError("a screw must be six finite numbers")
    largest = float(np.abs(coordinates).max())
    if largest == 0.0:
        raise ValueError("a screw of six zeros has no axis")
    # The coordinates are scaled first, so that squares neither overflow nor underflow.
    direction, moment = coordinates[:3] / largest, coordinates[3:] / largest
    intensity, couple = float(np.linalg.norm(direction)), float(np.linalg.norm(moment))
    if intensity <= _INFINITE_PITCH * couple:
        return Screw(frozen_array(moment / couple, (3,)), frozen_array(np.zeros(3), (3,)), math.inf, couple * largest)
    axis, moment = direction / intensity, moment / intensity
    return Screw(
        axis=frozen_array(axis, (3,)),
        point=frozen_array(np.cross(axis, moment), (3,)),
        pitch=float(axis @ moment),
        intensity=intensity * largest,
    )


def line_through(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the unit line from one point to another (equation 1, normalised).

    Args:
        first: (3,) point, length.
        second: (3,) another point, length.

    Returns:
        (6,) read-only array: unit direction from ``first`` to ``second``, then its moment about the world origin.

    Raises:
        ValueError: the points coincide, or a number is not finite.
    """
    start, end = frozen_array(first, (3,)), frozen_array(second, (3,))
    return screw_from_axis(end - start, start, 0.0)


def reciprocal_product(wrenches: ArrayLike, twist: ArrayLike) -> FloatArray:
    """Return the work rate ``m . omega + f . v`` of each wrench in a twist (equations 5 and 14).

    Args:
        wrenches: (6,) or (m, 6), force, then moment about the world origin.
        twist: (6,) angular velocity, then velocity of the body's point at the world origin.

    Returns:
        () or (m,) array, force * length / time.

    Raises:
        ValueError: the twist does not have six numbers.
    """
    rows = np.asarray(wrenches, dtype=np.float64)
    omega, v = np.split(frozen_array(twist, (6,)), 2)
    return np.asarray(rows[..., 3:] @ omega + rows[..., :3] @ v)


def moved_screw(screw: ArrayLike, rotation: ArrayLike, translation: ArrayLike) -> FloatArray:
    """Return a screw after its body is rotated by ``rotation`` and then translated by ``translation``.

    Args:
        screw: (6,) twist or wrench ``(s, s_o)``.
        rotation: (3, 3) rotation matrix ``R``.
        translation: (3,) translation ``t``, length.

    Returns:
        (6,) read-only array, ``(R s, R s_o + t x R s)``.

    Raises:
        ValueError: a shape is wrong.
    """
    coordinates, matrix = frozen_array(screw, (6,)), frozen_array(rotation, (3, 3))
    direction = matrix @ coordinates[:3]
    moment = matrix @ coordinates[3:] + np.cross(frozen_array(translation, (3,)), direction)
    return frozen_array(np.concatenate([direction, moment]), (6,))


class Displacement(NamedTuple):
    """A displacement of a body in the world frame: a point ``x`` goes to ``Q x + t``.

    Attributes:
        rotation: (3, 3) ``Q``.
        translation: (3,) translation ``t``, length.
    """

    rotation: FloatArray
    translation: FloatArray

    @property
    def is_identity(self) -> bool:
        """True if every point stays in its place."""
        return bool(np.array_equal(self.rotation, np.eye(3)) and not self.translation.any())

    @classmethod
    def by(cls, rotation: ArrayLike, translation: ArrayLike) -> Displacement:
        """Return the displacement with read-only copies of a rotation matrix (3, 3) and a translation (3,).

        Raises:
            ValueError: a shape is wrong.
        """
        return cls(frozen_array(rotation, (3, 3)), frozen_array(translation, (3,)))


def screw_displacement(screw: Screw, amount: float) -> Displacement:
    """Return the finite screw motion about an axis.

    Args:
        screw: screw with axis, point and pitch; its intensity has no effect.
        amount: angle about the axis, radians; translation along it, length, for an infinite pitch.
    """
    s = screw.axis
    if math.isinf(screw.pitch):
        return Displacement.by(np.eye(3), amount * s)
    cross = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    # Rodrigues' formula.
    Q = np.eye(3) + math.sin(amount) * cross + (1 - math.cos(amount)) * (cross @ cross)
    return Displacement.by(Q, screw.point - Q @ screw.point + screw.pitch * amount * s)


def displacement(twist: ArrayLike, t: float) -> Displacement:
    """Return the finite motion ``exp(t [twist])`` of a body that moves with a constant twist for a time ``t``.

    The motion is the screw motion about the twist's axis, which does not change the twist itself.

    Args:
        twist: (6,) angular velocity, then velocity of the body's point at the world origin.
        t: time.

    Raises:
        ValueError: the twist is zero or not finite.
    """
    screw = axis_from_screw(twist)
    return screw_displacement(screw, screw.intensity * t)
