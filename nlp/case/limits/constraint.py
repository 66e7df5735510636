"""Named smooth constraints, and how their bounds read in the words of a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from casadi import SX

from ....models import Dimension


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
        exact: (1, 1) the measured number itself, where the expression tells it near the limit only.
    """

    name: str
    expression: SX
    reading: Reading
    keys: tuple[str, str] = ("", "")
    pose: int = 0
    exact: SX | None = None


@dataclass(frozen=True, eq=False)
class BoundedConstraint:
    """A constraint with its bounds."""

    constraint: Constraint
    lower: float
    upper: float
