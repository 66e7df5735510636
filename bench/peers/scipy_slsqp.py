"""SLSQP of SciPy from one random start, with the exact gradient and with finite differences."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search_with_gradient(problem: Problem) -> FloatArray:
    """Return where SLSQP ends."""
    from scipy.optimize import minimize  # noqa: PLC0415 - may be missing

    constraints = [
        {"type": "ineq", "fun": lambda s: -problem.h(s), "jac": lambda s: -problem.h_jacobian(s)},
        {"type": "eq", "fun": problem.e, "jac": problem.e_jacobian},
    ]
    sizes = (problem.inequalities, problem.equations)
    options = {"ftol": 1e-12, "maxiter": 500}
    return minimize(
        problem.f,
        problem.start,
        jac=problem.f_gradient,
        method="SLSQP",
        bounds=[(-1, 1)] * problem.n,
        constraints=[each for each, size in zip(constraints, sizes, strict=True) if size],
        options=options,
    ).x


def search_by_differences(problem: Problem) -> FloatArray:
    """Return where SLSQP ends."""
    from scipy.optimize import minimize  # noqa: PLC0415 - may be missing

    constraints = [{"type": "ineq", "fun": lambda s: -problem.h(s)}, {"type": "eq", "fun": problem.e}]
    sizes = (problem.inequalities, problem.equations)
    options = {"ftol": 1e-12, "maxiter": 500}
    return minimize(
        problem.f,
        problem.start,
        method="SLSQP",
        bounds=[(-1, 1)] * problem.n,
        constraints=[each for each, size in zip(constraints, sizes, strict=True) if size],
        options=options,
    ).x


PEERS = (
    Peer("SciPy SLSQP", "scipy", search_with_gradient, "exact"),
    Peer("SciPy SLSQP, differences", "scipy", search_by_differences, "differences"),
)
