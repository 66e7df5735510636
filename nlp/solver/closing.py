"""Programs whose equations leave nothing to choose: they are closed by Newton's method, without a local solver.

A case that fixes all dimensions and the pose leaves the robot's internal unknowns alone as variables, as many as its
loops have independent equations. Where the loops cannot be closed, dependent equations cannot be told and all remain:
an interior-point method refuses a program with more equations than variables.
"""

from __future__ import annotations

import numpy as np

from ...models import FloatArray
from ..case.settings import Search
from ..evidence.closing import close_near, closed_start
from ..evidence.kkt import FEASIBLE, close_equations, linearise
from ..evidence.state import loops_are_closed
from ..program.epigraph import with_exact_level
from ..program.nlp import Nlp
from ..program.sampling import starting_points
from .interface import LocalSearch, SolverResult, StopReason


def closed_point(nlp: Nlp, search: Search) -> FloatArray:
    """Return the point (n,) of a case that leaves nothing free, with its loops closed.

    The assembly is that of home. Where the path from home does not reach the pose, loops are closed from sampled
    unknowns; where this fails too, the point is where Newton's method ended from home.

    Args:
        nlp: the program.
        search: number of starts and seed.
    """
    first = with_exact_level(nlp, closed_start(nlp))
    if _is_closed(nlp, first) or not nlp.n:
        return first
    for start in starting_points(nlp, search.starts, search.seed):
        x = with_exact_level(nlp, close_near(nlp, start, start))
        if _is_closed(nlp, x):
            return x
    return first


def closing(nlp: Nlp, search: Search, points: FloatArray, count: int) -> list[LocalSearch]:
    """Return searches that only close a program's equations; see :class:`screwsynth.nlp.solver.interface.Solver`."""
    del search, points

    def close(point: FloatArray) -> SolverResult:
        x = close_equations(nlp, point)
        reason = StopReason.SUCCEEDED if linearise(nlp, x).violation <= FEASIBLE else StopReason.INFEASIBLE
        zeros = np.zeros(nlp.n), np.zeros(len(nlp.program.constraints))
        return SolverResult(
            x=x, bound_multipliers=zeros[0], constraint_multipliers=zeros[1], reason=reason, iterations=0
        )

    return [close for _ in range(count)]


def _is_closed(nlp: Nlp, x: FloatArray) -> bool:
    """Return whether the robot's loops are closed at a point (n,)."""
    at = linearise(nlp, x)
    equations = np.abs(at.residual[nlp.sides.equal])
    return bool(equations.max(initial=0.0) <= FEASIBLE) and loops_are_closed(nlp, x)
