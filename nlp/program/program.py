"""The nonlinear program: a :class:`Program` of symbols, and an :class:`Nlp` that gives it numbers.

A program is built for a *structure*, which is a robot and the choice of what is free. Everything a case fixes
(dimensions, pose, twist) is an argument, so one program can serve every start, every task and every point of a sweep.
Variables are in the units of the case (radians for angles); :attr:`Nlp.scale` brings them to order 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import FloatArray, Model, RobotInstance
from ..case.limits.constraint import Constraint
from .kernel import Kernel, the_only
from .places import Places, Scalar

#: Places of three results among those of :meth:`Program.robot_state`.
OBJECTIVE, SQUARES, MAGNITUDE = 5, 6, 7


class Values(NamedTuple):
    """Objective (1, 1) and constraints (c, 1)."""

    F: FloatArray
    g: FloatArray


class Derivatives(NamedTuple):
    """Objective (1, 1), its gradient (1, n), constraints (c, 1) and their Jacobian (c, n)."""

    F: FloatArray
    gradient: FloatArray
    g: FloatArray
    jacobian: FloatArray


class ArgumentDerivatives(NamedTuple):
    """Gradient (1, k) of the objective and Jacobian (c, k) of the constraints by the arguments."""

    gradient: FloatArray
    jacobian: FloatArray


class RobotNumbers(NamedTuple):
    """The numbers of a :class:`~screwsynth.models.RobotInstance`: parameters (k, 1), rates (m, tasks) and so on."""

    parameters: FloatArray
    rotation: FloatArray
    position: FloatArray
    jacobian: FloatArray
    rates: FloatArray
    F: FloatArray
    squares: FloatArray
    magnitude: FloatArray
    quantities: tuple[FloatArray, ...]

    @classmethod
    def from_outputs(cls, *outputs: FloatArray) -> RobotNumbers:
        """Return the numbers from the outputs of :meth:`Program.robot_state`."""
        parameters, rotation, position, jacobian, rates, F, squares, magnitude, *quantities = outputs
        return cls(parameters, rotation, position, jacobian, rates, F, squares, magnitude, tuple(quantities))


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
        robots: the robot's expressions at each pose.
        model: the robot itself.
        places: where the case's numbers, rotations, unknowns, twists and directions stand.
    """

    variables: tuple[Scalar, ...]
    arguments: tuple[Scalar, ...]
    x: SX
    p: SX
    objective: SX
    constraints: tuple[Constraint, ...]
    robots: tuple[RobotInstance, ...]
    model: Model
    places: Places

    @property
    def robot(self) -> RobotInstance:
        """The robot's expressions, at the first pose where there are several."""
        return self.robots[0]

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
    def values(self) -> Kernel[Values]:
        """Objective and constraints."""
        return Kernel(self._program.values, Values)

    @cached_property
    def derivatives(self) -> Kernel[Derivatives]:
        """Objective and constraints with first derivatives."""
        return Kernel(self._program.derivatives, Derivatives)

    @cached_property
    def hessian(self) -> Kernel[FloatArray]:
        """Hessian of the Lagrangian."""
        return Kernel(self._program.hessian, the_only)

    @cached_property
    def argument_derivatives(self) -> Kernel[ArgumentDerivatives]:
        """Derivatives by what is fixed."""
        return Kernel(self._program.argument_derivatives, ArgumentDerivatives)

    @cached_property
    def robot_state(self) -> Kernel[RobotNumbers]:
        """The robot's expressions, at the first pose."""
        return self.robot_states[0]

    @cached_property
    def robot_states(self) -> tuple[Kernel[RobotNumbers], ...]:
        """The robot's expressions at each pose."""
        poses = range(len(self._program.robots))
        return tuple(Kernel(self._program.robot_state(pose), RobotNumbers.from_outputs) for pose in poses)
