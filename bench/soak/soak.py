"""Soak of generated C: 20,000 ticks of each case, judged by formulas that are not the program's. Run by hand:

    .venv/bin/python -P bench/soak/soak.py [--ticks N] [--seed N] [--tasks N] [CASE ...]

Tasks, limits, ranges (down to equal bounds), budgets and odd numbers change from tick to tick. Cases are shipped ones,
and starters of robots with loops. Worst cases are solved for random tasks too, beside a random search of many points.
The command ends with status 1 where there is a fault.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parent))
from optima import compared, stationarity
from ticks import FORMULAS, OK, Robot, next_tick, soak, solved

from screwsynth.models import robot_function
from screwsynth.nlp import case_from_tables, generate_c, load_case, load_compiled, shipped_cases
from screwsynth.nlp.starter.text import starter_case

WORST = ("camera-mount", "flight-simulator")
TRACKS = 200
#: Largest KKT residual by differences, in parts of a bound of F, and by how much a random search may be better.
_STATIONARY, _BETTER, _MUCH = 1e-6, 1e-9, 1e-3


def robot_of(name: str, folder: Path) -> Robot:
    """Return a case in C and its formulas."""
    if name in shipped_cases():
        case = load_case(name)
    else:
        case = case_from_tables(tomllib.loads(starter_case(robot_function(name)())), name=name, source=name)
    folder.mkdir()
    for file, text in generate_c(case, "").items():
        (folder / file).write_text(text, encoding="utf-8")
    return Robot(load_compiled(folder), 1.0 if case.tasks[0].sense.value == "max" else -1.0)


def residuals(robot: Robot, seed: int, ticks: int) -> list[float]:
    """Return KKT residuals of answers that are said to be optima, by differences."""
    rng = np.random.default_rng(seed)
    x = np.tile(robot.compiled.solve(threads=1).x, (20, 1))
    p, found = np.tile(robot.defaults, (20, 1)), []
    for _ in range(ticks):
        tick = next_tick(robot, x, p, rng)
        answers = solved(robot, tick)
        good = (answers.status == OK) & (tick.odd < 0)
        found += [stationarity(robot, tick, answers.x, int(row)) for row in np.flatnonzero(good)]
        x, p = np.where(good[:, None], answers.x, x), np.where(good[:, None], tick.p, robot.defaults)
    return found


def main() -> int:
    """Soak the cases, and print a line of each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=20_000, help="ticks of each case")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tasks", type=int, default=1_000, help="random tasks of each worst case")
    parser.add_argument("cases", nargs="*", default=[*FORMULAS])
    given = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as root:
        for name in given.cases:
            robot = robot_of(name, Path(root) / name)
            statuses, faults, places = soak(robot, given.ticks, TRACKS, given.seed)
            wrong += faults.total()
            print(f"{name}: {dict(statuses.most_common())}; faults: {dict(faults) or 'none'}", flush=True)
            for fault, tick, row in places[:10]:
                print(f"  {fault}: tick {tick}, row {row}")
            off = residuals(robot, given.seed, max(1, given.ticks // 1000))
            bad = sum(each > _STATIONARY for each in off)
            wrong += bad
            print(
                f"  KKT residual by differences of {len(off)} optima: at most {max(off):.1e}; {bad} faults", flush=True
            )
            if name in WORST and given.tasks:
                rng = np.random.default_rng(given.seed)
                p = np.tile(robot.defaults, (given.tasks, 1))
                p[:, robot.twists] = rng.normal(size=(given.tasks, len(robot.twists)))
                p[:, robot.twists] *= 10 ** rng.uniform(-2, 2, (given.tasks, 1))
                found, better = compared(robot, p, rng)
                # An optimum is local: a better one that no seed reached is a fault where it is much better.
                bad = int(np.sum((better > _MUCH) | (found.status != OK)))
                wrong += bad
                print(
                    f"  {given.tasks} tasks: {int((found.status == OK).sum())} OK; a random search is better in "
                    f"{int((better > _BETTER).sum())} (by {max(better.max(), 0.0):.1e} of F at most), "
                    f"and misses {np.median(-better):.1e} of F in the median, "
                    f"{np.quantile(-better, 0.99):.1e} in 1 of 100, {np.max(-better):.1e} at most",
                    flush=True,
                )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
