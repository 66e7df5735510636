"""Boxes of poses: the box of a workspace's coordinates, the leaves of its tree, and the proof of claims on pieces.

A pose has three position coordinates and three rotation coordinates, tangents of half angles. The bounds of the box
are fractions; rotations about any axis form a ball in the box, and positions may form a set
(:mod:`.position_conditions`). Nodes of a tree are ``cut``, ``bounded`` and ``outside`` of :mod:`..tree`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, Protocol

import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ....case.pose import Free, Value, ends_of
from ....case.workspace import TurnKind, Workspace
from ..bisection import Shown, show
from ..fractions import tangent_ends
from ..polynomials import Polynomial
from ..proof_file import ProofError
from ..tree import Node, TreeReader, ahead, blocks_of, wrong_node
from .position_conditions import PositionConditions

#: Number of coordinates of a pose.
COORDINATES = 6
#: Number of coordinates of its position.
POSITION = 3
#: Relative outward rounding of tangents that multiply an axis: its components have unit length up to rounding. The
#: coordinate of a fixed angle is a rounded tangent too.
_AXIS = Fraction(1, 2**50)
#: Numbers of bisections and of parts at which a box that a tree calls outside must be proved to be outside.
_OUTSIDE, _MOST_PARTS = 30, 2048


class PoseSymbols(NamedTuple):
    """Pose of the platform as symbols for varying and numbers for constant coordinates.

    Attributes:
        free: indices of the box coordinates that vary.
        head: symbols of these coordinates.
        given: (g, 1) further symbols; the box coordinates determine their values.
        pose: coordinates of the pose, symbols or numbers.
        varying: coordinates of the pose that are symbols.
    """

    free: list[int]
    head: list[SX]
    given: SX
    pose: list[SX]
    varying: list[SX]


@dataclass(frozen=True, eq=False)
class PoseRoot:
    """Box of pose coordinates.

    Attributes:
        kind: kind of the rotation coordinates.
        axis: (3,) axis of rotations about one axis.
        values: (6,) bounds of each varying coordinate; value, or angle, of each constant coordinate.
        lower, upper: (6,) bounds of a box that contains every pose of the workspace.
        inner: (6,) pairs of bounds within which every pose belongs to the workspace; for a fixed angle, its bounds in
            the box.
        ball, inner_ball: outer and inner bound of the squared norm of a Cayley vector; infinite without a ball.
        dependent: indices of the dependent coordinates. Their bounds exclude no pose, and the ball contains only
            independent components.
        at: (6,) pose from which closed loops are followed; None for the centre.
        positions: set of positions; None for all positions of the box.
        settings: names of the dimensions that change along a path. They are the last coordinates.
    """

    kind: TurnKind
    axis: FloatArray
    values: tuple[Value, ...]
    lower: FloatArray
    upper: FloatArray
    inner: tuple[tuple[Fraction, Fraction], ...]
    ball: float
    inner_ball: Fraction | None
    dependent: tuple[int, ...] = ()
    at: FloatArray | None = None
    positions: PositionConditions | None = None
    settings: tuple[str, ...] = ()

    @property
    def of_pose(self) -> int:
        """Number of coordinates of the pose."""
        return len(self.lower) - len(self.settings)

    @property
    def coordinates(self) -> int:
        """Number of coordinates of a box."""
        return len(self.lower)

    @property
    def middle(self) -> FloatArray:
        """The pose (6,) from which closed loops are followed."""
        return 0.5 * self.lower + 0.5 * self.upper if self.at is None else self.at

    def symbols(self) -> PoseSymbols:
        """Return the pose coordinates: symbols for varying coordinates, numbers for constant coordinates."""
        free: list[int] = np.flatnonzero(self.upper > self.lower).tolist()
        pose = [SX.sym(f"y{k}") if k in free else SX(float(each)) for k, each in enumerate(self.middle)]
        own = [pose[k] for k in free]
        return PoseSymbols(free, own, SX(0, 1), pose, own)

    def given(self, lower: FloatArray, upper: FloatArray) -> Sequence[Polynomial]:  # noqa: ARG002 - used by paths
        """Return the values of further symbols over boxes (B, n): a box of poses has none."""
        return ()

    def values_at(self, along: FloatArray) -> FloatArray:
        """Return the values (P, 0) of further symbols at points: a box of poses has none."""
        return np.zeros((len(along), 0))

    slopes_at = values_at

    @property
    def _turns(self) -> list[int]:
        """Indices of the components of the ball."""
        return [k for k in range(3, COORDINATES) if k not in self.dependent]

    @property
    def is_ball(self) -> bool:
        """Whether all three components of a Cayley vector lie in a ball."""
        return math.isfinite(self.ball) and len(self._turns) == 3

    @property
    def is_convex(self) -> bool:
        """Whether the workspace contains the line between any two of its poses."""
        return self.positions is None or self.positions.positions.is_convex

    def holds(self, y: FloatArray) -> bool:
        """Return whether a point (6,) is provably a pose of the workspace."""
        at = [Fraction(each) for each in y.tolist()]
        inside = all(
            low <= each <= high or k in self.dependent
            for k, ((low, high), each) in enumerate(zip(self.inner, at, strict=True))
        )
        inside = inside and (self.positions is None or self.positions.holds(y[:POSITION]))
        return inside and (self.inner_ball is None or sum(at[k] * at[k] for k in self._turns) <= self.inner_ball)

    def show_on_leaves(self, claim: BoxClaim, tree: bytes) -> tuple[int, int]:
        """Prove a claim on the leaves of a tree, and return the numbers of leaves and of examined boxes."""
        leaves = pieces = 0
        for count, boxes in ahead(_read_boxes(self, tree), lambda block: int(block[1].size)):
            rule = _PoseRule(claim, self, *boxes)
            leaves += count
            pieces += show(rule, rule.lower, rule.upper)
        return leaves, pieces

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, 6) to the workspace without loss of a pose; also return which (B,) may contain poses."""
        some = np.ones(len(lower), dtype=bool)
        if self.positions is not None:
            *ends, some = self.positions.contracted(lower[:, :POSITION], upper[:, :POSITION])
            lower, upper = (
                np.hstack([end, each[:, POSITION:]]) for end, each in zip(ends, (lower, upper), strict=True)
            )
        if not math.isfinite(self.ball):
            return lower, upper, some
        turns = self._turns
        least = np.maximum(np.maximum(lower[:, turns], -upper[:, turns]), 0.0)
        squares = least * least
        whole = squares.sum(axis=1, keepdims=True)
        # Sums and differences of three squares have a relative rounding error below 8 / 2^53.
        room = np.maximum(self.ball - (whole - squares) + 2.0**-50 * (self.ball + whole), 0.0)
        most = np.sqrt(room) * (1 + 2.0**-50)
        low, high = lower.copy(), upper.copy()
        low[:, turns], high[:, turns] = np.maximum(lower[:, turns], -most), np.minimum(upper[:, turns], most)
        return low, high, np.asarray((low <= high).all(axis=1) & some)

    def is_outside(self, lower: FloatArray, upper: FloatArray) -> bool:
        """Return whether a box with ends (6,) provably has no pose; parts of it are examined for a set of positions."""
        low, high = lower[None], upper[None]
        for _ in range(1 if self.positions is None else _OUTSIDE):
            low, high, kept = self.contracted(low, high)
            if not kept.any():
                return True
            if kept.sum() > _MOST_PARTS:
                break
            low, high, every = low[kept], high[kept], np.arange(int(kept.sum()))
            along = (high - low)[:, :POSITION].argmax(axis=1)
            middle = 0.5 * low[every, along] + 0.5 * high[every, along]
            below, above = high.copy(), low.copy()
            below[every, along] = above[every, along] = middle
            low, high = np.concatenate([low, above]), np.concatenate([below, high])
        return False


def pose_root(workspace: Workspace) -> PoseRoot:
    """Return the box of coordinates of a workspace."""
    turns = workspace.turns
    spans = [ends_of(each) for each in workspace.position]
    outer = [(Fraction(low), Fraction(high)) for low, high in spans]
    inner = list(outer)
    ball, inner_ball = math.inf, None
    if turns.kind is TurnKind.ANY_AXIS:
        largest = max(map(abs, ends_of(turns.angles[0])))
        least, most = tangent_ends(largest)
        spans += [(-largest, largest)] * 3
        outer += [(-most, most)] * 3
        inner += [(-most, most)] * 3
        ball, inner_ball = _up(most * most), least * least
    else:
        for low, high in map(ends_of, turns.angles):
            (below, start), (end, above) = tangent_ends(low), tangent_ends(high)
            wide = below - _AXIS * abs(below), above + _AXIS * abs(above)
            spans.append((low, high))
            outer.append(wide)
            narrow = start + _AXIS * abs(start), end - _AXIS * abs(end)
            inner.append(wide if low == high else narrow)
    flat = [(Fraction(0), Fraction(0))] * (COORDINATES - len(outer))
    ends = [(_down(Fraction(low)), _up(Fraction(high))) for low, high in outer + flat]
    spans += [(0.0, 0.0)] * len(flat)
    for each in workspace.dependent:
        spans[each.index] = each.lower, each.upper
        is_turn = each.index >= POSITION
        ends[each.index] = (math.tan(each.lower / 2), math.tan(each.upper / 2)) if is_turn else spans[each.index]
    lower, upper = np.array(ends).T
    values = (Free(*each) if low < high else low for (low, high), each in zip(spans, ends, strict=True))
    axis = np.array(turns.axis, dtype=float)
    dependent = tuple(each.index for each in workspace.dependent)
    chosen, positions, at = workspace.position_set, None, None
    if chosen is not None:
        positions = PositionConditions(chosen, lower[:POSITION], upper[:POSITION])
        at = 0.5 * lower + 0.5 * upper
        moving = [k for k in range(POSITION) if lower[k] < upper[k] and k not in dependent]
        at[moving] = np.array(workspace.middle)[moving]
    return PoseRoot(
        turns.kind,
        axis,
        tuple(values),
        lower,
        upper,
        tuple(inner + flat),
        ball,
        inner_ball,
        dependent,
        at,
        positions,
    )


def _down(value: Fraction) -> float:
    """Return a double that is at most a fraction."""
    number = float(value)
    return number if number <= value else math.nextafter(number, -math.inf)


def _up(value: Fraction) -> float:
    """Return a double that is at least a fraction."""
    return 0.0 - _down(-value)


class Attempt(NamedTuple):
    """Result of an attempt to prove a claim on B boxes.

    Attributes:
        holds: (B,) whether the claim is proved on the box.
        shares: (B, n) share of each varying coordinate in the remaining gap.
        is_wrong: (B,) whether the value at the centre clearly violates the bound; None where this was not tested.
    """

    holds: NDArray[np.bool_]
    shares: FloatArray
    is_wrong: NDArray[np.bool_] | None = None


class BoxClaim(Protocol):
    """A claim about boxes of poses; ``free`` has the indices of the pose coordinates that vary."""

    free: list[int]

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to prove the claim on boxes (B, 6)."""


def _read_boxes(root: PoseRoot, tree: bytes) -> Iterator[tuple[int, FloatArray]]:
    """Yield blocks of leaves of a workspace tree: number of leaves, and bounds (2, 6, L) of leaves with poses."""
    reader = TreeReader(tree)
    for block in blocks_of(reader.walk(root.lower, root.upper, frozenset({Node.CUT})), 2 * COORDINATES):
        count, boxes = 0, list[tuple[FloatArray, FloatArray]]()
        for kind, _, low, high in block:
            count += 1
            if kind == Node.BOUNDED:
                boxes.append((low, high))
            elif kind != Node.OUTSIDE:
                raise wrong_node(kind, (Node.CUT, Node.BOUNDED, Node.OUTSIDE))
            elif not root.is_outside(low, high):
                box = box_words(low, high)
                raise ProofError(f"the proof excludes the box {box}, which is not outside the workspace")
        yield count, np.array(boxes).reshape(-1, 2, COORDINATES).transpose(1, 2, 0)
    reader.finish()


class _PoseRule:
    """Rule for a claim about boxes of poses (6, L); boxes outside of the workspace need no proof."""

    block, most_pieces = 1024, 5_000

    def __init__(self, claim: BoxClaim, root: PoseRoot, lower: FloatArray, upper: FloatArray) -> None:
        self._claim, self._root, self.lower, self.upper = claim, root, lower, upper
        self.width = root.upper - root.lower

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (6, N)."""
        low, high, kept = self._root.contracted(lower.T, upper.T)
        holds, shares, is_wrong = ~kept, np.zeros(low.shape), np.zeros(len(low), dtype=bool)
        at = np.flatnonzero(kept)
        if at.size:
            found = self._claim.attempt(low[at], high[at])
            holds[at], shares[at[:, None], self._claim.free] = found.holds, found.shares
            if found.is_wrong is not None:
                at = at[found.is_wrong]
                # Only a pose of the workspace can refute a claim about a box.
                is_wrong[at] = [self._root.holds(y) for y in 0.5 * low[at] + 0.5 * high[at]]
        return Shown(holds, shares.T, low.T, high.T, is_wrong)

    def sentence(self, claim: int) -> str:
        """Return the message for a claim that could not be proved."""
        return f"the claim could not be proved for the box {box_words(self.lower[:, claim], self.upper[:, claim])}"


def box_words(lower: FloatArray, upper: FloatArray) -> str:
    """Return the ranges of a box as text, for messages."""
    return ", ".join(f"[{low:.6g}, {high:.6g}]" for low, high in zip(lower, upper, strict=True))
