"""Inverse kinematics of a robot at many poses: joint positions, Jacobian and actuator rates, as arrays.

Unknowns with a closed form are expressions of the pose. The others are followed along paths of the pose, for many poses
at once: from the home assembly mode, or from the previous pose. Newton's method closes the loops at each step from
extrapolated joints. A large correction may lead to another assembly mode, so such a path is repeated with shorter
steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, Substitution, axis_angle_from_matrix
from ...models.arrays import values_at
from ...models.instance import instantiate
from ...models.joints.model.closedform import closed_form, with_joints_at_home
from ...models.parts import Quantity
from ...models.rows import independent_rows
from ...models.statics import driven_joints, inverse_rates, rows_about
from ..case.case import Case
from ..case.pose import ROUNDING, rotations_from_rpy
from ..case.radians import WHOLE_TURN
from ..errors import InputError
from .assembly import home_position, unknowns_from_home
from .closed_loops import DEPENDENT, Loops
from .dependent import completed
from .state import CLOSED, ZERO_SINGULAR_VALUE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Number of poses in one block: the arrays of a block fit into the cache of a processor.
_BLOCK = 256
#: Components of a pose: the rotation column by column, then the position.
POSE = 12
#: Attempts along a path: number of steps, and largest correction of a scaled, extrapolated unknown in a step.
#: The last attempt has the step limit of :mod:`.assembly`, beyond which a step is a jump.
_WAYS = ((4, 0.2), (16, 0.1), (64, 0.05))
#: Attempts between consecutive poses, which begin with one step.
_NEXT = ((1, 0.05), *_WAYS)
#: Number of given poses at which the home assembly mode is sought, if it cannot be closed at the home pose.
_REFERENCES = 8
#: Part of the largest determinant of J'J above which the rank is provably 6: the smallest singular value is then at
#: least 1e-6 of the largest. Below it, singular values are computed.
_REGULAR = 1e-10
#: Quantities that are actuator coordinates.
_MEASURES = ("actuator_angle", "actuator_length")


@dataclass(frozen=True, eq=False)
class InversePoses:
    """Joint coordinates, Jacobian and rates of a robot at N poses; NaN at poses that are not closed. Angles in radians.

    Attributes:
        actuators: (a,) names of the actuators.
        held: labels of the driven joints that the pose does not determine; they stay at home, with rates of 0.
        measures: (a,) quantity of each coordinate: ``leg_length``, the distance between the joints of a leg, for robots
            given by rows of ``J``; otherwise ``actuator_angle`` or ``actuator_length``, measured from home.
        joints: (u,) names of the passive joint coordinates that are unknowns of the robot.
        coordinates: (N, a) actuator coordinates, radians or length.
        unknowns: (N, u) coordinates of the ``joints``, from home, radians or length.
        jacobian: (N, m, 6) ``J``: unit wrenches, force, then moment about the world origin, couples times the
            characteristic length. A limb whose wrenches follow from its joints has all rows of the projector onto these
            wrenches; results show a basis of these rows, with the same ``J'J``.
        rates: (N, a, 6) actuator rates for a unit of each component of the platform's motion: angular velocity, then
            velocity of its origin, in the world frame. They are valid for motions that the platform can make.
        closed: (N,) True if all loops close at the pose, in the followed assembly mode. Limits do not count.
        singular: (N,) True if J has a rank below 6 at a closed pose, or rates are not finite.
        positions: (N, 3) origins of the platform frame at the poses, length.
        rotations: (N, 3, 3) platform to world coordinates.
        dependent: names of the dependent coordinates whose values differ from the given values.
        resets: (N, a, d) changes of the actuator coordinates for a unit of each of d dimensions that change from pose
            to pose, at a fixed pose of the platform.
    """

    actuators: tuple[str, ...]
    held: tuple[str, ...]
    measures: tuple[str, ...]
    joints: tuple[str, ...]
    coordinates: FloatArray
    unknowns: FloatArray
    jacobian: FloatArray
    rates: FloatArray
    closed: NDArray[np.bool_]
    singular: NDArray[np.bool_]
    positions: FloatArray
    rotations: FloatArray
    dependent: tuple[str, ...] = ()
    resets: FloatArray | None = None


def inverse(
    case: Case,
    positions: ArrayLike,
    rotations: ArrayLike | None = None,
    *,
    rpy: ArrayLike | None = None,
    follow: Literal["home", "previous"] = "home",
    changing: Mapping[str, ArrayLike] | None = None,
) -> InversePoses:
    """Return joint coordinates, Jacobian and actuator rates at many poses.

    No pose raises an error: ``closed`` is False where the loops do not close, or the arrays are not a rotation and a
    finite position. A robot with fewer than six degrees of freedom cannot take every pose: there, dependent coordinates
    of the pose are computed from the others. Driven joints that the pose does not determine stay at home.

    Args:
        case: case with fixed dimensions; its poses, limits and tasks are not read.
        positions: (N, 3) origins of the platform frame in the world frame, length.
        rotations: (N, 3, 3) platform to world coordinates, orthogonal to 1e-6; the identity if left out.
        rpy: (N, 3) roll, pitch and yaw of each pose instead of ``rotations``, radians, about the world's axes x, y and
            z in this order, like the columns ``roll``, ``pitch`` and ``yaw`` of a CSV file.
        follow: assembly mode for loops without a closed form: ``"home"``, or ``"previous"`` to follow the joints
            from each closed pose to the next. With ``"previous"``, actuator angles have no jumps by a full turn.
        changing: values (N,) of dimensions that change from pose to pose, by their name in the robot. The pose must
            determine all joints in closed form.

    Raises:
        CaseError: a dimension of the case's robot is free, and does not change from pose to pose.
        InputError: an array has a wrong shape, rotations are stated in two forms, an angle is more than a whole turn,
            ``follow`` is not allowed, an actuator coordinate is not known, or dimensions of a robot change whose joints
            have no closed form.
    """
    if rotations is not None and rpy is not None:
        raise InputError("rpy: conflicts with rotations; give only one of them")
    p = np.array(positions, dtype=np.float64)
    shape = (*p.shape[:1], 3, 3)
    if rpy is not None:
        R = rotations_from_rpy(_rpy_rows(rpy, len(p) if p.ndim else 0))
    else:
        R = np.broadcast_to(np.eye(3), shape) if rotations is None else np.array(rotations, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or R.shape != shape:
        hint = "; rows of roll, pitch and yaw are the argument rpy" if R.shape == (*shape[:1], 3) else ""
        raise InputError(f"poses: expected arrays (N, 3) and (N, 3, 3), got {p.shape} and {R.shape}{hint}")
    if follow not in ("home", "previous"):
        raise InputError(f"follow = {follow!r}: must be 'home' or 'previous'")
    dimensions = {name: np.array(values, dtype=np.float64) for name, values in (changing or {}).items()}
    found = _inverse(case, p, R, follow, dimensions)
    if dimensions:
        return found
    # Joints that stay at home cannot determine other coordinates.
    held = replace(case, model=with_joints_at_home(case.model)) if case.model.free_joints else case
    near = None if found.closed.all() else completed(held, p, R, ~found.closed & _are_poses(R, p))
    if near is None or not near.dependent:
        return found
    return replace(_inverse(case, near.positions, near.rotations, follow, {}), dependent=near.dependent)


def _rpy_rows(rpy: ArrayLike, count: int) -> FloatArray:
    """Return rows (N, 3) of roll, pitch and yaw, radians.

    Args:
        rpy: (N, 3) roll, pitch and yaw, radians.
        count: number of poses.

    Raises:
        InputError: the array has a wrong shape, or an angle is more than a whole turn.
    """
    rows = np.array(rpy, dtype=np.float64)
    if rows.shape != (count, 3):
        raise InputError(f"rpy: must be an array (N, 3) of roll, pitch and yaw for N = {count} poses, got {rows.shape}")
    large = np.argwhere(np.abs(rows) > WHOLE_TURN)
    if len(large):
        k, column = large[0]
        angle = float(rows[k, column])
        words = f"{angle:.6g} rad = {math.degrees(angle):.1f} deg; angles are radians in Python"
        raise InputError(f"rpy[{k}][{column}] = {angle:.6g}: must be at most 2 pi in magnitude; {words}")
    return rows


def _inverse(case: Case, p: FloatArray, R: FloatArray, follow: str, changing: Mapping[str, FloatArray]) -> InversePoses:
    """Return the joints at positions (N, 3) with rotations (N, 3, 3), without changing dependent coordinates."""
    robot = functions_of(case, tuple(changing))
    poses = np.concatenate([R.transpose(0, 2, 1).reshape(-1, 9), p], axis=1)
    is_pose = _are_poses(R, p)
    moving = np.full((len(p), len(robot.size)), np.nan)
    if len(robot.size) and is_pose.any():
        moving[is_pose] = robot.followed(poses[is_pose], one_by_one=follow == "previous")
    moving = np.column_stack([moving, *changing.values()])
    blocks = [robot.at(poses[k : k + _BLOCK], moving[k : k + _BLOCK]) for k in range(0, max(len(p), 1), _BLOCK)]
    q, unknowns, J, rates, margin, residual, signs, modes, resets = (
        np.concatenate(each) for each in zip(*blocks, strict=True)
    )
    with np.errstate(invalid="ignore"):
        closed = is_pose & np.isfinite(q).all(axis=1) & np.isfinite(unknowns).all(axis=1)
        closed &= (np.abs(residual) <= CLOSED).all(axis=1) & (signs > 0).all(axis=1)
        closed &= (modes > 0).all(axis=1) | (follow == "previous")
        singular = closed & ~((margin[:, 0] > _REGULAR) & np.isfinite(rates).all(axis=(1, 2)))
    unsure = np.flatnonzero(singular & np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(J).all(axis=(1, 2)))
    singular[unsure] = _ranks(J[unsure], p[unsure]) < 6
    for each in (q, unknowns, J, rates, resets):
        each[~closed] = np.nan
    turning = robot.turning
    if follow == "previous" and turning:
        q[np.ix_(closed, turning)] = np.unwrap(q[np.ix_(closed, turning)], axis=0)
    arrays = q, unknowns, J, rates, closed, singular, p.copy(), R.copy()
    for each in (*arrays, resets):
        each.flags.writeable = False
    names = robot.actuators, case.model.free_joints, robot.measures, robot.joints
    return InversePoses(*names, *arrays, resets=resets)


class _Values(NamedTuple):
    """Values at B poses: fields of :class:`InversePoses`, and values that decide ``closed`` and ``singular``."""

    coordinates: FloatArray
    unknowns: FloatArray
    jacobian: FloatArray
    rates: FloatArray
    margin: FloatArray
    residual: FloatArray
    signs: FloatArray
    modes: FloatArray
    resets: FloatArray


@lru_cache(maxsize=4)
def functions_of(case: Case, changing: tuple[str, ...] = ()) -> RobotFunctions:
    """Return the functions of a case's robot; the last cases are cached, as a controller calls repeatedly."""
    return RobotFunctions(case, changing)


class RobotExpressions(NamedTuple):
    """Expressions of a robot with fixed dimensions; Python evaluates them here, and C in ``embedding``.

    Attributes:
        coordinates: (a, 1) actuator coordinates, radians or length.
        unknowns: (u, 1) coordinates of the passive joints that are unknowns of the robot.
        jacobian: (m, 6) Jacobian, as in :class:`InversePoses`.
        rates: (a, 6) actuator rates, as in :class:`InversePoses`.
        margin: (1, 1) relative determinant of ``J'J``.
        residual: (e, 1) left sides of all loop equations, scaled to magnitudes of about 1.
        signs: (s, 1) expressions that are positive in the home assembly mode.
        modes: (w, 1) expressions that are positive in the home working mode too.
        resets: (a, d) changes of the actuator coordinates, as in :class:`InversePoses`.
    """

    coordinates: SX
    unknowns: SX
    jacobian: SX
    rates: SX
    margin: SX
    residual: SX
    signs: SX
    modes: SX
    resets: SX


class RobotFunctions:
    """A robot with fixed dimensions, as functions of the pose and of the unknowns without a closed form.

    Args:
        case: case with fixed dimensions.
        changing: dimensions that are inputs of the functions: components of the robot's parameters.

    Attributes:
        actuators, measures, joints: names and quantities of :class:`InversePoses`.
        model: model of the robot, without the unknowns that have a closed form.
        robot: the robot at the pose ``z``.
        z: (12 + f + d, 1) symbols of the pose, rotation column by column, then position, of these unknowns, and of the
            dimensions that change.
        expressions: the results, as expressions of ``z``.
        turning: indices of the actuators that turn.
        moving: indices of the actuators that the pose determines.
        size: (f,) sizes of the unknowns without a closed form.
    """

    def __init__(self, case: Case, changing: tuple[str, ...] = ()) -> None:
        self._parameters = case.fixed_parameters("joint positions are computed with fixed dimensions", changing)
        model, drives = case.model, driven_joints(case.model)
        self.joints = tuple(each.name for each in model.unknowns)
        if self.joints:
            # As a quantity, eliminated unknowns keep their values as expressions.
            all_of_them = ca.vertcat(*[each.symbol for each in model.unknowns])
            listed = Quantity("every unknown", self.joints, all_of_them, Dimension.NUMBER, "of joints")
            model = replace(model, quantities=(*model.quantities, listed))
        at_home = with_joints_at_home(model)
        kept = tuple(each for each in at_home.actuators if each.joint not in model.undetermined)
        self.model = closed_form(replace(at_home, actuators=kept)).model
        own, pose = self.model.unknowns, SX.sym("pose", POSE)
        if own and changing:
            fault = f"joints of robot {model.name!r} have no closed form, so its dimensions cannot change with the pose"
            raise InputError(f"inverse kinematics: {fault}")
        unknowns, numbers = SX.sym("z", len(own)), [SX.sym(name) for name in changing]
        z = ca.vertcat(pose, unknowns, *numbers)
        position = pose[9:]
        self.z = z
        names = [name for item in model.parameters for name in item.components]
        dimensions = SX(ca.DM(self._parameters))
        for name, symbol in zip(changing, numbers, strict=True):
            dimensions[names.index(name)] = symbol
        given = Substitution(dimensions, unknowns, ca.reshape(pose[:9], 3, 3), position)
        robot = instantiate(self.model, given, SX(case.characteristic_length), [SX([0, 0, 1, 0, 0, 0])])
        values = {each.name: robot.quantities[k] for k, each in enumerate(self.model.quantities)}
        known = {
            owner: (each.name, values[each.name][k])
            for each in self.model.quantities
            if each.name in (_MEASURES if model.actuators else ("leg_length",))
            for k, owner in enumerate(each.owners)
        }
        self.actuators = tuple(each.name for each in drives)
        unknown = [name for name in self.actuators if name not in known]
        if unknown or not drives:
            fault = f"no formula for the coordinate of actuator {unknown[0]}" if unknown else "no actuators"
            raise InputError(f"inverse kinematics: robot {model.name!r} has {fault}")
        self.measures = tuple(known[name][0] for name in self.actuators)
        self.turning = [k for k, each in enumerate(drives) if each.dimension is Dimension.ANGLE]
        sizes = ca.Function("sizes", [model.symbols], [ca.vertcat(SX(0, 1), *[each.size for each in own])])
        self.size = np.asarray(sizes(self._parameters).full().ravel(), dtype=np.float64)
        every = ca.vertcat(robot.loops, robot.closure)
        size = np.concatenate([np.ones(POSE), self.size, np.ones(len(changing))])
        self._loops = Loops(z, robot.closure, every, robot.signs, size)
        is_mode = [each.is_mode for each in self.model.signs]
        rates = SX(len(drives), 6)
        moving = [each.name for each in driven_joints(self.model)]
        self.moving = [k for k, each in enumerate(drives) if each.name in moving]
        rates[self.moving, :] = inverse_rates(self.model, robot)
        self.robot = robot
        coordinates = ca.vertcat(*[known[name][1] for name in self.actuators])
        self.expressions = RobotExpressions(
            coordinates,
            values.get("every unknown", SX(0, 1)),
            robot.jacobian,
            rates,
            _margin(rows_about(robot.jacobian, position)),
            every,
            robot.signs[[k for k, mode in enumerate(is_mode) if not mode], :],
            robot.signs[[k for k, mode in enumerate(is_mode) if mode], :],
            ca.jacobian(coordinates, ca.vertcat(SX(0, 1), *numbers)),
        )
        # CasADi's columns are NumPy's rows.
        outputs = self.expressions._replace(jacobian=robot.jacobian.T, rates=rates.T, resets=self.expressions.resets.T)
        self._function = ca.Function("inverse", [z], [ca.densify(each) for each in outputs])
        # CasADi caches a mapped function while it is referenced: making it takes as long as evaluating it.
        self._mapped = self._function.map(_BLOCK)

    def at(self, poses: FloatArray, moving: FloatArray) -> _Values:
        """Return the values at poses (B, 12) with unknowns and dimensions (B, f + d)."""
        # CasADi's columns are NumPy's rows: the transposes are contiguous.
        found = [each.transpose(0, 2, 1) for each in values_at(self._function, np.hstack([poses, moving]))]
        return _Values(*(each if k in (2, 3, 8) else each[:, 0] for k, each in enumerate(found)))

    def followed(self, poses: FloatArray, *, one_by_one: bool) -> FloatArray:
        """Return the unknowns (N, f) without closed form at poses (N, 12); NaN where a path ends early.

        Args:
            poses: (N, 12) the poses.
            one_by_one: If true, follow the joints from each pose to the next.
        """
        found = np.full((len(poses), len(self.size)), np.nan)
        start = self.start(poses)
        if start is None:
            return found
        loops = self._loops.some(self._independent(start))
        if not one_by_one:
            for k in range(0, len(poses), _BLOCK):
                found[k : k + _BLOCK] = self._reached(loops, start, poses[k : k + _BLOCK], _WAYS)
            return found
        for k in range(len(poses)):
            found[k] = self._reached(loops, start, poses[k : k + 1], _NEXT)[0]
            start = np.concatenate([poses[k], found[k]]) if np.isfinite(found[k]).all() else start
        return found

    def start(self, poses: FloatArray) -> FloatArray | None:
        """Return a pose with its unknowns (12 + f,) in the home assembly mode: home, or one of the given poses."""
        at_home = np.concatenate([np.eye(3).ravel(), home_position(self.model, self._parameters)])
        chosen = poses[np.unique(np.linspace(0, len(poses) - 1, _REFERENCES).astype(int))]
        for pose in (at_home, *chosen):
            axis, angle = axis_angle_from_matrix(pose[:9].reshape(3, 3).T)
            unknowns = unknowns_from_home(self.model, self._parameters, np.concatenate([angle * axis, pose[9:]]))
            if unknowns is not None:
                return np.concatenate([pose, unknowns])
        return None

    def _independent(self, start: FloatArray) -> Sequence[int]:
        """Return the indices of independent loop equations, which determine the unknowns about a point (12 + f,)."""
        rng = np.random.default_rng(0)
        spread = 0.1 * self._loops.size
        spread[:POSE] = 0.0
        near = start + np.vstack([np.zeros(len(start)), spread * rng.uniform(-1, 1, (4, len(start)))])
        slopes = (self._loops.slopes(near.T) * self._loops.size)[:, :, POSE:]
        return independent_rows(list(slopes))

    def _reached(
        self, loops: Loops, start: FloatArray, poses: FloatArray, ways: Sequence[tuple[int, float]]
    ) -> FloatArray:
        """Return the unknowns (B, f) at poses (B, 12), followed from a closed point (12 + f,); NaN where that fails."""
        found = np.full((len(poses), len(self.size)), np.nan)
        left = np.arange(len(poses))
        for steps, largest in ways:
            at = start[POSE:] + np.zeros((len(left), 1))
            before = at
            for pose in _path(start[:POSE], poses[left], steps):
                kept = np.isfinite(at).all(axis=1)
                guess = 2 * at[kept] - before[kept]
                square = loops.count == len(self.size)
                z = loops.all_closed(
                    np.hstack([pose[kept], guess]).T,
                    range(POSE, POSE + len(self.size)),
                    zero=None if square else DEPENDENT,
                )[POSE:].T
                with np.errstate(invalid="ignore"):
                    z[~(np.abs(z - guess) <= largest * self.size).all(axis=1)] = np.nan
                before, at = at, np.full(at.shape, np.nan)
                at[kept] = z
            found[left] = at
            left = left[~np.isfinite(at).all(axis=1)]
            if not len(left):
                break
        return found


def _path(start: FloatArray, poses: FloatArray, steps: int) -> Iterator[FloatArray]:
    """Yield poses (B, 12) along straight paths from a pose (12,), each with a rotation about a fixed axis."""
    begin = start[:9].reshape(3, 3).T
    turns = [axis_angle_from_matrix(each.reshape(3, 3).T @ begin.T) for each in poses[:, :9]]
    angles = np.array([each.angle for each in turns])[:, None, None]
    cross = np.cross(np.eye(3), np.array([each.axis for each in turns]).reshape(-1, 1, 3))
    for k in range(1, steps):
        part = k / steps
        turn = np.eye(3) + np.sin(part * angles) * cross + (1 - np.cos(part * angles)) * (cross @ cross)
        rotations = (turn @ begin).transpose(0, 2, 1).reshape(-1, 9)
        yield np.hstack([rotations, start[9:] + part * (poses[:, 9:] - start[9:])])
    yield poses


def _are_poses(R: FloatArray, p: FloatArray) -> NDArray[np.bool_]:
    """Return whether positions (N, 3) are finite and matrices (N, 3, 3) are rotations."""
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z = R.transpose(1, 0, 2)
        off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        volume = sum(x[:, k] * (y[:, k - 2] * z[:, k - 1] - y[:, k - 1] * z[:, k - 2]) for k in range(3))
        return np.asarray(np.isfinite(p).all(axis=1) & (off <= ROUNDING) & (np.asarray(volume) > 0))


def _margin(rows: SX) -> SX:
    """Return a relative determinant (1, 1) of ``J'J``, which is small for nearly dependent rows (m, 6).

    Rows begin with moments, which are divided by the longest one. The determinant is divided by the largest possible
    one with the same squares.
    """
    arm = SX(0)
    for row in ca.vertsplit(rows):
        arm = ca.fmax(arm, ca.sumsqr(row[:3]))
    scaled = ca.horzcat(rows[:, :3] / ca.sqrt(arm), rows[:, 3:])
    products = scaled.T @ scaled
    pivots = ca.ldl(products)[0]
    volume = SX(1)
    for k in range(6):
        volume *= pivots[k] * 6 / ca.trace(products)
    return volume


def _ranks(J: FloatArray, p: FloatArray) -> NDArray[np.intp]:
    """Return the ranks (N,) of matrices (N, m, 6), moments about points (N, 3), by the rule of :mod:`.state`."""
    moments = J[:, :, 3:] - np.cross(p[:, None], J[:, :, :3])
    arms = np.linalg.norm(moments, axis=2).max(axis=1, initial=0.0)[:, None, None]
    values = np.linalg.svd(
        np.concatenate([J[:, :, :3], moments / np.where(arms > 0, arms, 1.0)], axis=2), compute_uv=False
    )
    return np.asarray(np.count_nonzero(values > ZERO_SINGULAR_VALUE * values[:, :1], axis=1))
