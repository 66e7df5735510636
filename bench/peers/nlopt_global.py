"""Global methods of NLopt: ISRES with its own handling of constraints, the others by penalty."""

from __future__ import annotations

from functools import partial

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search_with_constraints(problem: Problem) -> FloatArray:
    """Return the best point of ISRES."""
    import nlopt  # noqa: PLC0415 - may be missing

    def h(result: FloatArray, s: FloatArray, _jacobian: FloatArray) -> None:
        result[:] = problem.h(s)

    def e(result: FloatArray, s: FloatArray, _jacobian: FloatArray) -> None:
        result[:] = problem.e(s)

    nlopt.srand(problem.seed + 1)
    method = nlopt.opt(nlopt.GN_ISRES, problem.n)
    method.set_min_objective(lambda s, _gradient: problem.f(s))
    method.set_lower_bounds(-1)
    method.set_upper_bounds(1)
    if problem.inequalities:
        method.add_inequality_mconstraint(h, [1e-10] * problem.inequalities)
    if problem.equations:
        method.add_equality_mconstraint(e, [1e-10] * problem.equations)
    method.set_xtol_rel(1e-9)
    return method.optimize(problem.start)


def search_by_penalty(problem: Problem, algorithm: str) -> FloatArray:
    """Return the best point of a method without constraints."""
    import nlopt  # noqa: PLC0415 - may be missing

    nlopt.srand(problem.seed + 1)
    method = nlopt.opt(getattr(nlopt, algorithm), problem.n)
    method.set_min_objective(lambda s, _gradient: problem.penalised(s))
    method.set_lower_bounds(-1)
    method.set_upper_bounds(1)
    method.set_xtol_rel(1e-9)
    method.set_ftol_rel(1e-12)
    return method.optimize(problem.start)


CRS2 = partial(search_by_penalty, algorithm="GN_CRS2_LM")
DIRECT = partial(search_by_penalty, algorithm="GN_DIRECT_L")
PEERS = (
    Peer("NLopt ISRES", "nlopt", search_with_constraints, kind="global"),
    Peer("NLopt CRS2", "nlopt", CRS2, constraints="penalty", kind="global"),
    Peer("NLopt DIRECT-L", "nlopt", DIRECT, constraints="penalty", kind="global", is_random=False),
)
