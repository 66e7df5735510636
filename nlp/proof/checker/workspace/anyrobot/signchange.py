"""A singular pose of a robot without loops: between two poses with determinants of opposite signs."""

from __future__ import annotations

import numpy as np

from ......models import FloatArray
from ...proof_file import ProofError
from ..poseroot import PoseRoot
from .motionclaim import MotionClaim

#: Largest number of parts of the way between two poses.
_PARTS = 4096


def show_sign_change(claim: MotionClaim, root: PoseRoot, one: FloatArray, other: FloatArray) -> None:
    """Show that the determinant has opposite signs at two poses, and that there is a way between them in the workspace.

    The entries have values along the whole way, so that the determinant changes continuously, and is 0 at a pose.

    Args:
        claim: that J has full rank.
        root: the workspace, which is convex in its coordinates.
        one: (6,) coordinates of a pose.
        other: (6,) those of the other.

    Raises:
        ProofError: it could not be shown.
    """
    if not claim.is_square:
        raise ProofError("a singular pose has a proof for robots with six rows, without loops, alone")
    signs = claim.signs_at(np.stack([one, other]))
    if signs[0] * signs[1] >= 0:
        raise ProofError("the determinant has not opposite signs at the two poses")
    waiting = [(one, other)]
    parts = 0
    while waiting:
        begin, end = waiting.pop()
        parts += 1
        if claim.has_values(np.minimum(begin, end), np.maximum(begin, end)):
            continue
        middle = 0.5 * begin + 0.5 * end
        if parts > _PARTS or not root.holds(middle):
            raise ProofError("the determinant is not shown to change continuously between the two poses")
        waiting += [(begin, middle), (middle, end)]
