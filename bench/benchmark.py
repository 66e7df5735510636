"""Compare this program with other methods, and write docs/benchmarks.md: run by ``make bench``.

    python bench/benchmark.py                  # all of it, less than 30 minutes
    python bench/benchmark.py --quick          # less than 2 minutes; the page goes to the build folder
    python bench/benchmark.py --page           # write the page from the results of the last run, also of a broken one

Results are kept in build/bench as JSON, after each measurement. What would exceed ``--total`` is cut short or left out,
and the page says so.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from pathlib import Path

from comparison import certificates, evaluation, growth, page, race
from comparison.store import Store

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "bench"
PAGE = ROOT / "docs" / "benchmarks.md"
#: Sections in the order of their run: the longest last, as it can be cut short anywhere.
SECTIONS = {"evaluation": evaluation, "certificates": certificates, "growth": growth, "race": race}
#: Seconds of a whole run.
QUICK_TOTAL, FULL_TOTAL = 110.0, 1_740.0


def main() -> int:
    """Measure, and write the page; return 1 where a section failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few attempts, short limits")
    parser.add_argument("--total", type=float, metavar="SECONDS", help="most seconds of the whole run")
    parser.add_argument("--attempt", type=float, metavar="SECONDS", help="most CPU seconds of an attempt of a method")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="what is measured")
    parser.add_argument("--page", action="store_true", help="measure nothing, write the page from the last results")
    parser.add_argument("--write", action="store_true", help="write docs/benchmarks.md after a quick run too")
    chosen = parser.parse_args()
    path = BUILD / ("quick.json" if chosen.quick else "results.json")
    target = PAGE if chosen.write or not chosen.quick else BUILD / "benchmarks.md"
    if chosen.page:
        page.write(Store.read(path).data, PAGE, target)
        return 0
    usual = QUICK_TOTAL if chosen.quick else FULL_TOTAL
    total = chosen.total or usual
    store = Store.begin(path, "quick" if chosen.quick else "full")
    store.data["is_shortened"] = total < usual
    began, failed = time.monotonic(), False
    for name in chosen.sections:
        module = SECTIONS[name]
        plan = module.QUICK if chosen.quick else module.FULL
        left = total - (time.monotonic() - began)
        # A shorter run shortens each section, and the last one has what is left.
        if module is race and chosen.attempt:
            plan = plan._replace(budget=plan.budget._replace(seconds=chosen.attempt))
        seconds = min(left, plan.seconds if module is race else plan.seconds * min(1.0, total / usual))
        print(f"{name}: at most {seconds:.0f} s", file=sys.stderr, flush=True)
        if seconds <= 0:
            continue  # the page says that it was not measured
        try:
            module.run(plan._replace(seconds=seconds), store.keeper(name))
        except Exception:  # the other sections are measured all the same
            traceback.print_exc()
            failed = True
    store.data["seconds"] = round(time.monotonic() - began)
    store.write()
    page.write(store.data, PAGE, target)
    print(f"{store.data['seconds']} s, {path.relative_to(ROOT)}, {target.relative_to(ROOT)}", file=sys.stderr)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
