"""Ranks of any robot over a workspace."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from .....models import FloatArray, Model
from ....errors import UncoveredError
from ...statement.claims import CONSTRAINTS, REGULAR
from ...statement.machine import Legs
from ..home_poses import Homes
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, Problem, build_problem
from ..robot.tolerance_model import Family
from ..verdict import Outcome, Regularity
from .search import NewtonRefuter, RankProgress, prove_rank, singular_at
from .signs import SignRefuter

if TYPE_CHECKING:
    from ..proof_record import PaperRecord


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
    try:
        family = None if homes.machines is None else homes.machines.family
        problem = build_problem(homes.case, model, homes.box) if family is None else family.problem
        found = []
        for name, matrix in ((REGULAR, problem.locked), (CONSTRAINTS, problem.unactuated)):
            if matrix is None:
                continue
            recorder = None if paper is None else paper.own(name)
            is_shown = partial(_is_shown, problem, family, homes, constraints=name == CONSTRAINTS)
            newton = NewtonRefuter(problem, matrix, None if legs else family, is_shown)
            refuter = newton if legs is None else SignRefuter(legs, problem)
            verdict = prove_rank(problem, matrix, family=family, progress=progress, recorder=recorder, refuter=refuter)
            if name == REGULAR and verdict.outcome is Outcome.OPEN and not problem.dependent:
                at = newton.from_random()
                if at is not None:
                    verdict = replace(verdict, outcome=Outcome.REFUTED, y=at.y, reason=at.reason, centres=at.centres)
            found.append(verdict)
    except (UncoveredError, NotJudgedError) as error:
        return Ranks(not_judged(homes.box, str(error)), None)
    return Ranks(found[0], found[1] if len(found) > 1 else None)


def _is_shown(problem: Problem, family: Family | None, homes: Homes, z: FloatArray, *, constraints: bool) -> bool:
    """Return whether a singular point, or one of another machine, is singular in home's assembly."""
    at = singular_at(problem, family, z)
    return homes.is_singular(at.y, at.centres, constraints=constraints)


def not_judged(box: PoseBox, reason: str) -> Regularity:
    """Return the verdict on a robot that no search covers."""
    return Regularity(Outcome.OPEN, box, None, None, "none", 0, 1, 1.0, 0.0, reason)
