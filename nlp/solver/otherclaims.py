"""Claims at poses of a robot that is not six straight legs, as they are added to its program in an exchange."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models import FloatArray
from ...models.joints.closedform import closed_form
from ..case.case import Case
from ..program.nlp import Nlp
from ..proof.statement.machine import workspace_of_case
from ..proof.statement.posed_layout import reach_claims
from ..proof.workspace.judge import Judgement, judge_workspace
from ..proof.workspace.numbers.extremes import prove_extreme
from ..proof.workspace.ranks.ranks import not_judged
from ..proof.workspace.robot.pose_box import pose_box
from ..proof.workspace.verdict import Outcome
from .anybinding import AnyBinder, BoundPose
from .binding import BindingPose, Distinct, points_around

_REACH = "reach limb "
_UNREACHED = "a limb does not reach every pose, so that J is not judged"


def judge(case: Case, *, gap: float) -> Judgement:
    """Return the verdicts on a design over its workspace; where its limbs do not reach every pose, on these alone.

    Args:
        case: with fixed dimensions.
        gap: of the bounds.
    """
    closed, workspace = closed_form(case.model), workspace_of_case(case)
    if closed.reaches:
        layout, claims = reach_claims(case, closed, workspace)
        found = tuple(prove_extreme(layout, claim, gap=gap, jobs=1) for claim in claims)
        if any(each.outcome is not Outcome.PROVED for each in found):
            unknown = not_judged(pose_box(workspace), _UNREACHED)
            return Judgement(case, workspace, unknown, found)
    return judge_workspace(case, gap=gap, jobs=1, with_objective=False)


class OtherClaims:
    """Claims at poses of a robot.

    Args:
        nlp: the program without them.
        case: the case.
    """

    def __init__(self, nlp: Nlp, case: Case) -> None:
        self._nlp, self._binder = nlp, AnyBinder(nlp, case)
        self._bound: list[BoundPose] = []

    @property
    def program(self) -> Nlp:
        """The program with the claims as constraints."""
        return self._binder.program(self._bound)

    def added(self, design: Case, fresh: Sequence[BindingPose], x: FloatArray) -> list[BindingPose]:
        """Add further claims as constraints, and return those that are added.

        Where a limb does not reach a pose, J and the limits are not defined nearby: the reach comes first.

        Args:
            design: that refutes the claims.
            fresh: the claims.
            x: (n,) the design, and more that does not count.
        """
        if any(each.name.startswith(_REACH) for each in fresh):
            fresh = [each for each in fresh if each.name.startswith(_REACH)]
        problem = self._binder.problem(design) if fresh else None
        if problem is None:
            return []
        kept, distinct = list[BindingPose](), Distinct()
        points = points_around(self._nlp, x[: self._nlp.n])
        for each in fresh:
            bound = self._binder.bound(each.name, each.pose, problem, points[0], len(self._bound))
            if bound is None:
                continue
            values = np.array([bound.values(point, self._nlp.arguments) for point in points])
            # Limits of one size on joints of different limbs repeat each other too.
            if distinct.adds(repr([(item.lower, item.upper) for item in bound.constraints]), values):
                kept.append(each)
                self._bound.append(bound)
        return kept
