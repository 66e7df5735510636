"""Time of whole commands beside the bare import of their libraries, taken in turns so that a busy machine burdens all.

Run by hand: ``.venv/bin/python bench/startup.py [rounds]``. The aims: a solve with 32 starts in at most 4 times the
import, and help in no more than it.
"""

import statistics
import subprocess
import sys
import time
from pathlib import Path

BIN = Path(sys.executable).parent
COMMANDS = {
    "import casadi, numpy": [str(BIN / "python"), "-c", "import casadi, numpy"],
    "screwsynth --help": [str(BIN / "screwsynth"), "--help"],
    "screwsynth solve paper-4.1-helical": [str(BIN / "screwsynth"), "solve", "paper-4.1-helical"],
}


def seconds(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
for command in COMMANDS.values():  # files into the cache
    seconds(command)
times = [[seconds(command) for command in COMMANDS.values()] for _ in range(rounds)]
base = [row[0] for row in times]
for name, column in zip(COMMANDS, zip(*times, strict=True), strict=True):
    ratio = statistics.median(c / b for c, b in zip(column, base, strict=True))
    print(f"{name:36s} median {1e3 * statistics.median(column):6.0f} ms   {ratio:5.2f} times the import")
