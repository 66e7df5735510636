"""Independent loop equations, which alone enter a program, and the driven joints whose positions they leave free.

Equations of an overconstrained robot depend on each other, and a robot with more actuators than degrees of freedom can
move some of its joints while the platform stands still. Both are measured at random closed configurations: random
dimensions, and a pose near home from which Newton's method with least-norm steps closes all loops.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...newton import Point, VectorEquations, newton
from ...parts import Closure, Unknown
from ...rotation import matrix_from_cayley
from ...rows import DEPENDENT, independent_rows, rank_of
from ..home.chain import HomeRobot
from ..home.generic import PathFrame
from ..written.forms import RobotError

#: Closed configurations that are tried; the largest rank among them counts.
_POINTS = 5
#: Newton steps to a closed configuration, and the residual that ends them: equations are of order 1.
_STEPS = 40
_CLOSED = 1e-12
#: Largest random change of the pose's coordinates and of the unknowns, in the robot's size and radians.
_CHANGES = (0.15, 0.05)
#: Part of a joint's rate, in a self-motion of unit size, that is independent of joints before: rounding leaves less.
_INDEPENDENT = 1e-6


class ClosedPoint(NamedTuple):
    """A closed configuration.

    Attributes:
        dimensions: (d,) values.
        unknowns: (u,) values.
        rotation: (3, 3) of the platform.
        position: (3,) of the platform's origin, length.
    """

    dimensions: FloatArray
    unknowns: FloatArray
    rotation: FloatArray
    position: FloatArray


class Loops(NamedTuple):
    """Closed configurations of a robot, and what its loop equations determine there.

    Attributes:
        points: the configurations.
        independent: indices of the independent loop equations.
        free: indices of driven unknowns that the pose leaves free, as many as are independent of each other.
    """

    points: tuple[ClosedPoint, ...]
    independent: tuple[int, ...]
    free: tuple[int, ...]


def examine_loops(
    frame: PathFrame, equations: Sequence[Closure], unknowns: Sequence[Unknown], driven: Sequence[int]
) -> Loops:
    """Return closed configurations near home, which of the loop equations are independent there, and what they leave.

    Args:
        frame: values that all paths of the robot share.
        equations: of dimensions, pose and unknowns.
        unknowns: their symbols, and the sizes by which they become numbers of order 1.
        driven: indices of the unknowns that are positions of driven joints.

    Raises:
        RobotError: no closed configuration was found near home.
    """
    robot, pose = frame.robot, frame.platform
    c, shift = SX.sym("c", 3), SX.sym("shift", 3)
    own, scaled = (ca.vertcat(SX(0, 1), *[item.symbol for item in unknowns]), SX.sym("scaled", len(unknowns)))
    sizes = ca.vertcat(SX(0, 1), *[item.size for item in unknowns])
    moving = ca.vertcat(c, shift, scaled)
    rotation, position = matrix_from_cayley(c), robot.home + robot.size * shift
    stacked = ca.vertcat(SX(0, 1), *[each.scaled for each in equations])
    (residual,) = ca.Function("closure", [robot.symbols, own, pose.rotation, pose.image], [stacked]).call(
        [robot.symbols, scaled * sizes, rotation, position]
    )
    slopes = _slopes(residual, moving, robot)
    function = ca.Function("loops", [moving, robot.symbols], [ca.densify(residual), ca.densify(slopes)])
    outputs = [rotation, ca.densify(position), ca.densify(scaled * sizes)]
    placed = ca.Function("placed", [moving, robot.symbols], outputs)
    points: list[ClosedPoint] = []
    jacobians: list[FloatArray] = []
    rng = np.random.default_rng(1)
    free = moving.numel()
    for change in _CHANGES:
        for sample in frame.samples:
            if len(points) >= _POINTS:
                break
            z = change * rng.uniform(-1.0, 1.0, free)
            found = _closed(function, z, sample)
            if found.error <= np.sqrt(_CLOSED):
                R, p, values = (each.full() for each in placed(found.z, sample))
                points.append(ClosedPoint(sample, values.ravel(), R, p.ravel()))
                jacobians.append(found.slopes)
    if not points:
        raise RobotError("", "its loops could not be closed at any configuration near home: is it movable?")
    own_slopes = [each[:, 6 : 6 + len(unknowns)] for each in jacobians]
    return Loops(tuple(points), independent_rows(jacobians), _free(own_slopes, driven))


def _free(slopes: Sequence[FloatArray], driven: Sequence[int]) -> tuple[int, ...]:
    """Return the driven unknowns that the pose leaves free, the first ones that are independent of each other.

    Args:
        slopes: (c, u) derivatives of the loop equations by the unknowns at each closed configuration.
        driven: indices of the driven unknowns.
    """
    motions = [_self_motions(each) for each in slopes]
    fewest = min(each.shape[1] for each in motions)
    usual = [each for each in motions if each.shape[1] == fewest]
    found: list[int] = []
    for k in driven:
        if len(found) < fewest and all(_is_independent(each[[*found, k]]) for each in usual):
            found.append(k)
    return tuple(found)


def _self_motions(slopes: FloatArray) -> FloatArray:
    """Return an orthonormal basis (u, n) of the rates of unknowns with which the platform stands still."""
    _, values, right = np.linalg.svd(slopes)
    return np.asarray(right[rank_of(values) :].T)


def _is_independent(rows: FloatArray) -> bool:
    """Return whether the last row (n,) is independent of those before it."""
    *others, last = rows
    if others:
        basis = np.linalg.svd(np.array(others), full_matrices=False)[2]
        last = last - basis.T @ (basis @ last)
    return bool(np.linalg.norm(last) > _INDEPENDENT)


def _slopes(residual: SX, moving: SX, robot: HomeRobot) -> SX:
    """Return the Jacobian by pose, unknowns and dimensions, lengths in parts of the robot's size."""
    own = ca.jacobian(residual, robot.symbols)
    scales = [robot.size if item.kind.value == "length" else SX(1) for item in robot.words.dimensions.values()]
    scaled = [own[:, k] * scale for k, scale in enumerate(scales)]
    return ca.horzcat(ca.jacobian(residual, moving), *scaled)


def _closed(function: ca.Function, z: FloatArray, sample: FloatArray) -> Point:
    """Return pose and unknowns (n,) at which Newton's method ends, for some dimensions (d,)."""
    equations = VectorEquations(lambda at: [each.full() for each in function(at, sample)], _CLOSED)
    return newton(equations, equations.at(z), steps=_STEPS, zeros=[DEPENDENT])
