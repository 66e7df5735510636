"""Call of Ipopt through CasADi, with scaled variables and a scaled objective.

No other module knows Ipopt's strings.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX, SX

from ...models import FloatArray
from ..case.settings import Search
from ..program.nlp import Nlp
from ..system.programs import shared_library
from .interface import LocalSearch, SolverResult, StopReason

#: Ipopt's tolerance. The Newton correction afterwards converges quadratically: a tighter one would only cost time.
TOLERANCE = 1e-8
#: Number of starting points at which the size of each constraint is measured.
_SAMPLED = 4
#: Length of a gradient in scaled variables that indicates narrow ranges: an ordinary rotation of 3 degrees has 1e-3.
_SHORT = 1e-4
#: Distance from bounds, barrier and multipliers for Ipopt at a point that is optimal already: below its tolerance, so
#: that Ipopt can stay at the point.
_MARGIN = 1e-9
_WARM = (
    "mu_init",
    "warm_start_bound_push",
    "warm_start_bound_frac",
    "warm_start_slack_bound_push",
    "warm_start_slack_bound_frac",
    "warm_start_mult_bound_push",
)
_REASONS = {
    "Solve_Succeeded": StopReason.SUCCEEDED,
    "Maximum_Iterations_Exceeded": StopReason.ITERATION_LIMIT,
    "Infeasible_Problem_Detected": StopReason.INFEASIBLE,
    "Invalid_Number_Detected": StopReason.UNDEFINED,
}


def ipopt(nlp: Nlp, search: Search, points: FloatArray, count: int) -> list[LocalSearch]:
    """Return searches by Ipopt; see :class:`screwsynth.nlp.solver.interface.Solver`.

    CasADi's symbols are not safe to share between threads: every function is built here, and only called later.

    Raises:
        InputError: the objective cannot be compiled, although the search asks for it.
    """
    problem = _Problem(nlp, search, constraint_sizes(nlp, points))
    options = _options(search.max_iterations)
    return [partial(problem.search, problem.function(options)) for _ in range(count)]


class Confirmation:
    """Ipopt from points that are already optimal, with multipliers: a confirmed point does not move.

    Derivatives are existing functions of the program, because another differentiation would take longer than a search.
    Like every search, the object must be built and used in the same thread.

    Args:
        nlp: the nonlinear program.
        search: limit of iterations, and whether functions are compiled.
        sizes: (c,) sizes of the constraints, from :func:`constraint_sizes`.

    Raises:
        InputError: the objective cannot be compiled, although the search asks for it.
    """

    def __init__(self, nlp: Nlp, search: Search, sizes: FloatArray) -> None:
        options = _options(search.max_iterations)
        options["ipopt"] |= dict.fromkeys(_WARM, _MARGIN) | {"warm_start_init_point": "yes"}
        if search.compiled:
            self._problem = _Problem(nlp, search, sizes)
        else:
            problem, derivatives = _given_derivatives(nlp)
            self._problem = _Problem(nlp, search, sizes, problem)
            options |= derivatives
        self._function = self._problem.function(options)

    def __call__(self, optimum: SolverResult) -> SolverResult:
        """Search from the point at which another solver stopped."""
        return self._problem.search(self._function, optimum.x, optimum)


class _Problem:
    """Nonlinear program in scaled variables for Ipopt, with the scales of its variables and objective.

    Args:
        nlp: the nonlinear program.
        search: limit of iterations, and whether functions are compiled.
        sizes: (c,) sizes of the constraints.
        symbols: problem by CasADi's keys; :func:`_scaled_problem` if left out.
    """

    def __init__(self, nlp: Nlp, search: Search, sizes: FloatArray, symbols: dict[str, MX] | None = None) -> None:
        self._nlp, self._sizes = nlp, sizes
        self._problem: str | dict[str, MX] | dict[str, SX]
        if symbols is not None:
            self._problem = symbols
        else:
            own = _scaled_problem(nlp)
            self._problem = _compiled_problem(own) if search.compiled else own
        weight = [nlp.sign / nlp.objective_scale]
        self._parameters = np.concatenate([nlp.arguments, nlp.centre, nlp.scale, weight, self._sizes])
        self._lower, self._upper = nlp.g_lower / self._sizes, nlp.g_upper / self._sizes

    def function(self, options: dict[str, Any]) -> ca.Function:
        """Return a new CasADi solver (Ipopt) for one thread."""
        return ca.nlpsol("solver", "ipopt", self._problem, options)

    def search(self, function: ca.Function, point: FloatArray, optimum: SolverResult | None = None) -> SolverResult:
        """Search from a point (n,), with the multipliers of an optimum if there is one."""
        nlp, sizes = self._nlp, self._sizes
        scaled = (point - nlp.centre) / nlp.scale
        given: dict[str, Any] = {"x0": scaled, "p": self._parameters, "lbg": self._lower, "ubg": self._upper}
        if optimum is not None:
            given |= {"lam_x0": optimum.bound_multipliers, "lam_g0": optimum.constraint_multipliers * sizes}
        result = function(lbx=-1, ubx=1, **given)
        stats = function.stats()
        return SolverResult(
            x=nlp.centre + nlp.scale * result["x"].full().ravel(),
            bound_multipliers=result["lam_x"].full().ravel(),
            constraint_multipliers=result["lam_g"].full().ravel() / sizes,
            reason=_REASONS.get(str(stats["return_status"]), StopReason.OTHER),
            iterations=int(stats.get("iter_count", 0)),
        )


def _given_derivatives(nlp: Nlp) -> tuple[dict[str, MX], dict[str, Any]]:
    """Return the problem of :func:`_scaled_problem` as calls of the program's functions, and options with derivatives.

    Both have CasADi's keys.
    """
    program, n, c = nlp.program, nlp.n, len(nlp.program.constraints)
    counts = [len(program.arguments), n, n, 1, c]
    s, parameters, factor, multipliers = MX.sym("s", n), MX.sym("p", sum(counts)), MX.sym("factor"), MX.sym("m", c)
    p, centre, scale, weight, sizes = ca.vertsplit(parameters, np.cumsum([0, *counts]).tolist())
    x = centre + scale * s
    F, gradient, g, jacobian = program.derivatives(x, p)
    hessian = program.hessian(x, p, factor * weight, multipliers / sizes)
    names = ["x", "p"]
    options: dict[str, Any] = {
        "grad_f": ca.Function(
            "nlp_grad_f", [s, parameters], [weight * F, weight * gradient.T * scale], names, ["f", "grad_f_x"]
        ),
        "hess_lag": ca.Function(
            "nlp_hess_l",
            [s, parameters, factor, multipliers],
            [ca.triu(hessian * (scale @ scale.T))],
            [*names, "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
    }
    rows = jacobian * ca.repmat(scale.T, c, 1) / ca.repmat(sizes, 1, n)
    # CasADi would differentiate once more, for multipliers that nobody needs.
    options["no_nlp_grad"] = True
    options["jac_g"] = ca.Function("nlp_jac_g", [s, parameters], [g / sizes, rows], names, ["g", "jac_g_x"])
    values = program.values(x, p)
    return {"x": s, "p": parameters, "f": weight * values[0], "g": values[1] / sizes}, options


def constraint_sizes(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return the largest sampled gradient lengths (c,) of the limits in scaled variables, which divide Ipopt's rows.

    Other constraints have gradients of length about 1 and the divisor 1, unless narrow ranges make gradients small.
    """
    jacobians = [nlp.program.kernels.derivatives(x, nlp.arguments).jacobian for x in points[:_SAMPLED]]
    rows = np.array(jacobians) * nlp.scale
    lengths = np.sqrt(np.einsum("kij,kij->ki", rows, rows))
    lengths = np.where(np.isfinite(lengths), lengths, 0.0).max(axis=0, initial=0.0)
    limits = np.array([any(constraint.keys) for constraint in nlp.program.constraints], dtype=bool)
    lengths = np.maximum(lengths, np.where(limits, 0.0, nlp.row_sizes))
    return np.where((limits & (lengths > 0)) | ((lengths > 0) & (lengths < _SHORT)), lengths, 1.0)


def _scaled_problem(nlp: Nlp) -> dict[str, SX]:
    """Return the program by CasADi's keys, in scaled variables, with a scaled objective to be minimised."""
    program = nlp.program
    s, centre, scale, weight = SX.sym("s", nlp.n), SX.sym("centre", nlp.n), SX.sym("scale", nlp.n), SX.sym("weight")
    sizes = SX.sym("sizes", len(program.constraints))
    F, g = program.values.call([centre + scale * s, program.p])
    return {"x": s, "p": ca.vertcat(program.p, centre, scale, weight, sizes), "f": weight * F, "g": g / sizes}


def _compiled_problem(problem: dict[str, SX]) -> str:
    """Return the path of a library with all functions that Ipopt calls, for CasADi to load as external functions."""
    solver = ca.nlpsol("solver", "ipopt", problem, _options(1))
    generator = ca.CodeGenerator("problem.c")
    for function in (solver.oracle(), *(solver.get_function(name) for name in solver.get_function())):
        generator.add(function)
    return str(shared_library({"source.c": generator.dump()}))


def _options(max_iterations: int) -> dict[str, Any]:
    """Return the options of CasADi and Ipopt, by the names in CasADi and Ipopt."""
    return {
        "print_time": False,
        "show_eval_warnings": False,
        "error_on_fail": False,
        "calc_multipliers": False,
        "calc_lam_p": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": TOLERANCE,
            "max_iter": max_iterations,
            # Otherwise Ipopt widens every bound by 1e-8 and returns infeasible points.
            "bound_relax_factor": 0.0,
            # The objective and variables are scaled already, by the same numbers for every start.
            "nlp_scaling_method": "none",
        },
    }
