"""Typed places of a program's variables and arguments: indices in ``x`` or in ``p``.

A symbol is found by its typed place and never by its name. Names are only for people, so a robot may give its
parameters any names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import casadi as ca
from casadi import SX

from ...models import Dimension, component_names
from ...models.values import dataclass
from ..case.limits.constraint import Constraint
from ..case.pose import Free, Value


@dataclass(frozen=True)
class Scalar:
    """Named scalar of a program: a free variable, or an argument that a case fixes.

    Attributes:
        name: name for people.
        dimension: length, angle (radians) or dimensionless number.
    """

    name: str
    dimension: Dimension


@dataclass(frozen=True)
class Place:
    """Index of a scalar among the variables (``x``) or the arguments (``p``)."""

    vector: Literal["x", "p"]
    index: int


@dataclass(frozen=True, eq=False)
class FreeRotation:
    """Places of a rotation with a free axis.

    Attributes:
        q: indices in ``x`` of the vector part ``q`` of the unit quaternion.
        ball: constraint on ``|q|^2``.
    """

    q: tuple[int, int, int]
    ball: Constraint


@dataclass(frozen=True)
class HeldRotation:
    """Place of a rotation with a fixed axis.

    Attributes:
        angle: place of the angle, radians.
    """

    angle: Place


#: Places of a rotation; None for a free axis with an angle of zero.
RotationPlaces: TypeAlias = FreeRotation | HeldRotation | None


@dataclass(frozen=True, eq=False)
class Epigraph:
    """Places of the epigraph of a worst case: a variable that bounds several objectives.

    Attributes:
        level: index in ``x`` of the epigraph variable, the last variable.
        ceiling: index in ``p`` of the divisor of the constraints.
        constraints: constraint of each objective.
        best: indices in ``p`` of the separate optimum of each task; empty for a worst pose.
        power: 2 if the level is the root of the worst of squares.
    """

    level: int
    ceiling: int
    constraints: tuple[Constraint, ...]
    best: tuple[int, ...] = ()
    power: int = 1


@dataclass(frozen=True, eq=False)
class Places:
    """Places of a program's variables and arguments.

    Attributes:
        numbers: places of the case's parameters, in the order of :attr:`screwsynth.nlp.case.case.Case.scalars`.
        rotations: places of the rotation of each stated pose.
        unknowns: indices in ``x`` of the robot's unknowns, at each pose.
        twists: indices in ``p`` of the six numbers of each task's twist.
        directions: indices in ``x`` of the three components of each unit vector with three free components.
        epigraph: places of the epigraph of a worst case; None if the objective consists of F.
        weights: indices in ``p`` of the tasks' weights; empty for one task.
        further: indices in ``x`` of unknowns and dependent coordinates at workspace poses that are constraints.
        joints: indices in ``x`` of the free actuator coordinates among the unknowns, at each pose.
        dimensions: number of the first entries of ``numbers`` that are components of the robot's parameters.
        owners: index of the task of each variable of a case whose dimensions or pose change from task to task, None for
            a variable of all tasks; empty for other cases. A level is not counted.
        tasks: index of the task of each pose in such a case; otherwise empty.
    """

    numbers: tuple[Place, ...]
    rotations: tuple[RotationPlaces, ...]
    unknowns: tuple[tuple[int, ...], ...]
    twists: tuple[range, ...]
    directions: tuple[tuple[int, int, int], ...] = ()
    epigraph: Epigraph | None = None
    weights: tuple[int, ...] = ()
    further: tuple[int, ...] = ()
    joints: tuple[tuple[int, ...], ...] = ()
    dimensions: int = 0
    owners: tuple[int | None, ...] = ()
    tasks: tuple[int, ...] = ()

    @property
    def determined(self) -> tuple[int, ...]:
        """Indices in ``x`` of the unknowns that closed loops determine at the poses of the case."""
        free = {index for at_pose in self.joints for index in at_pose}
        return tuple(index for at_pose in self.unknowns for index in at_pose if index not in free)

    def of_task(self, task: int, count: int) -> list[int]:
        """Return the indices in ``x`` of the variables of one task's own program, in its order.

        Args:
            task: index of the task.
            count: number of variables, without a level.
        """
        return [k for k in range(count) if not self.owners or self.owners[k] in (None, task)]

    @property
    def inner(self) -> tuple[int, ...]:
        """Indices in ``x`` of all variables that closed loops determine."""
        return (*self.determined, *self.further)


class PlacedSymbols(NamedTuple):
    """Symbols of n scalars, (n, 1), and their places."""

    symbols: SX
    places: tuple[Place, ...]


class SymbolTable:
    """Symbols of a program under construction: free variables and fixed arguments, in the order of addition.

    Attributes:
        variables: names of the free variables.
        x: symbols of the free variables.
        bounds: bounds and start of each free variable.
        arguments: names of the fixed arguments.
        p: symbols of the fixed arguments.
        values: value of each fixed argument.
    """

    def __init__(self) -> None:
        self.variables: list[Scalar] = []
        self.x: list[SX] = []
        self.bounds: list[Free] = []
        self.arguments: list[Scalar] = []
        self.p: list[SX] = []
        self.values: list[float] = []
        self._names: set[str] = set()

    def add(self, name: str, dimension: Dimension, value: Value) -> PlacedSymbols:
        """Add a scalar, as a variable if it is free and as an argument if it is fixed.

        A name that is already in use gets the prefix ``program.``.

        Args:
            name: name for people.
            dimension: length, angle (radians) or dimensionless number.
            value: fixed value, or bounds.

        Returns:
            Symbol (1, 1) and its place.
        """
        name = f"program.{name}" if name in self._names else name
        self._names.add(name)
        symbol, scalar = SX.sym(name), Scalar(name, dimension)
        if isinstance(value, Free):
            self.variables.append(scalar)
            self.x.append(symbol)
            self.bounds.append(value)
            return PlacedSymbols(symbol, (Place("x", len(self.x) - 1),))
        self.arguments.append(scalar)
        self.p.append(symbol)
        self.values.append(value)
        return PlacedSymbols(symbol, (Place("p", len(self.p) - 1),))

    def add_each(self, names: Sequence[str], dimension: Dimension, values: Sequence[Value]) -> PlacedSymbols:
        """Add several scalars with the given names, and return their symbols (n, 1) and places."""
        added = [self.add(name, dimension, value) for name, value in zip(names, values, strict=True)]
        symbols = ca.vertcat(SX(0, 1), *[each.symbols for each in added])
        return PlacedSymbols(symbols, tuple(each.places[0] for each in added))

    def add_vector(self, name: str, dimension: Dimension, values: Sequence[Value]) -> PlacedSymbols:
        """Add the components of a vector, and return their symbols (n, 1) and places.

        The names are ``name_x, name_y, name_z``; for more than three components ``name_0, name_1`` and so on.
        """
        names = component_names(name, len(values)) if len(values) <= 3 else [f"{name}_{i}" for i in range(len(values))]
        return self.add_each(names, dimension, values)

    @property
    def variables_vector(self) -> SX:
        """(n, 1) symbols of the variables."""
        return ca.vertcat(SX(0, 1), *self.x)

    @property
    def arguments_vector(self) -> SX:
        """(k, 1) symbols of the arguments."""
        return ca.vertcat(SX(0, 1), *self.p)
