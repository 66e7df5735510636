"""Nonlinear program with values: bounds, arguments, scale, and sides of bounds and constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple, Self, TypeAlias

import casadi as ca
import numpy as np

from ...models import FloatArray, frozen_vector
from ...models.values import dataclass
from ...models.whole import Whole
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, PairFamily
from ..case.task import Sense
from .program import Kernel, Program, single_output

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Golden ratio: its multiples modulo 1 are spread evenly over the unit interval.
_GOLDEN = 0.6180339887498949
#: Relative change of the objective between the bounds below which the change is the scale: tolerances of 1e-7 would
#: otherwise exceed 2e-5 of the possible gain. Ordinary cases have 0.01 to 1.
_NARROW = 5e-3
#: Smallest relative scale of the objective: smaller changes drown in the rounding of its derivatives.
_SMALLEST_CHANGE = 1e-8
#: Number of points at which changes are measured.
_POINTS = 9
#: Relative inexactness of an objective in rounding units: a few for each of its successive operations.
_ROUNDINGS = 16

#: Sides of a limit: lower, upper, or both at once.
Bound: TypeAlias = Literal["min", "max", "equal"]


class PairPlace(NamedTuple):
    """Pair of values with one limit: index of its family of values, and indices of both values in the family."""

    family: int
    first: int
    second: int


class Evaluation(NamedTuple):
    """Objective and constraints (c,) at a point."""

    F: float
    g: FloatArray


@dataclass(frozen=True)
class Side:
    """One side of a variable's bounds or of a constraint.

    Attributes:
        name: name of the variable or constraint.
        bound: kind of the side: ``min`` or ``max``; ``equal`` for an equation, which has one side.
        variable: index of the variable; None for a constraint.
        constraint: index of the constraint; None for a variable's bound.
    """

    name: str
    bound: Bound
    variable: int | None = None
    constraint: int | None = None


@dataclass(frozen=True, eq=False)
class Sides:
    """All sides of a program as arrays: bounds of the variables, then constraints.

    Attributes:
        sides: sides, k of them.
        place: (k,) index of each side's expression among the variables followed by the constraints.
        sign: (k,) -1 for a lower and +1 for an upper side, the sign of an infeasible change; +1 for an equation.
        limit: (k,) bound of each side, in the units of its expression.
        equal: (k,) True for an equation.
    """

    sides: tuple[Side, ...]
    place: NDArray[np.intp]
    sign: FloatArray
    limit: FloatArray
    equal: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Nlp(Whole):
    """Nonlinear program with values, the basis of every solver, certificate and report.

    Attributes:
        program: symbols of the program.
        case: the case of the program, for names and units.
        sense: maximisation or minimisation of the objective.
        arguments: (k,) values of the program's arguments.
        lower: (n,) lower bounds of the variables.
        upper: (n,) upper bounds, ``lower < upper``.
        start: (n,) first starting point.
        g_lower: (c,) lower sides of the constraints; minus infinity without a lower side.
        g_upper: (c,) upper sides of the constraints; equal to the lower ones for an equation.
        constant_limits: satisfied limits that depend on no variable, and so are not constraints.
        families: limits on many pairs of values. Only the pairs in ``pairs`` are constraints; see :mod:`.pairs`.
        implied: equations that the fixed parameters satisfy, as in :class:`~.layout.Layout`.
        fixed_families: families of fixed values.
        pairs: family, first and second index of the pairs that are the program's last constraints.
        pair_count: number of constraints of these pairs.
        in_home_mode: True if a search of the whole box keeps to the home working mode of a robot given joint by joint.
        size: magnitude of an objective that does not consist of the robot's F; otherwise None.
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
    families: tuple[PairFamily, ...] = ()
    implied: tuple[BoundedConstraint, ...] = ()
    fixed_families: tuple[PairFamily, ...] = ()
    pairs: tuple[PairPlace, ...] = ()
    pair_count: int = 0
    in_home_mode: bool = False
    size: float | None = None

    def __repr__(self) -> str:
        return f"<Nlp of {self.case.name!r}: {self.sense.value} F, {self.program!r}>"

    @property
    def n(self) -> int:
        """Number of free variables."""
        return len(self.program.variables)

    @property
    def is_fixed(self) -> bool:
        """True if loops determine all variables except the level of a worst pose."""
        places = self.program.places
        own = set(places.inner)
        own |= set() if places.epigraph is None else {places.epigraph.level}
        return len(own) == self.n

    @property
    def is_overdetermined(self) -> bool:
        """True if there are more equations than variables, so that a local solver has no freedom of choice."""
        return int(np.count_nonzero(self.g_lower == self.g_upper)) > self.n

    @cached_property
    def scale(self) -> FloatArray:
        """(n,) half of each variable's range: scaled variables run from -1 to 1 between the bounds."""
        return (self.upper - self.lower) / 2

    @property
    def centre(self) -> FloatArray:
        """(n,) middle of the box."""
        return (self.upper + self.lower) / 2

    @property
    def sign(self) -> float:
        """Factor of the objective for minimisation: -1 for a maximum, 1 for a minimum."""
        return -self.sense.sign

    def stated_limit(self, j: int) -> float:
        """Return the bound of side j in the case, in the units of its expression."""
        side = self.sides.sides[j]
        stated = None if side.constraint is None else self.program.constraints[side.constraint].stated
        return float(self.sides.limit[j]) if stated is None else stated[0 if side.bound == "min" else 1]

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

    @cached_property
    def family_values(self) -> Kernel[FloatArray]:
        """``(x, p)`` to the values of all families, one below the other, (sum of N, 1)."""
        values = ca.densify(ca.vertcat(*[family.values for family in self.families]))
        return Kernel(ca.Function("family_values", [self.program.x, self.program.p], [values]), single_output)

    def evaluate(self, x: FloatArray) -> Evaluation:
        """Return the objective and the constraints at a point (n,)."""
        F, g = self.program.kernels.values(x, self.arguments)
        return Evaluation(float(F[0, 0]), g.ravel())

    @cached_property
    def objective_scale(self) -> float:
        """Scale of the objective: its magnitude or, for narrow ranges, its change between the bounds.

        The change is the largest sum of scaled derivatives at a few points.
        """
        size = self.objective_size
        if not self.has_scale_of_changes:
            return size
        changes = [float(np.abs(row[0]).sum()) for row in self._scaled_rows]
        change = max((each for each in changes if np.isfinite(each)), default=size)
        return float(scale_of_change(np.array(size), np.array(change)))

    @cached_property
    def rounding(self) -> float:
        """Rounding error of the scaled objective and its derivatives: about 1e-15, and larger for narrow ranges."""
        return _ROUNDINGS * float(np.finfo(float).eps) * self.objective_size / self.objective_scale

    @cached_property
    def row_sizes(self) -> FloatArray:
        """(c,) longest gradient of each constraint in scaled variables at a few points; 0 if undefined."""
        rows = [np.linalg.norm(each[1:], axis=1) for each in self._scaled_rows]
        return np.asarray(np.nan_to_num(np.array(rows), nan=0.0, posinf=0.0).max(axis=0), dtype=np.float64)

    def with_constraints(self, added: Sequence[BoundedConstraint]) -> Self:
        """Return the program with further constraints."""
        program = replace(self.program, constraints=(*self.program.constraints, *(item.constraint for item in added)))
        return replace(
            self,
            program=program,
            g_lower=frozen_vector([*self.g_lower, *(item.lower for item in added)]),
            g_upper=frozen_vector([*self.g_upper, *(item.upper for item in added)]),
        )

    @cached_property
    def _scaled_rows(self) -> list[FloatArray]:
        """Derivatives (1 + c, n) of objective and constraints in scaled variables, at a few points of the box."""
        points = [self.centre + self.scale * each for each in self.shares]
        found = [self.program.kernels.derivatives(point, self.arguments) for point in points]
        return [np.vstack([each.gradient.reshape(1, -1), each.jacobian]) * self.scale for each in found]

    @property
    def has_scale_of_changes(self) -> bool:
        """True if the objective's scale may be its change between the bounds; False with free directions."""
        return bool(self.n) and self.size is None and not self.program.places.directions

    @property
    def shares(self) -> list[FloatArray]:
        """Points (n,) at which changes are sampled, in half ranges from the middle of the box."""
        return [np.zeros(self.n), *(2 * self._spread(k) for k in range(1, _POINTS))]

    def _spread(self, k: int) -> FloatArray:
        """Return the k-th of evenly spread points (n,), in half ranges from the middle, k >= 1."""
        return np.asarray(np.modf(k * _GOLDEN * np.arange(1, self.n + 1))[0] - 0.5, dtype=np.float64)

    @cached_property
    def objective_size(self) -> float:
        """Sum of the magnitudes of the terms of the objective at the first starting point: positive even if F is 0.

        If the robot is undefined there, for example with limbs of zero length, the first of a few points around the
        middle of the box with a defined robot is used; without such a point, the value is 1.
        """
        if self.size is not None:
            return self.size
        around = (self._spread(k) for k in range(1, 9))
        for x in (self.start, *(self.centre + self.scale * each for each in around)):
            kernels, tasks = self.program.kernels, self.program.places.tasks
            # The first pose of all tasks, or of each task.
            firsts = [tasks.index(task) for task in dict.fromkeys(tasks)] or [0]
            size = float(np.max([kernels.robot_states[k](x, self.arguments).magnitude for k in firsts]))
            if np.isfinite(size) and size > 0:
                return size
        return 1.0


def scale_of_change(size: FloatArray, change: FloatArray) -> FloatArray:
    """Return the scale of objectives from their sizes and their changes between the bounds."""
    return np.where(change >= _NARROW * size, size, np.maximum(change, _SMALLEST_CHANGE * size))
