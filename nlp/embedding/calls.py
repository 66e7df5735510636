"""A program as calls of few functions, repeated for legs, pairs of legs, joints, tasks and poses.

A call of a limit or of the objective is a *final* call. It may take values of *inner* calls: spans of legs, rates of
rows, their sums, and for several poses the other values of the robot at each pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, TypeAlias

import casadi as ca
from casadi import SX

from ...models import Model, RobotInstance, Substitution, WrenchKind, homogenised, instantiate
from ...models.instance import LegInstance, magnitude, objective, rates
from ...models.wrench import Wrench, force_along
from ..case.limits.constraint import Call, Form
from ..program.program import Program

#: Depth for the comparison of joint-centre expressions at two poses.
_DEPTH = 1000
#: Number of operations in the second derivatives of all calls of one form up to which they stay single operations in C:
#: a loop saves little then, and single operations are faster.
_FEW = 2000


#: Function that builds a row of J from its inputs, as returned by :func:`_inputs_of_row`.
RowBuild: TypeAlias = Callable[[SX], Wrench]


class InnerCall(NamedTuple):
    """Call, and its value (r, 1) as expressions of the program."""

    call: Call
    values: SX

    @property
    def computed(self) -> dict[int, int]:
        """Indices of the values by their hash, without constants and without values that are inputs of the call.

        A joint coordinate may be an unknown of the program.
        """
        given = {each.element_hash() for each in ca.vertsplit(self.call.inputs)}
        found: dict[int, int] = {}
        for place, each in enumerate(ca.vertsplit(self.values)):
            if not each.is_constant() and each.element_hash() not in given:
                found.setdefault(each.element_hash(), place)
        return found


class FinalCall(NamedTuple):
    """Call, and the index of its constraint; for the objective, the index is the number of constraints."""

    call: Call
    place: int


@dataclass(frozen=True, eq=False)
class Calls:
    """Calls of a program.

    Attributes:
        inner: calls with values that other calls take.
        final: calls with values that are constraints, or the objective.
        matrices: J with moments about the platform's origin, (6 m, 1) row by row, at each pose; empty without a limit
            on singular values.
    """

    inner: tuple[InnerCall, ...]
    final: tuple[FinalCall, ...]
    matrices: tuple[SX, ...]


@dataclass(frozen=True)
class RobotValues:
    """Function that returns the robot's values at a pose from all their inputs: a ``build`` of a form.

    Attributes:
        model: the robot.
        reference: reference of :class:`~screwsynth.models.instance.Substitution`.
    """

    model: Model
    reference: tuple[float, ...] | None

    def __call__(self, inputs: SX) -> SX:
        """Return :func:`robot_values` of a robot from its inputs (k, 1)."""
        return robot_values(self.robot(inputs))

    def robot(self, inputs: SX) -> RobotInstance:
        """Return the robot from its inputs (k, 1)."""
        at, parts = 0, []
        for each in Substitution.identity(self.model).all:
            parts.append(ca.reshape(inputs[at : at + each.numel()], each.shape))
            at += each.numel()
        parameters, unknowns, rotation, position = parts
        own = Substitution(parameters, unknowns, rotation, position, self.reference)
        twists = [inputs[j : j + 6] for j in range(at + 1, inputs.numel(), 6)]
        return instantiate(self.model, own, inputs[at], twists)


def robot_values(robot: RobotInstance) -> SX:
    """Return F, rates, bound on F, closure, quantities and J row by row, one below the other (r, 1).

    The moments of J are about the platform's origin.
    """
    numbers = [robot.F, robot.rates, robot.magnitude, robot.closure, *robot.quantities, _central_rows(robot)]
    return ca.veccat(*numbers)


def span_of_leg(inputs: SX) -> SX:
    """Return ``p + R a - b``, (3, 1), from p, R column by column, a and b, (18, 1) together."""
    return inputs[:3] + ca.reshape(inputs[3:12], 3, 3) @ inputs[12:15] - inputs[15:]


def find_calls(program: Program) -> Calls:
    """Return the calls of a program.

    At a single pose, limits of few operations are not calls. The objective is a call if limits take F, or if there are
    other calls and its second derivatives are many operations.
    """
    several = len(program.robots) > 1
    is_spectral = any(each.spectral is not None for each in program.constraints)
    matrices = tuple(_central_rows(robot) for robot in program.robots) if is_spectral else ()
    inner = _inner_calls(program, matrices)
    values = {key for item in inner for key in item.computed}
    final = []
    for place, constraint in enumerate(program.constraints):
        if several and constraint.spectral is None and constraint.expression.element_hash() in values:
            final.append(FinalCall(Call(Form(_same), constraint.expression), place))
        elif constraint.call is not None:
            final.append(FinalCall(constraint.call, place))
    taken = values if several else set()
    chosen = [each for members in by_form(final) if _is_worthwhile(program, members, taken) for each in members]
    of_F = {each.element_hash() for robot in program.robots for each in ca.vertsplit(robot.F)}
    takes_F = several or any(each.element_hash() in of_F for item in chosen for each in ca.vertsplit(item.call.inputs))
    # With other loops, their code exists already.
    is_large = bool(chosen) and bool(of_F & values) and _second_operations(program, program.objective) > _FEW
    if program.objective_call is not None and (takes_F or is_large):
        chosen.append(FinalCall(program.objective_call, len(program.constraints)))
    return Calls(inner, tuple(chosen), matrices)


def _same(inputs: SX) -> SX:
    return inputs


def _central_rows(robot: RobotInstance) -> SX:
    """Return J (6 m, 1), row by row, with moments about the platform's origin."""
    return ca.vec(ca.horzcat(*homogenised(robot.jacobian, robot.position, 1.0)).T)


def _inner_calls(program: Program, matrices: Sequence[SX]) -> tuple[InnerCall, ...]:
    """Return the calls for spans of legs, rates, F, and for several poses the robot's other values.

    Of two calls with the same value the first is used.
    """
    calls: list[InnerCall] = []
    first = program.robots[0].legs
    for k, robot in enumerate(program.robots):
        legs = [_with_first_joints(leg, own) for leg, own in zip(robot.legs, first, strict=True)]
        for leg in legs:
            inputs = ca.veccat(robot.position, robot.rotation, leg.platform, leg.base)
            calls.append(InnerCall(Call(Form(span_of_leg), inputs), leg.span))
        rows = [_inputs_of_row(row, legs) for row in robot.rows]
        # The rows of a member come from one projector, so no form gives each of them separately.
        is_by_row = len(program.robots) == 1 or all(form == _FORCE_OF_LEG for form, _ in rows)
        if is_by_row and not program.model.members:
            calls += _calls_of_rows(robot, rows)
        if len(program.robots) > 1:
            values = robot_values(robot)
            if matrices:
                values[values.numel() - matrices[k].numel() :] = matrices[k]
            calls.append(InnerCall(Call(Form(RobotValues(program.model, robot.reference)), robot.inputs), values))
    return tuple(calls)


def _with_first_joints(leg: LegInstance, first: LegInstance) -> LegInstance:
    """Return a leg with the joint centres of the first pose if these equal its own; otherwise the leg itself."""
    pairs = (leg.base, first.base), (leg.platform, first.platform)
    same = all(ca.is_equal(here, there, _DEPTH) for here, there in pairs)
    return replace(leg, base=first.base, platform=first.platform) if same else leg


def _inputs_of_row(row: Wrench, legs: Sequence[LegInstance]) -> tuple[Form, SX]:
    """Return the form of a row's rates, and the inputs of the row: base and span of its leg, or its wrench.

    The inputs of a wrench are force, moment and square.
    """
    for leg in legs:
        along = force_along(leg.name, leg.base, leg.span)
        if row.kind is WrenchKind.FORCE and row.limb == leg.name:
            pairs = ((row.force, along.force), (row.moment, along.moment), (row.square, along.square))
            if all(ca.is_equal(one, other, _DEPTH) for one, other in pairs):
                return _FORCE_OF_LEG, ca.vertcat(leg.base, leg.span)
    kind = WrenchKind.FORCE if row.kind is WrenchKind.FORCE else WrenchKind.COUPLE
    return _OF_KIND[kind], ca.vertcat(row.force, row.moment, row.square)


def _calls_of_rows(robot: RobotInstance, rows: Sequence[tuple[Form, SX]]) -> list[InnerCall]:
    """Return the calls for the rate, the term of F and the magnitude of each row, and for their sums."""
    tasks = robot.F.numel()
    at = robot.inputs.numel() - 6 * tasks
    length, calls = robot.inputs[at - 1], []
    for j in range(tasks):
        twist = robot.inputs[at + 6 * j : at + 6 * j + 6]
        terms, sizes = SX.sym("term", len(rows)), SX.sym("size", len(rows))
        for i, (form, inputs) in enumerate(rows):
            rate = Call(form, ca.vertcat(length, twist, inputs))
            calls.append(InnerCall(rate, ca.vertcat(robot.rates[i, j], terms[i])))
            size = Call(Form(_size_of_row, form.numbers), ca.vertcat(length, twist, robot.position, inputs))
            calls.append(InnerCall(size, sizes[i]))
        calls.append(InnerCall(Call(Form(ca.sum1), terms), robot.F[j]))
        calls.append(InnerCall(Call(Form(ca.sum1), sizes), robot.magnitude[j]))
    return calls


def _force_of_leg(inputs: SX) -> Wrench:
    return force_along("", inputs[:3], inputs[3:])


def _wrench(kind: WrenchKind, inputs: SX) -> Wrench:
    return Wrench("", kind, inputs[:3], inputs[3:6], inputs[6])


def _rate_of_row(inputs: SX, row: RowBuild) -> SX:
    """Return the rate of a row and its term of F, (2, 1), from characteristic length, twist and inputs of the row."""
    length, twist, rows = inputs[0], inputs[1:7], [row(inputs[7:])]
    return ca.vertcat(rates(rows, twist, length), objective(rows, twist, length))


def _size_of_row(inputs: SX, row: RowBuild) -> SX:
    """Return the term of a row in the bound on F, (1, 1), from length, twist, position and inputs of the row."""
    return magnitude([row(inputs[10:])], inputs[1:7], inputs[7:10], inputs[0])


_FORCE_OF_LEG = Form(_rate_of_row, (_force_of_leg,))
_OF_KIND = {kind: Form(_rate_of_row, (partial(_wrench, kind),)) for kind in (WrenchKind.FORCE, WrenchKind.COUPLE)}


def _is_worthwhile(program: Program, members: Sequence[FinalCall], values: set[int]) -> bool:
    """Return True if calls take values of inner calls, or have many operations."""
    if any(each.element_hash() in values for item in members for each in ca.vertsplit(item.call.inputs)):
        return True
    multipliers = SX.sym("multipliers", len(members))
    total = ca.dot(multipliers, ca.vertcat(*[item.call.value for item in members]))
    return len(members) > 1 and _second_operations(program, total, multipliers) > _FEW


def _second_operations(program: Program, expression: SX, *others: SX) -> int:
    """Return the number of operations of an expression's second derivatives with respect to x, p and other symbols."""
    inputs = [program.x, program.p, *others]
    return int(ca.Function("hessian", inputs, [ca.hessian(expression, program.x)[0]]).n_instructions())


def by_form(final: Iterable[FinalCall]) -> list[list[FinalCall]]:
    """Return groups of calls with one form and number of inputs, in the order of their first calls."""
    found: dict[tuple[Form, int], list[FinalCall]] = {}
    for item in final:
        found.setdefault((item.call.form, item.call.inputs.numel()), []).append(item)
    return [*found.values()]
