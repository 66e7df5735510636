"""Schedules of one and two settings: values, proved bounds, gaps and CPU seconds, beside Ipopt from constants alone.

python -P bench/schedule.py [CASE]

The second setting is the base radius of the shipped case hexapod-yaw. A given case is measured as it is.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free, load_case
from screwsynth.nlp.solver.schedule.cells import cell_bound
from screwsynth.nlp.solver.schedule.formulation import schedule_problem
from screwsynth.nlp.solver.schedule.polish import polish
from screwsynth.nlp.solver.schedule.problem import ScheduleProblem, ends
from screwsynth.nlp.solver.schedule.search import solve_schedule

#: Relative gaps to which bounds are proved.
_GAPS = (1e-2, 1e-3, 1e-4)
#: Range and rate of the base radius, inches.
_RADIUS = Free(18.0, 34.0, rate=0.5)


def main() -> None:
    """Print the figures of each case."""
    if len(sys.argv) > 1:
        _measure(sys.argv[1], load_case(sys.argv[1]))
        return
    case = load_case("hexapod-yaw")
    _measure("one setting", case)
    _measure("two settings", replace(case, parameters={**case.parameters, "x1": _RADIUS}))


def _measure(name: str, case: Case) -> None:
    """Print the objective of a case by both methods, and its bounds."""
    problem = schedule_problem(case)
    names = ", ".join(each.name for each in problem.settings)
    print(f"{name}: {names}, {len(problem.points)} points")
    _print_constants(problem)
    began = time.process_time()
    solution = solve_schedule(case)
    schedule = solution.schedule
    if schedule is None:
        print(f"  solve  {solution.status.value}  {time.process_time() - began:.2f} s")
        return
    held = "none" if schedule.constant is None else f"{schedule.constant.value:.7f}"
    print(f"  solve  {schedule.value:.7f} (constant {held})  {time.process_time() - began:.2f} s")
    d = np.array([case.units.to_internal(schedule.design[each.name], each.dimension) for each in problem.design])
    for gap in _GAPS:
        _print_bound(problem, d, problem.sign * schedule.value, gap)


def _print_constants(problem: ScheduleProblem) -> None:
    """Print the objectives that Ipopt reaches from constant settings."""
    low, high, _ = ends(problem.settings)
    d = ends(problem.design)[2]
    for part in (0.3, 0.5, 0.7):
        began = time.process_time()
        constant = np.repeat((low + part * (high - low))[None], len(problem.points), axis=0)
        found = polish(problem, d, constant, near=False)
        value = "infeasible" if found is None else f"{problem.sign * found.value:.7f}"
        print(f"  Ipopt from a constant at {part:.0%} of the range  {value}  {time.process_time() - began:.2f} s")


def _print_bound(problem: ScheduleProblem, d: FloatArray, value: float, gap: float) -> None:
    """Print the bound of all schedules for a relative gap."""
    began = time.process_time()
    found = cell_bound(problem, d, value, gap)
    seconds = time.process_time() - began
    reached = (found.bound - value) / abs(value)
    stopped = f", stopped: {found.reason}" if found.reason else ""
    print(
        f"  bound, gap {gap:g}  {problem.sign * found.bound:.7f}  reached {reached:.2e}{stopped}  "
        f"{found.cells:,} cells of {found.levels} widths  {seconds:.2f} s"
    )


if __name__ == "__main__":
    main()
