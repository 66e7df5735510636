"""DIRECT of SciPy; constraints by penalty."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the middle of the best box."""
    from scipy.optimize import direct  # noqa: PLC0415 - may be missing

    bounds = [(-1, 1)] * problem.n
    return direct(problem.penalised, bounds, maxfun=1_000_000, maxiter=1_000_000, vol_tol=0, len_tol=1e-9).x


PEERS = (Peer("SciPy direct", "scipy", search, constraints="penalty", kind="global", is_random=False),)
