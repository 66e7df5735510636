"""shgo of SciPy, simplicial, with SLSQP as its local search and its own handling of constraints."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem) -> FloatArray:
    """Return the best point found."""
    from scipy.optimize import shgo  # noqa: PLC0415 - may be missing

    constraints = []
    if problem.inequalities:
        constraints.append({"type": "ineq", "fun": lambda s: -problem.h(s), "jac": lambda s: -problem.h_jacobian(s)})
    if problem.equations:
        constraints.append({"type": "eq", "fun": problem.e, "jac": problem.e_jacobian})
    local = {"method": "SLSQP", "options": {"ftol": 1e-12}}
    bounds = [(-1, 1)] * problem.n
    options = {"jac": problem.f_gradient}
    return shgo(problem.f, bounds, constraints=constraints, minimizer_kwargs=local, options=options).x


PEERS = (Peer("SciPy shgo", "scipy", search, "exact", kind="global", is_random=False),)
