"""The nonlinear program: a :class:`Program` of symbols, and an :class:`Nlp` that gives it numbers.

A program is built for a *structure*, which is a robot and the choice of what is free. Everything a case fixes
(dimensions, pose, twist) is an argument, so one program can serve every start, every task and every point of a sweep.
Variables are in the units of the case (radians for angles); :attr:`Nlp.scale` brings them to order 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
from casadi import SX

from ...models import Dimension, Model, RobotInstance
from ..case.limits.constraint import Constraint
from .kernel import Kernel

#: Places of three results among those of :meth:`Program.robot_state`.
OBJECTIVE, SQUARES, MAGNITUDE = 5, 6, 7


@dataclass(frozen=True)
class Scalar:
    """A named scalar of a program: a free variable or an argument that a case fixes."""

    name: str
    dimension: Dimension


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
    robot: RobotInstance
    model: Model
    directions: tuple[tuple[int, int, int], ...] = ()
    further: tuple[RobotInstance, ...] = ()

    @property
    def robots(self) -> tuple[RobotInstance, ...]:
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
        """``(x, p) ->`` every number of :class:`RobotInstance`, in its order, at one of the poses."""
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
