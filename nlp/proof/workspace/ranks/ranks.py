"""Ranks of any robot over a workspace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray, Model
from ....errors import UncoveredError
from ...statement.claims import CONSTRAINTS, REGULAR
from ...statement.machine import Legs
from ..home_poses import Homes
from ..regular.signs import SignRefuter
from ..robot.motion_matrix import RankMatrix
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, Problem, build_problem
from ..robot.tolerance_model import Family
from ..tolerance.singular_machine import SingularMachine
from ..verdict import Outcome, Regularity
from .search import NewtonRefuter, RankProgress, Refuter, prove_rank, singular_at
from .singular_pose import SingularPose

if TYPE_CHECKING:
    from ..proof_record import PaperRecord

#: Random poses from which Newton's method looks for a singular one, and number of the worst that are tried.
_POSES, _WORST = 2048, 8
_SEED = 0


class Ranks(NamedTuple):
    """Verdicts on J, and on the constraint wrenches; None for a robot without them."""

    regular: Regularity
    constraints: Regularity | None


def prove_ranks(
    model: Model,
    homes: Homes,
    *,
    legs: Legs | None = None,
    progress: RankProgress | None = None,
    paper: PaperRecord | None = None,
) -> Ranks:
    """Prove that J and the constraint wrenches keep their ranks at every pose of a box, or find a pose.

    Args:
        model: the robot, without unknowns that follow in closed form.
        homes: the case, its poses and the machines that are meant.
        legs: joint centres of six straight legs; None for another robot.
        progress: called during them.
        paper: records the searches for a proof.
    """
    box = homes.box
    try:
        family = None if homes.machines is None else homes.machines.family
        problem = build_problem(homes.case, model, box) if family is None else family.problem
        prove = partial(prove_rank, problem, family=family, progress=progress)
        shown = partial(_is_shown, problem, family, homes)
        found = []
        for name, matrix in ((REGULAR, problem.locked), (CONSTRAINTS, problem.unactuated)):
            if matrix is not None:
                recorder = None if paper is None or (legs is None and family is not None) else paper.own(name)
                is_shown = partial(shown, constraints=name == CONSTRAINTS)
                refuter: Refuter
                if legs is None:
                    refuter = NewtonRefuter(problem, matrix, family, is_shown)
                else:
                    refuter = SignRefuter(legs, problem)
                found.append(prove(matrix, recorder=recorder, refuter=refuter))
        regular, constraints = found[0], found[1] if len(found) > 1 else None
    except (UncoveredError, NotJudgedError) as error:
        return Ranks(not_judged(box, str(error)), None)
    is_shown = partial(shown, constraints=False)
    return Ranks(_after_newton(regular, problem, problem.locked, None if legs else family, is_shown), constraints)


def _is_shown(problem: Problem, family: Family | None, homes: Homes, z: FloatArray, *, constraints: bool) -> bool:
    """Return whether a singular point, or one of another machine, is singular in home's assembly."""
    at = singular_at(problem, family, z)
    return homes.is_singular(at.y, at.centres, constraints=constraints)


def _after_newton(
    found: Regularity,
    problem: Problem,
    matrix: RankMatrix,
    family: Family | None,
    is_shown: Callable[[FloatArray], bool],
) -> Regularity:
    """Return a verdict, refuted where it was open and Newton's method finds a singular pose from random ones."""
    if found.outcome is not Outcome.OPEN or problem.dependent:
        return found
    newton = SingularPose(problem, matrix)
    points = problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(problem.free)]
    values = np.array([newton.smallest(each) for each in points])
    searches: list[Callable[[FloatArray], FloatArray | None]] = [newton.search]
    if family is not None:
        searches.append(SingularMachine(family, family.matrix(matrix)).search)
    for search in searches:
        for k in np.argsort(values)[:_WORST]:
            z = search(points[k]) if np.isfinite(values[k]) else None
            if z is not None and is_shown(z):
                at = singular_at(problem, family, z)
                return replace(found, outcome=Outcome.REFUTED, y=at.y, reason=at.reason, centres=at.centres)
    return found


def not_judged(box: PoseBox, reason: str) -> Regularity:
    """Return the verdict on a robot that no search covers."""
    return Regularity(Outcome.OPEN, box, None, None, "none", 0, 1, 1.0, 0.0, reason)
