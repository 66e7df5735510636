"""Upper models of limbs over boxes of shared and own variables, for the search of limbs that share variables.

A box of a limb is a box of the shared variables, which come first, and one of its own variables. Nothing may be said
of a shared variable from one limb alone: monotonicity and contraction are those of own variables, by the limb's
conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...enclosure.quadratic_models import QuadraticModel

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .....models import FloatArray


@dataclass(frozen=True, eq=False)
class LimbModels:
    """Results for B boxes of a limb with n variables, the first m of them shared.

    Attributes:
        is_possible: (B,) whether an optimum may lie in the box.
        defined: (B,) whether the limb's function has a value in the whole box.
        holds: (B,) whether every condition of the limb holds on the whole box.
        lower, upper: (n, B) the part of the box that is left; shared variables as they were.
        L: upper models of the Lagrangian, whose multipliers make its gradient small in the own variables.
        slope_lo, slope_hi: (m, B) gradient of the function along shared variables.
        stops_up, stops_down: (m, B) whether a condition may stop a point from moving along a shared variable.
        high: (B,) upper bound of the function.
        value: (B,) lower bound of the function at the centre; -inf where a condition may be violated there.
    """

    is_possible: NDArray[np.bool_]
    defined: NDArray[np.bool_]
    holds: NDArray[np.bool_]
    lower: FloatArray
    upper: FloatArray
    L: QuadraticModel
    slope_lo: FloatArray
    slope_hi: FloatArray
    stops_up: NDArray[np.bool_]
    stops_down: NDArray[np.bool_]
    high: FloatArray
    value: FloatArray

    def part(self, which: slice) -> LimbModels:
        """Return the results of some boxes."""
        L = QuadraticModel(**{name: values[..., which] for name, values in vars(self.L).items()})
        return LimbModels(
            **{**{name: values[..., which] for name, values in vars(self).items() if name != "L"}, "L": L}
        )


def models_from_rows(rows: FloatArray, n: int, m: int) -> tuple[FloatArray, QuadraticModel, FloatArray]:
    """Return what the kernel writes of B boxes: flags (B,), models, and slopes and stops (m, 4, B).

    A flag is 1 where the function is defined, plus 2 where every condition holds.
    """
    vectors = rows[3 : 3 + 4 * n].reshape(4, n, -1)
    at = 3 + 4 * n
    H = rows[at : at + n * n].reshape(n, n, -1)
    L = QuadraticModel(rows[1], vectors[0], H, vectors[1], vectors[2], vectors[3], rows[2])
    return rows[0], L, rows[at + n * n :].reshape(m, 4, rows.shape[1])


def rows_of_models(n: int, m: int) -> int:
    """Return the number of rows that the kernel writes for each box."""
    return 3 + 4 * n + n * n + 4 * m
