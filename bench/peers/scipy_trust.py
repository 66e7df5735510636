"""trust-constr of SciPy from one random start, with the exact gradient and with finite differences."""

from __future__ import annotations

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search_with_gradient(problem: Problem) -> FloatArray:
    """Return where trust-constr ends."""
    from scipy.optimize import Bounds, NonlinearConstraint, minimize  # noqa: PLC0415 - may be missing

    constraints = []
    if problem.inequalities:
        constraints.append(NonlinearConstraint(problem.h, -float("inf"), 0, jac=problem.h_jacobian))
    if problem.equations:
        constraints.append(NonlinearConstraint(problem.e, 0, 0, jac=problem.e_jacobian))
    return minimize(
        problem.f,
        problem.start,
        jac=problem.f_gradient,
        method="trust-constr",
        bounds=Bounds(-1, 1),
        constraints=constraints,
        options={"gtol": 1e-9, "xtol": 1e-11, "maxiter": 2000},
    ).x


def search_by_differences(problem: Problem) -> FloatArray:
    """Return where trust-constr ends."""
    from scipy.optimize import Bounds, NonlinearConstraint, minimize  # noqa: PLC0415 - may be missing

    constraints = []
    if problem.inequalities:
        constraints.append(NonlinearConstraint(problem.h, -float("inf"), 0))
    if problem.equations:
        constraints.append(NonlinearConstraint(problem.e, 0, 0))
    return minimize(
        problem.f,
        problem.start,
        jac="2-point",
        method="trust-constr",
        bounds=Bounds(-1, 1),
        constraints=constraints,
        options={"gtol": 1e-9, "xtol": 1e-11, "maxiter": 2000},
    ).x


PEERS = (
    Peer("SciPy trust-constr", "scipy", search_with_gradient, "exact"),
    Peer("SciPy trust-constr, differences", "scipy", search_by_differences, "differences"),
)
