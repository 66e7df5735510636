"""Random cases with narrow ranges: the answer of every one, held to a search of another kind.

    python -P bench/narrow_ranges.py [cases] [first]

The cases and the search are those of tests/nlp/test_narrow_ranges.py, which holds the first 333 of the 1,000 cases that
are counted here by default. Prints each fault (there must be none), and CPU times.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "nlp"))

from test_narrow_ranges import fault_of


def main() -> int:
    """Print the faults, and return the exit status: 1 where there is any."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    began, faults = time.process_time(), 0
    for seed in range(first, first + count):
        if fault := fault_of(seed):
            faults += 1
            print(f"case {seed}: {fault}", flush=True)
    seconds = time.process_time() - began
    print(f"{count} cases from {first}: {faults} faults, {seconds:.0f} s of CPU, {1e3 * seconds / count:.0f} ms a case")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
