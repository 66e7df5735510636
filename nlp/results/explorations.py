"""Results of a Pareto front and of a sweep; a sweep is stored by columns."""

from collections.abc import Mapping
from typing import TypeAlias

from ..case.task import Sense
from ..evidence.optimality import PointKind
from ..solver.status import Status
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector
from .data import CertificateData
from .parts import HeadData, VersionsData


class FrontGoalData(JsonObject):
    """Goal of a front.

    Attributes:
        name: ``F:TASK`` or ``limits.KEY``.
        sense: sense of the goal: maximised or minimised.
        unit: unit of its values; empty for a plain number.
    """

    name: str
    sense: Sense
    unit: str


class FrontPointData(JsonObject):
    """Point of a front: the optimum of one goal, with bounds on the other goals.

    Attributes:
        goals: value of each goal, by name.
        optimised: name of the optimised goal.
        bounds: bounds on the other goals, by name; empty for the optimum of one goal without such bounds.
        status: status of the solve.
        design: variables of the case, by name.
        active: active bounds and limits.
        multipliers: multipliers of the active bounds and limits, in the optimised goal per unit.
        kind: kind of the point, such as strict local maximum; null for a case without variables.
        stationarity: largest scaled derivative of the Lagrangian; null without evidence.
        feasibility: largest distance outside a limit, in half ranges; null without evidence.
        certificate: proved bound; null if no proof was requested.
    """

    goals: Mapping[str, float]
    optimised: str
    bounds: Mapping[str, float]
    status: Status
    design: Mapping[str, float]
    active: tuple[str, ...]
    multipliers: tuple[float, ...]
    kind: PointKind | None
    stationarity: float | None
    feasibility: float | None
    certificate: CertificateData | None


class FrontResult(JsonObject):
    """Result of a search of a front.

    Attributes:
        head: the case.
        notice: notice that limits over a workspace or path are taken at the stated pose only; otherwise absent.
        front: the goals.
        points: nondominated points, from the worst to the best value of the first goal.
        gaps: for two goals, indices of points after which the front has a gap.
        failed: number of searches without an optimum.
        versions: versions of the software.
        seconds: wall time.
    """

    head: Inline[HeadData]
    notice: Absent[str]
    front: tuple[FrontGoalData, ...]
    points: tuple[FrontPointData, ...]
    gaps: tuple[int, ...]
    failed: int
    versions: VersionsData
    seconds: float


#: Values of the points; null if a point has no value.
Numbers: TypeAlias = tuple[float | None, ...]


class SweepResult(JsonObject):
    """Result of a sweep, by columns: each column has one entry for each point.

    Attributes:
        head: case at the first point.
        notice: notice that limits over a workspace are taken at the stated pose only, for points of the compiled
            engine; otherwise absent.
        unit: unit of F; empty if tasks have different units.
        numbers: values of each varied parameter, by name.
        statuses: status of each solve; "refused" if the case contradicts itself.
        F: objective, or value of the combination of several tasks.
        design: values of each variable, by name.
        actives: active bounds and limits of each design.
        multipliers: multipliers of the active bounds and limits.
        verdicts: kind of each point.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest distance outside a bound or limit, in half ranges.
        curvature: smallest eigenvalue of the reduced Hessian.
        starts: number of searches.
        converged: number of converged searches.
        engines: engine that solved the point.
        times: wall time, seconds.
        notes: reasons for refusals.
        certificates: status of each proof; absent if no proof was requested.
        bounds: proved bounds of F; absent if no proof was requested.
        gaps: distances of the bounds from F; absent if no proof was requested.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    notice: Absent[str]
    unit: str
    numbers: Mapping[str, Vector]
    statuses: tuple[str, ...]
    F: Numbers
    design: Mapping[str, Numbers]
    actives: tuple[tuple[str, ...], ...]
    multipliers: tuple[Vector, ...]
    verdicts: tuple[str, ...]
    stationarity: Numbers
    feasibility: Numbers
    curvature: Numbers
    starts: tuple[int, ...]
    converged: tuple[int, ...]
    engines: tuple[str, ...]
    times: Numbers
    notes: tuple[str, ...]
    certificates: Absent[tuple[str, ...]]
    bounds: Absent[Numbers]
    gaps: Absent[Numbers]
    versions: VersionsData
