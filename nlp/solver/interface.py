"""Interface of local solvers: any function of the type :class:`Solver` can search a program.

A solver reports its last point, the multipliers, the stop reason, and the number of iterations. The report is never
trusted: :mod:`screwsynth.nlp.solver.starts` corrects the point and checks its optimality conditions.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from typing import Protocol

from ...models import FloatArray
from ...models.values import dataclass
from ..case.settings import Search
from ..program.nlp import Nlp


class StopReason(enum.Enum):
    """Reason why a local solver stopped."""

    SUCCEEDED = "succeeded"
    ITERATION_LIMIT = "iteration limit"
    INFEASIBLE = "infeasible"
    UNDEFINED = "undefined"
    OTHER = "other"


@dataclass(frozen=True, eq=False)
class SolverResult:
    """Report of a local solver about the point at which it stopped.

    Multipliers belong to the scaled problem of :mod:`screwsynth.nlp.evidence.kkt`, with variables in half ranges and a
    scaled objective to be minimised. They are positive at an upper limit and negative at a lower limit.

    Attributes:
        x: (n,) last point, in the units of the program.
        bound_multipliers: (n,) multipliers of the variables' bounds, per half range.
        constraint_multipliers: (c,) multipliers of the constraints, per unit of their expressions.
        reason: reason why the solver stopped.
        iterations: number of iterations.
    """

    x: FloatArray
    bound_multipliers: FloatArray
    constraint_multipliers: FloatArray
    reason: StopReason
    iterations: int


#: A search from one starting point (n,), in the program's units.
LocalSearch = Callable[[FloatArray], SolverResult]


class Solver(Protocol):
    """Interface of local solvers: a function that prepares searches of a nonlinear program."""

    def __call__(self, nlp: Nlp, search: Search, points: FloatArray, count: int) -> Sequence[LocalSearch]:
        """Return ``count`` searches that may run at the same time, each in one thread only.

        Args:
            nlp: nonlinear program with at least one variable.
            search: limit of iterations, and whether functions are compiled.
            points: (k, n) starting points of the searches, by which a solver may scale the problem.
            count: number of searches.

        Raises:
            InputError: the program cannot be compiled, although the search asks for it.
        """
        ...
