"""Monotonic basin hopping of pygmo over a local search: compass search, or SLSQP of NLopt."""

from __future__ import annotations

from functools import partial

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem, local: str) -> FloatArray:
    """Return the best point found."""
    import pygmo  # noqa: PLC0415 - may be missing

    class Constrained:
        def fitness(self, s: FloatArray) -> list[float]:
            return [problem.f(s), *problem.e(s), *problem.h(s)]

        def gradient(self, s: FloatArray) -> list[float]:
            rows = [problem.f_gradient(s), *problem.e_jacobian(s), *problem.h_jacobian(s)]
            return [each for row in rows for each in row]

        def get_bounds(self) -> tuple[list[float], list[float]]:
            return [-1.0] * problem.n, [1.0] * problem.n

        def get_nec(self) -> int:
            return problem.equations

        def get_nic(self) -> int:
            return problem.inequalities

    if local == "slsqp":
        inner = pygmo.nlopt("slsqp")
        inner.ftol_rel, inner.xtol_rel = 1e-12, 1e-9
    else:
        inner = pygmo.compass_search(max_fevals=10_000, start_range=0.1, stop_range=1e-9)
    pygmo_problem = pygmo.problem(Constrained())
    pygmo_problem.c_tol = 1e-9
    population = pygmo.population(pygmo_problem, size=1, seed=problem.seed)
    method = pygmo.algorithm(pygmo.mbh(pygmo.algorithm(inner), stop=5, perturb=0.3, seed=problem.seed))
    return method.evolve(population).champion_x


PEERS = (
    Peer("pygmo basin hopping over SLSQP", "pygmo", partial(search, local="slsqp"), "exact", kind="global"),
    Peer("pygmo basin hopping over compass search", "pygmo", partial(search, local="compass"), kind="global"),
)
