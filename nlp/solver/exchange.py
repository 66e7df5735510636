"""A design that is regular and keeps its limits over a continuous workspace, by exchange of poses.

A limit over a workspace is one constraint for each of its poses. A program with a few of them is solved, its design is
judged over the whole workspace (:mod:`screwsynth.nlp.proof.workspace`), and the poses that refute a claim become
constraints, each of the one claim that it refutes, until the proof holds.

In these constraints every limit is a little tighter than in the case: a design that lies exactly on a limit at the
worst of the poses known is beyond it at some pose nearby, and only poses without end would end the exchange.

Source: J. W. Blankenship, J. E. Falk, *Infinitely constrained optimization problems*, J. Optim. Theory Appl. 19 (1976).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, RobotInstance, Substitution, instantiate
from ..case.case import Case
from ..case.limits.clearance import LegClearance
from ..case.limits.constraint import NUMBER, BoundedConstraint, Constraint
from ..case.limits.joints import JointAngle
from ..case.limits.legs import Actuator
from ..case.limits.limit import Design, PosedRobot
from ..case.task import Sense
from ..errors import CaseError
from ..interruption import is_requested, one_call
from ..program.formulation import formulate
from ..program.nlp import Nlp
from ..proof.enclosure.engine import kernel
from ..proof.statement.machine import has_straight_legs
from ..proof.workspace.judge import Judgement, judge_workspace
from ..proof.workspace.robot.pose_box import PoseNumbers, pose_box
from ..proof.workspace.verdict import Outcome
from .binding import BindingPose, Distinct, points_around
from .machines import machine_of, on_plates, with_spans_of
from .multistart import ProgramSolution
from .otherclaims import OtherClaims, judge
from .tighter import TIGHTER, tightened

#: Gap of the proofs: several of them fit between a limit of the constraints and that of the case.
_GAP = 2e-4
#: Part of the determinant of the rows at the middle of the workspace that is demanded at a singular pose.
_DETERMINANT = 1e-2
#: Largest number of exchanges.
MOST_EXCHANGES = 40

#: Solves a program, from points that come before those that the search samples.
SolveOne = Callable[[Nlp, Sequence[FloatArray]], ProgramSolution]
#: Called after each exchange with the number of exchanges, F, and the number of claims that are not proved.
ExchangeProgress = Callable[[int, float, int], None]


@dataclass(frozen=True, eq=False)
class WorkspaceProof:
    """The proof of a design over its workspace.

    Attributes:
        judgement: of the design.
        poses: poses of the constraints, in the order in which they were found.
        history: F, and the number of claims that were not proved, of each design in turn.
        first: the design that keeps the limits at the stated pose alone: its judgement.
        tighter: part of themselves by which the limits of the constraints are tighter than those of the case.
    """

    judgement: Judgement
    poses: tuple[BindingPose, ...]
    history: tuple[tuple[float, int], ...]
    first: Judgement
    tighter: float = TIGHTER

    @property
    def is_proved(self) -> bool:
        """Whether the design is regular and keeps its limits at every pose."""
        return not _faults(self.judgement)


class Exchanged(NamedTuple):
    """The last program's solution, and the judgement of its design; None where the program has no answer."""

    own: ProgramSolution
    proof: WorkspaceProof | None


@one_call
def solve_over_workspace(case: Case, solve_one: SolveOne, *, progress: ExchangeProgress | None = None) -> Exchanged:
    """Return the solution of a case whose limits hold over its workspace, and the proof.

    Args:
        case: a case with one task and one stated pose.
        solve_one: solves a program.
        progress: called after each exchange.

    Raises:
        CaseError: the case has several tasks or poses, or a tolerance on joint centres of a robot that is not six
            straight legs.
        InputError: the C kernel was not built.
    """
    _check(case)
    kernel()  # before any solve where it is missing
    bare = formulate(case)
    nlp, binding, history = bare, list[BindingPose](), list[tuple[float, int]]()
    others = None if has_straight_legs(case.model) else OtherClaims(bare, case)
    first: Judgement | None = None
    found = solve_one(nlp, ())
    while found.status.is_answer:
        design = design_of(case, nlp, found.x)
        if others is None:
            judged = judge_workspace(design, gap=_GAP, jobs=1, with_objective=False)
        else:
            judged = judge(design, gap=_GAP)
        first = judged if first is None else first
        faults = _faults(judged)
        history.append((found.F, len(faults)))
        if progress is not None:
            progress(len(history), found.F, len(faults))
        fresh = [each for each in faults if each is not None and not _is_known(each, binding)]
        if others is not None:
            fresh = others.added(design, fresh, found.x)
        if not faults or not fresh or len(history) >= MOST_EXCHANGES or is_requested():
            return Exchanged(found, WorkspaceProof(judged, tuple(binding), tuple(history), first))
        if others is None:
            binding += _without_images(bare, case, fresh, found.x)
            nlp, point = with_binding_poses(bare, case, binding), found.x
        else:
            binding += fresh
            nlp = others.program
            point = np.concatenate([found.x, nlp.start[len(found.x) :]])
        found = solve_one(nlp, [point])
    return Exchanged(found, None)


def design_of(case: Case, nlp: Nlp, x: FloatArray) -> Case:
    """Return a case with the dimensions of a point (n,) of its program, all fixed."""
    values = nlp.program.kernels.robot_state(x, nlp.arguments).parameters.ravel().tolist()
    parameters, begin = {}, 0
    for item in case.model.parameters:
        count = len(item.components)
        parts = values[begin : begin + count]
        parameters[item.name] = parts[0] if count == 1 else parts
        begin += count
    return replace(case, parameters=parameters)


def with_binding_poses(nlp: Nlp, case: Case, binding: Sequence[BindingPose]) -> Nlp:
    """Return a program with further constraints: claims at poses of the workspace.

    Args:
        nlp: the program without them.
        case: the case.
        binding: the poses.
    """
    added = [item for k, each in enumerate(binding) for item in _constraints(nlp, case, each, k)]
    return nlp.with_constraints(added)


def _check(case: Case) -> None:
    """Refuse a case whose limits are not judged over a workspace.

    Raises:
        CaseError: it is refused.
    """
    if len(case.tasks) > 1 or case.pose_count > 1:
        raise CaseError("limits.over", "needs a case with one task and one stated pose", "workspace", case.source)
    if has_straight_legs(case.model):
        return
    if case.joint_centre_tolerance:
        fault = "needs a robot with six straight legs, or no [tolerance] joint_centre"
        raise CaseError("limits.over", fault, "workspace", case.source)
    for limit in case.limits:
        if isinstance(limit, Actuator | LegClearance):
            fault = f"needs a robot with six straight legs, or no limits.{limit.key}"
            raise CaseError("limits.over", fault, "workspace", case.source)


def _faults(judged: Judgement) -> list[BindingPose | None]:
    """Return a pose for each claim that is not proved; None for one that is open without a pose."""
    faults: list[BindingPose | None] = []
    regular = judged.regularity
    if regular is not None and regular.outcome is not Outcome.PROVED:
        faults.append(None if regular.pose is None else BindingPose("regular", regular.pose, None, regular.errors))
    if judged.constraints is not None and judged.constraints.outcome is not Outcome.PROVED:
        faults.append(None)
    by_name = {(each.name, each.sense): each for each in judged.extremes}
    for each in judged.extremes:
        if not each.fails:
            continue
        if each.pose is None:
            faults.append(None)
        elif each.key.startswith("actuator."):
            limb = each.name.partition(" limb ")[2]
            short, long = (by_name[f"leg_length limb {limb}", sense].pose for sense in (Sense.MIN, Sense.MAX))
            faults.append(None if short is None else BindingPose(each.name, short, long, each.errors))
        else:
            faults.append(BindingPose(each.name, each.pose, None, each.errors))
    return faults


def _is_known(one: BindingPose, others: Sequence[BindingPose]) -> bool:
    """Return whether a pose is a constraint of the same claim already, with the same machine."""
    return any(
        one.name == other.name
        and _are_same(one.pose, other.pose)
        and _are_same(one.longest, other.longest)
        and (one.errors is other.errors or np.array_equal(one.errors or (), other.errors or ()))
        for other in others
    )


def _are_same(one: PoseNumbers | None, other: PoseNumbers | None) -> bool:
    """Return whether two poses are the same, to the last bit."""
    if one is None or other is None:
        return one is other
    return bool(np.array_equal(one.position, other.position) and np.array_equal(one.rotation, other.rotation))


def _without_images(nlp: Nlp, case: Case, fresh: Sequence[BindingPose], x: FloatArray) -> list[BindingPose]:
    """Return poses without those whose constraints only repeat another: the images of a pose in a symmetric robot.

    Two constraints of one kind are the same where they differ by less than they are tighter than their limits, at a
    design (n,) and at designs around it. With both a program would have no unique multipliers.
    """
    points = points_around(nlp, x)
    kept, distinct = list[BindingPose](), Distinct()
    for each in fresh:
        items = list(_constraints(nlp, case, each, 0))
        expressions = ca.vertcat(SX(0, 1), *[item.constraint.expression for item in items])
        function = ca.Function("constraints", [nlp.program.x, nlp.program.p], [ca.densify(expressions)])
        values = np.array([function(point, nlp.arguments).full().ravel() for point in points])
        if distinct.adds(each.name.partition(" ")[0], values):
            kept.append(each)
    return kept


def _constraints(nlp: Nlp, case: Case, binding: BindingPose, k: int) -> Iterator[BoundedConstraint]:
    """Yield the constraints of a claim at its pose, with limits that are a little tighter."""
    where = f" workspace pose {k + 1}"
    exact = _robot_at(nlp, case, binding.pose)
    robot = exact if binding.errors is None else machine_of(exact, case, binding.errors)
    if binding.name == "regular":
        yield _regular(nlp, case, robot, where)
        return
    names = tuple(task.name for task in case.tasks)
    if binding.longest is not None:
        other = _robot_at(nlp, case, binding.longest)
        other = other if binding.errors is None else machine_of(other, case, binding.errors)
        yield from _of_stroke(case, binding, (robot, other), where)
        return
    for limit in case.limits:
        # Joints are mounted as in the design.
        posed = replace(robot, legs=with_spans_of(exact, robot)) if isinstance(limit, JointAngle) else robot
        items = [*limit.at_pose(PosedRobot(case.model, posed, names, where))]
        if binding.errors is not None:
            items += on_plates(limit, case, robot)
        for item in items:
            if item.constraint.name in (binding.name, f"{binding.name}{where}"):
                yield tightened(item, f"{binding.name}{where}")


def _of_stroke(
    case: Case, binding: BindingPose, robots: tuple[RobotInstance, RobotInstance], where: str
) -> Iterator[BoundedConstraint]:
    """Yield the constraints of a claim about a leg at two poses: of its shortest length, and of its longest."""
    both = Design(case.as_limited, robots, {})
    for limit in case.limits:
        for leg, family in zip(case.model.legs, limit.on_pairs(both), strict=False):
            for item in family.pair(0, 1):
                if binding.name == f"{item.constraint.name.partition(' ')[0]} limb {leg.name}":
                    yield tightened(item, f"{binding.name}{where}")


def _robot_at(nlp: Nlp, case: Case, pose: PoseNumbers) -> RobotInstance:
    """Return the robot with the program's dimensions at a pose of numbers."""
    substitution = Substitution(
        nlp.program.robot.parameters, SX(0, 1), SX(pose.rotation.tolist()), SX(pose.position.tolist())
    )
    twists = [SX(np.asarray(task.twist, dtype=np.float64).tolist()) for task in case.tasks]
    return instantiate(case.model, substitution, SX(case.characteristic_length), twists)


def _regular(nlp: Nlp, case: Case, robot: RobotInstance, where: str) -> BoundedConstraint:
    """Return the constraint that the determinant of J keeps the sign that it has at the middle of the workspace."""
    if case.workspace is None:
        raise TypeError("a workspace is judged before its poses are constraints")
    box = pose_box(case.workspace)
    middle = _robot_at(nlp, case, box.pose(0.5 * (box.lower + box.upper)))
    ratio = _determinant(robot) / _determinant(middle)
    return BoundedConstraint(Constraint(f"regular{where}", ratio, NUMBER), _DETERMINANT, math.inf)


def _determinant(robot: RobotInstance) -> SX:
    """Return the determinant of J with moments about the platform's origin, (1, 1)."""
    moments = [row.moment - ca.cross(robot.position, row.force) for row in robot.rows]
    rows = [
        ca.vertcat(row.force, moment).T / ca.sqrt(row.square) for row, moment in zip(robot.rows, moments, strict=True)
    ]
    return ca.det(ca.vertcat(*rows))
