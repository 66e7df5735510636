"""Independent loop equations of a nonlinear program: fixed parameters may make equations dependent.

The equations of a model are independent if all dimensions and the pose are free. With fewer free parameters some may
follow from others: the platform of a Delta with fixed rotation satisfies its rotation equations by itself. A local
solver stops at dependent equations, so the program has only independent ones. They are determined at closed points of
the case's box, and all loop equations are checked at every answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray
from ...models.newton import VectorEquations, newton
from ...models.rows import independent_rows
from .places import SymbolTable

#: Number of points of the box from which closed points are searched, including the first starting point.
_POINTS = 6
#: Fraction of the box, about its middle, with these points.
_SPREAD = 0.6
#: Largest number of Newton steps to a closed point, with only the unknowns and with all variables. From home six are
#: enough.
_STEPS = (11, 39)
#: Largest residual of a closed point; equations have magnitudes of about 1.
_CLOSED = 1e-10
#: Relative size below which singular values are zero in a step, so that rounding moves nothing.
_DEPENDENT = 1e-9


def needed_equations(equations: Sequence[SX], table: SymbolTable, unknowns: Sequence[int]) -> list[int]:
    """Return the indices of the loop equations that a program needs, in order; all if there is no closed point.

    Args:
        equations: (1, 1) expressions of the variables and arguments, zero where the loops are closed.
        table: symbols of the variables and arguments.
        unknowns: indices of the robot's unknowns among the variables.
    """
    every = list(range(len(equations)))
    if not equations or not table.x:
        return every
    x, stacked = table.variables_vector, ca.vertcat(*equations)
    outputs = [ca.densify(stacked), ca.densify(ca.jacobian(stacked, x))]
    function = ca.Function("loops", [x, table.arguments_vector], outputs)
    lower = np.array([each.lower for each in table.bounds])
    upper = np.array([each.upper for each in table.bounds])
    start = np.array([each.first for each in table.bounds])
    own, scale = list(unknowns), (upper - lower) / 2
    rng = np.random.default_rng(0)
    jacobians = []
    for k in range(_POINTS):
        point = start if k == 0 else (lower + upper) / 2 + _SPREAD * scale * rng.uniform(-1.0, 1.0, len(start))
        point[own] = start[own]  # home, from which the loops close in the home assembly mode
        closed = _closed_point(function, table.values, point, scale, own)
        if closed is not None:
            jacobians.append(closed * scale)
    return sorted(independent_rows(jacobians)) if jacobians else every


def _closed_point(
    function: ca.Function, arguments: Sequence[float], start: FloatArray, scale: FloatArray, unknowns: list[int]
) -> FloatArray | None:
    """Return the Jacobian (c, n) of the equations at a closed point; None if Newton's method fails.

    Args:
        function: function from variables and arguments to the equations and their Jacobian.
        arguments: values of the arguments.
        start: (n,) start of Newton's method.
        scale: (n,) half range of each variable.
        unknowns: indices of the unknowns, the only moving variables if this closes the loops.
    """
    for movable, steps in zip((unknowns, list(range(len(start)))), _STEPS, strict=True):
        equations = VectorEquations(
            lambda x: [each.full() for each in function(x, arguments)], _CLOSED, movable, scale[movable]
        )
        found = newton(equations, equations.at(start), steps=steps, zeros=[_DEPENDENT])
        if found.error <= _CLOSED:
            return found.slopes
    return None
