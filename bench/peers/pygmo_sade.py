"""Self-adaptive differential evolution of pygmo; constraints by penalty."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the best of the last population."""
    import pygmo  # noqa: PLC0415 - may be missing

    class Penalised:
        def fitness(self, s: FloatArray) -> list[float]:
            return [problem.penalised(s)]

        def get_bounds(self) -> tuple[list[float], list[float]]:
            return [-1.0] * problem.n, [1.0] * problem.n

    population = pygmo.population(Penalised(), size=20, seed=problem.seed)
    method = pygmo.algorithm(pygmo.sade(gen=100_000, ftol=1e-12, xtol=1e-9, seed=problem.seed))
    return method.evolve(population).champion_x


PEERS = (Peer("pygmo SADE", "pygmo", search, constraints="penalty", kind="global"),)
