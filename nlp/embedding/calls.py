"""A program as calls of few functions: those that repeat for legs, pairs of legs, joints, tasks and poses.

A call of a limit or of the objective is a *final* call. It may take values of *inner* calls. With several poses these are
F and the other numbers of the robot at each pose, and the spans of the legs there; at a single pose, the rates of each
row and the sums of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ...models import Model, RobotInstance, Substitution, WrenchKind, homogenised, instantiate
from ...models.instance import magnitude, objective, rates
from ...models.wrench import Wrench
from ..case.limits.form import Call, Form
from ..program.program import Program

#: Depth to which expressions of joint centres at two poses are compared.
_DEPTH = 1000
#: Operations of the second derivatives of all calls of one form up to which they stay single operations in C. A loop
#: saves little then, and single operations are faster.
_FEW = 2000


class InnerCall(NamedTuple):
    """A call, and its value (r, 1) as the program's own expressions."""

    call: Call
    values: SX


class FinalCall(NamedTuple):
    """A call, and the index of the constraint that is its value; the number of constraints for the objective."""

    call: Call
    place: int


@dataclass(frozen=True, eq=False)
class Calls:
    """The calls of a program.

    Attributes:
        inner: calls whose values other calls take.
        final: calls whose values are constraints, or the objective.
        matrices: J with moments about the platform's origin, (6 m, 1) row after row, at each pose; empty where there is
            no limit on singular values.
    """

    inner: tuple[InnerCall, ...]
    final: tuple[FinalCall, ...]
    matrices: tuple[SX, ...]


@dataclass(frozen=True)
class RobotValues:
    """The robot's numbers at a pose as a function of all that they depend on: a ``build`` of a form."""

    model: Model

    def __call__(self, inputs: SX) -> SX:
        """Return :func:`robot_values` of a robot from its inputs (k, 1)."""
        return robot_values(self.robot(inputs))

    def robot(self, inputs: SX) -> RobotInstance:
        """Return the robot from its inputs (k, 1)."""
        at, parts = 0, []
        for each in Substitution.identity(self.model).all:
            parts.append(ca.reshape(inputs[at : at + each.numel()], each.shape))
            at += each.numel()
        twists = [inputs[j : j + 6] for j in range(at + 1, inputs.numel(), 6)]
        return instantiate(self.model, Substitution(*parts), inputs[at], twists)


def robot_values(robot: RobotInstance) -> SX:
    """Return F, rates, F without cancellation, closure, quantities and J row after row, below each other (r, 1).

    The moments of J are about the platform's origin.
    """
    numbers = [robot.F, robot.rates, robot.magnitude, robot.closure, *robot.quantities, _central_rows(robot)]
    return ca.veccat(*numbers)


def span_of_leg(inputs: SX) -> SX:
    """Return ``p + R a - b``, (3, 1), from p, R column after column, a and b, (18, 1) together."""
    return inputs[:3] + ca.reshape(inputs[3:12], 3, 3) @ inputs[12:15] - inputs[15:]


def find_calls(program: Program) -> Calls:
    """Return the calls of a program.

    At a single pose limits of few operations are no calls, and the objective is one only where limits take F.
    """
    several = len(program.robots) > 1
    is_spectral = any(each.spectral is not None for each in program.constraints)
    matrices = tuple(_central_rows(robot) for robot in program.robots) if is_spectral else ()
    if several:
        inner = _calls_at_poses(program.robots, program.model, matrices)
    else:
        inner = _calls_of_rows(program.robot)
    values = {
        each.element_hash()
        for item in inner
        for each in ca.vertsplit(item.values)
        if not each.is_constant()
    }
    final = []
    for place, constraint in enumerate(program.constraints):
        if several and constraint.spectral is None and constraint.expression.element_hash() in values:
            final.append(FinalCall(Call(Form(_same), constraint.expression), place))
        elif constraint.call is not None:
            final.append(FinalCall(constraint.call, place))
    of_objective = program.objective_call
    if several:
        chosen = [each for members in by_form(final) if _is_worthwhile(program, members, values) for each in members]
        takes_F = of_objective is not None
    else:
        chosen = [each for members in by_form(final) if _is_worthwhile(program, members, set()) for each in members]
        takes_F = any(each.element_hash() in values for item in chosen for each in ca.vertsplit(item.call.inputs))
    if of_objective is not None and takes_F:
        chosen.append(FinalCall(of_objective, len(program.constraints)))
    return Calls(inner, tuple(chosen), matrices)


def _same(inputs: SX) -> SX:
    return inputs


def _central_rows(robot: RobotInstance) -> SX:
    """Return J (6 m, 1), row after row, with moments about the platform's origin."""
    return ca.vec(ca.horzcat(*homogenised(robot.jacobian, robot.position, 1.0)).T)


def _calls_at_poses(robots: Sequence[RobotInstance], model: Model, matrices: Sequence[SX]) -> tuple[InnerCall, ...]:
    """Return the calls that give each robot's numbers, and the spans of its legs."""
    calls, form, span = [], Form(RobotValues(model)), Form(span_of_leg)
    for k, robot in enumerate(robots):
        values = robot_values(robot)
        if matrices:
            values[values.numel() - matrices[k].numel() :] = matrices[k]
        calls.append(InnerCall(Call(form, robot.inputs), values))
        for leg, first in zip(robot.legs, robots[0].legs, strict=True):
            # No pose changes the joint centres, but they are other expressions at each.
            platform, base = _first_if_same(leg.platform, first.platform), _first_if_same(leg.base, first.base)
            inputs = ca.veccat(robot.position, robot.rotation, platform, base)
            calls.append(InnerCall(Call(span, inputs), leg.span))
    return tuple(calls)


def _calls_of_rows(robot: RobotInstance) -> tuple[InnerCall, ...]:
    """Return the calls that give each row's rates, and those that give F and F without cancellation from them."""
    at = robot.inputs.numel() - 6 * robot.F.numel()
    length, calls, terms = robot.inputs[at - 1], [], []
    for i, row in enumerate(robot.rows):
        form = Form(_of_force if row.kind is WrenchKind.FORCE else _of_couple)
        for j in range(robot.F.numel()):
            twist = robot.inputs[at + 6 * j : at + 6 * j + 6]
            inputs = ca.vertcat(row.force, row.moment, row.square, robot.position, length, twist)
            term = SX.sym("term", 2)
            calls.append(InnerCall(Call(form, inputs), ca.vertcat(robot.rates[i, j], term)))
            terms.append(term)
    for j in range(robot.F.numel()):
        own = terms[j :: robot.F.numel()]
        for k, total in enumerate((robot.F[j], robot.magnitude[j])):
            calls.append(InnerCall(Call(Form(ca.sum1), ca.vertcat(*[term[k] for term in own])), total))
    return tuple(calls)


def _of_force(inputs: SX) -> SX:
    """Return a row's rate, its square, and the row's part of F without cancellation, from force, moment, square and twist.

    The position and the characteristic length are before the twist.
    """
    return _of_row(WrenchKind.FORCE, inputs)


def _of_couple(inputs: SX) -> SX:
    """Return the same as :func:`_of_force` of a couple."""
    return _of_row(WrenchKind.COUPLE, inputs)


def _of_row(kind: WrenchKind, inputs: SX) -> SX:
    row = [Wrench("", kind, inputs[:3], inputs[3:6], inputs[6])]
    position, length, twist = inputs[7:10], inputs[10], inputs[11:]
    return ca.vertcat(
        rates(row, twist, length), objective(row, twist, length), magnitude(row, twist, position, length)
    )


def _first_if_same(here: SX, first: SX) -> SX:
    """Return the expressions at the first pose where they are the same as here."""
    return first if ca.is_equal(here, first, _DEPTH) else here


def _is_worthwhile(program: Program, members: Sequence[FinalCall], values: set[int]) -> bool:
    """Return whether calls take values of inner calls, or are many operations."""
    if any(each.element_hash() in values for item in members for each in ca.vertsplit(item.call.inputs)):
        return True
    multipliers = SX.sym("multipliers", len(members))
    total = ca.dot(multipliers, ca.vertcat(*[item.call.value for item in members]))
    hessian = ca.Function("hessian", [program.x, program.p, multipliers], [ca.hessian(total, program.x)[0]])
    return len(members) > 1 and int(hessian.n_instructions()) > _FEW


def by_form(final: Iterable[FinalCall]) -> list[list[FinalCall]]:
    """Return calls of one form and one number of inputs together, in the order of the first of them."""
    found: dict[tuple[Form, int], list[FinalCall]] = {}
    for item in final:
        found.setdefault((item.call.form, item.call.inputs.numel()), []).append(item)
    return list(found.values())
