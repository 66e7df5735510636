"""All claims about every machine within a tolerance of joint centres, for any robot.

With the derivatives g_j by the error of centre j, a number g of a machine within the tolerance t is at most

    g + t sum_j |g_j| + rest

at each pose, and at least ``g - t sum_j |g_j| - rest``. The rest bounds terms of second order over the workspace. So
the number of all machines is an expression of the pose, which the search of ``certify`` bounds. Where coordinates
follow from others, or a number has kinks, boxes of poses are searched for all machines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, Model
from .....models.joints import RobotError
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import is_requested, why_stopped
from ....program.layout import Layout
from ...enclosure.tape import compile_tape
from ...statement.claims import Claim
from ...statement.machine import INSIDE, CentreErrors
from ...statement.tolerance import (
    BuiltModel,
    MachineLayout,
    built_model,
    design_layout,
    is_smooth,
    machine_layout,
    second_order_name,
)
from ..numbers.bound_search import Minimum, smallest_values
from ..numbers.expressions import Expressions
from ..numbers.extremes import Extreme, extreme_of, goal_of, prove_extreme
from ..robot.pose_box import PoseBox, PoseNumbers, pose_coordinates
from ..robot.posed_robot import NotJudgedError, build_problem
from ..robot.tolerance_model import ToleranceModel, family_of
from ..verdict import Outcome
from .second_order_change import second_order_change

if TYPE_CHECKING:
    from ..proof_record import PaperRecord

#: Reason for numbers of a robot that does not have all poses.
_OUT_OF_REACH = "not every machine within the tolerance is proved to reach every pose"
#: Part of itself by which a bound of a change moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12
#: Poses from whose first-order changes the size is taken beside which terms of second order are small.
_POSES = 32
_SEED = 0


class Proving(NamedTuple):
    """How claims are proved: gap, threads, a function of the progress, and the record for a proof on paper."""

    gap: float
    jobs: int | None
    progress: Callable[[str, int, int], None] | None = None
    paper: PaperRecord | None = None


class Machines:
    """Every machine within a tolerance.

    Args:
        case: with fixed dimensions.
        model: its robot, without unknowns in closed form.
        built: the robot with errors of its joint centres.
        family: the machines over the workspace.
    """

    def __init__(self, case: Case, model: Model, built: BuiltModel, family: ToleranceModel) -> None:
        self.case, self.model, self.built, self.family = case, model, built, family
        self._at = pose_coordinates(family.problem.box)
        self.symbols: MachineLayout = machine_layout(case, built, family.tolerance, self._at)
        self._rests: dict[tuple[str, str], float] = {}

    @cached_property
    def design(self) -> Layout:
        """The design as symbols of the pose."""
        return design_layout(self.case, self.model, self._at)

    def rest(self, claim: Claim, number: SX, single: _Machine) -> float:
        """Return a bound of the terms of second order of a claim's number, the same for both senses; or infinite.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        family, key = self.family, (claim.name, claim.key.rpartition(".")[0])
        if key not in self._rests:
            poses = family.problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(family.problem.free)]
            first = max((single.first_order_change(z) for z in poses), default=0.0)
            self._rests[key] = second_order_change(family, number, first)
        return self._rests[key]

    def number(self, expression: SX) -> SX:
        """Return an expression of the symbols of machines in the coordinates of their family."""
        return self.symbols.of(expression, self.family.errors, self.family.problem.z)


def machines_of(case: Case, model: Model, box: PoseBox) -> Machines:
    """Return every machine within the tolerance of a case.

    Args:
        case: with fixed dimensions and a tolerance.
        model: its robot, without unknowns in closed form.
        box: the poses.

    Raises:
        NotJudgedError: the machines are not known, or do not have the freedoms of the design.
    """
    try:
        built = built_model(case.model)
    except RobotError as error:
        raise NotJudgedError(str(error)) from None
    problem = build_problem(case, model, box)
    return Machines(case, model, built, family_of(case, built, problem, case.joint_centre_tolerance or 0.0))


def design_alone(case: Case, closed: ClosedForm, box: PoseBox) -> Machines:
    """Return the design as the only machine within a tolerance of nothing.

    Raises:
        NotJudgedError: its loops cannot be followed.
    """
    built = BuiltModel(closed.model, (), closed.reaches)
    family = family_of(case, built, build_problem(case, closed.model, box), 0.0)
    return Machines(case, closed.model, built, family)


def machine_extremes(
    machines: Machines,
    quantities: Sequence[str],
    proving: Proving,
    *,
    with_objective: bool,
    only: Sequence[str] | None = None,
) -> Iterator[Extreme]:
    """Yield the extremes over all machines: of the reach of limbs, limits, lengths of legs, measures and tasks.

    Args:
        machines: the machines.
        quantities: names of measures.
        proving: how they are proved.
        with_objective: whether F of each task is bounded.
        only: names of the numbers that are meant; None for all.

    Raises:
        InputError: the robot has no measure of a name.
    """
    reaches, claims = machines.symbols.claims(quantities, with_objective=with_objective)
    if only is not None:
        reaches, claims = ([each for each in some if each.name in only] for some in (reaches, claims))
    reached = True
    for done, claim in enumerate([*reaches, *claims]):
        if proving.progress is not None:
            proving.progress(claim.name, done, len(reaches) + len(claims))
        if done >= len(reaches) and not reached:
            yield extreme_of(claim, Minimum(reason=_OUT_OF_REACH))
            continue
        found = machine_extreme(machines, claim, proving)
        reached = reached and (done >= len(reaches) or found.outcome is Outcome.PROVED)
        yield found


def shown_extremes(
    case: Case,
    closed: ClosedForm,
    box: PoseBox,
    quantities: Sequence[str],
    proving: Proving,
    *,
    with_objective: bool,
    with_free: bool = True,
) -> Iterator[Extreme]:
    """Yield the extremes of a design with loops, in the assembly of home: of limits that are decided, then of others.

    Loop equations as conditions of a program hold in every assembly, and F has no bound where one of these is singular.
    The design is searched as the only machine within a tolerance of nothing, for all limits together. None is yielded
    of a robot without loops, or one whose loops cannot be followed.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        box: the poses.
        quantities: names of measures.
        proving: how they are proved.
        with_objective: whether F of each task is bounded.
        with_free: whether numbers without a limit are.

    Raises:
        InputError: the robot has no measure of a name.
    """
    if not closed.model.unknowns:
        return
    try:
        machines = design_alone(case, closed, box)
    except NotJudgedError:
        return
    claims = machines.symbols.claims(quantities, with_objective=with_objective)[1]
    limited = [claim for claim in claims if claim.limit is not None and _is_covered(machines, claim)]
    if limited:
        with suppress(UncoveredError):  # an equation of loops
            found = _by_search(machines, limited, proving.gap, is_enough=True)
            yield from (each for each in found if each.outcome is not Outcome.OPEN)
    for claim in claims if with_free else ():
        if claim.limit is None:
            yield machine_extreme(machines, claim, proving)


def _is_covered(machines: Machines, claim: Claim) -> bool:
    """Return whether a number has no operation without a rule."""
    try:
        compile_tape(ca.Function("number", [machines.family.z], [machines.number(claim.expression)]))
    except UncoveredError:
        return False
    return True


def machine_extreme(machines: Machines, claim: Claim, proving: Proving, *, again: bool = False) -> Extreme:
    """Return the extreme of one number over all machines.

    Args:
        machines: the machines.
        claim: the number, in their symbols.
        proving: how it is proved.
        again: whether the record takes the place of an earlier one of the same number.
    """
    if is_requested():
        return extreme_of(claim, Minimum(reason=why_stopped()))
    number = machines.number(claim.expression)
    try:
        if not machines.family.problem.dependent and is_smooth(number):
            found = _by_first_order(machines, claim, number, proving, again=again)
            if found is not None:
                return found
        return next(_by_search(machines, [claim], proving.gap))
    except UncoveredError as error:
        return extreme_of(claim, Minimum(reason=str(error)))


def _by_first_order(machines: Machines, claim: Claim, number: SX, proving: Proving, *, again: bool) -> Extreme | None:
    """Return the extreme of a number and its change as an expression of the pose; None where it is not bounded.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    family, pose = machines.family, machines.design.table.variables_vector
    sign = 1.0 if claim.sense is Sense.MAX else -1.0
    machine, whole, symbols = None, claim.expression, machines.symbols
    if any(ca.which_depends(number, family.errors, 1, True)):
        single = _Machine(family, number, sign)
        rest = machines.rest(claim, number, single)
        if not math.isfinite(rest):
            return None
        gradient = ca.densify(ca.gradient(whole, symbols.errors))
        sizes = enumerate(symbols.near_zero(whole, machines.design).tolist())
        change = sum((ca.norm_2(ca.vertcat(gradient[3 * j : 3 * j + 3], size)) for j, size in sizes), SX(0))
        whole, machine = whole + sign * (family.tolerance * change * _OUTWARDS + rest), single.worst
        if proving.paper is not None:
            proving.paper.rests[second_order_name(claim.name), claim.sense.value] = rest
    own = replace(claim, expression=symbols.of(whole, SX.zeros(symbols.errors.numel()), pose))
    return prove_extreme(
        machines.design, own, gap=proving.gap, jobs=proving.jobs, machine=machine, paper=proving.paper, again=again
    )


class _Machine:
    """A number of single machines.

    Args:
        family: the machines, none of whose coordinates follows from others.
        number: (1, 1) in their coordinates, smooth.
        sign: 1 where the largest value is meant, -1 where the smallest one is.
    """

    def __init__(self, family: ToleranceModel, number: SX, sign: float) -> None:
        self._family, self._sign = family, sign
        slopes = ca.densify(ca.gradient(number, family.errors))
        self._function = ca.Function("number", [family.z], [number, slopes])

    def first_order_change(self, z: FloatArray) -> float:
        """Return the first-order change at a pose (n,), of derivatives that are defined."""
        slopes = self._slopes(z)
        return self._family.tolerance * float(np.nan_to_num(np.linalg.norm(slopes, axis=1)).sum())

    def worst(self, pose: PoseNumbers) -> tuple[CentreErrors, float]:
        """Return the errors that are worst at a pose to first order, and the number with them."""
        family = self._family
        z = family.problem.box.coordinates(pose)[list(family.problem.free)]
        slopes = self._slopes(z)
        sizes = np.linalg.norm(slopes, axis=1, keepdims=True)
        unit = np.divide(slopes, sizes, out=np.zeros_like(slopes), where=sizes > 0)
        whole = np.concatenate([z, (self._sign * INSIDE * family.tolerance * unit).ravel()])
        return family.errors_of(whole), float(self._function(whole)[0])

    def _slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (m, 3) by the errors of the design at a pose (n,)."""
        return np.array(self._function(self._family.exact(z))[1].full().reshape(-1, 3))


def _by_search(
    machines: Machines, claims: Sequence[Claim], gap: float, *, is_enough: bool = False
) -> Iterator[Extreme]:
    """Yield the extremes of numbers by one search of boxes of poses for all machines.

    Args:
        machines: the machines.
        claims: the numbers, in their symbols.
        gap: as a part of a number.
        is_enough: whether bounds within limits are enough whatever the gap is.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    family, problem = machines.family, machines.family.problem
    signs = [1.0 if claim.sense is Sense.MAX else -1.0 for claim in claims]
    numbers = [-sign * machines.number(claim.expression) for sign, claim in zip(signs, claims, strict=True)]
    goals = [goal_of(claim, part=gap, is_enough=is_enough) for claim in claims]
    every = smallest_values(Expressions(family, ca.vertcat(*numbers)), goals)
    for claim, found in zip(claims, every, strict=True):
        is_known = math.isfinite(found.value)
        pose = problem.box.pose(problem.pose_of(found.at)) if is_known else None
        yield extreme_of(claim, found, pose, centres=family.errors_of(found.at) if is_known and family.names else None)
