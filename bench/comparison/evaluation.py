"""Time of F, its gradient and its Hessian: generated C, CasADi's virtual machine, NumPy, C by hand, and operations.

Values are compared before times count. Implementations run by turns; the smallest time of each is kept, as what makes
a longer one is the machine.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp import Nlp, generate_c
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.program.sampling import starting_points

from . import numpyrobot
from .problems import Subject, subject_of
from .shares import shared

_FOLDER = Path(__file__).parents[1]
#: The case with implementations by hand.
_BY_HAND = "paper-4.1-helical"
#: Points of one call of CasADi's map and of NumPy.
_BATCH = 1000
#: Largest relative difference of values from CasADi's.
_SAME = 1e-10
QUANTITIES = ("F", "F, gradient", "F, gradient, Hessian")


class Plan(NamedTuple):
    """Cases, turns of all implementations, seconds of each function in a turn, and seconds of the whole section."""

    cases: tuple[str, ...]
    turns: int
    each: float
    seconds: float


QUICK = Plan((_BY_HAND,), 2, 0.02, 20.0)
FULL = Plan((_BY_HAND, "paper-4.3", "paper-4.4-max", "hexapod-machining", "3-rps"), 7, 0.15, 120.0)


def run(plan: Plan, keep: Callable[[object], None]) -> None:
    """Measure each case and hand over the rows so far."""
    rows: list[dict[str, object]] = []
    for name, end in shared(plan.seconds, plan.cases):
        print(f"  {name}", file=sys.stderr, flush=True)
        try:
            rows += _rows(name, subject_of(name), plan, end)
        except (subprocess.CalledProcessError, OSError, ValueError) as fault:
            rows.append({"case": name, "note": f"failed: {type(fault).__name__}: {fault}"[:160]})
        keep({"rows": rows})


def _rows(name: str, subject: Subject, plan: Plan, end: float) -> list[dict[str, object]]:
    """Return the rows of a case, one for each quantity; after the end of its time no further turn begins."""
    points = starting_points(subject.nlp, _BATCH + 1, 0)[1:]
    machines = _functions(subject.nlp)
    best: dict[str, list[float]] = {}
    operation = np.inf
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _compile(folder, subject, by_hand=name == _BY_HAND)
        if name == _BY_HAND:
            _compare(machines, points)
        for turn in range(plan.turns):
            if turn and time.monotonic() > end:
                break
            *generated, own = map(float, _output(folder, "./evaluation", str(plan.each)).split())
            operation = min(operation, own)
            _keep_least(best, "generated C", generated)
            _keep_least(best, "CasADi", [_time(_mapped(each, points), plan.each) for each in machines])
            if name == _BY_HAND:
                arrays = (lambda: numpyrobot.values(points), lambda: numpyrobot.gradients(points))
                _keep_least(best, "NumPy", [_time(each, plan.each) for each in arrays])
                printed = _output(folder, "./handwritten")
                found = [
                    float(re.findall(pattern, printed)[0])
                    for pattern in (r"F by hand ([\d.]+)", r"gradient by hand ([\d.]+)")
                ]
                _keep_least(best, "C by hand", found)
    rows = []
    for k, quantity in enumerate(QUANTITIES):
        counts = operations(machines[k])
        rows.append(
            {
                "case": name,
                "quantity": quantity,
                "nanoseconds": {each: times[k] for each, times in best.items() if k < len(times)},
                "operations": sum(counts.values()),
                "divisions_and_roots": counts["divisions"] + counts["functions"],
                "operation_nanoseconds": operation,
            }
        )
    return rows


def operations(function: ca.Function) -> dict[str, int]:
    """Return the numbers of sums and products, of divisions, and of roots and other functions of a function."""
    counts = {"sums and products": 0, "divisions": 0, "functions": 0}
    cheap = {ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_SQ, ca.OP_TWICE, ca.OP_NEG}
    none = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_PARAMETER, ca.OP_ASSIGN}
    for k in range(function.n_instructions()):
        op = function.instruction_id(k)
        if op in cheap:
            counts["sums and products"] += 1
        elif op in {ca.OP_DIV, ca.OP_INV}:
            counts["divisions"] += 1
        elif op not in none:
            counts["functions"] += 1
    return counts


def _functions(nlp: Nlp) -> list[ca.Function]:
    """Return F, F with its gradient, and both with the Hessian's upper half, with the fixed numbers put in."""
    x = nlp.program.x
    (F,) = ca.Function("f", [x, nlp.program.p], [nlp.program.objective]).call([x, ca.SX(nlp.arguments)])
    hessian, gradient = ca.hessian(F, x)
    outputs = [[F], [F, gradient], [F, gradient, ca.triu(hessian)]]
    return [ca.Function("f", [x], each, {"cse": True}) for each in outputs]


def _compile(folder: Path, subject: Subject, *, by_hand: bool) -> None:
    """Compile the programs that measure the generated C of a case, and the C by hand."""
    prefix = identifier(subject.case.name)
    for name, text in generate_c(subject.case, "").items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = sorted(path.name for path in folder.glob(f"{prefix}*.c"))
    driver = (_FOLDER / "evaluation.c").read_text(encoding="utf-8")
    driver = driver.replace("BIG_", f"{prefix.upper()}_").replace("ID_", f"{prefix}_").replace("ID.h", f"{prefix}.h")
    (folder / "evaluation.c").write_text(driver, encoding="utf-8")
    compiler = os.environ.get("CC", "cc")
    flags = ["-O2", "-std=gnu99", "-ffp-contract=off"]
    subprocess.run([compiler, *flags, "-c", *sources], cwd=folder, check=True)
    objects = [f"{source[:-2]}.o" for source in sources]
    # Sums and products one by one: two in one instruction would not be what most of the functions can have.
    own = ["-fno-tree-vectorize", "-fno-tree-slp-vectorize", "evaluation.c", *objects, "-lm", "-o", "evaluation"]
    subprocess.run([compiler, *flags, *own], cwd=folder, check=True)
    if by_hand:
        (folder / "handwritten.c").write_text((_FOLDER / "handwritten.c").read_text(encoding="utf-8"))
        words = [*flags, "-DCALLS=40000", "handwritten.c", *objects, "-lm", "-o", "handwritten"]
        subprocess.run([compiler, *words], cwd=folder, check=True)


def _compare(machines: list[ca.Function], points: FloatArray) -> None:
    """Refuse values of NumPy that are not CasADi's.

    Raises:
        ValueError: they differ.
    """
    F, gradient = (np.array(each) for each in machines[1].map(len(points))(points.T))
    own, slopes = numpyrobot.gradients(points)
    off = max(
        float(np.max(np.abs(own / F.ravel() - 1))),
        float(np.max(np.abs(numpyrobot.values(points) / F.ravel() - 1))),
        float(np.max(np.abs(slopes - gradient.T)) / np.max(np.abs(gradient))),
    )
    if not off <= _SAME:
        raise ValueError(f"F in NumPy differs by {off:.1e}")


def _mapped(function: ca.Function, points: FloatArray) -> Callable[[], object]:
    """Return a call that evaluates a function at all points inside of CasADi's virtual machine."""
    mapped = function.map(len(points))
    buffer, call = mapped.buffer()
    inputs = np.ascontiguousarray(points)
    results = [np.zeros(mapped.nnz_out(k)) for k in range(mapped.n_out())]
    buffer.set_arg(0, memoryview(inputs.ravel()))
    for k, each in enumerate(results):
        buffer.set_res(k, memoryview(each))

    def evaluate(_kept: object = (mapped, buffer, inputs, results)) -> None:
        call()

    return evaluate


def _time(call: Callable[[], object], seconds: float) -> float:
    """Return the smallest CPU nanoseconds of a point, of calls that last some seconds together."""
    best, end = np.inf, time.process_time() + seconds
    while time.process_time() < end or not np.isfinite(best):
        began = time.process_time_ns()
        call()
        best = min(best, (time.process_time_ns() - began) / _BATCH)
    return float(best)


def _keep_least(best: dict[str, list[float]], name: str, times: list[float]) -> None:
    best[name] = [min(pair) for pair in zip(best.get(name, times), times, strict=True)]


def _output(folder: Path, *words: str) -> str:
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout
