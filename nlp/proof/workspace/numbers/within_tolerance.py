"""Claims about every machine within a tolerance of joint centres, for any robot.

With the derivatives g_j by the error of centre j, a number g of a machine within the tolerance t is at most

    g + t sum_j |g_j| + rest

at each pose, and at least ``g - t sum_j |g_j| - rest``. The rest bounds terms of second order over the workspace. So
the number of all machines is an expression of the pose, which the search of ``certify`` bounds. Where coordinates
follow from others, or a number has kinks, boxes of poses are searched for all machines.
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
from ...statement.machine import JointErrors
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

#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Length, in parts of the robot's, or angle, that counts as small.
_SMALL = 0.01
#: The same for a dependent rotation of the platform. It is often 0 at all poses, where a narrow gap takes many boxes.
_SMALL_TURN = 0.03
#: Poses from whose first-order changes the size is taken beside which terms of second order are small.
_POSES, _SEED = 32, 0


class RobotsWithinTolerance:
    """Every machine within a tolerance; the design alone without one.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        design: this robot over the workspace.

    Attributes:
        case: the case.
        built: the robot with errors of its joint centres.
        model: the robot without unknowns in closed form.
        family: the machines over the workspace.
        symbols: the machines as symbols of one pose and of errors.

    Raises:
        NotJudgedError: the machines are not known, or do not have the freedoms of the design.
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
        """The design as symbols of the pose."""
        return design_layout(self.case, self.model, self._at)

    def extreme(self, claim: Claim, search: NumberSearch = DEFAULT) -> Verdict:
        """Prove the smallest or the largest value of a number over all machines and poses.

        Args:
            claim: the number, in the symbols of machines.
            search: gap, threads and record.
        """
        if is_requested():
            return verdict_of(claim, Minimum(reason=why_stopped()))
        number, found = self.number(claim), None
        try:
            if not self.family.problem.dependent and is_smooth(number):
                found = self._by_first_order(claim, number, search)
            small = _SMALL if claim.is_coordinate else 0.0
            return found or next(self._by_search([claim], search.gap, small=small, record=search.record))
        except UncoveredError as error:
            return verdict_of(claim, Minimum(reason=str(error)))

    def followed(self, claims: Sequence[Claim], gap: float) -> Iterator[Verdict]:
        """Yield the extremes of those limits that have rules, by one search in which bounds within limits are enough.

        Args:
            claims: the limits, in the symbols of machines.
            gap: allowed distance of the bound from a value beyond its limit, as a part of it.
        """
        covered = [claim for claim in claims if self.is_covered(claim)]
        if covered:
            with suppress(UncoveredError):  # an equation of loops
                yield from self._by_search(covered, gap, is_enough=True)

    def searched(self, claims: Sequence[Claim], search: NumberSearch, *, is_enough: bool = True) -> list[Verdict]:
        """Return the extremes of numbers that have rules, all by one search.

        Args:
            claims: the numbers, in the symbols of machines.
            search: gap and record.
            is_enough: whether bounds within limits are enough whatever the gap is.
        """
        small = _SMALL if is_enough else 0.0
        return list(self._by_search(claims, search.gap, is_enough=is_enough, small=small, record=search.record))

    def is_covered(self, claim: Claim) -> bool:
        """Return whether a number has no operation without a rule."""
        try:
            compile_tape(ca.Function("number", [self.family.z], [self.number(claim)]))
        except UncoveredError:
            return False
        return True

    def number(self, claim: Claim) -> SX:
        """Return a number in the coordinates of machines, times -1 where the largest value is meant."""
        return -claim.sense.sign * self.symbols.of(claim.expression, self.family.errors, self.family.problem.z)

    def _by_first_order(self, claim: Claim, number: SX, search: NumberSearch) -> Verdict | None:
        """Return the extreme of a number and its change as an expression of the pose; None where it is not bounded.

        Raises:
            UncoveredError: the expression holds an operation without a rule.
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
        """Return the errors that are worst at a pose to first order, and the number with them."""
        problem = self.family.problem
        z = self.family.exact(problem.box.coordinates(pose)[list(problem.free)])[None]
        z = values.worst(z, values.slopes(z, np.zeros(1, dtype=np.intp)))
        return self.family.errors_of(z[0]), -sign * float(values.values(z)[0, 0])

    def _rest(self, claim: Claim, number: SX, values: Expressions) -> float:
        """Return a bound of the terms of second order of a claim's number, the same for both senses; or infinite.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
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
        """Yield the extremes of numbers by one search of boxes of poses for all machines.

        Args:
            claims: the numbers, in the symbols of machines.
            gap: as a part of a number.
            is_enough: whether bounds within limits are enough whatever the gap is.
            small: length, in parts of the robot's, or angle, of which the gap is a part too: numbers may be 0 at home.
            record: record of the search for a proof; along a path also of one that stopped.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        problem = self.family.problem
        sizes = {LENGTH: small * problem.length, Reading(Dimension.ANGLE): small}
        least = [
            # Rotations about the pose's axes are angles, or halves of angles in Cayley vectors.
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
