"""Standard form of a nonlinear program for global searches: maximise the smallest of some functions under conditions.

    maximise  min_j phi_j(x)   over  lower <= x <= upper,   h_k(x) <= 0 or h_k(x) = 0

A minimum becomes a maximum of ``-F``. The nonlinear program states the worst case of several tasks by an epigraph: a
variable ``level`` with one constraint for each task. The standard form has the smallest of the tasks' functions
instead, without ``level``. The program's arguments become double constants; a proof is about the expression graph with
these constants.

A limit on the smallest singular value is a limit on an estimate of the smallest eigenvalue of ``A = J'J`` with
thousands of operations. Its enclosure is useful only on small boxes. The estimate is a lower bound; if it is at least
``s^2``,

    M = A - s^2 I   has no negative eigenvalue.

So no principal minor of M is negative. Minors are polynomials in J with terms that cancel in second-order forms. If two
eigenvalues of M are negative in a box, the determinant is positive, but smaller minors are negative, by interlacing.
A limit c on the condition number gives the same conditions with ``A_ii / c^2`` in place of ``s^2``: the largest
eigenvalue is at most ``c^2`` times the smallest one, and every entry ``A_ii`` is at most the largest eigenvalue. i is
the index of the largest entry at one point; the entry equals the largest eigenvalue if motion i is a principal motion,
as for many robots at symmetric poses.

In the home working mode, closed forms replace unknowns that follow from dimensions and pose
(:mod:`screwsynth.models.joints.model.elimination`). The form has the condition that the limb reaches the pose instead.
The remaining equations are kept, such as those for degrees of freedom that a limb removes. Equations that are zero
everywhere and ranges of unknowns are left out, which never makes the feasible set smaller.
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

#: Orders of the principal minors. Minors of order 4 and 5 exclude boxes twice as wide as the determinant does; smaller
#: minors exclude few more, as few poses have so many small singular values.
_ORDERS: tuple[int, ...] = (4, 5, 6)
#: Orders for condition numbers, for which the bound of the largest eigenvalue is an expression; and relative difference
#: of two entries that counts as rounding.
_ORDERS_OF_RATIO, _SAME = (1, 2, 3, 4), 1e-9
#: Relative reduction of s^2, for rounding.
_ROUNDING = 1e-9
_SIZE = 6
#: Number of points of the box at which a condition is tested, and least number of them within reach.
_TESTS, _LEAST = 24, 4
#: Largest value of a condition that counts as 0; loop conditions are scaled to values of about 1.
_ZERO = 1e-10
#: Smallest reach of a limb (scaled to 1 at home) at points of the box, for which a root replaces an unknown.
_NEAR = 0.02
#: Violation of a limb's reach (scaled to 1 at home) that counts as rounding.
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
    # Arguments become constants; a condition that then depends on no variable is dropped.
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
    """Return whether a robot is in the home working mode at a point (n,); None if no sign distinguishes its modes."""
    if not nlp.n or not any(each.is_mode for each in nlp.program.model.signs):
        return None
    return standard_form(replace(nlp, in_home_mode=True)).keeps_signs(x)


def _ends_of_names(nlp: Nlp) -> list[str]:
    """Return the suffix of the names of each pose's constraints."""
    count = len(nlp.program.robots)
    return [f" pose {k + 1}" for k in range(count)] if count > 1 else [""] * count


def _function_of_epigraph(expression: SX, level: SX, sign: float) -> SX:
    """Return the function that bounds the level in a constraint ``expression >= 0`` that is linear in the level.

    If the constraint is linear in the square of the level, the function bounds the square.
    """
    without = ca.substitute(expression, level, 0)
    slope = ca.jacobian(expression, level)
    slope = slope if not ca.depends_on(slope, level) else ca.substitute(slope, level, 0.5)
    # Maximum: level <= -without / slope, slope < 0. Minimum: level >= -without / slope, slope > 0; negated.
    return -without / slope if sign < 0 else without / slope


def _conditions(name: str, expression: SX, low: float, high: float, kind: Kind) -> Iterator[Condition]:
    """Yield the conditions of a constraint: an equation for equal bounds, or an inequality for each finite bound."""
    if low == high:
        yield Condition(name, expression - low, is_equation=True, kind=kind)
        return
    if np.isfinite(high):
        yield Condition(name, expression - high, is_equation=False, kind=kind)
    if np.isfinite(low):
        yield Condition(name, low - expression, is_equation=False, kind=kind)


def _of_joints(nlp: Nlp) -> Iterator[Condition]:
    """Yield conditions on a robot's joints in addition to the program's constraints, in its symbols.

    First come loop equations that the program omits, and distance equations that follow from these, with a tolerance
    for rounding. Near a solution they follow from the program's equations. Elsewhere in the box, joints that do not
    fit together may satisfy the program's equations. Then come the signs of the assembly mode; signs of the home
    working mode count if the program requires it.
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
    """Return the index of the largest of some expressions (k, 1) of a program at its start; the first of equal ones."""
    program = nlp.program
    found = ca.Function("values", [program.x, program.p], [ca.densify(values)])(nlp.start, nlp.arguments)
    sizes = np.nan_to_num(np.array(found).ravel())
    return int(np.argmax(sizes > sizes.max() * (1 - _SAME)))


def _principal_minors(A: SX, orders: Sequence[int]) -> Iterator[tuple[tuple[int, ...], SX]]:
    """Yield the indices and values of principal minors, by expansion along rows; each minor is computed once."""

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
    """Closed forms for unknowns of a form, with the conditions that replace their loop equations.

    Attributes:
        solved: closed forms, by index of the variable.
        conditions: conditions on the reach; and, for unknowns with two solutions that stay variables, their equation
            and the sign of their solution.
        reaches: (r, 1) expressions; they are not negative where all limbs reach the poses.
        stated: names of the loop equations that these conditions replace.
        edges: unknowns of each pose whose two solutions coincide somewhere in the box, because a limb hardly reaches
            the pose there.
    """

    solved: dict[int, Solved]
    conditions: list[Condition]
    reaches: SX
    stated: set[str]
    edges: list[frozenset[int]]


def without_unknowns(form: StandardForm) -> StandardForm:
    """Return a form in the home working mode with closed forms in place of unknowns.

    The form is unchanged if no unknown has a closed form. An unknown stays a variable if its two solutions meet in the
    box, where roots have infinite slopes.
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
    """Return the closed forms for unknowns of a form.

    Args:
        form: the form.
        held: indices, for each pose, of the unknowns that stay variables if they have two solutions.
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
    """Return the unknowns whose reach (1, 1) is at its boundary at some random point of the box."""
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

    An entry that does not exist for the unknown is 0.
    """
    symbols = Substitution.identity(nlp.program.model).all
    solved, root = each.solved, each.root
    parts = [None] * 3 if solved is None else [solved.value, solved.sine, solved.cosine]
    parts += [None] * 3 if root is None else [root.reach * _at_size(nlp, each.place), root.value, root.slope]
    outputs = [SX(0) if part is None else part for part in parts]
    return list(ca.Function("unknown", symbols, outputs).call(given))


def _at_size(nlp: Nlp, place: int) -> float:
    """Return the factor that scales the reach of a limb with an unknown to 1 at home, for typical dimensions.

    The reach of a slide is scaled by the square of a length.
    """
    model, unknown = nlp.program.model, nlp.program.model.unknowns[place]
    if unknown.dimension is Dimension.ANGLE:
        return 1.0
    typical = tuple(model.typical.tolist())
    case, home = (float(sizes_at(model, [unknown], each, SX.ones(1))) for each in (reference_of(nlp.case), typical))
    return (case / home) ** 2


def _numbers(expression: SX) -> tuple[float, ...] | None:
    """Return the values of a constant expression, column by column; None if it depends on symbols."""
    return tuple(ca.DM(expression).full().ravel(order="F").tolist()) if expression.is_constant() else None


def _idle(form: StandardForm, may_go: Sequence[int], reaches: SX) -> set[int]:
    """Return the indices of conditions that hold at all random points within reach, where ``reaches`` (r, 1) are >= 0.

    A condition that is left out by mistake makes the feasible set larger and the bound weaker, but not wrong.
    """
    conditions = form.conditions
    points = np.random.default_rng(_SEED).uniform(form.lower, form.upper, (_TESTS, form.n))
    values = _values_at(form.x, [*(each.expression for each in conditions), reaches], points)
    values = values[np.all(values[:, len(conditions) :] >= 0, axis=1)]
    sizes = [np.abs(own) if each.is_equation else own for each, own in zip(conditions, values.T, strict=False)]
    return {k for k in may_go if len(values) >= _LEAST and bool(np.all(sizes[k] <= _ZERO))}
