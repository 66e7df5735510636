"""Joints that a whole turn brings back: the ends of their ranges are the same position."""

from __future__ import annotations

import math

import casadi as ca

from ..program.nlp import Nlp

#: Rounding error of a range of a whole turn.
_ROUNDING = 1e-12


def turning_joints(nlp: Nlp) -> frozenset[int]:
    """Return the places of the joint positions with a range of a whole turn, of which all functions have period 2 pi.

    A function has that period in a position that enters it by its sine and cosine alone, with either sign.
    """
    turning = {i for i in nlp.program.places.inner if abs(nlp.upper[i] - nlp.lower[i] - 2 * math.pi) < _ROUNDING}
    if not turning:
        return frozenset()
    program = nlp.program
    outputs = [
        program.objective,
        *(each.expression for each in program.constraints),
        *(r.signs for r in program.robots),
    ]
    function = ca.Function("all", [program.x, program.p], [ca.veccat(*outputs)])
    held: dict[int, int] = {}
    for k in range(function.n_instructions()):
        op, inputs = function.instruction_id(k), function.instruction_input(k)
        if op == ca.OP_OUTPUT:
            turning.discard(held.get(inputs[0], -1))
            continue
        place = function.instruction_output(k)[0]
        if op == ca.OP_INPUT:
            source, index = inputs
            found = index if source == 0 else -1
        elif op in (ca.OP_SIN, ca.OP_COS, ca.OP_CONST):
            found = -1
        elif op == ca.OP_NEG:
            found = held.get(inputs[0], -1)
        else:
            found = -1
            turning -= {held.get(each, -1) for each in inputs}
        held[place] = found
    return frozenset(turning)
