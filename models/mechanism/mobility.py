"""Platform twists that free joints of a mechanism allow: image of the null space of their loop equations.

Unknowns are the rates of the free joints along a spanning tree from the base. Each joint that closes a loop gives six
equations, and each coupling one. Twists are scaled: about the middle of the joints, with velocities relative to the
mechanism's size.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray
from ..rows import rank_of
from .graph import Mechanism, MechanismJoint
from .motions import WIDTHS, joint_screws, size_of
from .topology import spanning_tree


def null_space(matrix: FloatArray) -> FloatArray:
    """Return an orthonormal basis (n, n - r) of the null space of a matrix (m, n)."""
    _, values, right = np.linalg.svd(matrix, full_matrices=True)
    return np.asarray(right[rank_of(values) :].T)


def column_space(matrix: FloatArray, scale: float) -> FloatArray:
    """Return an orthonormal basis (m, r) of the column span; singular values far below ``scale`` count as 0."""
    left, values, _ = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(left[:, : rank_of(values, scale)])


@dataclass(frozen=True, eq=False)
class AllowedTwists:
    """Motions that free joints allow: twists of the platform and rates of the joints.

    Attributes:
        twists: (6, r) basis of the platform twists: angular velocity, then velocity of the platform point at the world
            origin.
        platform: (6, d) platform twist in each motion, in the same coordinates.
        rates: (n, d) rates of the free coordinates in each motion, radians or length per unit of time.
        columns: index of the joint of each coordinate.
    """

    twists: FloatArray
    platform: FloatArray
    rates: FloatArray
    columns: tuple[int, ...]


class Mobility:
    """Allowed platform twists of a mechanism at its configuration.

    Args:
        mechanism: mechanism with closed loops.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.size = mechanism, size_of(mechanism)
        joints = mechanism.joints
        self.middle = np.mean([joint.point for joint in joints if joint.kind != "weld"], axis=0)
        still = np.eye(3)
        self._screws = [self.scaled(joint_screws(joint, still, joint.point)) for joint in joints]
        self._units = [self.size if joint.kind == "P" else 1.0 for joint in joints]
        self._index = {joint.name: k for k, joint in enumerate(joints)}

    def allowed(self, joints: Collection[int], free: Collection[int]) -> AllowedTwists:
        """Return the platform twists that free joints allow.

        Args:
            joints: indices of the joints in use; welds are always in use.
            free: indices, among ``joints``, of the joints that move.
        """
        own = [k for k, each in enumerate(self.mechanism.joints) if k in joints or each.kind == "weld"]
        widths = [WIDTHS[self.mechanism.joints[k].kind] if k in free else 0 for k in own]
        ends = np.cumsum([0, *widths])
        count = int(ends[-1])
        edges = [(self.mechanism.joints[k].inner, self.mechanism.joints[k].outer) for k in own]
        tree = spanning_tree([self.mechanism.base], edges, lambda k: widths[k])
        twists = {self.mechanism.base: np.zeros((6, count))}
        for k, parent, child in tree.branches:
            twist = twists[parent].copy()
            if widths[k]:
                sign = 1.0 if edges[k][0] == parent else -1.0
                twist[:, ends[k] : ends[k + 1]] += sign * self._unit_screws(own[k])
            twists[child] = twist
        rows = [self._couplings(own, free, widths)]
        for k in tree.chords:
            row = twists[edges[k][1]] - twists[edges[k][0]]
            if widths[k]:
                row[:, ends[k] : ends[k + 1]] -= self._unit_screws(own[k])
            rows.append(row)
        motions = null_space(np.vstack(rows)) if count else np.zeros((0, 0))
        platform = twists.get(self.mechanism.platform, np.zeros((6, count))) @ motions
        columns = tuple(k for k, width in zip(own, widths, strict=True) for _ in range(width))
        units = np.array([self._units[k] for k in columns])
        basis = column_space(platform, 1.0) if count else np.zeros((6, 0))
        return AllowedTwists(self.unscaled(basis), self.unscaled(platform), units[:, None] * motions, columns)

    def _couplings(self, used: Sequence[int], free: Collection[int], widths: Sequence[int]) -> FloatArray:
        """Return the equations (c, n) of the couplings with all moving joints in use."""
        ends = np.cumsum([0, *widths])
        place = {k: int(ends[i]) for i, k in enumerate(used) if widths[i]}
        rows = [np.zeros((0, int(ends[-1])))]
        for coupling in self.mechanism.couplings:
            factors = {self._index[name]: factor for name, factor in coupling.factors}
            moving = {k: factor * self._units[k] for k, factor in factors.items() if k in free}
            if not moving or not set(factors) <= set(used):
                continue
            row = np.zeros((1, int(ends[-1])))
            for k, factor in moving.items():
                row[0, place[k]] = factor
            rows.append(row / np.abs(row).max())
        return np.vstack(rows)

    def angle(self, joint: MechanismJoint) -> float:
        """Return the factor from a joint's rate to a velocity: the size for an angle, 1 for a slide."""
        return 1.0 if joint.kind == "P" else self.size

    def _unit_screws(self, k: int) -> FloatArray:
        """Return the screws of a joint for scaled rates."""
        return self._screws[k] * self._units[k]

    def scaled(self, twists: FloatArray) -> FloatArray:
        """Return scaled twists (6, n): about the middle of the joints, with velocities relative to the size."""
        velocities = twists[3:] + np.cross(twists[:3].T, self.middle).T
        return np.vstack([twists[:3], velocities / self.size])

    def unscaled(self, twists: FloatArray) -> FloatArray:
        """Return twists (6, n) with velocities at the world origin from scaled ones."""
        velocities = self.size * twists[3:] - np.cross(twists[:3].T, self.middle).T
        return np.vstack([twists[:3], velocities])
