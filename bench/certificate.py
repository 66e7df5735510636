"""Boxes and CPU seconds of certificates: by case, by number of free variables, and by gap; and of checks.

    python -P bench/certificate.py
    python -P bench/certificate.py proofs

CPU time of this process on one thread, best of three where it is short, because the machine may be shared.
"""

import sys
import time

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, Free, Rotation, Solution, Task, load_case, solve
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import Certificate
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import program_of
from screwsynth.nlp.solver.certified import certify, proof_of

LIMIT = 60.0


def measure(solution: Solution, gap: float) -> tuple[Certificate, float]:
    """Return the certificate of a solution, and the CPU seconds of the fastest of up to three runs."""
    best = float("inf")
    for _ in range(3):
        began = time.process_time()
        found = certify_program(solution.nlp, solution.x, gap=gap, jobs=1, time_limit=LIMIT)
        best = min(best, time.process_time() - began)
        if best > 3:
            break
    return found, best


def row(name: str, solution: Solution, gap: float) -> None:
    """Print one row of the table."""
    found, seconds = measure(solution, gap)
    relative = "" if found.relative_gap is None else f"{found.relative_gap:.1e}"
    print(
        f"{name:34} {gap:7.0e} {found.status.value:10} {found.boxes:>9,} {seconds:9.3f} {relative}",
        flush=True,
    )


def proof_row(name: str, solution: Solution) -> None:
    """Print the size of a proof for a gap of 1e-4, and the CPU seconds of its search and of its check."""
    _, seconds = measure(solution, 1e-4)
    certified = certify(solution, gap=1e-4, jobs=1, time_limit=LIMIT, with_proof=True)
    if certified.tree is None:
        print(f"{name:34} not proved", flush=True)
        return
    (claim,) = proof_of(certified, "").claims
    began = time.process_time()
    verified = check_proof(claim, program_of(solution.case, certified.statement))
    spent = time.process_time() - began
    print(
        f"{name:34} {len(claim.tree):>9,} bytes {verified.leaves:>8,} leaves {verified.pieces:>8,} pieces "
        f"search {seconds:.3f} s, check {spent:.2f} s, {spent / seconds:.1f} times",
        flush=True,
    )


def proofs() -> None:
    """Print what proofs cost."""
    for name in ("paper-4.1-helical", "paper-4.1-rotation", "paper-4.3"):
        proof_row(name, solve(load_case(name), starts=8))
    for free in (6, 8):
        solution = solve(case_with(free), starts=16)
        proof_row(f"{solution.nlp.n} free variables", solution)


def case_with(free: int) -> Case:
    """Return the paper's screw motion with 2 to 9 free variables: pose first, then dimensions."""
    ranges = {
        "p_x": Free(-10.0, 10.0), "p_y": Free(-10.0, 10.0), "p_z": Free(20.0, 50.0), "x4": Free(0.0, 0.5235),
        "x2": Free(6.0, 10.0), "x3": Free(0.1, 0.5),
    }  # fmt: skip
    rotation = Rotation() if free < 5 else Rotation(axis=None, angle=Free(-0.5235987755982988, 0.5235987755982988))
    names = list(ranges)[: free if free < 5 else free - 3]
    p = [ranges["p_x"], ranges["p_y"], ranges["p_z"] if "p_z" in names else 35.0]
    held = {"x1": 12.0, "x2": 8.0, "x3": 0.5235, "x4": 0.14}
    parameters = {name: ranges[name] if name in names else value for name, value in held.items()}
    task = Task(load_case("paper-4.1-helical").tasks[0].twist)
    return Case(stewart_gough(), parameters, p, [task], rotation=rotation)


def main() -> None:
    """Print the table: cases, then gaps, then numbers of free variables."""
    print(f"{'case':34} {'asked':>7} {'status':10} {'boxes':>9} {'CPU s':>9} gap")
    for name in ("paper-4.1-helical", "paper-4.1-rotation", "paper-4.2-rotation", "paper-4.2-translation", "paper-4.3"):
        row(name, solve(load_case(name), starts=8), 1e-4)
    for gap in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        row("paper-4.1-helical", solve(load_case("paper-4.1-helical"), starts=8), gap)
    for free in range(2, 10):
        solution = solve(case_with(free), starts=16)
        row(f"{solution.nlp.n} free variables", solution, 1e-4)


if __name__ == "__main__":
    proofs() if sys.argv[1:] == ["proofs"] else main()
