"""The claim that a robot's J, or its constraint wrenches alone, keep their rank, built from the case."""

from __future__ import annotations

from .....models.joints.closedform import closed_form
from ....case.case import Case
from ....certificate.paper.proof import ProofError
from ....errors import UncoveredError
from ...claims import CONSTRAINTS
from ..pieces import BoxClaim
from ..poseroot import PoseRoot
from .motionclaim import MotionClaim
from .motions import free_motions, locked_motions
from .posedrobot import posed_robot


def rank_claim(case: Case, root: PoseRoot, name: str) -> BoxClaim:
    """Return the claim about boxes of poses.

    Loop equations without an unknown are left out: what holds at every pose of a box holds at those with closed loops.

    Args:
        case: with fixed dimensions.
        root: the box of coordinates.
        name: ``regular``, or ``constraints regular``.

    Raises:
        ProofError: the robot has unknowns without a closed form, or an expression has an operation without a rule.
    """
    model = closed_form(case.model).model
    if model.unknowns:
        raise ProofError("the robot has loops that are not solved in closed form")
    robot = posed_robot(case, model, root)
    start = robot.centre
    motions = free_motions(model, robot, start) if name == CONSTRAINTS else locked_motions(robot, start)
    try:
        return MotionClaim(robot, motions)
    except UncoveredError as error:
        raise ProofError(f"the check has no rule for {error}") from None
