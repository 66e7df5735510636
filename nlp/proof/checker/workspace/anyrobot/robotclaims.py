"""Claims about a robot that is not six straight legs alone: its constraint wrenches, and the reach of its limbs."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from ......models import Model, WrenchKind
from ......models.joints import RobotError
from ......models.joints.closedform import closed_form
from .....case.case import Case
from .....case.workspace import Workspace
from .....program.layout import Layout
from ....statement.claims import CONSTRAINTS
from ....statement.machine import legs_of
from ....statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..expected import ExpectedClaim
from ..poseroot import pose_root
from ..tolerance import Machines


class RobotClaims(NamedTuple):
    """Claims about a robot over a workspace.

    Attributes:
        layout: the case as symbols of the pose in which its numbers are bounded: without the unknowns that follow in
            closed form, where all limbs reach every pose.
        model: the robot without these unknowns, over whose poses its ranks are claimed.
        more: claims about constraint wrenches and reach; none about six straight legs.
        numbers_at: assemblies that its numbers are about, in words; empty for a robot without unknowns.
        machines: every machine within the tolerance, in whose symbols the numbers and ``more`` are then; None where
            the design is meant, or machines cannot be put together.
    """

    layout: Layout
    model: Model
    more: tuple[ExpectedClaim, ...]
    numbers_at: str = ""
    machines: Machines | None = None


def robot_claims(case: Case, workspace: Workspace, reached: Collection[str]) -> RobotClaims:
    """Return the claims about a robot that is not six straight legs, and the symbols of its numbers.

    Args:
        case: with fixed dimensions.
        workspace: the poses.
        reached: names of those claims about reach that are proved.
    """
    machines = _machines(case, workspace)
    if machines is not None:
        constraints = [ExpectedClaim(CONSTRAINTS, "", "constraints")] if has_constraints(machines.model) else []
        reaches, _ = machines.symbols.claims(())
        more = [*constraints, *(ExpectedClaim(one.name, one.sense.value, "number", one.limit, one) for one in reaches)]
        home = "the assembly of home" if case.model.unknowns else ""
        return RobotClaims(machines.symbols.layout, machines.model, tuple(more), home, machines)
    if legs_of(case) is not None:
        return RobotClaims(posed_layout(case, workspace), case.model, ())
    closed = closed_form(case.model)
    more = [ExpectedClaim(CONSTRAINTS, "", "constraints")] if has_constraints(closed.model) else []
    layout = None
    if closed.reaches:
        reach = reach_claims(case, closed, workspace)
        own = [
            ExpectedClaim(each.name, each.sense.value, "number", each.limit, each, layout=reach.layout)
            for each in reach.claims
        ]
        more += own
        if all(each.name in reached for each in own):
            layout = closed_layout(case, closed, workspace)
    numbers_at = "every assembly" if case.model.unknowns else ""
    if layout is not None:
        partly = "every assembly in which limbs in closed form are as at home"
        numbers_at = partly if closed.model.unknowns else "the assembly of home"
    return RobotClaims(layout or posed_layout(case, workspace), closed.model, tuple(more), numbers_at)


def _machines(case: Case, workspace: Workspace) -> Machines | None:
    """Return every machine within the case's tolerance; None for the design, or where machines are not known."""
    if not case.joint_centre_tolerance:
        return None
    try:
        return Machines(case, closed_form(case.model).model, workspace, pose_root(workspace))
    except RobotError:
        return None


def has_constraints(model: Model) -> bool:
    """Return whether a robot has constraint wrenches, of which a rank is claimed."""
    if model.generic is not None:
        return 0 < model.generic.constraints < 6
    return not model.members and any(row.kind is WrenchKind.COUPLE for row in model.wrenches)
