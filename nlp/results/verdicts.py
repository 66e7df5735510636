"""Verdicts on ranks and quantities, over a workspace or along a path, as a result."""

from typing import TYPE_CHECKING, Annotated, Any

from ..case.task import Sense
from ..evidence.state import WorkspacePose
from ..proof.enclosure.engine import ENGINE
from ..proof.statement.fixed_robot import has_straight_legs
from ..proof.workspace.robot.pose_box import pose_box
from ..proof.workspace.verdict import Outcome
from ..system.jsonvalues import Absent, JsonObject, Mark, Measure, Vector3, vector
from ..units import Units
from .objective import unit_of_claim

if TYPE_CHECKING:
    from ..case.case import Case
    from ..proof.statement.fixed_robot import JointErrors
    from ..proof.workspace.judgement import Judgement
    from ..proof.workspace.robot.pose_box import PoseNumbers
    from ..proof.workspace.verdict import Verdict


class CentreData(JsonObject):
    """Error of a joint centre.

    Attributes:
        joint: label of the joint, limb and place, or leg and plate.
        error: error in the world frame at home, or in the frame of the leg's plate, length.
    """

    joint: str
    error: Vector3


class JointErrorsData(JsonObject):
    """Joint-centre errors of a robot within the tolerance.

    Attributes:
        base: errors of the base joints of six straight legs, in the world frame, length; absent for another robot.
        platform: errors of their platform joints, in the platform frame, length; absent for another robot.
        centres: errors of the joint centres of another robot; absent for six straight legs.
    """

    base: Absent[tuple[Vector3, ...]]
    platform: Absent[tuple[Vector3, ...]]
    centres: Absent[tuple[CentreData, ...]]


class RegularData(JsonObject):
    """Verdict on the claim that J has full rank at every pose.

    Attributes:
        outcome: ``proved``; ``refuted``, with a singular pose; ``open`` (undecided), with the centre of the widest
            undecided box.
        pose: singular pose, or centre of the widest undecided box; absent if the claim is proved.
        between: two poses at which the determinant of the rows is proved to have opposite signs; absent if the
            claim is not refuted in this way.
        boxes: number of boxes examined.
        open: number of undecided boxes.
        share: volume of the undecided boxes, as a fraction of the box of poses.
        seconds: wall time.
        engine: ``c``, or ``none`` where no search was made.
        reason: reason for an early end, or method of a singular pose that is not between two poses; otherwise absent.
        machine: joint-centre errors of the singular robot; absent if the claim is not refuted, or the exact robot is
            singular.
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
    machine: Absent[JointErrorsData]


class VerdictData(JsonObject):
    """Verdict on a claim about every pose of a workspace or path: a rank, or an extreme value of a quantity.

    Attributes:
        name: name of the claim.
        unit: unit of the values; empty for a plain number, absent for a rank.
        sense: smallest or largest value; absent for a rank.
        bound: proved bound: no pose has a smaller, or larger, value; null if nothing is proved, or for a rank.
        reached: smallest or largest known value; null if no value is known, and for a rank.
        key: dotted key, below ``limits``, of the limit in the case; absent without a limit.
        limit: the limit; absent without one.
        outcome: outcome of the limit or rank; for a quantity without a limit, ``proved`` if the gap was reached.
        pose: pose with the value, singular pose, or centre of the widest undecided box of a rank; null if no pose is
            known.
        boxes: number of examined boxes; absent in results of earlier versions along a path.
        seconds: wall time; absent in results of earlier versions along a path.
        reason: reason for an open outcome, or how a singular pose was computed; otherwise absent.
        machine: joint-centre errors of the robot that has the value at the pose; absent for the exact robot.
    """

    name: str
    unit: Absent[str]
    sense: Absent[Sense]
    bound: Annotated[float | None, Measure.NUMBER]
    reached: Annotated[float | None, Measure.NUMBER]
    key: Absent[str]
    limit: Annotated[float | None, Mark.ABSENT, Measure.NUMBER]
    outcome: Outcome
    pose: WorkspacePose | None
    boxes: Absent[int]
    seconds: Absent[float]
    reason: Absent[str]
    machine: Absent[JointErrorsData]


def pose_data(pose: "PoseNumbers", units: Units) -> WorkspacePose:
    """Return a pose in a case's units."""
    return WorkspacePose.of(pose, units)


def rank_data(found: "Verdict", judged: "Judgement") -> RegularData:
    """Return the verdict on a rank over a workspace."""
    case, sides = judged.case, None
    if found.sides is not None:
        box = pose_box(judged.workspace)
        sides = tuple(pose_data(box.pose(y), case.units) for y in found.sides)
    return RegularData.of(
        found,
        pose=None if found.pose is None else pose_data(found.pose, case.units),
        between=sides,
        engine=ENGINE if found.boxes else "none",
        machine=joint_errors_data(found.errors, case),
    )


def joint_errors_data(errors: "JointErrors | None", case: "Case") -> JointErrorsData | None:
    """Return the joint-centre errors of a robot; None for the exact robot. Lengths are in the case's unit already."""
    if errors is None:
        return None
    each = tuple(map(vector, errors.vectors))
    if has_straight_legs(case.model):
        return JointErrorsData(base=each[::2], platform=each[1::2], centres=None)
    centres = tuple(CentreData(joint=name, error=error) for name, error in zip(errors.names, each, strict=True))
    return JointErrorsData(base=None, platform=None, centres=centres)


def verdict_data(each: "Verdict", case: "Case") -> VerdictData:
    """Return a verdict in a case's units."""
    return VerdictData.of(each, case.units, **posed_fields(each, case))


def posed_fields(each: "Verdict", case: "Case") -> dict[str, Any]:
    """Return the fields of a verdict that depend on its kind and robot, by name, in the units of the case."""
    return {
        "unit": None if each.is_rank else unit_of_claim(case, each.name, each.dimension),
        "sense": None if each.is_rank else each.sense,
        "pose": None if each.pose is None else pose_data(each.pose, case.units),
        "machine": joint_errors_data(each.errors, case),
    }
