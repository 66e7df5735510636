"""What the campaigns share: cases with seeds, a journal from which a campaign is resumed, and the command line.

    python bench/soundness/NAME.py COUNT FIRST [JOURNAL]

Seeds that a journal has are not run again. Nothing here or beside it looks inside the package: a campaign calls the
command line or public names, and judges with arithmetic of its own.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from screwsynth.nlp.cli.main import run

Row = dict[str, Any]


def command(*words: str) -> tuple[int, str, str]:
    """Run the command line in this process; return exit status, standard output and standard error."""
    before, sys.argv = sys.argv, ["screwsynth", *words]
    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = run()
    finally:
        sys.argv = before
    return code, out.getvalue(), err.getvalue()


def judged(text: str, *words: str) -> tuple[Any, Row]:
    """Return the result of ``workspace`` for a case, or None and the row of a seed without one."""
    with tempfile.TemporaryDirectory() as folder:
        case, out = Path(folder) / "case.toml", Path(folder) / "result.json"
        case.write_text(text, encoding="utf-8")
        code, _, err = command("workspace", str(case), *words, "--json", str(out))
        if out.exists():
            return json.loads(out.read_text(encoding="utf-8")), {}
    if code == 2:
        return None, {"counts": {f"refused: {err.strip()[-60:]}": 1}, "faults": []}
    return None, {"counts": {"failed": 1}, "faults": [err]}


def campaign(examine: Callable[[int], Row]) -> list[Row]:
    """Examine the seeds that the words of the command ask for, write the journal, and print faults and counts.

    Returns the rows of these seeds.

    Args:
        examine: of a seed; its row has ``faults``, a list of sentences, and ``counts``, numbers by their names.
    """
    count, first = int(sys.argv[1]), int(sys.argv[2])
    journal = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    rows: list[Row] = []
    if journal is not None and journal.exists():
        rows = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines()]
    done = {row["seed"] for row in rows}
    for seed in range(first, first + count):
        if seed in done:
            continue
        began = time.perf_counter()
        try:
            row = examine(seed)
        except Exception:
            row = {"counts": {"errors": 1}, "faults": [traceback.format_exc(limit=-6)]}
        row |= {"seed": seed, "seconds": round(time.perf_counter() - began, 2)}
        rows.append(row)
        for fault in row["faults"]:
            print(f"{seed}: {fault}", flush=True)
        if journal is not None:
            with journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    rows = [row for row in rows if first <= row["seed"] < first + count]
    counts: Counter[str] = Counter()
    for row in rows:
        counts.update(row["counts"])
    faults, seconds = sum(len(row["faults"]) for row in rows), sum(row["seconds"] for row in rows)
    print(f"{len(rows)} seeds in {seconds:.0f} s, faults: {faults}")
    for name, number in sorted(counts.items()):
        print(f"  {name}: {number}")
    return rows
