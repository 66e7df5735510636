"""Measure claims about one hexapod's workspace on paper, one by one: leaves, boxes of the check, CPU seconds of both.

The machine and the workspace are those of ``workspace.py``, within 20 degrees about any axis. Numbers of a claim are
those of a judgement with it less those of one without; ranks are measured alone, with the set-up of their search.

    python -P bench/workspace_claims.py
"""

import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from workspace import POSITION, machine

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free, Limits
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.checker.proof_file import read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord
from screwsynth.nlp.proof.workspace.proof_writer import proof_of

#: Length by which moments are divided, and the largest error of a leg's length.
_LENGTH, _LEG_ERROR = 10.0, 0.008
_LIMITS = {
    "condition number at most 8": ConditionNumber(8.0, _LENGTH),
    "smallest singular value at least 0.3": SmallestSingularValue(0.3, _LENGTH),
}


def case_of(tolerance: float | None, degrees: float = 20.0) -> Case:
    """Return the machine over its workspace, with a tolerance on joint centres."""
    angle = math.radians(degrees)
    workspace = Workspace(POSITION, Turns(TurnKind.ANY_AXIS, (Free(-angle, angle),)))
    return replace(machine(), workspace=workspace, joint_centre_tolerance=tolerance)


def measure(case: Case, *, numbers: bool = True, objective: bool = False, leg_error: float = 0.0) -> FloatArray:
    """Return leaves, boxes of the check, and CPU seconds of search and check of a case's proof."""
    record, began = ProofRecord(), time.process_time()
    judged = judge_workspace(
        case, jobs=1, time_limit=None, with_limits=numbers, with_objective=objective, leg_error=leg_error, record=record
    )
    searched = time.process_time() - began
    proof = read_proof(proof_of(judged, record, "", leg_error=leg_error).as_text(), "proof")
    began = time.process_time()
    checked = check_workspace_proof(proof, case, leg_error=leg_error)
    return np.array([checked.leaves, checked.pieces, searched, time.process_time() - began])


def row(name: str, found: FloatArray) -> None:
    """Print the row of a claim."""
    leaves, pieces, search, check = found
    print(f"| {name} | {leaves:,.0f} | {pieces:,.0f} | {search:.2f} | {check:.2f} |", flush=True)


def main() -> None:
    """Print the rows of the machine as designed, then of every machine within tolerances."""
    for degrees in (20.0, 35.0):
        row(f"regular, {degrees:g} degrees", measure(case_of(None, degrees), numbers=False))
    for tolerance in (0.002, 0.1, 0.5):
        row(f"regular, t = {tolerance:g} in", measure(case_of(tolerance), numbers=False))
    exact = case_of(None)
    with_objective = measure(exact, objective=True)
    row("F, from and to", with_objective - measure(exact))
    row("errors of position and rotation", measure(exact, objective=True, leg_error=_LEG_ERROR) - with_objective)
    for tolerance in (None, 0.002, 0.02):
        case, within = case_of(tolerance), "" if tolerance is None else f", t = {tolerance:g} in"
        base = measure(case)
        for name, limit in _LIMITS.items():
            row(f"{name}{within}", measure(replace(case, limits=Limits(limit))) - base)


if __name__ == "__main__":
    main()
