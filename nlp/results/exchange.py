"""Proofs of solved designs by exchange of poses as a result: what those over a workspace and along a path share."""

from typing import TYPE_CHECKING, Any

from ..evidence.state import WorkspacePose
from ..system.jsonvalues import Absent, JsonObject
from .verdicts import pose_data

if TYPE_CHECKING:
    from ..solver.semi_infinite import ExchangeProof


class BindingData(JsonObject):
    """A pose at which a claim is a constraint of the program.

    Attributes:
        claim: claim that the pose refuted.
        pose: the pose.
    """

    claim: str
    pose: WorkspacePose


class DesignData(JsonObject):
    """A design on the way to the proven one.

    Attributes:
        F: F of the design.
        unproved: number of claims about the workspace that it does not keep, or that stay open.
    """

    F: float
    unproved: int


class ExchangeData(JsonObject):
    """Proof of a design, by exchange of poses.

    Attributes:
        proved: whether all ranks and limits are proved at every pose.
        joint_centre: the proof is about every robot whose joint centres are off by at most this; absent where it is
            about the exact robot.
        tighter: part of themselves by which the program's limits at the poses are tighter than the case's; absent in
            results of earlier versions.
        designs: each design that was judged; the last is the answer.
        poses: poses of the constraints.
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
