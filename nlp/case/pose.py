"""Poses of a case: fixed and free values, rotations, displacements. Angles are radians.

Conventions: a rotation matrix transforms platform coordinates into world coordinates; its columns are the platform
axes. A quaternion is ``(w, x, y, z)``, the scalar part first. Roll, pitch and yaw rotate about the fixed world axes x,
then y, then z: ``R = Rz(yaw) Ry(pitch) Rx(roll)``.
"""

from __future__ import annotations

import enum
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

import numpy as np

from ...models import Dimension, Displacement, FloatArray, axis_from_screw, screw_displacement
from ...models.rotation import AxisAngle, axis_angle_from_matrix
from ...models.values import dataclass
from ..errors import CaseError
from ..units import Units

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .toml import TomlValue

#: Largest error of a component of ``R' R``, and of the norm of a quaternion: above the rounding of values with seven
#: decimals, and far below a typing error.
ROUNDING = 1e-6
#: Largest angle of a rotation about a free axis. Its variables are the vector part of a quaternion, which is a smooth
#: function of the rotation only below half a turn.
MAX_FREE_ROTATION = math.radians(179)
#: Fault of a value that changes along the path without a rate.
MISSING_RATE = "is missing: a number that changes along the path needs its largest rate, or inf"
#: Largest magnitude of a number in a case, and inverse of the smallest twist: squares and fourth powers stay finite.
LARGEST = 1e30


@dataclass(frozen=True)
class Free:
    """Free variable: the solver chooses its value between two bounds.

    Attributes:
        lower: lower bound, finite.
        upper: upper bound, finite and above ``lower``.
        start: value at the first starting point; None for the middle.
        values: catalogue values, ascending from ``lower`` to ``upper``, of which the solver chooses one; empty for a
            continuous variable. Only dimensions of a robot can have them.
        rate: largest rate of change, per second, of a setting: a value that changes along the tool path of the case;
            infinite for no limit. None for a value that is the same along the path.
    """

    lower: float
    upper: float
    start: float | None = None
    values: tuple[float, ...] = ()
    rate: float | None = None

    @classmethod
    def among(cls, values: Iterable[float]) -> Free:
        """Return a variable with catalogue values.

        Args:
            values: allowed values, at least two.

        Raises:
            ValueError: there is no value.
        """
        listed = tuple(sorted(values))
        return cls(min(listed), max(listed), None, listed)

    @property
    def first(self) -> float:
        """Value at the first starting point."""
        return (self.lower + self.upper) / 2 if self.start is None else self.start


Value: TypeAlias = float | Free


@dataclass(frozen=True)
class PerTask:
    """Dimension that is reset for every task, such as a pin in one of several holes.

    Attributes:
        values: value for each task, in the order of the tasks; a single value stands for all tasks.
    """

    values: Sequence[Value]

    @property
    def whole(self) -> Value:
        """Smallest range that contains the values of all tasks; a number if all tasks have this number."""
        ends = [ends_of(value) for value in self.values]
        lower, upper = min(low for low, _ in ends), max(high for _, high in ends)
        first = self.values[0]
        if all(value == first for value in self.values):
            return first
        return Free(lower, upper) if lower < upper else lower

    @property
    def shared(self) -> Value | None:
        """Values that every task allows; None if there is none."""
        return shared_value(self.values)


@dataclass(frozen=True)
class PerPose:
    """Dimension that is reset for every pose of the workspace, such as the base radius of a hexapod on slides.

    Attributes:
        range: range of the setting, or its catalogue values.
        at: value in the middle of the workspace, for an affine setting; None if it is free within the range.
        slope: (3,) changes along x, y and z of the platform's position, for an affine setting; None if they are free.
    """

    range: Free
    at: Value | None = None
    slope: Sequence[Value] | None = None


def shared_value(values: Sequence[Value]) -> Value | None:
    """Return the values that several fixed or free values have in common; None without any."""
    first = values[0]
    if all(value == first for value in values):
        return first
    listed = [set(value.values) for value in values if isinstance(value, Free) and value.values]
    ends = [ends_of(value) for value in values]
    lower, upper = max(low for low, _ in ends), min(high for _, high in ends)
    if listed:
        common = sorted(each for each in set.intersection(*listed) if lower <= each <= upper)
        return None if not common else common[0] if len(common) == 1 else Free.among(common)
    return None if lower > upper else lower if lower == upper else Free(lower, upper)


class StatedRange(Protocol):
    """Table of a range in a case file, in the file's units; it may have a ``start``."""

    min: float
    max: float


@runtime_checkable
class StatedValues(Protocol):
    """Table of catalogue values in a case file, in the file's units."""

    values: list[float]


@runtime_checkable
class StatedTasks(Protocol):
    """Table of the values of each task in a case file, in the file's units."""

    tasks: list[Any]


def internal_dimension(
    written: Any,  # noqa: ANN401 - a table
    units: Units,
    dimension: Dimension,
) -> Value | PerTask | PerPose:
    """Return the value of a dimension in a case file in internal units, or its values for each task or pose."""
    if isinstance(written, StatedTasks):
        return PerTask(tuple(internal_value(each, units, dimension) for each in written.tasks))
    value = internal_value(written, units, dimension)
    if getattr(written, "per", None) == "pose" and isinstance(value, Free):
        at, slope = getattr(written, "at", None), getattr(written, "slope", None)
        along = _slope_dimension(dimension)
        return PerPose(
            value,
            None if at is None else internal_value(at, units, dimension),
            None if slope is None else tuple(internal_value(each, units, along) for each in slope),
        )
    return PerTask((value,)) if getattr(written, "per", None) == "task" else value


def _slope_dimension(dimension: Dimension) -> Dimension:
    """Return the dimension in which slopes of a setting are written: angles in the case's unit, per unit of length."""
    return Dimension.ANGLE if dimension is Dimension.ANGLE else Dimension.NUMBER


def written_dimension(value: Value | PerTask | PerPose, units: Units, dimension: Dimension) -> TomlValue:
    """Return the value of a dimension as TOML, the inverse of :func:`internal_dimension`."""
    if isinstance(value, PerPose):
        slope, along = value.slope, _slope_dimension(dimension)
        stated = written_value(value.range, units, dimension)
        policy = {
            "at": None if value.at is None else written_value(value.at, units, dimension),
            "slope": None if slope is None else [written_value(each, units, along) for each in slope],
        }
        return {**(stated if isinstance(stated, dict) else {}), "per": "pose", **policy}
    if not isinstance(value, PerTask):
        written = written_value(value, units, dimension)
        return {**written, "per": "path"} if isinstance(written, dict) and "rate" in written else written
    of_tasks = [written_value(each, units, dimension) for each in value.values]
    first = of_tasks[0]
    if isinstance(first, dict) and all(each == first for each in of_tasks):
        return {**first, "per": "task"}
    return {"tasks": of_tasks}


def internal_value(written: float | StatedRange | StatedValues, units: Units, dimension: Dimension) -> Value:
    """Return a fixed or free value of a case file in internal units: radians for an angle."""
    if isinstance(written, float | int):
        return units.to_internal(written, dimension)
    if isinstance(written, StatedValues):
        return Free.among(units.to_internal(value, dimension) for value in written.values)
    start = getattr(written, "start", None)  # a range of a workspace has no start
    return Free(
        units.to_internal(written.min, dimension),
        units.to_internal(written.max, dimension),
        None if start is None else units.to_internal(start, dimension),
        rate=None if (rate := getattr(written, "rate", None)) is None else units.to_internal(rate, dimension),
    )


def written_value(value: Value, units: Units, dimension: Dimension) -> TomlValue:
    """Return a fixed or free value as TOML in the case's unit, the inverse of :func:`internal_value`."""
    if not isinstance(value, Free):
        return units.written(value, dimension)
    if value.values:
        return {"values": [units.written(each, dimension) for each in value.values]}
    ends = {"min": value.lower, "max": value.upper, "start": value.start}
    ends |= {} if value.rate is None else {"rate": value.rate}
    return {key: None if end is None else units.written(end, dimension) for key, end in ends.items()}


def ends_of(value: Value) -> tuple[float, float]:
    """Return the bounds of a value; both are equal for a fixed value."""
    return (value.lower, value.upper) if isinstance(value, Free) else (float(value), float(value))


def sizes_of_turn(angle: Value) -> tuple[float, float]:
    """Return the smallest and the largest magnitude, radians, of a rotation about a free axis.

    The sign of an angle about a free axis has no meaning.

    Args:
        angle: fixed or free angle, radians.
    """
    lower, upper = ends_of(angle)
    sizes = sorted((abs(lower), abs(upper)))
    return (0.0 if lower <= 0 <= upper else sizes[0]), sizes[1]


class RotationForm(enum.Enum):
    """Forms of a rotation in a case and in the output; a matrix is shown as axis and angle."""

    AXIS_ANGLE = "axis and angle"
    RPY = "rpy"
    QUATERNION = "quaternion"


@dataclass(frozen=True, eq=False)
class Rotation:
    """Orientation of the platform, ``exp(angle [axis]x)`` in the world frame (equation 9).

    Attributes:
        axis: (3,) fixed axis of rotation, of any length but zero; None for a free axis.
        angle: angle of rotation, radians, fixed or free. About a free axis its sign has no meaning: ``Free(-0.5, 0.5)``
            allows every rotation by at most 0.5 about any axis. Its start is a rotation about z.
        form: form in which the rotation was stated, and in which it is shown.
    """

    axis: ArrayLike | None = (0.0, 0.0, 1.0)
    angle: Value = 0.0
    form: RotationForm = RotationForm.AXIS_ANGLE

    @classmethod
    def from_rpy(cls, roll: float, pitch: float, yaw: float) -> Rotation:
        """Return the fixed rotation ``Rz(yaw) Ry(pitch) Rx(roll)``.

        Args:
            roll: angle about the world x axis, radians.
            pitch: angle about the world y axis, radians.
            yaw: angle about the world z axis, radians.

        Raises:
            CaseError: an angle is not finite.
        """
        return cls(*rotation_from_rpy((roll, pitch, yaw), "rotation.rpy"), RotationForm.RPY)

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Rotation:
        """Return the fixed rotation of a matrix (3, 3) from platform to world coordinates.

        Raises:
            CaseError: the matrix is not orthogonal, or a reflection.
        """
        return cls(*rotation_from_matrix(matrix, "rotation.matrix"))

    @classmethod
    def from_quaternion(cls, quaternion: ArrayLike) -> Rotation:
        """Return the fixed rotation of a unit quaternion (4,) ``(w, x, y, z)``.

        Raises:
            CaseError: the quaternion is not of unit length.
        """
        return cls(*rotation_from_quaternion(quaternion, "rotation.quaternion"), RotationForm.QUATERNION)


#: No displacement.
NO_DISPLACEMENT = Displacement.by(np.eye(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class Pose:
    """Stated pose of the platform, with its displacements.

    Attributes:
        position: (3,) origin of the platform frame in the world frame, length; each coordinate fixed or free.
        rotation: orientation of the platform.
        displacements: displacements of this pose; each gives one pose of the robot.
    """

    position: Sequence[Value]
    rotation: Rotation = field(default_factory=Rotation)
    displacements: tuple[Displacement, ...] = (NO_DISPLACEMENT,)


class OverPoses(enum.Enum):
    """Combination of F over several poses."""

    SUM = "sum"
    MEAN = "mean"
    WORST = "worst"


def along_screw(twist: ArrayLike, amounts: Sequence[float]) -> tuple[Displacement, ...]:
    """Return displacements along the finite screw motion ``exp(t [chi])`` of a twist.

    Args:
        twist: (6,) twist ``chi`` of any magnitude but zero; only its axis and pitch matter.
        amounts: amount of each displacement: radians about the axis, or a length for a pure translation.
    """
    screw = axis_from_screw(twist)
    return tuple(screw_displacement(screw, amount) for amount in amounts)


def over_grid(offsets: Sequence[Sequence[float]]) -> tuple[Displacement, ...]:
    """Return the translations by all combinations of offsets along x, y and z.

    Args:
        offsets: offsets along each of the three axes, length.
    """
    return tuple(Displacement.by(np.eye(3), offset) for offset in itertools.product(*offsets))


def rotation_from_matrix(matrix: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle of the rotation that is nearest to a matrix with rounding errors.

    Args:
        matrix: (3, 3) matrix, orthogonal up to rounding.
        key: dotted key of the matrix, for messages.

    Raises:
        CaseError: the matrix is not three rows of three finite numbers, not orthogonal, or a reflection.
    """
    rows = _numbers(matrix, (3, 3), key, "three rows of three finite numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.max(np.abs(rows.T @ rows - np.eye(3))))
    if not error <= ROUNDING:
        fault = "must be orthogonal, with perpendicular unit vectors as columns"
        raise CaseError(key, f"{fault}; R' R differs from the identity by {error:.3g}")
    if np.linalg.det(rows) < 0:
        raise CaseError(key, "must be a rotation with determinant 1, got a reflection with determinant -1")
    # Nearest orthogonal matrix.
    left, _, right = np.linalg.svd(rows)
    return axis_angle_from_matrix(left @ right)


def rotation_from_quaternion(quaternion: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle, in [0, pi], of a unit quaternion.

    Args:
        quaternion: (4,) quaternion ``(w, x, y, z)``; its negative is the same rotation.
        key: dotted key of the quaternion, for messages.

    Raises:
        CaseError: the quaternion is not four finite numbers, or not of unit length.
    """
    parts = _numbers(quaternion, (4,), key, "four finite numbers: w, x, y, z")
    size = math.hypot(*parts.tolist())
    if not abs(size - 1) <= ROUNDING:
        raise CaseError(key, f"must be a unit quaternion (w, x, y, z), got one of norm {size:.7g}", parts.tolist())
    sign = -1.0 if parts[0] < 0 else 1.0
    sine = math.hypot(*parts[1:].tolist())
    if sine == 0:
        return AxisAngle(np.array([0.0, 0.0, 1.0]), 0.0)
    return AxisAngle(sign * parts[1:] / sine, 2 * math.atan2(sine, abs(float(parts[0]))))


def rotation_from_rpy(rpy: ArrayLike, key: str) -> AxisAngle:
    """Return axis and angle of the rotation by roll, pitch and yaw, about the world x, then y, then z axis.

    Args:
        rpy: (3,) angles, radians.
        key: dotted key of the angles, for messages.

    Raises:
        CaseError: the angles are not three finite numbers.
    """
    half = _numbers(rpy, (3,), key, "three finite numbers: roll, pitch, yaw") / 2
    (sr, sp, sy), (cr, cp, cy) = np.sin(half).tolist(), np.cos(half).tolist()
    # Product of three quaternions.
    return rotation_from_quaternion(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ),
        key,
    )


def rotations_from_rpy(rpy: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) ``Rz(yaw) Ry(pitch) Rx(roll)`` of N rows of roll, pitch and yaw, radians."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy).T, np.cos(rpy).T
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _numbers(values: ArrayLike, shape: tuple[int, ...], key: str, words: str) -> FloatArray:
    """Return finite numbers as an array of a given shape.

    Raises:
        CaseError: a number is not finite, or the shape is wrong.
    """
    try:
        numbers: FloatArray = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise CaseError(key, f"must be {words}") from None
    if numbers.shape != shape or not np.isfinite(numbers).all():
        raise CaseError(key, f"must be {words}")
    return numbers
