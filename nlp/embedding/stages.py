"""A program's functions in two stages: the numbers that depend on the arguments alone, then the rest at each point.

A controller changes the task or a dimension rarely and the point always. Sines of fixed angles and the like must not be
computed at every point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ..program.program import Program


@dataclass(frozen=True, eq=False)
class StagedFunctions:
    """Functions in two stages.

    Attributes:
        prepare: first stage, ``p -> k``: (count, 1) numbers that depend on the arguments alone.
        functions: second stage, by name: functions of ``(x, k)`` and of further inputs, with dense results.
    """

    prepare: ca.Function
    functions: Mapping[str, ca.Function]

    @property
    def all(self) -> tuple[ca.Function, ...]:
        """Every function, the first stage first."""
        return (self.prepare, *self.functions.values())


def stage_functions(program: Program, prefix: str) -> StagedFunctions:
    """Return the functions that the generated C calls.

    * ``F``, ``F_gradient``: the objective, and the objective with its gradient;
    * ``jacobian``, ``rates``, ``rotation``: those of the robot;
    * ``limits``: constraints with their gradients;
    * ``derivatives``: objective, gradient, constraints, and their gradients;
    * ``curvature``: Hessian of ``weight * F + multipliers . g``, for a weight and multipliers as further inputs;
    * ``magnitude``: size of the objective without cancellation.

    A constraint on singular values of J is 0 here. ``derivatives`` returns in addition the entries of J, row after row,
    with their gradients; ``curvature`` takes a multiplier for each of these entries at the end and a direction, and
    returns the Hessian's product with the direction. There is no ``limits`` then.

    Matrices are transposed, because CasADi writes column after column and C reads row after row.

    Args:
        program: the program.
        prefix: beginning of the functions' names.
    """
    x, F = program.x, program.objective
    spectra = [constraint.spectral for constraint in program.constraints]
    # The C computes estimates of eigenvalues itself, from the entries of J: unrolled they would be megabytes.
    expressions = [SX(0) if each.spectral else each.expression for each in program.constraints]
    g = ca.vertcat(SX(0, 1), *expressions)
    # C is generated for one pose, and all of these constraints are on its J.
    matrix = next((each.matrix for each in spectra if each is not None), SX(0, 0))
    entries = ca.vec(matrix.T)
    lifted = [entries, ca.jacobian(entries, x).T] if entries.numel() else []
    gradient = ca.gradient(F, x)
    slopes = ca.jacobian(g, x).T
    weight, multipliers = SX.sym("weight"), SX.sym("multipliers", g.numel() + entries.numel())
    lagrangian = weight * F + ca.dot(multipliers, ca.vertcat(g, entries))
    inputs = {"curvature": [weight, multipliers]}
    outputs = {
        "F": [F],
        "F_gradient": [F, gradient],
        "jacobian": [program.robot.jacobian.T],
        "rates": [program.robot.rates],
        "limits": [g, slopes],
        "rotation": [program.robot.rotation.T],
        "derivatives": [F, gradient, g, slopes, *lifted],
        "curvature": [] if lifted else [ca.hessian(lagrangian, x)[0]],
        "magnitude": [ca.mmax(program.robot.magnitude)],
    }
    if lifted:
        # What ``limits`` returns is part of what ``derivatives`` returns; and the whole Hessian of J's entries would be
        # three times as much code as its product with a direction.
        del outputs["limits"]
        direction = SX.sym("direction", x.numel())
        outputs["curvature"] = [ca.jtimes(ca.gradient(lagrangian, x), x, direction)]
        inputs["curvature"].append(direction)
    dense = {name: [ca.densify(each) for each in expressions] for name, expressions in outputs.items()}
    rest, k, prepared = _extract(program.p, [each for expressions in dense.values() for each in expressions])
    functions = {}
    for name, expressions in dense.items():
        own, rest = rest[: len(expressions)], rest[len(expressions) :]
        functions[name] = ca.Function(f"{prefix}_{name}", [x, k, *inputs.get(name, [])], own)
    return StagedFunctions(ca.Function(f"{prefix}_prepare", [program.p], [prepared]), functions)


class _Extraction(NamedTuple):
    """Expressions of ``(x, k)``, the symbols ``k``, (count, 1), and their values as expressions of ``p`` alone."""

    expressions: list[SX]
    k: SX
    values: SX


def _extract(p: SX, expressions: Sequence[SX]) -> _Extraction:
    """Extract the parts of expressions that depend on ``p`` alone, with symbols in their place."""
    joined = ca.vertcat(SX(0, 1), *[ca.vec(each) for each in expressions])
    rest, symbols, parts = ca.extract_parametric(joined, p)
    # An argument that also stands beside variables, such as a component of a twist, is passed on in k as it is.
    left = [each for each, used in zip(ca.vertsplit(p), ca.which_depends(rest, p, 1, False), strict=True) if used]
    k, prepared = ca.vertcat(SX(0, 1), *left, *symbols), ca.vertcat(SX(0, 1), *left, *parts)
    replaced, at = [], 0
    for each in expressions:
        replaced.append(ca.reshape(rest[at : at + each.numel()], each.shape))
        at += each.numel()
    return _Extraction(replaced, k, prepared)
