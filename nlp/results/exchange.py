"""Proof of a solved design by exchange of poses as a result, over a workspace or along a path."""

from typing import TYPE_CHECKING, Any

from ..evidence.state import WorkspacePose
from ..system.jsonvalues import Absent, JsonObject
from .verdicts import pose_data

if TYPE_CHECKING:
    from ..solver.semi_infinite import ExchangeProof


class BindingData(JsonObject):
    """Pose at which a claim was added as a constraint of the nonlinear program.

    Attributes:
        claim: name of the claim that the pose refuted.
        pose: the pose.
    """

    claim: str
    pose: WorkspacePose


class DesignData(JsonObject):
    """Design of an iteration.

    Attributes:
        F: F of the design.
        unproved: number of claims that are refuted or undecided for the design.
    """

    F: float
    unproved: int


class ExchangeData(JsonObject):
    """Proof of a design, by exchange of poses.

    Attributes:
        proved: If true, all ranks and limits are proved at every pose.
        joint_centre: joint-centre tolerance: the proof covers every robot within this tolerance; absent for the exact
            robot.
        tighter: relative safety margin of the added constraints; absent in results of earlier versions.
        designs: designs of the iterations; the last one is the answer.
        poses: poses of the added constraints.
    """

    proved: bool
    joint_centre: Absent[float]
    tighter: Absent[float]
    designs: tuple[DesignData, ...]
    poses: tuple[BindingData, ...]


def exchange_fields(proof: "ExchangeProof") -> dict[str, Any]:
    """Return the fields of a proof by exchange of poses, by name."""
    case = proof.judgement.case
    return {
        "proved": proof.is_proved,
        "joint_centre": case.joint_centre_tolerance,
        "tighter": proof.tighter,
        "designs": tuple(DesignData(F=F, unproved=count) for F, count in proof.history),
        "poses": tuple(BindingData(claim=each.name, pose=pose_data(each.pose, case.units)) for each in proof.poses),
    }
