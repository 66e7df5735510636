"""Exact merging of successive lines of a program: one direction, one feed, decided in whole numbers.

Slicers cut straight motions into many short ones. Coordinates in a file have few decimals, so that directions can be
compared without rounding.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from .path import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Grid of the decimals that are compared, parts of a millimetre: the six decimals that slicers write at most.
_GRID = 1e6
#: Largest difference of grid numbers, so that sums of two products fit into 64 bits; and largest grid number.
_LARGEST, _FARTHEST = 2**31, 2**52


def joined_to_previous(
    positions: FloatArray, kinds: NDArray[np.uint8], feeds: FloatArray, scale: tuple[float, float]
) -> NDArray[np.bool_]:
    """Return for each segment whether it continues the previous segment: a line in the same direction at the same feed.

    The end coordinates of each line must be the floating-point numbers nearest to decimals of a grid. On this grid the
    common point lies exactly on the merged line.

    Args:
        positions: (n + 1, 3) ends of the segments, in the unit of the case.
        kinds: (n,) kinds of the segments.
        feeds: (n,) feeds of the lines.
        scale: numerator and denominator of a millimetre in the unit of the case.
    """
    joined = np.zeros(len(kinds), dtype=np.bool_)
    if len(kinds) < 2:
        return joined
    with np.errstate(invalid="ignore", over="ignore"):
        grid = np.round(positions * scale[1] / scale[0] * _GRID)
        is_decimal = (np.abs(grid) < _FARTHEST) & (grid / _GRID * scale[0] / scale[1] == positions)
    on_grid = is_decimal.all(axis=1)
    whole = np.where(on_grid[:, None], grid, 0).astype(np.int64)
    steps = whole[1:] - whole[:-1]
    is_exact = on_grid[:-1] & on_grid[1:] & (np.abs(steps) < _LARGEST).all(axis=1) & (kinds == Kind.LINE)
    steps[~is_exact] = 0
    one, other = steps[:-1], steps[1:]
    is_parallel = np.all([one[:, i] * other[:, j] == one[:, j] * other[:, i] for i, j in ((0, 1), (1, 2), (2, 0))], 0)
    # Parallel directions are equal if no coordinate reverses.
    is_forward = (np.sign(one) * np.sign(other) >= 0).all(axis=1)
    is_equal = feeds[:-1] == feeds[1:]
    joined[1:] = (
        is_exact[:-1] & is_exact[1:] & one.any(axis=1) & other.any(axis=1) & is_parallel & is_forward & is_equal
    )
    return joined
