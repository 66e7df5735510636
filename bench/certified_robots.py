"""Boxes and CPU seconds of certificates of the gallery's robots, in home's working mode.

    python -P bench/certified_robots.py [--time 10] [--pose] [NAME ...]

A maximum of F of a general motion with the gallery's dimensions, to a gap of 1e-4. At home: the pose is fixed there and
the first two lengths are free by 5 % either way. With ``--pose`` the pose is free instead, by 2 % of the robot's size
and 0.02 rad. CPU time of this process on one thread, because the machine may be shared.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from screwsynth.models import Dimension, robot_function
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, Free, Rotation, Task, solve
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program

TWIST = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
#: Part by which lengths are free at home; parts of the size and radians by which the pose is.
LENGTHS, POSE = 0.05, 0.02


def case_of(name: str, *, free_pose: bool) -> Case:
    """Return the case of a row."""
    model = robot_function(name)()
    parameters: dict[str, float | Free] = {item.name: item.typical[0] for item in model.parameters}
    task = Task(TWIST, "max")
    if not free_pose:
        lengths = [item for item in model.parameters if item.dimension is Dimension.LENGTH][:2]
        for item in lengths:
            parameters[item.name] = Free((1 - LENGTHS) * item.typical[0], (1 + LENGTHS) * item.typical[0])
        return Case(model, parameters, model.home, [task])
    size = float(np.linalg.norm(model.home)) or 1.0
    position = [Free(value - POSE * size, value + POSE * size) for value in model.home]
    return Case(model, parameters, position, [task], Rotation(None, Free(-POSE, POSE)))


def row(name: str, limit: float, *, free_pose: bool) -> None:
    """Print one row of the table."""
    solution = solve(case_of(name, free_pose=free_pose), starts=2)
    nlp = replace(solution.nlp, in_home_mode=any(each.is_mode for each in solution.nlp.program.model.signs))
    began = time.process_time()
    found = certify_program(nlp, solution.x, claimed=solution.F, time_limit=limit, jobs=1)
    seconds = time.process_time() - began
    gap = "inf" if found.relative_gap is None else f"{found.relative_gap:.1e}"
    unknowns = len(nlp.program.model.unknowns)
    reason = "" if found.reason.startswith("stopped") else found.reason
    print(
        f"{name:20} {unknowns:3} {found.status.value:10} {found.boxes:9,} {seconds:7.2f} {gap:8} {reason}", flush=True
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--time", type=float, default=10.0)
    parser.add_argument("--pose", action="store_true")
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    print(f"{'robot':20} unknowns, status     boxes   CPU s gap")
    for name in given.names or gallery_names():
        row(name, given.time, free_pose=given.pose)


if __name__ == "__main__":
    main()
