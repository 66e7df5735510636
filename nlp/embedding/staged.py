"""A program's functions in two stages: what depends on the fixed numbers alone, once, and the rest at every point.

A controller changes the task or a dimension now and then and the point always; sines of fixed angles and the like must
not be computed at every point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from ..program.program import Program


@dataclass(frozen=True, eq=False)
class Staged:
    """Functions in two stages.

    Attributes:
        prepare: ``p -> k``, the (count, 1) numbers that depend on the arguments alone.
        functions: by name, of ``(x, k)`` and of further inputs where they have some; all results dense.
    """

    prepare: ca.Function
    functions: Mapping[str, ca.Function]

    @property
    def all(self) -> tuple[ca.Function, ...]:
        """Every function, the first stage first."""
        return (self.prepare, *self.functions.values())


def stage(program: Program, prefix: str) -> Staged:
    """The functions that a program's embedding calls.

    * ``F``, ``F_gradient``: the objective, and with its gradient;
    * ``jacobian``, ``rates``, ``rotation``: the robot's;
    * ``limits``: constraints, and their gradients;
    * ``derivatives``: objective, gradient, constraints, their gradients;
    * ``curvature``: also of a weight and multipliers, the Hessian of ``weight * F + multipliers . g``;
    * ``magnitude``: what the objective would be without cancellation.

    Matrices are transposed: C then has them row after row.

    Args:
        program: the program.
        prefix: of the functions' names.
    """
    x, F, g = program.x, program.objective, program.g
    gradient = ca.gradient(F, x)
    slopes = ca.jacobian(g, x).T
    weight, multipliers = SX.sym("weight"), SX.sym("multipliers", g.numel())
    curvature = ca.hessian(weight * F + ca.dot(multipliers, g), x)[0]
    outputs = {
        "F": [F],
        "F_gradient": [F, gradient],
        "jacobian": [program.robot.jacobian.T],
        "rates": [program.robot.rates],
        "limits": [g, slopes],
        "rotation": [program.robot.rotation.T],
        "derivatives": [F, gradient, g, slopes],
        "curvature": [curvature],
        "magnitude": [ca.mmax(program.robot.magnitude)],
    }
    inputs = {"curvature": [weight, multipliers]}
    dense = {name: [ca.densify(each) for each in expressions] for name, expressions in outputs.items()}
    replaced, k, prepared = _without(program.p, [each for expressions in dense.values() for each in expressions])
    functions = {}
    for name, expressions in dense.items():
        own, replaced = replaced[: len(expressions)], replaced[len(expressions) :]
        functions[name] = ca.Function(f"{prefix}_{name}", [x, k, *inputs.get(name, [])], own)
    return Staged(ca.Function(f"{prefix}_prepare", [program.p], [prepared]), functions)


def _without(p: SX, expressions: Sequence[SX]) -> tuple[list[SX], SX, SX]:
    """Expressions with everything that depends on ``p`` alone replaced by symbols: them, the symbols, what they are."""
    joined = ca.vertcat(SX(0, 1), *[ca.vec(each) for each in expressions])
    rest, symbols, parts = ca.extract_parametric(joined, p)
    # What occurs beside variables only, such as a component of a twist, is left as it is.
    left = [each for each, used in zip(ca.vertsplit(p), ca.which_depends(rest, p, 1, False), strict=True) if used]
    k, prepared = ca.vertcat(SX(0, 1), *left, *symbols), ca.vertcat(SX(0, 1), *left, *parts)
    replaced, at = [], 0
    for each in expressions:
        replaced.append(ca.reshape(rest[at : at + each.numel()], each.shape))
        at += each.numel()
    return replaced, k, prepared
