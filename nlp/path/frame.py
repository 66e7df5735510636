"""Frame of a path in the world: its origin and rotation, and bounds of the rounding of what it moves.

A path keeps its pieces in its frame: arcs in planes of the axes, angles that change linearly. The pose in the world is
``t + R p`` and ``R R(angles)``. Entries of R that the three angles leave at zero are exactly zero.
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

#: Part of the sizes of the numbers in ``t + R p`` by which the computed one may be off. An entry of R is a sum of two
#: products of three cosines or sines, off by at most 17 roundings (2^-53); with those of the sum there are 21 of 32.
_OFF = 2.0**-48


@dataclass(frozen=True, eq=False)
class PathFrame:
    """Place of a path's frame in the world.

    Attributes:
        origin: (3,) in the world.
        angles: (3,) roll, pitch and yaw, radians.
    """

    origin: FloatArray
    angles: FloatArray

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation matrix (3, 3): path to world coordinates."""
        return np.asarray(np.linalg.multi_dot([self._about(axis) for axis in ORDERS["rpy"]]))

    @cached_property
    def pattern(self) -> NDArray[np.bool_]:
        """Whether each entry (3, 3) of the rotation may differ from zero."""
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
        """Return positions (n, 3) in the world of points (n, 3) of the frame."""
        return np.asarray(self.vectors(points) + self.origin)

    def vectors(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n, 3) in the world of vectors (n, 3) of the frame."""
        return np.asarray(vectors @ self.rotation.T)

    def orientations(self, quaternions: FloatArray) -> FloatArray:
        """Return quaternions (n, 4) in the world of unit quaternions (n, 4) in the frame."""
        return quaternion_products(self.quaternion, quaternions)

    def sizes(self, points: FloatArray) -> FloatArray:
        """Return the sums (n, 3) of the sizes of the numbers from which positions of points (n, 3) are computed."""
        return np.asarray(np.abs(points) @ self.pattern.T + np.abs(self.origin))

    def off_positions(self, points: FloatArray) -> FloatArray:
        """Return how far computed positions (n, 3) of points may be off; zero where nothing is rounded."""
        is_exact = (self.pattern.sum(axis=1) == 1) & (self.origin == 0)
        return np.where(is_exact, 0.0, _OFF * self.sizes(points))

    def off_vectors(self, vectors: FloatArray) -> FloatArray:
        """Return how far computed vectors (n, 3) may be off; zero where nothing is rounded."""
        return np.where(self.pattern.sum(axis=1) == 1, 0.0, _OFF * (np.abs(vectors) @ self.pattern.T))
