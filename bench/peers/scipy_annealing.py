"""dual_annealing of SciPy, with its own local search; constraints by penalty."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the best point found."""
    from scipy.optimize import dual_annealing  # noqa: PLC0415 - may be missing

    return dual_annealing(problem.penalised, [(-1, 1)] * problem.n, rng=problem.seed).x


PEERS = (Peer("SciPy dual_annealing", "scipy", search, constraints="penalty", kind="global"),)
