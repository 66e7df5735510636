"""Largest numbers of iterations and evaluations of a solve in C, from the constants of the solver.

The generated C takes its constants from here; those of the search are read from its C.
"""

from __future__ import annotations

#: Largest number of iterations of one search.
_ITERATIONS = 100
#: Largest numbers of rescalings of F, and of searches for a feasible point, in one search.
_ROUNDS = 3
_RESTORES = 2
#: Number of second derivatives in one iteration: for the step; along the active sides, to recognise a saddle; and again
#: for the step.
_CURVATURES = 3
#: Number of first derivatives for each iteration so far, in addition to those of one line search. Of 34,000 searches in
#: seven cases none needed more than 3.7 for each iteration in total.
_DERIVATIVES = 4


def worst_case_texts(searches: int, phases: int, trials: int, programs: int) -> dict[str, str]:
    """Return the texts of the placeholders for the solver's constants and for its worst case.

    A search computes first derivatives in line searches, and a few times for each judged point. Judged points are one
    in each iteration, one at the end of each part (one part for each scale of F and each feasible point), and the first
    point, which scales the constraints.

    Args:
        searches: largest number of searches of a solve.
        phases: largest number of starts of a search: a search that leaves the home assembly mode is repeated within it.
        trials: largest number of step lengths in one iteration.
        programs: largest number of quadratic programs in one iteration.
    """
    parts = phases * (_ROUNDS + _RESTORES)
    by_iteration, by_search, magnitudes = _DERIVATIVES, trials + _DERIVATIVES * parts, 1 + phases + parts
    iterations = searches * _ITERATIONS
    return {
        "iterations": str(_ITERATIONS),
        "trials": str(trials),
        "rounds": str(_ROUNDS),
        "restores": str(_RESTORES),
        "most_searches": str(searches),
        "most_iterations": str(iterations),
        "derivatives_by_iteration": str(by_iteration),
        "derivatives_by_search": str(by_search),
        "curvatures_by_iteration": str(_CURVATURES),
        "magnitudes_by_search": str(magnitudes),
        "programs_by_iteration": str(programs),
        "most_derivatives": str(by_iteration * iterations + by_search * searches),
        "most_curvatures": str(_CURVATURES * iterations),
        "most_magnitudes": str(magnitudes * searches),
        "most_programs": str(programs * iterations),
    }
