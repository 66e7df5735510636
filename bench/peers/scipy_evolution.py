"""differential_evolution of SciPy, with its own handling of constraints; its own polish is left out."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the best of the last population."""
    from scipy.optimize import NonlinearConstraint, differential_evolution  # noqa: PLC0415 - may be missing

    constraints = []
    if problem.inequalities:
        constraints.append(NonlinearConstraint(problem.h, -float("inf"), 0))
    if problem.equations:
        constraints.append(NonlinearConstraint(problem.e, 0, 0))
    bounds = [(-1, 1)] * problem.n
    return differential_evolution(
        problem.f, bounds, constraints=constraints, rng=problem.seed, tol=1e-8, maxiter=10_000, polish=False
    ).x


PEERS = (Peer("SciPy differential_evolution", "scipy", search, kind="global"),)
