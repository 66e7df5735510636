"""Boxes and CPU seconds of certificates with an active limit on singular values, over poses of four hexapods.

    python -P bench/singular_values.py [seconds]

LinuxCNC's hexapod (``bench/limbs.py``) and three random ones with joints around its own: dimensions fixed, the pose
free. ``near``: within 3, 3 and 2 in and 10 degrees, the largest F in the task of ``hexapod-machining``; the limit is
halfway between its value at the optimum without it and the best at random poses. ``wide``: within 10, 10 and 8 in and
45 degrees, the smallest F, to 1e-2; the limit excludes 70 % of random poses. CPU time of this process on one thread.
"""

import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from limbs import ANGLE, machine

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Free, Limits, Rotation, Task, formulate, load_case, solve
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program

#: Length by which moments are divided.
LENGTH = 10.0


def hexapod_case(seed: int | None, *, wide: bool) -> Case:
    """Return the hexapod of a row with its pose free; without a seed LinuxCNC's."""
    parameters = {}
    rng = np.random.default_rng(seed)
    for name, value in machine(0.5).parameters.items():
        centre = np.array([0.5 * (each.lower + each.upper) for each in value])
        size = 0.0 if seed is None else 0.15 * np.linalg.norm(centre)
        parameters[name] = (centre + size * rng.uniform(-1, 1, 3)).tolist()
    twist = np.asarray(load_case("hexapod-machining").tasks[0].twist)
    across, along, angle = (10.0, 8.0, math.radians(45)) if wide else (3.0, 2.0, ANGLE)
    position = [Free(-across, across), Free(-across, across), Free(20.0 - along, 20.0 + along)]
    rotation = Rotation(axis=None, angle=Free(-angle, angle))
    return Case(hexapod(), parameters, position, [Task(twist, "min" if wide else "max")], rotation=rotation)


def values_at(case: Case, points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest singular values and condition numbers (K,) at points."""
    nlp = formulate(case)
    found = []
    for x in points:
        state = nlp.program.kernels.robot_state(x, nlp.arguments)
        J, p = np.array(state.jacobian), np.array(state.position).ravel()
        moments = (J[:, 3:] - np.cross(p, J[:, :3])) / LENGTH
        found.append(np.linalg.svd(np.nan_to_num(np.hstack([J[:, :3], moments])), compute_uv=False))
    values = np.array([each for each in found if each[-1] > 0])
    return values[:, -1], values[:, 0] / values[:, -1]


def row(name: str, case: Case, limit: SmallestSingularValue | ConditionNumber, gap: float, seconds: float) -> None:
    """Print one row."""
    solution = solve(replace(case, limits=Limits(limit)), starts=8)
    began = time.process_time()
    found = certify_program(solution.nlp, solution.x, gap=gap, jobs=1, time_limit=seconds)
    used = time.process_time() - began
    relative = "inf" if found.relative_gap is None else f"{found.relative_gap:.1e}"
    what = f"{name:14} {limit.key:24} F {solution.F:8.6g} asked {gap:.0e}"
    print(f"{what} {found.status.value:10} {found.boxes:9,} {used:7.2f} s {relative}", flush=True)


def main(seconds: float) -> None:
    """Print the table."""
    for name, seed in (("LinuxCNC", None), ("random 1", 1), ("random 2", 2), ("random 3", 3)):
        case = hexapod_case(seed, wide=False)
        best = solve(case, starts=4)
        (own,), (own_ratio,) = values_at(case, [best.outcomes[0].own.x])
        smallest, ratios = values_at(case, list(starting_points(formulate(case), 200, seed=0)))
        limits = (
            SmallestSingularValue(0.5 * (own + smallest.max()), LENGTH),
            ConditionNumber(0.5 * (own_ratio + ratios.min()), LENGTH),
        )
        for limit in limits:
            for gap in (1e-2, 1e-4):
                row(f"{name} near", case, limit, gap, seconds)
        case = hexapod_case(seed, wide=True)
        smallest, ratios = values_at(case, list(starting_points(formulate(case), 400, seed=0)))
        row(f"{name} wide", case, SmallestSingularValue(float(np.quantile(smallest, 0.7)), LENGTH), 1e-2, seconds)
        row(f"{name} wide", case, ConditionNumber(float(np.quantile(ratios, 0.3)), LENGTH), 1e-2, seconds)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
