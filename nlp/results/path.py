"""Verdicts along a tool path as a result: types and construction."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension
from ...models.rotation import axis_angle_from_matrix
from ...models.statics import driven_joints
from ..case.pathfile import PLACE
from ..case.task import Sense
from ..evidence.state import WorkspacePose
from ..path.idle import Idle
from ..proof.statement.claims import ACTUATED
from ..proof.workspace.robot.pose_box import PoseNumbers
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

#: Distances along a segment, as parts of it, at which a violation is shown that is rounding error at its first point.
_FURTHER = (1e-3, 1e-2, 0.1, 1.0)


class PathFaultData(JsonObject):
    """Point of a path that refutes a claim.

    Attributes:
        value: value of the quantity at this point; null for a rank.
        line: line of the file, or row of a table, of the segment.
        segment: index of the segment, from 0.
        parameter: parameter along the segment, from 0 to 1.
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
        line: line of the file, or row of a table, of the segment with the pose; null if no pose is known.
        segment: index of this segment, from 0; null if no pose is known.
        parameter: parameter along this segment, from 0 to 1; null if no pose is known.
        fault: first known point of the path that refutes the claim; absent for another outcome.
    """

    line: int | None
    segment: int | None
    parameter: float | None
    fault: Absent[PathFaultData]


class PathActuatorData(JsonObject):
    """Range, speed and acceleration of an actuator along a path.

    Attributes:
        actuator: name of the actuator.
        unit: unit of the actuator coordinate.
        smallest: proved smallest coordinate; null if nothing is proved.
        largest: proved largest coordinate; null if nothing is proved.
        speed: proved largest speed in the motion of the path, unit per second; absent without times.
        acceleration: largest acceleration between knots, unit per second squared; absent without knots or times.
    """

    actuator: str
    unit: str
    smallest: float | None
    largest: float | None
    speed: Absent[float]
    acceleration: Absent[float]


class PathKnotsData(JsonObject):
    """Knots of a path: points at which a table has the actuator coordinates.

    Attributes:
        number: number of knots.
        closed: number of knots that the robot reaches.
        within: requested largest deviation of the platform's origin from the path, with linear actuator motion from
            knot to knot; absent if a step was requested.
        deviation: proved largest deviation; null if nothing is proved, or if a step was requested.
        reason: reason why no deviation is proved; absent otherwise.
    """

    number: int
    closed: int
    within: Absent[float]
    deviation: float | None
    reason: Absent[str]


class PathData(JsonObject):
    """Path and the claims about it.

    Attributes:
        file: name of the path's file.
        segments: number of segments.
        time: total time of the segments with a stated time, seconds; absent if no segment has a time.
        untimed: number of segments without a time, whose speeds are unknown; absent if no segment has a time.
        idle: words of the G-code without a motion, in the order of the lines.
        warnings: sentences about the file that a user has to know; absent without any.
        dependent: names of the dependent coordinates of the pose; absent without any.
        claims: verdicts, ranks first.
        actuators: ranges of the actuators.
        knots: knots of the table of actuators; absent if no table is requested.
    """

    file: str
    segments: int
    time: Absent[float]
    untimed: Absent[int]
    idle: tuple[Idle, ...]
    warnings: Absent[tuple[str, ...]]
    dependent: Absent[tuple[str, ...]]
    claims: tuple[PathVerdictData, ...]
    actuators: tuple[PathActuatorData, ...]
    knots: Absent[PathKnotsData]


class PathResult(JsonObject):
    """Result of verifying a robot along a tool path.

    Attributes:
        head: the case.
        settings: values that replaced those of the case file, such as a limit, by the names of ``--set``; absent
            without any, and in results of earlier versions.
        proved: If true, all ranks and limits are proved at every point.
        path: the path and its claims.
        versions: versions of the software.
    """

    head: Inline[HeadData]
    settings: Absent[SettingsData]
    proved: bool
    path: PathData
    versions: VersionsData


class PlaceData(JsonObject):
    """Placement of a path's frame in the world.

    Attributes:
        x: x coordinate of the frame's origin.
        y: y coordinate of the frame's origin.
        z: z coordinate of the frame's origin.
        roll: first rotation, about the world's x.
        pitch: second rotation, about the world's y.
        yaw: third rotation, about the world's z.
    """

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float


class PathProofData(ExchangeData):
    """Proof of a solved design along its path.

    Attributes:
        file: name of the path's file.
        segments: number of segments of the path.
        place: placement of the path's frame.
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
        settings: values that replaced values of the case file; None without such values.
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
            warnings=judged.path.warnings or None,
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
    """Return a verdict with its line and path parameter."""
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


def violating_poses(judged: "Judgement", claim: PathVerdictData) -> Iterator[WorkspacePose]:
    """Yield poses that refute a claim: the first known one, some further along its segment, and the worst known one.

    The first pose is at the limit, where the violation may count as rounding error. With dependent coordinates, poses
    along the segment are left out, because the path does not state them.

    Args:
        judged: the verdicts.
        claim: one of them.
    """
    fault = claim.fault
    if fault is not None:
        yield fault.pose
    if fault is not None and not judged.dependent:
        parts = sorted({min(fault.parameter + each, 1.0) for each in _FURTHER} - {fault.parameter})
        for position, rotation in zip(*judged.path.poses_at([fault.segment] * len(parts), parts), strict=True):
            axis, angle = axis_angle_from_matrix(rotation)
            yield pose_data(PoseNumbers(position, rotation, axis, angle), judged.case.units)
    if claim.pose is not None:
        yield claim.pose


def _knots_data(units: "Units", knots: "Knots") -> PathKnotsData:
    """Return the summary of the knots: their number, the number of reached knots, and the proved deviation."""
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
