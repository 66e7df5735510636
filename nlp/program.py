"""The nonlinear program: a :class:`Program` of symbols, and an :class:`Nlp` that gives it numbers.

A program is built for a *structure*, which is a robot and the choice of what is free. Everything a case fixes
(dimensions, pose, twist) is an argument, so one program can serve every start, every task and every point of a sweep.
Variables are in the units of the case (radians for angles); :attr:`Nlp.scale` brings them to order 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import casadi as ca
import numpy as np
from casadi import SX

from screwsynth.models import Dimension, FloatArray, Model, Wrench, WrenchKind
from screwsynth.nlp.case import Case, Sense
from screwsynth.nlp.kernel import Kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Places of three results among those of :meth:`Program.robot_state`.
OBJECTIVE, SQUARES, MAGNITUDE = 5, 6, 7
#: Multiples of the golden section, modulo 1, spread evenly.
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Scalar:
    """A named scalar of a program: a free variable or an argument that a case fixes."""

    name: str
    dimension: Dimension


@dataclass(frozen=True)
class Reading:
    """How a constraint's limit reads in the words of a case.

    A limit on an angle may be a limit on a smoother function of it in the program.

    Attributes:
        dimension: what the limit measures for people.
        from_value: the number for people (radians for angles) from the program's limit.
        slope: derivative of the program's limit with respect to the number for people, at the program's limit.
        to_value: the program's limit from the number for people, as an expression; it never falls where that grows.
    """

    dimension: Dimension
    from_value: Callable[[float], float] = lambda value: value
    slope: Callable[[float], float] = lambda _: 1.0
    to_value: Callable[[SX], SX] = lambda number: number


@dataclass(frozen=True, eq=False)
class Constraint:
    """A named smooth constraint ``lower <= expression <= upper``; its bounds are numbers of the :class:`Nlp`.

    Attributes:
        name: in the words of a case.
        expression: (1, 1).
        reading: how its limits read.
        keys: dotted keys below ``limits`` of the case's numbers that are its lower and its upper bound; empty for a
            bound that is none of the case's limits.
        pose: index of the pose that it is at.
    """

    name: str
    expression: SX
    reading: Reading
    keys: tuple[str, str] = ("", "")
    pose: int = 0


@dataclass(frozen=True, eq=False)
class Bounded:
    """A constraint with its bounds."""

    constraint: Constraint
    lower: float
    upper: float


def vanished(row: Wrench) -> str:
    """Why a row whose direction is zero is none, for messages."""
    if row.kind is WrenchKind.COUPLE:
        return f"the couple of limb {row.limb!r} has no direction: the axes that it is normal to coincide"
    return f"limb {row.limb!r} has zero length: its two joints coincide"


@dataclass(frozen=True, eq=False)
class LegExpressions:
    """A leg at the program's point.

    Attributes:
        name: the limb's name.
        base: (3, 1) centre of its base joint in the world frame, length.
        platform: (3, 1) centre of its platform joint in the platform frame, length.
        span: (3, 1) from base joint to platform joint in the world frame, length.
    """

    name: str
    base: SX
    platform: SX
    span: SX


@dataclass(frozen=True, eq=False)
class RobotExpressions:
    """The robot at the program's point: every expression in the program's variables and arguments.

    Attributes:
        parameters: (n, 1) components of all parameters, in the model's order.
        rotation: (3, 3) ``R``.
        position: (3, 1) ``p``, length.
        jacobian: (m, 6) unit wrenches ``J``, couple rows scaled by the characteristic length.
        rates: (m, tasks) ``L_i ^ chi_j``.
        F: (tasks, 1) objective of each task (equation 14).
        squares: (m, 1) squared length of each row's direction: a limb of zero length has 0.
        magnitude: (tasks, 1) what F would be without cancellation, ``sum (|m_i| |omega| + |f_i| |v|)^2`` with moments
            and velocity taken at the platform's origin, so that it does not depend on where the world's origin is.
        quantities: each of the model's quantities.
        legs: the model's legs.
    """

    parameters: SX
    rotation: SX
    position: SX
    jacobian: SX
    rates: SX
    F: SX
    squares: SX
    magnitude: SX
    quantities: tuple[SX, ...]
    legs: tuple[LegExpressions, ...] = ()


@dataclass(frozen=True, eq=False)
class Program:
    """A nonlinear program without its numbers.

    Attributes:
        variables: what is free, in the order of ``x``.
        arguments: what is fixed, in the order of ``p``.
        x: (n, 1) symbols of the free variables.
        p: (k, 1) symbols of the arguments.
        objective: (1, 1) expression that is maximised or minimised.
        constraints: beside the variables' bounds.
        robot: the robot's expressions, at the first pose where there are several.
        model: the robot itself.
        directions: indices in ``x`` of the three components of each unit vector that is wholly free.
        further: the robot's expressions at the other poses.
    """

    variables: tuple[Scalar, ...]
    arguments: tuple[Scalar, ...]
    x: SX
    p: SX
    objective: SX
    constraints: tuple[Constraint, ...]
    robot: RobotExpressions
    model: Model
    directions: tuple[tuple[int, int, int], ...] = ()
    further: tuple[RobotExpressions, ...] = ()

    @property
    def robots(self) -> tuple[RobotExpressions, ...]:
        """The robot's expressions at every pose."""
        return (self.robot, *self.further)

    def index(self, name: str) -> int:
        """Place of a free variable in ``x``."""
        return [variable.name for variable in self.variables].index(name)

    @cached_property
    def g(self) -> SX:
        """(c, 1) expressions of all constraints."""
        return ca.vertcat(SX(0, 1), *[constraint.expression for constraint in self.constraints])

    @cached_property
    def values(self) -> ca.Function:
        """``(x, p) -> (F, g)``."""
        return ca.Function("values", [self.x, self.p], [ca.densify(self.objective), ca.densify(self.g)])

    @cached_property
    def derivatives(self) -> ca.Function:
        """``(x, p) -> (F, dF/dx as a row, g, dg/dx)``."""
        outputs = [self.objective, ca.jacobian(self.objective, self.x), self.g, ca.jacobian(self.g, self.x)]
        return ca.Function("derivatives", [self.x, self.p], [ca.densify(output) for output in outputs])

    @cached_property
    def hessian(self) -> ca.Function:
        """``(x, p, weight, multipliers) -> Hessian of weight * F + multipliers . g``, (n, n)."""
        weight, multipliers = SX.sym("weight"), SX.sym("multipliers", len(self.constraints))
        lagrangian = weight * self.objective + ca.dot(multipliers, self.g)
        hessian = ca.densify(ca.hessian(lagrangian, self.x)[0])
        return ca.Function("hessian", [self.x, self.p, weight, multipliers], [hessian])

    @cached_property
    def argument_derivatives(self) -> ca.Function:
        """``(x, p) -> (dF/dp as a row, dg/dp)``."""
        outputs = [ca.jacobian(self.objective, self.p), ca.jacobian(self.g, self.p)]
        return ca.Function("argument_derivatives", [self.x, self.p], [ca.densify(output) for output in outputs])

    def robot_state(self, pose: int = 0) -> ca.Function:
        """``(x, p) ->`` every number of :class:`RobotExpressions`, in its order, at one of the poses."""
        robot = self.robots[pose]
        outputs = [robot.parameters, robot.rotation, robot.position, robot.jacobian, robot.rates, robot.F]
        outputs += [robot.squares, robot.magnitude, *robot.quantities]
        return ca.Function("robot_state", [self.x, self.p], [ca.densify(output) for output in outputs])

    @cached_property
    def kernels(self) -> Kernels:
        """The functions on NumPy arrays."""
        return Kernels(self)


class Kernels:
    """A program's functions on NumPy arrays, each made when it is first used.

    Arguments and results are those of the properties of the same names of :class:`Program`.
    """

    def __init__(self, program: Program) -> None:
        self._program = program

    @cached_property
    def values(self) -> Kernel:
        """Objective and constraints."""
        return Kernel(self._program.values)

    @cached_property
    def derivatives(self) -> Kernel:
        """Objective and constraints with first derivatives."""
        return Kernel(self._program.derivatives)

    @cached_property
    def hessian(self) -> Kernel:
        """Hessian of the Lagrangian."""
        return Kernel(self._program.hessian)

    @cached_property
    def argument_derivatives(self) -> Kernel:
        """Derivatives by what is fixed."""
        return Kernel(self._program.argument_derivatives)

    @cached_property
    def robot_state(self) -> Kernel:
        """The robot's expressions, at the first pose."""
        return self.robot_states[0]

    @cached_property
    def robot_states(self) -> tuple[Kernel, ...]:
        """The robot's expressions at each pose."""
        return tuple(Kernel(self._program.robot_state(pose)) for pose in range(len(self._program.robots)))


@dataclass(frozen=True)
class Side:
    """One side of a bound or constraint.

    Attributes:
        name: the variable or constraint.
        bound: which side of it.
        variable: index of the variable, or None for a constraint.
        constraint: index of the constraint, or None for a variable's bound.
    """

    name: str
    bound: Literal["min", "max", "equal"]
    variable: int | None = None
    constraint: int | None = None


@dataclass(frozen=True, eq=False)
class SideTable:
    """Every side of a program, variables' bounds first, and what arithmetic over all of them needs.

    Attributes:
        sides: the sides.
        place: (k,) index of each side's expression among the variables and then the constraints.
        sign: (k,) direction, along that expression, that leaves the feasible side; +1 for an equation.
        limit: (k,) limit of each side, in the program's terms.
        equal: (k,) whether it is an equation.
    """

    sides: tuple[Side, ...]
    place: NDArray[np.intp]
    sign: FloatArray
    limit: FloatArray
    equal: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Nlp:
    """A program with its numbers: what every solver, certificate and report reads.

    Attributes:
        program: the symbols.
        case: where the numbers come from, for names and units.
        sense: whether the objective is maximised or minimised.
        arguments: (k,) values of the program's arguments.
        lower, upper: (n,) bounds of the variables, ``lower < upper``.
        start: (n,) first starting point.
        g_lower, g_upper: (c,) bounds of the constraints, infinite where there is none, equal for an equation.
        met: limits of the case that hold whatever is chosen, and so are no constraints of the program.
        size: size of the objective, where it is not made of the robot's F.
    """

    program: Program
    case: Case
    sense: Sense
    arguments: FloatArray
    lower: FloatArray
    upper: FloatArray
    start: FloatArray
    g_lower: FloatArray
    g_upper: FloatArray
    met: tuple[Bounded, ...] = ()
    size: float | None = None

    @property
    def n(self) -> int:
        """Number of free variables."""
        return len(self.program.variables)

    @cached_property
    def scale(self) -> FloatArray:
        """(n,) half of each variable's range: a step of 1 in scaled variables goes from the middle to a bound."""
        return (self.upper - self.lower) / 2

    @property
    def centre(self) -> FloatArray:
        """(n,) middle of the box."""
        return (self.upper + self.lower) / 2

    @property
    def sign(self) -> float:
        """What makes the objective one to be minimised: -1 for a maximum."""
        return -1.0 if self.sense is Sense.MAX else 1.0

    @cached_property
    def sides(self) -> SideTable:
        """Every side of every bound and constraint."""
        sides: list[Side] = []
        limits: list[float] = []
        for index, variable in enumerate(self.program.variables):
            sides += [Side(variable.name, "min", variable=index), Side(variable.name, "max", variable=index)]
            limits += [float(self.lower[index]), float(self.upper[index])]
        for index, constraint in enumerate(self.program.constraints):
            lower, upper = float(self.g_lower[index]), float(self.g_upper[index])
            if lower == upper:
                sides.append(Side(constraint.name, "equal", constraint=index))
                limits.append(lower)
                continue
            for bound, limit in (("min", lower), ("max", upper)):
                if np.isfinite(limit):
                    sides.append(Side(constraint.name, "min" if bound == "min" else "max", constraint=index))
                    limits.append(limit)
        place = [side.variable if side.variable is not None else self.n + (side.constraint or 0) for side in sides]
        return SideTable(
            sides=tuple(sides),
            place=np.array(place, dtype=np.intp),
            sign=np.array([-1.0 if side.bound == "min" else 1.0 for side in sides]),
            limit=np.array(limits, dtype=np.float64),
            equal=np.array([side.bound == "equal" for side in sides], dtype=bool),
        )

    def evaluate(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Objective and constraints, (c,), at a point (n,)."""
        F, g = self.program.kernels.values(x, self.arguments)
        return float(F[0, 0]), g.ravel()

    @cached_property
    def objective_scale(self) -> float:
        """Size of the objective without cancellation, at the first starting point: positive, unlike F near 0.

        Where the robot is not defined there, as with limbs of zero length, it is taken at the first of a few points
        around the middle where it is.
        """
        if self.size is not None:
            return self.size
        around = (np.modf(k * _GOLDEN * np.arange(1, self.n + 1))[0] - 0.5 for k in range(1, 9))
        for x in (self.start, *(self.centre + self.scale * each for each in around)):
            size = float(np.max(self.program.kernels.robot_state(x, self.arguments)[MAGNITUDE]))
            if np.isfinite(size) and size > 0:
                return size
        return 1.0
