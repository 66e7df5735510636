"""Fronts of several goals and sweeps, column by column, as data."""

from collections.abc import Mapping
from typing import TypeAlias

from ..case.task import Sense
from ..evidence.optimality import PointKind
from ..solver.status import Status
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector
from .data import CertificateData
from .parts import HeadData, VersionsData


class FrontGoalData(JsonObject):
    """A goal of a front.

    Attributes:
        name: ``F:TASK`` or ``limits.KEY``.
        sense: whether it is maximised or minimised.
        unit: of its numbers; empty for a plain number.
    """

    name: str
    sense: Sense
    unit: str


class FrontPointData(JsonObject):
    """A point of a front: the optimum of one goal within bounds of the others.

    Attributes:
        goals: number of each goal, by name.
        optimised: name of the goal whose optimum the point is.
        bounds: that the other goals keep, by name; empty for the optimum of one goal alone.
        status: of the solve.
        design: the free numbers of the case, by name.
        active: sides of bounds and limits that the design lies on.
        multipliers: of the active sides, in the optimised goal per unit.
        kind: of point, by the evidence; null where nothing is free.
        stationarity: largest scaled derivative of the Lagrangian; null without evidence.
        feasibility: largest distance outside a limit, in half ranges; null without evidence.
        certificate: the proven bound; null where none was asked for.
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
        notice: that the limits are taken at the stated pose alone, where the case has them over its workspace; else
            absent.
        front: the goals.
        points: none of which is better than another in all goals, in the order of the first goal, its best value last.
        gaps: of two goals, indices of the points that no point was found between it and the next.
        failed: number of searches that found no optimum.
        versions: of the programs.
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


#: A number for each point; null where there is none.
Numbers: TypeAlias = tuple[float | None, ...]


class SweepResult(JsonObject):
    """Result of a sweep: one entry for each point in each column.

    Attributes:
        head: the case at the first point.
        notice: that limits are taken at the stated pose alone, where the case has them over its workspace and the
            compiled engine solved points; else absent.
        unit: of F; empty where tasks do not agree in it.
        numbers: values of each number that changes, by name.
        statuses: of each solve; "refused" where the case contradicts itself.
        F: objective, or the value of the combination of several tasks.
        design: values of each free number, by name.
        actives: sides of bounds and limits that each design lies on.
        multipliers: of the active sides.
        verdicts: kind of each point.
        stationarity: largest scaled derivative of the Lagrangian.
        feasibility: largest distance outside a side, in half ranges.
        curvature: smallest eigenvalue of the reduced Hessian.
        starts: number of searches.
        converged: number of searches that converged.
        engines: whose point it is.
        times: wall time, seconds.
        notes: reasons of refusals.
        certificates: status of each proof; absent where none was asked for.
        bounds: proven bounds of F; absent likewise.
        gaps: distances of the bounds from F; absent likewise.
        versions: of the programs.
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
