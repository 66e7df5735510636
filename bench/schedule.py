"""Schedule of a turn about the tool: dynamic programming with Ipopt, beside Ipopt from constant settings alone.

python -P bench/schedule.py [CASE]
"""

from __future__ import annotations

import sys
import time

import numpy as np

from screwsynth.nlp import load_case, solve
from screwsynth.nlp.solver.schedule.polish import polish
from screwsynth.nlp.solver.schedule.problem import ends, schedule_problem


def main() -> None:
    """Print objective and CPU seconds of both methods, and the proved bound."""
    case = load_case(sys.argv[1] if len(sys.argv) > 1 else "hexapod-yaw")
    problem = schedule_problem(case)
    low, high, _ = ends(problem.settings)
    d = ends(problem.design)[2]
    for part in (0.3, 0.5, 0.7):
        began = time.process_time()
        constant = np.repeat((low + part * (high - low))[None], len(problem.points), axis=0)
        found = polish(problem, d, constant, near=False)
        value = "infeasible" if found is None else f"{problem.sign * found.value:.7f}"
        print(f"Ipopt from a constant at {part:.0%} of the range  {value}  {time.process_time() - began:.2f} s")
    for gap in (None, 5e-4, 1e-4):
        began = time.process_time()
        schedule = solve(case, gap=gap).schedule
        seconds = time.process_time() - began
        if schedule is None:
            print(f"solve  infeasible  {seconds:.2f} s")
            return
        bound = "" if schedule.bound is None else f", bound {schedule.bound:.7f}, gap {schedule.gap or 0:.1e}"
        held = "none" if schedule.constant is None else f"{schedule.constant.value:.7f}"
        print(f"solve, gap {gap}  {schedule.value:.7f} (constant {held}){bound}  {seconds:.2f} s")


if __name__ == "__main__":
    main()
