"""The nonlinear program: a :class:`Program` of symbols, and an :class:`Nlp` that gives it numbers.

A program is built for a *structure*, which is a robot and the choice of what is free. Everything a case fixes
(dimensions, pose, twist) is an argument, so one program can serve every start, every task and every point of a sweep.
Variables are in the units of the case (radians for angles); :attr:`Nlp.scale` brings them to order 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import casadi as ca
import numpy as np
from casadi import SX

from screwsynth.models import FloatArray, Model
from screwsynth.nlp.case import Case
from screwsynth.nlp.expressions import Bounded, Constraint, RobotExpressions, Scalar
from screwsynth.nlp.kernel import Kernel
from screwsynth.nlp.values import Sense

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Places of three results among those of :meth:`Program.robot_state`.
OBJECTIVE, SQUARES, MAGNITUDE = 5, 6, 7
#: Multiples of the golden section, modulo 1, spread evenly.
_GOLDEN = 0.6180339887498949


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
