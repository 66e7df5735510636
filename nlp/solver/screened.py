"""Screened starts: sequential quadratic programming in C searches each start, and Ipopt confirms the optima.

The search in C (:mod:`screwsynth.nlp.screening`) takes a fraction of Ipopt's time. Ipopt starts from each distinct
optimum of this search, with the multipliers, and Ipopt's last point is the answer. Ipopt also searches, from the
beginning, the starts from which the search in C does not converge, or whose result violates the program's conditions.
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
from .ipopt import Confirmation, constraint_sizes, ipopt
from .starts import SAME_F, Start, StartStatus, judge, known_optimum, same_value, search_from

#: Name of the search in C, for starts that it ended.
SCREEN = "sqp"
#: Number of starts that are screened before the first is confirmed: few, so that long searches show progress and can be
#: stopped with what they have.
_BLOCK = 32


def search_each(
    nlp: Nlp, points: FloatArray, search: Search, jobs: int | None = None, solver: Solver = ipopt
) -> Iterator[Start]:
    """Search a program from each of several points, with screening if the solver is Ipopt and the program allows it.

    Args:
        nlp: the nonlinear program.
        points: (k, n) starting points.
        search: settings of the solver, and whether starts are screened.
        jobs: number of threads; see :func:`~screwsynth.nlp.solver.starts.search_from`.
        solver: local solver.

    Yields:
        One result for each point, in order; after a stop request, only the results of complete searches.

    Raises:
        InputError: the objective cannot be compiled, although the search asks for it.
    """
    if solver is not ipopt or not search.screen or not can_screen(nlp):
        yield from search_from(nlp, points, search, jobs, solver)
        return
    confirmed = _Confirmed(nlp, search, constraint_sizes(nlp, points))
    for first in range(0, len(points), _BLOCK):
        yield from _search_block(nlp, points[first : first + _BLOCK], search, jobs, confirmed)
        if is_requested():
            return


def _search_block(
    nlp: Nlp, points: FloatArray, search: Search, jobs: int | None, confirmed: _Confirmed
) -> Iterator[Start]:
    """Search a block of points in C, confirm the results, and yield them in order; see :func:`search_each`."""
    found = screen(nlp, points, confirmed.sizes, search.max_iterations, jobs)
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
    left = [k for k, start in enumerate(starts) if start is None]
    searched = search_from(nlp, points[left], search, jobs)
    for start in starts[left[0] :]:
        following = start or next(searched, None)
        if following is None:  # interrupted
            return
        yield following


class _Confirmed:
    """Confirmation by Ipopt of optima from the search in C.

    Among points with equal F, Ipopt confirms the first point, and each point that is better even within rounding
    error. So the best point always comes from Ipopt.

    Args:
        nlp: the nonlinear program.
        search: settings of the solver.
        sizes: (c,) sizes of the constraints; see :func:`~screwsynth.nlp.solver.ipopt.constraint_sizes`.
    """

    def __init__(self, nlp: Nlp, search: Search, sizes: FloatArray) -> None:
        self._nlp, self._search, self.sizes = nlp, search, sizes
        self._confirmation: Confirmation | None = None
        self._known: list[Start] = []

    def start(self, found: Screened, k: int) -> Start | None:
        """Return the result of the k-th search; None if Ipopt must search from its starting point."""
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
        """Return the result for an optimum of the search in C; None if the point violates the program's conditions.

        Ipopt's point counts unless Ipopt fails from there, or moves to a worse point.
        """
        nlp = self._nlp
        own = replace(judge(nlp, screened), solver=SCREEN)
        is_good = own.status is StartStatus.CONVERGED
        if is_good and self._is_of_known_value(own):
            return own
        if self._confirmation is None:
            self._confirmation = Confirmation(nlp, self._search, self.sizes)
        result = self._confirmation(screened)
        iterations = screened.iterations + result.iterations
        if is_good and result.reason is StopReason.SUCCEEDED and known_optimum(nlp, result.x, [own]) is not None:
            return replace(own, iterations=iterations, solver=ipopt.__name__)
        confirmed = replace(judge(nlp, result), iterations=iterations)
        if confirmed.status is not StartStatus.CONVERGED:
            return own if is_good else None
        loss = nlp.sign * (confirmed.F - own.F)
        return own if is_good and loss > SAME_F * nlp.objective_scale else confirmed

    def _is_of_known_value(self, start: Start) -> bool:
        """Return whether Ipopt has confirmed a point that has the same F and is not worse."""
        tolerance, sign = same_value(self._nlp), self._nlp.sign
        known = (sign * (start.F - each.F) for each in self._known if each.solver != SCREEN)
        return any(0 <= worse <= tolerance for worse in known)
