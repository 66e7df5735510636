"""Proven bounds of the global optimum: this program's certificates, SCIP and MAiNGO, each within the same time.

The solvers run in processes of their own through the scripts ``global_peers.py`` (the paper's problems, each in its
natural formulation) and ``limbs.py`` (joint coordinates and axes, this program's expressions operation by operation).
"""

from __future__ import annotations

import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from limbs import machine

from screwsynth.nlp import Solution, certify_program, load_case, solve

_FOLDER = Path(__file__).parents[1]
#: Gap that every method is asked for.
_GAP = 1e-4
#: Seconds beyond its limit after which a solver is ended.
_GRACE = 20.0
#: Absolute values above this are no bounds.
_INFINITE = 1e19
_METHODS = ("screwsynth", "scip", "maingo")
_REACHED = re.compile(r"best ([-+.\deinfa]+), bound ([-+.\deinfa]+).*nodes (\d+)")


class Question(NamedTuple):
    """A problem: its name in the table, the script of the general solvers, and its word there."""

    name: str
    script: str
    word: str


QUESTIONS = (
    Question("Section 4.1, 6 free", "global_peers.py", "4.1"),
    Question("Section 4.3, 7 free", "global_peers.py", "4.3"),
    Question("hexapod, 36 joint coordinates", "limbs.py", "36"),
    Question("Section 4.4, 18 components of axes", "limbs.py", "18"),
)


class Plan(NamedTuple):
    """The problems, seconds of each solver on each, and seconds of the whole section."""

    questions: tuple[Question, ...]
    each: float
    seconds: float


QUICK = Plan(QUESTIONS[:1], 2.0, 20.0)
FULL = Plan(QUESTIONS, 30.0, 390.0)


def run(plan: Plan, keep: Callable[[object], None]) -> None:
    """Measure each problem by all methods in turn, and hand over the rows so far."""
    deadline, rows = time.monotonic() + plan.seconds, []
    # Start-up and a solver's overshoot take the rest.
    each = min(plan.each, 0.7 * plan.seconds / (len(_METHODS) * len(plan.questions)))
    for question in plan.questions:
        for method in _METHODS:
            print(f"  {question.name}: {method}", file=sys.stderr, flush=True)
            row: dict[str, object] = {"problem": question.name, "method": method}
            if time.monotonic() + each > deadline:
                row["note"] = "left out: no time"
            else:
                row |= _own(question, each) if method == "screwsynth" else _general(question, method, each)
            rows.append(row)
            keep({"seconds_each": each, "gap": _GAP, "rows": rows})


def _solution(question: Question) -> Solution:
    """Return the solution whose F is to be proved."""
    if question.word == "36":
        return solve(machine(2.0), starts=8, jobs=1)
    name = {"4.1": "paper-4.1-helical", "4.3": "paper-4.3", "18": "paper-4.4-max"}[question.word]
    return solve(load_case(name), starts=8, jobs=1)


def _own(question: Question, seconds: float) -> dict[str, object]:
    """Return what this program's certificate reaches: the solve and the search of the box."""
    before = time.process_time()
    solution = _solution(question)
    solved = time.process_time() - before
    found = certify_program(solution.nlp, solution.x, gap=_GAP, jobs=1, time_limit=seconds)
    return {
        "best": solution.F,
        "bound": found.bound,
        "nodes": found.boxes,
        "seconds": time.process_time() - before,
        "note": f"{found.status.value}; the solve before it took {solved:.2f} s of these",
    }


def _general(question: Question, method: str, seconds: float) -> dict[str, object]:
    """Return what a general solver reaches within a time."""
    command = [sys.executable, str(_FOLDER / question.script), method, question.word, str(seconds)]
    before = _children_seconds()
    with tempfile.TemporaryDirectory() as folder:  # a solver writes its log where it runs
        try:
            done = subprocess.run(
                command, check=False, cwd=folder, capture_output=True, text=True, timeout=seconds + _GRACE
            )
        except subprocess.TimeoutExpired:
            return {"note": f"ended after {seconds + _GRACE:.0f} s without an answer"}
    taken = _children_seconds() - before
    reached = _REACHED.search(done.stdout)
    if reached is None:
        said = (done.stderr.strip().splitlines() or ["no words"])[-1]
        if "ModuleNotFoundError" in said:
            return {"note": "is not installed"}
        return {"note": f"failed: {said}"[:160], "seconds": taken}
    best, bound = float(reached[1]), float(reached[2])
    return {
        "best": best if abs(best) < _INFINITE else None,
        "bound": bound if abs(bound) < _INFINITE else None,
        "nodes": int(reached[3]),
        "seconds": taken,
    }


def _children_seconds() -> float:
    """Return the CPU time of all processes that this one has begun and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
