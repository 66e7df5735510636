"""Claims about every machine within a tolerance of joint centres, for any robot.

With the derivatives g_j by the error of centre j, a number g of a machine within the tolerance t is at most

    g + t sum_j |g_j| + rest

at each pose, and at least ``g - t sum_j |g_j| - rest``. The rest bounds terms of second order over the workspace. So
the number of all machines is an expression of the pose, which the search of ``certify`` bounds. Where coordinates
follow from others, or a number has kinks, boxes of poses are searched for all machines.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from casadi import SX

from .....models.joints import RobotError
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import is_requested, why_stopped
from ....program.layout import Layout
from ...statement.claims import Claim
from ...statement.machine import CentreErrors, has_straight_legs
from ...statement.tolerance import (
    BuiltModel,
    MachineLayout,
    built_model,
    design_layout,
    is_smooth,
    machine_layout,
    second_order_name,
)
from ..numbers.extremes import CLOSE, GAP, Extreme, nothing_known, prove_extreme, slack_of
from ..robot.pose_box import PoseBox, PoseNumbers, pose_coordinates
from ..robot.posed_robot import NotJudgedError, build_problem
from ..robot.tolerance_model import ToleranceModel, family_of
from ..verdict import Outcome
from .leg_errors import of_legs
from .machine_number import MachineNumber
from .second_order_change import second_order_change

if TYPE_CHECKING:
    from ..proof_record import PaperRecord

#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Poses from whose first-order changes the size is taken beside which terms of second order are small.
_POSES, _SEED = 32, 0


class Machines:
    """Every machine within a tolerance; the design alone without one.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        box: the poses.

    Attributes:
        built: the robot with errors of its joint centres.
        family: the machines over the workspace.
        symbols: the machines as symbols of one pose and of errors.

    Raises:
        NotJudgedError: the machines are not known, or do not have the freedoms of the design.
    """

    def __init__(self, case: Case, closed: ClosedForm, box: PoseBox) -> None:
        self._case, self._model, self._at = case, closed.model, pose_coordinates(box)
        tolerance = case.joint_centre_tolerance or 0.0
        try:
            self.built = built_model(case.model) if tolerance else BuiltModel(closed.model, (), closed.reaches)
        except RobotError as error:
            raise NotJudgedError(str(error)) from None
        self.family: ToleranceModel = family_of(case, self.built, build_problem(case, closed.model, box), tolerance)
        self.symbols: MachineLayout = machine_layout(case, self.built, tolerance, self._at)
        self._rests: dict[tuple[str, str], float] = {}

    @cached_property
    def _design(self) -> Layout:
        """The design as symbols of the pose."""
        return design_layout(self._case, self._model, self._at)

    def extreme(
        self, claim: Claim, *, gap: float = GAP, jobs: int | None = None, paper: PaperRecord | None = None
    ) -> Extreme:
        """Prove the smallest or the largest value of a number over all machines and poses.

        Args:
            claim: the number, in the symbols of machines.
            gap: allowed distance of the bound from the best value known, as a part of it.
            jobs: threads.
            paper: records the search for a proof.
        """
        if is_requested():
            return not_bounded(claim, why_stopped())
        whole = self.symbols.of(claim.expression, self.family.errors, self.family.problem.z)
        number = MachineNumber(self.family, whole if claim.sense is Sense.MIN else -whole)
        try:
            found = None
            if not self.family.problem.dependent and is_smooth(whole):
                found = self._by_first_order(claim, number, gap, jobs, paper)
            found = found or self._by_search(claim, number, gap)
        except UncoveredError as error:
            return not_bounded(claim, str(error))
        if found.centres is None or not has_straight_legs(self._case.model):
            return found
        return replace(found, errors=of_legs(found.centres), centres=None)

    def _by_first_order(
        self, claim: Claim, number: MachineNumber, gap: float, jobs: int | None, paper: PaperRecord | None
    ) -> Extreme | None:
        """Return the extreme of a number and its change as an expression of the pose; None where it is not bounded.

        Raises:
            UncoveredError: the expression holds an operation without a rule.
        """
        family, symbols, design, sign = self.family, self.symbols, self._design, _sign(claim)
        whole, machine = claim.expression, None
        if any(ca.which_depends(number.entries, family.errors, 1, True)):
            rest = self._rest(claim, number)
            if not math.isfinite(rest):
                return None
            gradient = ca.densify(ca.gradient(whole, symbols.errors))
            sizes = enumerate(symbols.near_zero(whole, design).tolist())
            change = sum((ca.norm_2(ca.vertcat(gradient[3 * j : 3 * j + 3], size)) for j, size in sizes), SX(0))
            whole += sign * (family.tolerance * change * _OUTWARDS + rest)
            if paper is not None:
                paper.rests[second_order_name(claim.name), claim.sense.value] = rest

            def machine(pose: PoseNumbers) -> tuple[CentreErrors, float]:
                """Return the errors that are worst at a pose, and the number, as people read it, with them."""
                z = family.exact(family.problem.box.coordinates(pose)[list(family.problem.free)])[None]
                z = number.worst(z, number.slopes(z))
                return family.errors_of(z[0]), claim.reading.from_value(-sign * float(number.values(z)[0]))

        pose = design.table.variables_vector
        own = replace(claim, expression=symbols.of(whole, SX.zeros(symbols.errors.numel()), pose))
        return prove_extreme(design, own, gap=gap, jobs=jobs, machine=machine, paper=paper)

    def _rest(self, claim: Claim, number: MachineNumber) -> float:
        """Return a bound of the terms of second order of a claim's number, the same for both senses; or infinite.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        family, key = self.family, (claim.name, claim.key.rpartition(".")[0])
        if key not in self._rests:
            poses = family.problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(family.problem.free)]
            first = float(number.change(np.array([family.exact(z) for z in poses])).max())
            self._rests[key] = second_order_change(family, number.entries, first)
        return self._rests[key]

    def _by_search(self, claim: Claim, number: MachineNumber, gap: float) -> Extreme:
        """Return the extreme of a number by a search of boxes of poses for all machines.

        Raises:
            UncoveredError: the expression holds an operation without a rule.
        """
        sign, read, family = _sign(claim), claim.reading.from_value, self.family
        least = None if claim.limit is None else -sign * claim.limit
        slack = 0.0 if claim.limit is None else slack_of(claim.limit)
        found = number.minimum(gap=gap, limit=least, slack=slack)
        is_bounded, is_known = math.isfinite(found.bound), math.isfinite(found.value)
        is_proved = is_bounded and (not found.reason if least is None else found.bound >= least - slack)
        outcome, reason = Outcome.PROVED if is_proved else Outcome.OPEN, found.reason or CLOSE
        if least is not None and found.value < least - slack:
            outcome = Outcome.REFUTED
        problem = family.problem
        return Extreme(
            name=claim.name,
            sense=claim.sense,
            dimension=claim.reading.dimension,
            key=claim.key,
            limit=None if claim.limit is None else read(claim.limit),
            bound=read(-sign * found.bound) if is_bounded else sign * math.inf,
            reached=read(-sign * found.value) if is_known else math.nan,
            pose=problem.box.pose(problem.pose_of(found.at)) if is_known else None,
            outcome=outcome,
            boxes=found.boxes,
            seconds=found.seconds,
            reason=reason if outcome is Outcome.OPEN else "",
            centres=family.errors_of(found.at) if is_known and family.names else None,
        )


def not_bounded(claim: Claim, reason: str) -> Extreme:
    """Return the extreme of a claim of which nothing is proved."""
    limit = None if claim.limit is None else claim.reading.from_value(claim.limit)
    return nothing_known(claim.name, claim.sense, claim.reading.dimension, reason, key=claim.key, limit=limit)


def _sign(claim: Claim) -> float:
    """Return 1 where the largest value is meant, -1 where the smallest one is."""
    return 1.0 if claim.sense is Sense.MAX else -1.0
