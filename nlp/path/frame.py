"""Frame of a path in the world frame: origin, rotation, and bounds of rounding errors.

Segments keep their parameters in the path's frame: arcs in planes of its axes, angles that change linearly. The pose in
the world frame is ``t + R p`` and ``R R(angles)``. Entries of R that vanish for the three angles are exactly zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from .orientation import ORDERS, quaternion_products, quaternions_from_angles

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative error of the computed ``t + R p``, with respect to the absolute values of its terms. An entry of R is a sum
#: of two products of three cosines or sines, with at most 17 roundings (2^-53); the sum adds 4, in total 21 of 32.
_OFF = 2.0**-48


@dataclass(frozen=True, eq=False)
class PathFrame:
    """Frame of a path in the world frame.

    Attributes:
        origin: (3,) origin in the world frame, length.
        angles: (3,) roll, pitch and yaw, radians.
    """

    origin: FloatArray
    angles: FloatArray

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation matrix (3, 3) from path to world coordinates."""
        return np.asarray(np.linalg.multi_dot([self._about(axis) for axis in ORDERS["rpy"]]))

    @cached_property
    def pattern(self) -> NDArray[np.bool_]:
        """True for each entry (3, 3) of the rotation that may differ from zero."""
        first, second, third = ((self._about(axis) != 0).astype(int) for axis in ORDERS["rpy"])
        return np.asarray(first @ second @ third > 0)

    @cached_property
    def quaternion(self) -> FloatArray:
        """Unit quaternion (1, 4) of the rotation."""
        return quaternions_from_angles(self.angles[None], ORDERS["rpy"])

    def _about(self, axis: int) -> FloatArray:
        """Return the rotation matrix (3, 3) of the angle about an axis."""
        cosine, sine = np.cos(self.angles[axis]), np.sin(self.angles[axis])
        first, second = (axis + 1) % 3, (axis + 2) % 3
        matrix = np.eye(3)
        matrix[first, first] = matrix[second, second] = cosine
        matrix[first, second], matrix[second, first] = -sine, sine
        return matrix

    def positions(self, points: FloatArray) -> FloatArray:
        """Return world positions (n, 3) of points (n, 3) of the frame."""
        return np.asarray(self.vectors(points) + self.origin)

    def vectors(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors (n, 3) of vectors (n, 3) of the frame."""
        return np.asarray(vectors @ self.rotation.T)

    def orientations(self, quaternions: FloatArray) -> FloatArray:
        """Return world quaternions (n, 4) of unit quaternions (n, 4) of the frame."""
        return quaternion_products(self.quaternion, quaternions)

    def sizes(self, points: FloatArray) -> FloatArray:
        """Return the sums (n, 3) of the absolute terms in the positions of points (n, 3)."""
        return np.asarray(np.abs(points) @ self.pattern.T + np.abs(self.origin))

    def off_positions(self, points: FloatArray) -> FloatArray:
        """Return error bounds (n, 3) of computed positions of points (n, 3); zero without rounding."""
        is_exact = (self.pattern.sum(axis=1) == 1) & (self.origin == 0)
        return np.where(is_exact, 0.0, _OFF * self.sizes(points))

    def off_vectors(self, vectors: FloatArray) -> FloatArray:
        """Return error bounds (n, 3) of computed vectors (n, 3); zero without rounding."""
        return np.where(self.pattern.sum(axis=1) == 1, 0.0, _OFF * (np.abs(vectors) @ self.pattern.T))
