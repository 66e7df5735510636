"""Claims about every robot within the joint-centre tolerance, for robots of any type.

Let g_j be the derivative of a quantity g with respect to the error of centre j. For a robot within the tolerance t,
the quantity is at most

    g + t sum_j |g_j| + rest

at each pose, and at least ``g - t sum_j |g_j| - rest``. The rest bounds second-order terms over the workspace. So the
worst value within the tolerance is an expression of the pose; the search of ``certify`` bounds this expression. Robots
with dependent coordinates, and quantities with kinks, are bounded by a search of boxes of poses instead.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Dimension
from .....models.joints import RobotError
from .....models.joints.model.closedform import ClosedForm
from ....case.case import Case
from ....case.limits.constraint import LENGTH, Reading
from ....errors import UncoveredError
from ....interruption import is_requested, why_stopped
from ....program.layout import Layout
from ...boxes.tree import TreeRecord
from ...enclosure.tape import compile_tape
from ...statement.claims import Claim
from ...statement.fixed_robot import JointErrors
from ...statement.tolerance import (
    BuiltModel,
    ToleranceLayout,
    built_model,
    design_layout,
    is_smooth,
    second_order_name,
    tolerance_layout,
)
from ..proof_record import ProofRecord
from ..robot.pose_box import PoseNumbers, pose_coordinates
from ..robot.posed_robot import NotJudgedError, Problem, family_of
from ..verdict import Verdict
from .bound_search import Minimum, smallest_values
from .expressions import Expressions
from .extremes import DEFAULT, NumberSearch, goal_of, prove_extreme, verdict_of
from .second_order_change import second_order_change

#: Outward factor of the bound of a change, for rounding.
_OUTWARDS = 1 + 1e-12
#: Length (relative to the robot's size) or angle that counts as small.
_SMALL = 0.01
#: The same for a dependent rotation of the platform. This rotation is often 0 at all poses, and a small gap would then
#: take many boxes.
_SMALL_TURN = 0.03
#: Number of random poses at which the first-order change is sampled, to compare with second-order terms.
_POSES, _SEED = 32, 0


class RobotsWithinTolerance:
    """All robots within the joint-centre tolerance; without a tolerance only the nominal robot.

    Args:
        case: case with fixed dimensions.
        closed: robot of the case, with closed forms in place of unknowns.
        design: the nominal robot over the workspace.

    Attributes:
        case: the case.
        built: the robot with joint-centre errors as additional parameters.
        model: the robot with closed forms in place of unknowns.
        family: the robots within the tolerance over the workspace.
        symbols: the case as expressions of one pose and of joint-centre errors.

    Raises:
        NotJudgedError: joint-centre errors cannot be modelled, or remove degrees of freedom of the robot.
    """

    def __init__(self, case: Case, closed: ClosedForm, design: Problem) -> None:
        self.case, self.model, self._at = case, closed.model, pose_coordinates(design.box)
        tolerance = case.joint_centre_tolerance or 0.0
        try:
            bare = BuiltModel(closed.model, (), closed.reaches)
            self.built = built_model(case.model, with_angles=closed.has_angles) if tolerance else bare
        except RobotError as error:
            raise NotJudgedError(str(error)) from None
        self.family: Problem = family_of(case, self.built, design, tolerance)
        self.symbols: ToleranceLayout = tolerance_layout(case, self.built, tolerance, self._at)
        self._rests: dict[tuple[str, str], float] = {}

    @cached_property
    def _design(self) -> Layout:
        """Quantities of the nominal robot, without joint-centre errors, as expressions of the pose."""
        return design_layout(self.case, self.model, self._at)

    def extreme(self, claim: Claim, search: NumberSearch = DEFAULT) -> Verdict:
        """Prove the smallest or the largest value of a quantity over all robots within the tolerance and all poses.

        Args:
            claim: claim about the quantity, in the symbols of ``symbols``.
            search: requested gap, threads, and recorder for a proof file.
        """
        if is_requested():
            return verdict_of(claim, Minimum(reason=why_stopped()))
        number, found = self.number(claim), None
        try:
            # Programs have the box of a set of positions, not the set.
            is_whole_box = self.family.problem.box.positions is None
            if is_whole_box and not self.family.problem.dependent and is_smooth(number):
                found = self._by_first_order(claim, number, search)
            small = _SMALL if claim.is_coordinate else 0.0
            return found or next(self._by_search([claim], search.gap, small=small, record=search.record))
        except UncoveredError as error:
            return verdict_of(claim, Minimum(reason=str(error)))

    def followed(self, claims: Sequence[Claim], gap: float) -> Iterator[Verdict]:
        """Yield the verdicts on limits whose operations have interval rules.

        One search ends when all of these limits are decided.

        Args:
            claims: claims with limits, in the symbols of ``symbols``.
            gap: largest relative gap of a quantity that violates its limit.
        """
        covered = [claim for claim in claims if self.is_covered(claim)]
        if covered:
            with suppress(UncoveredError):  # in a loop equation
                yield from self._by_search(covered, gap, is_enough=True)

    def searched(self, claims: Sequence[Claim], search: NumberSearch, *, is_enough: bool = True) -> list[Verdict]:
        """Return the verdicts on quantities whose operations have interval rules; one search bounds all of them.

        Args:
            claims: claims about the quantities, in the symbols of ``symbols``.
            search: requested gap, and recorder for a proof file.
            is_enough: If true, a bound within its limit is sufficient, whatever its gap.
        """
        small = _SMALL if is_enough else 0.0
        return list(self._by_search(claims, search.gap, is_enough=is_enough, small=small, record=search.record))

    def is_covered(self, claim: Claim) -> bool:
        """Return whether all operations of a quantity have interval rules."""
        try:
            compile_tape(ca.Function("number", [self.family.z], [self.number(claim)]))
        except UncoveredError:
            return False
        return True

    def number(self, claim: Claim) -> SX:
        """Return a quantity as expression of the coordinates of ``family``, negated for a largest value."""
        return -claim.sense.sign * self.symbols.of(claim.expression, self.family.errors, self.family.problem.z)

    def _by_first_order(self, claim: Claim, number: SX, search: NumberSearch) -> Verdict | None:
        """Return the verdict on a quantity from its first-order change, an expression of the pose.

        The result is None if the second-order terms have no bound.

        Raises:
            UncoveredError: the expression has an operation without an interval rule.
        """
        family, symbols, design, sign = self.family, self.symbols, self._design, claim.sense.sign
        whole, worst = claim.expression, None
        if any(ca.which_depends(number, family.errors, 1, True)):
            values = Expressions(family, number)
            rest = self._rest(claim, number, values)
            if not math.isfinite(rest):
                return None
            gradient = ca.densify(ca.gradient(whole, symbols.errors))
            sizes = enumerate(symbols.near_zero(whole, design).tolist())
            change = sum((ca.norm_2(ca.vertcat(gradient[3 * j : 3 * j + 3], size)) for j, size in sizes), SX(0))
            whole += sign * (family.tolerance * change * _OUTWARDS + rest)
            worst = partial(self._worst, values, sign)
            if search.record is not None:
                search.record.rests[second_order_name(claim.name), claim.sense.value] = rest
        pose = design.table.variables_vector
        of_design = replace(claim, expression=symbols.of(whole, SX.zeros(symbols.errors.numel()), pose))
        return replace(prove_extreme(design, of_design, search, worst=worst), claim=claim)

    def _worst(self, values: Expressions, sign: float, pose: PoseNumbers) -> tuple[JointErrors, float]:
        """Return the joint-centre errors that are worst at a pose to first order, and the resulting quantity."""
        problem = self.family.problem
        z = self.family.exact(problem.box.coordinates(pose)[list(problem.free)])[None]
        z = values.worst(z, values.slopes(z, np.zeros(1, dtype=np.intp)))
        return self.family.errors_of(z[0]), -sign * float(values.values(z)[0, 0])

    def _rest(self, claim: Claim, number: SX, values: Expressions) -> float:
        """Return a bound of the second-order terms of a quantity, the same for both senses; infinite without a bound.

        Raises:
            UncoveredError: an expression has an operation without an interval rule.
        """
        family, key = self.family, (claim.name, claim.key.rpartition(".")[0])
        if key not in self._rests:
            poses = family.problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(family.problem.free)]
            z = np.array([family.exact(each) for each in poses])
            slopes = values.slopes(z, np.zeros(_POSES, dtype=np.intp))[:, poses.shape[1] :].reshape(_POSES, -1, 3)
            first = family.tolerance * float(np.nan_to_num(np.linalg.norm(slopes, axis=2)).sum(axis=1).max())
            self._rests[key] = second_order_change(family, number, first)
        return self._rests[key]

    def _by_search(
        self,
        claims: Sequence[Claim],
        gap: float,
        *,
        is_enough: bool = False,
        small: float = 0.0,
        record: ProofRecord | None = None,
    ) -> Iterator[Verdict]:
        """Yield the verdicts on quantities by one search of boxes of poses for all robots within the tolerance.

        Args:
            claims: claims about the quantities, in the symbols of ``symbols``.
            gap: largest relative gap.
            is_enough: If true, a bound within its limit is sufficient, whatever its gap.
            small: length (relative to the robot's size) or angle below which the gap is relative to this value,
                because quantities may be 0 at home.
            record: recorder for a proof file; along a path, stopped searches are recorded, too.

        Raises:
            UncoveredError: an expression has an operation without an interval rule.
        """
        problem = self.family.problem
        sizes = {LENGTH: small * problem.length, Reading(Dimension.ANGLE): small}
        least = [
            # Rotations are angles, or Cayley vectors with tangents of half angles.
            _SMALL_TURN if claim.is_coordinate and claim.reading != LENGTH else sizes.get(claim.reading, 0.0)
            for claim in claims
        ]
        goals = [goal_of(claim, gap * own, gap, is_enough=is_enough) for claim, own in zip(claims, least, strict=True)]
        recorder = None if record is None else TreeRecord()
        every = smallest_values(Expressions(self.family, ca.vertcat(*map(self.number, claims))), goals, recorder)
        if record is not None and recorder is not None:
            for claim, own in zip(claims, every, strict=True):
                if problem.cover is not None or not own.reason:
                    sign = -claim.sense.sign
                    record.followed(claim, sign * own.bound, sign * own.value, recorder)
        for claim, found in zip(claims, every, strict=True):
            is_known = math.isfinite(found.value)
            pose = problem.box.pose(problem.pose_of(found.at)) if is_known else None
            errors = self.family.errors_of(found.at) if is_known and self.family.names else None
            yield verdict_of(claim, found, pose, errors=errors)
