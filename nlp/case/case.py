"""Case: a robot with fixed and free dimensions, the tasks of its platform, limits and settings.

A :class:`Case` is read from a case file or made in Python. Angles are radians. Its constructor checks every value, with
messages in the words of case files, so that all other modules can rely on valid cases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from ...models import Dimension, Displacement, FloatArray, Model, Parameter, component_names, frozen_array, unit_vector
from ...models.shown import Shown
from ...models.statics import driven_joints
from ...models.values import dataclass
from ...models.whole import Whole
from ..errors import CaseError, NoRobotError, listing, nearest
from ..units import Units
from .checks import (
    check_determined_joints,
    check_direction,
    check_real,
    check_reals,
    check_statics,
    check_value,
    check_vector,
)
from .controller import SAME, Controller
from .excursions import OutsideWorkspace, check_excursions, in_world, outside_workspace, refuse_free
from .existence import assembly_fault
from .limits.limit import Limit, LimitedCase
from .limits.limits import Limits
from .loads import NO_LOADING, Loading
from .names import name_of_task, parameter_name, pose_prefixes
from .pathfile import TURN, PathFile
from .pertask import check_poses, common_poses, common_value, task_value
from .pose import LARGEST, MAX_FREE_ROTATION, NO_DISPLACEMENT, Free, OverPoses, PerTask, Pose, Rotation, Value
from .radians import angles_of, check_radians, with_radians
from .schedule import check_settings
from .settings import Expectation, Published, Search
from .task import LEG_LENGTH, MEASURES, Method, Sense, Task
from .workspace import Workspace

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Station(NamedTuple):
    """Pose of the robot in a case.

    Attributes:
        task: index of the only task at this pose; None if every task takes it.
        pose: index of the stated pose.
        step: displacement from the stated pose.
    """

    task: int | None
    pose: int
    step: Displacement


@dataclass(frozen=True, eq=False)
class Case(Whole, Shown):
    """Synthesis problem: a robot, its dimensions and pose, tasks, limits, and settings of the search.

    Attributes:
        model: robot of the case.
        parameters: value of each parameter of the robot by name: a number, :class:`Free` or :class:`PerTask`, or a
            sequence of three for a point or direction; stored as tuples of components.
        position: (3,) origin of the platform frame in the world frame, length; each coordinate fixed or free.
        rotation: orientation of the platform.
        tasks: tasks of the platform, one or more.
        units: units of files, messages and results.
        characteristic_length: length by which unit couples are multiplied to make them comparable with unit forces; no
            effect on robots without constraint couples.
        limits: limits that a design must satisfy to be buildable.
        displacements: displacements of the first stated pose; each gives one pose of the robot.
        further: stated poses after the first one, with their displacements; the dimensions are the same at all poses.
        pose_per_task: If true, every task has its own pose: the stated poses belong to the tasks in turn, as many to
            each task. A single stated pose gives the ranges of all tasks.
        over_poses: combination of F over several poses.
        worst_everywhere: If true, the worst F over the workspace or path is optimised, not F at the stated poses only.
        over_path: combination of F over the points of the path, mean or worst, while values with a rate change along
            it; None if F is not optimised along the path.
        joint_centre_tolerance: largest manufacturing error of each joint centre, length; None for no tolerance.
        workspace: box of poses over which the robot is verified; None for no workspace.
        path: tool path along which the robot is verified; None for no path.
        loading: loads on the platform, and its largest speeds.
        controller: conventions of a controller, for generated kinematics.
        search: settings of the search.
        method: method that combines several tasks; the average is equation 15.
        title: title of the case, one line.
        name: name of the case, that of its file without suffix.
        expect: expected results, for regression tests.
        published: values printed in the literature.
        source: name of the case file, for messages; None for a case made in Python.

    Raises:
        CaseError: a value is missing, unknown, not finite, out of its range, or crossed; the message names its key in a
            case file.
    """

    model: Model
    parameters: Mapping[str, Value | PerTask | Sequence[Value | PerTask]]
    position: Sequence[Value]
    tasks: Sequence[Task]
    rotation: Rotation = field(default_factory=Rotation)
    units: Units = field(default_factory=Units)
    characteristic_length: float = 1.0
    limits: Limits = field(default_factory=Limits)
    displacements: tuple[Displacement, ...] = (NO_DISPLACEMENT,)
    further: Sequence[Pose] = ()
    pose_per_task: bool = False
    over_poses: OverPoses = OverPoses.SUM
    worst_everywhere: bool = False
    over_path: OverPoses | None = None
    joint_centre_tolerance: float | None = None
    workspace: Workspace | None = None
    path: PathFile | None = None
    loading: Loading = NO_LOADING
    controller: Controller = SAME
    search: Search = field(default_factory=Search)
    method: Method = Method.AVERAGE
    title: str = ""
    name: str = "case"
    expect: Expectation = field(default_factory=Expectation)
    published: tuple[Published, ...] = ()
    source: str | None = None

    def __post_init__(self) -> None:
        try:
            self._check()
            if self.source is None:
                check_radians(self._angles(), self.units)
        except CaseError as error:
            # Files state their unit of angles, so a slip between degrees and radians is likely in Python only.
            raise (error if self.source is not None else with_radians(error, self._angles())) from None

    def _angles(self) -> Iterator[tuple[str, float]]:
        """Yield the dotted key and the value of each angle, also before the case is checked."""
        rotations = [self.rotation, *(pose.rotation for pose in self.further)]
        return angles_of(self.model, self.parameters, rotations, self.limits, self.workspace)

    def _check(self) -> None:
        """Check every value, and store each in its canonical form.

        Raises:
            CaseError: a value is not allowed.
        """
        store = object.__setattr__
        store(self, "parameters", MappingProxyType(_check_parameters(self)))
        known = {} if self.dimensions_per_task else self.parameters
        if fault := assembly_fault(self.model, known, self.units):  # type: ignore[arg-type]
            raise NoRobotError("robot.parameters", fault, source=self.source)
        store(self, "position", _check_position(self, self.position, "pose"))
        store(self, "rotation", _check_rotation(self, self.rotation, "pose"))
        if self.pose_per_task and not self.further:
            store(self, "further", [Pose(self.position, self.rotation, self.displacements)] * (len(self.tasks) - 1))
        store(self, "further", _check_further_poses(self))
        store(self, "tasks", _check_tasks(self))
        _check_changes(self)
        check_settings(self)
        _check_choices(self)
        _check_worst_everywhere(self)
        _check_loading(self)
        self.controller.check(driven_joints(self.model), self.units)
        self.limits.check(self.as_limited)
        if self.limits_over:
            check_determined_joints(self.model, "limits.over", self.source)
        _check_tolerance(self)
        if self.workspace is not None:
            self.workspace.check(self.units)
            check_excursions(self.workspace, self.poses[0], self.pose_count, self.units)
        if self.path is not None:
            self.path.check(self.units)
        if not 1 / LARGEST <= check_real(self.characteristic_length, "robot.characteristic_length") <= LARGEST:
            raise CaseError("robot.characteristic_length", "must be positive and finite", self.characteristic_length)

    def __repr__(self) -> str:
        stated = [value for name in self.parameters for value in self._stated(name)]
        values = [each for value in stated for each in (value.values if isinstance(value, PerTask) else [value])]
        values += [value for pose in self.poses for value in (*pose.position, pose.rotation.angle)]
        free = sum(isinstance(value, Free) for value in values)
        parts = [_counted(free, "variable"), _counted(len(self.tasks), "task"), _counted(self.pose_count, "pose")]
        parts += [_counted(len(self.limits), "limit")] if self.limits else []
        return f"<Case {self.name!r}: robot {self.model.name!r}, {', '.join(parts)}>"

    def to_toml(self) -> str:
        """Return the text of a case file from which an equal case is read.

        Raises:
            CaseError: no case file can state the case, for example because its robot has no name.
        """
        from .. import case_text  # noqa: PLC0415 - files come after cases

        return case_text(self)

    def replace(self, settings: Mapping[str, float | ArrayLike] | None = None, /, **numbers: float | ArrayLike) -> Case:
        """Return the case with some values replaced by name, as the option ``--set`` does.

        Values are in the units of the case: ``case.replace(x2=7, x3=20)`` sets an angle to 20 degrees in a case with
        degrees. A free variable becomes fixed.

        Args:
            settings: new values by names with dots, such as ``{"limits.leg_length.max": 40, "p_z.min": 15}``; three
                numbers for an axis, point or direction.
            numbers: new values by names without dots.

        Raises:
            CaseError: the case has no value with a name, or a value is not allowed.
        """
        from .. import with_settings  # noqa: PLC0415 - files come after cases

        return with_settings(self, {**(settings or {}), **numbers})

    def components(self, name: str) -> tuple[Value, ...]:
        """Return the values of a parameter's components.

        Args:
            name: name of the parameter in the robot.
        """
        return tuple(value.whole if isinstance(value, PerTask) else value for value in self._stated(name))

    def _stated(self, name: str) -> tuple[Value | PerTask, ...]:
        """Return the components of a parameter as the case states them."""
        values = self.parameters[name]
        return tuple(values) if isinstance(values, Sequence) else (values,)

    @property
    def dimensions_per_task(self) -> Mapping[str, PerTask]:
        """Components of the robot's parameters that are set anew for every task, by their name in the robot."""
        return {
            name: value
            for item in self.model.parameters
            for name, value in zip(item.components, self._stated(item.name), strict=True)
            if isinstance(value, PerTask)
        }

    @property
    def changes(self) -> tuple[str, ...]:
        """Names of what changes from task to task: components of parameters, then ``pose``; empty if nothing does."""
        return (*map(self.parameter_name, self.dimensions_per_task), *(["pose"] if self.pose_per_task else []))

    @property
    def settings(self) -> Mapping[str, Free]:
        """Values that change along the path, by name: dimensions as in the case, then ``turn`` about the tool."""
        found = {
            name: value
            for item in self.model.parameters
            for name, value in zip(self.component_names(item), self.components(item.name), strict=True)
            if isinstance(value, Free) and value.rate is not None
        }
        turn = None if self.path is None or self.path.tool is None else self.path.tool.turn
        return {**found, TURN: turn} if isinstance(turn, Free) else found

    @property
    def changing_key(self) -> str:
        """Dotted key of the first dimension that changes from task to task, or else of the pose."""
        name = next(iter(self.dimensions_per_task), None)
        return "pose" if name is None else f"robot.parameters.{name}"

    def of_task(self, index: int) -> Case:
        """Return the case of one task: its dimensions, its poses, and no other task.

        Args:
            index: index of the task.
        """
        poses = self.poses
        if self.pose_per_task:
            count = len(poses) // len(self.tasks)
            poses = poses[count * index : count * (index + 1)]
        first, *further = poses
        return replace(
            self,
            parameters={name: [task_value(each, index) for each in self._stated(name)] for name in self.parameters},
            position=first.position,
            rotation=first.rotation,
            displacements=first.displacements,
            further=further,
            pose_per_task=False,
            tasks=(self.tasks[index],),
            expect=Expectation(),
            published=(),
        )

    def sharing(self, *names: str) -> Case:
        """Return the case with something that is the same for every task instead of changing from task to task.

        The shared value may take the values that every task allows.

        Args:
            names: names of ``changes``.

        Raises:
            CaseError: no value is allowed for every task.
        """
        own = self.dimensions_per_task
        parameters = {item.name: list(self._stated(item.name)) for item in self.model.parameters}
        for item in self.model.parameters:
            for k, key in enumerate(item.components):
                if key in own and self.parameter_name(key) in names:
                    parameters[item.name][k] = common_value(own[key].values, f"robot.parameters.{key}")
        first, *further = common_poses(self.poses, len(self.tasks)) if "pose" in names else self.poses
        return replace(
            self,
            parameters=parameters,
            position=first.position,
            rotation=first.rotation,
            displacements=first.displacements,
            further=further,
            pose_per_task=self.pose_per_task and "pose" not in names,
        )

    def fixed_parameters(self, reason: str) -> FloatArray:
        """Return the values (d,) of all components of the robot's parameters, in the robot's order.

        Args:
            reason: reason why the parameters must be fixed, as a clause for messages.

        Raises:
            CaseError: a parameter is free.
        """
        found: list[float] = []
        for item in self.model.parameters:
            values = [value for value in self.components(item.name) if not isinstance(value, Free)]
            if len(values) < len(item.typical):
                fault = f"is free, and {reason}: give it with --set, or a result with --of"
                raise CaseError(f"robot.parameters.{item.name}", fault, source=self.source)
            found += values
        return np.array(found, dtype=np.float64)

    @property
    def without_motion(self) -> tuple[Limit[Any], ...]:
        """Limits on speed and power without a motion in the case; only a path with times gives them a value."""
        return tuple(each for each in self.limits if each.needs_motion and self.loading.motion is None)

    def require_motion(self, without: str = "") -> None:
        """Refuse limits on speed and power in a case without a motion.

        Args:
            without: alternative source of the motion, as the end of the message.

        Raises:
            CaseError: there is such a limit.
        """
        for limit in self.without_motion:
            raise CaseError(
                f"limits.{limit.name}",
                f"needs [motion], the largest speeds of the platform{without}",
                source=self.source,
            )

    def parameter_name(self, name: str) -> str:
        """Return the name of a parameter or component in this case; see :mod:`.names`.

        Args:
            name: name of the parameter or component in the robot.
        """
        return parameter_name(name, len(self.poses))

    def component_names(self, parameter: Parameter) -> tuple[str, ...]:
        """Return the names of a parameter's components in this case."""
        return tuple(self.parameter_name(name) for name in parameter.components)

    @property
    def axis(self) -> FloatArray | None:
        """Fixed unit axis (3,) of the rotation; None for a free axis."""
        return None if self.rotation.axis is None else frozen_array(self.rotation.axis, (3,))

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Stated poses, each with its displacements."""
        return (Pose(self.position, self.rotation, self.displacements), *self.further)

    @property
    def pose_count(self) -> int:
        """Number of poses of the robot: one for each displacement of each stated pose.

        If only dimensions change from task to task, the robot takes every pose once for each task.
        """
        return len(self.stations)

    @property
    def poses_per_task(self) -> int:
        """Number of poses at which F of one task is taken."""
        return self.pose_count // (len(self.tasks) if self.changes else 1)

    @property
    def stations(self) -> tuple[Station, ...]:
        """Poses of the robot in order: the poses of the first task, then those of the second, and so on."""
        poses = [(k, step) for k, pose in enumerate(self.poses) for step in pose.displacements]
        if not self.changes:
            return tuple(Station(None, k, step) for k, step in poses)
        count = len(self.poses) // len(self.tasks)
        return tuple(
            Station(task, k, step)
            for task in range(len(self.tasks))
            for k, step in poses
            if not self.pose_per_task or k // count == task
        )

    @property
    def pose_prefixes(self) -> tuple[str, ...]:
        """Prefix of the coordinate names of each stated pose; empty for a single pose."""
        return pose_prefixes(len(self.poses))

    @property
    def scalars(self) -> Mapping[str, Dimension]:
        """Quantities of the case that ``limits.custom`` may use, by name, with the dimension of each.

        The order is: components of the parameters; then, for each pose, position and, if its axis is fixed, angle.
        """
        own, several = self.dimensions_per_task, range(len(self.tasks))
        names = {
            name: item.dimension
            for item in self.model.parameters
            for key, part in zip(item.components, self.component_names(item), strict=True)
            for name in ([name_of_task(part, k) for k in several] if key in own else [part])
        }
        for prefix, pose in zip(self.pose_prefixes, self.poses, strict=True):
            names |= dict.fromkeys((f"{prefix}{part}" for part in component_names("p", 3)), Dimension.LENGTH)
            if pose.rotation.axis is not None:
                names[f"{prefix}angle"] = Dimension.ANGLE
        return names

    @property
    def limits_over(self) -> Literal["", "workspace", "path"]:
        """Domain of the limits besides the stated poses: ``workspace`` or ``path``; empty for the stated poses only."""
        if self.workspace is not None and self.workspace.has_limits:
            return "workspace"
        return "path" if self.path is not None and self.path.has_limits else ""

    @property
    def limits_where(self) -> str:
        """Domain of the limits besides the stated poses, in words; empty for the stated poses only."""
        return {"": "", "workspace": "over the workspace", "path": "along the path"}[self.limits_over]

    @property
    def uses_forces(self) -> bool:
        """True if actuator forces under loads are limited or minimised."""
        return any(each.needs_loads for each in self.limits) or any(
            task.measure in MEASURES and MEASURES[task.measure][0] for task in self.tasks
        )

    @property
    def is_optimised_everywhere(self) -> bool:
        """True if the worst value over the workspace or path is optimised, not only the value at the stated poses."""
        return bool(self.limits_over) and (bool(self.tasks[0].measure) or self.worst_everywhere)

    @property
    def world_workspace(self) -> Workspace | None:
        """Workspace in world coordinates; None for a case without a workspace.

        Raises:
            CaseError: the workspace is stated about the pose, and the pose has a free coordinate.
        """
        if self.workspace is None:
            return None
        refuse_free(self.workspace, self.poses[0], self.source)
        return in_world(self.workspace, self.poses[0])

    @property
    def outside_workspace(self) -> OutsideWorkspace | None:
        """Reason why the workspace contains no stated pose; None if it contains one, or without a workspace."""
        if self.workspace is None:
            return None
        follows = self.model.generic is not None and self.model.generic.constraints > 0
        return outside_workspace(self.workspace, self.poses, self.units, by_ranges=follows)

    @property
    def stated_pose_notice(self) -> str:
        """Notice for commands that evaluate only the stated pose of a case with limits over a workspace or path."""
        taken = "the limits and F" if self.worst_everywhere else "the limits"
        return self.limits_where and f"{taken} are evaluated only at the stated pose, not {self.limits_where}"

    def at_stated_poses(self) -> Case:
        """Return the case with F and limits at the stated poses only."""
        workspace, path = self.workspace, self.path
        return replace(
            self,
            worst_everywhere=False,
            workspace=None if workspace is None else replace(workspace, has_limits=False),
            path=None if path is None else replace(path, has_limits=False),
        )

    @property
    def as_limited(self) -> LimitedCase:
        """Part of the case on which its limits depend."""
        scalars = self.of_task(0).scalars if self.changes else self.scalars
        return LimitedCase(self.model, self.units, scalars, self.loading)


def _check_changes(case: Case) -> None:
    """Refuse dimensions and poses that change from task to task where this has no meaning, or is not supported.

    Raises:
        CaseError: there is only one task, poses do not fit to tasks, or another table of the case conflicts.
    """
    if not case.changes:
        return
    key, tasks = case.changing_key, len(case.tasks)
    if tasks == 1:
        raise CaseError(f"{key}.per", "needs several tasks, but the case has one [[task]]; leave per out", "task")
    for table, stated in (("workspace", case.workspace), ("path", case.path)):
        if stated is not None:
            fault = (
                f"conflicts with {key}, which changes from task to task: the proof needs one robot; remove [{table}]"
            )
            raise CaseError(table, fault)
    if case.pose_per_task:
        check_poses(case.poses, tasks)
    if case.over_poses is OverPoses.WORST and case.poses_per_task > 1:
        raise CaseError("combine.over_poses", "must be 'sum' or 'mean' with several tasks", case.over_poses.value)
    for task in range(tasks):
        case.of_task(task)  # checks the dimensions and poses of this task


def _check_worst_everywhere(case: Case) -> None:
    """Refuse the worst F over a domain if the limits do not cover the domain, or with several tasks.

    Raises:
        CaseError: the objective is not allowed.
    """
    if not case.worst_everywhere:
        return
    key = "objective.over"
    if not case.limits_over:
        raise CaseError(key, "needs limits over the same poses: set over in [limits] to 'workspace' or 'path'")
    if len(case.tasks) > 1:
        raise CaseError(key, f"needs exactly one [[task]], got {len(case.tasks)}", case.limits_over)
    if case.pose_count > 1 and case.over_poses is not OverPoses.WORST:
        raise CaseError("combine.over_poses", "must be 'worst' together with objective.over", case.over_poses.value)


def _check_loading(case: Case) -> None:
    """Refuse invalid loads and motions, and robots whose actuator forces do not follow from the loads.

    Raises:
        CaseError: loads, motion, gravity or stiffness are not allowed.
    """
    case.loading.check(case.units)
    loading = case.loading
    parts = (("load", loading.loads), ("motion", loading.motion), ("robot.actuator_stiffness", loading.stiffness))
    stated = [key for key, given in parts if given]
    if stated:
        check_statics(case.model, stated[0])
        loading.check_work(case.model)
    if loading.stiffness is not None:
        loading.stiffness_of([joint.name for joint in driven_joints(case.model)])


def _check_choices(case: Case) -> None:
    """Refuse catalogue values of directions, and combinations of tasks that do not allow catalogue values.

    Raises:
        CaseError: a parameter or the combination is not allowed.
    """
    listed = [
        item
        for item in case.model.parameters
        if any(isinstance(value, Free) and value.values for value in case.components(item.name))
    ]
    for item in listed:
        key = f"robot.parameters.{item.name}"
        if item.is_direction:
            raise CaseError(key, "must be numbers or { min, max }: a direction cannot have { values }")
        if len(case.tasks) > 1 and case.method is Method.AVERAGE:
            fault = f"must be 'weighted-sum' or 'worst-case': {key} has catalogue values"
            is_shared = not case.dimensions_per_task.keys() & set(item.components)
            fault += ", and an average of catalogue values need not be a catalogue value" if is_shared else ""
            raise CaseError("combine.method", fault, case.method.value)
        if case.method is Method.WORST_CASE and len({task.sense for task in case.tasks}) > 1:
            fault = f"must be 'weighted-sum': {key} has catalogue values, and tasks have both senses"
            raise CaseError("combine.method", fault, case.method.value)


def _check_measure(case: Case, task: Task) -> None:
    """Refuse an objective of the actuators for which loads, motion or a suitable robot is missing.

    Raises:
        CaseError: the objective is not allowed.
    """
    if not task.measure:
        return
    key = "objective.minimise"
    if task.measure == LEG_LENGTH:
        if case.over_path is not OverPoses.WORST:
            raise CaseError(key, 'needs over = "path" and as = "worst"', task.measure)
        return
    if task.measure not in MEASURES:
        raise CaseError(key, f"must be one of {listing([*MEASURES, LEG_LENGTH])}", task.measure)
    if case.over_path is not None:
        raise CaseError(key, "must be 'leg_length' along a path, or left out for F", task.measure)
    if len(case.tasks) > 1:
        fault = "must be given at most once with objective.minimise, which does not optimise the F of tasks"
        raise CaseError("task", f"{fault}, got {len(case.tasks)}")
    if task.sense is not Sense.MIN:
        fault = 'objective.minimise needs no task: remove [[task]], or give it sense = "min"'
        raise CaseError("task[0].sense", fault, "max")
    needs_loads, needs_motion = MEASURES[task.measure]
    if needs_loads and not case.loading.loads:
        raise CaseError(key, "needs a table [[load]] with a load on the platform", task.measure)
    if needs_motion and case.loading.motion is None:
        raise CaseError(key, "needs the table [motion] with the largest speeds of the platform", task.measure)
    check_statics(case.model, key, task.measure)
    joints = driven_joints(case.model)
    if task.measure != "actuator_power" and len({joint.dimension for joint in joints}) > 1:
        fault = "compares all actuators, but the robot has revolute and prismatic ones; minimise actuator_power"
        raise CaseError(key, fault, task.measure)


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def _check_parameters(case: Case) -> dict[str, tuple[Value | PerTask, ...]]:
    """Return the components of every parameter in the model's order, a fixed direction as a unit vector.

    Raises:
        CaseError: a parameter is unknown or missing, or a value is not allowed.
    """
    known = {parameter.name: parameter for parameter in case.model.parameters}
    for name in case.parameters:
        if name not in known:
            raise CaseError(f"robot.parameters.{name}", f"no such parameter; {nearest(name, known)}")
    components: dict[str, tuple[Value | PerTask, ...]] = {}
    for name, parameter in known.items():
        key = f"robot.parameters.{name}"
        if name not in case.parameters:
            raise CaseError(key, f"is missing: {parameter.description}; give {_allowed_form(parameter)}")
        given = case.parameters[name]
        if isinstance(given, str | bytes):  # a sequence too, but of no numbers
            check_real(given, key)
        values: tuple[Value | PerTask, ...] = tuple(given) if isinstance(given, Sequence) else (given,)
        if len(values) != len(parameter.typical):
            raise CaseError(key, f"must be {_allowed_form(parameter)}")
        if parameter.is_direction and any(isinstance(value, PerTask) for value in values):
            raise CaseError(key, "must be the same for every task: a direction cannot change from task to task")
        if parameter.is_direction and not any(isinstance(value, Free) for value in values):
            components[name] = tuple(float(part) for part in unit_vector(check_direction(values, key)))  # type: ignore[arg-type]
            continue
        keys = [key] if len(values) == 1 else [f"{key}[{index}]" for index in range(len(values))]
        domain = (parameter.lower, parameter.upper)
        components[name] = tuple(
            _check_each(value, place, parameter.dimension, case, domain)
            for value, place in zip(values, keys, strict=True)
        )
    return components


def _check_each(
    value: Value | PerTask, key: str, dimension: Dimension, case: Case, domain: tuple[float, float]
) -> Value | PerTask:
    """Return a checked value, or the checked value for each task; arguments and errors are those of ``check_value``."""
    if not isinstance(value, PerTask):
        return check_value(value, key, dimension, case.units, domain)
    given = tuple(value.values)
    given = given * len(case.tasks) if len(given) == 1 else given
    if len(given) != len(case.tasks):
        raise CaseError(
            f"{key}.tasks", f"must have one value for each of the {len(case.tasks)} tasks, got {len(given)}"
        )
    keys = [key if len(value.values) == 1 else f"{key}.tasks[{k}]" for k in range(len(given))]
    return PerTask(
        tuple(check_value(each, place, dimension, case.units, domain) for each, place in zip(given, keys, strict=True))
    )


def _allowed_form(parameter: Parameter) -> str:
    """Return the form of a parameter's value in a case file, for messages."""
    one = "a number or { min, max } or { values }"
    return one if len(parameter.typical) == 1 else f"a list of {len(parameter.typical)}, each {one}"


def _check_position(case: Case, position: Sequence[Value], pose: str) -> tuple[Value, ...]:
    """Return the checked position of a stated pose.

    Args:
        case: the case, for its units.
        position: position of the pose.
        pose: dotted key of the pose, for messages.

    Raises:
        CaseError: there are not three coordinates, or a coordinate is not allowed.
    """
    if len(position) != 3:
        fault = f"must be a list of 3, each a number or {{ min, max }}, got {len(position)}"
        raise CaseError(f"{pose}.position", fault)
    return tuple(
        check_value(value, f"{pose}.position[{index}]", Dimension.LENGTH, case.units)
        for index, value in enumerate(position)
    )


def _check_rotation(case: Case, given: Rotation, pose: str) -> Rotation:
    """Return the checked rotation of a stated pose; a fixed axis becomes a unit vector.

    Args:
        case: the case, for its units.
        given: rotation of the pose.
        pose: dotted key of the pose, for messages.

    Raises:
        CaseError: the angle is too large, its bounds are not symmetric about a free axis, or the axis is zero.
    """
    key = f"{pose}.rotation.angle"
    if given.axis is None:
        largest, why = MAX_FREE_ROTATION, "with a free axis"
    else:
        largest, why = 2 * math.pi, "with a fixed axis"
    angle = check_value(given.angle, key, Dimension.ANGLE, case.units)
    ends = {f"{key}.min": angle.lower, f"{key}.max": angle.upper} if isinstance(angle, Free) else {key: angle}
    for place, end in ends.items():
        if abs(end) > largest:
            allowed = case.units.text(largest, Dimension.ANGLE)
            raise CaseError(
                place, f"must be at most {allowed} in magnitude {why}", case.units.shown(end, Dimension.ANGLE)
            )
    lopsided = isinstance(angle, Free) and angle.lower < 0 < angle.upper and not math.isclose(-angle.lower, angle.upper)
    if given.axis is None and isinstance(angle, Free) and lopsided:
        fault = "must be -max, or have the sign of max: about a free axis the sign of an angle has no meaning"
        raise CaseError(f"{key}.min", fault, case.units.shown(angle.lower, Dimension.ANGLE))
    axis = None if given.axis is None else unit_vector(check_direction(given.axis, f"{pose}.rotation.axis"))
    return Rotation(axis, angle, given.form)


def _check_further_poses(case: Case) -> tuple[Pose, ...]:
    """Return the checked stated poses after the first.

    Raises:
        CaseError: a coordinate is not allowed, a pose has no displacement, or the worst F over poses is requested for
            several tasks.
    """
    keys = [f"pose[{k + 1}]" for k in range(len(case.further))]
    poses = tuple(
        Pose(
            _check_position(case, pose.position, key),
            _check_rotation(case, pose.rotation, key),
            tuple(pose.displacements),
        )
        for pose, key in zip(case.further, keys, strict=True)
    )
    displacements = [case.displacements, *(pose.displacements for pose in poses)]
    for key, moves in zip(["pose", *keys], displacements, strict=True):
        if not moves:
            raise CaseError(key, "must have at least one displacement, got none")
    if sum(map(len, displacements)) > 1 and case.over_poses is OverPoses.WORST and len(case.tasks) > 1:
        raise CaseError("combine.over_poses", "must be 'sum' or 'mean' with several tasks", case.over_poses.value)
    return poses


def _check_tasks(case: Case) -> tuple[Task, ...]:
    """Return the checked tasks, with twists as arrays (6,).

    Raises:
        CaseError: there is no task, a twist or weight is not allowed, or two tasks have the same name.
    """
    if not case.tasks:
        raise CaseError("task", "is missing: a case needs at least one [[task]]")
    tasks = []
    for index, task in enumerate(case.tasks):
        key = f"task[{index}]"
        twist = check_reals(task.twist, f"{key}.twist")
        if twist.shape != (6,) or not np.isfinite(twist).all():
            raise CaseError(f"{key}.twist", "must be six finite numbers", twist.tolist())
        size = float(np.abs(twist).max())
        if size == 0:
            raise CaseError(f"{key}.twist", "must not be zero: the platform would not move", twist.tolist())
        if not 1 / LARGEST <= size <= LARGEST:
            fault = f"must have a largest component between {1 / LARGEST:g} and {LARGEST:g}, got {size:g}"
            raise CaseError(f"{key}.twist", fault)
        weight = check_real(task.weight, f"{key}.weight")
        if not (math.isfinite(weight) and weight > 0):
            raise CaseError(f"{key}.weight", "must be positive and finite", task.weight)
        point = None if task.point is None else frozen_array(check_vector(task.point, f"{key}.point"), (3,))
        _check_measure(case, task)
        stated = replace(task, twist=frozen_array(twist, (6,)), sense=Sense(task.sense), weight=weight, point=point)
        tasks.append(stated)
    names = [task.name for task in tasks]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise CaseError(f"task[{index}].name", "is used by an earlier task; give each task its own name", name)
    return tuple(tasks)


def _check_tolerance(case: Case) -> None:
    """Refuse a tolerance that is not positive, or that is not supported for the robot.

    Raises:
        CaseError: the tolerance is not allowed.
    """
    tolerance = case.joint_centre_tolerance
    if tolerance is None:
        return
    if not 0 < check_real(tolerance, "tolerance.joint_centre") <= LARGEST:
        raise CaseError("tolerance.joint_centre", "must be positive and finite", tolerance)
    if case.model.structure and case.workspace is not None:
        # The workspace is verified for all robots within the tolerance.
        return
    if not case.model.built or case.model.unknowns:
        reason = "add a [workspace] to verify it there" if case.model.structure else "its joint centres are not known"
        raise CaseError("tolerance.joint_centre", f"is not supported for the robot {case.model.name!r}: {reason}")
