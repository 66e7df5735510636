"""Ranks of a limb, and parallel or intersecting axes, at almost all dimensions: measured at random values.

A single limb needs no closed loop: its joint coordinates may have any values.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...rows import rank_of
from ..written.forms import RobotError, UndefinedError
from .chain import HomeRobot, Joint, home_of
from .motion import AxisKind, Motion

#: Number of random points at which ranks are measured; the largest rank counts.
SAMPLES = 6
#: Relative variation of the samples around a typical dimension; halved while a sample has no finite value.
_SPREAD = 0.2
_HALVINGS = 8
#: Relative length below which a column is zero, such as the velocity of a rod's end by its spin: rounding leaves 1e-16,
#: and the column of a prismatic joint is short if the robot is large.
_ZERO_COLUMN = 1e-12
#: Cross product of parallel axes, and distance of intersecting axes relative to the robot's size: rounding leaves less.
INCIDENT = 1e-9


def sampled_dimensions(robot: HomeRobot) -> FloatArray:
    """Return values (SAMPLES, d) of the dimensions around the typical ones, for which the robot at home is finite.

    Raises:
        UndefinedError: an expression of the robot has no finite value at the typical dimensions.
        RobotError: the home position has no finite value.
    """
    try:
        home_of(robot.words, dict(zip(robot.words.dimensions, robot.typical.tolist(), strict=False)))
    except UndefinedError as error:
        raise UndefinedError(error.place, f"{error.fault}, at the typical dimensions", error.values) from None
    joints = robot.joints
    parts = [
        ca.veccat(*[part for axis in joint.axes for part in (axis.axis, axis.point, axis.rod, axis.pitch)])
        for joint in joints
    ]
    for joint, own in zip(joints, parts, strict=True):
        if not np.isfinite(ca.Function("joint", [robot.symbols], [ca.densify(own)])(robot.typical).full()).all():
            raise RobotError(joint.place, "has no finite place or axis at the typical dimensions")
    function = ca.Function("home", [robot.symbols], [ca.densify(ca.veccat(robot.home, *parts))])
    if not np.isfinite(function(robot.typical).full()).all():
        raise RobotError("home", "has no finite value at the typical dimensions")
    rng = np.random.default_rng(0)
    scale = np.where(robot.typical == 0, float(np.abs(robot.typical).max(initial=0.0)) or 1.0, robot.typical)
    shares = rng.uniform(-1.0, 1.0, (SAMPLES, len(robot.typical)))
    rows = []
    for share in shares:
        spread = _SPREAD
        for _ in range(_HALVINGS):
            row = robot.typical + spread * share * scale
            if np.isfinite(function(row).full()).all():
                break
            spread /= 2
        else:
            row = robot.typical
        rows.append(row)
    return np.array(rows)


class PathFrame:
    """Common data of all chains of a robot: robot at home, platform displacement, and sampled dimensions.

    Args:
        robot: robot at home.
        samples: (s, d) values of the robot's dimensions around the typical ones.
        platform: displacement of the platform from home.
    """

    def __init__(self, robot: HomeRobot, samples: FloatArray, platform: Motion) -> None:
        self.robot, self.samples, self.platform, self.size = robot, samples, platform, robot.size

    def typical_value(self, expression: SX) -> FloatArray:
        """Return the typical value of an expression of the dimensions, as an array of its shape."""
        found = ca.Function("typical", [self.robot.symbols], [ca.densify(expression)])(self.robot.typical)
        return np.asarray(found.full(), dtype=np.float64)

    def value_at_home(self, expression: SX, unknowns: SX) -> float:
        """Return the value of a scalar expression at home, with typical dimensions and unknowns (u, 1) of 0."""
        place, symbols = self.platform, [self.robot.symbols, unknowns, self.platform.rotation, self.platform.image]
        function = ca.Function("home", symbols, [ca.densify(expression)])
        return float(function(self.robot.typical, 0, np.eye(3), self.typical_value(place.origin)))

    def sampled(self, expression: SX) -> FloatArray:
        """Return the values (s, k) of an expression (k, 1) of the dimensions at all samples."""
        function = ca.Function("sampled", [self.robot.symbols], [ca.densify(expression)])
        return np.array([function(each).full().ravel() for each in self.samples])

    def is_zero(self, expression: SX) -> bool:
        """Return True if a dimensionless expression (k, 1) of the dimensions is zero for all dimensions."""
        return bool(np.all(np.abs(self.sampled(expression)) < INCIDENT))

    def coincide(self, one: SX, other: SX) -> bool:
        """Return True if two points (3, 1) at home coincide for all dimensions."""
        return self.is_zero(ca.norm_2(one - other) / self.size)

    def are_parallel(self, one: SX, other: SX) -> bool:
        """Return True if two unit vectors (3, 1) at home are parallel for all dimensions."""
        return self.is_zero(ca.norm_2(ca.cross(one, other)))


def free_screws(joints: Sequence[Joint], values: SX) -> list[list[SX]]:
    """Return the current screws (6, 1) of each joint's axes, from the base on, for any joint coordinates.

    Args:
        joints: joints from base to platform.
        values: (n, 1) coordinate of each axis, in order.
    """
    at, k, found = Motion.none(), 0, []
    for joint in joints:
        own = []
        for axis in joint.axes:
            own.append(axis.screw(values[k], at))
            at = at.after(axis.motion(values[k]))
            k += 1
        found.append(own)
    return found


def _rank(columns: FloatArray) -> int:
    """Return the rank of the columns of a matrix, each scaled to unit length.

    Rounding changes a zero singular value by about 1e-15, so small ones count as zero. A limb that is close to a lower
    rank at several random points is taken to have that rank.
    """
    lengths = np.linalg.norm(columns, axis=0)
    nonzero = lengths > _ZERO_COLUMN * lengths.max(initial=0.0)
    return rank_of(np.linalg.svd(columns[:, nonzero] / lengths[nonzero], compute_uv=False))


def random_values(joints: Sequence[Joint], size: float, seed: int) -> FloatArray:
    """Return random joint coordinates: angles in radians, and lengths of the robot's size."""
    rng = np.random.default_rng(seed)
    axes = [axis for joint in joints for axis in joint.axes]
    unit = np.array([size if axis.kind is AxisKind.TRANSLATION else 1.0 for axis in axes])
    return np.asarray(unit * rng.uniform(-0.7, 0.7, len(axes)))


def generic_rank(frame: PathFrame, joints: Sequence[Joint], columns: SX, values: SX) -> int:
    """Return the largest rank of columns, made of a limb's screws, at random dimensions and joint coordinates.

    Args:
        frame: common data of all chains of the robot.
        joints: joints of the limb.
        columns: (k, n) expressions of the dimensions and of the joint coordinates.
        values: (v, 1) symbols of the joint coordinates.
    """
    if columns.shape[1] == 0:
        return 0
    function = ca.Function("columns", [frame.robot.symbols, values], [ca.densify(columns)])
    ranks = []
    for k, (sample, size) in enumerate(zip(frame.samples, frame.sampled(frame.size), strict=True)):
        reach = float(size[0])
        found = function(sample, random_values(joints, reach, k)).full()
        if found.shape[0] == 6:
            found[3:] /= reach
        ranks.append(_rank(found))
    return max(ranks)


def meeting_point(frame: PathFrame, lines: Sequence[tuple[SX, SX]]) -> SX | None:
    """Return the common point (3, 1) of lines for all dimensions; None if they do not intersect in one point.

    Args:
        frame: common data of all chains of the robot.
        lines: two or more lines, each a point (3, 1) and a unit direction (3, 1); the first two must not be parallel.
    """
    (p1, a1), (p2, a2), *_ = lines
    normal = ca.cross(a1, a2)
    met = p1 + a1 * (ca.dot(ca.cross(p2 - p1, a2), normal) / ca.sumsqr(normal))
    for candidate in (p1, p2, met):
        off = ca.vertcat(*[ca.cross(candidate - point, direction) for point, direction in lines]) / frame.size
        if frame.is_zero(off):
            return candidate
    return None
