"""Tapes in 200-bit ball arithmetic: what the enclosures of the search are held against."""

import flint
import numpy as np
from numpy_engine.first_order import Enclosures

from screwsynth.nlp.proof.enclosure.tape import Op, Tape


def arb(value: float) -> flint.arb:
    return flint.arb(float(value))


def steps(point: np.ndarray, centre: np.ndarray, radius: np.ndarray) -> list[flint.arb]:
    """Exact ``e_i`` of a point of a box."""
    flint.ctx.prec = 200
    return [(arb(x) - arb(c)) / arb(r) if r > 0 else arb(0) for x, c, r in zip(point, centre, radius, strict=True)]


def linear(c: float, a: np.ndarray, e: list[flint.arb]) -> flint.arb:
    return sum((arb(each) * step for each, step in zip(a, e, strict=True)), arb(c))


BINARY = (Op.ADD, Op.SUB, Op.MUL, Op.DIV)


def in_balls(tape: Tape, point: np.ndarray) -> list[flint.arb]:
    """Results of a tape at a point (n,) of doubles; a ball without an end is undefined."""
    return decided_balls(tape, point)[0]


def decided_balls(  # noqa: C901, PLR0912 - one branch for each operation
    tape: Tape, point: np.ndarray
) -> tuple[list[flint.arb], list[bool]]:
    """Results of a tape, and whether each is sharp.

    It is not where it depends on a ramp or a step at a number that may be 0: the ball holds both sides then, so that a
    root or a quotient of it may be undefined here and nowhere else.
    """
    sharp, sharp_out = [True] * tape.registers, [True] * tape.outputs
    work: list[flint.arb] = [flint.arb(0)] * tape.registers
    out: list[flint.arb] = [flint.arb(0)] * tape.outputs
    unary = {Op.SQRT: "sqrt", Op.SIN: "sin", Op.COS: "cos", Op.EXP: "exp", Op.LOG: "log", Op.ATAN: "atan"}
    flint.ctx.prec = 200
    for op, to, a, b, k in zip(
        *(column.tolist() for column in (tape.op, tape.to, tape.a, tape.b, tape.k)), strict=True
    ):
        if op not in (Op.OUTPUT, Op.INPUT, Op.CONSTANT):
            is_split = op in (Op.RAMP, Op.STEP) and work[a].is_finite() and not (work[a] < 0 or work[a] >= 0)
            sharp[to] = sharp[a] and (op not in BINARY or sharp[b]) and not is_split
        elif op != Op.OUTPUT:
            sharp[to] = True
        if op == Op.OUTPUT:
            out[to], sharp_out[to] = work[a], sharp[a]
        elif op == Op.INPUT:
            work[to] = flint.arb(float(point[a]))
        elif op == Op.CONSTANT:
            work[to] = flint.arb(k)
        elif op == Op.ADD:
            work[to] = work[a] + work[b]
        elif op == Op.SUB:
            work[to] = work[a] - work[b]
        elif op == Op.MUL:
            work[to] = work[a] * work[b]
        elif op == Op.DIV:
            work[to] = work[a] / work[b]
        elif op == Op.SHIFT:
            work[to] = work[a] + flint.arb(k)
        elif op == Op.SCALE:
            work[to] = work[a] * flint.arb(k)
        elif op == Op.SQUARE:
            work[to] = work[a] * work[a]
        elif op in (Op.RAMP, Op.STEP) and not work[a].is_finite():
            work[to] = work[a]
        elif op == Op.RAMP:
            work[to] = flint.arb(0) if work[a] < 0 else work[a] if work[a] > 0 else work[a].union(flint.arb(0))
        elif op == Op.STEP:
            work[to] = flint.arb(0) if work[a] < 0 else flint.arb(1) if work[a] >= 0 else flint.arb(0.5, 0.5)
        else:
            work[to] = getattr(work[a], unary[Op(op)])()
    return out, sharp_out


def violations(
    tape: Tape, forms: Enclosures, box: int, centre: np.ndarray, radius: np.ndarray, point: np.ndarray
) -> tuple[int, int]:
    """How many results lie surely outside of their interval, or of their form at a point of box number ``box``.

    Returns:
        Violations and checks; an undefined result must be poisoned, which is a check too.
    """
    flint.ctx.prec = 200
    e = steps(point, centre, radius)
    t = max((abs(each) for each in e), key=lambda ball: float(ball.mid()), default=flint.arb(0))
    bad = checks = 0
    for k, (ball, is_sharp) in enumerate(zip(*decided_balls(tape, point), strict=True)):
        checks += 2
        if not is_sharp:
            continue
        if not ball.is_finite():
            bad += 2 * int(np.isfinite(forms.s[k, box]))
            continue
        bad += int(bool(ball < arb(forms.lo[k, box])) or bool(ball > arb(forms.hi[k, box])))
        if not np.isfinite(forms.s[k, box]):
            continue
        value, s = linear(forms.c[k, box], forms.a[k, :, box], e), arb(forms.s[k, box])
        low, high = value + t * t * arb(forms.p[k, box]) - s, value + t * t * arb(forms.q[k, box]) + s
        bad += int(bool(ball < low) or bool(ball > high))
    return bad, checks
