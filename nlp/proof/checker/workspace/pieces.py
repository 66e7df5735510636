"""Claims about boxes of poses, shown on pieces of them inside the workspace."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from .....models import FloatArray
from ..bisection import Shown
from ..bisection import show as show_claims
from ..proof_file import ProofError
from .poseroot import PoseRoot
from .tree import Leaves

if TYPE_CHECKING:
    from numpy.typing import NDArray

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
    rule = _PoseRule(claim, root, leaves)
    return show_claims(rule, rule.lower.T, rule.upper.T)


class _PoseRule:
    """The rule of a claim about boxes of poses, of which those outside of the workspace need nothing."""

    block, most_pieces = 256, 5_000

    def __init__(self, claim: BoxClaim, root: PoseRoot, leaves: Leaves) -> None:
        self._claim, self._root = claim, root
        self.width, inside = root.upper - root.lower, ~leaves.outside
        self.lower, self.upper = leaves.lower[inside], leaves.upper[inside]

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (6, N).

        Raises:
            ProofError: the claim is wrong at a pose.
        """
        low, high = lower.T, upper.T
        kept = ~np.asarray(self._root.is_outside(low, high), dtype=bool)
        low, high = self._root.contracted(low, high)
        holds, shares = ~kept, np.zeros(low.shape)
        if kept.any():
            found = self._claim.attempt(low[kept], high[kept])
            holds[kept], shares[kept] = found.holds, found.shares
            if found.is_wrong is not None:
                at = np.flatnonzero(kept)[found.is_wrong]
                self._refuse_wrong(0.5 * low[at] + 0.5 * high[at])
        return Shown(holds, shares.T, low.T, high.T)

    def _refuse_wrong(self, points: FloatArray) -> None:
        """Refuse a claim that is wrong at points (K, 6), of which the first ones are looked at.

        Raises:
            ProofError: one of them is a pose of the workspace.
        """
        for y in points[:_LOOKED_AT]:
            if self._root.holds(y):
                at = ", ".join(f"{value:.6g}" for value in y)
                raise ProofError(f"the claim is wrong at the pose with the coordinates {at}")

    def sentence(self, claim: int) -> str:
        """Return the sentence that a claim could not be shown."""
        return f"the claim could not be shown for the box {_words(self.lower[claim], self.upper[claim])}"


def _words(lower: FloatArray, upper: FloatArray) -> str:
    """Return a box in words."""
    return ", ".join(f"[{low:.6g}, {high:.6g}]" for low, high in zip(lower, upper, strict=True))
