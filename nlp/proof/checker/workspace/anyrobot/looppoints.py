"""Closed loops at points, by Newton's method: what it finds is computed, and proved elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ......models import FloatArray
from ......models.rows import independent_rows
from ...proof_file import ProofError
from ..positive import inverses
from .posedrobot import PosedRobot

#: Largest residual of a closed loop; equations are of order 1, and Newton's method ends at rounding.
_CLOSED = 1e-10
#: Largest residual of further equations of a loop: in another assembly it is of order 0.1.
_OTHER = 1e-6
#: Steps of Newton's method at most, and steps on a way from one closed point to another.
_STEPS, _WAY = 12, 8
#: Steps from home's assembly to closed loops at another pose.
_FROM_HOME = 40
#: Singular values below this part of the largest are zero.
_ZERO = 1e-9
#: Points about the start at which equations are looked at that follow from others, and their part of the workspace.
_POINTS, _SPREAD = 4, 0.5
_SEED = 1


class LoopPoints:
    """Loop equations of a robot as functions of its coordinates.

    Args:
        robot: the robot.
        equations: (k, 1) those that count.
    """

    def __init__(self, robot: PosedRobot, equations: SX) -> None:
        self._size, self._count = robot.size, int(equations.numel())
        outputs = [ca.densify(equations), ca.densify(ca.jacobian(equations, robot.z))]
        self._function = ca.Function("loops", [robot.z], outputs)

    def at(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return left sides (B, k) and their derivatives (B, k, n) at points (B, n), for coordinates of size 1."""
        count, n = z.shape
        g, J = (each.full() for each in self._function(z.T))
        slopes = J.reshape(self._count, count, n).transpose(1, 0, 2)
        return g.T, np.asarray(slopes * self._size)

    def closed(self, z: FloatArray, dependent: Sequence[int]) -> FloatArray:
        """Return closed points (B, n) near points, in which as many coordinates move as equations; NaN without one."""
        z, moving = z.copy(), list(dependent)
        with np.errstate(all="ignore"):
            for _ in range(_STEPS):
                g, J = self.at(z)
                if not np.nanmax(np.abs(g), initial=0.0) > 1e-3 * _CLOSED:
                    break
                z[:, moving] -= self._size[moving] * (inverses(J[:, :, moving]) @ g[:, :, None])[:, :, 0]
            residual = np.abs(self.at(z)[0]).max(axis=1, initial=0.0)
        z[~(residual <= _CLOSED)] = np.nan
        return z

    def moved(self, z: FloatArray, to: FloatArray, independent: Sequence[int], dependent: Sequence[int]) -> FloatArray:
        """Return the closed points (B, n) on the way from closed points to others' independent coordinates (B, f)."""
        z, own, moving = z.copy(), list(independent), list(dependent)
        way = to - z[:, own]
        with np.errstate(all="ignore"):
            for k in range(_WAY):
                J = self.at(z)[1]
                step = (way / _WAY) if k < _WAY - 1 else to - z[:, own]
                turned = inverses(J[:, :, moving]) @ J[:, :, own] @ (step / self._size[own])[:, :, None]
                z[:, moving] -= self._size[moving] * turned[:, :, 0]
                z[:, own] += step
                z = self.closed(z, dependent)
        z[:, own] = to
        return z

    def near(self, z: FloatArray, moving: Sequence[int]) -> FloatArray | None:
        """Return a closed point (n,) near a point in which some coordinates move; None where none is found."""
        z, own = z.copy(), list(moving)
        for _ in range(_STEPS):
            g, J = (each[0] for each in self.at(z[None]))
            if not (np.isfinite(g).all() and np.isfinite(J).all()):
                return None
            if float(np.abs(g).max(initial=0.0)) <= _CLOSED:
                return z
            z[own] -= self._size[own] * np.linalg.lstsq(J[:, own], g, rcond=_ZERO)[0]
        return None

    def from_home(self, z: FloatArray, moving: Sequence[int]) -> FloatArray | None:
        """Return closed loops on a way along which the residuals at a point fall to 0; None where it ends before."""
        z, own = z.copy(), list(moving)
        first = self.at(z[None])[0][0]
        if float(np.abs(first).max(initial=0.0)) <= _CLOSED:
            # Slopes of equations that hold by themselves are rounding, along which there is no step.
            return z
        for step in range(1, _FROM_HOME + 1):
            for _ in range(2):
                g, J = (each[0] for each in self.at(z[None]))
                left = g - first * (1 - step / _FROM_HOME)
                if not (np.isfinite(left).all() and np.isfinite(J).all()):
                    return None
                z[own] -= self._size[own] * np.linalg.lstsq(J[:, own], left, rcond=_ZERO)[0]
        return self.near(z, own)


def start_of(robot: PosedRobot) -> FloatArray:
    """Return closed loops (n,) in home's assembly, in the middle of the workspace or near it.

    Raises:
        ProofError: none are found.
    """
    points, count, n = LoopPoints(robot, robot.equations), len(robot.free), len(robot.centre)
    # Numbers of the pose move only where the unknowns alone do not close the loops.
    for moving in [range(count, n)] * (n > count) + [range(n)]:
        found = points.from_home(robot.centre, moving)
        if found is not None and is_home(robot, found):
            return found
    raise ProofError("no closed loops are found in the middle of the workspace, in the assembly of home")


def is_home(robot: PosedRobot, z: FloatArray) -> bool:
    """Return whether a closed point (n,) fulfils all loop equations, in home's working mode; not where it is NaN."""
    loops, signs = (each.full() for each in ca.Function("mode", [robot.z], [robot.loops, robot.signs])(z))
    return bool(np.isfinite(z).all() and (np.abs(loops) <= _OTHER).all() and (signs > 0).all())


def needed_equations(robot: PosedRobot, start: FloatArray) -> list[int]:
    """Return the equations that do not follow from others: by their rank at a few closed points."""
    if not robot.equations.numel():
        return []
    points, count = LoopPoints(robot, robot.equations), len(robot.free)
    rng = np.random.default_rng(_SEED)
    slopes = [points.at(start[None])[1][0]]
    for _ in range(_POINTS):
        z = start.copy()
        z[:count] += _SPREAD * robot.size[:count] * rng.uniform(-1, 1, count)
        found = points.near(z, range(count, len(z))) if len(z) > count else None
        found = points.near(z, range(len(z))) if found is None else found
        if found is not None:
            slopes.append(points.at(found[None])[1][0])
    if not any(np.abs(each).max() > _ZERO for each in slopes):
        return []
    return sorted(independent_rows(slopes))


def dependent_coordinates(points: LoopPoints, robot: PosedRobot, start: FloatArray, count: int) -> list[int]:
    """Return the coordinates that k equations determine: numbers of the pose where there are more, and all unknowns.

    Args:
        points: the equations that are needed.
        robot: the robot.
        start: (n,) closed loops.
        count: number k of equations.

    Raises:
        ProofError: the equations leave an unknown free, or are singular at the start.
    """
    poses, n = len(robot.free), len(start)
    unknowns = list(range(poses, n))
    if count < len(unknowns):
        raise ProofError("the loops leave a passive joint free")
    J = points.at(start[None])[1][0]
    basis = np.linalg.svd(J[:, unknowns])[0] if unknowns else np.eye(count)
    left = basis[:, len(unknowns) :].T @ J[:, :poses]
    order = sorted(independent_rows([left.T])) if count > len(unknowns) else []
    found = [*order, *unknowns]
    values = np.linalg.svd(J[:, found], compute_uv=False) if len(found) == count else np.zeros(1)
    if not values.min(initial=1.0) > _ZERO * values.max(initial=0.0):
        raise ProofError("the loops are singular in the middle of the workspace")
    return found
