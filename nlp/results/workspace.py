"""Verdicts on a workspace as a result: the types and their construction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from ...models.statics import driven_joints
from ..case.loads import NO_LOADING
from ..case.motors import MotorNumber
from ..case.task import Sense
from ..evidence.state import WorkspacePose
from ..proof.statement.claims import ACTUATED
from ..proof.workspace.verdict import Outcome, Verdict
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector
from ..units import Units
from .exchange import ExchangeData, exchange_fields
from .parts import HeadData, SettingsData, VersionsData, settings_data
from .point import head_data, versions
from .verdicts import RegularData, VerdictData, pose_data, rank_data, verdict_data

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.overrides import Settings
    from ..proof.workspace.judgement import Judgement
    from ..proof.workspace.scale import Scale
    from ..solver.semi_infinite import ExchangeProof

#: Outcomes, the worst one last.
_WORSE = (Outcome.PROVED, Outcome.OPEN, Outcome.REFUTED)


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
    extremes: tuple[VerdictData, ...]
    motors: Absent[tuple[MotorData, ...]]
    scale: Absent[ScaleData]
    versions: VersionsData


class WorkspaceProofData(ExchangeData):
    """Proof of a design over its workspace, by exchange of poses.

    Attributes:
        regular: whether J has full rank at every pose.
        extremes: smallest and largest values.
    """

    regular: RegularData
    extremes: tuple[VerdictData, ...]


def proof_data(proof: "ExchangeProof | None") -> WorkspaceProofData | None:
    """Return the proof of a solved design as a result."""
    if proof is None:
        return None
    judged = proof.judgement
    return WorkspaceProofData(
        **exchange_fields(proof),
        regular=rank_data(judged.regularity, judged),
        extremes=tuple(verdict_data(each, judged.case) for each in judged.extremes),
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
        regular=rank_data(judged.regularity, judged),
        constraints=None if judged.constraints is None else rank_data(judged.constraints, judged),
        extremes=tuple(verdict_data(each, case) for each in judged.extremes if each.motor is None or each.key),
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
    found: dict[tuple[MotorNumber, str, str], list[Verdict]] = {}
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


def _motor_end(parts: "Sequence[Verdict]", case: "Case") -> MotorEndData:
    """Return an end of a number of an actuator: the farthest of its parts, and the worst of their outcomes."""
    every = [verdict_data(each, case) for each in parts]
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


def _fixed(value: object) -> float:
    """Return a fixed number."""
    if not isinstance(value, float):
        raise TypeError("a judged machine has fixed dimensions")
    return value
