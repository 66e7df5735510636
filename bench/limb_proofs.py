"""Proofs by limbs: CPU seconds of the search without and with a proof, size of the proof, and CPU seconds of its check.

    python -P bench/limb_proofs.py                  # every row
    python -P bench/limb_proofs.py pose 0.1 1e-3    # 36 joint coordinates, a tenth of the pose's ranges, this gap
    python -P bench/limb_proofs.py paper-4.4-max 1e-3
    python -P bench/limb_proofs.py poses 1e-4       # robots of 5 to 10 numbers at several poses

The hexapod is that of ``limbs.py``; its pose is free within a part of 3, 3 and 2 in and of 10 degrees.
"""

import sys
import time
from pathlib import Path

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Free, Rotation, load_case, solve
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import OPTIMUM, Proof, ProofClaim, Statement

sys.path[:0] = [str(Path(__file__).parents[1] / each) for each in ("bench", "tests", "tests/models")]
from limb_cases import poses  # noqa: E402 - the tests' cases
from limbs import ANGLE, machine  # noqa: E402

ROWS = [
    ("pose", "0.1", "1e-2"), ("pose", "0.1", "1e-3"), ("pose", "0.1", "1e-4"),
    ("pose", "0.3", "1e-2"), ("pose", "0.3", "1e-3"), ("pose", "0.3", "1e-4"),
    ("pose", "1", "0.3"), ("pose", "1", "0.1"),
    ("paper-4.4-min", "1e-4"), ("paper-4.4-max", "1e-2"), ("paper-4.4-max", "1e-3"), ("paper-4.4-max", "1e-4"),
    ("poses", "1e-4"),
]  # fmt: skip


def near_home(part: float) -> Case:
    """Return the hexapod with every joint coordinate free within 2 in, and its pose within a part of its ranges."""
    case = machine(2.0)
    position: list[object] = [Free(-3 * part, 3 * part), Free(-3 * part, 3 * part), Free(20 - 2 * part, 20 + 2 * part)]
    rotation = Rotation(axis=None, angle=Free(-ANGLE * part, ANGLE * part))
    return Case(hexapod(), case.parameters, position, [case.tasks[0]], rotation=rotation)


def measure(name: str, case: Case, gap: float, limit: float = 120.0) -> None:
    """Print a row."""
    solution = solve(case, starts=4)
    nlp, times = solution.nlp, [time.process_time()]
    plain = certify_program(nlp, solution.x, gap=gap, jobs=1, time_limit=limit)
    times.append(time.process_time())
    recorder = TreeRecord()
    found = certify_program(nlp, solution.x, gap=gap, jobs=1, time_limit=limit, recorder=recorder)
    times.append(time.process_time())
    begin = f"{name:24} {nlp.n:3} {gap:8g} {plain.boxes:9,} {times[1] - times[0]:7.2f} s"
    if found.status.value != "proved":
        print(f"{begin}  {found.status.value}: {found.reason}", flush=True)
        return
    claim = ProofClaim(OPTIMUM, "", "program", -nlp.sign * found.bound, fingerprint(nlp), recorder.tree())
    size = len(Proof("", name, Statement(), (claim,)).as_text()) / 1000
    times.append(time.process_time())
    checked = check_proof(claim, nlp)
    check = time.process_time() - times[-1]
    ratio = check / (times[2] - times[1])
    print(f"{begin} {found.boxes:9,} {times[2] - times[1]:7.2f} s {checked.leaves:8,} {size:7,.0f} kB "
          f"{checked.pieces:9,} {check:7.2f} s {ratio:6.1f}", flush=True)  # fmt: skip


def several_poses(gap: float) -> None:
    """Print rows for robots at several poses, searched by limbs although they have few variables."""
    usual, branch_and_bound._WHOLE_BOX = branch_and_bound._WHOLE_BOX, 0
    for seed in range(12):
        measure(f"poses {seed}", poses(seed), gap, 20.0)
    branch_and_bound._WHOLE_BOX = usual


def main() -> None:
    """Print the rows asked for."""
    rows = [tuple(sys.argv[1:])] if len(sys.argv) > 1 else ROWS
    print("case, variables, gap; boxes, search; boxes, search with proof; leaves, size; boxes, check; check/search")
    for row in rows:
        if row[0] == "pose":
            measure(f"36 joints, {row[1]} of pose", near_home(float(row[1])), float(row[2]))
        elif row[0] == "poses":
            several_poses(float(row[1]))
        else:
            measure(row[0], load_case(row[0]), float(row[1]))


if __name__ == "__main__":
    main()
