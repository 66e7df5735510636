"""Independent loop equations for the nonlinear program, and free actuator coordinates.

The equations of an overconstrained robot are dependent, and a robot with more actuators than degrees of freedom can
move joints while the platform stands still. Both are measured at random closed configurations: random dimensions, and a
pose near home from which Newton's method with least-norm steps closes all loops.
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

#: Number of closed configurations; the largest rank among them counts.
_POINTS = 5
#: Largest number of Newton steps to a closed configuration, and residual that ends the steps; equations are scaled to
#: values of about 1.
_STEPS = 40
_CLOSED = 1e-12
#: Largest random change of pose coordinates and unknowns, relative to the robot's size and in radians.
_CHANGES = (0.15, 0.05)
#: Joint rate in a self-motion of unit size, independent of earlier joints, below which it is 0: rounding leaves less.
_INDEPENDENT = 1e-6


class ClosedPoint(NamedTuple):
    """Closed configuration of a robot.

    Attributes:
        dimensions: (d,) values of the dimensions.
        unknowns: (u,) values of the unknowns.
        rotation: (3, 3) rotation of the platform.
        position: (3,) position of the platform's origin, length.
    """

    dimensions: FloatArray
    unknowns: FloatArray
    rotation: FloatArray
    position: FloatArray


class Loops(NamedTuple):
    """Closed configurations of a robot, with independent equations and free coordinates.

    Attributes:
        points: closed configurations.
        independent: indices of the independent loop equations.
        free: indices, among the unknowns, of the free actuator coordinates: as many independent ones as possible.
    """

    points: tuple[ClosedPoint, ...]
    independent: tuple[int, ...]
    free: tuple[int, ...]


def examine_loops(
    frame: PathFrame, equations: Sequence[Closure], unknowns: Sequence[Unknown], driven: Sequence[int]
) -> Loops:
    """Return closed configurations near home, with the independent loop equations and the free actuator coordinates.

    Args:
        frame: common data of all chains of the robot.
        equations: loop equations in dimensions, pose and unknowns.
        unknowns: unknowns with their symbols and scales.
        driven: indices of the unknowns that are actuator coordinates.

    Raises:
        RobotError: there is no closed configuration near home.
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
        raise RobotError("", "found no closed configuration near home: check that the mechanism is mobile")
    own_slopes = [each[:, 6 : 6 + len(unknowns)] for each in jacobians]
    return Loops(tuple(points), independent_rows(jacobians), _free(own_slopes, driven))


def _free(slopes: Sequence[FloatArray], driven: Sequence[int]) -> tuple[int, ...]:
    """Return the first independent actuator coordinates that the pose does not determine.

    Args:
        slopes: (c, u) derivatives of the loop equations with respect to the unknowns, at each closed configuration.
        driven: indices of the unknowns that are actuator coordinates.
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
    """Return an orthonormal basis (u, n) of the self-motions: rates of unknowns with the platform at rest."""
    _, values, right = np.linalg.svd(slopes)
    return np.asarray(right[rank_of(values) :].T)


def _is_independent(rows: FloatArray) -> bool:
    """Return True if the last row (n,) is independent of the rows before it."""
    *others, last = rows
    if others:
        basis = np.linalg.svd(np.array(others), full_matrices=False)[2]
        last = last - basis.T @ (basis @ last)
    return bool(np.linalg.norm(last) > _INDEPENDENT)


def _slopes(residual: SX, moving: SX, robot: HomeRobot) -> SX:
    """Return the Jacobian of loop equations with respect to pose, unknowns and dimensions, in scaled lengths."""
    own = ca.jacobian(residual, robot.symbols)
    scales = [robot.size if item.kind.value == "length" else SX(1) for item in robot.words.dimensions.values()]
    scaled = [own[:, k] * scale for k, scale in enumerate(scales)]
    return ca.horzcat(ca.jacobian(residual, moving), *scaled)


def _closed(function: ca.Function, z: FloatArray, sample: FloatArray) -> Point:
    """Return pose and unknowns (n,) after Newton's method, for given dimensions (d,)."""
    equations = VectorEquations(lambda at: [each.full() for each in function(at, sample)], _CLOSED)
    return newton(equations, equations.at(z), steps=_STEPS, zeros=[DEPENDENT])
