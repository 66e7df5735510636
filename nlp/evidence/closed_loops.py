"""Closing of loops at many poses at once by Newton's method, in the home assembly mode."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ...models.arrays import FloatArray, values_at

#: Largest residual of a closed loop; equations have magnitudes of about 1, and Newton's method ends at rounding.
_CLOSED = 1e-10
#: Steps of Newton's method.
_STEPS = 15
#: Steps from the joints at home, where the equations have residuals at another pose, to closed loops.
_WAY = 40
#: Singular values below this fraction of the largest are zero in a step of more coordinates than equations.
DEPENDENT = 1e-9


class Loops:
    """Loop equations as functions of coordinates.

    Args:
        z: (n, 1) symbols of the coordinates.
        equations: (k, 1) expressions that are 0 for closed loops.
        every: (e, 1) all equations, including equations that follow from ``equations``.
        signs: (s, 1) expressions that are positive in the home assembly mode.
        size: (n,) divisors that make coordinates comparable, such as their typical ranges.
    """

    def __init__(self, z: SX, equations: SX, every: SX, signs: SX, size: FloatArray) -> None:
        self.z, self.equations, self.every, self.signs, self.size = z, equations, every, signs, size
        self.count = int(equations.numel())

    def some(self, which: Sequence[int]) -> Loops:
        """Return the loops with the equations of the given indices only."""
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
        """Return whether all equations hold at a point (n,), in the home assembly mode."""
        residual, signs = (each.full().ravel() for each in self._every(z))
        return bool((np.abs(residual) <= 1e3 * _CLOSED).all() and (signs > 0).all())

    def every_value(self, z: FloatArray) -> FloatArray:
        """Return the left sides (B, e) of all equations at points (n, B), also of dependent equations."""
        return np.asarray(values_at(self._every, z.T)[0][:, :, 0])

    @np.errstate(all="ignore")
    def all_closed(
        self, z: FloatArray, moving: Sequence[int], *, steps: int = 1, zero: float | None = None
    ) -> FloatArray:
        """Return closed points (n, B): along a path from each given point, the residuals fall to 0.

        A point that cannot be closed is NaN.

        Args:
            z: (n, B) the given points.
            moving: coordinates that move; without ``zero``, as many as there are equations.
            steps: number of steps of the path.
            zero: relative size below which singular values of the slopes count as zero; None for regular slopes.
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
            # The left sides cannot fall further beyond a fold: steps from there may end in any assembly mode.
            residual = np.abs(self.values(z) - left * first).max(axis=1, initial=0.0)
            z[:, ~(residual <= (off if left else _CLOSED))] = np.nan
        return z


def inverses(matrices: FloatArray, zero: float | None = None) -> FloatArray:
    """Return the inverses of matrices (B, k, k); NaN for singular ones.

    With ``zero`` the result is pseudo-inverses (B, n, k) of matrices (B, k, n); singular values below this fraction of
    the largest count as zero.
    """
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    if zero is None:
        good &= np.linalg.slogdet(np.where(good[:, None, None], matrices, np.eye(matrices.shape[1])))[0] != 0
    found: FloatArray = np.full(matrices.transpose(0, 2, 1).shape, np.nan)
    found[good] = np.linalg.inv(matrices[good]) if zero is None else np.linalg.pinv(matrices[good], rcond=zero)
    return found


def closed_from_home(loops: Loops, z: FloatArray, pose: int) -> FloatArray | None:
    """Return closed loops (n,) at or near a pose, in the home assembly mode; None if the loops cannot be closed.

    The unknowns are 0 at home. At another pose the equations then have residuals, which are reduced to 0 in steps.

    Args:
        loops: the loop equations.
        z: (n,) coordinates of the pose, followed by zeros.
        pose: number of pose coordinates, which move only if the unknowns cannot close the loops.
    """
    if not loops.count:
        return z if loops.is_closed(z) else None
    for begin in (pose, 0):
        found = loops.all_closed(z[:, None], range(begin, len(z)), steps=_WAY, zero=DEPENDENT)[:, 0]
        if loops.is_closed(found):
            return found
    return None
