"""Boxes and CPU seconds of certificates with an active limit on singular values, over poses of four hexapods.

    python -P bench/singular_values.py [seconds]

LinuxCNC's hexapod (``bench/limbs.py``) and three random ones with joints around its own: dimensions fixed, the pose free
within 3, 3 and 2 in and 10 degrees, the task of ``hexapod-machining``, minimised. The limit is halfway between the value at
the optimum without it and the best value known in the box. CPU time of this process on one thread.
"""

import sys
import time
from dataclasses import replace

from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from limbs import ANGLE, machine  # noqa: E402

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Free, Limits, Rotation, Task, formulate, load_case, solve
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.certificate.branchandbound import certify_program
from screwsynth.nlp.program.sampling import starting_points

#: Length by which moments are divided, and gaps asked for.
LENGTH, GAPS = 10.0, (1e-2, 1e-4)


def hexapod_case(seed: int | None) -> Case:
    """Return the hexapod of a row with its pose free; without a seed LinuxCNC's."""
    parameters = {}
    rng = np.random.default_rng(seed)
    for name, value in machine(0.5).parameters.items():
        centre = np.array([0.5 * (each.lower + each.upper) for each in value])
        size = 0.0 if seed is None else 0.15 * np.linalg.norm(centre)
        parameters[name] = (centre + size * rng.uniform(-1, 1, 3)).tolist()
    twist = np.asarray(load_case("hexapod-machining").tasks[0].twist)
    position = [Free(-3.0, 3.0), Free(-3.0, 3.0), Free(18.0, 22.0)]
    rotation = Rotation(axis=None, angle=Free(-ANGLE, ANGLE))
    return Case(hexapod(), parameters, position, [Task(twist, "max")], rotation=rotation)


def values_at(case: Case, points: list[np.ndarray]) -> np.ndarray:
    """Return the singular values (K, 6) at points, moments about the platform's origin divided by the length."""
    nlp = formulate(case)
    found = []
    for x in points:
        state = nlp.program.kernels.robot_state(x, nlp.arguments)
        J, p = np.array(state.jacobian), np.array(state.position).ravel()
        moments = (J[:, 3:] - np.cross(p, J[:, :3])) / LENGTH
        found.append(np.linalg.svd(np.nan_to_num(np.hstack([J[:, :3], moments])), compute_uv=False))
    return np.array(found)


def main(limit: float) -> None:
    """Print the table."""
    for name, seed in (("LinuxCNC", None), ("random 1", 1), ("random 2", 2), ("random 3", 3)):
        case = hexapod_case(seed)
        best = solve(case, starts=4)
        own = values_at(case, [best.outcomes[0].own.x])[0]
        others = values_at(case, list(starting_points(formulate(case), 200, seed=0)))
        smallest = 0.5 * (own[-1] + others[:, -1].max())
        condition = 0.5 * (own[0] / own[-1] + (others[:, 0] / others[:, -1]).min())
        plain = certify_program(best.nlp, best.x, gap=1e-4, jobs=1, time_limit=limit)
        print(f"{name:10} without limit {best.F:.6g} {plain.boxes:9,} smallest {own[-1]:.4g} to {others[:, -1].max():.4g}",
              f"condition {own[0] / own[-1]:.4g} to {(others[:, 0] / others[:, -1]).min():.4g}", flush=True)
        for what, each in (("smallest", SmallestSingularValue(smallest, LENGTH)), ("condition", ConditionNumber(condition, LENGTH))):
            with_limit = replace(case, limits=Limits(each))
            solution = solve(with_limit, starts=8)
            for gap in GAPS:
                began = time.process_time()
                found = certify_program(solution.nlp, solution.x, gap=gap, jobs=1, time_limit=limit)
                seconds = time.process_time() - began
                print(f"  {what:10} {solution.F:.6g} gap {gap:.0e} {found.status.value:10} {found.boxes:9,} {seconds:7.2f} "
                      f"{found.relative_gap} {found.reason}", flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
