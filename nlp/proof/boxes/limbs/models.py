"""Upper models of limbs over boxes of shared and own variables, for the search of limbs that share variables.

A box of a limb is a box of the shared variables, which come first, and one of its own variables. Nothing may be said
of a shared variable from one limb alone: monotonicity and contraction are those of own variables, by the limb's
conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...enclosure.first_order import midpoints
from ...enclosure.quadratic_models import Ends, QuadraticModel, ranges
from ..bounding import NumpyEngine
from ..examination import Verdict

if TYPE_CHECKING:
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


class LimbEngine(Protocol):
    """Upper models of one limb."""

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return the models of boxes with ends (n, B)."""

    def bound(self, L: QuadraticModel) -> FloatArray:
        """Return upper bounds (B,): see :meth:`.quadratic.QuadraticModel.bound`."""

    def ends_reaching(self, L: QuadraticModel, level: FloatArray) -> Ends:
        """Return ends for levels (B,): see :meth:`.quadratic.QuadraticModel.ends_reaching`."""

    def close(self) -> None:
        """Stop its threads."""


class NumpyLimbEngine:
    """The reference engine.

    Args:
        engine: of the limb's form.
        shared: number m of shared variables.
    """

    def __init__(self, engine: NumpyEngine, shared: int) -> None:
        self._engine, self._shared = engine, shared

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return the models of boxes with ends (n, B)."""
        with np.errstate(all="ignore"):
            return self._limb_models(lower, upper, least)

    def bound(self, L: QuadraticModel) -> FloatArray:
        """Return upper bounds (B,) of models."""
        return L.bound()

    def ends_reaching(self, L: QuadraticModel, level: FloatArray) -> Ends:
        """Return the ends of points that can reach levels (B,)."""
        return L.ends_reaching(level)

    def close(self) -> None:
        """Do nothing: this engine has no threads."""

    def _limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None) -> LimbModels:
        """Return the models; NumPy's warnings of invalid operations are off."""
        engine, m = self._engine, self._shared
        J = engine.functions
        box = midpoints(lower, upper)
        model = engine.model(lower, upper, box.radius, least)
        low, high = ranges(model)
        middle, error = model.value.c, model.value.s
        defined = np.asarray((error[:J] < np.inf).all(axis=0))
        L = model.sum_model(engine.multipliers(model, high, m))
        impossible, binding = engine.states(low, high)
        left = engine.collapse_monotone(model, binding, lower, upper, m)
        engine.contract(model, L, left, box, -np.inf)
        closed = np.isin(left.verdict, (Verdict.MONOTONE, Verdict.EMPTIED)) & defined
        stops = (binding | impossible)[:, None] & engine.depends[:, :m, None]
        is_equation = engine.equation[:, None, None]
        g_lo, g_hi = model.gradient_lo[:, :m], model.gradient_hi[:, :m]
        holds = (middle[J:] + error[J:] <= 0).all(axis=0)
        return LimbModels(
            is_possible=~(closed | impossible.any(axis=0)),
            defined=defined,
            holds=((high < 0) & ~engine.equation[:, None])[J:].all(axis=0),
            lower=np.where(defined, np.concatenate([lower[:m], left.lower[m:]]), lower),
            upper=np.where(defined, np.concatenate([upper[:m], left.upper[m:]]), upper),
            L=L,
            slope_lo=g_lo[:J].min(axis=0),
            slope_hi=g_hi[:J].max(axis=0),
            stops_up=(stops & (is_equation | ~(g_hi < 0))).any(axis=0),
            stops_down=(stops & (is_equation | ~(g_lo > 0))).any(axis=0),
            high=np.where(defined, high[:J].min(axis=0), np.inf),
            value=np.where(holds, (middle[:J] - error[:J]).min(axis=0), -np.inf),
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
