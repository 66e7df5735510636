"""Claims at poses of a workspace as constraints, for the nominal robot or within a joint-centre tolerance.

At such a pose the independent coordinates are fixed, and closed forms replace unknowns where they exist. The other
dependent coordinates become further variables of the program, with the loop equations at this pose as constraints.

Beyond the reach of a limb the closed forms are continued, so that a search may pass through such points: reach is a
separate claim, and so a separate constraint.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import (
    Dimension,
    FloatArray,
    Model,
    RobotInstance,
    Substitution,
    frozen_vector,
    instantiate,
)
from ...models.instance import homogenised
from ...models.joints.model.closedform import Reach, closed_form
from ...models.newton import VectorEquations, newton
from ...models.rows import independent_rows
from ..case.case import Case
from ..case.limits.constraint import NUMBER, BoundedConstraint, Constraint
from ..case.limits.joints import JointAngle
from ..case.limits.limit import Design, Plate, PlateJoint, PosedRobot
from ..case.limits.objective import ObjectiveLimit
from ..case.task import Sense
from ..case.workspace import Workspace
from ..path.path import SymbolicPose
from ..program.actuators import level_constraints
from ..program.epigraph import level_constraint
from ..program.nlp import Nlp
from ..program.places import Scalar
from ..proof.statement.claims import Claim, dependent_claims
from ..proof.statement.fixed_robot import workspace_of_case
from ..proof.statement.tolerance import BuiltModel, built_model
from ..proof.workspace.robot.pose_box import PoseNumbers, pose_box, rotation_of
from ..proof.workspace.robot.posed_robot import NotJudgedError, Problem, build_problem
from .frames import Frame, pose_of

#: Relative amount by which constraints are tighter than limits: several gaps of the proofs fit between.
TIGHTER = 1e-3
#: First words of the name of a claim about the reach of a limb; and smallest squared sine or cosine of the limb's reach
#: in a constraint: for a quantity between 0 and 1, the limit 0 is tighter by this amount.
REACH, _REACH = "reach limb ", TIGHTER
#: Smallest determinant of J at a singular pose, as a fraction of that in the middle of the workspace.
_DETERMINANT = 1e-2
#: Smallest determinant of J'J, as a fraction of that at the stated pose; factor for each further singular pose; largest
#: fraction. J'J has no sign, so a singular pose moves only a little: each further singular pose must be farther away.
_SQUARED, _MORE, _MOST = 1e-4, 4.0, 1e-2
#: Bounds of reaches and determinants that hold for every proved design.
_ABOVE = (0.0, math.inf)
#: Steps from the middle of the workspace to a pose, along which closed loops are followed.
_WAY = 16
#: Number of working ranges by which a dependent coordinate may leave its range in a search: another design has other
#: ranges.
_BEYOND = 2.0
#: Steps of Newton's method for the further variables, and largest residual of closed loops.
_STEPS, _CLOSED = 11, 1e-9
#: Relative difference below which two constraints count as equal; and the distance of designs, in half ranges, at which
#: they are compared.
_ALIKE, _NEARBY = 3e-4, 0.05
_SEED = 0


class BindingPose(NamedTuple):
    """A pose at which a claim becomes a constraint.

    Attributes:
        name: name of the claim.
        pose: pose at which the claim fails; for a stroke, the pose of the shortest length.
        longest: pose of the longest length, for a stroke; otherwise None.
        errors: (m, 3) joint-centre errors of the robot within the tolerance; None for the nominal robot.
    """

    name: str
    pose: PoseNumbers
    longest: PoseNumbers | None = None
    errors: FloatArray | None = None

    @property
    def poses(self) -> tuple[PoseNumbers, ...]:
        """The pose, or both poses of a stroke."""
        return (self.pose,) if self.longest is None else (self.pose, self.longest)

    def moved(self, move: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]) -> BindingPose:
        """Return the claim with poses moved to another frame by a function of position and rotation."""
        poses = [pose_of(*move(each.position, each.rotation)) for each in self.poses]
        return self._replace(pose=poses[0], longest=None if self.longest is None else poses[1])

    def is_same(self, other: BindingPose) -> bool:
        """Return whether another claim has exactly the same name, poses and joint-centre errors."""
        one, two = (
            [*(part for pose in each.poses for part in (pose.position, pose.rotation)), each.errors]
            for each in (self, other)
        )
        is_same = (
            a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in zip(one, two, strict=False)
        )
        return self.name == other.name and len(one) == len(two) and all(is_same)


@dataclass(frozen=True, eq=False)
class _ClosedPose:
    """A robot at a pose, with m further variables of a program that close its loops.

    Attributes:
        model: model of the robot; its unknowns have no closed form.
        robot: expressions of the robot at the pose.
        reaches: reach margins of its limbs at the pose.
        variables, symbols: further variables and their symbols, (m, 1).
        lower, upper, start: (m,) bounds of the further variables, and values that close the loops of the present
            design.
        equations: m loop equations.
    """

    model: Model
    robot: RobotInstance
    reaches: tuple[Reach, ...]
    variables: tuple[Scalar, ...]
    symbols: SX
    lower: FloatArray
    upper: FloatArray
    start: FloatArray
    equations: tuple[BoundedConstraint, ...] = ()


class _PosedClaim(NamedTuple):
    """Claim at one or two poses: its constraints, those of a minimised epigraph variable, and robots at these poses."""

    poses: tuple[_ClosedPose, ...]
    constraints: tuple[BoundedConstraint, ...]
    of_level: tuple[BoundedConstraint, ...] = ()


class PoseConstraints:
    """Claims at poses, as constraints of the program of a case.

    Args:
        nlp: nonlinear program without these constraints.
        case: the case.
        middle: reference pose for the determinant of J; the middle of the workspace if left out.
        frame: frame in which poses are given; the world if left out.
    """

    def __init__(self, nlp: Nlp, case: Case, middle: PoseNumbers | None = None, frame: Frame | None = None) -> None:
        if middle is None:
            if case.workspace is None:
                raise TypeError("case.workspace: limits over a workspace need a workspace, got None")
            box = pose_box(case.workspace)
            middle = box.pose(box.middle)
        self._nlp, self._case, self._middle, self._frame = nlp, case, middle, frame
        self._closed = closed_form(case.model, extended=True)
        names = [item.name for item in case.model.unknowns]
        own = nlp.program.places.unknowns[0] if names else ()
        self._unknowns = [own[names.index(item.name)] for item in self._closed.model.unknowns]
        self._claims: list[_PosedClaim] = []
        self._workspace: Workspace | None = None
        self._singular = 0

    @property
    def program(self) -> Nlp:
        """The program with the claims as constraints, tighter than the limits by :data:`TIGHTER`."""
        nlp, program = self._nlp, self._nlp.program
        poses = [pose for claim in self._claims for pose in claim.poses]
        count = sum(len(each.variables) for each in poses)
        of_level = [item for claim in self._claims for item in claim.of_level]
        epigraph = program.places.epigraph
        if epigraph is not None:
            own = (*epigraph.constraints, *(item.constraint for item in of_level))
            epigraph = replace(epigraph, constraints=own)
        wider = replace(
            program,
            variables=(*program.variables, *(item for each in poses for item in each.variables)),
            x=ca.vertcat(program.x, *[each.symbols for each in poses]),
            places=replace(program.places, further=tuple(range(nlp.n, nlp.n + count)), epigraph=epigraph),
        )
        wide = replace(
            nlp,
            program=wider,
            lower=frozen_vector([*nlp.lower, *(value for each in poses for value in each.lower)]),
            upper=frozen_vector([*nlp.upper, *(value for each in poses for value in each.upper)]),
            start=frozen_vector([*nlp.start, *(value for each in poses for value in each.start)]),
        )
        equations = [item for each in poses for item in each.equations]
        limits = [item for each in self._claims for item in each.constraints]
        return wide.with_constraints([*equations, *limits, *of_level])

    def added(self, design: Case, fresh: Sequence[BindingPose], x: FloatArray, part: float = 1.0) -> list[BindingPose]:
        """Add further claims as constraints, and return the added ones.

        Constraints that repeat another one, such as at mirrored poses of a symmetric robot, are left out: with both
            constraints, a program has no unique multipliers. Two constraints count as equal if they differ by less than
            the margin to their limits, at a design and at designs around it.

        Args:
            design: design that refutes the claims.
            fresh: new claims.
            x: (n,) the design; further components are not read.
            part: part of :data:`TIGHTER` by which the limits are tighter.
        """
        # Where a limb does not reach a pose, J and the limits are not defined nearby: add the reach first.
        first = [each for each in fresh if each.name.startswith(REACH)]
        if not fresh:
            return []
        self._workspace = workspace_of_case(design)
        problem = _problem(design, self._workspace)
        if problem is None:
            return []
        kept, known = list[BindingPose](), list[tuple[str, FloatArray]]()
        points = self._points_around(x[: self._nlp.n])
        for each in first or fresh:
            claim = self._claim(each, problem, points[0])
            if claim is None:
                continue
            values = self._values(claim, points)
            # Equal limits on joints of different limbs may also repeat each other.
            key = repr([(item.lower, item.upper) for item in (*claim.constraints, *claim.of_level)])
            if not any(key == one and _are_alike(values, other, part) for one, other in known):
                known.append((key, values))
                kept.append(each)
                self._claims.append(claim)
        return kept

    def _points_around(self, x: FloatArray) -> list[FloatArray]:
        """Return a design (n,), and designs around it."""
        nlp, rng = self._nlp, np.random.default_rng(_SEED)
        steps = (_NEARBY * nlp.scale * rng.normal(size=nlp.n) for _ in range(3))
        return [x, *(np.clip(x + step, nlp.lower, nlp.upper) for step in steps)]

    def _values(self, claim: _PosedClaim, points: Sequence[FloatArray]) -> FloatArray:
        """Return the values of a claim's constraints, with closed loops, at designs (n,)."""
        program = self._nlp.program
        symbols = ca.vertcat(SX(0, 1), *[each.symbols for each in claim.poses])
        equations, values = (
            ca.vertcat(SX(0, 1), *[item.constraint.expression for item in items])
            for items in (
                [item for each in claim.poses for item in each.equations],
                (*claim.constraints, *claim.of_level),
            )
        )
        slopes, inputs = ca.jacobian(equations, symbols), [program.x, program.p, symbols]
        loops = ca.Function("loops", inputs, [ca.densify(equations), ca.densify(slopes)])
        numbers = ca.Function("numbers", inputs, [ca.densify(values)])
        start = np.concatenate([each.start for each in claim.poses])

        def at_design(x: FloatArray) -> FloatArray:
            given = x, self._nlp.arguments
            closed = VectorEquations(lambda w: [each.full() for each in loops(*given, w)], _CLOSED)
            return np.asarray(numbers(*given, newton(closed, closed.at(start), steps=_STEPS).z).full().ravel())

        return np.array([at_design(x) for x in points])

    def _claim(self, binding: BindingPose, problem: Problem, x: FloatArray) -> _PosedClaim | None:
        """Return a claim as constraints; None without constraints, or if the design (n,) cannot be assembled."""
        where = f" workspace pose {len(self._claims) + 1}"
        poses = []
        for pose in binding.poses:
            closed = self._closed_pose(pose, binding.errors, problem, x, where)
            if closed is None:
                return None
            poses.append(closed)
        found = tuple(self._constraints(binding, poses, x, where))
        of_level: tuple[BoundedConstraint, ...] = ()
        measure = self._case.tasks[0].measure
        if measure and binding.name.startswith(f"{measure} actuator "):
            posed = PosedRobot(poses[0].model, poses[0].robot, (), where, self._case.loading)
            of_level = tuple(level_constraints(self._nlp, posed.forces, (binding.name,), where))
        elif self._case.worst_everywhere and binding.name == ObjectiveLimit.key:
            worst = level_constraint(self._nlp, poses[0].robot.F[0], f"{binding.name}{where}")
            of_level = () if worst is None else (worst,)
        return _PosedClaim(tuple(poses), found, of_level) if found or of_level else None

    def _closed_pose(
        self, pose: PoseNumbers, errors: FloatArray | None, problem: Problem, x: FloatArray, where: str
    ) -> _ClosedPose | None:
        """Return a robot at a pose; None if the loops of the design (n,) cannot be closed."""
        nlp, count, box = self._nlp, len(problem.free), problem.box
        y = box.coordinates(self._numbers(pose, x))
        start = _closed_at(problem, y)
        dependent = [j for j in problem.dependent if j < count]
        if start is None or (dependent and self._frame is not None and self._frame.is_path):
            return None
        places = [problem.free[j] for j in dependent]
        model, reaches = self._closed.model, self._closed.reaches
        parameters, reference = nlp.program.robot.parameters, nlp.program.robot.reference
        if errors is not None:
            model, reaches = self._built.model, self._built.reaches
            parameters = ca.vertcat(parameters, SX(errors.ravel().tolist()))
            reference = None if reference is None else (*reference, *np.zeros(errors.size).tolist())
        names = [*(f"pose coordinate {j + 1}" for j in places), *(item.name for item in model.unknowns)]
        symbols, coordinates = SX.sym("w", len(names)), SX(y)
        for j, place in enumerate(places):
            coordinates[place] = symbols[j]
        lower, upper = box.lower[places], box.upper[places]
        room, unknowns = _BEYOND * (upper - lower), symbols[len(places) :]
        at = SymbolicPose(coordinates[:3], rotation_of(box, coordinates[3:]))
        if self._frame is not None:
            at = self._frame.carried(at, nlp, x[: nlp.n]) if dependent else self._placed(pose)
        given = Substitution(parameters, unknowns, at.rotation, at.position, reference)
        robot = self._robot(model, given)
        values = [each.value for each in reaches]
        shown = ca.Function("reach", Substitution.identity(model).all, values).call(given.all) if values else []
        closed = _ClosedPose(
            model=model,
            robot=robot,
            reaches=tuple(Reach(each.limb, value) for each, value in zip(reaches, shown, strict=True)),
            variables=tuple(Scalar(f"{name}{where}", Dimension.NUMBER) for name in names),
            symbols=symbols,
            lower=np.concatenate([lower - room, nlp.lower[self._unknowns]]),
            upper=np.concatenate([upper + room, nlp.upper[self._unknowns]]),
            start=start[[*dependent, *range(count, len(start))]],
        )
        equations = self._equations(closed, x, where)
        return replace(closed, equations=equations) if len(equations) == len(names) else None

    def _placed(self, pose: PoseNumbers) -> SymbolicPose:
        """Return a pose that is given in the frame as a symbolic pose in the world."""
        if self._frame is None:
            return SymbolicPose(SX(pose.position.tolist()), SX(pose.rotation.tolist()))
        return self._frame.placed(pose)

    def _numbers(self, pose: PoseNumbers, x: FloatArray) -> PoseNumbers:
        """Return the world pose at a point (n,) for a pose given in the frame."""
        return pose if self._frame is None else pose_of(*Frame.at(self._frame.placed(pose), self._nlp, x))

    @cached_property
    def _built(self) -> BuiltModel:
        return built_model(self._case.model, extended=True)

    def _robot(self, model: Model, given: Substitution) -> RobotInstance:
        """Return the expressions of a robot with the tasks of the case."""
        twists = [SX(np.asarray(task.twist, dtype=np.float64).tolist()) for task in self._case.tasks]
        return instantiate(model, given, SX(self._case.characteristic_length), twists)

    def _equations(self, closed: _ClosedPose, x: FloatArray, where: str) -> tuple[BoundedConstraint, ...]:
        """Return independent loop equations that determine the further variables."""
        if not closed.variables:
            return ()
        program, closure = self._nlp.program, closed.robot.closure
        slopes = ca.Function("slopes", [program.x, program.p, closed.symbols], [ca.jacobian(closure, closed.symbols)])
        values = slopes(x, self._nlp.arguments, closed.start).full() * (closed.upper - closed.lower)
        return tuple(
            BoundedConstraint(Constraint(f"{closed.model.closure[k].name}{where}", closure[k], NUMBER), 0.0, 0.0)
            for k in sorted(independent_rows([values]))
        )

    def _constraints(
        self, binding: BindingPose, poses: Sequence[_ClosedPose], x: FloatArray, where: str
    ) -> Iterator[BoundedConstraint]:
        """Yield the constraints of a claim, tighter than its limits."""
        closed, name = poses[0], f"{binding.name}{where}"
        if binding.name == "regular":
            yield self._regular(closed.robot, name)
            return
        reaches = [each.value for each in closed.reaches if binding.name == f"{REACH}{each.limb}"]
        if reaches:
            program = self._nlp.program
            numbers = ca.Function("reach", [program.x, program.p], [ca.vertcat(*reaches)])
            # The two rods of a parallelogram have equal reach: one of two equal constraints is enough.
            farthest = int(np.argmin(numbers(x, self._nlp.arguments).full()))
            yield BoundedConstraint(Constraint(name, reaches[farthest], NUMBER, stated=_ABOVE), _REACH, math.inf)
            return
        stated = [each for each in self._of_dependent(closed.robot, x) if each.name == binding.name]
        if stated:
            low, high = (
                next((each.limit for each in stated if each.sense is sense), None) for sense in (Sense.MIN, Sense.MAX)
            )
            constraint = Constraint(name, stated[0].expression, stated[0].reading)
            ends = (-math.inf if low is None else low), (math.inf if high is None else high)
            yield _tightened(BoundedConstraint(constraint, *ends), name)
            return
        items = self._of_stroke(binding.name, poses) if binding.longest is not None else self._at_pose(closed, where)
        yield from (_tightened(item, name) for item in items if item.constraint.name in (binding.name, name))

    def _of_dependent(self, robot: RobotInstance, x: FloatArray) -> list[Claim]:
        """Return the claims about stated ranges of dependent coordinates, in the workspace of a design."""
        if self._workspace is None:
            return []
        if self._frame is not None and not self._frame.is_path:
            # The range moves with the pose of the design.
            at = self._frame.returned(SymbolicPose(robot.position, robot.rotation), self._nlp, x[: self._nlp.n])
            robot = replace(robot, position=at.position, rotation=at.rotation)
        return [each for each in dependent_claims(robot, self._workspace) if each.limit is not None]

    def _regular(self, robot: RobotInstance, name: str) -> BoundedConstraint:
        """Return the constraint that J keeps its rank; a determinant of six rows must also keep its sign."""
        length = self._case.characteristic_length
        model = self._closed.model
        if robot.jacobian.shape[0] == robot.jacobian.shape[1] and not (model.unknowns or model.members):
            middle = self._placed(self._middle)
            design = Substitution(self._nlp.program.robot.parameters, SX(0, 1), middle.rotation, middle.position)
            ratio = ca.det(_rows(robot, length)) / ca.det(_rows(self._robot(model, design), length))
            return BoundedConstraint(Constraint(name, ratio, NUMBER, stated=_ABOVE), _DETERMINANT, math.inf)
        one, other = (_rows(each, length) for each in (robot, self._nlp.program.robot))
        least = min(_SQUARED * _MORE**self._singular, _MOST)
        self._singular += 1
        ratio = ca.det(one.T @ one) / ca.det(other.T @ other)
        return BoundedConstraint(Constraint(name, ratio, NUMBER, stated=_ABOVE), least, math.inf)

    def _at_pose(self, closed: _ClosedPose, where: str) -> Iterator[BoundedConstraint]:
        """Yield the constraints of the case's limits on a robot at a pose, and on its joint centres."""
        robot, design, names = closed.robot, self._nlp.program.robot.legs, tuple(task.name for task in self._case.tasks)
        plates = [
            Plate(plate, tuple(PlateJoint(leg.name, getattr(leg, plate)) for leg in robot.legs))
            for plate in ("base", "platform")
        ]
        # The joints are mounted as in the design.
        legs = tuple(replace(one, span=other.span) for one, other in zip(design, robot.legs, strict=True))
        for limit in self._case.limits:
            posed = replace(robot, legs=legs) if isinstance(limit, JointAngle) else robot
            yield from limit.at_pose(PosedRobot(closed.model, posed, names, where, self._case.loading))
            if robot.legs:
                yield from (item for plate in plates for item in limit.on_plate(plate))
            if limit.needs_legs:
                yield from limit.of_design(Design(self._case.as_limited, (robot,), {}))

    def _of_stroke(self, name: str, poses: Sequence[_ClosedPose]) -> Iterator[BoundedConstraint]:
        """Yield the constraints of a claim about a leg's stroke, at the poses of shortest and longest length."""
        both = Design(self._case.as_limited, tuple(each.robot for each in poses), {})
        for limit in self._case.limits:
            for leg, family in zip(poses[0].robot.legs, limit.on_pairs(both), strict=False):
                for item in family.pair(0, 1):
                    if name == f"{item.constraint.name.partition(' ')[0]} limb {leg.name}":
                        yield BoundedConstraint(replace(item.constraint, name=name), item.lower, item.upper)


def with_margin(nlp: Nlp, part: float) -> Nlp:
    """Return a program with limits at poses that are tighter than in the case by ``part`` of the present margin.

    With ``part`` 0, the limits are those of the case, so that a valid design satisfies the constraints at any pose.
    """
    stated = [each.stated for each in nlp.program.constraints]

    def moved(own: float, limit: float) -> float:
        return limit if not (part and math.isfinite(limit)) else limit + part * (own - limit)

    lower, upper = (
        [own if each is None else moved(own, each[k]) for each, own in zip(stated, bounds, strict=True)]
        for k, bounds in enumerate((nlp.g_lower.tolist(), nlp.g_upper.tolist()))
    )
    return replace(nlp, g_lower=frozen_vector(lower), g_upper=frozen_vector(upper))


def _rows(robot: RobotInstance, length: float) -> SX:
    """Return J (m, 6) with moments about the platform's origin, divided by a length."""
    return ca.horzcat(*homogenised(robot.jacobian, robot.position, length))


def _are_alike(one: FloatArray, other: FloatArray, part: float) -> bool:
    """Return whether values (designs, constraints) are equal up to a small relative error."""
    most = part * _ALIKE * np.abs(other).max(initial=0.0)
    return one.shape == other.shape and bool(np.abs(one - other).max() <= most)


def _problem(design: Case, workspace: Workspace) -> Problem | None:
    """Return the robot of a design over its workspace; None if its loops cannot be closed at the centre."""
    try:
        return build_problem(design, closed_form(design.model).model, pose_box(workspace))
    except NotJudgedError:
        return None


def _closed_at(problem: Problem, y: FloatArray) -> FloatArray | None:
    """Return closed loops (n,) at a pose with coordinates (6,), followed from the middle; None if they stay open."""
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


def _tightened(item: BoundedConstraint, name: str) -> BoundedConstraint:
    """Return a named constraint with tighter bounds."""
    lower = item.lower + TIGHTER * abs(item.lower) if math.isfinite(item.lower) else item.lower
    upper = item.upper - TIGHTER * abs(item.upper) if math.isfinite(item.upper) else item.upper
    stated = (item.lower, item.upper)
    return BoundedConstraint(replace(item.constraint, name=name, stated=stated), lower, upper)
