"""A case: a robot, what is fixed and what is free, and the motion its platform must make.

This is what a case file becomes, and what a program builds directly. Angles are radians here. A :class:`Case` checks
itself once, in the words of a case file, so everything behind it can rely on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension, Displacement, FloatArray, Model, Parameter, component_names, frozen_array, unit_vector
from ..errors import CaseError, nearest
from ..units import Units
from .limits.limit import LimitedCase
from .limits.limits import Limits
from .names import parameter_name, pose_prefixes
from .pose import HERE, LARGEST, MAX_FREE_ROTATION, Free, OverPoses, Pose, Rotation, Value
from .settings import Expectation, Published, Search
from .task import Method, Sense, Task

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Case:
    """A synthesis problem.

    Attributes:
        model: the robot.
        parameters: a value for each of the model's parameters: a number or :class:`Free`, or a sequence of three for a
            point or direction. Stored as tuples of components.
        position: origin of the platform frame in the world frame, length.
        rotation: orientation of the platform.
        tasks: the motions.
        units: units for people.
        characteristic_length: what one unit couple counts for beside unit forces, length; matters only for robots with
            constraint couples.
        limits: what a design must keep to be built.
        displacements: of the pose above, one for each pose that the robot takes.
        further: other poses, with their displacements. The robot's dimensions are the same at all of them.
        over_poses: what F is over several poses.
        joint_centre_tolerance: how far off a joint centre may be built, length; None leaves it out.
        search: how the solver searches.
        method: how several tasks are brought together; the average is equation 15.
        title, name: for people; the name is the file's.
        expect: what a regression holds the case to.
        published: what the literature prints.
        source: name of the file it was read from, for messages.

    Raises:
        CaseError: a value is missing, unknown, not finite, out of its range, or crossed; the key is in the words of a
            case file.
    """

    model: Model
    parameters: Mapping[str, Value | Sequence[Value]]
    position: Sequence[Value]
    tasks: Sequence[Task]
    rotation: Rotation = field(default_factory=Rotation)
    units: Units = field(default_factory=Units)
    characteristic_length: float = 1.0
    limits: Limits = field(default_factory=Limits)
    displacements: tuple[Displacement, ...] = (HERE,)
    further: Sequence[Pose] = ()
    over_poses: OverPoses = OverPoses.SUM
    joint_centre_tolerance: float | None = None
    search: Search = field(default_factory=Search)
    method: Method = Method.AVERAGE
    title: str = ""
    name: str = "case"
    expect: Expectation = field(default_factory=Expectation)
    published: tuple[Published, ...] = ()
    source: str | None = None

    def __post_init__(self) -> None:
        settle = object.__setattr__
        settle(self, "parameters", MappingProxyType(_parameters(self)))
        settle(self, "position", _position(self, self.position, "pose"))
        settle(self, "rotation", _rotation(self, self.rotation, "pose"))
        settle(self, "further", _further(self))
        settle(self, "tasks", _tasks(self))
        self.limits.check(self.as_limited)
        _check_tolerance(self)
        if not 1 / LARGEST <= self.characteristic_length <= LARGEST:
            raise CaseError("robot.characteristic_length", "must be positive and finite", self.characteristic_length)

    def components(self, name: str) -> tuple[Value, ...]:
        """Values of a parameter, component by component."""
        values = self.parameters[name]
        return tuple(values) if isinstance(values, Sequence) else (values,)

    def parameter_name(self, name: str) -> str:
        """Return the name of a parameter, or of one of its components, in this case; see :mod:`.names`.

        Args:
            name: the name that the robot gives it.
        """
        return parameter_name(name, len(self.poses))

    def component_names(self, parameter: Parameter) -> tuple[str, ...]:
        """Return the names of a parameter's components in this case."""
        return tuple(self.parameter_name(name) for name in parameter.components)

    @property
    def axis(self) -> FloatArray | None:
        """Held axis of rotation, (3,) unit, or None when it is free."""
        return None if self.rotation.axis is None else frozen_array(self.rotation.axis, (3,))

    @property
    def poses(self) -> tuple[Pose, ...]:
        """The poses as they are stated, each with its displacements."""
        return (Pose(self.position, self.rotation, self.displacements), *self.further)

    @property
    def pose_count(self) -> int:
        """How many poses the robot takes."""
        return sum(len(pose.displacements) for pose in self.poses)

    @property
    def pose_prefixes(self) -> tuple[str, ...]:
        """Prefix of the names of each stated pose's numbers; an empty one for a single pose."""
        return pose_prefixes(len(self.poses))

    @property
    def scalars(self) -> Mapping[str, Dimension]:
        """Names of the case's own numbers, which ``limits.custom`` may relate, with what they measure.

        In this order: components of the parameters; then position and, where its axis is held, angle of each pose.
        """
        names = {part: item.dimension for item in self.model.parameters for part in self.component_names(item)}
        for prefix, pose in zip(self.pose_prefixes, self.poses, strict=True):
            names |= dict.fromkeys((f"{prefix}{part}" for part in component_names("p", 3)), Dimension.LENGTH)
            if pose.rotation.axis is not None:
                names[f"{prefix}angle"] = Dimension.ANGLE
        return names

    @property
    def as_limited(self) -> LimitedCase:
        """The case as far as its limits read it."""
        return LimitedCase(self.model, self.units, self.scalars)


def _parameters(case: Case) -> dict[str, tuple[Value, ...]]:
    known = {parameter.name: parameter for parameter in case.model.parameters}
    for name in case.parameters:
        if name not in known:
            raise CaseError(f"robot.parameters.{name}", f"no such parameter; {nearest(name, known)}")
    settled: dict[str, tuple[Value, ...]] = {}
    for name, parameter in known.items():
        key = f"robot.parameters.{name}"
        if name not in case.parameters:
            raise CaseError(key, f"is missing: {parameter.description}, {_expected(parameter)}")
        given = case.parameters[name]
        values = tuple(given) if isinstance(given, Sequence) else (given,)
        if len(values) != len(parameter.typical):
            raise CaseError(key, f"must be {_expected(parameter)}")
        if parameter.is_direction and not any(isinstance(value, Free) for value in values):
            settled[name] = tuple(float(part) for part in _unit(values, key))
            continue
        settled[name] = tuple(
            _checked(
                value,
                key if len(values) == 1 else f"{key}[{index}]",
                parameter.dimension,
                case.units,
                (parameter.lower, parameter.upper),
            )
            for index, value in enumerate(values)
        )
    return settled


def _expected(parameter: Parameter) -> str:
    one = "a number or { min, max }"
    return one if len(parameter.typical) == 1 else f"a list of {len(parameter.typical)}, each {one}"


def _position(case: Case, position: Sequence[Value], pose: str) -> tuple[Value, ...]:
    if len(position) != 3:
        raise CaseError(f"{pose}.position", "must be a list of 3, each a number or { min, max }")
    return tuple(
        _checked(value, f"{pose}.position[{index}]", Dimension.LENGTH, case.units)
        for index, value in enumerate(position)
    )


def _further(case: Case) -> tuple[Pose, ...]:
    keys = [f"pose[{k + 1}]" for k in range(len(case.further))]
    settled = [
        Pose(_position(case, pose.position, key), _rotation(case, pose.rotation, key), tuple(pose.displacements))
        for pose, key in zip(case.further, keys, strict=True)
    ]
    displacements = [case.displacements, *(pose.displacements for pose in settled)]
    for key, own in zip(["pose", *keys], displacements, strict=True):
        if not own:
            raise CaseError(key, "must have at least one pose")
    if sum(map(len, displacements)) > 1 and case.over_poses is OverPoses.WORST and len(case.tasks) > 1:
        raise CaseError("combine.over_poses", "must be 'sum' or 'mean' with several tasks", case.over_poses.value)
    return tuple(settled)


def _check_tolerance(case: Case) -> None:
    tolerance = case.joint_centre_tolerance
    if tolerance is not None and not (0 < tolerance <= LARGEST):
        raise CaseError("tolerance.joint_centre", "must be positive and finite", tolerance)
    if tolerance is not None and (not case.model.built or case.model.unknowns):
        raise CaseError("tolerance.joint_centre", f"means nothing for {case.model.name!r}, whose joints are not known")


def _rotation(case: Case, given: Rotation, pose: str) -> Rotation:
    key = f"{pose}.rotation.angle"
    if given.axis is None:
        limit, why = MAX_FREE_ROTATION, "with the axis free"
    else:
        limit, why = 2 * math.pi, "with the axis held"
    angle = _checked(given.angle, key, Dimension.ANGLE, case.units)
    ends = {f"{key}.min": angle.lower, f"{key}.max": angle.upper} if isinstance(angle, Free) else {key: angle}
    for place, end in ends.items():
        if abs(end) > limit:
            allowed = case.units.text(limit, Dimension.ANGLE)
            raise CaseError(place, f"must be at most {allowed} in size {why}", case.units.shown(end, Dimension.ANGLE))
    lopsided = isinstance(angle, Free) and angle.lower < 0 < angle.upper and not math.isclose(-angle.lower, angle.upper)
    if given.axis is None and isinstance(angle, Free) and lopsided:
        fault = "must be minus max, or both of one sign: with the axis free the sign of an angle means nothing"
        raise CaseError(f"{key}.min", fault, case.units.shown(angle.lower, Dimension.ANGLE))
    axis = None if given.axis is None else _unit(given.axis, f"{pose}.rotation.axis")
    return Rotation(axis, angle)


def _unit(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    vector: FloatArray = np.array(values, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise CaseError(key, "must be three finite numbers")
    if not vector.any():
        raise CaseError(key, "must not be zero: it gives no direction", vector.tolist())
    return unit_vector(vector)


def _tasks(case: Case) -> tuple[Task, ...]:
    if not case.tasks:
        raise CaseError("task", "is missing: a case needs at least one [[task]]")
    settled = []
    for index, task in enumerate(case.tasks):
        key = f"task[{index}]"
        twist = np.array(task.twist, dtype=np.float64)
        if twist.shape != (6,) or not np.isfinite(twist).all():
            raise CaseError(f"{key}.twist", "must be six finite numbers")
        size = float(np.abs(twist).max())
        if size == 0:
            raise CaseError(f"{key}.twist", "must not be zero: the platform would not move", twist.tolist())
        if not 1 / LARGEST <= size <= LARGEST:
            fault = f"has a largest component of {size:g}, which must be between {1 / LARGEST:g} and {LARGEST:g}"
            raise CaseError(f"{key}.twist", fault)
        if not (math.isfinite(task.weight) and task.weight > 0):
            raise CaseError(f"{key}.weight", "must be positive", task.weight)
        settled.append(Task(frozen_array(twist, (6,)), Sense(task.sense), task.name, float(task.weight)))
    names = [task.name for task in settled]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise CaseError(f"task[{index}].name", "is used by an earlier task", name)
    return tuple(settled)


def _checked(
    value: Value,
    key: str,
    dimension: Dimension,
    units: Units,
    domain: tuple[float, float] = (-math.inf, math.inf),
) -> Value:
    """The value, once it is finite, not crossed and inside the domain."""
    if not isinstance(value, Free):
        return _number(value, key, dimension, units, domain)
    lower = _number(value.lower, f"{key}.min", dimension, units, domain)
    upper = _number(value.upper, f"{key}.max", dimension, units, domain)
    if not lower < upper:
        raise CaseError(
            f"{key}.min",
            f"must be below max = {units.text(upper, dimension)}; a fixed value is a number alone",
            units.shown(lower, dimension),
        )
    start = None if value.start is None else _number(value.start, f"{key}.start", dimension, units, (lower, upper))
    return Free(lower, upper, start)


def _number(value: float, key: str, dimension: Dimension, units: Units, domain: tuple[float, float]) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise CaseError(key, "must be finite", number)
    if abs(number) > LARGEST:
        raise CaseError(key, f"must be at most {LARGEST:g} in size", number)
    lower, upper = domain
    # A bound written in degrees may differ from the same bound in radians by rounding.
    slack = 1e-12 * max(1.0, abs(number))
    if not lower - slack <= number <= upper + slack:
        ends = [units.text(end, dimension) for end in domain]
        allowed = (
            f"at least {ends[0]}"
            if math.isinf(upper)
            else f"at most {ends[1]}"
            if math.isinf(lower)
            else f"between {ends[0]} and {ends[1]}"
        )
        raise CaseError(key, f"must be {allowed}", units.shown(number, dimension))
    return min(max(number, lower), upper)
