"""Results of a solve of one task, and of a combined solve of several tasks.

A failed solve has no ``F``: its last point is under ``reached``, so that it is not mistaken for an answer.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, TypeAlias

from ..case.task import Method, Sense
from ..evidence.margins import Margin
from ..evidence.optimality import Evidence, PointKind
from ..evidence.sensitivity import Sensitivity
from ..evidence.tolerance import ToleranceLoss
from ..program.relaxation import RelaxedLimit
from ..proof.certificate.certificate import CertificateStatus
from ..solver.status import Status
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector
from ..system.strictjson import Size
from .choices import ChoiceData, RoundingData
from .objective import ObjectiveData
from .parts import HeadData, LimitData, RobotData, VersionsData, ViolationData

if TYPE_CHECKING:
    from .path import PathProofData
    from .schedule import ScheduleData
    from .workspace import WorkspaceProofData


class ReachedData(JsonObject):
    """Best point of a failed solve.

    Attributes:
        F: objective at the point; null if it has no value.
        violated: violated bounds and constraints.
    """

    F: float | None
    violated: tuple[ViolationData, ...]


class OptimumData(JsonObject):
    """Distinct optimum.

    Attributes:
        F: objective.
        count: number of starts that ended at the optimum.
        spread: largest distance between the end points of these starts along a variable, divided by the variable's
            range; 0 for an isolated optimum.
        assembly: assembly mode in a few words, if it is not, or may not be, that of home; empty for the home mode,
            absent for a robot without loops.
    """

    F: float
    count: int
    spread: float
    assembly: Absent[str]


class StartsData(JsonObject):
    """Outcomes of the starts.

    Attributes:
        run: number of starts.
        converged: number of converged starts.
        failed: number of failed starts, by reason.
        optima: distinct optima, best first.
        better: F of a feasible point of an unconverged search that is better than every optimum; otherwise absent.
    """

    run: int
    converged: int
    failed: Mapping[str, int]
    optima: tuple[OptimumData, ...]
    better: Absent[float]


class CertificateData(JsonObject):
    """Proved bound of the global optimum.

    Attributes:
        status: status of the proof.
        bound: proved bound: no feasible point has a better objective; null if nothing is proved.
        incumbent: objective of the best known feasible point; null if no such point is known.
        gap: distance of the bound from the incumbent.
        relative_gap: gap divided by the incumbent; null if the incumbent is near 0.
        engine: engine of the search.
        boxes: number of boxes examined.
        open: number of undecided boxes.
        seconds: wall time.
        statement: proved statement in words.
        history: seconds, bound and incumbent during the search.
    """

    status: CertificateStatus
    bound: float | None
    incumbent: float | None
    gap: float | None
    relative_gap: float | None
    engine: str
    boxes: int
    open: int
    seconds: float
    statement: str
    history: tuple[Annotated[Vector, Size(3)], ...]


class SolveResult(JsonObject):
    """Result of solving one task.

    Attributes:
        head: the case.
        sense: sense of the optimisation: F is maximised or minimised.
        status: status of the solve.
        F: objective; null without an answer.
        objective: objective, if it is not F at the stated poses; otherwise absent.
        reached: best point of a failed solve; otherwise absent.
        relaxation: for an infeasible case, the limits that would have to change; otherwise absent.
        robot: robot at the point; absent if its loop equations have no solution.
        optimality: evidence of optimality; null for a case without variables.
        margins: margin of every limit at every leg, joint and pose.
        limits: limits of the case, one row for each limit.
        sensitivity: derivatives of the optimal F with respect to each fixed value; absent without an answer.
        tolerance: loss by joint-centre errors; absent without an answer or a tolerance.
        starts: outcomes of the starts.
        certificate: proved bound; null if no proof was requested.
        workspace: proof over the workspace; absent if no limit covers the workspace.
        path: proof along the path; absent if no limit covers the path.
        choice: choice among listed values; absent without listed values.
        rounding: rounding of the dimensions; absent if they are not rounded.
        schedule: values that change along the path, if F is optimised over the path; the robot is then that at the
            first point of the path. Otherwise absent.
        seed: random seed of the starting points.
        versions: versions of the software.
        seconds: wall time.
    """

    head: Inline[HeadData]
    sense: Sense
    status: Status
    F: float | None
    objective: Absent[ObjectiveData]
    reached: Absent[ReachedData]
    relaxation: Absent[tuple[RelaxedLimit, ...]]
    robot: Inline[RobotData | None]
    optimality: Evidence | None
    margins: tuple[Margin, ...]
    limits: tuple[LimitData, ...]
    sensitivity: Absent[tuple[Sensitivity, ...]]
    tolerance: Absent[ToleranceLoss]
    starts: StartsData
    certificate: CertificateData | None
    workspace: Absent["WorkspaceProofData"]
    path: Absent["PathProofData"]
    choice: Absent[ChoiceData]
    rounding: Absent[RoundingData]
    schedule: Absent["ScheduleData"]
    seed: int
    versions: VersionsData
    seconds: float


class OutcomeData(JsonObject):
    """Task at the combined point.

    Attributes:
        name: name of the task.
        sense: sense of the optimisation: F is maximised or minimised.
        weight: weight of the task in the combination.
        F: objective at the combined point; null without an answer.
        best: separate optimum of the task; null without a separate optimum.
        loss: loss of F against the separate optimum.
        relative_loss: loss divided by the separate optimum.
        unique: If true, the separate optimum is unique.
        verdict: kind of the combined point as a point of this task; null for a case without variables.
        rates: work rate of each row in the task's motion; null without an answer.
    """

    name: str
    sense: Sense
    weight: float
    F: float | None
    best: float | None
    loss: float | None
    relative_loss: float | None
    unique: bool
    verdict: PointKind | None
    rates: Vector | None


class ChangeData(JsonObject):
    """Gain by a dimension, or the pose, that changes from task to task.

    Attributes:
        name: name of the dimension; ``pose`` for the pose.
        gain: relative gain of the combined objective, compared with the same problem with the dimension or pose shared;
            null for an average, and without an answer.
        value_shared: combined objective with it shared; null for an average, and without an answer.
        F_shared: F of each task with it shared; null without an answer.
        reason: reason why this problem has no answer; otherwise absent.
    """

    name: str
    gain: float | None
    value_shared: float | None
    F_shared: Vector | None
    reason: Absent[str]


class CombinedPointData(JsonObject):
    """Combined point of several tasks.

    Attributes:
        robot: robot at the point; absent if its loop equations have no solution.
        margins: margin of every limit at every leg, joint and pose.
        limits: limits of the case, one row for each limit.
    """

    robot: Inline[RobotData | None]
    margins: Absent[tuple[Margin, ...]]
    limits: Absent[tuple[LimitData, ...]]


class CombinedData(JsonObject):
    """Combination of several tasks.

    Attributes:
        method: method of combination.
        value: value of the combined objective; null for an average, and without an answer.
        method_point: point of the method; absent without an answer.
        reached: last point of a method without an answer; otherwise absent.
        tasks: each task at the combined point.
        violated: names of the violated bounds and constraints.
        notices: notices for the reader.
        optimality: evidence of optimality for the combined program; null without such a program.
        starts: outcomes of the starts of the combined program; null without such a program.
        certificate: proved bound of the combined program; null if no proof was requested.
        settings: robot of each task, at the dimensions and the pose of the task; absent if nothing changes from task to
            task, and then the robot of the point is that of all tasks.
        changes: gain by each dimension or pose that changes from task to task; absent if nothing does.
    """

    method: Method
    value: float | None
    method_point: Inline[CombinedPointData | None]
    reached: Absent[CombinedPointData]
    tasks: tuple[OutcomeData, ...]
    violated: tuple[str, ...]
    notices: tuple[str, ...]
    optimality: Evidence | None
    starts: StartsData | None
    certificate: CertificateData | None
    settings: Absent[tuple[RobotData, ...]]
    changes: Absent[tuple[ChangeData, ...]]

    @property
    def point(self) -> CombinedPointData | None:
        """Combined point, even if it is not an answer."""
        return self.reached if self.method_point is None else self.method_point


class CombinedResult(JsonObject):
    """Result of solving several tasks.

    Attributes:
        head: the case.
        status: status of the whole solve.
        tasks: results of the separate solves.
        combined: combination of the tasks.
        choice: choice among listed values; absent without listed values.
        rounding: rounding of the dimensions; absent if they are not rounded.
        workspace: proof of the combined design over the workspace; absent if no limit covers the workspace.
        path: proof of the combined design along the path; absent if no limit covers the path.
        versions: versions of the software.
        seconds: wall time.
    """

    head: Inline[HeadData]
    status: Status
    tasks: tuple[SolveResult, ...]
    combined: CombinedData
    choice: Absent[ChoiceData]
    rounding: Absent[RoundingData]
    workspace: Absent["WorkspaceProofData"]
    path: Absent["PathProofData"]
    versions: VersionsData
    seconds: float

    @property
    def F(self) -> float | None:  # noqa: N802 - the objective's name
        """Value of the combined objective."""
        return self.combined.value

    @property
    def robot(self) -> RobotData | None:
        """Robot at the combined point, even without an answer; None if the loop equations have no solution."""
        return None if self.combined.point is None else self.combined.point.robot

    @property
    def margins(self) -> tuple[Margin, ...]:
        """Margin of every limit at every leg, joint and pose of the combined point."""
        return () if self.combined.point is None else self.combined.point.margins or ()

    @property
    def limits(self) -> tuple[LimitData, ...]:
        """Limits of the case at the combined point, one row for each limit."""
        return () if self.combined.point is None else self.combined.point.limits or ()


#: Result of solving a case, of one task or of several.
CaseResult: TypeAlias = SolveResult | CombinedResult
