"""Semi-infinite programming by exchange of poses: regular designs that satisfy limits over a workspace.

A limit over a workspace is one constraint at each of its poses. A program with a few of them is solved, and its design
is judged over the whole workspace (:mod:`screwsynth.nlp.proof.workspace`). Poses that refute a claim become constraints
of this claim, until the proof succeeds.

The constraints are a little tighter than the limits of the case: a design exactly on a limit at the worst known poses
would violate it at a nearby pose, and the exchange would never end. Where no design satisfies this margin, the margin
shrinks, with tighter proofs. A case is infeasible only if no design satisfies its limits, without any margin, at the
known poses.

Source: J. W. Blankenship, J. E. Falk, *Infinitely constrained optimization problems*, J. Optim. Theory Appl. 19 (1976).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.joints.model.closedform import closed_form
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.forces import dimension_of_measure
from ..case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from ..case.limits.limits import Limits
from ..case.limits.objective import ObjectiveLimit
from ..case.pose import Free, Rotation
from ..case.task import Method, Sense
from ..errors import CaseError
from ..evidence.state import stated_poses
from ..interruption import is_requested, one_call
from ..path.path import SymbolicPose
from ..program.nlp import Nlp
from ..proof.enclosure.engine import kernel
from ..proof.statement.claims import REGULAR
from ..proof.statement.fixed_robot import JointErrors, workspace_of_case
from ..proof.statement.posed_layout import reach_claims
from ..proof.workspace.judge import judge_workspace
from ..proof.workspace.judgement import Judgement
from ..proof.workspace.numbers.extremes import NumberSearch, prove_extreme
from ..proof.workspace.verdict import Outcome, Verdict, not_judged
from .frames import Frame, excursion_from, excursion_to
from .multistart import ProgramSolution
from .pose_constraints import TIGHTER, BindingPose, PoseConstraints, with_margin
from .status import Status

#: Gap of the proofs: several of them fit between a constraint's bound and the limit of the case.
GAP = 2e-4
#: Parts of the margin and of the gap, in the order in which they are tried; the last two have the same gap.
_PARTS = (1.0, 1e-1, 1e-2, 1e-3, 0.0)
#: Relative amount by which a minimised level may be larger over the workspace.
LEVEL_ROOM = 1e-3
#: Reason why ranks are not judged.
_UNREACHED = "a limb does not reach every pose, so the rank of J is not checked"
#: Largest number of exchanges.
MOST_EXCHANGES = 40

#: Function that solves a program from given points, followed by sampled ones.
SolveOne = Callable[[Nlp, Sequence[FloatArray]], ProgramSolution]


@dataclass(frozen=True, eq=False)
class ExchangeProof:
    """Proof of a solved design over a workspace or along a path, by exchange of poses.

    Attributes:
        judgement: verdicts on the design.
        poses: poses that became constraints, in the order in which they were added.
        history: F and the number of unproved claims of each design, in order.
        first: verdicts on the first design, with limits at the stated poses only.
        tighter: relative amount by which the constraints are tighter than the limits of the case.
        place: (6,) pose of the path's frame in the world: position, then roll, pitch and yaw, radians; empty for a
            workspace.
    """

    judgement: Judgement
    poses: tuple[BindingPose, ...]
    history: tuple[tuple[float, int], ...]
    first: Judgement
    tighter: float = TIGHTER
    place: tuple[float, ...] = ()

    @property
    def is_proved(self) -> bool:
        """Whether the design is proved to be regular and to satisfy its limits at every pose."""
        return self.judgement.is_proved


class JudgedDesign(NamedTuple):
    """Design with the verdicts at every pose of a set: a workspace or a path.

    Attributes:
        design: design, with the set of poses as its workspace.
        judgement: verdicts on the design.
        faults: for each unproved claim, a pose at which the claim fails; None for an undecided claim without a pose.
    """

    design: Case
    judgement: Judgement
    faults: Sequence[BindingPose | None]


class SemiInfinite(NamedTuple):
    """Semi-infinite program: its limits hold at every pose of a set, a workspace or a path.

    Attributes:
        nlp: nonlinear program without constraints at poses.
        constraints: constraints at poses; none at the beginning.
        judge: function that judges the design of a solution, with a gap.
        in_world: function that converts the poses of a proof to the world frame, for a point (n,) of the program.
    """

    nlp: Nlp
    constraints: PoseConstraints
    judge: Callable[[ProgramSolution, float], JudgedDesign]
    in_world: Callable[[ExchangeProof, FloatArray], ExchangeProof]


def over_workspace(case: Case, nlp: Nlp) -> SemiInfinite:
    """Return the semi-infinite program of a case: its nonlinear program, with limits over the workspace.

    Args:
        case: the case.
        nlp: nonlinear program of the case with limits at the stated poses.
    """
    frame = None
    if case.workspace is not None and case.workspace.about_pose:
        # The workspace and its constraints move with the pose.
        robot = nlp.program.robot
        frame = Frame(SymbolicPose(robot.position, robot.rotation))

    def judge(solved: ProgramSolution, gap: float) -> JudgedDesign:
        design = design_of(case, solved.nlp, solved.x)
        found = _judged(with_objective(design, solved.F), gap)
        faults = list(faults_of(found))
        if frame is not None:
            move = partial(excursion_from, Frame.at(frame.place, nlp, solved.x[: nlp.n]))
            faults = [None if each is None else each.moved(move) for each in faults]
        # The level is not a limit of the case.
        return JudgedDesign(design, replace(found, case=design), faults)

    def in_world(proof: ExchangeProof, x: FloatArray) -> ExchangeProof:
        if frame is None:
            return proof
        move = partial(excursion_to, Frame.at(frame.place, nlp, x[: nlp.n]))
        return replace(proof, poses=tuple(each.moved(move) for each in proof.poses))

    return SemiInfinite(nlp, PoseConstraints(nlp, case, frame=frame), judge, in_world)


def check_exchange(case: Case) -> None:
    """Refuse a case that the exchange of poses cannot solve, and a missing C kernel.

    Raises:
        CaseError: the case averages its tasks, or combines tasks along a path with a free place.
        InputError: the C kernel was not built.
    """
    if len(case.tasks) > 1 and case.method is Method.AVERAGE:
        fault = f"must be 'weighted-sum' or 'worst-case' with limits {case.limits_where}: an average ignores limits"
        raise CaseError("combine.method", fault, case.method.value, case.source)
    if len(case.tasks) > 1 and case.path is not None and any(isinstance(each, Free) for each in case.path.place):
        raise CaseError("path.place", "must be fixed if several tasks are combined", source=case.source)
    kernel()  # a missing kernel is reported before any solve


@one_call
def exchanged(
    problem: SemiInfinite, solve_one: SolveOne, first: Sequence[FloatArray] = ()
) -> tuple[ProgramSolution, ExchangeProof | None]:
    """Return the solution with limits at every pose of a set, and the proof; the proof is None without an answer.

    An unproved design at the end of the exchange is not an answer. If a stop is requested, the result is the last
    judged design.

    Args:
        problem: program with limits at every pose of a set.
        solve_one: function that solves a program.
        first: points (n,) of the program to start from.
    """
    nlp, constraints = problem.nlp, problem.constraints
    binding, history, judgements = list[BindingPose](), list[tuple[float, int]](), list[Judgement]()
    found, parts, last = solve_one(nlp, first), list(_PARTS), None
    while found.status.is_answer:
        gap = GAP * (parts[0] or _PARTS[-2])
        design, judged, faults = problem.judge(found, gap)
        judgements.append(judged)
        history.append((found.F, len(faults)))
        fresh = [each for each in faults if each is not None and not any(map(each.is_same, binding))]
        fresh = constraints.added(design, fresh, found.x, gap / GAP)
        if faults:
            found = replace(found, status=Status.INTERRUPTED if is_requested() else Status.NOT_PROVED)
        proof = ExchangeProof(judged, tuple(binding), tuple(history), judgements[0], TIGHTER * parts[0])
        last = found, problem.in_world(proof, found.x)
        if not faults or not fresh or len(history) >= MOST_EXCHANGES or is_requested():
            return last
        binding += fresh
        nlp = constraints.program
        start = np.concatenate([found.x, nlp.start[len(found.x) :]])
        found, parts = _solve_within(nlp, solve_one, start, parts)
    if last is None or found.status is not Status.INTERRUPTED:
        return found, None
    return replace(last[0], status=Status.INTERRUPTED), last[1]


def _solve_within(
    nlp: Nlp, solve_one: SolveOne, start: FloatArray, parts: Sequence[float]
) -> tuple[ProgramSolution, list[float]]:
    """Return the solution with the largest safety margin that a design satisfies, and the remaining margins.

    Args:
        nlp: nonlinear program with the whole margin.
        solve_one: function that solves a program.
        start: (n,) point to start from.
        parts: fractions of the whole margin, in the order in which they are tried.

    Returns:
        The solution, and the fractions from its margin on. If the limits of the case cannot be satisfied either, the
        solution has no answer, and the only fraction is 0.
    """
    found = solve_one(with_margin(nlp, parts[0]), [start])
    if found.status.is_answer or found.status is Status.INTERRUPTED or not parts[0]:
        return found, list(parts)
    stated = solve_one(with_margin(nlp, 0.0), [start, found.x])
    if not stated.status.is_answer:
        return stated, [0.0]
    for k, part in enumerate(parts[1:-1], 1):
        found = solve_one(with_margin(nlp, part), [stated.x])
        if found.status.is_answer or found.status is Status.INTERRUPTED:
            return found, list(parts[k:])
    return stated, [0.0]


def with_objective(design: Case, level: float) -> Case:
    """Return a design with a limit on the objective over all poses: slightly above the level."""
    measure, sense = design.tasks[0].measure, design.tasks[0].sense
    if design.worst_everywhere:
        allowed = level - sense.sign * LEVEL_ROOM * abs(level)
        worst = ObjectiveLimit(min=allowed) if sense is Sense.MAX else ObjectiveLimit(max=allowed)
        return replace(design, limits=Limits(*design.limits, worst))
    kinds = {each.key: each for each in (ActuatorForce, ActuatorSpeed, ActuatorPower)}
    if not measure:
        return design
    own = next((each for each in design.limits if each.name == measure), None)
    dimension = dimension_of_measure(measure, driven_joints(design.model)[0])
    most = design.units.to_internal(level * (1 + LEVEL_ROOM), dimension)
    ends = {end: getattr(own, end) for end in ("min", "max") if getattr(own, end, None) is not None}
    limit = kinds[measure](**{**ends, "max": min(most, ends.get("max", most))})
    return replace(design, limits=Limits(*(each for each in design.limits if each is not own), limit))


def _judged(case: Case, gap: float) -> Judgement:
    """Return the verdicts on a design over its workspace; only verdicts on reach if a limb cannot reach every pose."""
    closed, workspace = closed_form(case.model), workspace_of_case(case)
    # Poses that the robot cannot take are no evidence about the reach of its limbs.
    if workspace.position_set is not None:
        # Programs have the box of a set, so that sampled poses are tested first.
        found_first = judge_workspace(case, gap=gap, jobs=1, with_objective=False, until_fault=True)
        if found_first.is_refuted:
            return found_first
    elif closed.reaches and not workspace.dependent:
        layout, claims = reach_claims(case, closed, workspace)
        found = tuple(prove_extreme(layout, claim, NumberSearch(gap, 1)) for claim in claims)
        if any(each.outcome is not Outcome.PROVED for each in found):
            return Judgement(case, workspace, (not_judged(REGULAR, _UNREACHED), *found))
    return judge_workspace(case, gap=gap, jobs=1, with_objective=False)


def design_of(case: Case, nlp: Nlp, x: FloatArray) -> Case:
    """Return a case with the dimensions of a point (n,) of its program, all fixed.

    If the workspace lies about the stated pose, the case also has the pose of the point.
    """
    values = nlp.program.kernels.robot_state(x, nlp.arguments).parameters.ravel().tolist()
    parameters, begin = {}, 0
    for item in case.model.parameters:
        count = len(item.components)
        parts = values[begin : begin + count]
        parameters[item.name] = parts[0] if count == 1 else parts
        begin += count
    if case.workspace is None or not case.workspace.about_pose:
        return replace(case, parameters=parameters)
    pose = stated_poses(nlp, x)[0]
    rotation = Rotation(pose.axis, pose.angle, case.rotation.form)
    return replace(case, parameters=parameters, position=pose.position, rotation=rotation)


def faults_of(judged: Judgement) -> Iterator[BindingPose | None]:
    """Yield, for each unproved claim, a pose at which the claim fails; None for an undecided claim without a pose.

    There is no constraint for the rank of the constraint wrenches.
    """
    for each in (rank for rank in judged.ranks if rank.fails):
        is_known = each.name == REGULAR and each.pose is not None
        yield BindingPose(each.name, each.pose, None, _errors(each.errors)) if is_known and each.pose else None
    yield from _faults_of_numbers(judged.extremes)


def _faults_of_numbers(extremes: Sequence[Verdict]) -> Iterator[BindingPose | None]:
    """Yield a pose for each unproved limited quantity; None for an undecided quantity without a pose."""
    by_name = {(each.name, each.sense): each for each in extremes}
    for each in extremes:
        if not each.fails:
            continue
        if each.pose is None:
            yield None
        elif each.key.startswith("actuator."):
            limb = each.name.partition(" limb ")[2]
            short, long = (by_name[f"leg_length limb {limb}", sense].pose for sense in (Sense.MIN, Sense.MAX))
            yield None if short is None else BindingPose(each.name, short, long, _errors(each.errors))
        else:
            yield BindingPose(each.name, each.pose, None, _errors(each.errors))


def _errors(found: JointErrors | None) -> FloatArray | None:
    """Return the joint-centre errors (m, 3) of a robot within the tolerance; None for the nominal robot."""
    return None if found is None else found.vectors
