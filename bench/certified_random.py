"""Random problems: certified bounds against the best of many Ipopt starts, and the cost of the certificates.

    python -P bench/certified_random.py [problems] [starts] [gap] [seconds] [processes]

Random platforms, layouts, twists, boxes and senses with 4 to 8 free variables, most with a rotation ball that is often
active. Prints violations (there must be none), how many searches did not reach the gap, and times. Cases with limits or
several poses: ``bench/random_proofs.py``, which compares bounds with starts too.
"""

import statistics
import sys
import time
from multiprocessing import get_context

import numpy as np

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, Free, Rotation, Task, formulate
from screwsynth.nlp.case.case import Search
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.solver.multistart import solve_program


def random_case(seed: int) -> Case:
    """Return a random case."""
    rng = np.random.default_rng(seed)
    parameters: dict[str, object] = {
        "x1": rng.uniform(6, 15), "x2": rng.uniform(4, 10), "x3": rng.uniform(0.05, 0.5), "x4": rng.uniform(0.05, 0.5)
    }  # fmt: skip
    freed = rng.permutation(["x1", "x2", "x3", "x4"])[: rng.integers(0, 3)]
    for name in freed:
        parameters[str(name)] = Free(8.0, 12.0) if name in ("x1", "x2") else Free(0.05, 0.5)
    position: list[object] = [Free(-w, w) for w in rng.uniform(1, 8, 2)] + [Free(25.0, 25 + rng.uniform(3, 20))]
    size = rng.uniform(0.05, 0.5)
    rotation = Rotation(axis=None, angle=Free(-size, size))
    if rng.random() < 0.2:
        rotation = Rotation(axis=rng.normal(size=3), angle=Free(-size, size))
    for i in range(2 - len(freed)):
        if rotation.axis is None and rng.random() < 0.5:
            position[i] = float(rng.uniform(-5, 5))
    twist = np.concatenate([rng.normal(size=3), rng.normal(size=3) * rng.choice([1.0, 10.0])])
    task = Task(twist, "max" if rng.random() < 0.5 else "min")
    layout = "aligned" if rng.random() < 0.5 else "octahedral"
    return Case(stewart_gough(layout=layout), parameters, position, [task], rotation=rotation)


def compare_with_starts(job: tuple[int, int, float, float]) -> dict[str, object]:
    """Certify a random problem, and compare its bound with the best of its starts."""
    seed, starts, gap, limit = job
    nlp = formulate(random_case(seed))
    solution = solve_program(nlp, Search(starts=starts, seed=seed), jobs=1)
    known = solution.x if solution.status.is_answer else None
    began = time.process_time()
    proved = certify_program(nlp, known, gap=gap, time_limit=limit, jobs=1)
    seconds = time.process_time() - began
    sign = -nlp.sign
    best = max((sign * start.F for start in solution.starts if start.violation <= 1e-9), default=-np.inf)
    active = solution.evidence is not None and any(side.name == "angle" for side in solution.evidence.active)
    return {
        "seed": seed, "n": nlp.n, "status": proved.status.value, "boxes": proved.boxes, "seconds": seconds,
        "violated": bool(sign * proved.bound < best - 1e-9 * max(abs(best), nlp.objective_scale * 1e-6)),
        "active": active, "relative": proved.relative_gap, "beaten": proved.was_beaten,
    }  # fmt: skip


def print_summary(rows: list[dict[str, object]], starts: float, gap: float, limit: float) -> None:
    """Print violations, searches that did not reach the gap, and times."""
    print(f"{len(rows)} problems, {int(starts)} starts each, gap {gap:g}, limit {limit:g} s")
    print(f"bounds below the best start: {sum(bool(row['violated']) for row in rows)}")
    print(f"ball active at the optimum: {sum(bool(row['active']) for row in rows)}")
    print(f"incumbent of all starts beaten: {sum(bool(row['beaten']) for row in rows)}")
    for status in sorted({str(row["status"]) for row in rows}):
        print(f"{status}: {sum(row['status'] == status for row in rows)}")
    left = [row for row in rows if row["status"] != "proved"]
    print("not proved:", [(row["seed"], row["n"], row["relative"]) for row in left])
    for n in sorted({int(str(row["n"])) for row in rows}):
        seconds = sorted(float(str(row["seconds"])) for row in rows if row["n"] == n)
        boxes = sorted(int(str(row["boxes"])) for row in rows if row["n"] == n)
        print(
            f"n = {n}: {len(seconds)} problems, CPU s median {statistics.median(seconds):.3f}, worst "
            f"{seconds[-1]:.2f}; boxes median {statistics.median(boxes):.0f}, worst {boxes[-1]}"
        )
    every = [float(str(row["seconds"])) for row in rows]
    print(f"all: CPU s median {statistics.median(every):.3f}, worst {max(every):.2f}", flush=True)


def main() -> None:
    """Examine random problems, in two processes unless told, and print a summary now and then."""
    given = [*sys.argv[1:], *("500", "256", "1e-4", "60", "2")[len(sys.argv) - 1 :]]
    problems, starts, gap, limit, processes = (float(text) for text in given)
    jobs = [(seed, int(starts), gap, limit) for seed in range(int(problems))]
    rows: list[dict[str, object]] = []
    with get_context("spawn").Pool(int(processes)) as pool:
        for row in pool.imap_unordered(compare_with_starts, jobs):
            rows.append(row)
            if len(rows) % 50 == 0 or len(rows) == len(jobs):
                print_summary(rows, starts, gap, limit)


if __name__ == "__main__":
    main()
