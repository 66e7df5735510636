"""Comparison of a proof with its case: premises, and limits that a bound must keep."""

from __future__ import annotations

import numpy as np

from ....case.case import Case
from ....case.task import Sense
from ....case.workspace import Workspace
from ...statement.machine import Legs
from ..premises import exact
from ..proof_file import ProofError, WorkspaceProof, workspace_numbers
from .expected import ExpectedClaim

#: Part of a limit by which a bound may be beyond it and still count as on it: rounding, as in the search.
_ON_LIMIT = 1e-9
#: Part of the largest coordinate by which joint centres may differ: the same case gives other last digits elsewhere.
_SAME = 1e-9


def hold_premises(case: Case, workspace: Workspace, legs: Legs | None, leg_error: float, proof: WorkspaceProof) -> None:
    """Refuse a proof whose file names other premises than those of the case; the check does without the file's.

    Args:
        case: the case.
        workspace: its poses.
        legs: its joint centres; None for a robot that is not six straight legs.
        leg_error: largest error of a leg's length.
        proof: the proof.

    Raises:
        ProofError: it is for another workspace, other joint centres or other errors.
    """
    if workspace_numbers(workspace) != proof.workspace:
        raise ProofError("the proof is for another workspace than this case's")
    if proof.leg_error != leg_error:
        stated = f"the proof is for legs that are off by at most {exact(proof.leg_error)} {case.units.length}"
        raise ProofError(f"{stated}, and not {exact(leg_error)}: see --leg-error")
    _compare_legs(legs, proof)
    if (case.joint_centre_tolerance or 0.0) != proof.tolerance:
        raise ProofError("the proof is for machines within another tolerance on joint centres than this case's")


def _compare_legs(legs: Legs | None, proof: WorkspaceProof) -> None:
    """Refuse a proof for other joint centres.

    Raises:
        ProofError: it is one.
    """
    numbers = [] if legs is None else [*legs.base.tolist(), *legs.platform.tolist()]
    given = [list(each) for each in proof.legs]
    same = len(numbers) == len(given) and all(len(each) == 3 for each in given)
    if same and numbers:
        size = float(np.abs(numbers).max())
        same = bool(np.allclose(given, numbers, rtol=0.0, atol=_SAME * size))
    if not same:
        raise ProofError("the proof is for other joint centres than this case's")


def keep_limit(each: ExpectedClaim, bound: float) -> None:
    """Refuse a bound beyond the limit of the case.

    Raises:
        ProofError: it is beyond.
    """
    if each.limit is None:
        return
    sign = 1.0 if each.sense == Sense.MAX.value else -1.0
    slack = _ON_LIMIT * max(abs(each.limit), abs(bound))
    if not sign * (bound - each.limit) <= slack:
        raise ProofError(f"the bound {bound:.10g} does not keep the case's limit {each.limit:.10g}")
