"""Boxes and CPU time of workspaces: by angle, and by the number of free coordinates of the pose.

    python -P bench/workspace.py

CPU time of this process on one thread, because the machine may be shared; the best of five for regular poses.
"""

import math
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from screwsynth.nlp import Case, Free, load_case
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.statement.claims import claims_of
from screwsynth.nlp.proof.statement.posed_layout import posed_layout
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.numbers.extremes import NumberSearch, prove_extreme

# The machine of LinuxCNC's hexapod kinematics; see cases/hexapod-machining.toml.
TEXT = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 26.5, x2 = 11.543, x3 = 0, x4 = 5 }
[pose]
position = [0, 0, 20]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""
POSITION = (Free(-5.0, 5.0), Free(-5.0, 5.0), Free(15.0, 25.0))


def machine() -> Case:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(TEXT, encoding="utf-8")
        return load_case(str(path))


def by_angle(case: Case) -> None:
    for kind in (TurnKind.ANY_AXIS, TurnKind.ROLL_PITCH_YAW):
        for degrees in (20, 25, 30, 35, 40):
            angle = Free(-math.radians(degrees), math.radians(degrees))
            workspace = Workspace(POSITION, Turns(kind, (angle,) * (1 if kind is TurnKind.ANY_AXIS else 3)))
            best = math.inf
            for _ in range(5):
                began = time.process_time()
                found = judge_workspace(replace(case, workspace=workspace), with_limits=False).regularity
                best = min(best, time.process_time() - began)
            print(f"{kind.value}, {degrees} deg: {found.outcome.value} {found.boxes:,} boxes {1e3 * best:.1f} ms")


def by_dimension(case: Case) -> None:
    angle = Free(-math.radians(25), math.radians(25))
    for free in range(1, 7):
        position = tuple(each if k < free else (each.lower + each.upper) / 2 for k, each in enumerate(POSITION))
        angles = tuple(angle if k + 3 < free else 0.0 for k in range(3))
        workspace = Workspace(position, Turns(TurnKind.ROLL_PITCH_YAW, angles))
        began = time.process_time()
        regular = judge_workspace(replace(case, workspace=workspace), with_limits=False).regularity
        taken = time.process_time() - began
        layout = posed_layout(case, workspace)
        boxes, seconds = {"length": 0, "F": 0}, {"length": 0.0, "F": 0.0}
        for claim in claims_of(layout):
            kind = "F" if claim.name == "F" else "length"
            began = time.process_time()
            boxes[kind] += prove_extreme(layout, claim, NumberSearch(jobs=1), time_limit=60).boxes
            seconds[kind] += time.process_time() - began
        print(
            f"{free} free: regular {regular.boxes:,} boxes {1e3 * taken:.1f} ms; 12 lengths {boxes['length']:,} boxes "
            f"{seconds['length']:.2f} s; F from and to {boxes['F']:,} boxes {seconds['F']:.2f} s"
        )


if __name__ == "__main__":
    by_angle(machine())
    by_dimension(machine())
