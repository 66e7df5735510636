"""Claims about a robot that is not six straight legs alone: its constraint wrenches, and the reach of its limbs."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from ......models import Model, WrenchKind
from ......models.joints.closedform import closed_form
from .....case.case import Case
from .....case.workspace import Workspace
from .....program.layout import Layout
from ....statement.claims import CONSTRAINTS
from ....statement.machine import legs_of
from ....statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..expected import ExpectedClaim


class RobotClaims(NamedTuple):
    """Claims about a robot over a workspace.

    Attributes:
        layout: the case as symbols of the pose in which its numbers are bounded: without the unknowns that follow in
            closed form, where all limbs reach every pose.
        model: the robot without these unknowns, over whose poses its ranks are claimed.
        more: claims about constraint wrenches and reach; none about six straight legs.
        numbers_at: assemblies that its numbers are about, in words; empty for a robot without unknowns.
    """

    layout: Layout
    model: Model
    more: tuple[ExpectedClaim, ...]
    numbers_at: str = ""


def robot_claims(case: Case, workspace: Workspace, reached: Collection[str]) -> RobotClaims:
    """Return the claims about a robot that is not six straight legs, and the symbols of its numbers.

    Args:
        case: with fixed dimensions.
        workspace: the poses.
        reached: names of those claims about reach that are proved.
    """
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


def has_constraints(model: Model) -> bool:
    """Return whether a robot has constraint wrenches, of which a rank is claimed."""
    if model.generic is not None:
        return 0 < model.generic.constraints < 6
    return not model.members and any(row.kind is WrenchKind.COUPLE for row in model.wrenches)
