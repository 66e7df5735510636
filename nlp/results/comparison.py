"""Robots compared on one case as data."""

from collections.abc import Mapping
from typing import Annotated, Literal

from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from ..solver.status import Status
from ..system.jsonvalues import Absent, JsonObject
from ..system.strictjson import Size
from .data import CertificateData
from .parts import SchemaVersion, UnitsData, VersionsData


class ComparedRateData(JsonObject):
    """The rate of an actuator for a task.

    Attributes:
        actuator: its name.
        unit: of the rate, per unit of the task's motion.
        rate: for the task's motion; null where the motion does not determine it, because the actuator can move while
            the platform stands still.
    """

    actuator: str
    unit: str
    rate: float | None


class ComparedTaskData(JsonObject):
    """A task at a robot's design.

    Attributes:
        name: of the task.
        F: objective; null without an answer.
        unit: of F.
        can_move: whether the platform can make the motion at the first pose; null where it is not known.
        constraint: part of F that constraints carry, 0 to 1; null where it is not known.
        rates: of the actuators.
    """

    name: str
    F: float | None
    unit: str
    can_move: bool | None
    constraint: float | None
    rates: tuple[ComparedRateData, ...]


class ComparedDimensionData(JsonObject):
    """A dimension of a robot's design.

    Attributes:
        name: of the number.
        value: in the design.
        unit: of the value.
        range: smallest and largest value that was allowed; absent for a fixed number.
    """

    name: str
    value: float
    unit: str
    range: Absent[Annotated[tuple[float, ...], Size(2)]]


class ComparedLimitData(JsonObject):
    """A limit of the case that a robot cannot have.

    Attributes:
        key: dotted key in the case file.
        reason: a clause.
    """

    key: str
    reason: str


class ComparedStrokeData(JsonObject):
    """The largest stroke of a measure over the workspace, or over the poses of a case with several.

    Attributes:
        stroke: of the limb that needs the largest; over a workspace from proven bounds.
        unit: of the stroke.
    """

    stroke: float
    unit: str


class ComparedRobotData(JsonObject):
    """A robot of a comparison.

    Attributes:
        name: in tables.
        model: name of the robot.
        description: of the robot.
        part: of the table: ``ranked``, ``limits not kept`` where the robot does not keep every limit of the case,
            ``no freedom`` where the platform cannot make a task's motion, or ``no answer``.
        factor: by which typical lengths are multiplied.
        size: largest distance between two points at home, typical dimensions times the factor.
        final_size: largest distance between two points of the design; null without an answer.
        freedoms: of the platform; null where they are not known.
        status: of the solve; null where the case contradicts itself with this robot.
        value: F of one task, or the value of the combination of several; null without an answer.
        sense: whether the value is maximised or minimised.
        tasks: each task at the design; empty without an answer.
        dimensions: of the design; empty without an answer.
        active: bounds and limits that the design lies on.
        singularities: clauses about the design.
        limits_kept: number of the case's limits that hold for this robot.
        limits_left_out: limits that this robot cannot have.
        certificate: the proven bound; null without one.
        certificate_fault: reason why there is no certificate; absent where none was asked for, or there is one.
        workspace: verdict on the design over the workspace; null where it is not judged.
        strokes: largest strokes, by measure: over the workspace, else over the poses of a case with several.
        sentences: about what is missing or cannot be compared.
        case: the case with this robot as the text of a case file; null where no file can state it.
        seconds: wall time.
    """

    name: str
    model: str
    description: str
    part: Literal["ranked", "limits not kept", "no freedom", "no answer"]
    factor: float
    size: float
    final_size: float | None
    freedoms: int | None
    status: Status | None
    value: float | None
    sense: Sense
    tasks: tuple[ComparedTaskData, ...]
    dimensions: tuple[ComparedDimensionData, ...]
    active: tuple[str, ...]
    singularities: tuple[str, ...]
    limits_kept: int
    limits_left_out: tuple[ComparedLimitData, ...]
    certificate: CertificateData | None
    certificate_fault: Absent[str]
    workspace: Outcome | None
    strokes: Mapping[str, ComparedStrokeData]
    sentences: tuple[str, ...]
    case: str | None
    seconds: float


class ComparisonResult(JsonObject):
    """Result of a comparison of robots.

    Attributes:
        schema: version of the result's keys.
        case: name of the case.
        title: of the case.
        units: of every number.
        limits: number of limits of the case.
        size: to which the robots are scaled; null where they are not scaled.
        range: part of a typical dimension by which a design may differ from it.
        characteristic_length: by which couples count beside forces.
        robots: ranked ones first, the best first.
        sentences: about the whole comparison.
        versions: of the programs.
        seconds: wall time.
    """

    schema: SchemaVersion
    case: str
    title: str
    units: UnitsData
    limits: int
    size: float | None
    range: float
    characteristic_length: float
    robots: tuple[ComparedRobotData, ...]
    sentences: tuple[str, ...]
    versions: VersionsData
    seconds: float
