"""Claims at poses of a workspace as constraints, for any robot.

At such a pose those numbers that the robot can choose are fixed. Unknowns in closed form are put in. The other
unknowns, and the numbers of the pose that the robot has no choice of, are further variables of the program, with the
loop equations at this pose as constraints.

Out of a limb's reach the closed forms are continued, so that a search may pass through it: the reach is a claim, and so
a constraint, of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, RobotInstance, Substitution, frozen_vector, instantiate
from ...models.instance import homogenised
from ...models.joints.closedform import ClosedForm, closed_form
from ...models.rows import independent_rows
from ..case.case import Case
from ..case.limits.constraint import NUMBER, BoundedConstraint, Constraint
from ..case.limits.limit import PosedRobot
from ..program.nlp import Nlp
from ..program.places import Scalar
from ..proof.statement.machine import workspace_of_case
from ..proof.workspace.robot.pose_box import PoseNumbers, pose_box, rotation_of
from ..proof.workspace.robot.posed_robot import NotJudgedError, Problem, build_problem
from .tighter import TIGHTER, tightened

#: Smallest squared sine or cosine of a limb's reach: of a number between 0 and 1 the limit 0 is tighter by as much.
_REACH = TIGHTER
#: Part of the determinant of J'J at the stated pose that is demanded at a singular pose: the square of the part of the
#: determinant that is demanded of six legs. J'J has no sign that tells the far side of a singular pose, so that the
#: singular pose moves by little: of each further one more is demanded, up to a largest part.
_DETERMINANT, _MORE, _MOST = 1e-4, 4.0, 1e-2
#: Steps from the middle of the workspace to a pose, along which closed loops are followed.
_WAY = 16
#: Half ranges by which a number of the pose that the robot has no choice of may leave its range in a search.
_BEYOND = 0.5
#: Steps of Newton's method for the further variables, and largest residual of closed loops.
_STEPS, _CLOSED = 12, 1e-9


@dataclass(frozen=True, eq=False)
class BoundPose:
    """A claim at a pose: m further variables of a program, and constraints.

    Attributes:
        variables: the further variables.
        symbols: (m, 1) their symbols.
        lower, upper, start: (m,) their bounds, and values at which the loops are closed.
        equations: m loop equations.
        constraints: of the claim.
        x, p: symbols of the program's own variables and arguments.
    """

    variables: tuple[Scalar, ...]
    symbols: SX
    lower: FloatArray
    upper: FloatArray
    start: FloatArray
    equations: tuple[BoundedConstraint, ...]
    constraints: tuple[BoundedConstraint, ...]
    x: SX
    p: SX

    @cached_property
    def _function(self) -> ca.Function:
        equations, values = (
            ca.vertcat(SX(0, 1), *[item.constraint.expression for item in items])
            for items in (self.equations, self.constraints)
        )
        outputs = [equations, ca.jacobian(equations, self.symbols), values]
        return ca.Function("bound", [self.x, self.p, self.symbols], [ca.densify(each) for each in outputs])

    def values(self, x: FloatArray, arguments: FloatArray) -> FloatArray:
        """Return the constraints' numbers, with loops closed, at values (n,) of the program's own variables."""
        w = self.start.copy()
        for _ in range(_STEPS):
            residual, slopes, values = (each.full() for each in self._function(x, arguments, w))
            if not self.variables or not np.isfinite(slopes).all() or np.abs(residual).max() <= _CLOSED:
                break
            w -= np.linalg.lstsq(slopes, residual.ravel(), rcond=None)[0]
        return np.asarray(values.ravel())


class AnyBinder:
    """Claims at poses as constraints of the program of a case.

    Args:
        nlp: the program without them.
        case: the case.
    """

    def __init__(self, nlp: Nlp, case: Case) -> None:
        if case.workspace is None:
            raise TypeError("a case with limits over its workspace has a workspace")
        self._nlp, self._case, self._box = nlp, case, pose_box(case.workspace)
        self._singular = 0
        self._closed: ClosedForm = closed_form(case.model, extended=True)
        names = [item.name for item in case.model.unknowns]
        own = nlp.program.places.unknowns[0] if names else ()
        self._unknowns = [own[names.index(item.name)] for item in self._closed.model.unknowns]

    def problem(self, design: Case) -> Problem | None:
        """Return a design over its workspace; None where its loops are not closed in the middle."""
        try:
            return build_problem(design, closed_form(design.model).model, pose_box(workspace_of_case(design)))
        except NotJudgedError:
            return None

    def bound(self, claim: str, pose: PoseNumbers, problem: Problem, x: FloatArray, k: int) -> BoundPose | None:
        """Return a claim at a pose; None where the claim has no constraint, or the loops do not close there.

        Args:
            claim: its name.
            pose: the pose.
            problem: the design (n,) over the workspace.
            x: (n,) the design.
            k: number of the pose, from 0.
        """
        nlp, count = self._nlp, len(problem.free)
        y = self._box.coordinates(pose)
        start = _closed_at(problem, y)
        if start is None:
            return None
        where = f" at workspace pose {k + 1}"
        dependent = [j for j in problem.dependent if j < count]
        places = [problem.free[j] for j in dependent]
        unknowns = self._closed.model.unknowns
        names = [*(f"number {j + 1} of the pose" for j in places), *(item.name for item in unknowns)]
        symbols = SX.sym("w", len(names))
        coordinates = SX(y)
        for j, place in enumerate(places):
            coordinates[place] = symbols[j]
        lower, upper = self._box.lower[places], self._box.upper[places]
        room = _BEYOND * (upper - lower)
        robot, substitution = self._robot(coordinates, symbols[len(places) :])
        found = BoundPose(
            variables=tuple(Scalar(f"{name}{where}", Dimension.NUMBER) for name in names),
            symbols=symbols,
            lower=np.concatenate([lower - room, nlp.lower[self._unknowns]]),
            upper=np.concatenate([upper + room, nlp.upper[self._unknowns]]),
            start=start[[*dependent, *range(count, len(start))]],
            equations=(),
            constraints=tuple(self._constraints(claim, robot, substitution, x, where)),
            x=nlp.program.x,
            p=nlp.program.p,
        )
        equations = self._equations(robot, found, x, where)
        return replace(found, equations=equations) if found.constraints and len(equations) == len(names) else None

    def program(self, bound: Sequence[BoundPose]) -> Nlp:
        """Return the program with claims at poses as constraints."""
        nlp, program = self._nlp, self._nlp.program
        count = sum(len(each.variables) for each in bound)
        wider = replace(
            program,
            variables=(*program.variables, *(item for each in bound for item in each.variables)),
            x=ca.vertcat(program.x, *[each.symbols for each in bound]),
            places=replace(program.places, further=tuple(range(nlp.n, nlp.n + count))),
        )
        wide = replace(
            nlp,
            program=wider,
            lower=frozen_vector([*nlp.lower, *(value for each in bound for value in each.lower)]),
            upper=frozen_vector([*nlp.upper, *(value for each in bound for value in each.upper)]),
            start=frozen_vector([*nlp.start, *(value for each in bound for value in each.start)]),
        )
        return wide.with_constraints([item for each in bound for item in (*each.equations, *each.constraints)])

    def _robot(self, coordinates: SX, unknowns: SX) -> tuple[RobotInstance, Substitution]:
        """Return the robot with the program's dimensions at coordinates (6, 1) of a pose."""
        robot = self._nlp.program.robot
        rotation = rotation_of(self._box, coordinates[3:])
        given = Substitution(robot.parameters, unknowns, rotation, coordinates[:3], robot.reference)
        twists = [SX(np.asarray(task.twist, dtype=np.float64).tolist()) for task in self._case.tasks]
        return instantiate(self._closed.model, given, SX(self._case.characteristic_length), twists), given

    def _constraints(
        self, claim: str, robot: RobotInstance, given: Substitution, x: FloatArray, where: str
    ) -> Iterator[BoundedConstraint]:
        """Yield the constraints of a claim, with limits that are a little tighter."""
        case, nlp = self._case, self._nlp
        if claim == "regular":
            length = case.characteristic_length
            ratio = _gram(robot, length) / _gram(nlp.program.robot, length)
            least = min(_DETERMINANT * _MORE**self._singular, _MOST)
            self._singular += 1
            yield BoundedConstraint(Constraint(f"{claim}{where}", ratio, NUMBER), least, math.inf)
            return
        own = [each.value for each in self._closed.reaches if claim == f"reach limb {each.limb}"]
        if own:
            values = ca.Function("reach", Substitution.identity(self._closed.model).all, own).call(given.all)
            numbers = ca.Function("reach", [nlp.program.x, nlp.program.p], [ca.vertcat(*values)])
            # Both rods of a parallelogram reach equally far: one of two equal constraints is enough.
            farthest = int(np.argmin(numbers(x, nlp.arguments).full()))
            yield BoundedConstraint(Constraint(f"{claim}{where}", values[farthest], NUMBER), _REACH, math.inf)
            return
        for limit in case.limits:
            for item in limit.at_pose(PosedRobot(self._closed.model, robot, tuple(t.name for t in case.tasks), where)):
                if item.constraint.name in (claim, f"{claim}{where}"):
                    yield tightened(item, f"{claim}{where}")

    def _equations(
        self, robot: RobotInstance, bound: BoundPose, x: FloatArray, where: str
    ) -> tuple[BoundedConstraint, ...]:
        """Return the loop equations that determine the further variables: those that follow from them are left out."""
        if not bound.variables:
            return ()
        slopes = ca.Function("slopes", [bound.x, bound.p, bound.symbols], [ca.jacobian(robot.closure, bound.symbols)])
        values = slopes(x, self._nlp.arguments, bound.start).full() * (bound.upper - bound.lower)
        names = [equation.name for equation in self._closed.model.closure]
        return tuple(
            BoundedConstraint(Constraint(f"{names[k]}{where}", robot.closure[k], NUMBER), 0.0, 0.0)
            for k in sorted(independent_rows([values]))
        )


def _gram(robot: RobotInstance, length: float) -> SX:
    """Return the determinant of J'J, moments about the platform's origin divided by a length, (1, 1)."""
    J = ca.horzcat(*homogenised(robot.jacobian, robot.position, length))
    return ca.det(J.T @ J)


def _closed_at(problem: Problem, y: FloatArray) -> FloatArray | None:
    """Return closed loops (n,) at a pose with coordinates (6,), followed from the middle; None where they end."""
    independent, dependent = list(problem.independent), list(problem.dependent)
    z = problem.start.copy()
    target = z.copy()
    target[: len(problem.free)] = y[list(problem.free)]
    if not dependent:
        return target
    loops = problem.loops
    begin = z[independent]
    for part in np.linspace(0, 1, _WAY + 1)[1:]:
        z[independent] = begin + part * (target[independent] - begin)
        z = loops.all_closed(z[:, None], dependent)[:, 0]
        if not np.isfinite(z).all():
            return None
    return z
