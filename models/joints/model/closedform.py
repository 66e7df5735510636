"""Closed-form inverse kinematics of limbs with a crank or a slide and a rod of constant length.

The loop of such a limb has one equation with one unknown:

* a crank or a rocker, ``A cos t + B sin t = D``, with solutions if ``A^2 + B^2 >= D^2``;
* a slide, ``c0 + c1 q + c2 q^2 = 0``, with solutions if ``c1^2 >= 4 c0 c2``.

The solution is that of the home working mode: the derivative of the equation with respect to the unknown has the same
sign as at home, and is 0 at the edge of the reach, where both solutions coincide. The unknown becomes an expression of
dimensions and pose, and the edge of the reach a separate claim.

Coefficients are derivatives of the equation at 0, with respect to the unknown or to its sine and cosine. Differences
of values would leave terms that cancel, and so wide bounds over boxes. Random values of all symbols test that the
equation, which is analytic, has no further terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ... import Closure, Dimension, Model, Substitution, Unknown
from ...drawing import Scene
from ...instance import joint_sizes, length_of
from ...whole import expressions_of, with_expressions
from .elimination import eliminated, limb_of
from .replacing import Solved, at_turn, with_replaced

#: Largest relative difference of both sides of an identity at random values: rounding.
_SAME = 1e-9
#: Number of random points at which an identity is tested.
_TESTS = 4
#: Smallest derivative of a scaled equation with respect to its unknown at home. With a smaller derivative, home is at
#: the boundary of the reach.
_EDGE = 1e-9
_SEED = 0
#: Squared sine or cosine of a reach below which an extended square root continues along its tangent.
_EXTENDED = 1e-4
#: Fields of a model, except the drawing, with expressions that may depend on its unknowns.
_REWRITTEN = (
    "wrenches", "members", "closure", "loops", "distances", "signs", "quantities", "actuators", "joint_screws",
    "joints", "links",
)  # fmt: skip


class Reach(NamedTuple):
    """Edge of a limb's reach.

    Attributes:
        limb: name of the limb.
        value: (1, 1) squared sine of the angle between crank and rod, projected along the crank's axis, or squared
            cosine of the angle between slide and rod; not negative where the limb reaches the pose, and 0 at the edge.
    """

    limb: str
    value: SX


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """Robot without the unknowns that have a closed form.

    Attributes:
        model: the robot, without its drawing.
        reaches: edge of the reach for each unknown with a closed form.
        has_angles: True if angles are replaced too; their closed forms jump after half a turn.
    """

    model: Model
    reaches: tuple[Reach, ...]
    has_angles: bool = True


def closed_form(model: Model, *, extended: bool = False, with_angles: bool = True) -> ClosedForm:
    """Return a robot without the unknowns that have a closed form in dimensions and pose.

    Free actuator coordinates stay unknowns; closed forms may depend on these coordinates.

    Args:
        model: the robot.
        extended: If true, the expressions also have values out of reach, for searches that pass through poses out of
            reach: the square root continues along its tangent where the squared sine or cosine of the reach is below
            1e-4.
        with_angles: If true, angles are replaced too. As unknowns they have no jump for a full rotation of a joint.
    """
    depends = [
        [
            k
            for k, each in enumerate(model.unknowns)
            if not each.is_free and ca.depends_on(equation.expression, each.symbol)
        ]
        for equation in model.closure
    ]
    found: dict[int, Solved] = {}
    dropped: set[int] = set()
    followed: set[int] = set()
    reaches: list[Reach] = []
    for k, unknown in enumerate(model.unknowns):
        for e, equation in enumerate(model.closure):
            if e in dropped or depends[e] != [k]:
                continue
            solved = _solved(model, unknown, equation, extended)
            if solved is not None:
                dropped.add(e)
                reaches.append(Reach(limb_of(equation.name), solved.reach))
                if with_angles or unknown.dimension is not Dimension.ANGLE:
                    found[k] = solved
                else:
                    followed.add(e)
                break
    if not found:
        return ClosedForm(model, tuple(reaches), with_angles)
    kept = tuple(each for e, each in enumerate(model.closure) if e not in dropped - followed)
    return ClosedForm(_rewritten(model, found, kept), tuple(reaches), with_angles)


def eliminated_form(model: Model) -> ClosedForm:
    """Return a robot without the unknowns that follow one after the other from its loop equations.

    The solutions are those of the home working mode, also for limbs with several unknowns, such as those of planar
    robots; see :mod:`.elimination`. The loop equations stay in the model: its constraints on the pose are in them.

    Args:
        model: the robot, without free actuator coordinates.
    """
    found = eliminated(model)
    solved = {each.place: each.solved for each in found if each.solved is not None}
    reaches = tuple(
        Reach(limb_of(each.root.equation) or model.unknowns[each.place].name, each.root.reach)
        for each in found
        if each.root is not None
    )
    return ClosedForm(_rewritten(model, solved, model.closure) if solved else model, reaches)


def with_joints_at_home(model: Model) -> Model:
    """Return a robot with its free actuator coordinates fixed at home, without its drawing."""
    held = {
        k: Solved.angle(SX(0), SX(1), SX(0)) if each.dimension is Dimension.ANGLE else Solved(SX(0), None, None, SX(0))
        for k, each in enumerate(model.unknowns)
        if each.is_free
    }
    return _rewritten(model, held, model.closure) if held else model


def _solved(model: Model, unknown: Unknown, equation: Closure, extended: bool) -> Solved | None:
    """Return the closed form of an unknown from an equation; None for an equation without a closed form."""
    q = unknown.symbol
    expression = equation.expression / equation.size

    slope = _slope_at_home(model, ca.jacobian(expression, q) * unknown.size)
    if not abs(slope) > _EDGE:
        return None
    sign = 1.0 if slope > 0 else -1.0
    if unknown.dimension is Dimension.ANGLE:
        sine, cosine = SX.sym("sine"), SX.sym("cosine")
        turned = at_turn(expression, q, sine, cosine)
        value, B, A, twice = _at_zero(turned, ca.vertcat(sine, cosine), [sine, cosine, (cosine, cosine)])
        # The sum of the squares of sine and cosine is one term, equal to 1.
        middle = value + twice / 2
        if not _is_same(model, expression, middle + A * ca.cos(q) + B * ca.sin(q)):
            return None
        D, square = -middle, A * A + B * B
        root = sign * _root(square - D * D, square, extended)
        cosine, sine = (A * D + B * root) / square, (B * D - A * root) / square
        return Solved.angle(sine, cosine, 1 - D * D / square)
    c0, c1, twice = _at_zero(expression, q, [q, (q, q)])
    c2 = twice / 2
    if _is_same(model, c2 * unknown.size**2, SX(0)) or not _is_same(model, expression, c0 + c1 * q + c2 * q * q):
        return None
    square = c1 * c1 - 4 * c0 * c2
    # For an equation divided by twice the squared rod length, 2 c2 square is the squared cosine.
    return Solved((sign * _root(square, 2 * c2, extended) - c1) / (2 * c2), None, None, square / (2 * c2))


def _root(value: SX, size: SX, extended: bool) -> SX:
    """Return the square root of a value; if extended, it continues along its tangent below a fraction of ``size``."""
    if not extended:
        return ca.sqrt(value)
    least = ca.fmax(value, _EXTENDED * size)
    root = ca.sqrt(least)
    return root + (value - least) / (2 * root)


def _at_zero(expression: SX, unknowns: SX, by: Sequence[SX | tuple[SX, SX]]) -> list[SX]:
    """Return the value of an expression and its derivatives where unknowns (k, 1) are 0.

    Args:
        expression: (1, 1) expression of the unknowns.
        unknowns: (k, 1) symbols.
        by: symbols with respect to which first derivatives are taken, and pairs of symbols for second derivatives.
    """
    own = {each.element_hash() for each in ca.vertsplit(unknowns)}
    rest = ca.vertcat(SX(0, 1), *[each for each in ca.symvar(expression) if each.element_hash() not in own])
    found = [expression]
    for each in by:
        first, *second = each if isinstance(each, tuple) else (each,)
        slope = ca.jacobian(expression, first)
        found.append(ca.jacobian(slope, second[0]) if second else slope)
    function = ca.Function("derivatives", [unknowns, rest], found)
    return list(function.call([SX.zeros(unknowns.numel()), rest]))


def _slope_at_home(model: Model, expression: SX) -> float:
    """Return the value of an expression at home, with typical dimensions."""
    function = ca.Function("home", Substitution.identity(model).all, [ca.densify(expression)])
    return float(function(model.typical, 0, np.eye(3), np.array(model.home)))


def _is_same(model: Model, one: SX, other: SX) -> bool:
    """Return True if two expressions agree at random values of all symbols."""
    symbols = Substitution.identity(model).all
    function = ca.Function("two", symbols, [ca.densify(one), ca.densify(other)])
    rng = np.random.default_rng(_SEED)
    typical, size = model.typical, length_of(model, model.typical.tolist())
    joints = joint_sizes(model)
    lengths = np.array([size if item.dimension is Dimension.LENGTH else 1.0 for item in model.unknowns])
    for _ in range(_TESTS):
        # Joint coordinates as parameters are 0 at home, which would hide terms.
        values = typical * rng.uniform(0.8, 1.2, typical.shape) + joints * rng.uniform(-1.5, 1.5, typical.shape)
        turn = rng.normal(size=(3, 3))
        place = np.array(model.home) + size * rng.uniform(-0.5, 0.5, 3)
        unknowns = lengths * rng.uniform(-1.5, 1.5, symbols[1].numel())
        a, b = (float(each) for each in function(values, unknowns, turn, place))
        if not abs(a - b) <= _SAME * (1 + abs(a) + abs(b)):
            return False
    return True


def _rewritten(model: Model, solved: dict[int, Solved], closure: tuple[Closure, ...]) -> Model:
    """Return a model in which closed forms replace some unknowns.

    Args:
        model: the model.
        solved: closed forms by the index of the unknown.
        closure: remaining closure equations.
    """
    given: dict[str, Any] = {name: getattr(model, name) for name in _REWRITTEN} | {
        "closure": closure,
        "members": tuple(replace(each, slide=None) for each in model.members),
    }
    expressions = with_replaced(Substitution.identity(model).all, expressions_of(given), 1, solved)
    unknowns = tuple(each for k, each in enumerate(model.unknowns) if k not in solved)
    return replace(model, **with_expressions(given, iter(expressions)), unknowns=unknowns, scene=Scene())
