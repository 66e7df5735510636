"""Kinematics of a robot with fixed dimensions as functions for C, in the conventions of a controller.

The expressions are those of :mod:`screwsynth.nlp.evidence.inverse`. In addition, Newton's method in C needs derivatives
with respect to a small rotation, a translation and the joint coordinates without closed form, and a set of independent
equations, which is chosen at closed configurations near home.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from ...models.arrays import values_at
from ...models.instance import length_of
from ...models.newton import Linear, newton
from ...models.rows import RANK_TOLERANCE, independent_rows
from ...models.statics import DrivenJoint, degrees_of_freedom, driven_joints, rows_about, statics_hindrance
from ...models.wrench import WrenchKind
from ..case.case import Case
from ..case.controller import Controller
from ..case.pose import Free
from ..case.workspace import TurnKind, Turns, Workspace
from ..errors import CaseError
from ..evidence.dependent import independent_coordinates
from ..evidence.inverse import POSE, RobotFunctions, functions_of

#: Largest value of a loop equation that holds at every pose: rounding.
_IDENTITY = 1e-9
#: Configurations at which equations are compared, and their largest distance from home, radians and parts of the size.
_SAMPLES, _NEAR = 12, 0.08
_SEED = 0
#: Largest residual of a closed configuration, and number of Newton steps to it.
_CLOSED, _STEPS = 1e-11, 20
#: Part of the best condition with which the coordinates of the case's workspace are taken.
_ENOUGH = 0.1


class Choice(NamedTuple):
    """Independent equations of Newton's method.

    Attributes:
        rows: indices of equations: first the actuators, then the loop equations. The indices -1 to -6 stand for the
            pose coordinates x, y, z, a (roll), b (pitch) and c (yaw).
        columns: indices of the components of a step: rotation, translation, joint coordinates.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Transform:
    """Conventions of a controller for one robot, as numbers.

    Attributes:
        scale: length unit of the controller, in the length unit of the case.
        degrees: angle unit of the controller, radians.
        turn: (3, 3) rotation from the controller's world frame to the world frame of the case.
        offset: (3,) origin of the controller's world frame, length of the case.
        zero: (a,) coordinates of the controller at which those of the case are 0, in the controller's units.
        slope: (a,) change of the controller's coordinate for a unit change of the case's coordinate.
    """

    scale: float
    degrees: float
    turn: FloatArray
    offset: FloatArray
    zero: FloatArray
    slope: FloatArray

    def poses(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Return poses (N, 12) of the controller, rotation row by row, then position, from poses of the case."""
        R = self.turn.T @ rotations @ self.turn
        return np.hstack([R.reshape(-1, 9), self.scale * (positions - self.offset) @ self.turn])

    def world_poses(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (N, 3) and rotations (N, 3, 3) of the case from poses (N, 12) of the controller."""
        R = self.turn @ poses[:, :9].reshape(-1, 3, 3) @ self.turn.T
        return poses[:, 9:] @ self.turn.T / self.scale + self.offset, R

    def coordinates(self, q: FloatArray) -> FloatArray:
        """Return actuator coordinates (N, a) of the controller from those of the case."""
        return self.zero + self.slope * q

    def rates(self, rates: FloatArray) -> FloatArray:
        """Return actuator rates (N, a, 6) of the controller from those of the case."""
        turned = np.concatenate([rates[:, :, :3] @ self.turn, rates[:, :, 3:] @ self.turn / self.scale], axis=2)
        return np.asarray(self.slope[:, None] * turned)


def transform_of(case: Case, drives: Sequence[DrivenJoint], controller: Controller) -> Transform:
    """Return the conventions of a controller for the actuators of a case's robot.

    Raises:
        CaseError: a unit of length has no known size.
    """
    scale = controller.scale(case.units)
    unit = math.radians(1.0) if controller.angle == "deg" else 1.0
    own = np.array([1 / unit if each.dimension is Dimension.ANGLE else scale for each in drives])
    zero = own * np.array([controller.zero_of(each.name) for each in drives])
    slope = own * np.array([controller.sign_of(each.name) for each in drives])
    a, b, c = controller.rpy
    return Transform(scale, unit, matrix_of_rpy(a, b, c), np.array(controller.origin), zero, slope)


def matrix_of_rpy(a: float, b: float, c: float) -> FloatArray:
    """Return the rotation matrix (3, 3) of roll, pitch and yaw, ``Rz(c) Ry(b) Rx(a)``; exact for right angles."""
    (ca_, sa), (cb, sb), (cc, sc) = (_cosine_and_sine(each) for each in (a, b, c))
    x = np.array([[1, 0, 0], [0, ca_, -sa], [0, sa, ca_]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x, dtype=np.float64)


def _cosine_and_sine(angle: float) -> tuple[float, float]:
    quarters = angle / (math.pi / 2)
    if abs(quarters - round(quarters)) < 1e-15 * max(1.0, abs(quarters)):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(angle), math.sin(angle)


class Kinematics:
    """Functions of a robot with fixed dimensions at a point ``z`` of a controller.

    A point is the rotation row by row, the position, and the joint coordinates without closed form. A step is a
    rotation vector, a translation, and changes of these joint coordinates.

    Args:
        case: case with fixed dimensions and the conventions of a controller.

    Attributes:
        controller: conventions of the controller.
        drives: the actuators.
        transform: the conventions as numbers.
        size: a length of the robot, in the controller's unit.
        sizes: (f,) sizes of the joint coordinates without closed form.
        start: point ``home`` in the conventions of the case, as ``z`` of the robot's functions.
        home: (12 + f,) closed point at home, or at the case's pose where home cannot be closed.
        forward: equations and coordinates of forward kinematics; None if the actuators do not determine the pose.
        complete: equations and coordinates that determine the dependent coordinates; None if all six coordinates are
            independent, or no such equations are known.
        loops: independent loop equations of the joint coordinates without closed form.

    Raises:
        CaseError: a dimension is free, or no configuration of the home assembly mode is known.
        InputError: an actuator coordinate is not known.
    """

    def __init__(self, case: Case) -> None:
        self.case, controller = case, case.controller
        robot = functions_of(case)
        self.robot: RobotFunctions = robot
        self.drives = driven_joints(case.model)
        self.transform = transform_of(case, self.drives, controller)
        self.controller = controller
        self.sizes = robot.size
        parameters = case.fixed_parameters("kinematics are computed with fixed dimensions")
        self.size = length_of(case.model, parameters.tolist()) * self.transform.scale
        self.unknowns = len(robot.size)
        self.step_sizes = np.concatenate([np.ones(3), np.full(3, self.size), self.sizes])
        self._express()
        # A robot given by its rows has no home of its own: the pose of the case is near its work.
        start = self.stated_poses()[0] if case.model.generic is None else robot.start(self.stated_poses())
        if start is None:
            fault = "no closed configuration in the home assembly mode is known at home or at the pose of the case"
            raise CaseError("pose", f"{fault}: state a pose that the robot can take", source=case.source)
        self.start = start
        pose = self.transform.poses(start[None, 9:12], start[:9].reshape(1, 3, 3).transpose(0, 2, 1))[0]
        self.home = np.concatenate([pose, start[POSE:]])
        self._choose()

    def stated_poses(self) -> FloatArray:
        """Return poses (N, 12) of the case, columns of the rotation first; at least one, in the middle of ranges."""
        found = []
        for pose in self.case.poses:
            middle = [0.5 * (v.lower + v.upper) if isinstance(v, Free) else v for v in pose.position]
            found.append([*np.eye(3).ravel(), *middle])
        return np.array(found, dtype=np.float64)

    def _express(self) -> None:
        """Compute the expressions of a point of the controller."""
        robot, f = self.robot, self.unknowns
        z = SX.sym("z", POSE + f)
        T, offset = ca.DM(self.transform.turn), ca.DM(self.transform.offset)
        rotation = ca.reshape(z[:9], 3, 3).T
        position = z[9:POSE]
        if not np.array_equal(self.transform.turn, np.eye(3)):
            rotation, position = T @ rotation @ T.T, T @ position
        if self.transform.scale != 1.0:
            position = position / self.transform.scale
        world = ca.vertcat(ca.vec(rotation), position + offset, z[POSE:])
        own = robot.expressions
        signs = ca.vertcat(own.signs, own.modes)
        outputs = [ca.densify(each) for each in (own.coordinates, own.rates, own.residual, signs)]
        q, rates, residual, self.signs = ca.Function("robot", [robot.z], outputs).call([world])
        self.z, self.world = z, world
        self.q = ca.DM(self.transform.zero) + ca.DM(self.transform.slope) * q
        turned = ca.horzcat(rates[:, :3] @ T, rates[:, 3:] @ T / self.transform.scale)
        self.rates = ca.diag(ca.DM(self.transform.slope)) @ turned
        self._every = residual
        self.held = self._couples()

    def _couples(self) -> SX:
        """Return the couples (h, 6 + f) of a robot given by rows of J, which do no work in a step.

        Such a robot has no loop equations for the coordinates of the pose that its constraints hold.
        """
        model = self.case.model
        rows = [k for k, row in enumerate(model.frame_rows) if row.kind is not WrenchKind.FORCE]
        if model.actuators or not rows:
            return SX(0, 6 + self.unknowns)
        own = (
            rows_about(self.robot.expressions.jacobian, self.robot.z[9:POSE])[rows, :3]
            / self.case.characteristic_length
        )
        (couples,) = ca.Function("couples", [self.robot.z], [ca.densify(own)]).call([self.world])
        return ca.horzcat(couples @ ca.DM(self.transform.turn), SX(len(rows), 3 + self.unknowns))

    def moved(self, z: FloatArray, step: FloatArray) -> FloatArray:
        """Return a point after a step; the parts of the step have the sizes of :attr:`step_sizes`."""
        step = step * self.step_sizes
        angle = float(np.linalg.norm(step[:3]))
        cross = np.cross(np.eye(3), step[:3] / angle if angle else step[:3])
        turn = np.eye(3) + np.sin(angle) * cross.T + (1 - np.cos(angle)) * (cross @ cross)
        return np.concatenate([(turn @ z[:9].reshape(3, 3)).ravel(), z[9:] + step[3:]])

    def by_step(self, expression: SX) -> SX:
        """Return the derivatives (k, 6 + f) of an expression (k, 1) with respect to the components of a step."""
        slopes = ca.jacobian(expression, self.z)
        R = ca.reshape(self.z[:9], 3, 3).T
        turns = ca.horzcat(*[ca.vec((ca.skew(SX.eye(3)[:, k]) @ R).T) for k in range(3)])
        return ca.horzcat(slopes[:, :9] @ turns, slopes[:, 9:])

    def _choose(self) -> None:
        """Choose the loop equations that do not hold at every point, and independent ones among all equations."""
        rng = np.random.default_rng(_SEED)
        steps = _NEAR * rng.uniform(-1, 1, (_SAMPLES, len(self.step_sizes)))
        points = np.array([self.moved(self.home, each) for each in steps])
        values = values_at(ca.Function("every", [self.z], [ca.densify(self._every)]), points)[0][:, :, 0]
        defined = np.isfinite(values).all(axis=1)
        values = values[defined]
        kept: list[int] = []
        for k in range(values.shape[1]):
            if np.abs(values[:, k]).max(initial=0.0) > _IDENTITY and not any(
                np.abs(values[:, k] - sign * values[:, j]).max() <= _IDENTITY for j in kept for sign in (1, -1)
            ):
                kept.append(k)
        equations = self._every[kept, :]
        closing = _Closing(self, equations)
        closed = [newton(closing, each, steps=_STEPS) for each in [self.home, *points[defined]]]
        closed = [each for each in closed if closing.error(each) <= _CLOSED]
        a = len(self.drives)
        every = ca.vertcat(self.by_step(ca.vertcat(self.q, equations)), self.held)
        slopes = values_at(ca.Function("slopes", [self.z], [ca.densify(every)]), np.array(closed))[0]
        slopes = slopes * self.step_sizes
        slopes[:, :a] /= self.motor_sizes[:, None]
        slopes = slopes[np.isfinite(slopes).all(axis=(1, 2))]
        count = len(kept)
        independent = independent_rows(list(slopes[:, a : a + count])) if kept else ()
        order = [*independent, *(k for k in range(count) if k not in independent)]
        self.equations, self.independent = equations[order, :], len(independent)
        held = slopes[:, a + count :]
        slopes = slopes[:, [*range(a), *(a + k for k in order)]]
        self.loops = Choice((), ())
        if self.unknowns:
            by_joints = slopes[:, a:, 6:]
            columns = independent_rows([each.T for each in by_joints])
            self.loops = Choice(independent_rows([each[:, columns] for each in by_joints]), columns)
        self.forward = self._forward(np.concatenate([slopes[:, : a + self.independent], held], axis=1))
        self.coordinates = self._independent_coordinates(slopes[:, a : a + self.independent])
        self.complete = self._complete(slopes[:, a : a + self.independent])
        self._move_home()
        function = ca.Function("home", [self.z], [self.q])
        self.home_coordinates = np.array(function(self.home), dtype=np.float64).ravel()

    def _move_home(self) -> None:
        """Move the home point to the configuration where all actuator coordinates of the case are 0, if that is near.

        If the dimensions differ from those of the robot file, the platform's pose at home differs too.
        """
        if self.forward is None or set(self.robot.measures) == {"leg_length"}:
            return
        own = (self.q - ca.DM(self.transform.zero)) / ca.DM(self.motor_sizes)
        closing = _Closing(self, ca.vertcat(own, self.equations))
        found = newton(closing, self.home, steps=2 * _STEPS, parts=(1.0, 0.5, 0.25, 0.125))
        signs = np.array(ca.Function("signs", [self.z], [self.signs])(found), dtype=np.float64)
        if closing.error(found) <= _CLOSED and (signs > 0).all():
            self.home = found
            p, R = self.transform.world_poses(found[None, :POSE])
            self.start = np.concatenate([R[0].T.ravel(), p[0], found[POSE:]])

    @cached_property
    def motor_sizes(self) -> FloatArray:
        """Typical sizes (a,) of actuator coordinates: a radian, or the robot's size."""
        turns = [each.dimension is Dimension.ANGLE for each in self.drives]
        return np.where(turns, 1 / self.transform.degrees, self.size)

    def _forward(self, slopes: FloatArray) -> Choice | None:
        """Return the equations of forward kinematics from derivatives (N, a + e, 6 + f) for scaled steps."""
        columns = self._columns(slopes)
        a = len(self.drives)
        loops = list(range(a, slopes.shape[1]))
        chosen = list(loops)
        for k in range(a):
            rows = [*chosen, k]
            if min(_rank(each[np.ix_(rows, columns)]) for each in slopes[:1]) == len(rows) or max(
                _rank(each[np.ix_(rows, columns)]) for each in slopes
            ) == len(rows):
                chosen.append(k)
        # Else a motion of the platform remains in which neither actuators nor loops move.
        determined = max(map(_rank, slopes)) == 6 + max(_rank(each[:, 6:]) for each in slopes)
        if len(chosen) != len(columns) or not determined:
            return None
        return Choice(tuple(sorted(chosen)), tuple(columns))

    def _columns(self, slopes: FloatArray) -> list[int]:
        """Return independent components of a step: those of the pose first, then joint coordinates."""
        chosen = list(range(6))
        for k in range(6, slopes.shape[2]):
            if max(_rank(each[:, [*chosen, k]]) for each in slopes) > max(_rank(each[:, chosen]) for each in slopes):
                chosen.append(k)
        return chosen

    @property
    def freedoms(self) -> int:
        """Number of degrees of freedom of the platform."""
        return degrees_of_freedom(self.case.model)

    def _independent_coordinates(self, slopes: FloatArray) -> tuple[int, ...]:
        """Return the indices of the independent coordinates x, y, z, a, b, c of the pose.

        Args:
            slopes: (N, e, 6 + f) derivatives of the independent loop equations with respect to scaled steps.
        """
        if not self.independent:
            return tuple(range(6))
        workspace = self.case.world_workspace if self.case.workspace is not None else None
        if workspace is None or workspace.turns.kind is TurnKind.ANY_AXIS:
            workspace = Workspace(self.start[9:12].tolist(), Turns(TurnKind.ROLL_PITCH_YAW, (0.0, 0.0, 0.0)))
        stated = tuple(independent_coordinates(self.case, workspace) or range(6))

        def worst(chosen: tuple[int, ...]) -> float:
            rows = _coordinate_rows(chosen, self.unknowns)
            values = (np.linalg.svd(np.vstack([each, rows]), compute_uv=False) for each in slopes)
            return min(float(each[-1] / each[0]) for each in values)

        # In a turned frame other coordinates may be the independent ones.
        every = {each: worst(each) for each in itertools.combinations(range(6), self.freedoms)}
        best = max(every, key=lambda each: every[each])
        return stated if every.get(stated, 0.0) >= _ENOUGH * every[best] else best

    def _complete(self, slopes: FloatArray) -> Choice | None:
        """Return the equations of the dependent coordinates from derivatives (N, e, 6 + f) of independent equations."""
        if len(self.coordinates) == 6 or not self.independent:
            return None
        a = len(self.drives)
        count, given = self.independent, [-1 - k for k in self.coordinates]
        rows = (*range(a, a + count), *given)
        at_home = _coordinate_rows(self.coordinates, self.unknowns)
        stacked = [np.vstack([each, at_home]) for each in slopes]
        columns = self._columns(np.array(stacked))
        if len(rows) != len(columns) or max(_rank(each[:, columns]) for each in stacked) < len(rows):
            return None
        return Choice(rows, tuple(columns))

    def point(self, pose: FloatArray, unknowns: FloatArray) -> FloatArray:
        """Return a point from a pose (12,) of the controller and the coordinates (u,) of all unknown joints."""
        places = [self.robot.joints.index(each.name) for each in self.robot.model.unknowns]
        return np.concatenate([pose, unknowns[places]])

    def feasible(self, z: FloatArray, step: FloatArray) -> FloatArray:
        """Return the motion (6,), scaled, that is possible at a closed point and nearest to the given motion."""
        slopes = np.array(self._slopes(z), dtype=np.float64) * self.step_sizes
        return np.asarray((step - np.linalg.pinv(slopes, rcond=RANK_TOLERANCE) @ (slopes @ step))[:6])

    def side(self, z: FloatArray) -> float:
        """Return the determinant of the equations of forward kinematics at a point, divided by the determinant at home.

        The result is 0 at a singularity, and NaN if the actuators do not determine the pose.
        """
        if self.forward is None:
            return math.nan
        now, home = (
            np.linalg.det((np.array(self._forward_slopes(each)) * self.step_sizes)[:, self.forward.columns])
            for each in (z, self.home)
        )
        return float(now / home) if home else math.nan

    @cached_property
    def _forward_slopes(self) -> ca.Function:
        chosen = self.equations[: self.independent, :]
        every = ca.vertcat(self.by_step(ca.vertcat(self.q, chosen)), self.held)
        rows = list(self.forward.rows) if self.forward is not None else []
        return ca.Function("slopes", [self.z], [ca.densify(every[rows, :])])

    @cached_property
    def _slopes(self) -> ca.Function:
        outputs = ca.vertcat(self.by_step(self.equations), self.held)
        return ca.Function("slopes", [self.z], [ca.densify(outputs)])

    @cached_property
    def no_torques(self) -> str:
        """Reason why loads do not determine the actuator forces, as a clause; empty if they do."""
        hindrance = statics_hindrance(self.case.model)
        return hindrance or ("" if self.forward else "actuators and loops do not determine the pose")


def _coordinate_rows(coordinates: Sequence[int], unknowns: int) -> FloatArray:
    """Return derivatives (k, 6 + f) of coordinates x, y, z, a, b, c for a step from a pose without rotation."""
    found = np.zeros((len(coordinates), 6 + unknowns))
    for row, k in zip(found, coordinates, strict=True):
        row[k + 3 if k < 3 else k - 3] = 1.0
    return found


def _rank(matrix: FloatArray) -> int:
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.count_nonzero(values > RANK_TOLERANCE * values.max(initial=0.0)))


class _Closing:
    """Loop equations at a point of :class:`Kinematics`, for Newton's method."""

    def __init__(self, of: Kinematics, equations: SX) -> None:
        self._of = of
        outputs = [ca.densify(equations), ca.densify(of.by_step(equations))]
        self._function = ca.Function("closing", [of.z], outputs)

    def error(self, at: FloatArray) -> float:
        """Return the largest left side at a point; infinite if it is not defined."""
        values = np.array(self._function(at)[0], dtype=np.float64)
        return float(np.abs(values).max(initial=0.0)) if np.isfinite(values).all() else math.inf

    def linear(self, at: FloatArray) -> Linear | None:
        """Return the equations to first order; None if they hold or are not defined."""
        values, slopes = (np.array(each, dtype=np.float64) for each in self._function(at))
        if not _CLOSED < np.abs(values).max(initial=0.0) < math.inf or not np.isfinite(slopes).all():
            return None
        return Linear(values.ravel(), slopes * self._of.step_sizes)

    def moved(self, at: FloatArray, step: FloatArray) -> FloatArray | None:
        """Return the point after a step; None if the residual grows or is not defined."""
        found = self._of.moved(at, step)
        return found if self.error(found) < self.error(at) else None
