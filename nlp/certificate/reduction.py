"""Standard forms without the unknowns of a robot that follow from dimensions and pose in closed form.

In home's working mode such an unknown is an expression of the others (:mod:`screwsynth.models.joints.elimination`). The
form keeps, in its place, the condition that the limb reaches the pose. What the equations used leave of the others is
kept, such as the freedoms that a limb takes from the platform; what is zero everywhere is left out, which never makes
the feasible set smaller. So does the range of an unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, Substitution, frozen_array
from ...models.joints.elimination import Eliminated, eliminated
from ...models.joints.replacing import Solved, with_replaced
from ..program.nlp import Nlp
from .lift import Lift
from .standardform import Condition, StandardForm

#: Points of the box at which a condition is tested, and how many of them have to be within reach.
_TESTS, _LEAST = 24, 4
#: Largest value of a condition that is 0 everywhere: conditions of loops are of order 1.
_ZERO = 1e-10
#: By how much the reach of a limb, 1 at home, may be exceeded: rounding.
_ROUNDING = 1e-12
_SEED = 0


def without_unknowns(form: StandardForm, assembly: Sequence[Condition]) -> StandardForm:
    """Return a form without the unknowns that follow in closed form; the same form where none does.

    Args:
        form: the form of a program that keeps to home's working mode.
        assembly: those of its conditions that state how joints hold together.
    """
    solved, reaches = _solved(form)
    if not solved:
        return form
    program, count = form.nlp.program, form.n
    kept = [i for i in range(count) if i not in solved]
    if not kept:
        return form
    own = {id(each) for each in assembly}
    expressions = [*form.functions, *[each.expression for each in form.conditions]]
    found = with_replaced([form.x], expressions, 0, solved)
    functions, rest = found[: len(form.functions)], found[len(form.functions) :]
    conditions = [
        (replace(each, expression=expression), id(each) in own)
        for each, expression in zip(form.conditions, rest, strict=True)
    ]
    x = form.x[kept]
    lower, upper = (frozen_array(each[kept], (len(kept),)) for each in (form.lower, form.upper))
    left = _without_identities(x, lower, upper, conditions, reaches)
    replaced = {id(each): new for each, (new, _) in zip(form.conditions, conditions, strict=True)}
    signs = [replaced[id(each)] for each in form.signs]
    places = sorted(solved)
    dimensions = [program.variables[i].dimension is Dimension.ANGLE for i in places]
    return replace(
        form,
        x=x,
        lower=lower,
        upper=upper,
        functions=tuple(functions),
        conditions=(*left, *reaches),
        signs=tuple(each for each in signs if any(each is other for other in left)),
        places=tuple(kept),
        lift=Lift(
            x=form.x,
            kept=tuple(kept),
            places=tuple(places),
            values=ca.vertcat(*[solved[i].value for i in places]),
            is_angle=tuple(dimensions),
            ranges=(form.upper - form.lower)[places] / 2,
            signs=ca.vertcat(SX(0, 1), *[each.expression for each in form.signs]),
        ),
    )


def _solved(form: StandardForm) -> tuple[dict[int, Solved], list[Condition]]:
    """Return what replaces variables of a form, by their places, and the conditions that limbs reach the poses."""
    nlp, program = form.nlp, form.nlp.program
    # The pose does not depend on an epigraph variable, which a form lacks.
    whole = ca.vertcat(form.x, SX.zeros(nlp.n - form.n))
    given = [whole, SX(ca.DM(nlp.arguments))]
    solved: dict[int, Solved] = {}
    reaches: list[Condition] = []
    for k, (robot, places) in enumerate(zip(program.robots, program.places.unknowns, strict=True)):
        where = f" pose {k + 1}" if len(program.robots) > 1 else ""
        pose = ca.Function("pose", [program.x, program.p], [robot.parameters, robot.rotation, robot.position])
        parameters, rotation, position = pose.call(given)
        fixed = _number(rotation)
        for each in eliminated(program.model, fixed):
            parts = _at_pose(nlp, each, [parameters, SX.zeros(len(places)), rotation, position])
            solved[places[each.index]] = Solved(parts[0], parts[1], parts[2], SX(0))
            if each.reach is not None and not parts[3].is_constant():
                name = f"reach of {program.model.unknowns[each.index].name}{where}"
                reaches.append(Condition(name, -parts[3] - _ROUNDING, is_equation=False))
    return solved, reaches


def _at_pose(nlp: Nlp, each: Eliminated, given: list[SX]) -> list[SX | None]:
    """Return value, sine, cosine and reach of an unknown at a robot's dimensions and pose."""
    symbols = Substitution.identity(nlp.program.model).all
    parts = [each.solved.value, each.solved.sine, each.solved.cosine, each.reach]
    function = ca.Function("unknown", symbols, [SX(0) if part is None else part for part in parts])
    return [None if part is None else new for part, new in zip(parts, function.call(given), strict=True)]


def _number(expression: SX) -> FloatArray | None:
    """Return the value of an expression; None where it depends on symbols."""
    return np.asarray(ca.DM(expression).full(), dtype=np.float64) if expression.is_constant() else None


def _without_identities(
    x: SX,
    lower: FloatArray,
    upper: FloatArray,
    conditions: Sequence[tuple[Condition, bool]],
    reaches: Sequence[Condition],
) -> list[Condition]:
    """Return conditions without those of the assembly that hold wherever the limbs reach the pose.

    They are found at random points of the box. One left out by mistake would make the feasible set larger, and so the
    bound, but not wrong.
    """
    every = ca.vertcat(*[each.expression for each, _ in conditions], *[each.expression for each in reaches])
    function = ca.Function("conditions", [x], [ca.densify(every)])
    rng = np.random.default_rng(_SEED)
    values = np.array([function(rng.uniform(lower, upper)).full().ravel() for _ in range(_TESTS)])
    values = values[np.all(values[:, len(conditions) :] <= 0, axis=1)]
    left = []
    for k, (each, is_own) in enumerate(conditions):
        own = np.abs(values[:, k]) if each.is_equation else values[:, k]
        holds = bool(np.all(own <= _ZERO)) and len(own) >= _LEAST
        if not (is_own and holds):
            left.append(each)
    return left
