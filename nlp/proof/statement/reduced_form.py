"""Standard forms without the unknowns of a robot that follow from dimensions and pose in closed form.

In home's working mode such an unknown is an expression of the others (:mod:`screwsynth.models.joints.elimination`). The
form keeps, in its place, the condition that the limb reaches the pose. What the equations used leave of the others is
kept, such as the freedoms that a limb takes from the platform; what is zero everywhere is left out, which never makes
the feasible set smaller. So does the range of an unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray, Substitution, frozen_array
from ....models.instance import sizes_at
from ....models.joints.elimination import Eliminated, eliminated
from ....models.joints.replacing import Solved, with_replaced
from ...program.layout import reference_of
from ...program.nlp import Nlp
from .form import Condition, Kind, Lift, StandardForm

#: Points of the box at which a condition is tested, and how many of them have to be within reach.
_TESTS, _LEAST = 24, 4
#: Largest value of a condition that is 0 everywhere: conditions of loops are of order 1.
_ZERO = 1e-10
#: Smallest reach of a limb, 1 at home, at points of the box, with which an unknown is replaced by a root.
_NEAR = 0.02
#: By how much the reach of a limb, 1 at home, may be exceeded: rounding.
_ROUNDING = 1e-12
_SEED = 0


class _Replaced(NamedTuple):
    """What replaces variables of a form.

    Attributes:
        solved: by the place of the variable.
        conditions: of what replaces them: reach, and the equation and side of variables that have two solutions.
        reaches: (r, 1) not negative where all limbs reach the poses.
        stated: names of the equations of the robot that these conditions state.
        edges: unknowns of each pose that have one solution at a point of the box at which limbs hardly reach the pose.
    """

    solved: dict[int, Solved]
    conditions: list[Condition]
    reaches: SX
    stated: set[str]
    edges: list[frozenset[int]]


def without_unknowns(form: StandardForm) -> StandardForm:
    """Return the form of a program that keeps to home's working mode without the unknowns that follow in closed form.

    It is the same form where none does. An unknown stays a variable where its two solutions meet in the box: roots have
    infinite slopes there.
    """
    nowhere = [frozenset[int]() for _ in form.nlp.program.robots]
    found = _replaced(form, nowhere)
    if any(found.edges):
        found = _replaced(form, found.edges)
    solved = found.solved
    kept, places = [i for i in range(form.n) if i not in solved], sorted(solved)
    if not solved or not kept:
        return form
    given = [each for each in form.conditions if not (each.is_of_joints and each.name in found.stated)]
    every = [*given, *found.conditions]
    expressions = [*form.functions, *[each.expression for each in every], found.reaches]
    *new, reaches = with_replaced([form.x], expressions, 0, solved)
    functions, rest = new[: len(form.functions)], new[len(form.functions) :]
    conditions = [replace(each, expression=expression) for each, expression in zip(every, rest, strict=True)]
    x = form.x[kept]
    lower, upper = (frozen_array(each[kept], (len(kept),)) for each in (form.lower, form.upper))
    may_go = [k for k, each in enumerate(given) if each.is_of_joints]
    signs = [each.expression for each in form.conditions if each.kind is Kind.ASSEMBLY]
    sides = [each.expression for each in found.conditions if not each.is_equation]
    return replace(
        form,
        x=x,
        lower=lower,
        upper=upper,
        functions=tuple(functions),
        conditions=tuple(conditions[k] for k in _left(x, lower, upper, conditions, may_go, reaches)),
        places=tuple(kept),
        lift=Lift(
            x=form.x,
            places=tuple(places),
            values=ca.vertcat(*[solved[i].value for i in places]),
            is_angle=tuple(form.nlp.program.variables[i].dimension is Dimension.ANGLE for i in places),
            ranges=(form.upper - form.lower)[places] / 2,
            signs=ca.vertcat(SX(0, 1), *signs, *sides),
        ),
    )


def _replaced(form: StandardForm, held: Sequence[frozenset[int]]) -> _Replaced:
    """Return what replaces unknowns of a form.

    Args:
        form: the form.
        held: indices of the unknowns, at each pose, that stay variables where they have two solutions.
    """
    nlp, program = form.nlp, form.nlp.program
    # The pose does not depend on an epigraph variable, which a form lacks.
    given = [ca.vertcat(form.x, SX.zeros(nlp.n - form.n)), SX(ca.DM(nlp.arguments))]
    found = _Replaced({}, [], SX(0, 1), set(), [])
    reaches: list[SX] = []
    for k, (robot, places) in enumerate(zip(program.robots, program.places.unknowns, strict=True)):
        where = f" pose {k + 1}" if len(program.robots) > 1 else ""
        pose = ca.Function("pose", [program.x, program.p], [robot.parameters, robot.rotation, robot.position])
        parameters, rotation, position = pose.call(given)
        numbers = [parameters, form.x[list(places)], rotation, position]
        of_roots: list[int] = []
        for each in eliminated(program.model, _numbers(rotation), held[k]):
            parts = _at_pose(nlp, each, numbers)
            name = program.model.unknowns[each.place].name + where
            if each.solved is not None:
                sine, cosine = (None, None) if each.solved.sine is None else parts[1:3]
                found.solved[places[each.place]] = Solved(parts[0], sine, cosine, SX(0))
            if each.root is None:
                continue
            of_roots.append(each.place)
            reaches.append(parts[3])
            if each.solved is None:
                found.stated.add(f"{each.root.equation}{where}")
                found.conditions.append(Condition(f"loop of {name}", parts[4], is_equation=True, kind=Kind.ASSEMBLY))
                found.conditions.append(Condition(f"side of {name}", -parts[5], is_equation=False, kind=Kind.ASSEMBLY))
            elif not parts[3].is_constant():
                reach = -parts[3] - _ROUNDING
                found.conditions.append(Condition(f"reach of {name}", reach, is_equation=False, kind=Kind.ASSEMBLY))
        found.edges.append(_edges(form, of_roots, reaches[len(reaches) - len(of_roots) :]))
    return found._replace(reaches=ca.vertcat(SX(0, 1), *reaches))


def _edges(form: StandardForm, unknowns: Sequence[int], reaches: Sequence[SX]) -> frozenset[int]:
    """Return the unknowns at whose reach (1, 1) the box has points, as far as random ones show it."""
    if not unknowns:
        return frozenset()
    function = ca.Function("reach", [form.x], [ca.densify(ca.vertcat(*reaches))])
    rng = np.random.default_rng(_SEED)
    shares = rng.uniform(0, 1, (_TESTS, form.n))
    shares[_TESTS // 2 :] = np.round(shares[_TESTS // 2 :])
    values = np.array([function(form.lower + each * (form.upper - form.lower)).full().ravel() for each in shares])
    least = np.nan_to_num(values, nan=-np.inf).min(axis=0)
    return frozenset(k for k, value in zip(unknowns, least, strict=True) if value < _NEAR)


def _at_pose(nlp: Nlp, each: Eliminated, given: list[SX]) -> list[SX]:
    """Return value, sine, cosine, reach, equation and slope of an unknown at a robot's dimensions and pose.

    Those that the unknown does not have are 0.
    """
    symbols = Substitution.identity(nlp.program.model).all
    solved, root = each.solved, each.root
    parts = [None] * 3 if solved is None else [solved.value, solved.sine, solved.cosine]
    parts += [None] * 3 if root is None else [root.reach * _at_size(nlp, each.place), root.value, root.slope]
    outputs = [SX(0) if part is None else part for part in parts]
    return list(ca.Function("unknown", symbols, outputs).call(given))


def _at_size(nlp: Nlp, place: int) -> float:
    """Return the factor of a limb's reach by an unknown, 1 at home with typical dimensions, in the size of a case.

    The reach of a slide is one over the square of a length.
    """
    model, unknown = nlp.program.model, nlp.program.model.unknowns[place]
    if unknown.dimension is Dimension.ANGLE:
        return 1.0
    typical = tuple(value for item in model.parameters for value in item.typical)
    case, home = (float(sizes_at(model, [unknown], each, SX.ones(1))) for each in (reference_of(nlp.case), typical))
    return (case / home) ** 2


def _numbers(expression: SX) -> tuple[float, ...] | None:
    """Return the numbers of an expression, column by column; None where it depends on symbols."""
    return tuple(ca.DM(expression).full().ravel(order="F").tolist()) if expression.is_constant() else None


def _left(
    x: SX, lower: FloatArray, upper: FloatArray, conditions: Sequence[Condition], may_go: Sequence[int], reaches: SX
) -> list[int]:
    """Return the indices of conditions without some of those that hold wherever the limbs reach the pose.

    They are found at random points of the box. One left out by mistake would make the feasible set larger, and so the
    bound, but not wrong.

    Args:
        x: (n,) symbols of the form's variables.
        lower: (n,) lower ends of the box.
        upper: (n,) upper ends.
        conditions: all of them.
        may_go: indices of those that may be left out.
        reaches: (r, 1) not negative where all limbs reach the poses.
    """
    every = ca.vertcat(*[each.expression for each in conditions], reaches)
    function = ca.Function("conditions", [x], [ca.densify(every)])
    rng = np.random.default_rng(_SEED)
    values = np.array([function(rng.uniform(lower, upper)).full().ravel() for _ in range(_TESTS)])
    values = values[np.all(values[:, len(conditions) :] >= 0, axis=1)]
    left = set(range(len(conditions)))
    for k in may_go:
        own = np.abs(values[:, k]) if conditions[k].is_equation else values[:, k]
        if len(own) >= _LEAST and bool(np.all(own <= _ZERO)):
            left.remove(k)
    return sorted(left)
