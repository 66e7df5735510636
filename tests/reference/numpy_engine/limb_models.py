"""Upper models of limbs with NumPy, over boxes of shared and own variables.

Nothing may be said of a shared variable from one limb alone: monotonicity and contraction are those of own variables,
by the limb's conditions.
"""

from __future__ import annotations

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.boxes.engine import BoxState, LimbModels

from .bounding import NumpyEngine
from .intervals import midpoints


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

    def _limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None) -> LimbModels:
        """Return the models; NumPy's warnings of invalid operations are off."""
        engine, m = self._engine, self._shared
        J = engine.functions
        box = midpoints(lower, upper)
        model = engine.model(lower, upper, box.radius, least)
        low, high = model.value.lo, model.value.hi
        middle, error = model.value.c, model.value.s
        defined = np.asarray((error[:J] < np.inf).all(axis=0))
        L = model.sum_model(engine.multipliers(model, high, m))
        impossible, binding = engine.states(low, high)
        left = engine.collapse_monotone(model, binding, lower, upper, m)
        engine.contract(model, L, left, box, -np.inf)
        closed = np.isin(left.verdict, (BoxState.MONOTONE, BoxState.EMPTIED)) & defined
        stops = (binding | impossible)[:, None] & engine.depends[:, :m, None]
        is_equation = engine.equation[:, None, None]
        g_lo, g_hi = model.gradient_lo[:, :m], model.gradient_hi[:, :m]
        holds = (middle[J:] + error[J:] <= 0).all(axis=0)
        return LimbModels(
            verdict=left.verdict,
            reason=left.reason,
            bound=np.where(defined, high[:J].min(axis=0), np.inf),
            lower=np.where(defined, np.concatenate([lower[:m], left.lower[m:]]), lower),
            upper=np.where(defined, np.concatenate([upper[:m], left.upper[m:]]), upper),
            cut_lower=left.cut_lower,
            cut_upper=left.cut_upper,
            split=np.zeros_like(left.verdict),
            value=np.where(holds, (middle[:J] - error[:J]).min(axis=0), -np.inf),
            centre=box.centre,
            is_possible=~(closed | impossible.any(axis=0)),
            defined=defined,
            holds=((high < 0) & ~engine.equation[:, None])[J:].all(axis=0),
            L=L,
            slope_lo=g_lo[:J].min(axis=0),
            slope_hi=g_hi[:J].max(axis=0),
            stops_up=(stops & (is_equation | ~(g_hi < 0))).any(axis=0),
            stops_down=(stops & (is_equation | ~(g_lo > 0))).any(axis=0),
        )
