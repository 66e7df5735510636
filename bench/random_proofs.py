"""Random case files of all kinds, certified, and their proofs checked: how many are accepted, and at what cost.

    python -P bench/random_proofs.py [first] [last] [seconds]

A third of the cases are plain, a third has limits, and a third has several poses, some with limits. Prints each
rejection, then the counts and the median of the CPU time of the check over the time of the search on one thread.
"""

import statistics
import sys
import time
import tomllib

import numpy as np

from screwsynth.nlp import case_from_tables
from screwsynth.nlp.certificate.paper.proof import ProofError
from screwsynth.nlp.certificate.paper.proofcheck import check_proof
from screwsynth.nlp.solver.certified import certify, program_of, proof_of

#: Bytes of a tree above which its check is left out: it takes too long for a run of hundreds.
LARGEST = 12_000


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


def main() -> None:
    """Certify and check random cases, and print the counts."""
    first, last, seconds = (float(text) for text in [*sys.argv[1:], *("0", "300", "4")[len(sys.argv) - 1 :]])
    accepted, rejected, unproved, large, ratios = 0, 0, 0, 0, []
    for seed in range(int(first), int(last)):
        text = random_case(seed)
        case = case_from_tables(tomllib.loads(text), name=f"random {seed}", source="random")
        certified = certify(case, gap=1e-4, starts=4, time_limit=seconds, jobs=1, with_proof=True)
        certificate = certified.certificate
        if certified.tree is None or certificate is None:
            unproved += 1
            continue
        if len(certified.tree) > LARGEST:
            large += 1
            continue
        proof = proof_of(certified, text)
        began = time.process_time()
        try:
            check_proof(proof, program_of(case, proof.statement))
            accepted += 1
        except ProofError as error:
            rejected += 1
            print(f"{seed}: {error}", flush=True)
        ratios.append((time.process_time() - began) / max(certificate.seconds, 1e-6))
    print(f"accepted {accepted}, rejected {rejected}, too large {large}, not proved {unproved}; "
          f"check over search: median {statistics.median(ratios):.1f}")  # fmt: skip


if __name__ == "__main__":
    main()
