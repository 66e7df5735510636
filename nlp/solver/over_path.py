"""Optimisation with regular poses and satisfied limits everywhere along a tool path, by exchange of poses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ...models import FloatArray
from ..case.case import Case
from ..path.placing import in_frame, in_world, placed
from ..path.reader import path_of_case, stated_path
from ..program.nlp import Nlp
from ..proof.workspace.path_judge import judge_path
from .frames import Frame, pose_of
from .multistart import ProgramSolution
from .placement import with_place
from .pose_constraints import PoseConstraints
from .semi_infinite import ExchangeProof, JudgedDesign, SemiInfinite, design_of, faults_of, with_objective


def over_path(case: Case, nlp: Nlp) -> SemiInfinite:
    """Return the semi-infinite program of a case: its nonlinear program, with limits along the path.

    Args:
        case: the case.
        nlp: nonlinear program of the case with limits at the stated poses.

    Raises:
        InputError: the path's file cannot be read, or has a word that is not supported.
    """
    nlp, numbers, frame = with_place(nlp, case)
    path = path_of_case(case) if frame is None else stated_path(case)
    start = path.poses_at([0], 0.0)
    first = pose_of(start.positions[0], start.rotations[0])

    def judge(solved: ProgramSolution, gap: float) -> JudgedDesign:
        place = numbers(solved.x)
        along = path if frame is None else placed(path, place.tolist())
        found = judge_path(with_objective(design_of(case, solved.nlp, solved.x), solved.F), along, gap=gap)
        faults = list(faults_of(found))
        found = replace(found, case=replace(found.case, limits=case.limits))  # the level is not a limit of the case
        if frame is not None:
            faults = [None if each is None else each.moved(partial(in_frame, place)) for each in faults]
        return JudgedDesign(found.case, found, faults)

    def world(proof: ExchangeProof, x: FloatArray) -> ExchangeProof:
        place, poses = numbers(x), proof.poses
        if frame is not None:
            poses = tuple(each.moved(partial(in_world, place)) for each in poses)
        return replace(proof, place=tuple(place.tolist()), poses=poses)

    constraints = PoseConstraints(nlp, case, first, None if frame is None else Frame(frame, is_path=True))
    return SemiInfinite(nlp, constraints, judge, world)
