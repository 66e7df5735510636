"""Verdicts over a workspace as a result: types and construction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ...models.statics import driven_joints
from ..case.loads import NO_LOADING
from ..case.motors import ActuatorQuantity
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
    """Smallest or largest value of an actuator quantity.

    Attributes:
        bound: proved bound: no pose has a smaller, or larger, value; null if nothing is proved.
        reached: smallest or largest known value; null if unknown.
        outcome: outcome of the limit; without a limit, ``proved`` if the requested gap was reached.
        limit: the limit; absent without one.
        pose: pose with the known value; null if unknown.
    """

    bound: float | None
    reached: float | None
    outcome: Outcome
    limit: Absent[float]
    pose: WorkspacePose | None


class MotorData(JsonObject):
    """Actuator quantity over the workspace.

    Attributes:
        actuator: name of the actuator.
        number: quantity: coordinate, or length of a leg; force or torque, positive in the sense of the rate; speed; or
            power, the larger value of both senses of the force.
        unit: unit of the values.
        load: name of the loads; absent for a quantity that depends on no load.
        smallest: smallest value; absent for speeds and powers.
        largest: largest value.
    """

    actuator: str
    number: ActuatorQuantity
    unit: str
    load: Absent[str]
    smallest: Absent[MotorEndData]
    largest: MotorEndData


class ScaleData(JsonObject):
    """Largest factor by which the box of poses can grow about its centre so that all claims stay proved.

    Only the radius grows if the positions are a disc, ring, cylinder, ball or cone.

    Attributes:
        factor: largest factor with a proof; null if no box is proved.
        diameter: diameter of the largest proved set of positions, of the base for a cone; absent without a diameter.
        refuted: smallest known factor with a violated claim; null if unknown.
        claim: claim that is refuted or undecided for the next larger box; empty without one.
        pose: pose at which the claim is refuted; null without one.
        reason: reason for the end of the search before the factor was known to its accuracy; absent otherwise.
    """

    factor: float | None
    diameter: Absent[float]
    refuted: float | None
    claim: str
    pose: WorkspacePose | None
    reason: Absent[str]


class WorkspaceResult(JsonObject):
    """Result of verifying a robot over its workspace.

    Attributes:
        head: the case.
        parameters: dimensions by name; three numbers for a point or direction.
        settings: values that replaced those of the case file, such as a limit, by the names of ``--set``; absent
            without any, and in results of earlier versions.
        joint_centre: joint-centre tolerance: every claim covers all robots within this tolerance; absent for the exact
            robot.
        proved: If true, J has full rank at every pose, and every limit is satisfied. Quantities without a limit do not
            count.
        poses: set of poses that the verdicts cover, in words; absent for a box without dependent coordinates.
        dependent: names of the dependent coordinates of the pose; absent without any.
        regular: verdict on the full rank of J at every pose.
        constraints: verdict on the rank of the constraint wrenches at every pose; absent without constraint wrenches.
        extremes: smallest and largest values; of actuators under loads, only values with a limit.
        motors: actuator quantities; absent for a case without loads and motions.
        scale: largest proved box; absent if it was not requested.
        versions: versions of the software.
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
    """Proof of a solved design over its workspace.

    Attributes:
        regular: verdict on the full rank of J at every pose.
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
        scale: the largest proved box; None if no search for it was made.
        settings: values that replaced values of the case file; None without such values.
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
    """Return the set of poses that the verdicts cover, in words; None for a box without dependent coordinates."""
    workspace = judged.workspace
    is_box = not workspace.dependent and workspace.position_set is None
    return None if is_box else f"every {workspace.set_words(judged.case.units)}"


def _motors(judged: "Judgement") -> Iterator[MotorData]:
    """Yield the quantities of each actuator, for a case with loads or motions."""
    case = judged.case
    if case.loading == NO_LOADING:
        return
    found: dict[tuple[ActuatorQuantity, str, str], list[Verdict]] = {}
    for each in judged.extremes:
        if each.motor is not None:
            found.setdefault((each.motor.number, each.motor.actuator, each.motor.load), []).append(each)
    for joint in driven_joints(case.model):
        names = [f"{measure} limb {joint.name}" for measure in ("leg_length", *ACTUATED)]
        own = {each.sense: each for each in judged.extremes if each.name in names}
        if len(own) == len(Sense):
            found[ActuatorQuantity.COORDINATE, joint.name, ""] = list(own.values())
    order, names = list(ActuatorQuantity), [joint.name for joint in driven_joints(case.model)]
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
    """Return an extreme value of an actuator quantity over all load cases, with the worst outcome."""
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
    """Return the largest proved box in a case's units."""
    return ScaleData.of(
        found,
        diameter=None if found.positions is None else units.shown(2 * found.positions.radius, Dimension.LENGTH),
        refuted=found.failed if found.refuted else None,
        pose=None if found.pose is None else pose_data(found.pose, units),
        reason=found.reason or None,
    )


def _fixed(value: object) -> float:
    """Return a dimension as a number; refuse a free dimension."""
    if not isinstance(value, float):
        raise TypeError(f"a robot to be verified must have fixed dimensions, got {value!r}")
    return value
