"""The robot at one pose of its workspace."""

from __future__ import annotations

from ....models import Dimension
from ...case.case import Case
from ...case.pose import Rotation
from ...errors import CaseError, EvaluationError
from ...evidence.closing import closed_start
from ...evidence.state import evaluate
from ...program.formulation import formulate_each
from ...proof.statement.posed_layout import at_one_pose
from ...proof.workspace.verdict import Outcome
from ...results.workspaceposes import PosedClaim
from .drawing import Drawing, drawing_of


def drawing_at(case: Case, claim: PosedClaim) -> Drawing:
    """Return the robot at the pose of a claim, with the case's first task.

    Args:
        case: with fixed dimensions.
        claim: the claim and the pose, in the case's units.

    Raises:
        EvaluationError: the robot does not exist at the pose, or it is that of another machine within the tolerance.
    """
    pose = claim.pose
    angle = case.units.to_internal(pose.angle, Dimension.ANGLE)
    posed = at_one_pose(case, tuple(pose.position), Rotation(tuple(pose.axis), angle))
    try:
        nlp = formulate_each(posed)[0]
    except CaseError:
        if case.joint_centre_tolerance is None:
            raise
        # Numbers of the pose that follow from others are those of the machine: the design's loops do not close there.
        raise EvaluationError("the worst pose is that of a machine within the tolerance, not of the design") from None
    x = closed_start(nlp)
    headline = f"{claim.outcome.value}: {claim.words}"
    return drawing_of(nlp, x, evaluate(nlp, x), headline=headline, is_answer=claim.outcome is not Outcome.REFUTED)
