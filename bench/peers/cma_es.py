"""CMA-ES of pycma with restarts; constraints by penalty."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the best point found."""
    import cma  # noqa: PLC0415 - may be missing

    options = {"bounds": [-1, 1], "seed": problem.seed + 1, "verbose": -9, "tolfun": 1e-12, "tolx": 1e-10}
    found, _ = cma.fmin2(problem.penalised, problem.start, 0.5, options, bipop=True, restarts=3)
    return found


PEERS = (Peer("CMA-ES", "cma", search, constraints="penalty", kind="global"),)
