"""All claims about every machine within a tolerance of joint centres, for any robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .....models import Dimension, Model, Substitution
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....case.limits.constraint import Reading
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import is_requested, why_stopped
from ....program.layout import Layout
from ...statement.claims import REACH, Claim, claims_of
from ..numbers.bound_search import Minimum
from ..numbers.extremes import CLOSE, Extreme, prove_extreme, slack_of
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, build_problem
from ..robot.tolerance_model import BuiltModel, Family, built_model, family_of
from ..verdict import Outcome
from .first_order_change import Place, worst_number
from .layouts import box_layout, in_family, machine_layout
from .machine_number import smallest_of_machines
from .second_order_change import is_smooth

#: Reason for numbers of a robot that does not have all poses.
_OUT_OF_REACH = "not every machine within the tolerance is proved to reach every pose"


class Machines(NamedTuple):
    """Every machine within a tolerance.

    Attributes:
        case: with fixed dimensions.
        model: its robot, without unknowns in closed form.
        built: the robot with errors of its joint centres.
        family: the machines over the workspace.
    """

    case: Case
    model: Model
    built: BuiltModel
    family: Family


class Proving(NamedTuple):
    """How claims are proved: gap, threads, and a function of the progress."""

    gap: float
    jobs: int | None
    progress: Callable[[str, int, int], None] | None = None


def machines_of(case: Case, model: Model, box: PoseBox) -> Machines:
    """Return every machine within the tolerance of a case.

    Args:
        case: with fixed dimensions and a tolerance.
        model: its robot, without unknowns in closed form.
        box: the poses.

    Raises:
        NotJudgedError: the machines are not known, or do not have the freedoms of the design.
    """
    built = built_model(case.model)
    problem = build_problem(case, model, box)
    return Machines(case, model, built, family_of(case, built, problem, case.joint_centre_tolerance or 0.0))


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
    case, family = machines.case, machines.family
    layout = machine_layout(case, machines.built, family)
    claims = claims_of(layout, quantities, with_objective=with_objective)
    reaches = _reach_claims(machines, layout)
    if only is not None:
        claims, reaches = ([each for each in some if each.name in only] for some in (claims, reaches))
    exact = None
    if not family.problem.dependent:
        exact = box_layout(replace(case, model=machines.model), family.problem.box)
    reached = True
    for done, claim in enumerate([*reaches, *claims]):
        if proving.progress is not None:
            proving.progress(claim.name, done, len(reaches) + len(claims))
        number = in_family(layout, family, claim.expression)
        if done >= len(reaches) and not reached:
            yield not_bounded(claim, _OUT_OF_REACH)
            continue
        found = _extreme(machines, exact, claim, number, proving)
        reached = reached and (done >= len(reaches) or found.outcome is Outcome.PROVED)
        yield found


def shown_extremes(
    case: Case, closed: ClosedForm, box: PoseBox, quantities: Sequence[str], proving: Proving, *, with_objective: bool
) -> Iterator[Extreme]:
    """Yield the extremes of numbers without a limit of a design with loops, in the assembly of home.

    Loop equations as conditions of a program hold in every assembly, and F has no bound where one of these is singular.
    The design is searched as the only machine within a tolerance of nothing. None is yielded of a robot without loops,
    or one whose loops cannot be followed.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        box: the poses.
        quantities: names of measures.
        proving: how they are proved.
        with_objective: whether F of each task is bounded.

    Raises:
        InputError: the robot has no measure of a name.
    """
    if not closed.model.unknowns:
        return
    built = BuiltModel(closed.model, (), closed.reaches)
    try:
        family = family_of(case, built, build_problem(case, closed.model, box), 0.0)
    except NotJudgedError:
        return
    machines = Machines(case, closed.model, built, family)
    layout = machine_layout(case, built, family)
    for claim in claims_of(layout, quantities, with_objective=with_objective):
        if claim.limit is None:
            yield _extreme(machines, None, claim, in_family(layout, family, claim.expression), proving)


def not_bounded(claim: Claim, reason: str) -> Extreme:
    """Return the extreme of a claim of which nothing is proved."""
    sign = 1.0 if claim.sense is Sense.MAX else -1.0
    limit = None if claim.limit is None else claim.reading.from_value(claim.limit)
    nothing = (sign * math.inf, math.nan, None, Outcome.OPEN, 0, 0.0, reason)
    return Extreme(claim.name, claim.sense, claim.reading.dimension, claim.key, limit, *nothing)


def _reach_claims(machines: Machines, layout: Layout) -> list[Claim]:
    """Return the claims that the limbs of every machine reach every pose."""
    built = machines.built.model
    robot, own = layout.robots[0], Substitution.identity(built)
    unknowns = ca.vertcat(
        SX(0, 1), *[layout.table.variables_vector[k] for each in layout.places.unknowns for k in each]
    )
    given = Substitution(robot.parameters, unknowns, robot.rotation, robot.position)
    reaches = machines.built.reaches
    values = ca.Function("reach", own.all, [each.value for each in reaches]).call(given.all)
    reading = Reading(Dimension.NUMBER)
    return [
        Claim(f"reach limb {each.limb}", Sense.MIN, value, reading, REACH, 0.0)
        for each, value in zip(reaches, values, strict=True)
    ]


def _extreme(machines: Machines, exact: Layout | None, claim: Claim, number: SX, proving: Proving) -> Extreme:
    """Return the extreme of one number over all machines.

    Args:
        machines: the machines.
        exact: the design as symbols of the pose; None where coordinates follow from others.
        claim: the number.
        number: (1, 1) in the coordinates of the family.
        proving: how it is proved.
    """
    if is_requested():
        return not_bounded(claim, why_stopped())
    try:
        if exact is not None and is_smooth(machines.family, number):
            found = _by_first_order(machines, exact, claim, number, proving)
            if found is not None:
                return found
        return _by_search(machines, claim, number, proving)
    except UncoveredError as error:
        return not_bounded(claim, str(error))


def _by_first_order(machines: Machines, exact: Layout, claim: Claim, number: SX, proving: Proving) -> Extreme | None:
    """Return the extreme of a number and its change as an expression of the pose; None where it is not bounded.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    family, sign = machines.family, 1.0 if claim.sense is Sense.MAX else -1.0
    coordinates = exact.table.variables_vector
    worst = None
    if any(ca.which_depends(number, family.errors, 1, True)):
        worst = worst_number(Place(family, coordinates), number, claim.reading, sign)
        if worst is None:
            return None
    function = ca.Function("number", [family.problem.z, family.errors], [number])
    design = function.call([coordinates, SX.zeros(family.errors.numel())])[0]
    return prove_extreme(
        exact,
        replace(claim, expression=design, worst=worst),
        gap=proving.gap,
        jobs=proving.jobs,
    )


def _by_search(machines: Machines, claim: Claim, number: SX, proving: Proving) -> Extreme:
    """Return the extreme of a number by a search of boxes of poses for all machines.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    sign = 1.0 if claim.sense is Sense.MAX else -1.0
    slack = 0.0 if claim.limit is None else slack_of(claim.limit)
    found = smallest_of_machines(
        machines.family,
        -sign * number,
        gap=proving.gap,
        limit=None if claim.limit is None else -sign * claim.limit,
        slack=slack,
    )
    return _of_minimum(machines.family, claim, found, slack)


def _of_minimum(family: Family, claim: Claim, found: Minimum, slack: float) -> Extreme:
    """Return the extreme of a claim from the smallest value of its number, or of the negative of it."""
    sign, read = 1.0 if claim.sense is Sense.MAX else -1.0, claim.reading.from_value
    is_bounded = math.isfinite(found.bound)
    outcome, reason = (Outcome.OPEN if found.reason or not is_bounded else Outcome.PROVED), found.reason
    if claim.limit is not None:
        least = -sign * claim.limit
        outcome = Outcome.OPEN
        if found.value < least - slack:
            outcome = Outcome.REFUTED
        elif is_bounded and found.bound >= least - slack:
            outcome = Outcome.PROVED
    pose, centres = None, None
    if math.isfinite(found.value):
        problem = family.problem
        pose = problem.box.pose(problem.pose_of(found.at))
        centres = family.errors_of(found.at) if family.names else None
    return Extreme(
        name=claim.name,
        sense=claim.sense,
        dimension=claim.reading.dimension,
        key=claim.key,
        limit=None if claim.limit is None else read(claim.limit),
        bound=read(-sign * found.bound) if is_bounded else sign * math.inf,
        reached=math.nan if pose is None else read(-sign * found.value),
        pose=pose,
        outcome=outcome,
        boxes=found.boxes,
        seconds=found.seconds,
        reason="" if outcome is not Outcome.OPEN else reason or CLOSE,
        centres=centres,
    )
