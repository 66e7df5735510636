"""Random case files of all kinds, certified, and their proofs checked: how many are accepted, and at what cost.

    python -P bench/random_proofs.py [first] [last] [seconds] [journal]

A third of the cases are plain, a third has limits, and a third has several poses, some with limits. Prints each
rejection, and each bound that is below the best of some starts; then the counts and the CPU time of the check, with the
building of the program, over that of the search on one thread, with its proof. Each case is a line of JSON in the
journal; those that it already has are not run again.
"""

import json
import statistics
import sys
import time
import tomllib
from pathlib import Path

import numpy as np

from screwsynth.nlp import case_from_tables
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import program_of
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.solver.certified import certify, proof_of
from screwsynth.nlp.solver.solve import solve

#: Starts with the best of which a bound is compared, and the part of F by which it may be below, which is rounding.
STARTS, ROUNDING = 32, 1e-9


def random_case(seed: int) -> str:
    """Return a random case file."""
    rng = np.random.default_rng(seed)
    several, limited = seed % 3 == 2, seed % 3 == 1

    def free(low: float, high: float) -> str:
        return f"{{ min = {float(low)!r}, max = {float(high)!r} }}"

    ends = {"x1": (8.0, 12.0), "x2": (8.0, 12.0), "x3": (0.05, 0.5), "x4": (0.05, 0.5)}
    held = {
        "x1": rng.uniform(6, 15),
        "x2": rng.uniform(4, 10),
        "x3": rng.uniform(0.05, 0.5),
        "x4": rng.uniform(0.05, 0.5),
    }
    freed = set(rng.permutation(list(ends))[: rng.integers(0, 3)].tolist())
    lines = ["[units]", 'angle = "rad"', "[robot]", 'model = "stewart-gough"']
    lines += [f'layout = "{rng.choice(["aligned", "octahedral"])}"', "[robot.parameters]"]
    lines += [f"{name} = {free(*ends[name]) if name in freed else repr(float(held[name]))}" for name in ends]
    position = [free(-w, w) for w in rng.uniform(1, 8, 2)] + [free(25, 25 + rng.uniform(3, 20))]
    size = float(rng.uniform(0.05, 0.5))
    rotation = f"angle = {free(-size, size)}"
    if rng.random() < 0.2:
        rotation = f"axis = {rng.normal(size=3).tolist()}, {rotation}"
    for i in range(2 - len(freed)):
        if rng.random() < 0.5:
            position[i] = repr(float(rng.uniform(-5, 5)))
    if several and rng.random() < 0.5:
        rotation = f"axis = [0, 0, 1], angle = {float(rng.uniform(-0.3, 0.3))!r}"
    lines += ["[pose]", f"position = [{', '.join(position)}]", f"rotation = {{ {rotation} }}"]
    if several:
        lines.append("along_task = { first = -0.2, last = 0.15, count = 3 }")
    point = (rng.normal(size=3) * rng.choice([1.0, 10.0])).tolist()
    lines += [
        "[[task]]",
        'name = "t"',
        f'sense = "{rng.choice(["max", "min"])}"',
        f"axis = {rng.normal(size=3).tolist()}",
    ]
    lines += [f"point = {point}", f"pitch = {float(rng.uniform(-2, 2))!r}"]
    if limited or (several and rng.random() < 0.6):
        limits = [
            f"leg_length = {free(rng.uniform(15, 28), rng.uniform(32, 50))}",
            f"base_joint_angle = {float(rng.uniform(0.3, 0.8))!r}",
            f"platform_joint_angle = {float(rng.uniform(0.3, 0.8))!r}",
            f"radius_ratio = {free(rng.uniform(0.3, 0.6), rng.uniform(0.7, 1.2))}",
            f"joint_spacing = {{ min = {float(rng.uniform(0.2, 2))!r} }}",
            f"rate_share = {{ max = {float(rng.uniform(0.25, 0.6))!r} }}",
            f"footprint = {{ base = {float(rng.uniform(9, 13))!r} }}",
        ]
        lines += ["[limits]", *(each for each in limits if rng.random() < 0.35)]
    return "\n".join(lines) + "\n"


def examine(seed: int, seconds: float) -> dict[str, object]:
    """Certify a random case and check its proof."""
    text = random_case(seed)
    case = case_from_tables(tomllib.loads(text), name=f"random {seed}", source="random")
    solution = solve(case, starts=STARTS, jobs=1)
    began = time.process_time()
    certified = certify(solution, gap=1e-4, time_limit=seconds, jobs=1, with_proof=True)
    search = time.process_time() - began
    certificate = certified.certificate
    row: dict[str, object] = {"seed": seed, "search": search, "outcome": "not proved"}
    own = solution.outcomes[0].own
    sign = -own.nlp.sign
    best = max((sign * start.F for start in own.starts if start.violation <= ROUNDING), default=-np.inf)
    if certificate is not None:
        # Where no start is feasible, nothing is compared.
        row["compared"] = bool(np.isfinite(best))
        row["below"] = bool(sign * certificate.bound < best - ROUNDING * max(abs(best), 1e-6 * own.nlp.objective_scale))
    if certified.tree is None or certificate is None:
        return row
    row |= {"bytes": len(certified.tree), "boxes": certificate.boxes}
    proof = proof_of(certified, text)
    began = time.process_time()
    try:
        verified = check_proof(proof.claims[0], program_of(case, certified.statement))
        row |= {"outcome": "accepted", "leaves": verified.leaves, "pieces": verified.pieces}
    except ProofError as error:
        row |= {"outcome": "rejected", "message": str(error)}
    return row | {"check": time.process_time() - began}


def print_summary(rows: list[dict[str, object]]) -> None:
    """Print the counts, and the ratios of CPU times."""
    count = {each: sum(row["outcome"] == each for row in rows) for each in ("accepted", "rejected", "not proved")}
    ratios = [float(str(row["check"])) / float(str(row["search"])) for row in rows if "check" in row]
    print(", ".join(f"{name} {number}" for name, number in count.items()))
    compared = [row for row in rows if row.get("compared")]
    plain = sum(int(str(row["seed"])) % 3 == 0 for row in compared)
    print(f"bounds compared with {STARTS} starts: {len(compared)} ({plain} plain), below the best: "
          f"{sum(bool(row['below']) for row in compared)}")  # fmt: skip
    if ratios:
        largest = max((int(str(row["bytes"])) for row in rows if "check" in row), default=0)
        print(f"check over search: median {statistics.median(ratios):.1f}, largest {max(ratios):.1f}, above 20: "
              f"{sum(ratio > 20 for ratio in ratios)}; largest tree {largest} bytes", flush=True)  # fmt: skip


def main() -> None:
    """Certify and check random cases, and print the counts."""
    first, last, seconds = (float(text) for text in [*sys.argv[1:4], *("0", "300", "4")[len(sys.argv[1:4]) :]])
    journal = Path(sys.argv[4]) if len(sys.argv) > 4 else None
    rows: list[dict[str, object]] = []
    if journal is not None and journal.exists():
        rows = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines()]
    done = {row["seed"] for row in rows}
    for seed in range(int(first), int(last)):
        if seed in done:
            continue
        row = examine(seed, seconds)
        rows.append(row)
        if row["outcome"] == "rejected":
            print(f"{seed}: {row['message']}", flush=True)
        if row.get("below"):
            print(f"{seed}: the bound is below the best start", flush=True)
        if journal is not None:
            with journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    print_summary([row for row in rows if first <= int(str(row["seed"])) < last])


if __name__ == "__main__":
    main()
