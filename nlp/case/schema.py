"""Schema of case files: tables and keys.

The classes mirror the file, in the user's units and words. They check keys, types and finite numbers, for which no
robot need be known. Everything else is checked once, by :class:`screwsynth.nlp.case.case.Case`. A key that may be left
out has the default of the value that it becomes.

The tables of limits, of the workspace and of loads take as long to make as all others together. They are imported when
a file states them.
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
from .settings import Expectation, Published, Search
from .table import FileName, Later, Range, Table, Value, Vector, empty_list, fault_of, tag_of_number
from .task import Task
from .workspace import Workspace

if TYPE_CHECKING:
    from .limits.registry import LimitsTable
    from .loadtables import GravityTable, LoadTable, MotionTable, ObjectiveTable
    from .controllertable import ControllerTable
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

#: Forms of a fixed rotation, each of which stands alone.
_FIXED = ("rpy", "matrix", "quaternion")

Label = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=20)]


class Listed(Table):
    """A dimension that has one of a few values, such as those of a catalogue."""

    values: Annotated[list[FiniteFloat], Field(min_length=1)] = Field(
        description="the values, two or more, of which one is chosen"
    )


def _tag_of_value(value: object) -> str:
    """Return the branch of a union for a number, a range, values or a list of them."""
    return "<list>" if isinstance(value, list | tuple) else _tag_of_dimension(value)


def _tag_of_dimension(value: object) -> str:
    """Return the branch of a union for a number, a range or values."""
    is_listed = isinstance(value, Listed) or (isinstance(value, dict) and "values" in value)
    return "<values>" if is_listed else tag_of_number(value)


Numbers = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[list[FiniteFloat], Tag("<list>")],
    Discriminator(lambda value: "<list>" if isinstance(value, list) else "<number>"),
]
DimensionValue = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[Range, Tag("<range>")] | Annotated[Listed, Tag("<values>")],
    Discriminator(_tag_of_dimension),
]
VectorOrValue = Annotated[
    Annotated[FiniteFloat, Tag("<number>")]
    | Annotated[Range, Tag("<range>")]
    | Annotated[Listed, Tag("<values>")]
    | Annotated[list[DimensionValue], Tag("<list>")],
    Discriminator(_tag_of_value),
]


NumberOrTable = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[dict[str, FiniteFloat], Tag("<range>")],
    Discriminator(tag_of_number),
]


class UnitsTable(Table):
    """Units of every number in the file."""

    length: Label = Field(default=Units.length, description="label of the length unit")
    angle: Literal["deg", "rad"] = Field(default=Units.angle, description="unit of angles")
    force: Label = Field(default=Units.force, description="label of the unit of force; a torque is force times length")


class RobotTable(Table):
    """The robot: its model, the model's own options, and its dimensions."""

    model_config = ConfigDict(
        extra="allow",
        json_schema_extra={"oneOf": [{"required": [each]} for each in ("model", "file", "definition")]},
    )

    model: str | None = Field(default=None, description="name of the robot; `screwsynth models` lists them")
    file: FileName | None = Field(default=None, description="robot file beside this one, instead of a name")
    definition: dict[str, Any] | None = Field(default=None, description="content of a robot file, instead of a name")
    parameters: dict[str, VectorOrValue] = Field(
        default_factory=dict,
        description="a number, { min, max } or { values } for each parameter; three for a point",
    )
    characteristic_length: FiniteFloat = Field(
        default=Case.characteristic_length,
        gt=0,
        description="length by which unit couples are made comparable with unit forces",
    )
    actuator_stiffness: NumberOrTable | None = Field(
        default=None, description="force of an actuator by its displacement, of all or by name"
    )

    @model_validator(mode="after")
    def _refuse_two_robots(self) -> RobotTable:
        """Return the table, or refuse one that gives no robot, or gives it twice."""
        if self.model is None and self.definition is None:
            raise fault_of("model", "is missing")
        if self.model is not None and self.definition is not None:
            raise fault_of("definition", "cannot stand beside model: give the robot in one way")
        return self

    @property
    def options(self) -> dict[str, Any]:
        """The model's own options, as ``tomllib`` returns their values."""
        return dict(self.model_extra or {})


class RotationTable(Table):
    """Rotation of the platform: about an axis of the world frame, or fixed in one of three other forms."""

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

    axis: Vector | None = Field(default=None, description="held axis; left out, the axis is free")
    angle: Value | None = Field(default=None, description="angle, fixed or free")
    rpy: Vector | None = Field(default=None, description="roll, pitch, yaw: about the world's x, then y, then z")
    matrix: Annotated[list[Vector], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="rows of the matrix from platform to world coordinates"
    )
    quaternion: Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="unit quaternion w, x, y, z"
    )

    @model_validator(mode="after")
    def _refuse_two_forms(self) -> RotationTable:
        """Return the table, or refuse two forms of a rotation beside each other, and none."""
        given = [form for form in (*_FIXED, "angle", "axis") if getattr(self, form) is not None]
        if given in ([], ["axis"]):
            raise fault_of("angle", f"is missing: give angle, or one of {listing(_FIXED)}")
        if len(given) > 1 and given[0] in _FIXED:
            raise fault_of(given[1], f"cannot stand beside {given[0]}; state the rotation in one way")
        return self


class AlongTable(Table):
    """Poses along the finite screw motion of a task, evenly spaced."""

    task: str | None = Field(default=None, description="name of the task; needed where there are several")
    first: FiniteFloat = Field(description="where it begins: an angle, or a length for a translation")
    last: FiniteFloat = Field(description="where it ends")
    count: int = Field(ge=2, le=50, description="number of poses")


class OffsetsTable(Table):
    """Offsets of the platform's position along one axis, evenly spaced."""

    min: FiniteFloat = Field(description="first offset")
    max: FiniteFloat = Field(description="last offset")
    count: int = Field(ge=2, le=20, description="number of offsets")


class GridTable(Table):
    """Poses over a box about the stated one: every combination of offsets along the world's axes."""

    x: OffsetsTable | None = Field(default=None, description="offsets along x; none if left out")
    y: OffsetsTable | None = Field(default=None, description="offsets along y")
    z: OffsetsTable | None = Field(default=None, description="offsets along z")


class DisplacementTable(Table):
    """A displacement of the stated pose: ``x -> rotation x + translation``, in the world frame."""

    rotation: Annotated[list[Vector], Field(min_length=3, max_length=3)] = Field(
        default=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        description="rows of the rotation matrix; left out: no rotation",
    )
    translation: Vector = Field(description="where the world's origin goes")


class PoseTable(Table):
    """Pose of the platform in the world frame."""

    position: Annotated[list[Value], Field(min_length=3, max_length=3)] = Field(
        description="origin of the platform frame"
    )
    rotation: RotationTable | None = Field(default=None, description="left out: no rotation")
    along_task: AlongTable | None = Field(default=None, description="poses along a task's screw motion from this one")
    grid: GridTable | None = Field(default=None, description="poses over a box about this one")
    displacements: Annotated[list[DisplacementTable], Field(min_length=1)] | None = Field(
        default=None, description="poses at these displacements from this one, instead of a trajectory or a grid"
    )


Poses = Annotated[
    Annotated[PoseTable, Tag("<pose>")] | Annotated[list[PoseTable], Field(min_length=1), Tag("<poses>")],
    Discriminator(lambda value: "<poses>" if isinstance(value, list) else "<pose>"),
]


class TaskTable(Table):
    """A motion that the platform must make: axis, point and pitch, or the six numbers of a twist."""

    name: str | None = Field(default=None, min_length=1, description="a few words")
    sense: Literal["max", "min"] = Field(description="maximise or minimise F")
    axis: Vector | None = Field(default=None, description="direction of the screw axis, any length but zero")
    point: Vector | None = Field(default=None, description="any point on the axis")
    pitch: float | None = Field(
        default=None, description="translation per radian; inf is a pure translation along the axis"
    )
    weight: FiniteFloat = Field(default=Task.weight, gt=0, description="weight of the task beside others")
    twist: Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)] | None = Field(
        default=None, description="angular velocity and velocity at the world origin, instead of axis, point and pitch"
    )


class CombineTable(Table):
    """Combination of several tasks, and of several poses."""

    method: Literal["average", "weighted-sum", "worst-case"] | None = Field(
        default=None,
        description="average of the tasks' optima (equation 15), best weighted sum, or best worst task",
    )
    over_poses: Literal["sum", "mean", "worst"] | None = Field(
        default=None, description="combination of F over several poses; the sum if left out"
    )


class ToleranceTable(Table):
    """Manufacturing tolerances."""

    joint_centre: FiniteFloat = Field(description="largest error of each joint centre, in any direction")


class SolveTable(Table):
    """Settings of the search."""

    starts: int = Field(default=Search.starts, ge=1, le=100_000, description="number of starting points")
    seed: int = Field(default=Search.seed, ge=0, description="seed of the random ones")
    max_iterations: int = Field(default=Search.max_iterations, ge=1, le=1_000_000, description="limit for each start")
    screen: bool = Field(
        default=Search.screen, description="whether a quick search in C finds the optima that Ipopt confirms"
    )


class ExpectedValueTable(Table):
    """A number that a regression expects in the result."""

    quantity: str = Field(min_length=1, description="dotted path in the JSON result, such as pose.angle")
    value: FiniteFloat = Field(description="expected number, in the case's units")
    within: FiniteFloat = Field(gt=0, description="largest difference from it")


class ExpectTable(Table):
    """Values that a regression expects."""

    F: FiniteFloat | None = Field(default=Expectation.F, ge=0, description="objective at the optimum")
    tolerance: FiniteFloat = Field(default=Expectation.tolerance, gt=0, description="relative; absolute where F is 0")
    singular: bool | None = Field(
        default=Expectation.singular, description="whether J is rank deficient at the optimum"
    )
    value: list[ExpectedValueTable] = Field(default_factory=empty_list, description="other numbers of the result")


class PublishedTable(Table):
    """A number that the literature prints."""

    quantity: str = Field(min_length=1, description="dotted path in the JSON result, or gain (percent, with over)")
    value: Numbers = Field(description="as printed")
    source: str = Field(min_length=1, description="where")
    reproduced: bool = Field(description="whether this program reproduces it")
    because: str = Field(default=Published.because, description="the reason, where it does not")
    decimals: int | None = Field(
        default=Published.decimals, ge=0, le=15, description="printed decimals, if the value hides zeros"
    )
    over: str | None = Field(default=Published.over, description="the case that a gain is over")

    @model_validator(mode="after")
    def _refuse_incomplete(self) -> PublishedTable:
        """Return the table, or refuse a missing reason, and a gain without its other case."""
        if not self.reproduced and not self.because:
            raise fault_of("because", "is missing: say why the number is not reproduced")
        if (self.quantity == "gain") != (self.over is not None):
            raise fault_of("over", 'belongs to quantity = "gain", and that to it')
        return self


class Document(Table):
    """A whole case file."""

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

    schema_: Literal[1] = Field(default=1, alias=VERSION_KEY, description="version of the keys of this file")
    title: str = Field(default=Case.title, description="one line for people")
    # Defaults are constructed without validators, which are built when a document is first read.
    units: UnitsTable = UnitsTable.model_construct()
    robot: RobotTable
    # A document that names CSV files has their rows here by the time that it is checked.
    pose: Poses = Field(default_factory=empty_list)
    task: Annotated[list[TaskTable], Field(min_length=1)] = Field(default_factory=empty_list)
    poses: FileName | None = Field(default=None, description="CSV file beside this one with a pose in each row")
    tasks: FileName | None = Field(default=None, description="CSV file beside this one with a task in each row")
    combine: CombineTable | None = Field(default=None, description="several tasks or poses only")
    limits: LimitsTable | None = Field(default=None, description="limits that a design must keep to be built")
    tolerance: ToleranceTable | None = Field(default=None, description="manufacturing tolerances")
    workspace: WorkspaceTable | None = Field(default=None, description="poses for which a machine is judged")
    solve: SolveTable = SolveTable.model_construct()
    expect: ExpectTable = ExpectTable.model_construct()
    published: list[PublishedTable] = Field(default_factory=empty_list)
    path: PathTable | None = Field(default=None, description="programmed path along which a machine is judged")
    load: list[LoadTable] = Field(default_factory=empty_list, description="loads on the platform")
    motion: MotionTable | None = Field(default=None, description="the platform's fastest motions")
    gravity: GravityTable | None = Field(default=None, description="gravity, for loads that are masses")
    objective: ObjectiveTable | None = Field(default=None, description="what is optimised, and over which poses")
    controller: ControllerTable | None = Field(default=None, description="conventions of generated kinematics in C")

    @model_validator(mode="after")
    def _refuse_without_pose_or_task(self) -> Document:
        """Return the document, or refuse one that states no pose or no task."""
        for key in ("pose", "task"):
            if key not in self.model_fields_set and not (key == "task" and "objective" in self.model_fields_set):
                raise fault_of(key, "is missing")
        return self

    @classmethod
    def file_schema(cls) -> dict[str, Any]:
        """Return the JSON Schema of case files, for which all tables are imported."""
        Later.is_over = True
        cls.model_rebuild(force=True)
        return cls.model_json_schema()

    def read_worst_everywhere(self) -> bool:
        """Return whether F is its worst over all poses at which limits hold.

        Raises:
            CaseError: the limits do not hold there.
        """
        if self.objective is None or self.objective.over is None:
            return False
        over = self.objective.over
        if not self._has_limits_over(over):
            raise CaseError("objective.over", f"needs limits that hold there too: [limits] over = '{over}'", over)
        return self.objective.minimise is None  # a number of the actuators is that of all these poses by itself

    def _has_limits_over(self, poses: str) -> bool:
        """Return whether limits hold over the workspace, or along the path."""
        return self.limits is not None and self.limits.over == poses

    def read_workspace(self, units: Units) -> Workspace | None:
        """Return the workspace that the document states, over which its limits may hold; None where it states none.

        Args:
            units: the document's units.

        Raises:
            CaseError: the axis of its rotations is zero, or limits hold over a workspace that is not stated.
        """
        has_limits = self._has_limits_over("workspace")
        if self.workspace is not None:
            return self.workspace.read(units, has_limits=has_limits)
        if has_limits:
            raise CaseError("limits.over", "needs the table [workspace], which states the poses", "workspace")
        return None

    def read_path(self, folder: str, units: Units) -> PathFile | None:
        """Return the programmed path that the document states, along which its limits may hold; None without one.

        Args:
            folder: of the document, beside which the path's file is.
            units: the document's units.

        Raises:
            CaseError: limits hold along a path that is not stated.
        """
        has_limits = self._has_limits_over("path")
        if self.path is not None:
            return self.path.read(folder, units, has_limits=has_limits)
        if has_limits:
            raise CaseError("limits.over", "needs the table [path], which names its file", "path")
        return None

    def read_tasks(self, tasks: Sequence[Task]) -> list[Task]:
        """Return the tasks, that of a number of the actuators in the place of F of a motion.

        Args:
            tasks: those that the document states.
        """
        if self.objective is None or self.objective.minimise is None:
            return list(tasks)
        if not tasks:
            return [Task.minimise(self.objective.minimise)]
        return [replace(task, measure=self.objective.minimise) for task in tasks]

    def read_loading(self, units: Units) -> Loading:
        """Return the loads, the motions and the gravity that the document states, and the actuators' stiffness.

        Args:
            units: the document's units.
        """
        found, stiffness = NO_LOADING, self.robot.actuator_stiffness
        if self.load or self.motion is not None or self.gravity is not None:
            from .loadtables import loading_of  # noqa: PLC0415 - a case without them starts without their tables

            found = loading_of(self.load, self.motion, self.gravity, units)
        if stiffness is None:
            return found
        return found._replace(stiffness=stiffness if isinstance(stiffness, dict) else {"": stiffness})
