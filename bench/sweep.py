"""Time of a sweep over 10,000 tasks of Section 4.1 with 8 starts, and memory of one over a million points.

The million points have made-up rows: what is measured is the journal and the table, which hold everything else back.
Run with the package's environment: ``python -P bench/sweep.py``.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.output.sweeptable import table_rows, write_table
from screwsynth.nlp.sweeps.journal import Row
from screwsynth.nlp.sweeps.points import CaseSource, grid
from screwsynth.nlp.sweeps.sweep import Sweep

CASE = "paper-4.1-helical"
NAMES = [f"task.{part}" for part in ("axis_x", "axis_y", "axis_z", "point_x", "point_y", "point_z", "pitch")]


def timed(folder: str, count: int = 10_000) -> None:
    """Sweep random tasks twice: the first run compiles."""
    random = np.random.default_rng(7)
    axes, points = random.normal(size=(count, 3)), random.uniform(-10, 10, (count, 3))
    tasks = np.column_stack([axes, points, random.uniform(-3, 3, count)])
    file = Path(folder) / "tasks.csv"
    lines = [",".join(map(repr, row)) for row in tasks.tolist()]
    file.write_text("\n".join([",".join(NAMES), *lines]) + "\n", encoding="utf-8")
    for run in ("with compiling", "compiled before"):
        out = Path(folder) / f"{run.split()[0]}-{run.split()[1]}.csv"
        began, before = time.perf_counter(), os.times()
        command = [
            sys.executable,
            "-P",
            "-m",
            "screwsynth.nlp",
            "sweep",
            CASE,
            "--over",
            str(file),
            "--out",
            str(out),
        ]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        after = os.times()
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        print(f"{count:,} tasks, {run}: {time.perf_counter() - began:.1f} s, {spent:.1f} s of processor time")


def memory(folder: str) -> None:
    """Write a million made-up rows through journal and table."""
    sweep = Sweep.of(CaseSource.from_file(read_case(CASE)), grid(["task.pitch=0:2:1000", "x1=10:14:1000"]))
    out = str(Path(folder) / "million.parquet")
    count, began = len(sweep.points), time.perf_counter()
    active, multipliers = ("p_x min", "p_y min", "p_z max"), (1 / 3, 2 / 7, 5 / 3)
    with sweep.journal_of(out) as journal:
        for first in range(0, count, 512):
            journal.add(
                Row(
                    k,
                    "optimal",
                    k / 3,
                    (k / 7,) * 6,
                    active,
                    multipliers,
                    "strict local maximum",
                    1e-13 / 3,
                    1e-17 / 3,
                    0.1,
                )
                for k in range(first, min(first + 512, count))
            )
        size = Path(f"{out}.journal").stat().st_size
        appended = time.perf_counter() - began
        with_rows = time.perf_counter()
        write_table(out, sweep, journal.rows())
        written = time.perf_counter() - with_rows
        journal.remove()
    table_rows(out, sweep, shown=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    times = f"journal of {size / 1e6:.0f} MB in {appended:.0f} s, table in {written:.0f} s"
    print(f"{count:,} rows: {times}, {peak:.0f} MB of memory")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        memory(temporary)
        timed(temporary)
