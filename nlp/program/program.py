"""Symbols and compiled functions of a nonlinear program; its values are in :class:`~.nlp.Nlp`.

A program belongs to a *structure*: a robot with a set of free parameters. All fixed values of a case (dimensions, pose,
twist) are arguments, so one program serves every start, task and point of a sweep. Variables are in the units of the
case (radians for angles); division by :attr:`~.nlp.Nlp.scale` makes them of magnitude about 1.

CasADi's functions are evaluated on NumPy arrays in place, by kernels that keep the memory of arguments and results: the
conversions of CasADi's general interface take twenty times as long as the functions of a parallel robot.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from threading import Lock
from typing import Generic, NamedTuple, TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, Model, RobotInstance, Substitution, Velocities
from ...models.actuation import expressions_of_paths
from ...models.arrays import buffer_on
from ...models.values import dataclass
from ...models.whole import Whole
from ..case.limits.constraint import Call, Constraint
from .places import Places, Scalar

T = TypeVar("T")


def tuple_of(*outputs: FloatArray) -> tuple[FloatArray, ...]:
    """Return the outputs of a function unchanged, as a tuple."""
    return outputs


def single_output(output: FloatArray) -> FloatArray:
    """Return the output of a function with a single output, unchanged."""
    return output


class Kernel(Generic[T]):
    """CasADi function with NumPy arrays as arguments and results; calls from several threads are safe.

    Args:
        function: function with any number of dense inputs and outputs.
        result: function that turns the outputs of a call, newly made arrays (rows, columns), into its return value.
    """

    def __init__(self, function: ca.Function, result: Callable[..., T]) -> None:
        self._result = result
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        # The buffer must outlive the evaluation handle that belongs to it, and the function must outlive both.
        self._function = function
        self._buffer, self._evaluate = buffer_on(function, self._inputs, self._outputs)
        self._lock = Lock()

    def __call__(self, *arguments: FloatArray | float) -> T:
        """Return the function's value.

        Args:
            arguments: number, or vector of the input's size, for each input.

        Raises:
            ValueError: the number of arguments or a size is wrong.
        """
        with self._lock:
            for memory, argument in zip(self._inputs, arguments, strict=True):
                memory[:] = argument
            self._evaluate()
            results = zip(self._outputs, self._shapes, strict=True)
            arrays = [memory.reshape(shape, order="F").copy() for memory, shape in results]
        return self._result(*arrays)


class Values(NamedTuple):
    """Objective F (1, 1) and constraints g (c, 1)."""

    F: FloatArray
    g: FloatArray


class Derivatives(NamedTuple):
    """Objective F (1, 1), its gradient (1, n), constraints g (c, 1) and their Jacobian (c, n)."""

    F: FloatArray
    gradient: FloatArray
    g: FloatArray
    jacobian: FloatArray


class ArgumentDerivatives(NamedTuple):
    """Gradient (1, k) of the objective and Jacobian (c, k) of the constraints with respect to the arguments."""

    gradient: FloatArray
    jacobian: FloatArray


class RobotNumbers(NamedTuple):
    """Values of a :class:`~screwsynth.models.RobotInstance` at one pose.

    Attributes:
        parameters: (k, 1) components of all parameters, radians for angles.
        rotation: (3, 3) ``R``, platform to world coordinates.
        position: (3, 1) ``p``, origin of the platform frame, length.
        jacobian: (m, 6) unit wrenches, force, then moment about the world origin.
        rates: (m, tasks) work rates.
        F: (tasks, 1) objective of each task.
        squares: (m, 1) squared length of each row's direction.
        magnitude: (tasks, 1) upper bound on F without cancellation.
        loops: (k, 1) left sides of all loop equations of the model.
        driven: (m, a) work rate of each row for a unit rate of each actuator.
        relations: (r, a) coefficients of the loop equations that involve only actuator rates.
        quantities: (n, 1) values of each quantity of the model, radians for angles.
    """

    parameters: FloatArray
    rotation: FloatArray
    position: FloatArray
    jacobian: FloatArray
    rates: FloatArray
    F: FloatArray
    squares: FloatArray
    magnitude: FloatArray
    loops: FloatArray
    driven: FloatArray
    relations: FloatArray
    quantities: tuple[FloatArray, ...]

    @classmethod
    def from_outputs(cls, *outputs: FloatArray) -> RobotNumbers:
        """Return the values from the outputs of :meth:`Program.robot_state`."""
        numbers, quantities = outputs[:11], outputs[11:]
        return cls._make((*numbers, quantities))

    @property
    def velocities(self) -> Velocities:
        """Velocity equations of the platform and the actuators."""
        return Velocities(self.jacobian, self.driven, self.relations)


@dataclass(frozen=True, eq=False)
class Program(Whole):
    """Symbols and expressions of a nonlinear program, without values of its bounds and arguments.

    Attributes:
        variables: free variables, in the order of ``x``.
        arguments: fixed arguments, in the order of ``p``.
        x: (n, 1) symbols of the variables.
        p: (k, 1) symbols of the arguments.
        objective: (1, 1) expression that is maximised or minimised.
        constraints: constraints in addition to the variables' bounds.
        robots: the robot's expressions at each pose.
        model: symbolic model of the robot.
        places: places of the case's parameters, rotations, unknowns, twists, directions and epigraph.
        objective_call: call that returns the objective, if it combines F of several poses; otherwise None.
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
    objective_call: Call | None = None

    def __repr__(self) -> str:
        counts = (
            f"{len(self.variables)} variables, {len(self.constraints)} constraints, {len(self.arguments)} arguments"
        )
        return f"<Program of robot {self.model.name!r}: {counts}>"

    @property
    def robot(self) -> RobotInstance:
        """Expressions of the robot, at the first pose if there are several."""
        return self.robots[0]

    @cached_property
    def g(self) -> SX:
        """(c, 1) expressions of all constraints."""
        return ca.vertcat(SX(0, 1), *[constraint.expression for constraint in self.constraints])

    @cached_property
    def values(self) -> ca.Function:
        """``(x, p) -> (F, g)``, as :class:`Values`."""
        return ca.Function("values", [self.x, self.p], [ca.densify(self.objective), ca.densify(self.g)])

    @cached_property
    def derivatives(self) -> ca.Function:
        """``(x, p) -> (F, dF/dx as a row, g, dg/dx)``, as :class:`Derivatives`."""
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
        """``(x, p) -> (dF/dp as a row, dg/dp)``, as :class:`ArgumentDerivatives`."""
        outputs = [ca.jacobian(self.objective, self.p), ca.jacobian(self.g, self.p)]
        return ca.Function("argument_derivatives", [self.x, self.p], [ca.densify(output) for output in outputs])

    def robot_state(self, pose: int = 0) -> ca.Function:
        """Return the function ``(x, p) -> RobotNumbers`` at one of the poses; its last outputs are the quantities."""
        robot = self.robots[pose]
        outputs = [robot.parameters, robot.rotation, robot.position, robot.jacobian, robot.rates, robot.F]
        outputs += [robot.squares, robot.magnitude, robot.loops, robot.driven, robot.relations, *robot.quantities]
        return ca.Function("robot_state", [self.x, self.p], [ca.densify(output) for output in outputs])

    @cached_property
    def kernels(self) -> Kernels:
        """Functions as kernels, with NumPy arrays as arguments and results."""
        return Kernels(self)


class Kernels:
    """Functions of a program as kernels on NumPy arrays, each made at first use.

    Arguments and results are those of the :class:`Program` properties of the same names.
    """

    def __init__(self, program: Program) -> None:
        self._program = program

    @cached_property
    def values(self) -> Kernel[Values]:
        """``(x, p)`` to objective and constraints."""
        return Kernel(self._program.values, Values)

    @cached_property
    def derivatives(self) -> Kernel[Derivatives]:
        """``(x, p)`` to objective and constraints with their first derivatives."""
        return Kernel(self._program.derivatives, Derivatives)

    @cached_property
    def hessian(self) -> Kernel[FloatArray]:
        """``(x, p, weight, multipliers)`` to the Hessian of the Lagrangian, (n, n)."""
        return Kernel(self._program.hessian, single_output)

    @cached_property
    def argument_derivatives(self) -> Kernel[ArgumentDerivatives]:
        """``(x, p)`` to the derivatives of objective and constraints with respect to the arguments."""
        return Kernel(self._program.argument_derivatives, ArgumentDerivatives)

    @cached_property
    def robot_state(self) -> Kernel[RobotNumbers]:
        """``(x, p)`` to the robot's values at the first pose."""
        return self.robot_states[0]

    @cached_property
    def robot_states(self) -> tuple[Kernel[RobotNumbers], ...]:
        """``(x, p)`` to the robot's values, one kernel for each pose."""
        poses = range(len(self._program.robots))
        return tuple(Kernel(self._program.robot_state(pose), RobotNumbers.from_outputs) for pose in poses)

    @cached_property
    def joint_screws(self) -> ca.Function:
        """Function from parameters, unknowns, rotation and position to the expressions of the model's paths."""
        model = self._program.model
        return ca.Function("joint_screws", Substitution.identity(model).all, expressions_of_paths(model.joint_screws))


def design_indices(program: Program) -> tuple[int, ...]:
    """Return the indices in ``x`` of dimensions and poses: all variables but joints and the epigraph level."""
    places = program.places
    others = set(places.inner)
    if places.epigraph is not None:
        others.add(places.epigraph.level)
    return tuple(k for k in range(len(program.variables)) if k not in others)


def design_names(program: Program) -> frozenset[str]:
    """Return the names of a design's variables and limits, without names of joints and closed loops."""
    model = program.model
    inner = {program.variables[index].name for index in program.places.inner}
    names = {each.name for each in program.variables} | {each.name for each in program.constraints}
    closed = tuple(equation.name for equation in (*model.closure, *model.loops))
    return frozenset(name for name in names - inner if name.split(" at ")[0] not in closed)
