"""Verdicts on a programmed path as a result: the types and their construction."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension
from ...models.statics import driven_joints
from ..case.pathfile import PLACE
from ..case.task import Sense
from ..evidence.state import WorkspacePose
from ..path.idle import Idle
from ..proof.statement.claims import ACTUATED
from ..system.jsonvalues import Absent, Inline, JsonObject
from .exchange import ExchangeData, exchange_fields
from .parts import HeadData, SettingsData, VersionsData, settings_data
from .pathtable import knot_motion
from .point import head_data, versions
from .verdicts import VerdictData, pose_data, posed_fields

if TYPE_CHECKING:
    from ..case.overrides import Settings
    from ..proof.workspace.judgement import Judgement
    from ..proof.workspace.path_knots import Knots
    from ..proof.workspace.verdict import Fault, Verdict
    from ..solver.semi_infinite import ExchangeProof
    from ..units import Units


class PathFaultData(JsonObject):
    """A point of a path that refutes a claim.

    Attributes:
        value: value of the number at this point; null of a rank.
        line: line of the file, or row of a table, of the segment.
        segment: its index, from 0.
        parameter: along the segment, from 0 to 1.
        pose: pose of the platform at this point.
    """

    value: float | None
    line: int
    segment: int
    parameter: float
    pose: WorkspacePose


class PathVerdictData(VerdictData):
    """Verdict on a claim about every point of a path.

    Attributes:
        line: line of the file, or row of a table, of the segment with the pose; null where none is known.
        segment: index of this segment, from 0.
        parameter: parameter along it, from 0 to 1.
        fault: first known point, in the order of the path, that refutes the claim; absent of other outcomes.
    """

    line: int | None
    segment: int | None
    parameter: float | None
    fault: Absent[PathFaultData]


class PathActuatorData(JsonObject):
    """Numbers of an actuator along a path.

    Attributes:
        actuator: its name.
        unit: unit of its coordinate.
        smallest: proven smallest coordinate; null where nothing is proved.
        largest: proven largest coordinate.
        speed: proven largest speed, in this unit by seconds, in the path's motion where it states times; absent without
            such.
        acceleration: largest size of the change of its speed between knots, by the square of seconds; absent without
            knots or times.
    """

    actuator: str
    unit: str
    smallest: float | None
    largest: float | None
    speed: Absent[float]
    acceleration: Absent[float]


class PathKnotsData(JsonObject):
    """Knots of a path, of which a table has the coordinates of the actuators.

    Attributes:
        number: number of knots.
        closed: number of knots that the robot reaches.
        within: largest distance asked for between the path and the platform's origin, as actuators move linearly from
            knot to knot; absent where steps were asked for.
        deviation: the proven largest distance; absent where none was asked for, and null where none is proved.
        reason: for which none is proved; absent otherwise.
    """

    number: int
    closed: int
    within: Absent[float]
    deviation: float | None
    reason: Absent[str]


class PathData(JsonObject):
    """A path and the claims about it.

    Attributes:
        file: its name.
        segments: their number.
        time: seconds of the segments whose time is stated; absent where none is.
        untimed: number of the others, of which speeds are not known; absent where no time is stated.
        idle: words of the program without a motion, in the order of the lines.
        dependent: names of the coordinates of the pose that follow from the others; absent without any.
        claims: ranks first.
        actuators: ranges of the actuators.
        knots: knots of the table of actuators; absent where none is requested.
    """

    file: str
    segments: int
    time: Absent[float]
    untimed: Absent[int]
    idle: tuple[Idle, ...]
    dependent: Absent[tuple[str, ...]]
    claims: tuple[PathVerdictData, ...]
    actuators: tuple[PathActuatorData, ...]
    knots: Absent[PathKnotsData]


class PathResult(JsonObject):
    """Result of judging a machine along a path.

    Attributes:
        head: the case.
        settings: numbers that replaced those of the case file, such as a limit, by the names of ``--set``; absent
            without any, and in results of earlier versions.
        proved: whether all ranks and limits are proved at every point.
        path: the path.
        versions: versions of the programs.
    """

    head: Inline[HeadData]
    settings: Absent[SettingsData]
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


class PathProofData(ExchangeData):
    """Proof of a design along its path, by exchange of poses.

    Attributes:
        file: name of the path's file.
        segments: number of its segments.
        place: place of the path's frame.
        claims: verdicts, ranks first.
    """

    file: str
    segments: int
    place: PlaceData
    claims: tuple[PathVerdictData, ...]


def path_result(judged: "Judgement", settings: "Settings | None" = None) -> PathResult:
    """Return the verdicts on a path as a result.

    Args:
        judged: the verdicts.
        settings: numbers that replaced those of the case file; None without any.
    """
    return PathResult(
        head=head_data(judged.case),
        settings=settings_data(settings or {}),
        proved=judged.is_proved,
        path=PathData(
            file=judged.path.source,
            segments=len(judged.path),
            time=judged.path.time if judged.path.is_timed else None,
            untimed=len(judged.path.untimed) if judged.path.is_timed else None,
            idle=judged.path.idle,
            dependent=judged.dependent or None,
            claims=_claims(judged),
            actuators=tuple(_actuators(judged)),
            knots=None if judged.knots is None else _knots_data(judged.case.units, judged.knots),
        ),
        versions=versions(),
    )


def path_proof_data(proof: "ExchangeProof") -> PathProofData:
    """Return the proof of a solved design as a result."""
    judged = proof.judgement
    place = zip(PLACE.items(), proof.place, strict=True)
    return PathProofData(
        **exchange_fields(proof),
        file=judged.path.source,
        segments=len(judged.path),
        place=PlaceData(**{name: judged.case.units.shown(value, dimension) for (name, dimension), value in place}),
        claims=_claims(judged),
    )


def _claims(judged: "Judgement") -> tuple[PathVerdictData, ...]:
    """Return the verdicts, ranks first."""
    return tuple(_verdict(each, judged) for each in judged.verdicts)


def _verdict(each: "Verdict", judged: "Judgement") -> PathVerdictData:
    """Return a verdict with its place."""
    place, fault = each.place if each.pose is not None else None, each.first_fault
    return PathVerdictData.of(
        each,
        judged.case.units,
        **posed_fields(each, judged.case),
        line=None if place is None else int(judged.path.lines[place.segment]),
        segment=None if place is None else place.segment,
        parameter=None if place is None else place.parameter,
        fault=None if fault is None else _fault(each, fault, judged),
    )


def _fault(each: "Verdict", fault: "Fault", judged: "Judgement") -> PathFaultData:
    """Return the first known point that refutes a claim."""
    units = judged.case.units
    return PathFaultData(
        value=None if each.is_rank else units.shown(fault.value, each.dimension),
        line=int(judged.path.lines[fault.place.segment]),
        segment=fault.place.segment,
        parameter=fault.place.parameter,
        pose=pose_data(fault.pose, units),
    )


def _knots_data(units: "Units", knots: "Knots") -> PathKnotsData:
    """Return the knots of a table."""
    within, deviation = (
        None if each is None else units.shown(each, Dimension.LENGTH) for each in (knots.within, knots.deviation)
    )
    return PathKnotsData(
        number=len(knots.segments),
        closed=int(np.isfinite(knots.coordinates).all(axis=1).sum()),
        within=within,
        deviation=deviation,
        reason=knots.reason or None,
    )


def _actuators(judged: "Judgement") -> Iterator[PathActuatorData]:
    """Yield the ranges of the actuators."""
    units, accelerations = judged.case.units, dict[str, float]()
    if judged.knots is not None and judged.path.is_timed:
        sizes = np.nan_to_num(np.abs(knot_motion(judged.path, judged.knots).accelerations)).max(axis=0)
        accelerations = dict(zip(judged.knots.actuators, sizes.tolist(), strict=True))
    for joint in driven_joints(judged.case.model):
        names = [f"{measure} limb {joint.name}" for measure in ("leg_length", *ACTUATED)]
        ends = {each.sense: each.bound for each in judged.extremes if each.name in names}
        shown = {sense: units.shown(end, joint.dimension) for sense, end in ends.items() if math.isfinite(end)}
        name = f"actuator_speed actuator {joint.name}"
        speeds = [each for each in judged.extremes if each.name == name and judged.path.is_timed]
        speed = next((units.shown(each.bound, each.dimension) for each in speeds if math.isfinite(each.bound)), None)
        acceleration = accelerations.get(joint.name)
        if ends or speeds or acceleration is not None:
            yield PathActuatorData(
                actuator=joint.name,
                unit=units.label(joint.dimension),
                smallest=shown.get(Sense.MIN),
                largest=shown.get(Sense.MAX),
                speed=speed,
                acceleration=None if acceleration is None else units.shown(acceleration, joint.dimension),
            )
