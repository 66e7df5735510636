"""Actuator speeds along a tool path with times.

The rates w of the pose (rates of its coordinates, or its angular velocity), and of dimensions that change along the
path, are coordinates of the search; each piece of the path determines their ranges. X has the pose and these
dimensions. With the loop equations ``L(X, u) = 0`` for the passive joints u without a closed form, and
``X' = X'(X, w)``,

    L_u u' = -L_X X',        q' = q_X X' + q_u u'

for the actuator coordinates q. Forms of the four matrices give forms of the speeds over each box.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.arrays import values_at
from ....case.workspace import TurnKind
from ....evidence.closed_loops import Loops, inverses
from ...enclosure.forms import Forms
from ..robot.path_cover import PathCover
from ..robot.posed_robot import Problem
from .bound_search import Bounds, Number
from .quadratic_forms import Quadratics, solved


def with_rates(problem: Problem, cover: PathCover) -> Problem:
    """Return the robot along a path, with rates of the pose as additional coordinates."""
    return _with(problem, cover, ca.vertcat(SX(0, 1), *[SX.sym(f"rate{k}") for k in problem.rated]))


def _with(problem: Problem, cover: PathCover, rates: SX) -> Problem:
    """Return the robot with the given symbols of the rates as additional coordinates."""
    rated, n = problem.rated, len(problem.start) - len(problem.of_errors)
    ends = [each[:, rated] for each in cover.rates(cover.pieces)]
    largest = np.abs(np.concatenate(ends)).max(axis=0)
    first = [each[0, rated] for each in cover.rates(np.zeros((1, 3)))]
    (start, size), loops = (problem.start, problem.size), problem.loops
    z = ca.vertcat(problem.z[:n, :], rates, problem.z[n:, :])
    whole = np.concatenate([size[:n], np.where(largest > 0, largest, 1.0), size[n:]])
    own = tuple(range(n, n + len(rated)))
    # Errors must stay the last coordinates.
    return replace(
        problem,
        loops=Loops(z, loops.equations, loops.every, loops.signs, whole),
        independent=(*problem.independent, *own),
        start=np.concatenate([start[:n], 0.5 * first[0] + 0.5 * first[1], start[n:]]),
        design=None if problem.design is None else _with(problem.design, cover, rates),
        rates=own,
        resting=problem,
    )


class PathSpeeds(Number):
    """Negative absolute speeds of actuators in the motion of a path.

    Args:
        problem: the nominal robot, or all robots within the tolerance, with rates of the pose as coordinates.
        coordinates: (K, 1) actuator coordinates, as expressions of the problem's coordinates.
    """

    def __init__(self, problem: Problem, coordinates: SX) -> None:
        z, of_pose, D = problem.z, range(len(problem.free)), list(problem.dependent)
        L = problem.equations
        parts = [
            ca.jacobian(L, z)[:, D],
            ca.jtimes(L, z[list(of_pose), :], pose_rates(problem)),
            ca.jacobian(coordinates, z)[:, D],
            ca.jtimes(coordinates, z[list(of_pose), :], pose_rates(problem)),
        ]
        parts = [ca.densify(each) for each in parts]
        # Rounding of a speed that is exactly 0 would leave a relative gap open.
        self._still = np.array([not ca.depends_on(each, z) for each in ca.vertsplit(coordinates)], dtype=bool)
        self._shapes = [each.shape for each in parts]
        super().__init__(problem, ca.vertcat(SX(0, 1), *map(ca.vec, parts)), coordinates.numel())
        self._parts = ca.Function("parts", [z], parts)

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, K) at points (P, n) with closed loops."""
        with np.errstate(all="ignore"):
            L_u, L_t, q_u, q_t = values_at(self._parts, z)
            return -np.abs(q_t - q_u @ (inverses(L_u) @ L_t))[:, :, 0]

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        ends = np.cumsum([0, *(rows * columns for rows, columns in self._shapes)]).tolist()
        L_u, L_t, q_u, speeds = (
            Quadratics.of(forms.part(slice(begin, end)), count, len(self.problem.of_errors), shape)
            for begin, end, shape in zip(ends, ends[1:], self._shapes, strict=False)
        )
        with np.errstate(all="ignore"):
            if L_u.c.size:
                speeds = speeds.plus(q_u.matmul(solved(L_u, L_t).times(-1.0)))
            upper = np.maximum(speeds.upper(), speeds.times(-1.0).upper())[:, 0].T
            upper[:, self._still] = 0.0
            # Only the place along the path is bisected, so the shares of all coordinates count for it.
            shares = np.abs(speeds.a[:, 0, :count]).transpose(2, 0, 1) + speeds.r[:, 0].T[:, :, None] / max(count, 1)
        shares[:, :, [k for k, j in enumerate(self.problem.independent) if j in self.problem.rates]] = 0.0
        return Bounds(np.where(np.isfinite(upper), -upper, -np.inf), shares)


def pose_rates(problem: Problem) -> SX:
    """Return the rates (f, 1) of the free coordinates, with tangents of half angles for angles.

    Rates of dependent coordinates are 0 here: they follow from the loops.
    """
    box, y = problem.box, problem.box.symbols(problem.z)
    rates = SX(6 + len(box.settings), 1)
    rates[problem.rated] = problem.z[list(problem.rates), :]
    velocity, turn, w = rates[:3], y[3 : box.of_pose], rates[3:6]
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        turned = 0.5 * (1 + turn * turn) * w
    elif turn.numel() > 3:  # a quaternion of any norm, which may change along itself
        turned = 0.5 * ca.vertcat(-ca.dot(w, turn[1:]), turn[0] * w + ca.cross(w, turn[1:]))
    else:
        turned = 0.5 * (w + ca.cross(w, turn) + ca.dot(w, turn) * turn)
    return ca.vertcat(velocity, turned, rates[6:])[list(problem.free), :]
