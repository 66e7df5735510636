"""Time to the optimum: every peer on every case by short turns, until its seeds or its time are used up.

By turns, because a machine that becomes busy then burdens all. What is kept is each attempt with its verdict; which of
them are correct is decided when the page is written, from the best answer that the whole run knows.
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from peers import all_peers
from peers.interface import Budget, Peer

from screwsynth.nlp import CertificateStatus, certify_program, formulate, solve

from .attempts import Attempt
from .problems import CASES, Subject, case_of, subject_of
from .workers import LostWorkerError, Worker, loads

#: Cases whose optimum is proved here, to a gap below the tolerance of a correct answer.
_PROVABLE = ("paper-4.1-helical", "paper-4.2-rotation", "paper-4.3", "paper-4.4-max")
_GAP = 5e-7
#: Seconds between two writings of what is known so far.
_WRITE_EVERY = 10.0
#: CPU seconds after which the turn of a peer on a case ends: quick ones make several attempts in each.
_TURN = 0.3
#: Losses of a peer's process on a case after which it is not begun again.
_MOST_LOSSES = 2


class Plan(NamedTuple):
    """How much is measured.

    Attributes:
        cases: names.
        seeds: most attempts of a peer on a case.
        budget: of each attempt; this program's own searches have none.
        pair_seconds: CPU seconds of all attempts of a peer on a case, after which it is left out.
        seconds: of the whole section.
        reference_starts: starts of the search for the best known F.
        proof_seconds: of each certificate of the best known F.
    """

    cases: tuple[str, ...]
    seeds: int
    budget: Budget
    pair_seconds: float
    seconds: float
    reference_starts: int
    proof_seconds: float


QUICK = Plan(("paper-4.1-helical", "paper-4.4-max", "delta"), 5, Budget(2_000, 0.2), 1.0, 50.0, 16, 2.0)
FULL = Plan(CASES, 100, Budget(50_000, 2.0), 9.0, 1_020.0, 256, 30.0)


class _Pair:
    """Attempts of one peer on one case."""

    def __init__(self, case: str, peer: Peer, note: str) -> None:
        self.case, self.peer, self.note = case, peer, note
        self.attempts: list[Attempt] = []
        self.seconds, self.losses = 0.0, 0

    def is_open(self, plan: Plan) -> bool:
        """Whether further attempts are to be made."""
        most = plan.seeds if self.peer.is_random else 1
        return (
            not self.note
            and self.losses < _MOST_LOSSES
            and len(self.attempts) < most
            and self.seconds < plan.pair_seconds
        )


def run(plan: Plan, keep: Callable[[object], None], peers: tuple[Peer, ...] | None = None) -> None:
    """Measure, and hand over what is known, every few seconds and at the end."""
    deadline = time.monotonic() + plan.seconds
    peers = all_peers() if peers is None else peers
    subjects, cases = {}, {}
    for name in plan.cases:
        print(f"  {name}: the best known F", file=sys.stderr, flush=True)
        subjects[name] = subject_of(name)
        cases[name] = _reference(name, subjects[name], plan)
    pairs = [_Pair(name, peer, _reason_against(peer, subjects[name])) for name in plan.cases for peer in peers]
    # In an order that favours no case and no peer, where the time ends within the first turn.
    random.Random(0).shuffle(order := list(pairs))  # noqa: S311 - an order, no secret
    workers = {peer.name: Worker(peer, subjects) for peer in peers}
    written, turn = time.monotonic(), 0
    try:
        while any(pair.is_open(plan) for pair in pairs) and time.monotonic() < deadline:
            turn += 1
            print(f"  turn {turn}: {sum(pair.is_open(plan) for pair in pairs)} pairs", file=sys.stderr, flush=True)
            for pair in order:
                if time.monotonic() > deadline:
                    break
                before = pair.seconds
                while pair.is_open(plan) and pair.seconds <= before + _TURN and time.monotonic() < deadline:
                    _attempt(pair, workers[pair.peer.name], plan)
                if time.monotonic() > written + _WRITE_EVERY:
                    written = time.monotonic()
                    keep(_data(plan, cases, peers, pairs))
    finally:
        for worker in workers.values():
            worker.end()
        keep(_data(plan, cases, peers, pairs))


def _attempt(pair: _Pair, worker: Worker, plan: Plan) -> None:
    """Make the next attempt of a pair."""
    began = time.monotonic()
    try:
        found = worker.attempt(pair.case, len(pair.attempts), plan.budget)
        pair.attempts.append(found)
        pair.seconds += found.seconds + found.polish_seconds
    except LostWorkerError as loss:
        pair.seconds += time.monotonic() - began
        pair.losses += 1
        if pair.losses >= _MOST_LOSSES:
            pair.note = str(loss)


def _reason_against(peer: Peer, subject: Subject) -> str:
    """Return why a peer cannot search a case; nothing where it can."""
    if not loads(peer.package):
        return f"{peer.package} is not installed, or does not load"
    has_equations = bool((subject.nlp.g_lower == subject.nlp.g_upper).any())
    return "has no equations" if has_equations and not peer.has_equations else ""


def _reference(name: str, subject: Subject, plan: Plan) -> dict[str, object]:
    """Return a case's data: sizes, the best F of many starts, and whether a certificate proves it."""
    began = time.process_time()
    formulate(case_of(name))
    formulated = time.process_time() - began
    nlp = subject.nlp
    solution = solve(subject.case, starts=plan.reference_starts, seed=12_345, jobs=1)
    proved = False
    if name in _PROVABLE:
        found = certify_program(nlp, solution.x, gap=_GAP, jobs=1, time_limit=plan.proof_seconds)
        proved = found.status is CertificateStatus.PROVED
    equal = nlp.g_lower == nlp.g_upper
    return {
        "variables": nlp.n,
        "constraints": int((~equal).sum()),
        "equations": int(equal.sum()),
        "F": solution.F,
        "status": solution.status.value,
        "is_proved": proved,
        "sign": nlp.sign,
        "scale": nlp.objective_scale,
        "starts": plan.reference_starts,
        "formulation_seconds": formulated,
    }


def _data(plan: Plan, cases: Mapping[str, object], peers: tuple[Peer, ...], pairs: list[_Pair]) -> dict[str, object]:
    """Return everything as JSON has it."""
    return {
        "plan": {**plan._asdict(), "budget": plan.budget._asdict()},
        "cases": dict(cases),
        "peers": [
            {
                "name": peer.name,
                "derivatives": peer.derivatives,
                "constraints": peer.constraints,
                "kind": peer.kind,
                "lines": peer.lines,
                "module": peer.module,
            }
            for peer in peers
        ],
        "pairs": [
            {
                "case": pair.case,
                "peer": pair.peer.name,
                "note": pair.note,
                "losses": pair.losses,
                "attempts": [_attempt_data(each) for each in pair.attempts],
            }
            for pair in pairs
        ],
    }


def _attempt_data(attempt: Attempt) -> dict[str, object]:
    """Return an attempt as JSON has it."""
    polished = None if attempt.polished is None else attempt.polished._asdict()
    return {**attempt._asdict(), "verdict": attempt.verdict._asdict(), "polished": polished}
