"""Rotations of a path with a turn about the tool's axis, as ranges of Cayley vectors.

The rotation ``R(s) = R_task(s) R_tool(psi(s))`` has one more factor than the path's orientations: a turn about an axis
of the platform, by an angle that changes linearly. Each factor of its quaternion is an exponential of a linear
function. So the second derivative is at most the square of half the sum of all rates, as for angles of any convention,
and the same bound of the distance from a chord is valid; see :mod:`.path_turns`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from ....path.orientation import matrices_from_quaternions, quaternion_products
from .path_turns import PER_RADIAN, ROUNDED, LinearAngles, OneReference, ShortestTurns, chord_hull, relative

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....path.settings import ToolTurn
    from .pose_box import Reference

#: Factor of the errors of quaternions at the ends of a rotation about a fixed axis, for the quaternions between them.
_BETWEEN = 16
#: Relative outward shift of a sum of two angular velocities, more than its rounding.
_OUTWARDS = 2.0**-50


@dataclass(frozen=True, eq=False)
class ToolTurns(OneReference):
    """Rotations of a path with a turn about the tool's axis, as Cayley vectors.

    Attributes:
        task: rotations of the path without the turn, relative to no rotation.
        tool: turn about the tool's axis.
        reference: reference of the Cayley vectors.
        units: indices of the quaternion units that may differ from zero in the rotations of the path.
    """

    task: LinearAngles | ShortestTurns
    tool: ToolTurn
    reference: Reference
    units: frozenset[int]
    kind = TurnKind.ANY_AXIS

    @cached_property
    def widths(self) -> FloatArray:
        """Sums (N,) of the changes of all angles over each segment, radians."""
        return np.asarray(self.task.widths + np.abs(np.diff(self.tool.angles)))

    @cached_property
    def _vary(self) -> FloatArray:
        """0 for coordinates (3,) that are zero at all points; else 1."""
        own = {unit ^ other for unit in self.units for other in self._tool_units | {0}}
        found = {unit ^ other for unit in own for other in range(4) if self.reference[other]}
        return np.array([float(unit in found) for unit in (1, 2, 3)])

    @property
    def _tool_units(self) -> set[int]:
        """Indices of the quaternion units along which the tool's axis has a component."""
        return {1 + k for k in range(3) if self.tool.axis[k]}

    def quaternions(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the quaternions (B, 4), relative to the reference, at parameters (B,) of segments (B,)."""
        own = quaternion_products(self.task.quaternions(segments, s), self.tool.quaternions(segments, s))
        return relative(own, self.reference)

    def _off(self, segments: NDArray[np.intp]) -> FloatArray:
        """Return error bounds (B,) of computed quaternions; the tool's one has its angle, its axis and a product."""
        start = np.abs(self.tool.angles[segments]) + np.abs(self.tool.angles[segments + 1])
        own, task = ROUNDED + 2 * PER_RADIAN * start, self.task
        if isinstance(task, ShortestTurns):
            return np.asarray(own + _BETWEEN * np.maximum(task.off[segments], task.off[segments + 1]))
        angles = np.abs(task.angles[segments]) + np.abs(task.angles[segments + 1])
        return np.asarray(own + task.rounded + 2 * PER_RADIAN * angles.sum(axis=1))

    def over(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges (B, 3) over pieces."""
        return chord_hull(self, segments, ends, self._off(segments), self._vary)

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angular velocities over pieces: those of the path, and the turn about the axis, which turns too."""
        low, high = self.task.derivatives(segments, ends)
        change = self.tool.angles[segments + 1] - self.tool.angles[segments]
        axes = matrices_from_quaternions(self.task.quaternions(segments, ends.mean(axis=1))) @ self.tool.axis
        middle = change[:, None] * axes
        turned_by = self.task.widths[segments] * (ends[:, 1] - ends[:, 0]) / 2
        off = 4 * self._off(segments)
        pairs = {unit ^ each ^ other for unit in self.units for each in self._tool_units for other in self.units}
        vary = np.array([float(unit in pairs) for unit in (1, 2, 3)])
        slack = (np.abs(change) * (turned_by + off))[:, None] * vary
        middle *= vary
        return low + middle - slack - _OUTWARDS * np.abs(low), high + middle + slack + _OUTWARDS * np.abs(high)
