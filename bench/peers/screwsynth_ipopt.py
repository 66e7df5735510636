"""One search by Ipopt from one random start, as this program does it: the solver is built anew for each attempt."""

from __future__ import annotations

from dataclasses import replace

from screwsynth.models import FloatArray
from screwsynth.nlp.solver.ipopt import ipopt

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return where Ipopt and the correction that follows it end."""
    from screwsynth.nlp import Search, solve_program  # noqa: PLC0415 - counted as a line of the call

    nlp = replace(problem.nlp, start=problem.x(problem.start))
    solution = solve_program(nlp, Search(starts=1), jobs=1, solver=ipopt)
    problem.iterations = sum(start.iterations for start in solution.starts)
    return (solution.x - nlp.centre) / nlp.scale


PEERS = (Peer("screwsynth, Ipopt from one start", "screwsynth", search, "exact"),)
