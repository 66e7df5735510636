"""Starts that are screened: each is searched by sequential quadratic programming in C, and Ipopt has the last word.

The search in C (:mod:`screwsynth.nlp.screening`) takes a fraction of Ipopt's time. Every distinct point that it finds is
given to Ipopt, with its multipliers, and it is Ipopt's point that is corrected and judged. A start from which the
search in C does not converge, or whose end the program's own conditions refuse, is searched by Ipopt from the
beginning, so that no start is lost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...models import FloatArray
from ..case.settings import Search
from ..interruption import is_requested
from ..program.nlp import Nlp
from ..screening.screening import Screened, can_screen, screen
from .interface import Solver, SolverResult, StopReason
from .ipopt import Confirmation, ipopt
from .starts import SAME_F, Start, StartStatus, judge, known_optimum, search_from

#: Name of the search in C as the solver that ended a start.
SCREEN = "sqp"


def search_each(
    nlp: Nlp, points: FloatArray, search: Search, jobs: int | None = None, solver: Solver = ipopt
) -> Iterator[Start]:
    """Search a program from each of several points, with screening where the solver is Ipopt and it applies.

    Args:
        nlp: the program.
        points: (k, n) starting points.
        search: the solver's settings, and whether starts are screened.
        jobs: as for :func:`~screwsynth.nlp.solver.starts.search_from`.
        solver: the local solver.

    Yields:
        One start for each point, in their order; those that are done, where the work is requested to stop.

    Raises:
        InputError: the objective is to be compiled, and cannot be.
    """
    if solver is not ipopt or not search.screen or not can_screen(nlp):
        yield from search_from(nlp, points, search, jobs, solver)
        return
    found = screen(nlp, points, search.max_iterations, jobs)
    confirmed = _Confirmed(nlp, search, points)
    starts: list[Start | None] = []
    for k in range(len(points)):
        if is_requested():
            return
        starts.append(confirmed.start(found, k))
        start = starts[-1]
        if start is not None and None not in starts:
            yield start
    if None not in starts:
        return
    first = starts.index(None)
    left = [k for k, start in enumerate(starts) if start is None]
    searched = search_from(nlp, points[left], search, jobs, solver)
    for start in starts[first:]:
        following = start or next(searched, None)
        if following is None:  # interrupted
            return
        yield following


class _Confirmed:
    """Starts that the search in C brought to an optimum, and that Ipopt confirms.

    Args:
        nlp: the program.
        search: the solver's settings.
        points: (k, n) starting points, by which Ipopt's problem is scaled.
    """

    def __init__(self, nlp: Nlp, search: Search, points: FloatArray) -> None:
        self._nlp, self._search, self._points = nlp, search, points
        self._confirmation: Confirmation | None = None
        self._known: list[Start] = []

    def start(self, found: Screened, k: int) -> Start | None:
        """Return the k-th start, or None where Ipopt must search from its beginning."""
        if not found.converged[k]:
            return None
        n, iterations = self._nlp.n, int(found.iterations[k])
        screened = SolverResult(
            x=found.x[k],
            bound_multipliers=found.multipliers[k, :n],
            constraint_multipliers=found.multipliers[k, n:],
            reason=StopReason.SUCCEEDED,
            iterations=iterations,
        )
        same = known_optimum(self._nlp, screened.x, self._known)
        if same is not None:
            return replace(same, iterations=iterations, solver=SCREEN)
        start = self._confirm(screened)
        if start is not None:
            self._known.append(start)
        return start

    def _confirm(self, screened: SolverResult) -> Start | None:
        """Return the start whose search in C ended at an optimum; None where its end is none by the program's conditions.

        Ipopt's point counts unless Ipopt fails from there, or leaves for a worse one.
        """
        nlp = self._nlp
        if self._confirmation is None:
            self._confirmation = Confirmation(nlp, self._search, self._points)
        confirmed = self._confirmation(screened)
        best = nlp.sign * nlp.evaluate(screened.x)[0] + SAME_F * nlp.objective_scale
        for result, name in ((confirmed, "ipopt"), (screened, SCREEN)):
            start = judge(nlp, result)
            if start.status is StartStatus.CONVERGED and nlp.sign * start.F <= best:
                iterations = screened.iterations + (confirmed.iterations if name == "ipopt" else 0)
                return replace(start, iterations=iterations, solver=name)
        return None
