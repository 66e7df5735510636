"""Claims about boxes, shown on pieces of them: a box on which a claim is not shown at once is bisected."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from .....models import FloatArray
from ..proof import ProofError
from .poseroot import PoseRoot
from .tree import Leaves

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of boxes that are examined at once.
_BLOCK = 256
#: Largest number of pieces of a box, and of bisections on the way to one of them.
_MOST_PIECES, _MOST_BISECTIONS = 5_000, 60

#: Number of points of a block that are looked at for one that shows a claim to be wrong.
_LOOKED_AT = 4
#: Part of a bound by which a number at a pose must be beyond it to show that a claim is wrong: far more than rounding.
WRONG = 1e-6


class Attempt(NamedTuple):
    """An attempt to show a claim on B boxes.

    Attributes:
        holds: (B,) whether it is shown.
        shares: (B, 6) share of each coordinate in what is missing.
        is_wrong: (B,) whether the number at the centre is clearly beyond the bound; None where that is not asked.
    """

    holds: NDArray[np.bool_]
    shares: FloatArray
    is_wrong: NDArray[np.bool_] | None = None


class BoxClaim(Protocol):
    """A claim about boxes of poses."""

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6).

        Raises:
            ProofError: the claim is wrong at a pose.
        """


def show(claim: BoxClaim, root: PoseRoot, leaves: Leaves) -> int:
    """Show a claim on the leaves of a tree, and return the number of boxes examined.

    Raises:
        ProofError: a leaf is not outside of the workspace as it is claimed to be, or the claim could not be shown.
    """
    wrong = leaves.outside & ~np.asarray(root.is_outside(leaves.lower, leaves.upper), dtype=bool)
    if wrong.any():
        at = int(wrong.argmax())
        raise ProofError(f"the box {_words(leaves.lower[at], leaves.upper[at])} is not outside of the workspace")
    inside = ~leaves.outside
    lower, upper = leaves.lower[inside], leaves.upper[inside]
    first_lower, first_upper = lower, upper
    owner, depth = np.arange(len(lower)), np.zeros(len(lower), dtype=int)
    used, total = np.zeros(len(lower), dtype=int), 0
    while owner.size:
        part = slice(max(0, owner.size - _BLOCK), owner.size)
        low, high, of, deep = lower[part], upper[part], owner[part], depth[part]
        lower, upper, owner, depth = lower[: part.start], upper[: part.start], owner[: part.start], depth[: part.start]
        kept = ~np.asarray(root.is_outside(low, high), dtype=bool)
        low, high = root.contracted(low[kept], high[kept])
        of, deep = of[kept], deep[kept]
        if not of.size:
            continue
        np.add.at(used, of, 1)
        total += of.size
        holds, shares, is_wrong = claim.attempt(low, high)
        if is_wrong is not None:
            _refuse_wrong(root, 0.5 * low[is_wrong] + 0.5 * high[is_wrong])
        left = np.flatnonzero(~np.asarray(holds, dtype=bool))
        failed = (used[of[left]] > _MOST_PIECES) | (deep[left] >= _MOST_BISECTIONS)
        if failed.any():
            k = int(of[left[failed.argmax()]])
            raise ProofError(f"the claim could not be shown for the box {_words(first_lower[k], first_upper[k])}")
        low, high, of, deep = low[left], high[left], of[left], deep[left] + 1
        wide = high - low
        relative = wide / np.where(root.upper > root.lower, root.upper - root.lower, np.inf)
        known = np.isfinite(shares[left]).all(axis=1, keepdims=True) & (shares[left] > 0).any(axis=1, keepdims=True)
        along = np.where(wide > 0, np.where(known, shares[left], relative), -1.0).argmax(axis=1)
        every = np.arange(len(left))
        middle = 0.5 * low[every, along] + 0.5 * high[every, along]
        below, above = high.copy(), low.copy()
        below[every, along] = above[every, along] = middle
        lower, upper = np.concatenate([lower, low, above]), np.concatenate([upper, below, high])
        owner, depth = np.concatenate([owner, of, of]), np.concatenate([depth, deep, deep])
    return total


def _refuse_wrong(root: PoseRoot, points: FloatArray) -> None:
    """Refuse a claim that is wrong at points (K, 6), of which the first ones are looked at.

    Raises:
        ProofError: one of them is a pose of the workspace.
    """
    for y in points[:_LOOKED_AT]:
        if root.holds(y):
            raise ProofError(f"the claim is wrong at the pose with the coordinates {', '.join(f'{v:.6g}' for v in y)}")


def _words(lower: FloatArray, upper: FloatArray) -> str:
    """Return a box in words."""
    return ", ".join(f"[{low:.6g}, {high:.6g}]" for low, high in zip(lower, upper, strict=True))
