"""The loop equations that a program needs: those that depend on the others where a case fixes numbers are left out.

A model has the equations that are independent when all dimensions and the pose are free. With fewer free numbers some
of them may follow from the others: the platform of a Delta that is held without rotation fulfils the equations of its
rotation by itself. A local solver stops at dependent equations, so the program has independent ones alone. They are
found at closed points of the case's box, and all equations of the robot are checked at every answer.
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

#: Points of the box from which closed points are searched, the first starting point among them.
_POINTS = 6
#: Share of the box in which the points lie, about its middle.
_SPREAD = 0.6
#: Newton steps to a closed point, with the unknowns alone and with all variables. From home six are enough.
_STEPS = (11, 39)
#: Largest residual of a closed point; equations are of order 1.
_CLOSED = 1e-10
#: Singular values below this part of the largest are zero in a step, so that rounding moves nothing.
_DEPENDENT = 1e-9


def needed_equations(equations: Sequence[SX], table: SymbolTable, unknowns: Sequence[int]) -> list[int]:
    """Return the indices of the loop equations that a program needs, in order; all where no closed point is found.

    Args:
        equations: (1, 1) expressions of the variables and arguments, zero where the loops are closed.
        table: the numbers of the case as symbols.
        unknowns: indices of the robot's internal unknowns among the variables.
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
        point[own] = start[own]  # home, from which the loops close without another assembly
        closed = _closed_point(function, table.values, point, scale, own)
        if closed is not None:
            jacobians.append(closed * scale)
    return sorted(independent_rows(jacobians)) if jacobians else every


def _closed_point(
    function: ca.Function, arguments: Sequence[float], start: FloatArray, scale: FloatArray, own: list[int]
) -> FloatArray | None:
    """Return the Jacobian (c, n) of the equations at a closed point; None where Newton's method finds none.

    Args:
        function: of the variables and arguments, to the equations and their Jacobian.
        arguments: values of the arguments.
        start: (n,) where Newton's method starts.
        scale: (n,) half range of each variable.
        own: indices of the unknowns, which move alone if this closes the loops.
    """
    for movable, steps in zip((own, list(range(len(start)))), _STEPS, strict=True):
        equations = VectorEquations(
            lambda x: [each.full() for each in function(x, arguments)], _CLOSED, movable, scale[movable]
        )
        found = newton(equations, equations.at(start), steps=steps, zeros=[_DEPENDENT])
        if found.error <= _CLOSED:
            return found.slopes
    return None
