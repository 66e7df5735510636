"""A design that is regular and keeps its limits at every point of a programmed path, by the exchange of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

from ..case.case import Case
from ..path.placing import in_frame, in_world, placed
from ..path.reader import path_of_case, stated_path
from ..program.nlp import Nlp
from ..proof.statement.claims import REGULAR
from ..proof.workspace.path_judge import PathJudgement, judge_path
from ..proof.workspace.verdict import Outcome
from .frames import Frame, pose_of
from .multistart import ProgramSolution
from .placement import with_place
from .pose_constraints import TIGHTER, BindingPose, PoseConstraints
from .semi_infinite import Exchange, Judging, SemiInfinite, design_of, faults_of_numbers, with_objective


@dataclass(frozen=True, eq=False)
class PathProof:
    """The proof of a design along its path.

    Attributes:
        judgement: of the design.
        place: (6,) of the path's frame: position, then roll, pitch and yaw, radians.
        poses: poses of the constraints, in the order in which they were found.
        history: F, and the number of claims that were not proved, of each design in turn.
        tighter: part of themselves by which the limits of the constraints are tighter than those of the case.
    """

    judgement: PathJudgement
    place: tuple[float, ...]
    poses: tuple[BindingPose, ...]
    history: tuple[tuple[float, int], ...]
    tighter: float = TIGHTER

    @property
    def is_proved(self) -> bool:
        """Whether the design is regular and keeps its limits at every point."""
        return self.judgement.is_proved


def over_path(case: Case, nlp: Nlp) -> SemiInfinite[PathJudgement, PathProof]:
    """Return a program of a case whose limits hold along its path.

    Args:
        case: the case.
        nlp: its program with limits at the stated poses.

    Raises:
        InputError: the file of the path cannot be read, or holds what is not read.
    """
    nlp, numbers, frame = with_place(nlp, case)
    path = path_of_case(case) if frame is None else stated_path(case)
    start = path.poses_at([0], 0.0)
    first = pose_of(start.positions[0], start.rotations[0])

    def judge(solved: ProgramSolution, gap: float) -> Judging[PathJudgement]:
        place = numbers(solved.x)
        along = path if frame is None else placed(path, place.tolist())
        found = judge_path(with_objective(design_of(case, solved.nlp, solved.x), solved.F), along, gap=gap)
        faults = list(_faults(found))
        found = replace(found, case=replace(found.case, limits=case.limits))  # the level is no limit of the case
        if frame is not None:
            faults = [None if each is None else each.moved(partial(in_frame, place)) for each in faults]
        return Judging(found.case, found, faults)

    def proof(done: Exchange[PathJudgement]) -> PathProof:
        place, poses = numbers(done.found.x), done.poses
        if frame is not None:
            poses = tuple(each.moved(partial(in_world, place)) for each in poses)
        return PathProof(done.judgement, tuple(place.tolist()), poses, done.history, done.tighter)

    constraints = PoseConstraints(nlp, case, first, None if frame is None else Frame(frame, is_path=True))
    return SemiInfinite(nlp, constraints, judge, proof)


def _faults(judged: PathJudgement) -> Iterator[BindingPose | None]:
    """Yield a pose for each claim that is not proved; None for one that is open without a pose."""
    for each in judged.ranks:
        if each.outcome is not Outcome.PROVED:
            is_known = each.name == REGULAR and each.pose is not None
            yield BindingPose(each.name, each.pose) if is_known and each.pose is not None else None
    yield from faults_of_numbers(judged.extremes)
