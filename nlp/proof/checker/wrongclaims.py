"""Claims that the centre of a box shows to be wrong, so that a wrong proof is rejected without many bisections.

The centres are evaluated in doubles. A claim counts as wrong only where the centre misses it by far more than rounding;
nothing that is accepted rests on this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ..statement.standard_form import StandardForm
from .tree import Node

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Distance from a claim, in parts of the numbers compared or of 1, that rounding does not explain.
_CLEARLY = 1e-9


class Centres:
    """A search for counterexamples to claims of one kind at the centres of boxes.

    Args:
        form: the form.
        bound: its proven bound.
        kind: kind of the claims.
        index: of their condition or variable.
    """

    def __init__(self, form: StandardForm, bound: float, kind: Node, index: int) -> None:
        self._form, self._bound, self._kind, self._index = form, bound, kind, index
        wanted = [form.expressions]
        if kind in (Node.MONOTONE, Node.FACE_UPPER, Node.FACE_LOWER):
            wanted.append(form.jacobian[:, index])
        self._function = ca.Function("centres", [form.x], [ca.vertcat(*wanted)])

    def are_wrong(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return whether the centres of boxes with ends (n, N) are counterexamples."""
        form, J, R = self._form, len(self._form.functions), self._form.expressions.numel()
        equation = np.array(form.is_equation)
        found = self._function(0.5 * lower + 0.5 * upper).full()
        values, slopes = found[:R], found[R:]
        with np.errstate(all="ignore"):
            if self._kind == Node.INFEASIBLE:
                return np.asarray((values[self._index] < -_CLEARLY) & (not equation[self._index]))
            if self._kind == Node.BOUNDED:
                feasible = (values[J:] < -_CLEARLY).all(axis=0)
                best = values[:J].min(axis=0)
                above = best - self._bound > _CLEARLY * (np.abs(best) + abs(self._bound))
                return np.asarray(feasible & above & (not equation.any()))
            # A function that falls there, or a condition that does not hold strictly and grows, excludes a direction.
            excluded = []
            clear = _CLEARLY * (1 + np.abs(slopes))
            for side in {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(self._kind, (1, -1)):
                falls = (side * slopes[:J] < -clear[:J]).any(axis=0)
                grows = (values[J:] > _CLEARLY) & (side * slopes[J:] > clear[J:])
                excluded.append(falls | grows.any(axis=0))
            return np.asarray(np.all(excluded, axis=0))
