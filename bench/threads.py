"""Two threads beside one: wall times of searches that take over a second, and what their CPU times allow.

    python bench/threads.py            # all cases, three pairs of runs each
    python bench/threads.py 5 paper    # five pairs of one case

Runs with one and two threads alternate; wall times mean something on a machine that does nothing else. "serial" is the
part of the CPU time outside of what threads share, and "of pieces" the ratio of wall times that the CPU times of all
pieces allow: each piece is run by itself, and goes to the thread that would be free first. The boxes must be the same.
"""

import heapq
import sys
import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

from certificate import case_with
from limbs import machine

from screwsynth.nlp import Case, Solution, load_case, solve
from screwsynth.nlp.proof.boxes.engine import Threads
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import Certificate

#: Cases by name, and gaps for which the search takes a second or more.
CASES: dict[str, tuple[Callable[[], Case], float]] = {
    "paper": (lambda: load_case("paper-4.3"), 1e-4),
    "eight": (lambda: case_with(8), 1e-4),
    "machining": (lambda: load_case("hexapod-machining"), 0.5),
    "pose": (lambda: machine(2.0, pose_is_free=True), 1e-3),
}


class Times(NamedTuple):
    """CPU seconds of pieces, one by one, and of the longest thread of each step."""

    pieces: float
    steps: float


class Planned(Threads):
    """Threads that run nothing beside each other, and note how long each of some would take."""

    measured: Times

    def map(self, function: Callable, items: Iterable) -> list:
        """Run one item after the other."""
        if self.jobs == 1:  # the kernel of a limb, which is a piece itself
            return [function(each) for each in items]
        results, busy, total = [], [0.0] * self.jobs, 0.0
        for each in items:
            began = time.thread_time()
            results.append(function(each))
            seconds = time.thread_time() - began
            total += seconds
            heapq.heapreplace(busy, busy[0] + seconds)
        Planned.measured = Times(Planned.measured.pieces + total, Planned.measured.steps + max(busy))
        return results


def run(solution: Solution, gap: float, jobs: int) -> tuple[Certificate, float, float]:
    """Return a certificate, and the wall and CPU seconds it takes."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = certify_program(solution.nlp, solution.x, gap=gap, jobs=jobs, time_limit=300.0)
    return found, time.perf_counter() - wall, time.process_time() - cpu


def planned(solution: Solution, gap: float) -> tuple[float, float]:
    """Return the serial part of the CPU time, and the ratio that the pieces for two threads allow."""
    Planned.measured = Times(0.0, 0.0)
    original, Threads.map = Threads.map, Planned.map
    try:
        _, _, cpu = run(solution, gap, 2)
    finally:
        Threads.map = original
    serial = cpu - Planned.measured.pieces
    return serial / cpu, cpu / (serial + Planned.measured.steps)


def main(pairs: int, names: Iterable[str]) -> None:
    """Print a row for each case."""
    print(f"{'case':10} {'boxes':>9} {'serial':>7} {'of pieces':>9} {'1 thread, s':>12} {'2 threads, s':>12}  ratios")
    for name in names:
        make, gap = CASES[name]
        solution = solve(make(), starts=8)
        serial, allowed = planned(solution, gap)
        one, two = [], []
        for _ in range(pairs):
            first, alone, _ = run(solution, gap, 1)
            second, both, _ = run(solution, gap, 2)
            if (first.boxes, first.bound, first.incumbent) != (second.boxes, second.bound, second.incumbent):
                raise SystemExit(f"{name}: two threads have other boxes or bounds than one")
            one.append(alone)
            two.append(both)
        ratios = " ".join(f"{a / b:.2f}" for a, b in zip(one, two, strict=True))
        print(
            f"{name:10} {first.boxes:9,} {serial:7.1%} {allowed:9.2f} {min(one):12.2f} {min(two):12.2f}  {ratios}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3, sys.argv[2:] or CASES)
