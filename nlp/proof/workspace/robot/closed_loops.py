"""Closed loops at points: Newton's method for many poses at once, and the way from home's assembly."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray

#: Largest residual of a closed loop; equations are of order 1, and Newton's method ends at rounding.
_CLOSED = 1e-10
#: Steps of Newton's method.
_STEPS = 15
#: Steps from home's assembly, where the equations have residuals at another pose, to closed loops.
_WAY = 40
#: Singular values below this part of the largest are zero in a step.
_DEPENDENT = 1e-9


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
        return Loops(
            self.z, ca.vertcat(SX(0, 1), *[self.equations[k] for k in which]), self.every, self.signs, self.size
        )

    @cached_property
    def _function(self) -> ca.Function:
        slopes = ca.jacobian(self.equations, self.z)
        return ca.Function("loops", [self.z], [ca.densify(self.equations), ca.densify(slopes)])

    @cached_property
    def _every(self) -> ca.Function:
        return ca.Function("every", [self.z], [ca.densify(self.every), ca.densify(self.signs)])

    def values(self, z: FloatArray) -> FloatArray:
        """Return the left sides (B, k) at points (n, B)."""
        return np.asarray(self._function(z)[0].full().reshape(self.count, z.shape[1]).T)

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (B, k, n) at points (n, B)."""
        n, count = z.shape
        if not self.count:
            return np.zeros((count, 0, n))
        found = self._function(z)[1].full()
        return np.asarray(found.reshape(self.count, count, n).transpose(1, 0, 2))

    def is_closed(self, z: FloatArray) -> bool:
        """Return whether all equations hold at a point (n,), in home's assembly."""
        residual, signs = (each.full().ravel() for each in self._every(z))
        return bool((np.abs(residual) <= 1e3 * _CLOSED).all() and (signs > 0).all())

    def closed(self, z: FloatArray, moving: list[int]) -> FloatArray | None:
        """Return a closed point (n,) near a point, from which some coordinates move; None where there is none."""
        for _ in range(_STEPS):
            if float(np.abs(self.values(z[:, None])).max(initial=0.0)) <= _CLOSED:
                return z
            moved = self.moved(z, moving, np.zeros(self.count))
            if moved is None:
                return None
            z = moved
        return None

    def moved(self, z: FloatArray, moving: list[int], left: FloatArray) -> FloatArray | None:
        """Return a point (n,) after a step toward left sides (k,) of the equations; None where there is no step."""
        residual = self.values(z[:, None])[0] - left
        slopes = (self.slopes(z[:, None])[0] * self.size)[:, moving]
        if not (np.isfinite(residual).all() and np.isfinite(slopes).all()):
            return None
        z = z.copy()
        z[moving] -= self.size[moving] * np.linalg.lstsq(slopes, residual, rcond=_DEPENDENT)[0]
        return z

    def all_closed(self, z: FloatArray, moving: list[int]) -> FloatArray:
        """Return closed points (n, B) near points, in which the same coordinates move, as many as equations.

        A point that does not close is NaN.
        """
        z = z.copy()
        if not z.size:
            return z
        with np.errstate(all="ignore"):
            for _ in range(_STEPS):
                residual, slopes = self.values(z), self.slopes(z)[:, :, moving] * self.size[moving]
                known = np.asarray(np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(residual).all(axis=1))
                known &= np.abs(np.linalg.det(np.where(known[:, None, None], slopes, np.eye(len(moving))))) > 0
                step = np.linalg.solve(
                    np.where(known[:, None, None], slopes, np.eye(len(moving))),
                    np.where(known[:, None], residual, np.nan)[:, :, None],
                )[:, :, 0]
                z[moving] -= (self.size[moving] * step).T
                if not np.nanmax(np.abs(step), initial=0.0) > _CLOSED:
                    break
            residual = np.abs(self.values(z)).max(axis=1, initial=0.0)
        z[:, ~(residual <= _CLOSED)] = np.nan
        return z


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
    unknowns, every, first = list(range(pose, len(z))), list(range(len(z))), loops.values(z[:, None])[0]
    off = max(np.abs(first).max(initial=0.0) / _WAY, _CLOSED)
    for moving in (unknowns, every):
        found: FloatArray | None = z
        for share in np.linspace(1, 0, _WAY + 1)[1:]:
            for _ in range(2):
                found = None if found is None else loops.moved(found, moving, share * first)
            # Beyond a fold there are no left sides that fall: steps from there may end in any assembly.
            if found is None or not np.abs(loops.values(found[:, None])[0] - share * first).max(initial=0.0) <= off:
                break
        else:
            found = None if found is None else loops.closed(found, moving)
            if found is not None and loops.is_closed(found):
                return found
    return None
