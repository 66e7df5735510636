"""Verdicts on a workspace as a result: the types and their construction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ...models.statics import driven_joints
from ..case.loads import NO_LOADING
from ..case.motors import MotorNumber
from ..case.task import Sense
from ..proof.statement.claims import ACTUATED
from ..proof.statement.machine import has_straight_legs
from ..proof.workspace.verdict import Outcome
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector, Vector3, finite_or_none, vector
from ..units import Units
from .objective import unit_of_claim
from .parts import HeadData, SettingsData, VersionsData, settings_data
from .point import head_data, versions

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.overrides import Settings
    from ..proof.statement.machine import JointErrors
    from ..proof.workspace.judge import Judgement
    from ..proof.workspace.numbers.extremes import Extreme
    from ..proof.workspace.robot.pose_box import PoseNumbers
    from ..proof.workspace.scale import Scale
    from ..proof.workspace.verdict import RankVerdict
    from ..solver.semi_infinite import WorkspaceProof

#: Outcomes, the worst one last.
_WORSE = (Outcome.PROVED, Outcome.OPEN, Outcome.REFUTED)


class WorkspacePose(JsonObject):
    """A pose of the platform.

    Attributes:
        position: origin of the platform frame in the world frame.
        axis: unit axis of the rotation; z without rotation.
        angle: about it.
    """

    position: Vector3
    axis: Vector3
    angle: float


class CentreData(JsonObject):
    """Error of a joint centre.

    Attributes:
        joint: label of the joint, limb and place, or leg and plate.
        error: in the world frame at home, or in that of the leg's plate, length.
    """

    joint: str
    error: Vector3


class MachineData(JsonObject):
    """Errors of the joint centres of a machine.

    Attributes:
        base: of the base joints of six straight legs, in the world frame, length; absent for another robot.
        platform: of their platform joints, in the platform frame, length; absent for another robot.
        centres: of another robot; absent for six straight legs.
    """

    base: Absent[tuple[Vector3, ...]]
    platform: Absent[tuple[Vector3, ...]]
    centres: Absent[tuple[CentreData, ...]]


class RegularData(JsonObject):
    """Verdict on the claim that J has full rank at every pose.

    Attributes:
        outcome: ``proved``; ``refuted``, with a singular pose; ``open``, with the middle of the widest box that is
            left.
        pose: that pose; absent where the claim is proved.
        between: two poses at which the determinant of the rows is proved to have opposite signs; absent where the
            claim is not refuted so.
        boxes: number of boxes examined.
        open: number of boxes left.
        share: part of the box of poses in boxes that are left.
        seconds: wall time.
        engine: ``c``, or ``none`` where no search was made.
        reason: for stopping early, or how a singular pose was found that is not between two; absent without one.
        machine: that is singular at the pose; absent where the claim is not refuted, or the exact machine is.
    """

    outcome: Outcome
    pose: Absent[WorkspacePose]
    between: Absent[tuple[WorkspacePose, ...]]
    boxes: int
    open: int
    share: float
    seconds: float
    engine: str
    reason: Absent[str]
    machine: Absent[MachineData]


class ExtremeData(JsonObject):
    """The smallest or the largest value of a number over the workspace.

    Attributes:
        name: of the number.
        unit: of its values; empty for a plain number.
        sense: whether the smallest or the largest value is meant.
        bound: proven: no pose has a smaller, or larger, value; null where nothing is proved.
        reached: the smallest or largest value known; null without one.
        key: dotted key, below ``limits``, of the limit in the case; absent without one.
        limit: the limit; absent without one.
        outcome: of the limit, or, without one, of the gap asked for.
        pose: at which the value is reached; null without one.
        boxes: number of boxes examined.
        seconds: wall time.
        reason: for an open outcome; absent without one.
        machine: that reaches the value at the pose; absent for the exact machine.
    """

    name: str
    unit: str
    sense: Sense
    bound: float | None
    reached: float | None
    key: Absent[str]
    limit: Absent[float]
    outcome: Outcome
    pose: WorkspacePose | None
    boxes: int
    seconds: float
    reason: Absent[str]
    machine: Absent[MachineData]


class MotorEndData(JsonObject):
    """The smallest or the largest value of a number of an actuator.

    Attributes:
        bound: proven: no pose has a smaller, or larger, value; null where nothing is proved.
        reached: the smallest or largest value known; null without one.
        outcome: of the limit, or, without one, of the gap.
        limit: the limit; absent without one.
        pose: at which the value is reached; null without one.
    """

    bound: float | None
    reached: float | None
    outcome: Outcome
    limit: Absent[float]
    pose: WorkspacePose | None


class MotorData(JsonObject):
    """A number of an actuator over the workspace.

    Attributes:
        actuator: its name.
        number: its coordinate, the length of a leg for one; its force, or torque, positive in the sense of its rate;
            its speed, or its power, the larger one of both senses of the force.
        unit: of the values.
        load: name of the loads; absent for a number that depends on none.
        smallest: smallest value; absent of speeds and powers.
        largest: largest value.
    """

    actuator: str
    number: MotorNumber
    unit: str
    load: Absent[str]
    smallest: Absent[MotorEndData]
    largest: MotorEndData


class ScaleData(JsonObject):
    """The largest factor by which the box of poses can grow about its centre with everything proved.

    Attributes:
        factor: everything is proved for the box that is larger by this factor; null where no such factor was found.
        refuted: the smallest factor known at which something is refuted; null where there is none.
        claim: the claim that is refuted there, or that stays open; empty without one.
        pose: at which it is refuted; null without one.
        reason: why the search ended before the factor was known to 1 %; absent where it is.
    """

    factor: float | None
    refuted: float | None
    claim: str
    pose: WorkspacePose | None
    reason: Absent[str]


class WorkspaceResult(JsonObject):
    """Result of judging a machine over its workspace.

    Attributes:
        head: the case.
        parameters: dimensions by name; three numbers for a point or direction.
        settings: numbers that replaced those of the case file, such as a limit, by the names of ``--set``; absent
            without any, and in results of earlier versions.
        joint_centre: every claim is about all machines whose joint centres are off by at most this; absent where it is
            about the exact machine alone.
        proved: whether J is regular at every pose, and every limit holds; numbers without a limit are information.
        poses: the set of poses that the verdicts are about, in words; absent without dependent coordinates.
        dependent: names of the coordinates of the pose that follow from the others; absent without any.
        regular: whether J has full rank at every pose.
        constraints: whether the constraint wrenches alone keep their rank at every pose; absent for a robot without.
        extremes: smallest and largest values; those of actuators under loads where they have a limit.
        motors: numbers of actuators; absent for a case without loads and motions.
        scale: the largest box; absent where it was not asked for.
        versions: of the programs.
    """

    head: Inline[HeadData]
    parameters: Mapping[str, float | Vector]
    settings: Absent[SettingsData]
    joint_centre: Absent[float]
    proved: bool
    poses: Absent[str]
    dependent: Absent[tuple[str, ...]]
    regular: RegularData
    constraints: Absent[RegularData]
    extremes: tuple[ExtremeData, ...]
    motors: Absent[tuple[MotorData, ...]]
    scale: Absent[ScaleData]
    versions: VersionsData


class BindingData(JsonObject):
    """A pose at which a claim is a constraint of the program.

    Attributes:
        claim: that the pose refuted.
        pose: the pose.
    """

    claim: str
    pose: WorkspacePose


class DesignData(JsonObject):
    """A design on the way to the proven one.

    Attributes:
        F: of the design.
        unproved: number of claims about the workspace that it does not keep, or that stay open.
    """

    F: float
    unproved: int


class WorkspaceProofData(JsonObject):
    """Proof of a design over its workspace, by exchange of poses.

    Attributes:
        proved: whether J is regular at every pose, and every limit holds there.
        joint_centre: the proof is about all machines whose joint centres are off by at most this; absent where it is
            about the exact machine alone.
        tighter: part of themselves by which the program's limits at the poses are tighter than the case's;
            absent in results of earlier versions.
        designs: each design that was judged; the last is the answer.
        poses: of the constraints.
        regular: whether J has full rank at every pose.
        extremes: smallest and largest values.
    """

    proved: bool
    joint_centre: Absent[float]
    tighter: Absent[float]
    designs: tuple[DesignData, ...]
    poses: tuple[BindingData, ...]
    regular: RegularData
    extremes: tuple[ExtremeData, ...]


def proof_data(proof: "WorkspaceProof | None") -> WorkspaceProofData | None:
    """Return the proof of a solved design as a result."""
    if proof is None:
        return None
    judged = proof.judgement
    units = judged.case.units
    return WorkspaceProofData(
        proved=proof.is_proved,
        joint_centre=judged.case.joint_centre_tolerance,
        tighter=proof.tighter,
        designs=tuple(DesignData(F=F, unproved=count) for F, count in proof.history),
        poses=tuple(BindingData(claim=each.name, pose=pose_data(each.pose, units)) for each in proof.poses),
        regular=_regular_data(judged.regularity, judged.case),
        extremes=tuple(_extreme_data(each, judged.case) for each in judged.extremes),
    )


def workspace_of(
    judged: "Judgement", scale: ScaleData | None = None, settings: "Settings | None" = None
) -> WorkspaceResult:
    """Return the verdicts on a robot over its workspace as a result.

    Args:
        judged: the verdicts.
        scale: the largest proved box; None where no search for it was made.
        settings: numbers that replaced those of the case file; None without any.
    """
    case = judged.case
    parameters: dict[str, float | Vector] = {}
    for item in case.model.parameters:
        values = tuple(case.units.shown(_fixed(value), item.dimension) for value in case.components(item.name))
        parameters[item.name] = values[0] if len(values) == 1 else values
    return WorkspaceResult(
        head=head_data(case),
        parameters=parameters,
        settings=settings_data(settings or {}),
        joint_centre=case.joint_centre_tolerance,
        proved=judged.is_proved,
        poses=poses_of(judged),
        dependent=judged.workspace.dependent_names or None,
        regular=_regular_data(judged.regularity, case),
        constraints=None if judged.constraints is None else _regular_data(judged.constraints, case),
        extremes=tuple(_extreme_data(each, case) for each in judged.extremes if each.motor is None or each.key),
        motors=tuple(_motors(judged)) or None,
        scale=scale,
        versions=versions(),
    )


def poses_of(judged: "Judgement") -> str | None:
    """Return the set of poses that a judgement is about, in words; None without dependent coordinates."""
    workspace = judged.workspace
    return f"every {workspace.set_words(judged.case.units)}" if workspace.dependent else None


def _motors(judged: "Judgement") -> Iterator[MotorData]:
    """Yield the numbers of each actuator, for a case with loads or motions."""
    case = judged.case
    if case.loading == NO_LOADING:
        return
    found: dict[tuple[MotorNumber, str, str], list[Extreme]] = {}
    for each in judged.extremes:
        if each.motor is not None:
            found.setdefault((each.motor.number, each.motor.actuator, each.motor.load), []).append(each)
    for joint in driven_joints(case.model):
        names = [f"{measure} limb {joint.name}" for measure in ("leg_length", *ACTUATED)]
        own = {each.sense: each for each in judged.extremes if each.name in names}
        if len(own) == len(Sense):
            found[MotorNumber.COORDINATE, joint.name, ""] = list(own.values())
    order, names = list(MotorNumber), [joint.name for joint in driven_joints(case.model)]
    for key in sorted(found, key=lambda key: (names.index(key[1]), order.index(key[0]))):
        (what, actuator, load), every = key, found[key]
        ends = {sense: [each for each in every if each.sense is sense] for sense in Sense}
        yield MotorData(
            actuator=actuator,
            number=what,
            unit=case.units.label(every[0].dimension),
            load=load or None,
            smallest=_motor_end(ends[Sense.MIN], case) if ends[Sense.MIN] else None,
            largest=_motor_end(ends[Sense.MAX], case),
        )


def _motor_end(parts: "Sequence[Extreme]", case: "Case") -> MotorEndData:
    """Return an end of a number of an actuator: the farthest of its parts, and the worst of their outcomes."""
    every = [_extreme_data(each, case) for each in parts]
    farthest = max(parts, key=lambda each: each.sense.sign * each.reached if math.isfinite(each.reached) else -math.inf)
    shown = every[list(parts).index(farthest)]
    bounds = [each.bound for each in every]
    sign = farthest.sense.sign
    return MotorEndData(
        bound=None if None in bounds else sign * max(sign * each for each in bounds if each is not None),
        reached=shown.reached,
        outcome=max((each.outcome for each in every), key=_WORSE.index),
        limit=shown.limit,
        pose=shown.pose,
    )


def scale_data(found: "Scale", units: Units) -> ScaleData:
    """Return the largest proven workspace in a case's units."""
    return ScaleData.of(
        found,
        refuted=found.failed if found.refuted else None,
        pose=None if found.pose is None else pose_data(found.pose, units),
        reason=found.reason or None,
    )


def pose_data(pose: "PoseNumbers", units: Units) -> WorkspacePose:
    """Return a pose in a case's units."""
    return WorkspacePose.of(pose, angle=units.shown(pose.angle, Dimension.ANGLE))


def _fixed(value: object) -> float:
    """Return a fixed number."""
    if not isinstance(value, float):
        raise TypeError("a judged machine has fixed dimensions")
    return value


def _regular_data(found: "RankVerdict", case: "Case") -> RegularData:
    """Return the verdict on regularity."""
    sides = None
    if found.sides is not None:
        sides = tuple(pose_data(found.box.pose(y), case.units) for y in found.sides)
    return RegularData.of(
        found,
        pose=None if found.pose is None else pose_data(found.pose, case.units),
        between=sides,
        reason=found.reason or None,
        machine=_machine_data(found.errors, case),
    )


def _machine_data(errors: "JointErrors | None", case: "Case") -> MachineData | None:
    """Return the errors of a machine; None for the exact one. Lengths are in the case's unit already."""
    if errors is None:
        return None
    each = tuple(map(vector, errors.vectors))
    if has_straight_legs(case.model):
        return MachineData(base=each[::2], platform=each[1::2], centres=None)
    centres = tuple(CentreData(joint=name, error=error) for name, error in zip(errors.names, each, strict=True))
    return MachineData(base=None, platform=None, centres=centres)


def _extreme_data(each: "Extreme", case: "Case") -> ExtremeData:
    """Return an extreme in a case's units."""
    units = case.units

    def shown(value: float) -> float | None:
        return units.shown(value, each.dimension) if math.isfinite(value) else finite_or_none(value)

    return ExtremeData.of(
        each,
        unit=unit_of_claim(case, each.name, each.dimension),
        bound=shown(each.bound),
        reached=shown(each.reached),
        key=each.key or None,
        limit=None if each.limit is None else units.shown(each.limit, each.dimension),
        pose=None if each.pose is None else pose_data(each.pose, units),
        reason=each.reason or None,
        machine=_machine_data(each.errors, case),
    )
