"""Measure the search of regular poses for each robot of the gallery, over a small envelope about home.

Positions are within 2 % of the robot's size, roll, pitch and yaw within 5 degrees each: of these, the numbers that a
robot with fewer freedoms has no choice of follow from the others. CPU time, with the set-up of the expressions.

    python bench/workspace_robots.py [robot ...]
"""

import math
import sys
import time

from screwsynth.models.catalog import gallery_names
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Task
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.interruption import within
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import NotJudgedError, build_problem

_PART, _DEGREES, _SECONDS = 0.02, 5.0, 20.0


def measure(name: str) -> str:
    """Return the row of a robot."""
    began, model = time.process_time(), build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    size = max(abs(each) for each in (*model.home, *values.values()))
    angle = math.radians(_DEGREES)
    place = [Free(each - _PART * size, each + _PART * size) for each in model.home]
    box = pose_box(Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3)))
    case = Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])])
    try:
        problem = build_problem(case, closed_form(model).model, box)
    except NotJudgedError as error:
        return f"| `{name}` | | open: {error} | | | |"
    cells = []
    for matrix in (problem.locked, problem.unactuated):
        if matrix is None:
            cells += ["", ""]
            continue
        begin = time.process_time()
        with within(_SECONDS):
            found = prove_rank(problem, matrix)
        reason = f", {found.reason}" if found.reason else ""
        cells += [f"{found.outcome.value}, {found.boxes:,}{reason}", f"{time.process_time() - begin:.2f}"]
        begin = time.process_time()
    setup = time.process_time() - began
    free = f"{len(problem.independent)} + {len(problem.dependent)}"
    return f"| `{name}` | {free} | {' | '.join(cells)} | {setup:.2f} |"


if __name__ == "__main__":
    for robot in sys.argv[1:] or gallery_names():
        print(measure(robot), flush=True)
