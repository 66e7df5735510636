"""Sections 4.1 and 4.3 by general global solvers, each in its natural formulation, with 120 s each.

    python -P bench/global_peers.py scip 4.1 [seconds]
    python -P bench/global_peers.py maingo 4.3 [seconds]

Needs pyscipopt or maingopy, in an environment of their own; screwsynth is not used. The problem is written out from the
paper's equations: position p, quaternion vector q in a ball, half angle x4; F = sum (g_i . d_i)^2 / |d_i|^2.
"""

import math
import sys
import time

OMEGA = (2 / 3, 2 / 3, 1 / 3)
V = (-7 / 3, 4.0, -1 / 3)
RADIUS = math.sin(math.radians(15))
BOUNDS = [(-10.0, 10.0), (-10.0, 10.0), (20.0, 50.0), *[(-RADIUS, RADIUS)] * 3, (0.0, math.radians(30))]


def legs(p: list, q: list, q0: object, x4: object, functions: tuple) -> list:
    """Return (d, b) of each leg: vector from base to platform joint, and base joint."""
    sin, cos = functions
    found = []
    for k in range(3):
        for sign in (-1, 1):
            base = k * 2 * math.pi / 3 + sign * math.radians(30)
            b = (12 * math.cos(base), 12 * math.sin(base), 0.0)
            azimuth = k * 2 * math.pi / 3 + sign * x4
            a = (8 * cos(azimuth), 8 * sin(azimuth))
            # R a with a_z = 0, R = I + 2 q0 [q]x + 2 [q]x^2.
            rotated = (
                a[0] * (1 - 2 * (q[1] * q[1] + q[2] * q[2])) + a[1] * (2 * q[0] * q[1] - 2 * q0 * q[2]),
                a[0] * (2 * q[0] * q[1] + 2 * q0 * q[2]) + a[1] * (1 - 2 * (q[0] * q[0] + q[2] * q[2])),
                a[0] * (2 * q[0] * q[2] - 2 * q0 * q[1]) + a[1] * (2 * q[1] * q[2] + 2 * q0 * q[0]),
            )
            found.append(([p[i] + rotated[i] - b[i] for i in range(3)], b))
    return found


def rate(d: list, b: tuple) -> object:
    """Return (b x d) . omega + d . v = d . (v + omega x b)."""
    g = (
        V[0] + OMEGA[1] * b[2] - OMEGA[2] * b[1],
        V[1] + OMEGA[2] * b[0] - OMEGA[0] * b[2],
        V[2] + OMEGA[0] * b[1] - OMEGA[1] * b[0],
    )
    return g[0] * d[0] + g[1] * d[1] + g[2] * d[2]


def scip(free_angle: bool, seconds: float) -> None:
    """Maximise F by SCIP, and print the best point and the bound."""
    import pyscipopt as scip_  # noqa: PLC0415 - one of the two may be missing

    model = scip_.Model()
    model.hideOutput()
    x = [model.addVar(f"x{i}", lb=low, ub=high) for i, (low, high) in enumerate(BOUNDS[: 7 if free_angle else 6])]
    p, q = x[:3], x[3:6]
    q0 = model.addVar("q0", lb=math.cos(math.radians(15)), ub=1)
    model.addCons(q0 * q0 + q[0] * q[0] + q[1] * q[1] + q[2] * q[2] == 1)
    functions = (scip_.sin, scip_.cos) if free_angle else (math.sin, math.cos)
    terms = []
    for k, (d, b) in enumerate(legs(p, q, q0, x[6] if free_angle else math.radians(8), functions)):
        # Unit directions bound each term by a ball, with which the solver is faster than with quotients.
        unit = [model.addVar(f"u{k}{i}", lb=-1, ub=1) for i in range(3)]
        length = model.addVar(f"l{k}", lb=1, ub=150)
        model.addCons(unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2] == 1)
        for part, expression in zip(unit, d, strict=True):
            model.addCons(length * part == expression)
        work = model.addVar(f"s{k}", lb=-100, ub=100)
        model.addCons(work == rate(unit, b))
        terms.append(work * work)
    F = model.addVar("F", lb=0, ub=None)
    model.addCons(sum(terms[1:], terms[0]) >= F)
    model.setObjective(F, "maximize")
    model.setParam("limits/time", seconds)
    model.setParam("limits/gap", 1e-4)
    model.optimize()
    best = model.getPrimalbound()
    print(f"scip {model.version()}: {model.getStatus()}, best {best:.6g}, bound {model.getDualbound():.6g}, "
          f"gap {(model.getDualbound() - best) / best:.2%}, nodes {model.getNNodes()}")  # fmt: skip


def maingo(free_angle: bool, seconds: float) -> None:
    """Maximise F by MAiNGO, and print the best point and the bound."""
    import maingopy as mg  # noqa: PLC0415

    class Problem(mg.MAiNGOmodel):
        def __init__(self) -> None:
            mg.MAiNGOmodel.__init__(self)

        def get_variables(self) -> list:
            chosen = BOUNDS[: 7 if free_angle else 6]
            return [
                mg.OptimizationVariable(mg.Bounds(*ends), mg.VT_CONTINUOUS, f"x{i}") for i, ends in enumerate(chosen)
            ]

        def evaluate(self, x: list) -> object:
            p, q = x[:3], x[3:6]
            ball = q[0] * q[0] + q[1] * q[1] + q[2] * q[2]
            q0 = mg.sqrt(1 - ball)
            functions = (mg.sin, mg.cos) if free_angle else (math.sin, math.cos)
            total = 0
            for d, b in legs(p, q, q0, x[6] if free_angle else math.radians(8), functions):
                total = total + mg.sqr(rate(d, b)) / (mg.sqr(d[0]) + mg.sqr(d[1]) + mg.sqr(d[2]))
            result = mg.EvaluationContainer()
            result.objective = -total
            result.ineq = [ball - RADIUS**2]
            return result

    problem = Problem()  # the solver does not keep it alive
    solver = mg.MAiNGO(problem)
    for name, value in (
        ("maxTime", seconds),
        ("epsilonR", 1e-4),
        ("epsilonA", 1e-4),
        ("BAB_verbosity", 0),
        ("loggingDestination", 0),
    ):
        if not solver.set_option(name, value):
            print(f"maingo: option {name} was not taken")
    solver.solve()
    best = -solver.get_objective_value()
    gap = solver.get_final_abs_gap()
    print(f"maingo: best {best:.6g}, bound {best + gap:.6g}, gap {gap / best:.2%}, nodes {solver.get_iterations()}")


if __name__ == "__main__":
    which, section = sys.argv[1], sys.argv[2]
    limit = float(sys.argv[3]) if len(sys.argv) > 3 else 120.0
    began = time.perf_counter()
    {"scip": scip, "maingo": maingo}[which](section == "4.3", limit)
    print(f"{which} {section}: {time.perf_counter() - began:.1f} s")
