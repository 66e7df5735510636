"""Schema of case files: tables, keys and types.

The classes mirror the file, in the user's units and words. They check keys, types and finite numbers, which is possible
without the robot. :class:`screwsynth.nlp.case.case.Case` checks everything else. The tables of limits, workspace and
loads are imported only for files that contain them, because pydantic needs as long for them as for all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, FiniteFloat, StringConstraints, Tag, model_validator

from ...models.fileversions import VERSION_KEY
from ..errors import CaseError, listing
from ..units import Units
from .case import Case
from .loads import NO_LOADING, Loading
from .pathfile import PathFile
from .pose import MISSING_RATE, OverPoses
from .settings import Expectation, Published, Search
from .table import FileName, Later, Range, Table, Value, Vector, empty_list, fault_of, tag_of_number
from .task import Task
from .workspace import Workspace

if TYPE_CHECKING:
    from .controllertable import ControllerTable
    from .limits.registry import LimitsTable
    from .loadtables import GravityTable, LoadTable, MotionTable, ObjectiveTable
    from .workspacetables import PathTable, WorkspaceTable
else:
    LimitsTable = Annotated[Any, Later("limits.registry", "LimitsTable")]
    ControllerTable = Annotated[Any, Later("controllertable", "ControllerTable")]
    GravityTable = Annotated[Any, Later("loadtables", "GravityTable")]
    LoadTable = Annotated[Any, Later("loadtables", "LoadTable")]
    MotionTable = Annotated[Any, Later("loadtables", "MotionTable")]
    ObjectiveTable = Annotated[Any, Later("loadtables", "ObjectiveTable")]
    PathTable = Annotated[Any, Later("workspacetables", "PathTable")]
    WorkspaceTable = Annotated[Any, Later("workspacetables", "WorkspaceTable")]

#: Forms of a fixed rotation; each excludes all other keys of the table.
_FIXED = ("rpy", "matrix", "quaternion")

Label = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=20)]


#: Kinds of change of a dimension or pose.
Per = Literal["task"]


class DimensionRange(Range):
    """Range of a free dimension."""

    per: Literal["task", "path", "pose"] | None = Field(
        default=None,
        description="task: the dimension is reset for every task; path: it changes along the tool path; pose: it is "
        "set for every pose of the workspace; the same value everywhere if left out",
    )
    rate: float | None = Field(
        default=None, description="largest change per second of a dimension with per = 'path'; inf for no limit"
    )
    at: Value | None = Field(
        default=None,
        description="value in the middle of the workspace, of a dimension with per = 'pose'; free within its range if "
        "left out",
    )
    slope: Annotated[list[Value], Field(min_length=3, max_length=3)] | None = Field(
        default=None,
        description="changes of a dimension with per = 'pose' along x, y and z of the position, per unit of length; "
        "free if left out",
    )

    @model_validator(mode="after")
    def _refuse_rate_alone(self) -> DimensionRange:
        """Refuse a change along the path without its largest rate, and a rate without a change along the path."""
        if self.per == "path" and self.rate is None:
            raise fault_of("rate", MISSING_RATE)
        if self.per != "path" and self.rate is not None:
            raise fault_of("rate", 'has an effect only with per = "path"')
        for key in ("at", "slope"):
            if self.per != "pose" and getattr(self, key) is not None:
                raise fault_of(key, 'has an effect only with per = "pose"')
        if self.per == "pose" and self.start is not None:
            raise fault_of("start", 'has no effect with per = "pose": give at = { min, max, start }')
        return self


class Listed(Table):
    """Dimension with catalogue values, of which a solve chooses one."""

    values: Annotated[list[FiniteFloat], Field(min_length=1)] = Field(
        description="allowed values of the dimension, two or more"
    )
    per: Literal["task", "pose"] | None = Field(
        default=None,
        description="task: a value is chosen for every task; pose: for every pose of the workspace; one value if left "
        "out",
    )


def _tag_of_value(value: object) -> str:
    """Return the branch of a union for a number, a range, catalogue values, or a list of these."""
    return "<list>" if isinstance(value, list | tuple) else _tag_of_dimension(value)


def _tag_of_dimension(value: object) -> str:
    """Return the branch of a union for a number, a range or catalogue values."""
    if isinstance(value, TaskValues) or (isinstance(value, dict) and "tasks" in value):
        return "<tasks>"
    return _tag_of_one(value)


def _tag_of_one(value: object) -> str:
    """Return the branch of a union for a number, a range or catalogue values of one task."""
    is_listed = isinstance(value, Listed) or (isinstance(value, dict) and "values" in value)
    return "<values>" if is_listed else tag_of_number(value)


Numbers = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[list[FiniteFloat], Tag("<list>")],
    Discriminator(lambda value: "<list>" if isinstance(value, list) else "<number>"),
]
TaskValue = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[Range, Tag("<range>")] | Annotated[Listed, Tag("<values>")],
    Discriminator(_tag_of_one),
]


class TaskValues(Table):
    """Dimension with a value or range of its own for every task."""

    tasks: Annotated[list[TaskValue], Field(min_length=1)] = Field(
        description="value for each task, in the order of the tasks: a number, { min, max } or { values }"
    )


DimensionValue = Annotated[
    Annotated[FiniteFloat, Tag("<number>")]
    | Annotated[DimensionRange, Tag("<range>")]
    | Annotated[Listed, Tag("<values>")]
    | Annotated[TaskValues, Tag("<tasks>")],
    Discriminator(_tag_of_dimension),
]
VectorOrValue = Annotated[
    Annotated[FiniteFloat, Tag("<number>")]
    | Annotated[DimensionRange, Tag("<range>")]
    | Annotated[Listed, Tag("<values>")]
    | Annotated[TaskValues, Tag("<tasks>")]
    | Annotated[list[DimensionValue], Tag("<list>")],
    Discriminator(_tag_of_value),
]


NumberOrTable = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[dict[str, FiniteFloat], Tag("<range>")],
    Discriminator(tag_of_number),
]


class UnitsTable(Table):
    """Units of all values in the file."""

    length: Label = Field(default=Units.length, description="name of the length unit, such as mm")
    angle: Literal["deg", "rad"] = Field(default=Units.angle, description="unit of angles: degrees or radians")
    force: Label = Field(
        default=Units.force, description="name of the force unit, such as N; torques are in force times length"
    )


class RobotTable(Table):
    """Robot of the case: its name or file, its options, and its dimensions."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={"oneOf": [{"required": [each]} for each in ("model", "file", "definition")]},
    )

    model: str | None = Field(default=None, description="name of a robot; `screwsynth models` lists all")
    file: FileName | None = Field(
        default=None, description="name of a robot file in the folder of the case file, instead of model"
    )
    definition: dict[str, Any] | None = Field(default=None, description="content of a robot file, instead of model")
    parameters: dict[str, VectorOrValue] = Field(
        default_factory=dict,
        description="value of each parameter by name: a number, a range { min, max }, catalogue values { values }, or "
        "a value for each task { tasks }; three of these for a point or direction",
    )
    characteristic_length: FiniteFloat = Field(
        default=Case.characteristic_length,
        gt=0,
        description="length by which unit couples are multiplied to make them comparable with unit forces",
    )
    actuator_stiffness: NumberOrTable | None = Field(
        default=None,
        description="stiffness of the actuators, force per displacement: one number, or a number for each by name",
    )

    @model_validator(mode="after")
    def _refuse_two_robots(self) -> RobotTable:
        """Refuse a table that gives no robot, or gives a robot in two ways."""
        if self.model is None and self.definition is None:
            raise fault_of("model", "is missing: give model, or file with the name of a robot file")
        if self.model is not None and self.definition is not None:
            raise fault_of("definition", "conflicts with model; give only one of them")
        return self

    @property
    def options(self) -> dict[str, Any]:
        """Options of the robot by name, as ``tomllib`` returns them."""
        return dict(self.model_extra or {})


class RotationTable(Table):
    """Rotation of the platform: axis and angle, or a fixed rotation by roll-pitch-yaw, matrix or quaternion."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["angle"]},
                {"required": ["rpy"], "properties": {"axis": False}},
                {"required": ["matrix"], "properties": {"axis": False}},
                {"required": ["quaternion"], "properties": {"axis": False}},
            ]
        }
    )

    axis: Vector | None = Field(
        default=None, description="fixed axis of rotation in the world frame; a free variable if left out"
    )
    angle: Value | None = Field(
        default=None, description="angle of rotation: a number, or a range { min, max } for a free variable"
    )
    rpy: Vector | None = Field(
        default=None, description="roll, pitch, yaw: angles of rotation about the world x, then y, then z axis"
    )
    matrix: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="rotation matrix from platform to world coordinates, by rows"
    )
    quaternion: Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="unit quaternion [w, x, y, z], scalar part first"
    )

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> RotationTable:
        """Refuse a table with two forms of the rotation, and a table without a rotation."""
        given = [form for form in (*_FIXED, "angle", "axis") if getattr(self, form) is not None]
        if given in ([], ["axis"]):
            raise fault_of("angle", f"is missing: give angle, or one of {listing(_FIXED)}")
        if len(given) > 1 and given[0] in _FIXED:
            raise fault_of(given[1], f"conflicts with {given[0]}; state the rotation in one way")
        return self


class AlongTable(Table):
    """Evenly spaced poses along the finite screw motion of a task."""

    task: str | None = Field(default=None, description="name of the task; required with several tasks")
    first: FiniteFloat = Field(
        description="displacement of the first pose along the screw: an angle, or a length for a translation"
    )
    last: FiniteFloat = Field(description="displacement of the last pose along the screw, in the same unit as first")
    count: int = Field(ge=2, le=50, description="number of poses")


class OffsetsTable(Table):
    """Evenly spaced offsets of the platform position along one world axis."""

    min: FiniteFloat = Field(description="first offset from the stated pose, length")
    max: FiniteFloat = Field(description="last offset from the stated pose, length, above min")
    count: int = Field(ge=2, le=20, description="number of offsets")


class GridTable(Table):
    """Grid of poses around the stated pose: all combinations of offsets along the world axes."""

    x: OffsetsTable | None = Field(default=None, description="offsets along the world x axis; no offset if left out")
    y: OffsetsTable | None = Field(default=None, description="offsets along the world y axis; no offset if left out")
    z: OffsetsTable | None = Field(default=None, description="offsets along the world z axis; no offset if left out")


class DisplacementTable(Table):
    """Displacement of the stated pose: ``x -> rotation x + translation``, in the world frame."""

    rotation: Annotated[list[Vector], Field(min_length=3, max_length=3)] = Field(
        default=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        description="rotation matrix, by rows; the identity if left out",
    )
    translation: Vector = Field(description="translation vector: the displaced position of the world origin")


class PoseTable(Table):
    """Pose of the platform in the world frame."""

    position: Annotated[list[Value], Field(min_length=3, max_length=3)] = Field(
        description="origin of the platform frame: three coordinates, each a number or { min, max }"
    )
    rotation: RotationTable | None = Field(
        default=None, description="rotation of the platform; if left out, no rotation"
    )
    per: Per | None = Field(
        default=None, description="task: every task has its own pose, within these ranges; one pose if left out"
    )
    task: str | None = Field(
        default=None, description="name of the only task at this pose; if left out, every task is taken at this pose"
    )
    along_task: AlongTable | None = Field(
        default=None, description="several poses along a task's screw motion, starting from this pose"
    )
    grid: GridTable | None = Field(default=None, description="several poses on a grid around this pose")
    displacements: Annotated[list[DisplacementTable], Field(min_length=1)] | None = Field(
        default=None, description="several poses by their displacements from this pose, instead of along_task or grid"
    )


Poses = Annotated[
    Annotated[PoseTable, Tag("<pose>")] | Annotated[list[PoseTable], Field(min_length=1), Tag("<poses>")],
    Discriminator(lambda value: "<poses>" if isinstance(value, list) else "<pose>"),
]


class TaskTable(Table):
    """Task: instantaneous motion that the platform must make, by axis, point and pitch, or by a twist."""

    name: str | None = Field(default=None, min_length=1, description="name of the task, such as drive the screw")
    sense: Literal["max", "min"] = Field(description="sense of optimisation: maximise or minimise F")
    axis: Vector | None = Field(
        default=None, description="direction of the screw axis in the world frame, of any length but zero"
    )
    point: Vector | None = Field(default=None, description="any point on the screw axis, in the world frame")
    pitch: float | None = Field(
        default=None, description="translation per radian; 0 for a rotation, inf for a translation along the axis"
    )
    weight: FiniteFloat = Field(
        default=Task.weight, gt=0, description="weight of the task in a combination of several tasks"
    )
    twist: Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)] | None = Field(
        default=None,
        description="twist [omega, v]: angular velocity of the platform and velocity of its point at the world origin, "
        "instead of axis, point and pitch",
    )
    follows: Literal["feed", "tool", "thrust"] | None = Field(
        default=None,
        description="motion that moves with the tool path, instead of axis, point and pitch; feed: translation in the "
        "direction of the feed; tool: rotation about the tool's axis; thrust: translation along the tool's axis",
    )


class CombineTable(Table):
    """Combination of several tasks, and of several poses."""

    method: Literal["average", "weighted-sum", "worst-case"] | None = Field(
        default=None,
        description="average: weighted mean of the separate optima (equation 15); weighted-sum: optimum of the "
        "weighted sum of F; worst-case: optimum of the worst F",
    )
    over_poses: Literal["sum", "mean", "worst"] | None = Field(
        default=None, description="combination of F over several poses: sum, mean or worst; the sum if left out"
    )


class ToleranceTable(Table):
    """Manufacturing tolerances."""

    joint_centre: FiniteFloat = Field(description="largest error of each joint centre in any direction, length")


class SolveTable(Table):
    """Settings of the search for optima."""

    starts: int = Field(default=Search.starts, ge=1, le=100_000, description="number of starting points")
    seed: int = Field(default=Search.seed, ge=0, description="seed of the random starting points")
    max_iterations: int = Field(
        default=Search.max_iterations,
        ge=1,
        le=1_000_000,
        description="largest number of Ipopt iterations from each starting point",
    )
    screen: bool = Field(
        default=Search.screen,
        description="If true, a fast search in C finds the optima and Ipopt confirms them; if false, Ipopt runs from "
        "each starting point",
    )


class ExpectedValueTable(Table):
    """Expected value of a quantity in the result, for regression tests."""

    quantity: str = Field(
        min_length=1, description="dotted path of the quantity in the JSON result, such as pose.angle"
    )
    value: FiniteFloat = Field(description="expected value, in the case's units")
    within: FiniteFloat = Field(gt=0, description="largest allowed difference, in the same unit")


class ExpectTable(Table):
    """Expected results, for regression tests."""

    F: FiniteFloat | None = Field(default=Expectation.F, ge=0, description="expected F at the optimum")
    tolerance: FiniteFloat = Field(
        default=Expectation.tolerance,
        gt=0,
        description="largest allowed difference of F, relative; absolute if F is 0",
    )
    singular: bool | None = Field(
        default=Expectation.singular,
        description="If true, J must be rank deficient at the optimum; if false, it must have full rank",
    )
    value: list[ExpectedValueTable] = Field(
        default_factory=empty_list, description="expected values of other quantities of the result"
    )


class PublishedTable(Table):
    """Value printed in the literature."""

    quantity: str = Field(
        min_length=1,
        description="dotted path of the quantity in the JSON result, or gain: percentage by which F exceeds that of "
        "the case over",
    )
    value: Numbers = Field(description="value as printed, one number or several")
    source: str = Field(min_length=1, description="place in the literature, such as Section 4.1")
    reproduced: bool = Field(description="If true, this program reproduces the value")
    because: str = Field(default=Published.because, description="reason why the value is not reproduced")
    decimals: int | None = Field(
        default=Published.decimals,
        ge=0,
        le=15,
        description="number of printed decimals, if trailing zeros were printed",
    )
    over: str | None = Field(default=Published.over, description="name of the reference case of a gain")

    @model_validator(mode="after")
    def _refuse_incomplete(self) -> PublishedTable:
        """Refuse a missing reason, and a gain without its reference case."""
        if not self.reproduced and not self.because:
            raise fault_of("because", "is missing: say why the value is not reproduced")
        if (self.quantity == "gain") != (self.over is not None):
            fault = 'is missing: quantity = "gain" needs the name of a reference case'
            raise fault_of("over", fault if self.over is None else 'is allowed only for quantity = "gain"')
        return self


class Document(Table):
    """Case file."""

    model_config = ConfigDict(
        title="screwsynth case file",
        json_schema_extra={
            "allOf": [
                {"oneOf": [{"required": ["pose"]}, {"required": ["poses"]}]},
                {
                    "oneOf": [
                        {"required": ["task"]},
                        {"required": ["tasks"]},
                        {
                            "required": ["objective"],
                            "not": {"anyOf": [{"required": ["task"]}, {"required": ["tasks"]}]},
                        },
                    ]
                },
            ]
        },
    )

    schema_: Literal[1] = Field(default=1, alias=VERSION_KEY, description="version of the file format")
    title: str = Field(default=Case.title, description="title of the case, one line")
    # Defaults are constructed without validators, which are built when a document is first read.
    units: UnitsTable = UnitsTable.model_construct()
    robot: RobotTable
    # Rows of CSV files are inserted here before the document is checked.
    pose: Poses = Field(default_factory=empty_list)
    task: Annotated[list[TaskTable], Field(min_length=1)] = Field(default_factory=empty_list)
    poses: FileName | None = Field(
        default=None, description="name of a CSV file with one pose in each row, in the folder of the case file"
    )
    tasks: FileName | None = Field(
        default=None, description="name of a CSV file with one task in each row, in the folder of the case file"
    )
    combine: CombineTable | None = Field(default=None, description="combination of several tasks, or of several poses")
    limits: LimitsTable | None = Field(default=None, description="limits that a design must satisfy to be buildable")
    tolerance: ToleranceTable | None = Field(default=None, description="manufacturing tolerances")
    workspace: WorkspaceTable | None = Field(default=None, description="box of poses over which the robot is verified")
    solve: SolveTable = SolveTable.model_construct()
    expect: ExpectTable = ExpectTable.model_construct()
    published: list[PublishedTable] = Field(default_factory=empty_list)
    path: PathTable | None = Field(default=None, description="tool path along which the robot is verified")
    load: list[LoadTable] = Field(default_factory=empty_list, description="external loads on the platform")
    motion: MotionTable | None = Field(default=None, description="largest speeds of the platform")
    gravity: GravityTable | None = Field(default=None, description="gravity, for loads given as masses")
    objective: ObjectiveTable | None = Field(default=None, description="objective other than F at the stated poses")
    controller: ControllerTable | None = Field(default=None, description="conventions of generated kinematics in C")

    @model_validator(mode="after")
    def _refuse_without_pose_or_task(self) -> Document:
        """Refuse a document without a pose or a task."""
        for key in ("pose", "task"):
            if key not in self.model_fields_set and not (key == "task" and "objective" in self.model_fields_set):
                raise fault_of(
                    key, f"is missing: add a table [{key}]" if key == "pose" else "is missing: add a [[task]]"
                )
        return self

    @classmethod
    def file_schema(cls) -> dict[str, Any]:
        """Return the JSON Schema of case files; this imports all tables."""
        Later.is_over = True
        cls.model_rebuild(force=True)
        return cls.model_json_schema()

    def read_worst_everywhere(self) -> bool:
        """Return True if the worst F over the workspace or path is to be optimised.

        Raises:
            CaseError: the limits are not over the same poses.
        """
        if self.objective is None or self.objective.over is None or self.objective.as_ is not None:
            return False
        over = self.objective.over
        if not self._has_limits_over(over):
            raise CaseError("objective.over", f"needs limits over the same poses: [limits] over = '{over}'", over)
        return self.objective.minimise is None  # a quantity of the actuators covers all these poses anyway

    def read_over_path(self) -> OverPoses | None:
        """Return the combination of F over the points of the path; None if F is not optimised along the path.

        Raises:
            CaseError: the combination is stated for other poses than those of a path.
        """
        if self.objective is None or self.objective.as_ is None:
            return None
        if self.objective.over != "path":
            raise CaseError("objective.as", 'needs over = "path"', self.objective.as_)
        return OverPoses(self.objective.as_)

    def _has_limits_over(self, poses: str) -> bool:
        """Return True if the limits are over some poses, ``workspace`` or ``path``."""
        return self.limits is not None and self.limits.over == poses

    def read_workspace(self, units: Units) -> Workspace | None:
        """Return the workspace of the document; None without a table ``[workspace]``.

        Args:
            units: units of the document.

        Raises:
            CaseError: the axis of its rotations is zero, or the limits are over a workspace that is missing.
        """
        has_limits = self._has_limits_over("workspace")
        if self.workspace is not None:
            return self.workspace.read(units, has_limits=has_limits)
        if has_limits:
            raise CaseError("limits.over", "needs the table [workspace] with the box of poses", "workspace")
        return None

    def read_path(self, folder: str, units: Units) -> PathFile | None:
        """Return the tool path of the document; None without a table ``[path]``.

        Args:
            folder: folder of the document, from which the path's file name begins.
            units: units of the document.

        Raises:
            CaseError: the limits are along a path that is missing.
        """
        has_limits = self._has_limits_over("path")
        if self.path is not None:
            return self.path.read(folder, units, has_limits=has_limits)
        if has_limits:
            raise CaseError("limits.over", "needs the table [path] with the name of its file", "path")
        return None

    def read_tasks(self, tasks: Sequence[Task]) -> list[Task]:
        """Return the tasks of the case; with ``objective.minimise`` or ``maximise``, a quantity replaces F.

        Args:
            tasks: tasks that the document states.
        """
        measure = None if self.objective is None else self.objective.minimise or self.objective.maximise
        if self.objective is None or measure is None:
            return list(tasks)
        length = self.objective.length
        if not tasks:
            task = Task.minimise(measure) if self.objective.maximise is None else Task.maximise(measure, length=length)
            return [task]
        return [replace(task, measure=measure, length=length) for task in tasks]

    def read_loading(self, units: Units) -> Loading:
        """Return loads, motion, gravity and actuator stiffness of the document.

        Args:
            units: units of the document.
        """
        found, stiffness = NO_LOADING, self.robot.actuator_stiffness
        if self.load or self.motion is not None or self.gravity is not None:
            from .loadtables import loading_of  # noqa: PLC0415 - a case without them starts without their tables

            found = loading_of(self.load, self.motion, self.gravity, units)
        if stiffness is None:
            return found
        return found._replace(stiffness=stiffness if isinstance(stiffness, dict) else {"": stiffness})
