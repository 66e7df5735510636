"""Ranks of any robot over a workspace, and the reach of limbs whose inverse is known in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, Model, Substitution, frozen_array
from ...models.joints.closedform import ClosedForm
from ..case.case import Case
from ..case.limits.constraint import Reading
from ..case.limits.limits import Limits
from ..case.pose import Free
from ..case.task import Sense
from ..case.workspace import Workspace
from ..errors import UncoveredError
from ..program.layout import Layout
from .claims import Claim
from .general.family import Family
from .general.matrices import RankMatrix
from .general.problem import NotJudgedError, Problem, build_problem
from .general.search import BY_NEWTON, prove_rank
from .general.singularmachine import SingularMachine
from .general.singularpose import SingularPose
from .posebox import PoseBox
from .posed import posed_layout
from .regular.search import RankProgress
from .verdict import Outcome, Regularity

#: Random poses from which Newton's method looks for a singular one, and number of the worst that are tried.
_POSES, _WORST = 2048, 8
#: Random poses at which an equation is tested, and its largest residual, of order 1, where it holds by itself.
_TESTS, _IDENTITY = 32, 1e-11
_SEED = 0


class Ranks(NamedTuple):
    """Verdicts on J, and on the constraint wrenches; None for a robot without them."""

    regular: Regularity
    constraints: Regularity | None


def prove_ranks(
    case: Case,
    model: Model,
    box: PoseBox,
    *,
    family: Family | None = None,
    engine: str | None = None,
    time_limit: float | None = None,
    progress: RankProgress | None = None,
) -> Ranks:
    """Prove that J and the constraint wrenches keep their ranks at every pose of a box, or find a pose.

    Args:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        box: the poses.
        family: all machines that are meant; None for the design alone.
        engine: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        time_limit: seconds for each of the two searches.
        progress: called during them.
    """
    try:
        problem = build_problem(case, model, box) if family is None else family.problem
        prove = partial(prove_rank, problem, family=family, engine=engine, time_limit=time_limit, progress=progress)
        regular = prove(problem.locked)
        constraints = None
        if problem.unactuated is not None:
            constraints = prove(problem.unactuated)
    except (UncoveredError, NotJudgedError) as error:
        return Ranks(not_judged(box, str(error)), None)
    return Ranks(_after_newton(regular, problem, problem.locked, family), constraints)


def touched(case: Case, box: PoseBox, found: Regularity) -> Regularity:
    """Return the verdict on six straight legs after Newton's method, where a search has left it open."""
    if found.outcome is not Outcome.OPEN:
        return found
    problem = build_problem(case, case.model, box)
    return _after_newton(found, problem, problem.locked)


def without_identities(case: Case, model: Model, box: PoseBox) -> Model:
    """Return a robot without the loop equations that hold at every pose of a box by themselves.

    A Delta that is held without rotation is such a robot: the second rod of a limb closes with the first.

    Args:
        case: with fixed dimensions.
        model: its robot; with unknowns all equations are kept.
        box: the poses.
    """
    if model.unknowns or not model.closure:
        return model
    own = Substitution.identity(model)
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    scaled = ca.vertcat(*[each.scaled for each in model.closure])
    function = ca.Function("closure", own.all, [ca.densify(scaled)])
    poses = [box.pose(y) for y in box.random(_TESTS, np.random.default_rng(_SEED))]
    found = [function(np.array(values), 0, pose.rotation, pose.position).full().ravel() for pose in poses]
    # A limb that does not reach a pose has no value there.
    largest = np.nanmax(np.abs(found), axis=0, initial=0.0)
    known = np.isfinite(found).sum(axis=0) >= _TESTS // 2
    holds = known & (largest <= _IDENTITY)
    return replace(
        model, closure=tuple(each for each, is_identity in zip(model.closure, holds, strict=True) if not is_identity)
    )


def reach_claims(case: Case, closed: ClosedForm, workspace: Workspace) -> tuple[Layout, list[Claim]]:
    """Return the claims that limbs reach every pose, and the case as symbols of the pose.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        workspace: the poses.
    """
    # No condition is left on a pose: where a limb does not reach it, its loop and its signs have no values.
    bare = replace(closed.model, closure=(), loops=(), distances=(), signs=())
    layout = posed_layout(replace(case, model=bare, limits=Limits()), workspace)
    robot, own = layout.robots[0], Substitution.identity(bare)
    unknowns = ca.vertcat(
        SX(0, 1), *[layout.table.variables_vector[k] for at_pose in layout.places.unknowns for k in at_pose]
    )
    given = Substitution(robot.parameters, unknowns, robot.rotation, robot.position)
    values = ca.Function("reach", own.all, [each.value for each in closed.reaches]).call(given.all)
    reading = Reading(Dimension.NUMBER)
    claims = [
        Claim(f"reach limb {each.limb}", Sense.MIN, value, reading, "reach", 0.0)
        for each, value in zip(closed.reaches, values, strict=True)
    ]
    return layout, claims


def _after_newton(found: Regularity, problem: Problem, matrix: RankMatrix, family: Family | None = None) -> Regularity:
    """Return a verdict, refuted where it was open and Newton's method finds a singular pose from random ones."""
    if found.outcome is not Outcome.OPEN or problem.dependent:
        return found
    newton, free = SingularPose(problem, matrix), list(problem.free)
    points = problem.box.random(_POSES, np.random.default_rng(_SEED))[:, free]
    values = np.array([newton.smallest(each) for each in points])
    searches = [newton.search]
    if family is not None:
        searches.append(SingularMachine(family, family.matrix(matrix)).search)
    for search in searches:
        for k in np.argsort(values)[:_WORST]:
            z = search(points[k]) if np.isfinite(values[k]) else None
            if z is not None:
                y = frozen_array(problem.pose_of(z), (6,))
                centres = family.errors_of(z) if family is not None and len(z) > len(free) else None
                return replace(found, outcome=Outcome.REFUTED, y=y, sides=None, reason=BY_NEWTON, centres=centres)
    return found


def not_judged(box: PoseBox, reason: str) -> Regularity:
    """Return the verdict on a robot that no search covers."""
    return Regularity(Outcome.OPEN, box, None, None, "numpy", 0, 1, 1.0, 0.0, reason)
