"""This program's ``solve``: formulation, all starts of the case, and the evidence. One attempt is a whole solve."""

from __future__ import annotations

from dataclasses import replace

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search_by_default(problem: Problem) -> FloatArray:
    """Return the answer of a solve as it is called by default, on one thread."""
    from screwsynth.nlp import solve  # noqa: PLC0415 - counted as a line of the call

    solution = solve(problem.case, seed=problem.seed, jobs=1)
    return _answer(problem, solution)


def search_without_screening(problem: Problem) -> FloatArray:
    """Return the answer of a solve by Ipopt from every start, as by ``screen = false`` in the case, on one thread."""
    from screwsynth.nlp import solve  # noqa: PLC0415 - counted as a line of the call

    case = replace(problem.case, search=replace(problem.case.search, screen=False))
    solution = solve(case, seed=problem.seed, jobs=1)
    return _answer(problem, solution)


def _answer(problem: Problem, solution: object) -> FloatArray:
    """Return the point of a solution in scaled variables, and note its iterations."""
    problem.iterations = sum(start.iterations for start in solution.starts)  # type: ignore[attr-defined]
    return (solution.x - problem.nlp.centre) / problem.nlp.scale  # type: ignore[attr-defined]


PEERS = (
    Peer("screwsynth solve", "screwsynth", search_by_default, "exact", kind="many starts"),
    Peer(
        "screwsynth solve, Ipopt from every start",
        "screwsynth",
        search_without_screening,
        "exact",
        kind="many starts",
    ),
)
