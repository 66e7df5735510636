"""Boxes of poses: the box of a workspace's coordinates, the leaves of a tree of it, and claims shown on pieces of them.

The coordinates are three of position and three of rotation, tangents of half angles. Ends of the box are fractions;
rotations about any axis are a ball in it. Nodes of a tree are ``cut``, ``bounded`` and ``outside`` of :mod:`..tree`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from ....case.pose import Free, Value
from ....case.workspace import TurnKind, Workspace
from ..bisection import Shown, show
from ..fractions import tangent_ends
from ..proof_file import ProofError
from ..tree import Node, TreeReader

#: Number of coordinates of a pose.
COORDINATES = 6
#: Part of itself by which tangents move outwards where they multiply an axis: its doubles are of length 1 to rounding.
#: A fixed angle's coordinate is a rounded tangent too.
_AXIS = Fraction(1, 2**50)


@dataclass(frozen=True, eq=False)
class PoseRoot:
    """The box of coordinates.

    Attributes:
        kind: coordinates of rotations.
        axis: (3,) of rotations about one axis.
        lower, upper: (6,) ends, which hold every pose of the workspace.
        inner_lower, inner_upper: (6,) ends between which every pose is one of the workspace; a fixed angle's are those
            of its box.
        ball, inner_ball: the same of the squared size of a Cayley vector; infinite without a ball.
    """

    kind: TurnKind
    axis: FloatArray
    lower: FloatArray
    upper: FloatArray
    inner_lower: tuple[Fraction, ...]
    inner_upper: tuple[Fraction, ...]
    ball: float
    inner_ball: Fraction | None

    def holds(self, y: FloatArray) -> bool:
        """Return whether a point (6,) is surely a pose of the workspace."""
        at = [Fraction(each) for each in y.tolist()]
        inside = all(
            low <= each <= high for low, each, high in zip(self.inner_lower, at, self.inner_upper, strict=True)
        )
        return inside and (self.inner_ball is None or sum(each * each for each in at[3:]) <= self.inner_ball)

    def is_outside(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return whether no pose of the workspace is in boxes (B, 6)."""
        if not math.isfinite(self.ball):
            return np.zeros(len(lower), dtype=bool)
        least = np.maximum(np.maximum(lower[:, 3:], -upper[:, 3:]), 0.0)
        # Three squares and two sums round by less than 2^-50 of the result.
        return np.asarray((least * least).sum(axis=1) * (1 - 2.0**-50) > self.ball)

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return boxes (B, 6) with their ends moved to the ball, never past a pose of the workspace."""
        if not math.isfinite(self.ball):
            return lower, upper
        least = np.maximum(np.maximum(lower[:, 3:], -upper[:, 3:]), 0.0)
        squares = least * least
        whole = squares.sum(axis=1, keepdims=True)
        # Sums and differences of three squares round by a few 2^-53 of the largest number in them.
        room = np.maximum(self.ball - (whole - squares) + 2.0**-48 * (self.ball + whole), 0.0)
        most = np.sqrt(room) * (1 + 2.0**-50)
        low, high = np.maximum(lower[:, 3:], -most), np.minimum(upper[:, 3:], most)
        # A crossed pair would be no box: the ends stay where they were.
        crossed = (low > high).any(axis=1, keepdims=True)
        low, high = np.where(crossed, lower[:, 3:], low), np.where(crossed, upper[:, 3:], high)
        return np.concatenate([lower[:, :3], low], axis=1), np.concatenate([upper[:, :3], high], axis=1)


def pose_root(workspace: Workspace) -> PoseRoot:
    """Return the box of coordinates of a workspace."""
    turns = workspace.turns
    outer = [(Fraction(low), Fraction(high)) for low, high in map(_ends, workspace.position)]
    inner = list(outer)
    ball, inner_ball = math.inf, None
    if turns.kind is TurnKind.ANY_AXIS:
        least, most = tangent_ends(max(abs(end) for end in _ends(turns.angles[0])))
        outer += [(-most, most)] * 3
        inner += [(-most, most)] * 3
        ball, inner_ball = _up(most * most), least * least
    else:
        for low, high in map(_ends, turns.angles):
            (below, start), (end, above) = tangent_ends(low), tangent_ends(high)
            wide = below - _AXIS * abs(below), above + _AXIS * abs(above)
            outer.append(wide)
            narrow = start + _AXIS * abs(start), end - _AXIS * abs(end)
            inner.append(wide if low == high else narrow)
        flat = [(Fraction(0), Fraction(0))] * (6 - len(outer))
        outer += flat
        inner += flat
    return PoseRoot(
        turns.kind,
        np.array(turns.axis, dtype=float),
        np.array([_down(low) for low, _ in outer]),
        np.array([_up(high) for _, high in outer]),
        tuple(low for low, _ in inner),
        tuple(high for _, high in inner),
        ball,
        inner_ball,
    )


def _ends(value: Value) -> tuple[float, float]:
    """Return the ends of a number: the same twice for a fixed one."""
    return (value.lower, value.upper) if isinstance(value, Free) else (float(value), float(value))


def _down(value: Fraction) -> float:
    """Return a double that is not above a fraction."""
    number = float(value)
    return number if Fraction(number) <= value else math.nextafter(number, -math.inf)


def _up(value: Fraction) -> float:
    """Return a double that is not below a fraction."""
    return 0.0 - _down(-value)


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
        """Try to show the claim on boxes (B, 6)."""


def show_on_leaves(claim: BoxClaim, root: PoseRoot, tree: bytes) -> tuple[int, int]:
    """Show a claim on the leaves of a tree of a workspace, and return the numbers of leaves and of boxes examined.

    Raises:
        ProofError: the bytes are no tree of the workspace, a leaf is not outside of it as it is claimed to be, or the
            claim could not be shown.
    """
    reader, leaves, boxes = TreeReader(tree), 0, []
    for kind, _, low, high in reader.walk(root.lower, root.upper, frozenset({Node.CUT})):
        leaves += 1
        if kind == Node.BOUNDED:
            boxes.append((low, high))
        elif kind != Node.OUTSIDE:
            raise ProofError(f"the tree holds {kind} where a box must be closed or cut")
        elif not root.is_outside(low[None], high[None])[0]:
            raise ProofError(f"the box {_words(low, high)} is not outside of the workspace")
    reader.finish()
    if not boxes:
        return leaves, 0
    rule = _PoseRule(claim, root, *(np.array(ends).T for ends in zip(*boxes, strict=True)))
    return leaves, show(rule, rule.lower, rule.upper)


class _PoseRule:
    """The rule of a claim about boxes of poses (6, L), of which those outside of the workspace need nothing."""

    block, most_pieces = 1024, 5_000

    def __init__(self, claim: BoxClaim, root: PoseRoot, lower: FloatArray, upper: FloatArray) -> None:
        self._claim, self._root, self.lower, self.upper = claim, root, lower, upper
        self.width = root.upper - root.lower

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (6, N)."""
        low, high = lower.T, upper.T
        kept = ~np.asarray(self._root.is_outside(low, high), dtype=bool)
        low, high = self._root.contracted(low, high)
        holds, shares, is_wrong = ~kept, np.zeros(low.shape), np.zeros(len(low), dtype=bool)
        if kept.any():
            found = self._claim.attempt(low[kept], high[kept])
            holds[kept], shares[kept] = found.holds, found.shares
            if found.is_wrong is not None:
                at = np.flatnonzero(kept)[found.is_wrong]
                # A claim about a box is wrong only at a pose of the workspace.
                is_wrong[at] = [self._root.holds(y) for y in 0.5 * low[at] + 0.5 * high[at]]
        return Shown(holds, shares.T, low.T, high.T, is_wrong)

    def sentence(self, claim: int) -> str:
        """Return the sentence that a claim could not be shown."""
        return f"the claim could not be shown for the box {_words(self.lower[:, claim], self.upper[:, claim])}"


def _words(lower: FloatArray, upper: FloatArray) -> str:
    """Return a box in words."""
    return ", ".join(f"[{low:.6g}, {high:.6g}]" for low, high in zip(lower, upper, strict=True))
