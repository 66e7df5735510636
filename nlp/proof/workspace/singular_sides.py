"""Two poses at which the determinant of a robot's rows has opposite signs, near a computed singular pose."""

from __future__ import annotations

import numpy as np

from ....models import FloatArray, Model
from ...case.case import Case
from ...case.workspace import Workspace
from ..checker.proof_file import ProofError
from ..checker.workspace.pose_boxes import pose_root
from ..checker.workspace.ranks import rank_claim
from ..statement.claims import REGULAR

#: Distances from the singular pose, in parts of the workspace, and number of poses that are tried at each.
_DISTANCES, _TRIED = (1e-4, 1e-3, 1e-2, 1e-1), 256
_SEED = 2


def singular_sides(
    case: Case, model: Model, workspace: Workspace, y: FloatArray
) -> tuple[FloatArray, FloatArray] | str:
    """Return two poses (6,) that show a singular pose between them, or why there are none.

    Args:
        case: with fixed dimensions.
        model: its robot without unknowns that follow in closed form.
        workspace: the poses.
        y: (6,) coordinates of the singular pose.
    """
    root, rng = pose_root(workspace), np.random.default_rng(_SEED)
    try:
        claim = rank_claim(case, model, root, REGULAR)
    except ProofError as error:
        return str(error)
    if not claim.is_square:
        return "a computed singular pose has a proof for robots with six rows, without loops, alone"
    for distance in _DISTANCES:
        way = distance * (root.upper - root.lower)
        points = np.clip(y + way * rng.uniform(-1, 1, (_TRIED, 6)), root.lower + 1e-3 * way, root.upper - 1e-3 * way)
        points = points[[root.holds(each) for each in points]]
        if not len(points):
            continue
        values = np.nan_to_num(np.linalg.det(claim.values_at(points)))
        one, other = points[values.argmin()], points[values.argmax()]
        try:
            claim.show_sign_change(root, (one.tolist(), other.tolist()))
        except ProofError:
            continue
        return one, other
    return "the determinant is not found to change its sign at the computed singular pose"
