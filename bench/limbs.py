"""Designs with free joint coordinates and axes: boxes and CPU seconds, and general global solvers beside them.

    python -P bench/limbs.py                      # certificates
    python -P bench/limbs.py scip 36 [seconds]    # or maingo; 36 or 18 free variables

The hexapod has the dimensions of LinuxCNC's hexapod kinematics (genhexkins.h: base joints in pairs at the corners of a
triangle of circumradius 26.5 in, platform joints on a circle of 11.543 in, 5 degrees to each side of a corner, 20 in
above), and the task of the case hexapod-machining. The 3-UPU is that of the paper's Section 4.4. The solvers get the
same expressions, operation by operation.
"""

import functools
import math
import sys
import time
from collections.abc import Callable

import casadi as ca

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Free, Rotation, Solution, load_case, solve
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form

ANGLE = math.radians(10)


def machine(width: float, pose_is_free: bool = False) -> Case:
    """Return the hexapod with every joint coordinate free within a width, and its pose held or free."""
    parameters: dict[str, object] = {}
    for leg in range(6):
        corner, side = 2 * math.pi * (leg // 2) / 3, -1 if leg % 2 == 0 else 1
        azimuth = corner + side * math.radians(55)
        for name, radius, angle in (("base", 26.5, corner), ("platform", 11.543, azimuth)):
            point = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
            parameters[f"{name}_{leg + 1}"] = [Free(each - width, each + width) for each in point]
    task = load_case("hexapod-machining").tasks[0]
    if pose_is_free:
        position: list[object] = [Free(-3.0, 3.0), Free(-3.0, 3.0), Free(18.0, 22.0)]
        return Case(hexapod(), parameters, position, [task], rotation=Rotation(axis=None, angle=Free(-ANGLE, ANGLE)))
    return Case(hexapod(), parameters, [0.0, 0.0, 20.0], [task])


def measure(name: str, solution: Solution, gap: float, limit: float) -> None:
    """Print a row: boxes, CPU seconds and gap."""
    began = time.process_time()
    found = certify_program(solution.nlp, solution.x, gap=gap, jobs=1, time_limit=limit)
    seconds = time.process_time() - began
    print(f"{name:40} {found.nlp.n:3} {found.status.value:10} {found.boxes:>9,} {seconds:8.3f} {found.relative_gap}")


def evaluate(form: StandardForm, x: list, operations: dict[int, Callable]) -> list:
    """Return functions and conditions of a form as another solver's expressions, operation by operation."""
    function = ca.Function("f", [form.x], [form.expressions])
    work: list = [0.0] * function.sz_w()
    results: list = [0.0] * form.expressions.numel()
    for k in range(function.n_instructions()):
        op, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            results[target[1]] = work[source[0]]
        elif op == ca.OP_INPUT:
            work[target[0]] = x[source[1]]
        elif op == ca.OP_CONST:
            work[target[0]] = function.instruction_constant(k)
        else:
            work[target[0]] = operations[op](*(work[each] for each in source))
    return results


ALIKE: dict[int, Callable] = {
    ca.OP_ADD: lambda a, b: a + b, ca.OP_SUB: lambda a, b: a - b, ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b, ca.OP_NEG: lambda a: -1.0 * a, ca.OP_TWICE: lambda a: 2.0 * a,
    ca.OP_SQ: lambda a: a * a, ca.OP_INV: lambda a: 1.0 / a,
}  # fmt: skip


def scip(form: StandardForm, seconds: float) -> None:
    """Maximise by SCIP, and print the best point and the bound."""
    import pyscipopt as scip_  # noqa: PLC0415 - one of the two may be missing

    model = scip_.Model()
    model.hideOutput()
    ends = zip(form.lower.tolist(), form.upper.tolist(), strict=True)
    x = [model.addVar(f"x{i}", lb=low, ub=high) for i, (low, high) in enumerate(ends)]
    values = evaluate(form, x, {**ALIKE, ca.OP_SQRT: scip_.sqrt})
    F = model.addVar("F", lb=None, ub=None)
    model.addCons(values[0] >= F)
    for value, condition in zip(values[1:], form.conditions, strict=True):
        model.addCons(value == 0 if condition.is_equation else value <= 0)
    model.setObjective(F, "maximize")
    model.setParam("limits/time", seconds)
    model.setParam("limits/gap", 1e-4)
    model.optimize()
    print(f"scip {model.version()}: {model.getStatus()}, best {form.sign * model.getPrimalbound():.6g}, "
          f"bound {form.sign * model.getDualbound():.6g}, nodes {model.getNNodes()}")  # fmt: skip


def maingo(form: StandardForm, seconds: float) -> None:
    """Maximise by MAiNGO, and print the best point and the bound."""
    import maingopy as mg  # noqa: PLC0415

    class Problem(mg.MAiNGOmodel):
        def __init__(self) -> None:
            mg.MAiNGOmodel.__init__(self)

        def get_variables(self) -> list:
            ends = zip(form.lower.tolist(), form.upper.tolist(), strict=True)
            return [mg.OptimizationVariable(mg.Bounds(*each), mg.VT_CONTINUOUS, f"x{i}") for i, each in enumerate(ends)]

        def evaluate(self, x: list) -> object:
            values = evaluate(form, x, {**ALIKE, ca.OP_SQRT: mg.sqrt, ca.OP_SQ: mg.sqr})
            result = mg.EvaluationContainer()
            result.objective = -values[0]
            pairs = list(zip(values[1:], form.conditions, strict=True))
            result.eq = [value for value, condition in pairs if condition.is_equation]
            result.ineq = [value for value, condition in pairs if not condition.is_equation]
            return result

    problem = Problem()  # the solver does not keep it alive
    solver = mg.MAiNGO(problem)
    options = {"maxTime": seconds, "epsilonR": 1e-4, "epsilonA": 1e-4, "BAB_verbosity": 0, "loggingDestination": 0}
    for name, value in options.items():
        solver.set_option(name, value)
    solver.solve()
    best, gap = -solver.get_objective_value(), solver.get_final_abs_gap()
    print(f"maingo: best {form.sign * best:.6g}, bound {form.sign * (best + gap):.6g}, nodes {solver.get_iterations()}")


def main() -> None:
    """Print the certificates, or what another solver reaches."""
    if len(sys.argv) > 1:
        case = machine(2.0) if sys.argv[2] == "36" else load_case("paper-4.4-max")
        limit = float(sys.argv[3]) if len(sys.argv) > 3 else 120.0
        {"scip": scip, "maingo": maingo}[sys.argv[1]](standard_form(formulate(case)), limit)
        return
    print(f"{'case':40}   n status         boxes    CPU s gap")
    solved = functools.partial(solve, starts=8)
    for width in (2.0, 5.0):
        measure(f"hexapod, joints within {width:g} in, pose held", solved(machine(width)), 1e-4, 60)
    for name in ("paper-4.4-max", "paper-4.4-min"):
        measure(name, solved(load_case(name)), 1e-4, 60)
    measure("hexapod, joints within 2 in, pose free", solved(machine(2.0, pose_is_free=True)), 1e-3, 60)
    measure("hexapod-machining", solved(load_case("hexapod-machining")), 1e-4, 60)


if __name__ == "__main__":
    main()
