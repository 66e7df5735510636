"""Largest numbers of iterations and evaluations of a solve in C, from the constants of the solver.

The generated C takes the constants from here, and those of the search are read from its C.
"""

from __future__ import annotations

#: Largest number of iterations of one search.
_ITERATIONS = 100
#: Number of times that F is scaled in one search, and that it looks for a feasible point first.
_ROUNDS = 3
_RESTORES = 2
#: Second derivatives in one iteration: for the step; along the sides that are active at the point, to recognise a
#: saddle; and again for the step.
_CURVATURES = 3
#: First derivatives that a search may have for each iteration so far, beside those of one line search. Of 34,000
#: searches in seven cases none had more than 3.7 for each iteration on the whole.
_DERIVATIVES = 4


def worst_case_texts(searches: int, phases: int, trials: int, programs: int) -> dict[str, str]:
    """Return the texts of the placeholders for the solver's constants and for its worst case.

    A search counts its first derivatives, and may have a few for each point that it has judged beside those of one line
    search: it judges one point in each iteration, and one at the end of each part, of which it has one for each scale
    of F and for each feasible point found. The point where it begins, which scales the constraints, is counted too.

    Args:
        searches: largest number of searches of a solve.
        phases: number of times that a search begins: again within home's assembly where it has left that one.
        trials: largest number of trial lengths of a step in one iteration.
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
