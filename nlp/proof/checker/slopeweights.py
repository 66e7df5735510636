"""Weights of the checker's Lagrangian: any weights give a bound, and these make it small.

The bound of ``L = sum_r w_r v_r`` over a box is about ``L(c) + sum_i r_i |dL/dx_i (c)|``. The weights are found in two
steps: coordinate descent on the sum of squares of the scaled gradient, and then on this bound itself, which also counts
how far a condition is violated at the centre. The first weights are better where the optimum lies in the box, the
second ones for a box on the edge of the feasible set.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .slopes import Slope

if TYPE_CHECKING:
    from ....models import FloatArray

#: Sweeps over all expressions of the two searches.
_SWEEPS, _EDGE_SWEEPS = 12, 3


def lagrangian_weights(
    functions: int,
    is_equation: Sequence[bool],
    expressions: Sequence[Slope],
    gradients: Sequence[Sequence[Slope]],
    radius: FloatArray,
) -> list[FloatArray]:
    """Return two choices of weights (R, N): of functions, not negative with sum 1; of inequalities, not positive.

    Args:
        functions: number of functions, which come before the conditions.
        is_equation: whether each of the R expressions must be 0.
        expressions: R slopes.
        gradients: n slopes of each expression's derivatives.
        radius: (n, N) half widths of the boxes.
    """
    G = np.array([[0.5 * (g.C[0] + g.C[1]) for g in row] for row in gradients]) * radius
    values = np.array([0.5 * (each.C[0] + each.C[1]) for each in expressions])
    return weights_of(functions, is_equation, values, np.array([each.V[1] for each in expressions]), G)


def weights_of(
    functions: int, is_equation: Sequence[bool], values: FloatArray, high: FloatArray, G: FloatArray
) -> list[FloatArray]:
    """Return the two choices of weights (R, N) from numbers.

    Args:
        functions: number of functions, which come before the conditions.
        is_equation: whether each of the R expressions must be 0.
        values: (R, N) values at the centres of the boxes.
        high: (R, N) largest values on the boxes.
        G: (R, n, N) gradients at the centres times the radii of the boxes.
    """
    usable = np.isfinite(G).all(axis=1) & np.isfinite(values) & np.isfinite(high)
    for r in range(functions, len(G)):
        if not is_equation[r]:
            # A condition that cannot bind gets no weight.
            usable[r] &= ~(high[r] < 0)
    G, values = np.where(usable[:, None], G, 0.0), np.where(usable, values, 0.0)
    weights = np.zeros_like(values)
    weights[0] = 1.0
    if len(G) == 1:
        return [weights]
    left = G[0].copy()
    bind = [r for r in range(functions, len(G)) if usable[r].any()]
    sizes = np.einsum("rin,rin->rn", G, G)
    for _ in range(_SWEEPS):
        for r in range(1, functions):
            _move_towards(r, functions, weights, G, left)
        for r in bind:
            step = np.einsum("in,in->n", G[r], left) / np.where(sizes[r] > 0, sizes[r], np.inf)
            new = weights[r] - step if is_equation[r] else np.minimum(weights[r] - step, 0.0)
            left += (new - weights[r]) * G[r]
            weights[r] = new
    edge = weights.copy()
    for _ in range(_EDGE_SWEEPS):
        for r in bind:
            _minimise_bound(edge[r], G[r], values[r], left, is_equation[r])
    return [weights, edge]


def _move_towards(r: int, functions: int, weights: FloatArray, G: FloatArray, left: FloatArray) -> None:
    """Move the weights of the functions towards function r alone, as far as the gradient ``left`` gets smaller."""
    direction = G[r] - np.einsum("jn,jin->in", weights[:functions], G[:functions])
    size = np.einsum("in,in->n", direction, direction)
    part = -np.einsum("in,in->n", direction, left) / np.where(size > 0, size, np.inf)
    part = np.clip(part, 0.0, 1.0)
    left += part * direction
    weights[:functions] *= 1 - part
    weights[r] += part
    # The sum is 1 in spite of rounding.
    weights[:functions] /= weights[:functions].sum(axis=0)


def _minimise_bound(
    weight: FloatArray, gradient: FloatArray, value: FloatArray, left: FloatArray, is_equation: bool
) -> None:
    """Change one weight (N,) so that ``weight value + sum |left|`` is least; written in place, as is ``left`` (n, N).

    The function is convex and piecewise linear in the weight: it is least where a component of ``left`` is 0, or at 0.
    """
    without = left - weight * gradient
    with np.errstate(all="ignore"):
        breaks = np.where(np.abs(gradient) > 0, -without / gradient, 0.0)
    breaks = np.where(np.isfinite(breaks), breaks, 0.0)
    tried = np.concatenate([breaks, np.zeros((1, weight.size)), weight[None]])
    if not is_equation:
        tried = np.minimum(tried, 0.0)
    bounds = tried * value + np.abs(without[None] + tried[:, None] * gradient[None]).sum(axis=1)
    best = tried[bounds.argmin(axis=0), np.arange(weight.size)]
    left += (best - weight) * gradient
    weight[:] = best
