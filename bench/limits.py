"""Time of a case with its limits beside the same case without, in turns, and the number of starts at the optimum.

Run by hand: ``.venv/bin/python bench/limits.py [rounds]``. The aims for hexapod-machining: at most 5 times, and at
least 90 % of the starts, whatever the seed.
"""

import copy
import statistics
import sys
import tomllib

from screwsynth.nlp import case_from_tables, solve
from screwsynth.nlp.case.source import find_case

rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
tables = tomllib.loads(find_case("hexapod-machining").read_text(encoding="utf-8"))
free = copy.deepcopy(tables)
del free["limits"]
singular = copy.deepcopy(tables)
singular["limits"]["smallest_singular_value"] = {"min": 0.9, "length": 11.5}
variants = {"unlimited": free, "limited": tables, "limited, with a singular value": singular}
seconds: dict[str, list[float]] = {name: [] for name in variants}
for round_ in range(rounds):
    for name, each in variants.items():
        case = case_from_tables(copy.deepcopy(each), name=name, source=name)
        solution = solve(case, seed=round_)
        seconds[name].append(solution.seconds)
        if not round_ or name == "limited":
            best = solution.optima[0]
            print(f"{name}, seed {round_}: F = {best.F:.6f} from {best.count} of {len(solution.starts)} starts")
for name, times in seconds.items():
    ratio = statistics.median(t / f for t, f in zip(times, seconds["unlimited"], strict=True))
    print(f"{name:34s} median {1e3 * statistics.median(times):6.0f} ms   {ratio:5.2f} times the unlimited")
