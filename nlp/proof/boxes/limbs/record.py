"""Record of a search by limbs with shared variables as a proof's tree: see :mod:`...checker.tree`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...checker.proof_file import ProofError
from ...checker.tree import Node, halves, leaf_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray
    from .boxes import SharedBoxes
    from .cuts import SharedSums

#: Part of the gap that is left between the bound at which a recorded search closes a box and the one that is proved. A
#: checker with other arithmetic needs this room.
_RESERVE = 0.5


class SharedRecord:
    """Bisections and leaves of shared boxes, by their ends.

    Args:
        lower: (m,) lower ends of the box of the shared variables.
        upper: (m,) upper ends.
    """

    def __init__(self, lower: FloatArray, upper: FloatArray) -> None:
        self._lower, self._upper = np.array(lower), np.array(upper)
        self._along: dict[bytes, int] = {}
        self._leaves: dict[bytes, bytes] = {}

    def closing(self, threshold: float, value: float) -> float:
        """Return the bound at which a box is closed, for that which is to be proved and the incumbent's value."""
        return threshold - _RESERVE * max(threshold - value, 0.0) if np.isfinite(value) else threshold

    def bisect(self, boxes: SharedBoxes, along: NDArray[np.intp]) -> None:
        """Record bisections of boxes along one variable (B,) each; -1 for none."""
        for b in np.flatnonzero(along >= 0).tolist():
            self._along[_key(boxes.lower[:, b], boxes.upper[:, b])] = int(along[b])

    def close(
        self,
        boxes: SharedBoxes,
        sums: SharedSums,
        emptied: NDArray[np.bool_],
        closed: NDArray[np.bool_],
        threshold: float,
    ) -> None:
        """Record leaves, with the room up to the threshold shared out among limbs and common part.

        Args:
            boxes: B boxes.
            sums: their bounds.
            emptied: (K, B) whether no own box of a limb is left, which only a limb's conditions bring about.
            closed: (B,) whether a box is a leaf.
            threshold: the bound that is to be proved.
        """
        best = np.array([part.best for part in sums.parts])
        emptied = emptied | (best == -np.inf)
        room = (threshold - sums.sums) / (len(best) + 1)
        for b in np.flatnonzero(closed).tolist():
            node = bytes([Node.INFEASIBLE])
            if emptied[:, b].any():
                zero = np.zeros((len(best), len(boxes.lower)))
                bounds = np.where(np.cumsum(emptied[:, b]) * emptied[:, b] == 1, -np.inf, np.inf)
                node = leaf_bytes(bounds, zero, zero[:, :, None] * zero[:, None])
            elif sums.sums[b] <= threshold:
                g = np.array([part.tilt.g[:, b] for part in sums.parts])
                Q = np.array([part.tilt.Q[:, :, b] for part in sums.parts])
                node = leaf_bytes(best[:, b] + room[b], g, Q)
            self._leaves[_key(boxes.lower[:, b], boxes.upper[:, b])] = node

    def tree(self) -> bytes:
        """Return the whole tree.

        Raises:
            ProofError: a box is not closed.
        """
        parts, waiting = [bytes([Node.SHARED])], [(self._lower, self._upper)]
        while waiting:
            lower, upper = waiting.pop()
            key = _key(lower, upper)
            if key in self._leaves:
                parts.append(self._leaves[key])
            elif key in self._along:
                first, second = halves(lower, upper, self._along[key])
                parts.append(bytes([Node.HALF, self._along[key]]))
                waiting += [second, first]
            else:
                raise ProofError("the search did not close every box, so there is no proof to write")
        return b"".join(parts)


def _key(lower: FloatArray, upper: FloatArray) -> bytes:
    return lower.tobytes() + upper.tobytes()
