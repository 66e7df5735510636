"""Measure proofs on paper that each robot of the gallery keeps its ranks, over a small envelope about home.

The envelopes are those of ``workspace_robots.py``. CPU time: of the search with its set-up, and of the check with its.

    python bench/workspace_paper.py [robot ...]
"""

import math
import sys
import time

from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, Free, Task
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.checker.proof_file import ProofError, read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of

_PART, _DEGREES = 0.02, 5.0


def measure(name: str) -> str:
    """Return the row of a robot."""
    model = build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    size = max(abs(each) for each in (*model.home, *values.values()))
    angle = math.radians(_DEGREES)
    place = [Free(each - _PART * size, each + _PART * size) for each in model.home]
    workspace = Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3))
    case = Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])], workspace=workspace)
    began, record = time.process_time(), ProofRecord()
    judged = judge_workspace(case, with_limits=False, record=record)
    searched = time.process_time()
    proof = read_proof(proof_of(judged, record, "").as_text(), name)
    begin = time.process_time()
    try:
        checked = check_workspace_proof(proof, case)
    except ProofError as error:
        return f"| `{name}` | rejected: {error} | | | | |"
    names = ", ".join(each.name for each in checked.claims)
    seconds = f"{searched - began:.2f} | {time.process_time() - begin:.2f}"
    return f"| `{name}` | {names} | {checked.leaves:,} | {checked.pieces:,} | {seconds} |"


if __name__ == "__main__":
    for robot in sys.argv[1:] or gallery_names():
        print(measure(robot), flush=True)
