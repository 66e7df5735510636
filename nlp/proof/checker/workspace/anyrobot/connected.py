"""Whether the closed loops in all boxes of a proof are those of one assembly.

Over each box there is one closed point between two ends at every value of the independent coordinates, and it changes
continuously. A small box about one closed point, which it surely holds, ties two boxes with a common value of the
independent coordinates where it lies between the ends of both: there their closed points are the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ......models import FloatArray
from ...proof_file import ProofError
from .assembly import Assembly

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of pairs that are compared at once.
_BLOCK = 512


class Pieces(NamedTuple):
    """Boxes with known closed loops: ends (P, n) of all coordinates, and closed points (P, n) at their centres."""

    lower: FloatArray
    upper: FloatArray
    near: FloatArray


def refuse_apart(assembly: Assembly, pieces: Pieces) -> None:
    """Refuse boxes whose closed loops are not shown to be those of one assembly, that of the start.

    Args:
        assembly: the closed loops.
        pieces: boxes that cover the workspace.

    Raises:
        ProofError: a box is not reached from the one that holds the start.
    """
    own = assembly.independent
    lower, upper = pieces.lower[:, own], pieces.upper[:, own]
    start = np.broadcast_to(assembly.start, pieces.near.shape)
    at = start[:, own]
    is_reached = ((lower <= at) & (at <= upper)).all(axis=1)
    is_reached &= _holds(assembly, pieces, np.arange(len(lower)), at, start)
    border = np.flatnonzero(is_reached).tolist()
    while border:
        pairs = [
            (one, other)
            for one in border
            for other in np.flatnonzero(
                ~is_reached & (lower <= upper[one]).all(axis=1) & (upper >= lower[one]).all(axis=1)
            ).tolist()
        ]
        border = []
        for begin in range(0, len(pairs), _BLOCK):
            block = [pair for pair in pairs[begin : begin + _BLOCK] if not is_reached[pair[1]]]
            if block:
                first, second = np.array(block).T
                new = np.unique(second[_are_tied(assembly, pieces, first, second)])
                is_reached[new] = True
                border += new.tolist()
    if not is_reached.all():
        ends = zip(lower[~is_reached][0], upper[~is_reached][0], strict=True)
        box = ", ".join(f"[{low:.6g}, {high:.6g}]" for low, high in ends)
        raise ProofError(f"the loops closed in the box {box} are not shown to be of the same assembly as the others")


def _are_tied(
    assembly: Assembly, pieces: Pieces, first: NDArray[np.int64], second: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return whether pairs of boxes have the same closed point at a value that both hold."""
    own = assembly.independent
    low = np.maximum(pieces.lower[first], pieces.lower[second])[:, own]
    high = np.minimum(pieces.upper[first], pieces.upper[second])[:, own]
    at = np.clip(0.5 * low + 0.5 * high, low, high)
    near = assembly.points.moved(pieces.near[first], at, own, assembly.dependent)
    return _holds(assembly, pieces, first, at, near) & _holds(assembly, pieces, second, at, near)


def _holds(
    assembly: Assembly, pieces: Pieces, which: NDArray[np.int64], at: FloatArray, near: FloatArray
) -> NDArray[np.bool_]:
    """Return whether boxes hold a closed point (N, n) at values (N, f), shown in a small box about it."""
    D = assembly.dependent
    small = assembly.enclosed(at, at, near)
    inside = (small.lower >= pieces.lower[which])[:, D] & (small.upper <= pieces.upper[which])[:, D]
    return np.asarray(small.is_known & inside.all(axis=1))
