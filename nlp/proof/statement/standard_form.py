"""Standard form of a program for the search of its whole box: maximise the least of some functions under conditions.

    maximise  min_j phi_j(x)   over  lower <= x <= upper,   h_k(x) <= 0 or h_k(x) = 0

A minimum becomes a maximum of ``-F``. The worst case of several tasks is an epigraph in the program: a variable
``level`` with one constraint for each task. Here it is the least of the tasks' own functions again, without that
variable. The program's arguments are put in as doubles, and a proof is about the graph with these constants.

A limit on the smallest singular value is one on an estimate of the smallest eigenvalue of ``A = J'J`` that takes
thousands of operations. An enclosure of it is of use on small boxes alone. The estimate is from below, so that where it
is at least ``s^2``

    M = A - s^2 I   has no negative eigenvalue.

So no principal minor of M is negative. Minors are polynomials in J, whose terms cancel in forms of second order. By
interlacing a box with two eigenvalues of M below 0, where the determinant is positive, has smaller minors that are
negative. A limit c on the condition number has the like, with ``A_ii / c^2`` in the place of ``s^2``: the largest
eigenvalue is at most ``c^2`` times the smallest one, and no entry ``A_ii`` is larger. The largest entry of one point is
taken, which is the eigenvalue itself where the motion i is a principal one, as of many robots at symmetric poses.

In home's working mode an unknown that follows from dimensions and pose in closed form is an expression of the others
(:mod:`screwsynth.models.joints.model.elimination`). The form keeps, in its place, the condition that the limb reaches
the pose. The remaining equations are kept, such as those of the freedoms that a limb takes from the platform. Equations
that are zero everywhere and the range of an unknown are left out, which never makes the feasible set smaller.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray, Substitution, frozen_array
from ....models.instance import sizes_at
from ....models.joints.model.elimination import Eliminated, eliminated
from ....models.joints.model.replacing import Solved, with_replaced
from ...case.limits.constraint import End
from ...evidence.state import CLOSED
from ...program.layout import reference_of
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from .form import Condition, Kind, Lift, StandardForm

__all__ = ["Condition", "Kind", "StandardForm", "is_in_home_mode", "standard_form"]

#: Orders of the principal minors. Those of 4 and 5 exclude boxes twice as wide as the determinant alone; smaller ones
#: gain nothing more, as few poses have so many small singular values.
_ORDERS: tuple[int, ...] = (4, 5, 6)
#: Those for condition numbers, whose bound of the largest eigenvalue is no number, and part by which two of its entries
#: are one but for rounding.
_ORDERS_OF_RATIO, _SAME = (1, 2, 3, 4), 1e-9
#: Part of itself by which s^2 is smaller than stated: rounding of its numbers.
_ROUNDING = 1e-9
_SIZE = 6
#: Points of the box at which a condition is tested, and how many of them have to be within reach.
_TESTS, _LEAST = 24, 4
#: Largest value of a condition that is 0 everywhere: conditions of loops are of order 1.
_ZERO = 1e-10
#: Smallest reach of a limb, 1 at home, at points of the box, with which an unknown is replaced by a root.
_NEAR = 0.02
#: By how much the reach of a limb, 1 at home, may be exceeded: rounding.
_BEYOND = 1e-12
_SEED = 0


def standard_form(nlp: Nlp) -> StandardForm:
    """Return the standard form of a program with at least one variable."""
    nlp = with_all_pairs(nlp)
    program = nlp.program
    x, arguments = SX.sym("x", nlp.n), SX(ca.DM(nlp.arguments))
    F, g = program.values.call([x, arguments])
    epigraph = program.places.epigraph
    count = nlp.n if epigraph is None else epigraph.level
    loops = {f"{each.name}{where}" for each in program.model.closure for where in _ends_of_names(nlp)}
    functions: list[SX] = [-nlp.sign * F] if epigraph is None else []
    stated: list[Condition] = []
    for k, each in enumerate(program.constraints):
        if epigraph is not None and each in epigraph.constraints:
            functions.append(_function_of_epigraph(g[k], x[epigraph.level], nlp.sign))
        else:
            kind = Kind.LOOP if each.name in loops else Kind.LIMIT
            stated += _conditions(each.name, g[k], float(nlp.g_lower[k]), float(nlp.g_upper[k]), kind)
    found = [*_of_singular_values(nlp), *_of_joints(nlp)]
    # Numbers take the place of arguments; what then depends on no variable says nothing of a robot's joints.
    values = ca.Function("values", [program.x, program.p], [each.expression for each in found]).call([x, arguments])
    numbered = [replace(each, expression=value) for each, value in zip(found, values, strict=True)]
    stated += [each for each in numbered if not each.is_of_joints or any(ca.which_depends(each.expression, x, 1, True))]
    form = StandardForm(
        nlp=nlp,
        x=x[:count],
        lower=frozen_array(nlp.lower[:count], (count,)),
        upper=frozen_array(nlp.upper[:count], (count,)),
        functions=tuple(functions),
        conditions=tuple(stated),
    )
    return without_unknowns(form) if nlp.in_home_mode else form


def is_in_home_mode(nlp: Nlp, x: FloatArray) -> bool | None:
    """Return whether a robot is in home's working mode at a point (n,); None where it has no sign of a mode."""
    if not nlp.n or not any(each.is_mode for each in nlp.program.model.signs):
        return None
    return standard_form(replace(nlp, in_home_mode=True)).keeps_signs(x)


def _ends_of_names(nlp: Nlp) -> list[str]:
    """Return the end of the names of constraints of each pose."""
    count = len(nlp.program.robots)
    return [f" pose {k + 1}" for k in range(count)] if count > 1 else [""] * count


def _function_of_epigraph(expression: SX, level: SX, sign: float) -> SX:
    """Return the function that bounds the level in a constraint ``expression >= 0``, which is linear in the level.

    Of one that is linear in the square of the level, it is the function that bounds the square.
    """
    without = ca.substitute(expression, level, 0)
    slope = ca.jacobian(expression, level)
    slope = slope if not ca.depends_on(slope, level) else ca.substitute(slope, level, 0.5)
    # Maximum: level <= -without / slope, slope < 0. Minimum: level >= -without / slope, slope > 0; negated.
    return -without / slope if sign < 0 else without / slope


def _conditions(name: str, expression: SX, low: float, high: float, kind: Kind) -> Iterator[Condition]:
    """Yield an equation for equal bounds, else an inequality for each finite bound."""
    if low == high:
        yield Condition(name, expression - low, is_equation=True, kind=kind)
        return
    if np.isfinite(high):
        yield Condition(name, expression - high, is_equation=False, kind=kind)
    if np.isfinite(low):
        yield Condition(name, low - expression, is_equation=False, kind=kind)


def _of_joints(nlp: Nlp) -> Iterator[Condition]:
    """Yield conditions of a robot's joints beside the program's constraints, in its symbols.

    First the loop equations that the program leaves out, and distances that follow, with bounds of a closed loop. They
    follow from those of the program near its answer, but not in the whole box: there joints that are assembled in no
    way at all may fulfil the program's equations. Numbers in the place of arguments leave rounding error in them, so
    that an exact equation could hold nowhere. Then the signs of the assembly: where joints do not hold together it is
    no robot. Those of home's working mode count where the program says so.
    """
    model, names = nlp.program.model, {constraint.name for constraint in nlp.program.constraints}
    poses = list(zip(_ends_of_names(nlp), nlp.program.robots, strict=True))
    for where, robot in poses:
        values = [*ca.vertsplit(robot.closure), *ca.vertsplit(robot.distances)]
        for equation, value in zip((*model.closure, *model.distances), values, strict=True):
            if f"{equation.name}{where}" not in names:
                yield from _conditions(f"{equation.name}{where}", value, -CLOSED, CLOSED, Kind.LOOP)
    for where, robot in poses:
        for sign, value in zip(model.signs, ca.vertsplit(robot.signs), strict=True):
            if nlp.in_home_mode or not sign.is_mode:
                yield Condition(f"{sign.name}{where}", -value, is_equation=False, kind=Kind.ASSEMBLY)


def _of_singular_values(nlp: Nlp) -> Iterator[Condition]:
    """Yield conditions on the minors that follow from limits on singular values of J, in its symbols."""
    limits = zip(nlp.program.constraints, nlp.g_lower.tolist(), nlp.g_upper.tolist(), strict=True)
    for constraint, lower, upper in limits:
        spectral = constraint.spectral
        if spectral is None:
            continue
        J = spectral.matrix @ ca.diag(SX([1, 1, 1, *[1 / spectral.length] * 3]))
        A, least, orders = J.T @ J, SX(lower), _ORDERS
        if spectral.end is End.MINUS_RATIO and upper < 0:
            largest = _largest_at_start(nlp, ca.diag(A))
            least, orders = -upper * A[largest, largest], _ORDERS_OF_RATIO
        elif spectral.end is not End.SMALLEST or not (np.isfinite(lower) and lower > 0):
            continue
        for chosen, minor in _principal_minors(A - (1 - _ROUNDING) * least * SX.eye(_SIZE), orders):
            name = f"{constraint.name} minor {''.join(str(k + 1) for k in chosen)}"
            yield Condition(name, -minor, is_equation=False, kind=Kind.FOLLOWS)


def _largest_at_start(nlp: Nlp, values: SX) -> int:
    """Return the index of the largest of some expressions (k, 1) of a program at its start; of the first of several."""
    program = nlp.program
    found = ca.Function("values", [program.x, program.p], [ca.densify(values)])(nlp.start, nlp.arguments)
    sizes = np.nan_to_num(np.array(found).ravel())
    return int(np.argmax(sizes > sizes.max() * (1 - _SAME)))


def _principal_minors(A: SX, orders: Sequence[int]) -> Iterator[tuple[tuple[int, ...], SX]]:
    """Yield the places and values of principal minors, by expansion along rows, each minor computed once."""

    @cache
    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> SX:
        first, *others = rows
        if not others:
            return A[first, columns[0]]
        terms = [
            (-1) ** k * A[first, column] * minor(tuple(others), columns[:k] + columns[k + 1 :])
            for k, column in enumerate(columns)
        ]
        return sum(terms, SX(0))

    for order in orders:
        for chosen in combinations(range(_SIZE), order):
            yield chosen, minor(chosen, chosen)


class _Replaced(NamedTuple):
    """What replaces variables of a form.

    Attributes:
        solved: the expressions, by the place of the variable.
        conditions: reach, and the equation and side of variables that have two solutions and stay.
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
    lower, upper = (frozen_array(each[kept], (len(kept),)) for each in (form.lower, form.upper))
    signs = [each.expression for each in form.conditions if each.kind is Kind.ASSEMBLY]
    sides = [each.expression for each in found.conditions if not each.is_equation]
    lift = Lift(
        x=form.x,
        places=tuple(places),
        values=ca.vertcat(*[solved[i].value for i in places]),
        is_angle=tuple(form.nlp.program.variables[i].dimension is Dimension.ANGLE for i in places),
        ranges=(form.upper - form.lower)[places] / 2,
        signs=ca.vertcat(SX(0, 1), *signs, *sides),
    )
    reduced = StandardForm(
        form.nlp, form.x[kept], lower, upper, tuple(functions), tuple(conditions), places=tuple(kept), lift=lift
    )
    idle = _idle(reduced, [k for k, each in enumerate(given) if each.is_of_joints], reaches)
    return replace(reduced, conditions=tuple(each for k, each in enumerate(conditions) if k not in idle))


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
    poses = zip(_ends_of_names(nlp), program.robots, program.places.unknowns, held, strict=True)
    for where, robot, places, stay in poses:
        pose = ca.Function("pose", [program.x, program.p], [robot.parameters, robot.rotation, robot.position])
        parameters, rotation, position = pose.call(given)
        numbers = [parameters, form.x[list(places)], rotation, position]
        of_roots, begin = list[int](), len(reaches)
        for each in eliminated(program.model, _numbers(rotation), stay):
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
                lacking = -parts[3] - _BEYOND
                found.conditions.append(Condition(f"reach of {name}", lacking, is_equation=False, kind=Kind.ASSEMBLY))
        found.edges.append(_edges(form, of_roots, reaches[begin:]))
    return found._replace(reaches=ca.vertcat(SX(0, 1), *reaches))


def _edges(form: StandardForm, unknowns: Sequence[int], reaches: Sequence[SX]) -> frozenset[int]:
    """Return the unknowns at whose reach (1, 1) the box has points, as far as random ones show it."""
    shares = np.random.default_rng(_SEED).uniform(0, 1, (_TESTS, form.n))
    shares[_TESTS // 2 :] = np.round(shares[_TESTS // 2 :])
    values = _values_at(form.x, reaches, form.lower + shares * (form.upper - form.lower))
    least = np.nan_to_num(values, nan=-np.inf).min(axis=0)
    return frozenset(k for k, value in zip(unknowns, least, strict=True) if value < _NEAR)


def _values_at(x: SX, expressions: Sequence[SX], points: FloatArray) -> FloatArray:
    """Return the values (P, R) of expressions of x at points (P, n)."""
    function = ca.Function("values", [x], [ca.densify(ca.vertcat(SX(0, 1), *expressions))])
    return np.array([function(point).full().ravel() for point in points])


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
    typical = tuple(model.typical.tolist())
    case, home = (float(sizes_at(model, [unknown], each, SX.ones(1))) for each in (reference_of(nlp.case), typical))
    return (case / home) ** 2


def _numbers(expression: SX) -> tuple[float, ...] | None:
    """Return the numbers of an expression, column by column; None where it depends on symbols."""
    return tuple(ca.DM(expression).full().ravel(order="F").tolist()) if expression.is_constant() else None


def _idle(form: StandardForm, may_go: Sequence[int], reaches: SX) -> set[int]:
    """Return the indices of some conditions that hold wherever reaches (r, 1) are not negative, at random points.

    One that is left out by mistake would make the feasible set larger, and so the bound, but not wrong.
    """
    conditions = form.conditions
    points = np.random.default_rng(_SEED).uniform(form.lower, form.upper, (_TESTS, form.n))
    values = _values_at(form.x, [*(each.expression for each in conditions), reaches], points)
    values = values[np.all(values[:, len(conditions) :] >= 0, axis=1)]
    sizes = [np.abs(own) if each.is_equation else own for each, own in zip(conditions, values.T, strict=False)]
    return {k for k in may_go if len(values) >= _LEAST and bool(np.all(sizes[k] <= _ZERO))}
