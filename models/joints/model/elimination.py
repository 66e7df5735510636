"""Elimination of unknowns: closed forms from a robot's loop equations, one after the other.

The equations of a limb are those of its loop, its distances, and the component of its loop's gap along each joint axis.
A rotation changes neither a distance from its axis nor a gap along it, so many of these equations have one unknown less
than the gap. An unknown follows from one equation, or from the three of the gap:

* an angle from ``A cos t + B sin t = D``, a slide from ``c0 + c1 q + c2 q^2 = 0``: of two solutions, the one of the
home working mode, for which the derivative of the equation has the same sign as at home; only for limbs with a known
sign of the working mode;
* an angle from ``a cos t + b sin t + c = 0`` with perpendicular vectors a and b of equal length, ``cos t = -a.c / a.a``
  and ``sin t = -b.c / b.b``; a slide from ``a q + c = 0``: one solution.

A closed form depends on dimensions, pose and free actuator coordinates, and on no other unknown. It is identified from
an equation at a few values of the unknown, and tested at random dimensions and poses near home: analytic expressions
that agree there agree everywhere. Roots are written ``sqrt(max(v, 0))``, so that they have values beyond the edge of
the reach; a search excludes such points by ``v >= 0``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ... import Dimension, FloatArray, Model, Substitution, Unknown
from ...instance import joint_sizes, length_of
from .replacing import Solved, at_turn, with_replaced

#: Largest relative difference of both sides of an identity at random values: rounding.
_SAME = 1e-9
#: Number of points at which identities are tested, and their distance from home, relative to the dimensions and the
#: robot's size and in radians: far enough for other expressions to differ, near enough for limbs to reach them.
_TESTS, _SPREAD = 4, 0.02
#: Relative value below which a coefficient or a derivative is 0 at home: home is then at the boundary of the reach.
_EDGE = 1e-6
_SEED = 0
#: Number of cached results: a certificate needs those of one robot several times.
_CACHED = 16
#: Pattern of the names of loop equations of a path.
_LOOP = re.compile(r"(?:loop|distance) (\S+) \((\d+)\)")


class Root(NamedTuple):
    """Choice of one of two solutions of an equation.

    Attributes:
        equation: name of the equation in the model; empty for an equation that follows from several.
        value: (1, 1) left side of the equation, scaled to values of about 1.
        slope: (1, 1) derivative with respect to the unknown, times the sign that makes this product positive at home.
        reach: (1, 1) discriminant: not negative where there are solutions, and 1 at home.
    """

    equation: str
    value: SX
    slope: SX
    reach: SX


class Eliminated(NamedTuple):
    """Eliminated unknown: it follows from dimensions, pose, and the unknowns that stay variables.

    Attributes:
        place: index of the unknown in the model.
        solved: closed form of the unknown; None for an unknown that stays a variable.
        root: choice of the solution; None for an equation with one solution.
    """

    place: int
    solved: Solved | None
    root: Root | None


@dataclass(eq=False)
class _Elimination:
    """State of an elimination.

    Attributes:
        model: the robot.
        symbols: symbols of the robot: parameters, unknowns, rotation, position.
        solved: closed forms of the eliminated unknowns, by index.
        eliminated: eliminated unknowns, in order.
        points: arguments of functions of the symbols: home, then the test points.
        held: indices of unknowns that stay variables if they have two solutions.
        failed: unsuccessful attempts, each as the number of the attempt and the open unknowns.
    """

    model: Model
    symbols: list[SX]
    points: list[list[FloatArray]]
    held: frozenset[int]
    solved: dict[int, Solved] = field(default_factory=dict)
    eliminated: list[Eliminated] = field(default_factory=list)
    failed: set[tuple[int, ...]] = field(default_factory=set)

    def turned(self, equation: Equation, rotation: FloatArray | None) -> Equation:
        """Return an equation with a numerical platform rotation, if one is given."""
        if rotation is None:
            return equation
        expression = ca.substitute(equation.expression, self.symbols[2], SX(rotation.tolist()))
        return equation._replace(expression=expression)

    def open_unknowns(self, expression: SX) -> list[int]:
        """Return the indices of the unknowns in an expression that are not determined yet.

        Free actuator coordinates count as given, like dimensions and pose.
        """
        known = {each.place for each in self.eliminated}
        known |= {k for k, each in enumerate(self.model.unknowns) if each.is_free}
        every = enumerate(ca.vertsplit(self.symbols[1]))
        names = {each.element_hash(): k for k, each in every if k not in known}
        return sorted(names[h] for h in (s.element_hash() for s in ca.symvar(expression)) if h in names)

    def replaced(self, expression: SX) -> SX:
        """Return an expression without the eliminated unknowns."""
        return with_replaced(self.symbols, [expression], 1, self.solved)[0] if self.solved else expression

    def values(self, expression: SX) -> FloatArray:
        """Return the values (t, k) of an expression (k, 1) at home and at the test points."""
        function = ca.Function("values", self.symbols, [ca.densify(expression)])
        return np.array([function(*each).full().ravel() for each in self.points])

    def is_zero(self, expression: SX, size: SX | float = 1.0) -> bool:
        """Return True if an expression is 0 at all test points, relative to a size and to 1."""
        found = self.values(ca.vertcat(ca.vec(expression), SX(size)))
        return bool(np.all(np.abs(found[:, :-1]) <= _SAME * (1 + np.abs(found[:, -1:]))))

    def without_absent(self, equation: Equation) -> Equation:
        """Return an equation in which unknowns without influence on its value are replaced by 0."""
        expression = equation.expression
        for k in self.open_unknowns(expression):
            q, size = self.model.unknowns[k].symbol, equation.size / self.model.unknowns[k].size
            if self.is_zero(ca.jacobian(expression, q) / size):
                expression = ca.substitute(expression, q, SX(0))
        return equation._replace(expression=expression)

    def add(self, index: int, solved: Solved, root: Root | None = None) -> None:
        """Add the closed form of an unknown."""
        if root is not None and index in self.held:
            self.eliminated.append(Eliminated(index, None, root))
            return
        self.solved[index] = solved
        self.eliminated.append(Eliminated(index, solved, root))


@lru_cache(maxsize=_CACHED)
def eliminated(
    model: Model, rotation: tuple[float, ...] | None = None, held: frozenset[int] = frozenset()
) -> tuple[Eliminated, ...]:
    """Eliminate unknowns of a robot by closed forms in dimensions and pose, in the solution that is valid at home.

    Args:
        model: the robot.
        rotation: nine numbers, column by column, of a fixed platform rotation, with which more unknowns may follow;
            None for a variable rotation.
        held: indices of unknowns that stay variables if they have two solutions; closed forms of other unknowns may
            depend on these.
    """
    if not model.unknowns:
        return ()
    own = Substitution.identity(model)
    turn = None if rotation is None else np.array(rotation).reshape(3, 3, order="F")
    work = _Elimination(model, own.all, _points(model, turn), held)
    gaps = {name: work.turned(gap, turn) for name, gap in gaps_of(model).items()}
    single = [Equation(each.expression, each.size, limb_of(each.name), each.name) for each in model.distances]
    single += [
        Equation(ca.dot(axis, gap.expression), gap.size, gap.limb)
        for name, gap in gaps.items()
        for axis in axes_of(model, name)
    ]
    single += [Equation(each.expression, each.size, limb_of(each.name), each.name) for each in model.closure]
    single = [work.without_absent(work.turned(each, turn)) for each in single]
    while _eliminate_one(work, list(gaps.values()), single):
        pass
    return tuple(work.eliminated)


def _eliminate_one(work: _Elimination, gaps: Sequence[Equation], single: Sequence[Equation]) -> bool:
    """Eliminate one unknown, from a gap or otherwise from one equation; return False if this fails for all unknowns."""
    attempts = [
        (solve, each) for solve, own in ((_from_gap, gaps), (_from_linear, single), (_from_one, single)) for each in own
    ]
    for attempt, (solve, given) in enumerate(attempts):
        left = work.open_unknowns(given.expression)
        if not left or (attempt, *left) in work.failed:
            continue
        # Repeated only after another unknown has been determined.
        work.failed.add((attempt, *left))
        equation = given._replace(expression=work.replaced(given.expression))
        if len(left) > 1:
            equation = work.without_absent(equation)
            left = work.open_unknowns(equation.expression)
        if len(left) == 1 and solve(work, left[0], equation):
            return True
    return False


def _from_gap(work: _Elimination, k: int, gap: Equation) -> bool:
    """Eliminate an unknown that enters a gap (3, 1) linearly, or by its sine and cosine."""
    q, e = work.model.unknowns[k].symbol, gap.expression / gap.size
    slope = ca.jacobian(e, q)
    if work.model.unknowns[k].dimension is not Dimension.ANGLE:
        a = ca.substitute(slope, q, SX(0))
        c = ca.substitute(e, q, SX(0))
        if not work.is_zero(a * q + c - e) or not _is_positive(work, ca.sumsqr(a * work.model.unknowns[k].size)):
            return False
        work.add(k, Solved(-ca.dot(a, c) / ca.sumsqr(a), None, None, SX(0)))
        return True
    a, b, c = _harmonics(work, e, q)
    same = ca.vertcat(ca.dot(a, b), ca.sumsqr(a) - ca.sumsqr(b), a * ca.cos(q) + b * ca.sin(q) + c - e)
    if not work.is_zero(same) or not _is_positive(work, ca.sumsqr(a)):
        return False
    cosine, sine = -ca.dot(a, c) / ca.sumsqr(a), -ca.dot(b, c) / ca.sumsqr(b)
    work.add(k, Solved.angle(sine, cosine, SX(0)))
    return True


def _from_one(work: _Elimination, k: int, equation: Equation) -> bool:
    """Eliminate an unknown that one equation (1, 1) determines, in the solution that is valid at home."""
    unknown = work.model.unknowns[k]
    if all(each.limb != equation.limb for each in work.model.signs if each.is_mode):
        # A limb without a sign of its working mode is covered in all modes.
        return False
    q, e = unknown.symbol, equation.expression / equation.size
    slope = ca.jacobian(e, q) * unknown.size
    at_home = float(work.values(slope)[0, 0])
    if not abs(at_home) > _EDGE:
        return False
    solve = _angle_of if unknown.dimension is Dimension.ANGLE else _slide_of
    solved, reach = solve(work, unknown, e, 1.0 if at_home > 0 else -1.0)
    if solved is None:
        return False
    root = Root(equation.name, e, slope / at_home, reach / float(work.values(reach)[0, 0]))
    work.add(k, solved, root)
    return True


def _angle_of(work: _Elimination, unknown: Unknown, e: SX, sign: float) -> tuple[Solved | None, SX]:
    """Return the angle q with ``e = 0`` and a slope of given sign, and the edge of its reach.

    The angle is None unless e has the form ``A cos q + B sin q + C``.
    """
    q = unknown.symbol
    A, B, C = _harmonics(work, e, q)
    if not work.is_zero(A * ca.cos(q) + B * ca.sin(q) + C - e):
        return None, SX(0)
    square = A * A + B * B
    reach = square - C * C
    root = sign * ca.sqrt(ca.fmax(reach, 0))
    cosine, sine = (B * root - A * C) / square, (-B * C - A * root) / square
    return Solved.angle(sine, cosine, SX(0)), reach


def _slide_of(work: _Elimination, unknown: Unknown, e: SX, sign: float) -> tuple[Solved | None, SX]:
    """Return the travel q of a slide with ``e = 0`` and a slope of given sign, and the edge of its reach.

    The travel is None unless e has the form ``c0 + c1 q + c2 q^2`` with a nonzero c2.
    """
    q = unknown.symbol
    c0, c1, c2 = _coefficients(e, q)
    if not work.is_zero(c0 + c1 * q + c2 * q * q - e):
        return None, SX(0)
    if not abs(float(work.values(c2 * unknown.size**2)[0, 0])) > _EDGE:
        return None, SX(0)
    reach = c1 * c1 - 4 * c0 * c2
    return Solved((sign * ca.sqrt(ca.fmax(reach, 0)) - c1) / (2 * c2), None, None, SX(0)), reach


def _from_linear(work: _Elimination, k: int, equation: Equation) -> bool:
    """Eliminate the travel of a slide that enters one equation (1, 1) linearly."""
    unknown = work.model.unknowns[k]
    if unknown.dimension is Dimension.ANGLE:
        return False
    q, e = unknown.symbol, equation.expression / equation.size
    c0, c1, _ = _coefficients(e, q)
    if not work.is_zero(c0 + c1 * q - e) or not abs(float(work.values(c1 * unknown.size)[0, 0])) > _EDGE:
        return False
    work.add(k, Solved(-c0 / c1, None, None, SX(0)))
    return True


def _coefficients(e: SX, q: SX) -> tuple[SX, SX, SX]:
    """Return c0, c1 and c2 of ``e = c0 + c1 q + c2 q^2``, for any form of the expression e."""
    slope = ca.jacobian(e, q)
    at_zero = ca.substitute(ca.vertcat(e, slope, ca.jacobian(slope, q) / 2), q, SX(0))
    return at_zero[0], at_zero[1], at_zero[2]


def _harmonics(work: _Elimination, e: SX, q: SX) -> tuple[SX, SX, SX]:
    """Return a, b and c of ``e = a cos q + b sin q + c``, for any form of the expression e.

    The values a and b come from the derivative, in which terms without q cancel.
    """
    slope = ca.jacobian(e, q)
    a, b = at_turn(slope, q, -1.0, 0.0), at_turn(slope, q, 0.0, 1.0)
    c = at_turn(e, q, 0.0, 0.0)
    if not work.is_zero(a * ca.cos(q) + b * ca.sin(q) + c - e):
        c = at_turn(e, q, 0.0, 1.0) - a
    return a, b, c


def _is_positive(work: _Elimination, value: SX) -> bool:
    """Return True if a coefficient (1, 1), scaled to values of about 1, is positive at home."""
    return bool(float(work.values(value)[0, 0]) > _EDGE)


def _points(model: Model, rotation: FloatArray | None) -> list[list[FloatArray]]:
    """Return home and test points near it: values of parameters, unknowns, rotation and position."""
    rng = np.random.default_rng(_SEED)
    typical = model.typical
    home = np.array(model.home)
    size = float(np.linalg.norm(home)) or length_of(model, typical.tolist())
    points = [[typical, np.zeros(len(model.unknowns)), np.eye(3) if rotation is None else rotation, home]]
    lengths = np.array([item.dimension is not Dimension.ANGLE for item in model.unknowns])
    for _ in range(_TESTS):
        x, y, z = _SPREAD * rng.uniform(-1, 1, 3)
        turn = np.linalg.qr(np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]))[0]
        turn = turn * np.sign(np.diag(turn)) if rotation is None else rotation
        unknowns = rng.uniform(-1.5, 1.5, len(model.unknowns)) * np.where(lengths, size, 1.0)
        values = typical * (1 + _SPREAD * rng.uniform(-1, 1, typical.shape))
        values += _SPREAD * joint_sizes(model) * rng.uniform(-1, 1, typical.shape)
        points.append([values, unknowns, turn, home + _SPREAD * size * rng.uniform(-1, 1, 3)])
    return points


class Equation(NamedTuple):
    """One or three equations of a loop.

    Attributes:
        expression: (k, 1) left sides.
        size: (1, 1) length or number by which the left sides are divided, so that their values are about 1.
        limb: name of the limb with the loop; empty for a loop that belongs to no limb.
        name: name of a single equation.
    """

    expression: SX
    size: SX
    limb: str
    name: str = ""


def gaps_of(model: Model) -> dict[str, Equation]:
    """Return the gap (3, 1) of each chain that is opened at the centre of a joint, by the chain's name.

    Any three equations of a chain may be tried as a gap, because an unknown is identified by the form of its equation.
    """
    parts: dict[str, dict[int, Equation]] = {}
    for each in (*model.loops, *model.closure):
        match = _LOOP.match(each.name)
        if match is not None:
            parts.setdefault(match[1], {}).setdefault(
                int(match[2]), Equation(each.expression, each.size, limb_of(each.name))
            )
    first = {name: [own[k] for k in (1, 2, 3) if k in own] for name, own in parts.items()}
    return {
        name: Equation(ca.vertcat(*[each.expression for each in own]), own[0].size, own[0].limb)
        for name, own in first.items()
        if len(own) == 3
    }


def limb_of(name: str) -> str:
    """Return the limb of an equation from its name, such as 1 of ``loop 1.2 (3)``; empty for a name of another form."""
    match = _LOOP.match(name)
    return "" if match is None else match[1].partition(".")[0]


def axes_of(model: Model, name: str) -> Iterator[SX]:
    """Yield the current direction (3, 1) of each rotation of a chain's limb."""
    for each in model.joint_screws:
        if each.limb == name.partition(".")[0] and not each.is_nested:
            for k in range(each.all.shape[1]):
                if not each.all[:3, k].is_zero():
                    yield each.all[:3, k]
