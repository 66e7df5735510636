"""Loop of the checker: claims about boxes are proved on pieces of them; pieces without proof are bisected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .proof_file import ProofError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Largest number of bisections that lead to a piece.
_MOST_BISECTIONS = 60
#: Period of bisections along the widest variable, so that all variables become narrow whatever the models suggest.
_WIDEST = 5


@dataclass(eq=False)
class Shown:
    """Results of a rule on N pieces (boxes) of n variables.

    Attributes:
        holds: (N,) whether the claim is proved on the piece.
        change: (n, N) estimated improvement of the bound when each variable is halved.
        lower, upper: (n, N) bounds of the part of each piece that remains to be proved; lower above upper where
        nothing remains.
        is_wrong: (N,) whether the centre is a counterexample, beyond rounding; None where this was not tested.
    """

    holds: NDArray[np.bool_]
    change: FloatArray
    lower: FloatArray
    upper: FloatArray
    is_wrong: NDArray[np.bool_] | None = None

    def keep(self, which: NDArray[np.intp], holds: NDArray[np.bool_], change: FloatArray) -> None:
        """Store whether the claim holds on some pieces, and the estimated improvement of their bounds."""
        self.holds[which] |= holds
        self.change[:, which] = np.fmax(self.change[:, which], change)

    def cut(self, which: NDArray[np.intp], ends: tuple[FloatArray, FloatArray]) -> None:
        """Reduce some pieces to the given parts."""
        self.lower[:, which] = np.fmax(self.lower[:, which], ends[0])
        self.upper[:, which] = np.fmin(self.upper[:, which], ends[1])


class Rule(Protocol):
    """A rule that proves claims of one kind.

    Attributes:
        width: (n,) widths of the whole box.
        block: number of pieces examined at once.
        most_pieces: largest number of pieces of a claim's box.
    """

    width: FloatArray
    block: int
    most_pieces: int

    def examine(self, lower: FloatArray, upper: FloatArray, of: NDArray[np.intp]) -> Shown:
        """Examine pieces with bounds (n, N); ``of`` has the index of the claim of each piece.

        Raises:
            ProofError: a claim is wrong.
        """

    def sentence(self, claim: int) -> str:
        """Return the message for a claim that could not be proved."""


def show(rule: Rule, lower: FloatArray, upper: FloatArray) -> int:
    """Prove claims, and return the number of examined pieces.

    Args:
        rule: rule that proves the claims.
        lower: (n, L) lower ends of the claims' boxes.
        upper: (n, L) upper ends of the claims' boxes.

    Raises:
        ProofError: a claim could not be proved.
    """
    (n, count), begun, total = lower.shape, 0, 0
    used = np.zeros(count, dtype=np.intp)
    # Declared types save a type checker minutes of inference in the loop.
    waiting: tuple[FloatArray, FloatArray] = (np.zeros((n, 0)), np.zeros((n, 0)))
    owner: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    depth: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    while begun < count or owner.size:
        # The last pieces come first, so that most claims are finished before new ones begin.
        more = np.arange(begun, min(begun + max(rule.block - owner.size, 0), count))
        begun += more.size
        a, b = (np.concatenate([old, new[:, more]], axis=1) for old, new in zip(waiting, (lower, upper), strict=True))
        owner, depth = np.concatenate([owner, more]), np.concatenate([depth, np.zeros_like(more)])
        first = max(owner.size - rule.block, 0)
        low, high, of, deep = a[:, first:], b[:, first:], owner[first:], depth[first:]
        np.add.at(used, of, 1)
        total += of.size
        with np.errstate(all="ignore"):
            found = rule.examine(low, high, of)
            left = np.flatnonzero(~(found.holds | (found.lower > found.upper).any(axis=0)))
            along = _variables_to_bisect(found, low, high, rule.width, deep)[left]
        low, high, of, deep = found.lower[:, left], found.upper[:, left], of[left], deep[left] + 1
        failed = (used[of] > rule.most_pieces) | (deep > _MOST_BISECTIONS)
        if found.is_wrong is not None:
            failed |= found.is_wrong[left]
        if failed.any():
            raise ProofError(rule.sentence(int(of[failed.argmax()])))
        columns = np.arange(of.size)
        middle = 0.5 * low[along, columns] + 0.5 * high[along, columns]
        below, above = high.copy(), low.copy()
        below[along, columns] = above[along, columns] = middle
        waiting = np.hstack([a[:, :first], low, above]), np.hstack([b[:, :first], below, high])
        owner, depth = np.concatenate([owner[:first], of, of]), np.concatenate([depth[:first], deep, deep])
    return total


def _variables_to_bisect(
    found: Shown, lower: FloatArray, upper: FloatArray, width: FloatArray, depth: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the index (N,) of the variable along which the open part of each piece is bisected next."""
    wide = found.upper - found.lower
    score = found.change * (wide / np.where(upper > lower, upper - lower, 1.0))
    relative = wide / np.where(width > 0, width, np.inf)[:, None]
    known = np.isfinite(score).all(axis=0) & (score > 0).any(axis=0)
    score = np.where(known & (depth % _WIDEST != _WIDEST - 1), score, relative)
    return np.asarray(np.where(wide > 0, score, -1.0).argmax(axis=0))
