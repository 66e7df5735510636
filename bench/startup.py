"""Time of whole commands beside the bare import of their libraries, run in turns so that a busy machine slows all.

Run by hand: ``.venv/bin/python bench/startup.py [rounds] [bin folder of another environment]``. The aims: a solve with
32 starts in at most twice the import, and help in 0.35 of it. With another environment, such as one with an older
version, every command is run in both, one after the other, and the median of the differences is shown. The modules
have to be compiled before, as ``make`` does: with ``PYTHONDONTWRITEBYTECODE`` each run would compile them again.
"""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

BIN = Path(sys.executable).parent
BASE = "import casadi, numpy"
COMMANDS = {
    BASE: ["python", "-P", "-c", BASE],
    "import screwsynth": ["python", "-P", "-c", "import screwsynth"],
    "import screwsynth.nlp": ["python", "-P", "-c", "import screwsynth.nlp"],
    "screwsynth --version": ["screwsynth", "--version"],
    "screwsynth --help": ["screwsynth", "--help"],
    "screwsynth evaluate paper-4.1-helical": ["screwsynth", "evaluate", "paper-4.1-helical"],
    "screwsynth solve paper-4.1-helical": ["screwsynth", "solve", "paper-4.1-helical"],
}


def measure(folder: Path, command: list[str]) -> tuple[float, float]:
    """Return wall and processor milliseconds of a command in an environment."""
    began = time.perf_counter()
    running = subprocess.Popen([folder / command[0], *command[1:]], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, command)
    return 1e3 * (time.perf_counter() - began), 1e3 * (used.ru_utime + used.ru_stime)


rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
folders = [BIN, *(Path(argument) for argument in sys.argv[2:3])]
runs = [(name, folder) for name in COMMANDS for folder in folders]
for name, folder in runs:  # files into the cache
    measure(folder, COMMANDS[name])
taken: dict[tuple[str, Path], list[tuple[float, float]]] = {run: [] for run in runs}
for k in range(rounds):
    for run in runs if k % 2 else reversed(runs):
        taken[run].append(measure(run[1], COMMANDS[run[0]]))
base = [processor for _, processor in taken[BASE, BIN]]
for name in COMMANDS:
    wall, processor = zip(*taken[name, BIN], strict=True)
    ratio = statistics.median(p / b for p, b in zip(processor, base, strict=True))
    line = f"{name:38s} wall {statistics.median(wall):6.0f} ms, processor {statistics.median(processor):6.0f} ms"
    line += f"   {ratio:5.2f} times the import's processor time"
    for other in folders[1:]:
        pairs = list(zip(taken[name, BIN], taken[name, other], strict=True))
        more = [statistics.median(here[i] - there[i] for here, there in pairs) for i in (0, 1)]
        line += f"   beside the other: wall {more[0]:+.1f} ms, processor {more[1]:+.1f} ms"
    print(line)
