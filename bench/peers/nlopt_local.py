"""Local methods of NLopt from one random start."""

from __future__ import annotations

from functools import partial

from screwsynth.models import FloatArray

from .interface import Peer, Problem


def search(problem: Problem, algorithm: str) -> FloatArray:
    """Return where the method ends."""
    import nlopt  # noqa: PLC0415 - may be missing

    def f(s: FloatArray, gradient: FloatArray) -> float:
        if gradient.size:
            gradient[:] = problem.f_gradient(s)
        return problem.f(s)

    def h(result: FloatArray, s: FloatArray, jacobian: FloatArray) -> None:
        if jacobian.size:
            jacobian[:] = problem.h_jacobian(s)
        result[:] = problem.h(s)

    def e(result: FloatArray, s: FloatArray, jacobian: FloatArray) -> None:
        if jacobian.size:
            jacobian[:] = problem.e_jacobian(s)
        result[:] = problem.e(s)

    method = nlopt.opt(getattr(nlopt, algorithm), problem.n)
    method.set_min_objective(f)
    method.set_lower_bounds(-1)
    method.set_upper_bounds(1)
    if problem.inequalities:
        method.add_inequality_mconstraint(h, [1e-10] * problem.inequalities)
    if problem.equations:
        method.add_equality_mconstraint(e, [1e-10] * problem.equations)
    method.set_xtol_rel(1e-9)
    method.set_ftol_rel(1e-12)
    return method.optimize(problem.start)


PEERS = (
    Peer("NLopt SLSQP", "nlopt", partial(search, algorithm="LD_SLSQP"), "exact"),
    Peer("NLopt MMA", "nlopt", partial(search, algorithm="LD_MMA"), "exact", has_equations=False),
    Peer("NLopt COBYLA", "nlopt", partial(search, algorithm="LN_COBYLA")),
)
