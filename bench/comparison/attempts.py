"""One attempt of a peer: timed, judged as returned, and judged again after a polish where the method is global."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from peers.interface import Budget, BudgetSpentError, Peer, Problem
from peers.scipy_slsqp import search_with_gradient

from screwsynth.models import FloatArray

from .judging import NOTHING, Verdict, judge
from .problems import Subject

#: Budget of a polish: SLSQP from a good point needs some dozens of evaluations.
_POLISH = Budget(5_000, 1.0)
#: CPU seconds beyond its budget after which a search is ended by a signal, because it evaluates nothing.
_LATE = 0.2
#: Wall seconds between two looks at whether a search is to be ended.
_LOOK = 0.1
#: Length of a fault's text in the results.
_SHORT = 120


class Attempt(NamedTuple):
    """One attempt: CPU and wall seconds, evaluations, derivatives, verdict; and the same after a polish.

    Attributes:
        seed: of the attempt.
        seconds: CPU time of the search.
        wall: wall time of the search.
        evaluations: points at which F was evaluated; None where this program's own searches report iterations.
        gradients: points at which derivatives were evaluated.
        iterations: of this program's own searches.
        spent: whether the budget ended the search.
        fault: the exception that ended the search, in words, or nothing.
        verdict: on the answer as returned.
        polish_seconds: CPU time of the polish; 0 for a local method, which has none.
        polished: verdict after the polish, or None.
    """

    seed: int
    seconds: float
    wall: float
    evaluations: int | None
    gradients: int
    iterations: int | None
    spent: bool
    fault: str
    verdict: Verdict
    polish_seconds: float = 0.0
    polished: Verdict | None = None


def attempt(peer: Peer, subject: Subject, seed: int, budget: Budget) -> Attempt:
    """Run a peer once and judge its answer."""
    problem = Problem(subject.case, subject.nlp, seed, budget)
    _ = problem.start
    began, before = time.perf_counter(), time.process_time()
    answer, spent, fault = _answer(peer, problem, budget)
    seconds, wall = time.process_time() - before, time.perf_counter() - began
    verdict = _verdict(problem, answer)
    found = Attempt(
        seed,
        seconds,
        wall,
        None if problem.iterations is not None else problem.evaluations,
        problem.gradients,
        problem.iterations,
        spent,
        fault,
        verdict,
    )
    if peer.kind != "global" or answer is None:
        return found
    before = time.process_time()
    better = _polished(subject, answer)
    taken = time.process_time() - before
    return found._replace(polish_seconds=taken, polished=_verdict(problem, better))


def _answer(peer: Peer, problem: Problem, budget: Budget) -> tuple[FloatArray | None, bool, str]:
    """Return the answer, whether the budget ended the search, and the fault that did."""
    try:
        with _alarm(None if peer.package == "screwsynth" else budget.seconds + _LATE):
            answer = np.asarray(peer.search(problem), dtype=np.float64).ravel()
    except BudgetSpentError:
        return problem.best, True, ""
    except Exception as fault:  # whatever a library raises is a row of the table
        # Libraries in C++ wrap the exception by which the budget ends a search.
        if BudgetSpentError.__name__ in str(fault) or isinstance(fault.__cause__, BudgetSpentError):
            return problem.best, True, ""
        return problem.best, False, f"{type(fault).__name__}: {fault}"[:_SHORT]
    if answer.shape != (problem.n,) or not np.isfinite(answer).all():
        return problem.best, False, "returned no point"
    return answer, False, ""


@contextmanager
def _alarm(seconds: float | None) -> Iterator[None]:
    """End what runs inside by an exception after a CPU time; None for no end."""
    if seconds is None:
        yield
        return

    end = time.process_time() + seconds

    def look(*_: object) -> None:
        if time.process_time() > end:
            raise BudgetSpentError

    # A timer of CPU time would make the system's clock of CPU time coarse: this one only looks at that clock.
    before = signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, _LOOK, _LOOK)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _verdict(problem: Problem, answer: FloatArray | None) -> Verdict:
    return NOTHING if answer is None else judge(problem.nlp, problem.x(answer))


def _polished(subject: Subject, answer: FloatArray) -> FloatArray:
    """Return where SLSQP with the exact gradient ends from an answer; the answer itself where SLSQP fails."""
    problem = Problem(subject.case, subject.nlp, 0, _POLISH)
    problem.start = np.clip(answer, -1.0, 1.0)
    try:
        return np.asarray(search_with_gradient(problem), dtype=np.float64)
    except Exception:  # SciPy may be missing, or fail
        return answer
