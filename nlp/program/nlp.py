"""The nonlinear program with its numbers: bounds, arguments, scale and the sides of bounds and constraints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.whole import Whole
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint
from ..case.task import Sense
from .program import Program

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Golden section: its multiples modulo 1 are spread evenly over the unit interval.
_GOLDEN = 0.6180339887498949


class Evaluation(NamedTuple):
    """Objective and constraints (c,) at a point."""

    F: float
    g: FloatArray


@dataclass(frozen=True)
class Side:
    """One side of a variable's bounds or of a constraint.

    Attributes:
        name: name of the variable or constraint.
        bound: ``min`` or ``max``; ``equal`` for an equation, which has one side.
        variable: index of the variable, or None for a constraint.
        constraint: index of the constraint, or None for a variable's bound.
    """

    name: str
    bound: Literal["min", "max", "equal"]
    variable: int | None = None
    constraint: int | None = None


@dataclass(frozen=True, eq=False)
class Sides:
    """All sides of a program as arrays: those of the variables' bounds, then those of the constraints.

    Attributes:
        sides: the k sides.
        place: (k,) index of each side's expression among the variables, followed by the constraints.
        sign: (k,) -1 for a lower and +1 for an upper side: the sign of a change of the expression that leaves the
            feasible side; +1 for an equation.
        limit: (k,) bound of each side, in the units of its expression.
        equal: (k,) whether the side is an equation.
    """

    sides: tuple[Side, ...]
    place: NDArray[np.intp]
    sign: FloatArray
    limit: FloatArray
    equal: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Nlp(Whole):
    """A program with its numbers, on which every solver, certificate and report is based.

    Attributes:
        program: the symbols.
        case: the case of the program, for names and units.
        sense: whether the objective is maximised or minimised.
        arguments: (k,) values of the program's arguments.
        lower, upper: (n,) bounds of the variables, ``lower < upper``.
        start: (n,) first starting point.
        g_lower, g_upper: (c,) lower and upper sides of the constraints: infinite where there is none, equal for an
            equation.
        constant_limits: limits of the case that depend on no variable and hold, so that they are no constraints of the
            program.
        size: positive size of the objective, where the objective does not consist of the robot's F.
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
    constant_limits: tuple[BoundedConstraint, ...] = ()
    size: float | None = None

    def __repr__(self) -> str:
        return f"<Nlp of {self.case.name!r}: {self.sense.value} F, {self.program!r}>"

    @property
    def n(self) -> int:
        """Number of free variables."""
        return len(self.program.variables)

    @cached_property
    def scale(self) -> FloatArray:
        """(n,) half of each variable's range, so that scaled variables run from -1 to 1 between the bounds."""
        return (self.upper - self.lower) / 2

    @property
    def centre(self) -> FloatArray:
        """(n,) middle of the box."""
        return (self.upper + self.lower) / 2

    @property
    def sign(self) -> float:
        """Factor that turns the objective into one to be minimised: -1 for a maximum, 1 for a minimum."""
        return -1.0 if self.sense is Sense.MAX else 1.0

    @cached_property
    def sides(self) -> Sides:
        """All sides of the variables' bounds and of the constraints."""
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
        return Sides(
            sides=tuple(sides),
            place=np.array(place, dtype=np.intp),
            sign=np.array([-1.0 if side.bound == "min" else 1.0 for side in sides]),
            limit=np.array(limits, dtype=np.float64),
            equal=np.array([side.bound == "equal" for side in sides], dtype=bool),
        )

    def evaluate(self, x: FloatArray) -> Evaluation:
        """Return the objective and the constraints at a point (n,)."""
        F, g = self.program.kernels.values(x, self.arguments)
        return Evaluation(float(F[0, 0]), g.ravel())

    @cached_property
    def objective_scale(self) -> float:
        """Size of the objective without cancellation at the first starting point: positive also where F is 0.

        Where the robot is not defined at that point, as with limbs of zero length, the size is evaluated at the first
        of a few points around the middle of the box at which the robot is defined; 1 where there is none.
        """
        if self.size is not None:
            return self.size
        around = (np.modf(k * _GOLDEN * np.arange(1, self.n + 1))[0] - 0.5 for k in range(1, 9))
        for x in (self.start, *(self.centre + self.scale * each for each in around)):
            size = float(np.max(self.program.kernels.robot_state(x, self.arguments).magnitude))
            if np.isfinite(size) and size > 0:
                return size
        return 1.0
