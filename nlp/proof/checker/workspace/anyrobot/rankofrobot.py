"""The claim that a robot's J, or its constraint wrenches alone, keep their rank, built from the case."""

from __future__ import annotations

from casadi import SX

from ......models import Model
from .....case.case import Case
from .....errors import UncoveredError
from ....statement.claims import CONSTRAINTS
from ...proof_file import ProofError
from ..poseroot import PoseRoot
from .assembly import Assembly
from .looppoints import needed_equations, start_of
from .motionclaim import MotionClaim
from .motions import free_motions, locked_motions
from .posedrobot import posed_robot


def rank_claim(case: Case, model: Model, root: PoseRoot, name: str) -> MotionClaim:
    """Return the claim about boxes of poses.

    Loop equations that hold at all closed points by themselves are left out. That is found by their ranks at a few
    points: where it is wrong, the claim is about more than the closed loops, and says more.

    Args:
        case: with fixed dimensions.
        model: its robot without unknowns that follow in closed form.
        root: the box of coordinates.
        name: ``regular``, or ``constraints regular``.

    Raises:
        ProofError: no closed loops are found in the middle of the workspace, they are singular there or leave a joint
            free, or an expression has an operation without a rule.
    """
    robot = posed_robot(case, model, root)
    start = start_of(robot)
    needed = needed_equations(robot, start)
    try:
        assembly = Assembly(robot, robot.equations[needed] if needed else SX(0, 1), start)
        motions = free_motions(model, robot, start) if name == CONSTRAINTS else locked_motions(model, robot, start)
        return MotionClaim(robot, motions, assembly)
    except UncoveredError as error:
        raise ProofError(f"the check has no rule for {error}") from None
