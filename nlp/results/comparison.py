"""Result of a comparison of robots on one case."""

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
    """Rate of an actuator for a task.

    Attributes:
        actuator: name of the actuator.
        unit: unit of the rate, per unit of the task's motion.
        rate: rate for the task's motion; null if the motion does not determine the rate, because the actuator can
            move while the platform stands still.
    """

    actuator: str
    unit: str
    rate: float | None


class ComparedTaskData(JsonObject):
    """Task at a robot's design.

    Attributes:
        name: name of the task.
        F: objective; null without an answer.
        unit: unit of F.
        can_move: If true, the platform can make the motion at the first pose; null if unknown.
        constraint: fraction of F from constraint wrenches, 0 to 1; null if unknown.
        rates: rates of the actuators.
    """

    name: str
    F: float | None
    unit: str
    can_move: bool | None
    constraint: float | None
    rates: tuple[ComparedRateData, ...]


class ComparedDimensionData(JsonObject):
    """Dimension of a robot's design.

    Attributes:
        name: name of the dimension.
        value: value in the design.
        unit: unit of the value.
        range: lower and upper bound; absent for a fixed dimension.
    """

    name: str
    value: float
    unit: str
    range: Absent[Annotated[tuple[float, ...], Size(2)]]


class ComparedLimitData(JsonObject):
    """Limit of the case that does not apply to a robot.

    Attributes:
        key: dotted key in the case file.
        reason: reason, as a clause.
    """

    key: str
    reason: str


class ComparedStrokeData(JsonObject):
    """Largest stroke of an actuator quantity over the workspace, or over the poses of a case with several poses.

    Attributes:
        stroke: largest stroke of a limb; over a workspace from proved bounds.
        unit: unit of the stroke.
    """

    stroke: float
    unit: str


class ComparedRobotData(JsonObject):
    """Robot of a comparison.

    Attributes:
        name: name in tables.
        model: name of the robot.
        description: description of the robot.
        part: section of the table: ``ranked``, ``limits not kept`` if the robot violates a limit of the case,
            ``no freedom`` where the platform cannot make a task's motion, or ``no answer``.
        factor: scale factor of the typical lengths.
        size: largest distance between two points of the robot at home, with typical dimensions times ``factor``.
        final_size: largest distance between two points of the design; null without an answer.
        freedoms: degrees of freedom of the platform; null if unknown.
        status: status of the solve; null if the case contradicts itself with this robot.
        value: F of one task, or value of the combination of several tasks; null without an answer.
        sense: sense of the optimisation: the value is maximised or minimised.
        tasks: tasks at the design; empty without an answer.
        dimensions: dimensions of the design; empty without an answer.
        active: active bounds and limits.
        singularities: clauses about singularities of the design.
        limits_kept: number of the case's limits that the design satisfies; 0 without an answer.
        limits_left_out: limits that do not apply to the robot.
        certificate: proved bound; null without a proof.
        certificate_fault: reason why there is no certificate; absent with a certificate, or if none was requested.
        workspace: verdict on the design over the workspace; null without a verdict.
        strokes: largest stroke of each quantity over the workspace; without a workspace, over the poses of the case.
        sentences: sentences about missing or incomparable values.
        case: case with this robot, as the text of a case file; null if a case file cannot represent it.
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
        title: title of the case.
        units: units of all values.
        limits: number of limits of the case.
        size: common size of the robots; null if they are not scaled.
        range: largest relative difference between a dimension of a design and its typical value.
        characteristic_length: factor between couples and forces.
        robots: robots, ranked robots first, best first.
        sentences: sentences about the whole comparison.
        versions: versions of the software.
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
