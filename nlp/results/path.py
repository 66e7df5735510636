"""Verdicts on a programmed path as a result: the types and their construction."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...models.statics import driven_joints
from ..case.pathfile import PLACE
from ..case.task import Sense
from ..proof.statement.claims import ACTUATED
from ..proof.workspace.numbers.extremes import Extreme
from ..proof.workspace.verdict import Outcome
from .jsondata import Absent, Inline, JsonObject
from .parts import HeadData, VersionsData
from .point import head_data, versions
from .workspace import BindingData, DesignData, WorkspacePose, pose_data

if TYPE_CHECKING:
    from ..proof.workspace.path_judge import PathJudgement, RankOnPath
    from ..solver.over_path import PathProof


class PathFaultData(JsonObject):
    """A point of a path that refutes a claim.

    Attributes:
        value: of the number there; null of a rank.
        line: line of the file, or row of a table, of the segment.
        segment: its index, from 0.
        parameter: along the segment, from 0 to 1.
        pose: there.
    """

    value: float | None
    line: int
    segment: int
    parameter: float
    pose: WorkspacePose


class PathClaimData(JsonObject):
    """A claim about every point of a path.

    Attributes:
        name: the claim.
        unit: of its values; absent of a rank.
        sense: whether the smallest or the largest value is meant; absent of a rank.
        limit: the limit; absent without one.
        outcome: of the limit or the rank, or, without a limit, of the gap.
        bound: proven: no point has a smaller, or larger, value; null where nothing is proved, and of a rank.
        reached: the smallest or largest value known; null without one, and of a rank.
        line: line of the file, or row of a table, of the segment that reaches it, or that refutes or leaves open a
            rank; null where none is known.
        segment: its index, from 0.
        parameter: along the segment, from 0 to 1.
        pose: there.
        reason: for an open outcome, or how a singular pose was found; absent without one.
        fault: the first point known, in the order of the path, that refutes the claim; absent of other outcomes.
    """

    name: str
    unit: Absent[str]
    sense: Absent[Sense]
    limit: Absent[float]
    outcome: Outcome
    bound: float | None
    reached: float | None
    line: int | None
    segment: int | None
    parameter: float | None
    pose: WorkspacePose | None
    reason: Absent[str]
    fault: Absent[PathFaultData]


class PathActuatorData(JsonObject):
    """Coordinate of an actuator along a path.

    Attributes:
        actuator: its name.
        unit: of its coordinate.
        smallest: proven smallest value; null where nothing is proved.
        largest: proven largest value; null where nothing is proved.
    """

    actuator: str
    unit: str
    smallest: float | None
    largest: float | None


class IdleData(JsonObject):
    """A word of a program that moves nothing, or a line that is no part of the path.

    Attributes:
        word: the word, or what is left out.
        line: the first line that has it.
        lines: number of lines that have it.
    """

    word: str
    line: int
    lines: int


class PathData(JsonObject):
    """A path and the claims about it.

    Attributes:
        file: its name.
        segments: their number.
        idle: what moves nothing, in the order of the lines.
        claims: ranks first.
        actuators: of the robot.
    """

    file: str
    segments: int
    idle: tuple[IdleData, ...]
    claims: tuple[PathClaimData, ...]
    actuators: tuple[PathActuatorData, ...]


class PathResult(JsonObject):
    """Result of judging a machine along a path.

    Attributes:
        head: the case.
        proved: whether all ranks and limits are proved at every point.
        path: the path.
        versions: of the programs.
    """

    head: Inline[HeadData]
    proved: bool
    path: PathData
    versions: VersionsData


class PlaceData(JsonObject):
    """Place of a path's frame in the world.

    Attributes:
        x: first coordinate of its origin.
        y: second coordinate.
        z: third coordinate.
        roll: first turn, about the world's x.
        pitch: second turn, about the world's y.
        yaw: third turn, about the world's z.
    """

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float


class PathProofData(JsonObject):
    """Proof of a design along its path, by exchange of poses.

    Attributes:
        proved: whether all ranks and limits are proved at every point.
        joint_centre: the proof is about all machines whose joint centres are off by at most this; absent where it is
            about the exact machine alone.
        tighter: part of themselves by which the program's limits at the poses are tighter than the case's.
        designs: each design that was judged; the last is the answer.
        poses: of the constraints.
        file: name of the path's file.
        segments: their number.
        place: of the path's frame.
        claims: ranks first.
    """

    proved: bool
    joint_centre: Absent[float]
    tighter: float
    designs: tuple[DesignData, ...]
    poses: tuple[BindingData, ...]
    file: str
    segments: int
    place: PlaceData
    claims: tuple[PathClaimData, ...]


def path_result(judged: "PathJudgement") -> PathResult:
    """Return the verdicts as a result."""
    return PathResult(
        head=head_data(judged.case),
        proved=judged.is_proved,
        path=PathData(
            file=judged.path.source,
            segments=len(judged.path),
            idle=tuple(IdleData.of(each) for each in judged.path.idle),
            claims=_claims(judged),
            actuators=tuple(_actuators(judged)),
        ),
        versions=versions(),
    )


def path_proof_data(proof: "PathProof") -> PathProofData:
    """Return the proof of a solved design as a result."""
    judged = proof.judgement
    units = judged.case.units
    return PathProofData(
        proved=proof.is_proved,
        joint_centre=judged.case.joint_centre_tolerance,
        tighter=proof.tighter,
        designs=tuple(DesignData(F=F, unproved=count) for F, count in proof.history),
        poses=tuple(BindingData(claim=each.name, pose=pose_data(each.pose, units)) for each in proof.poses),
        file=judged.path.source,
        segments=len(judged.path),
        place=PlaceData(
            **{
                name: units.shown(value, dimension)
                for (name, dimension), value in zip(PLACE.items(), proof.place, strict=True)
            }
        ),
        claims=_claims(judged),
    )


def _claims(judged: "PathJudgement") -> tuple[PathClaimData, ...]:
    """Return the claims, ranks first."""
    ranks = [_claim_data(each, judged) for each in judged.ranks]
    return (*ranks, *(_number_data(each, judged) for each in judged.extremes))


def _number_data(each: "Extreme", judged: "PathJudgement") -> PathClaimData:
    """Return a claim about a number in the case's units."""
    units = judged.case.units

    def shown(value: float | None) -> float | None:
        return units.shown(value, each.dimension) if value is not None and math.isfinite(value) else None

    return _claim_data(
        each,
        judged,
        unit=units.label(each.dimension),
        sense=each.sense,
        limit=shown(each.limit),
        bound=shown(each.bound),
        reached=shown(each.reached),
    )


def _claim_data(each: "RankOnPath | Extreme", judged: "PathJudgement", **values: object) -> PathClaimData:
    """Return a claim with its place, and the values of a number."""
    place = each.place if each.pose is not None else None
    none = dict.fromkeys(("unit", "sense", "limit", "bound", "reached"))
    return PathClaimData(
        name=each.name,
        outcome=each.outcome,
        line=None if place is None else int(judged.path.lines[place.segment]),
        segment=None if place is None else place.segment,
        parameter=None if place is None else place.parameter,
        pose=None if each.pose is None else pose_data(each.pose, judged.case.units),
        reason=each.reason or None,
        fault=_fault_data(each, judged) if each.outcome is Outcome.REFUTED else None,
        **(none | values),
    )


def _fault_data(each: "RankOnPath | Extreme", judged: "PathJudgement") -> PathFaultData | None:
    """Return the first point known that refutes a claim."""
    units, place, pose, value = judged.case.units, each.place, each.pose, None
    if isinstance(each, Extreme):
        place, value, pose = judged.faults.get((each.name, each.sense), (each.place, each.reached, each.pose))
        value = units.shown(value, each.dimension)
    if place is None or pose is None:
        return None
    return PathFaultData(
        value=value,
        line=int(judged.path.lines[place.segment]),
        segment=place.segment,
        parameter=place.parameter,
        pose=pose_data(pose, units),
    )


def _actuators(judged: "PathJudgement") -> Iterator[PathActuatorData]:
    """Yield the ranges of the actuators."""
    units = judged.case.units
    for joint in driven_joints(judged.case.model):
        names = [f"{measure} limb {joint.name}" for measure in ("leg_length", *ACTUATED)]
        ends = {each.sense: each.bound for each in judged.extremes if each.name in names}
        shown = {sense: units.shown(end, joint.dimension) for sense, end in ends.items() if math.isfinite(end)}
        if ends:
            yield PathActuatorData(
                actuator=joint.name,
                unit=units.label(joint.dimension),
                smallest=shown.get(Sense.MIN),
                largest=shown.get(Sense.MAX),
            )
