"""Case: a robot with fixed and free dimensions, the tasks of its platform, limits and settings.

A :class:`Case` is read from a case file or made in Python. Angles are radians. Its constructor checks every value, with
messages in the words of case files, so that all other modules can rely on valid cases.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ...models import Dimension, Displacement, FloatArray, Model, Parameter, component_names, frozen_array
from ...models.shown import Shown
from ...models.statics import driven_joints
from ...models.values import dataclass
from ...models.whole import Whole
from ..errors import CaseError, NoRobotError
from ..units import Units
from .checks import check_determined_joints, check_real, check_tolerance
from .controller import SAME, Controller
from .excursions import OutsideWorkspace, check_excursions, in_world, outside_workspace, refuse_free
from .existence import assembly_fault
from .jointsettings import check_joint_rates, with_joints_along
from .limits.limit import Limit, LimitedCase
from .limits.limits import Limits
from .loads import NO_LOADING, Loading
from .names import name_of_task, parameter_name, pose_prefixes
from .parameters import check_choices, check_parameters
from .pathfile import TURN, PathFile
from .pertask import Station, check_poses, common_poses, common_value, stations, task_value
from .pose import LARGEST, NO_DISPLACEMENT, Free, OverPoses, PerPose, PerTask, Pose, Rotation, Value, ends_of
from .posechecks import check_displacements, check_further_poses, check_position, check_rotation
from .posesettings import check_pose_settings, with_settings_resolved
from .radians import angles_of, check_radians, with_radians
from .schedule import check_settings
from .settings import Expectation, Published, Search
from .task import MEASURES, Method, Task
from .taskchecks import check_loading, check_tasks
from .workspace import PoseSettings, Workspace

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Case(Whole, Shown):
    """Synthesis problem: a robot, its dimensions and pose, tasks, limits, and settings of the search.

    Attributes:
        model: robot of the case.
        parameters: value of each parameter of the robot by name: a number, :class:`Free`, :class:`PerTask` or
            :class:`PerPose`, or a sequence of three for a point or direction; stored as tuples of components. A
            :class:`PerPose` becomes its range, or a robot that follows it.
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
    parameters: Mapping[str, Value | PerTask | PerPose | Sequence[Value | PerTask | PerPose]]
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
        resolved = with_settings_resolved(
            self.model,
            self.parameters,
            self.limits,
            self.workspace,
            self.loading,
            self.joint_centre_tolerance,
            self.units,
        )
        for name, value in resolved._asdict().items():
            store(self, name, value)
        parameters = resolved.parameters
        if self.over_path is None:
            check_joint_rates(self.model, self.limits, has_path=self.path is not None)
        else:
            along = with_joints_along(self.model, parameters, self.limits, self.units)
            store(self, "model", along.model)
            parameters = along.parameters
        checked = check_parameters(parameters, self.model, len(self.tasks), self.units)
        store(self, "parameters", MappingProxyType(checked))
        known = {} if self.dimensions_per_task else self.parameters
        if fault := assembly_fault(self.model, known, self.units):  # type: ignore[arg-type]
            raise NoRobotError("robot.parameters", fault, source=self.source)
        store(self, "position", check_position(self.position, "pose", self.units))
        store(self, "rotation", check_rotation(self.rotation, "pose", self.units))
        if self.pose_per_task and not self.further:
            store(self, "further", [Pose(self.position, self.rotation, self.displacements)] * (len(self.tasks) - 1))
        store(self, "further", check_further_poses(self.further, self.units))
        check_displacements(self.poses, self.over_poses, len(self.tasks))
        store(self, "tasks", check_tasks(self.tasks, self.model, self.loading))
        _check_changes(self)
        check_settings(self)
        check_choices(checked, self.model, self.tasks, self.method)
        _check_worst_everywhere(self)
        check_loading(self.loading, self.model, self.units)
        self.controller.check(driven_joints(self.model), self.units)
        self.limits.check(self.as_limited)
        if self.limits_over:
            check_determined_joints(self.model, "limits.over", self.source)
        check_tolerance(self.joint_centre_tolerance, self.model, self.workspace is not None)
        if self.workspace is not None:
            self.workspace.check(self.units)
            check_excursions(self.workspace, self.poses[0], self.pose_count, self.units)
        check_pose_settings(self.model, self.workspace, len(self.changes), has_path=self.path is not None)
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
        values: Any = self.parameters[name]  # no longer a PerPose
        return tuple(values) if isinstance(values, Sequence) else (values,)

    @property
    def dimensions_per_task(self) -> Mapping[str, PerTask]:
        """Components of the robot's parameters that are reset for every task, by their name in the robot."""
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
    def has_any_settings(self) -> bool:
        """True if the workspace has settings of which any value may do at a pose, not a stated function of the pose."""
        return self.workspace is not None and self.workspace.settings is PoseSettings.ANY

    def refuse_settings(self, reason: str) -> None:
        """Refuse settings that follow the pose.

        Args:
            reason: reason, as a clause for the message.

        Raises:
            CaseError: the case has such settings.
        """
        if self.model.settings:
            raise CaseError("workspace.settings", f"is not supported here: {reason}", "affine", self.source)

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

    def fixed_parameters(self, reason: str, changing: Collection[str] = ()) -> FloatArray:
        """Return the values (d,) of all components of the robot's parameters, in the robot's order.

        Args:
            reason: reason why the parameters must be fixed, as a clause for messages.
            changing: names of components with ranges along a path; their values are the middles of the ranges.

        Raises:
            CaseError: another parameter is free.
        """
        found: list[float] = []
        for item in self.model.parameters:
            values = [
                sum(ends_of(value)) / 2
                for name, value in zip(item.components, self.components(item.name), strict=True)
                if not isinstance(value, Free) or name in changing
            ]
            if len(values) < len(item.typical):
                fault = f"is free, and {reason}: give it with --set, or a result with --of"
                if set(self.component_names(item)) & self.settings.keys():
                    fault = f"changes along the path, and {reason}: give it with --set"
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

    def with_components(self, values: Mapping[str, Value]) -> Case:
        """Return the case with other values of some components of its robot's parameters.

        Args:
            values: values or ranges by the names of the components in this case, lengths and radians.
        """
        parameters = {
            item.name: [
                values.get(name, value)
                for name, value in zip(self.component_names(item), self.components(item.name), strict=True)
            ]
            for item in self.model.parameters
        }
        return replace(self, parameters=parameters)

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
        return stations(self.poses, len(self.tasks) if self.changes else 0, self.pose_per_task)

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


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
