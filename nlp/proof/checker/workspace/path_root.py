"""Boxes along a tool path: their coordinates are the place along the path and the dependent coordinates of the pose.

The tree of a path consists of one tree for each segment, in order. The nodes of these trees bisect the place.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ....case.case import Case
from ....case.pose import Free, Value, ends_of
from ....case.workspace import LARGEST_TURN, TurnKind, Turns, Workspace
from ....errors import CaseError
from ....evidence.dependent import dependent_of, robot_size
from ....path.path import ProgrammedPath
from ...statement.chosen_settings import with_settings
from ..bisection import Shown, show
from ..polynomials import Polynomial
from ..proof_file import ProofError
from ..tree import Node, TreeReader, ahead, blocks_of, wrong_node
from .path_poses import PathPoses
from .pose_boxes import POSITION, BoxClaim, PoseRoot, PoseSymbols

#: Widening of the range of a coordinate beyond its range along the path; relative for values above 1, otherwise
#: absolute.
_ROOM = 1e-9
#: Motion of a coordinate, relative to the robot's size or in radians, below which it counts as rounding.
_STILL = 1e-9


class PathRoot:
    """Root of the trees of a path: the box of the place along the path, and its poses.

    Args:
        case: case with fixed dimensions.
        path: path with at least one segment.

    Attributes:
        poses: coordinates along the path.
        box: a box that contains all poses and starts at the first pose.
        workspace: the box as a workspace; its dependent coordinates are constant and have no range.
        stated: (v,) indices of the varying independent coordinates of the pose.
        of_pose: number of coordinates of the pose, which dimensions that change follow.
        settings: names of these dimensions.
        coordinates: number of coordinates of a piece: the place along the path.
        lower, upper, middle, dependent: bounds and centre of the place, and dependent coordinates; see
            :class:`.pose_boxes.PoseRoot`.

    Raises:
        ProofError: the path moves a coordinate that the robot cannot control.
    """

    coordinates = 1
    is_ball, ball, is_convex = False, math.inf, True

    def __init__(self, case: Case, path: ProgrammedPath) -> None:
        self.poses, self._is_timed = PathPoses(path), path.is_timed
        low, high = self.poses.ranges()
        self.of_pose, self.settings = self.poses.of_pose, self.poses.settings
        of_pose = slice(self.of_pose)
        middle = (0.5 * low + 0.5 * high)[self.of_pose :].tolist()
        resting = with_settings(case, dict(zip(self.settings, middle, strict=True)))
        self.workspace = _workspace(resting, low[of_pose], high[of_pose], is_tangents=self.poses.is_tangents)
        if self.workspace.dependent and self.settings:
            raise ProofError("dependent coordinates of the pose are not checked while dimensions change along the path")
        following, varying = [each.index for each in self.workspace.dependent], self.poses.varying
        for each in self.workspace.dependent:
            k, ends = each.index, (each.lower, each.upper)
            low[k], high[k] = map(math.tan, (0.5 * end for end in ends)) if k >= POSITION else ends
        self.stated = [k for k in varying if k not in following]
        room = np.zeros(len(low))
        room[self.stated] = _ROOM * (1 + np.abs([low, high]).max(axis=0))[self.stated]
        first, lower, upper = 0.5 * low + 0.5 * high, low - room, high + room
        first[self.stated] = self.poses.at(np.zeros(1))[0][0, [varying.index(k) for k in self.stated]]
        moving = sorted({*self.stated, *following})
        values = [
            Free(a, b) if k in moving else a
            for k, (a, b) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True))
        ]
        kind = TurnKind.ROLL_PITCH_YAW if self.poses.is_tangents else TurnKind.ANY_AXIS
        none = np.zeros(3)
        self.box = PoseRoot(
            kind, none, tuple(values), lower, upper, (), math.inf, None, tuple(following), first, settings=self.settings
        )
        self.kind, self.axis, self.values = kind, none, self.box.values
        self.lower = np.array([0.0, *lower[following]])
        self.upper = np.array([float(len(path)), *upper[following]])
        self.middle = np.array([0.0, *first[following]])
        self.dependent = tuple(range(1, 1 + len(following)))
        self._columns = [varying.index(k) for k in self.stated]

    def symbols(self) -> PoseSymbols:
        """Return the coordinates as symbols.

        The place determines the given coordinates and, for a path with times, their rates.
        """
        pose = list(self.box.symbols().pose)
        following = [pose[k] for k in self.box.dependent]
        stated = ca.vertcat(SX(0, 1), *[pose[k] for k in self.stated])
        rates = SX.sym("rates", len(self.stated) * self._is_timed)
        varying = [pose[k] for k in sorted({*self.stated, *self.box.dependent})]
        free = list(range(1 + len(following)))
        return PoseSymbols(free, [SX.sym("along"), *following], ca.vertcat(stated, rates), pose, varying)

    def given(self, lower: FloatArray, upper: FloatArray) -> Sequence[Polynomial]:
        """Return the stated coordinates over pieces (B, n) and, for a path with times, their rates per second."""
        low, high = lower[:, 0], upper[:, 0]
        values, slopes = ([each[k] for k in self._columns] for each in self.poses.over(low, high))
        if not self._is_timed:
            return values
        inverse = self.poses.inverse_seconds(self.poses.segments(low, high))
        return [*values, *(each * inverse for each in slopes)]

    def values_at(self, along: FloatArray) -> FloatArray:
        """Return the values (P, g) of the given symbols at places (P, 1), computed in doubles."""
        place = np.clip(along[:, 0], 0.0, len(self.poses))
        values, slopes = (each[:, self._columns] for each in self.poses.at(place))
        if not self._is_timed:
            return values
        inverse = self.poses.inverse_seconds(self.poses.segments(place, place)).P[0]
        return np.hstack([values, slopes * inverse[:, None]])

    def slopes_at(self, along: FloatArray) -> FloatArray:
        """Return derivatives (P, g) of the coordinates with respect to the place, at places (P, 1), in doubles.

        The derivatives of rates are 0.
        """
        slopes = self.poses.at(np.clip(along[:, 0], 0.0, len(self.poses)))[1][:, self._columns]
        return np.hstack([slopes, np.zeros((len(slopes), slopes.shape[1] * self._is_timed))])

    def holds(self, y: FloatArray) -> bool:
        """Return whether a point (1,) is a place on the path."""
        return bool(0 <= y[0] <= len(self.poses))

    def show_on_leaves(self, claim: BoxClaim, tree: bytes) -> tuple[int, int]:
        """Prove a claim on the leaves of a tree, and return the numbers of leaves and of examined pieces."""
        leaves = pieces = 0
        for each in ahead(self._read_pieces(tree), lambda block: int(block.size)):
            rule = _PieceRule(claim, *each)
            leaves += each.shape[2]
            pieces += show(rule, rule.lower, rule.upper)
        return leaves, pieces

    def _read_pieces(self, tree: bytes) -> Iterator[FloatArray]:
        """Yield the leaves of a tree in blocks: ends (2, 1, L) of pieces."""
        reader, inner = TreeReader(tree), frozenset({Node.HALF, Node.CUT})
        ends = (np.array([float(k), k + 1.0])[:, None] for k in range(len(self.poses)))
        every = (leaf for low, high in ends for leaf in reader.walk(low, high, inner))
        for block in blocks_of(every, 2):
            pieces = list[tuple[FloatArray, FloatArray]]()
            for kind, _, low, high in block:
                if kind != Node.BOUNDED:
                    raise wrong_node(kind, (Node.HALF, Node.CUT, Node.BOUNDED))
                pieces.append((low, high))
            yield np.array(pieces).transpose(1, 2, 0)
        reader.finish()


class _PieceRule:
    """Rule for a claim about pieces (1, L) of a path."""

    block, most_pieces = 1024, 5_000
    width: FloatArray = np.ones(1)

    def __init__(self, claim: BoxClaim, lower: FloatArray, upper: FloatArray) -> None:
        self._claim, self.lower, self.upper = claim, lower, upper

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (1, N)."""
        found = self._claim.attempt(lower.T, upper.T)
        return Shown(found.holds, np.ones_like(lower), lower, upper, found.is_wrong)

    def sentence(self, claim: int) -> str:
        """Return the message for a claim that could not be proved."""
        k = int(np.floor(0.5 * self.lower[0, claim] + 0.5 * self.upper[0, claim]))
        low, high = (each[0, claim] - k for each in (self.lower, self.upper))
        where = f"segment {k + 1}, for parameters of this segment from {low:.6g} to {high:.6g}"
        return f"the claim could not be proved on {where}"


def _workspace(case: Case, low: FloatArray, high: FloatArray, *, is_tangents: bool) -> Workspace:
    """Return a workspace about a path, from the bounds (c,) of its coordinates; dependent coordinates are constant.

    Raises:
        ProofError: the path moves a dependent coordinate.
    """
    turns = Turns(TurnKind.ANY_AXIS, (Free(-LARGEST_TURN, LARGEST_TURN),))
    position = _values(low[:POSITION], high[:POSITION])
    if not is_tangents:
        return Workspace(position, turns)
    angles = tuple(_values(*(2 * np.arctan(each[POSITION:]) for each in (low, high))))
    stated = [*position, *angles]
    about = Workspace(position, Turns(TurnKind.ROLL_PITCH_YAW, angles))
    try:
        found = dependent_of(replace(case, workspace=about), about)
    except CaseError as error:
        raise ProofError(error.fault) from None
    following = [each.index for each in found.dependent]
    if not following:
        return found
    length = _STILL * robot_size(case, [sum(ends_of(each)) / 2 for each in position])
    moved = [found.names[k] for k in following if np.ptp(ends_of(stated[k])) > (length if k < POSITION else _STILL)]
    if moved:
        raise ProofError(
            f"the path changes {' and '.join(moved)}, but this robot cannot choose these coordinates independently"
        )
    still = [sum(ends_of(each)) / 2 if k in following else each for k, each in enumerate(stated)]
    return replace(found, position=still[:POSITION], turns=replace(found.turns, angles=tuple(still[POSITION:])))


def _values(low: FloatArray, high: FloatArray) -> list[Value]:
    """Return ranges, or fixed values where both ends are equal."""
    return [Free(a, b) if b > a else a for a, b in zip(low.tolist(), high.tolist(), strict=True)]
