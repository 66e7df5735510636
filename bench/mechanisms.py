"""Random mechanisms against MuJoCo's constrained Jacobian: largest differences of F, of rates, and of spaces of twists.

    python -P bench/mechanisms.py            # 200 mechanisms, at home and at three closed configurations each
    python -P bench/mechanisms.py 20 300     # 20 of them, from seed 300 on

Robots that are refused, such as those whose passive joints leave the platform free, do not count.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from screwsynth.models.joints import RobotError

sys.path[:0] = [str(Path(__file__).parents[1] / each) for each in ("tests", "tests/models")]
from engine_comparison import compare  # noqa: E402 - the tests' comparison
from random_mechanisms import random_mechanism  # noqa: E402


def main(count: int, seed: int) -> None:
    """Compare so many mechanisms, and print a line for each."""
    worst, configurations, refused = np.zeros(3), 0, Counter[str]()
    done = 0
    while done < count:
        try:
            found = compare(random_mechanism(seed))
        except RobotError as error:
            refused[str(error)[:60]] += 1
        else:
            done, configurations = done + 1, configurations + found.configurations
            worst = np.maximum(worst, found[:3])
            print(seed, *(f"{value:.1e}" for value in found[:3]), found.configurations, flush=True)
        seed += 1
    print(f"{done} mechanisms, {configurations} configurations")
    print(f"F {worst[0]:.1e}, rates {worst[1]:.1e}, spaces {worst[2]:.1e}; refused:")
    print(dict(refused))


if __name__ == "__main__":
    main(*[int(each) for each in (sys.argv[1:3] + ["200", "0"][len(sys.argv) - 1 :])])
