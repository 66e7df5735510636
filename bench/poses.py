"""Time of a case by its number of poses, with and without an actuator, beside each other.

Run by hand: ``.venv/bin/python bench/poses.py [poses ...]``. The case is a hexapod of twelve irregular joints, twelve
coordinates of which are free. Its largest stroke binds.
"""

import math
import sys
import time

import numpy as np

from screwsynth.models import hexapod
from screwsynth.nlp import Actuator, Case, Free, Limits, OverPoses, Pose, Rotation, Task, formulate, solve

STROKE = 5.3


def case_of(count: int, limits: Limits) -> Case:
    """Return the case with a number of poses."""
    numbers = np.random.default_rng(7)
    parameters: dict[str, list[float | Free]] = {}
    for i in range(6):
        for plate, radius, half in (("base", 12.0, 20), ("platform", 8.0, 45)):
            angle = math.radians(120 * (i // 2) + half * (1 if i % 2 else -1))
            x, y = radius * np.array([math.cos(angle), math.sin(angle)]) + numbers.uniform(-0.5, 0.5, 2)
            is_free = plate == "base"
            parameters[f"{plate}_{i + 1}"] = [*(Free(c - 2, c + 2) if is_free else float(c) for c in (x, y)), 0.0]
    poses = []
    for _ in range(count):
        position = [*numbers.uniform(-6, 6, 2), numbers.uniform(19, 21)]
        axis = numbers.normal(size=3)
        poses.append(
            Pose([float(c) for c in position], Rotation(axis=axis, angle=math.radians(numbers.uniform(0, 12))))
        )
    task = Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1)
    first, *further = poses
    return Case(
        hexapod(),
        parameters,
        first.position,
        [task],
        first.rotation,
        further=further,
        over_poses=OverPoses.MEAN,
        limits=limits,
    )


def main(counts: list[int]) -> None:
    """Print a row for each number of poses, with and without an actuator."""
    for count in counts:
        for name, limits in (("without", Limits()), ("with", Limits(Actuator(stroke_max=STROKE, dead_length=6)))):
            case = case_of(count, limits)
            began = time.perf_counter()
            formulate(case)
            formulated = time.perf_counter() - began
            solution = solve(case, starts=24)
            constraints = len(solution.nlp.program.constraints)
            print(
                f"{count:4d} poses, {name:7s} actuator: formulated in {formulated:5.2f} s, "
                f"solved in {solution.seconds:6.2f} s, {solution.status.value}, {constraints} constraints"
            )


if __name__ == "__main__":
    main([int(each) for each in sys.argv[1:]] or [4, 8, 16, 40, 100])
