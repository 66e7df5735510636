"""Results of a solve: of one task, and of several tasks combined.

A solve that failed has no ``F``: the point reached is under ``reached``, so that nobody takes it for an answer.
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
    from .workspace import WorkspaceProofData


class ReachedData(JsonObject):
    """The best point of a solve that failed.

    Attributes:
        F: objective there; null where it has no value.
        violated: bounds and constraints that the point lies outside of.
    """

    F: float | None
    violated: tuple[ViolationData, ...]


class OptimumData(JsonObject):
    """A distinct optimum.

    Attributes:
        F: objective.
        count: number of starts that ended there.
        spread: of the points along one variable, as a part of its range; 0 for an isolated optimum.
        assembly: a few words about joints that are assembled in another way than at home, or perhaps; empty for home's,
            absent for a robot without loops.
    """

    F: float
    count: int
    spread: float
    assembly: Absent[str]


class StartsData(JsonObject):
    """Outcome of the starts.

    Attributes:
        run: number of starts.
        converged: number of those that converged.
        failed: number of the others, by reason.
        optima: distinct optima, best first.
        better: F within the limits that a search reached without converging, better than every optimum; else absent.
    """

    run: int
    converged: int
    failed: Mapping[str, int]
    optima: tuple[OptimumData, ...]
    better: Absent[float]


class CertificateData(JsonObject):
    """A proven bound of the global optimum.

    Attributes:
        status: of the proof.
        bound: no feasible point of the box has a better objective; null where nothing is known.
        incumbent: objective of the best point known.
        gap: distance of the bound from the incumbent.
        relative_gap: gap as a part of the incumbent; null near 0.
        engine: that examined the boxes.
        boxes: number of boxes examined.
        open: number of boxes left.
        seconds: wall time.
        statement: the proved statement in words.
        history: seconds, bound and incumbent on the way.
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
        sense: whether F is maximised or minimised.
        status: of the solve.
        F: objective; null unless the solve gave an answer.
        objective: what is optimised instead of F; absent for F.
        reached: the best point of a solve that failed; else absent.
        relaxation: for an infeasible case, the limits that would have to move; else absent.
        robot: at the point; absent where its equations have no value.
        optimality: evidence; null when nothing was free.
        margins: every limit at every leg, joint and pose.
        limits: one row for each limiting number of the case.
        sensitivity: of the optimal F to every fixed number; absent without an answer.
        tolerance: loss by inexact joint centres; absent without an answer or where the case has no tolerance.
        starts: outcome of the starts.
        certificate: the proven bound; null where none was asked for.
        workspace: proof over the workspace; absent where no limit holds there.
        path: proof along the path; absent where no limit holds there.
        choice: among listed values of dimensions; absent where the case has none.
        rounding: of the dimensions; absent where they are not rounded.
        seed: of the starting points.
        versions: of the programs.
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
    seed: int
    versions: VersionsData
    seconds: float


class OutcomeData(JsonObject):
    """A task at the combined point.

    Attributes:
        name: of the task.
        sense: whether F is maximised or minimised.
        weight: as it was used.
        F: objective at the combined point; null without an answer.
        best: optimum of the task alone; null where there is none.
        loss: how much worse F is than the optimum of the task alone.
        relative_loss: loss as a part of that optimum.
        unique: whether the task's own optimum is the only one.
        verdict: kind of point that the combined point is for this task alone; null where nothing is free.
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


class CombinedPointData(JsonObject):
    """The robot that several tasks were combined to.

    Attributes:
        robot: at the point; absent where its equations have no value.
        margins: every limit at every leg, joint and pose.
        limits: one row for each limiting number of the case.
    """

    robot: Inline[RobotData | None]
    margins: Absent[tuple[Margin, ...]]
    limits: Absent[tuple[LimitData, ...]]


class CombinedData(JsonObject):
    """Several tasks brought together.

    Attributes:
        method: how they were brought together.
        value: of the combined objective; null for an average, and without an answer.
        method_point: the point that the method yields; absent where it yields none.
        reached: the point reached where the method yields none; else absent.
        tasks: each task at the combined point.
        violated: names of the bounds and constraints that the combined point lies outside of.
        notices: for the reader.
        optimality: evidence about the combined program; null where there is none.
        starts: of the combined program; null where there is none.
        certificate: the proven bound of the combined program; null where there is none.
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

    @property
    def point(self) -> CombinedPointData | None:
        """The combined point, whether an answer or merely reached."""
        return self.reached if self.method_point is None else self.method_point


class CombinedResult(JsonObject):
    """Result of solving several tasks.

    Attributes:
        head: the case.
        status: of the whole.
        tasks: each task solved by itself.
        combined: the tasks brought together.
        choice: among listed values of dimensions; absent where the case has none.
        rounding: of the dimensions; absent where they are not rounded.
        workspace: proof of the combined design over the workspace; absent where no limit holds there.
        path: its proof along the path; absent where no limit holds there.
        versions: of the programs.
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
        """The robot at the combined point, an answer or merely reached; None where it does not exist."""
        return None if self.combined.point is None else self.combined.point.robot

    @property
    def margins(self) -> tuple[Margin, ...]:
        """Every limit at every leg, joint and pose of the combined point."""
        return () if self.combined.point is None else self.combined.point.margins or ()

    @property
    def limits(self) -> tuple[LimitData, ...]:
        """One row for each limiting number of the case at the combined point."""
        return () if self.combined.point is None else self.combined.point.limits or ()


#: Result of solving a case, of one task or of several.
CaseResult: TypeAlias = SolveResult | CombinedResult
