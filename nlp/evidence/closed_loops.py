"""Closed loops at points: Newton's method for many poses at once, and the way from home's assembly."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ...models.arrays import FloatArray, values_at

#: Largest residual of a closed loop; equations are of order 1, and Newton's method ends at rounding.
_CLOSED = 1e-10
#: Steps of Newton's method.
_STEPS = 15
#: Steps from home's assembly, where the equations have residuals at another pose, to closed loops.
_WAY = 40
#: Singular values below this part of the largest are zero in a step of more coordinates than equations.
DEPENDENT = 1e-9


class Loops:
    """Loop equations as functions of coordinates.

    Args:
        z: (n, 1) symbols.
        equations: (k, 1) expressions that are 0 where the loops are closed.
        every: all equations, those that follow from others too.
        signs: (s, 1) expressions that are positive in home's assembly.
        size: (n,) by which coordinates are comparable: of the order of their ranges.
    """

    def __init__(self, z: SX, equations: SX, every: SX, signs: SX, size: FloatArray) -> None:
        self.z, self.equations, self.every, self.signs, self.size = z, equations, every, signs, size
        self.count = int(equations.numel())

    def some(self, which: Sequence[int]) -> Loops:
        """Return some of the equations."""
        chosen = ca.vertcat(SX(0, 1), *[self.equations[k] for k in which])
        return Loops(self.z, chosen, self.every, self.signs, self.size)

    @cached_property
    def _function(self) -> ca.Function:
        slopes = ca.jacobian(self.equations, self.z)
        return ca.Function("loops", [self.z], [ca.densify(self.equations), ca.densify(slopes)])

    @cached_property
    def _every(self) -> ca.Function:
        return ca.Function("every", [self.z], [ca.densify(self.every), ca.densify(self.signs)])

    def values(self, z: FloatArray) -> FloatArray:
        """Return the left sides (B, k) at points (n, B)."""
        return values_at(self._function, z.T)[0][:, :, 0]

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (B, k, n) at points (n, B)."""
        return values_at(self._function, z.T)[1]

    def is_closed(self, z: FloatArray) -> bool:
        """Return whether all equations hold at a point (n,), in home's assembly."""
        residual, signs = (each.full().ravel() for each in self._every(z))
        return bool((np.abs(residual) <= 1e3 * _CLOSED).all() and (signs > 0).all())

    def every_value(self, z: FloatArray) -> FloatArray:
        """Return the left sides (B, e) of all equations at points (n, B), of those left out too."""
        return np.asarray(values_at(self._every, z.T)[0][:, :, 0])

    @np.errstate(all="ignore")
    def all_closed(
        self, z: FloatArray, moving: Sequence[int], *, steps: int = 1, zero: float | None = None
    ) -> FloatArray:
        """Return closed points (n, B) at the ends of ways from points, along which left sides fall to 0.

        A point that does not close is NaN.

        Args:
            z: (n, B) the points.
            moving: coordinates that move; as many as equations without ``zero``.
            steps: of the way.
            zero: part of the largest singular value of the slopes below which others are zero.
        """
        z, moving = z.copy(), list(moving)
        if not z.size:
            return z
        first = self.values(z)
        off = np.maximum(np.abs(first).max(axis=1, initial=0.0) / steps, _CLOSED)
        for k in range(1, steps + 1):
            left = 1 - k / steps
            for _ in range(2 if left else _STEPS):
                values, slopes = values_at(self._function, z.T)
                residual = values - left * first[:, :, None]
                step = (inverses(slopes[:, :, moving] * self.size[moving], zero) @ residual)[:, :, 0]
                z[moving] -= (self.size[moving] * step).T
                if not np.nanmax(np.abs(step), initial=0.0) > _CLOSED:
                    break
            # Beyond a fold there are no left sides that fall: steps from there may end in any assembly.
            residual = np.abs(self.values(z) - left * first).max(axis=1, initial=0.0)
            z[:, ~(residual <= (off if left else _CLOSED))] = np.nan
        return z


def inverses(matrices: FloatArray, zero: float | None = None) -> FloatArray:
    """Return the inverses of matrices (B, k, k); NaN for singular ones.

    With ``zero`` they are pseudo-inverses (B, n, k) of matrices (B, k, n), whose singular values below this part of the
    largest are zero.
    """
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    if zero is None:
        good &= np.linalg.slogdet(np.where(good[:, None, None], matrices, np.eye(matrices.shape[1])))[0] != 0
    found: FloatArray = np.full(matrices.transpose(0, 2, 1).shape, np.nan)
    found[good] = np.linalg.inv(matrices[good]) if zero is None else np.linalg.pinv(matrices[good], rcond=zero)
    return found


def closed_from_home(loops: Loops, z: FloatArray, pose: int) -> FloatArray | None:
    """Return closed loops (n,) at a pose, or near it, in home's assembly; None where none are found.

    The unknowns are 0 at home. At another pose the equations have residuals there, which are taken back in steps.

    Args:
        loops: the equations.
        z: (n,) coordinates of the pose, then zeros.
        pose: number of the pose's coordinates. They move only where the unknowns alone do not close the loops.
    """
    if not loops.count:
        return z if loops.is_closed(z) else None
    for begin in (pose, 0):
        found = loops.all_closed(z[:, None], range(begin, len(z)), steps=_WAY, zero=DEPENDENT)[:, 0]
        if loops.is_closed(found):
            return found
    return None
