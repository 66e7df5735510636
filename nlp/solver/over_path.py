"""A design that is regular and keeps its limits at every point of a programmed path, by the exchange of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...models import axis_angle_from_matrix
from ..case.case import Case
from ..interruption import one_call
from ..path.reader import path_of_case
from ..program.formulation import formulate
from ..proof.statement.claims import REGULAR
from ..proof.workspace.path_judge import PathJudgement, judge_path
from ..proof.workspace.robot.pose_box import PoseNumbers
from ..proof.workspace.verdict import Outcome
from .multistart import ProgramSolution
from .pose_constraints import TIGHTER, BindingPose, PoseConstraints
from .semi_infinite import (
    GAP,
    ExchangeProgress,
    SolveOne,
    check_one_pose,
    design_of,
    exchanged,
    faults_of_numbers,
    with_objective,
)


@dataclass(frozen=True, eq=False)
class PathProof:
    """The proof of a design along its path.

    Attributes:
        judgement: of the design.
        poses: poses of the constraints, in the order in which they were found.
        history: F, and the number of claims that were not proved, of each design in turn.
        tighter: part of themselves by which the limits of the constraints are tighter than those of the case.
    """

    judgement: PathJudgement
    poses: tuple[BindingPose, ...]
    history: tuple[tuple[float, int], ...]
    tighter: float = TIGHTER

    @property
    def is_proved(self) -> bool:
        """Whether the design is regular and keeps its limits at every point."""
        return self.judgement.is_proved


@one_call
def solve_over_path(
    case: Case, solve_one: SolveOne, *, progress: ExchangeProgress | None = None
) -> tuple[ProgramSolution, PathProof | None]:
    """Return the solution of a case whose limits hold along its path, and the proof; None without an answer.

    Args:
        case: a case with one task and one stated pose.
        solve_one: solves a program.
        progress: called after each exchange.

    Raises:
        CaseError: the case has several tasks or poses.
        InputError: the file of the path cannot be read or holds what is not read, the path has angles that are not
            covered, or the C kernel was not built.
    """
    check_one_pose(case)
    path, nlp = path_of_case(case), formulate(case)
    start = path.poses_at([0], 0.0)
    middle = PoseNumbers(start.positions[0], start.rotations[0], *axis_angle_from_matrix(start.rotations[0]))

    def judged(solved: ProgramSolution) -> tuple[Case, PathJudgement, list[BindingPose | None]]:
        found = judge_path(with_objective(design_of(case, solved.nlp, solved.x), solved.F), path, gap=GAP)
        return found.case, found, list(_faults(found))

    done = exchanged(nlp, PoseConstraints(nlp, case, middle), judged, solve_one, progress)
    if done.judgement is None:
        return done.found, None
    return done.found, PathProof(done.judgement, done.poses, done.history)


def _faults(judged: PathJudgement) -> Iterator[BindingPose | None]:
    """Yield a pose for each claim that is not proved; None for one that is open without a pose."""
    for each in judged.ranks:
        if each.outcome is not Outcome.PROVED:
            is_known = each.name == REGULAR and each.pose is not None
            yield BindingPose(each.name, each.pose) if is_known and each.pose is not None else None
    yield from faults_of_numbers(judged.extremes)
