"""Tables of generated C before and after: flash, stack, workspace, instructions, times of a solve, and the worst case.

Both versions are compiled first, two at a time. Then their programs run in turns, so that a busy machine burdens both.
Instructions are counted by valgrind and do not depend on the load. Run by hand on a quiet machine:

    .venv/bin/python -P bench/generated_c.py --old CHECKOUT --write

Rows are printed as they are measured, progress on standard error. ``--write`` puts the tables of a complete run into
docs/embedding.md. Without ``--old`` the tables have this version alone.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from statistics import median
from typing import NamedTuple

from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.measure import CORTEX_M7, stack_bound

CASES = ("paper-4.1-helical", "paper-4.3", "drilling-spindle", "hexapod-machining", "flight-simulator", "camera-mount")
FLAGS = ("-std=gnu99", "-O2")
#: Rounds by turns in which solves of each kind are run, and number of calls of which instructions are counted.
ROUNDS, COUNTED = 10, 200
FUNCTIONS = ("F", "F_gradient", "limits")
KINDS = ("cold", "task", "warm")
VERSIONS = ("before", "after")
#: The page with the tables, and their place in it.
PAGE = Path(__file__).parents[1] / "docs" / "embedding.md"
OPENING, CLOSING = "<!-- begin: bench/generated_c.py -->", "<!-- end -->"
#: The case that takes longest to compile.
LARGE = "hexapod-machining"
GENERATE = """import sys
from pathlib import Path
from screwsynth.nlp import load_case
from screwsynth.nlp.embedding.codegen import generate_c
for name, text in generate_c(load_case(sys.argv[1]), "").items():
    (Path(sys.argv[2]) / name).write_text(text, encoding="utf-8")
"""
#: The first word is the kind: `cold` from random starts, `task` with random tasks, `warm` from the last answer while
#: the task turns by 1e-4 rad each, `seeds` from all starting points. `stack` paints the stack below, and
#: `functions` calls each of FUNCTIONS at random points.
DRIVER = """#include "ID.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#define AREA 400000
static double work[BIG_SOLVERWORK], p[BIG_P], x[BIG_N + 1], k_numbers[BIG_K + 1], F, gradient[BIG_N + 1];
static double g[BIG_C + 1], rows[BIG_C * BIG_N + 1];
static int iwork[BIG_SOLVERIWORK];
static ID_result result;
static ID_problem problem;
static uint64_t state;
static double uniform(void) {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) / 9007199254740992.0;
}
static void turn(double angle) {
    const double *twist = ID_parameter_defaults + BIG_TWIST, c = cos(angle), s = sin(angle);
    int i;
    for (i = 0; i < 6; i += 3) {
        p[BIG_TWIST + i] = c * twist[i] - s * twist[i + 1];
        p[BIG_TWIST + i + 1] = s * twist[i] + c * twist[i + 1];
    }
}
static void __attribute__((noinline)) paint(volatile unsigned char *top) {
    long i;
    for (i = 512; i < AREA; ++i) top[-i] = 0xA5;
}
static long __attribute__((noinline)) depth(const volatile unsigned char *top) {
    long i = AREA - 1;
    while (i > 512 && top[-i] == 0xA5) --i;
    return i;
}
int main(int count, char **words) {
    volatile unsigned char here = 0;
    volatile unsigned char *volatile top = &here;
    const char kind = words[1][0];
    const long first = atol(words[2]), last = first + atol(words[3]);
    long k;
    int i;
    (void)count;
    ID_defaults(&problem);
    for (i = 0; i < BIG_P; ++i) p[i] = ID_parameter_defaults[i];
    if (words[1][1] == 't') {
        paint(top);
        ID_solve(&problem, &result, work, iwork);
        return printf("%ld\\n", depth(top)) < 0;
    }
    if (words[1][1] == 'e') {
        for (k = first; k < last; ++k) ID_solve(&problem, &result, work, iwork);
        return printf("%d %d %.10g\\n", result.runs, result.iterations, result.F) < 0;
    }
    problem.p = p;
    if (kind == 'w') {
        turn(1e-4 * (double)first);
        ID_solve(&problem, &result, work, iwork);
    }
    problem.x0 = x;
    problem.seeds = 0;
    for (k = first; k < last; ++k) {
        struct timespec begin, end;
        int status;
        state = 88172645463325252ull + 1000003ull * (uint64_t)k;
        for (i = 0; i < 20; ++i) uniform();
        for (i = 0; i < BIG_N; ++i)
            x[i] = kind == 'w' ? result.x[i] : problem.lower[i] + uniform() * (problem.upper[i] - problem.lower[i]);
        if (kind == 'w') turn(1e-4 * (double)k);
        for (i = 0; kind == 't' && i < 6; ++i) p[BIG_TWIST + i] = 2.0 * uniform() - 1.0;
        if (kind == 'f') {
            ID_prepare(p, k_numbers, work);
            ID_F(x, k_numbers, &F, work);
            ID_F_gradient(x, k_numbers, &F, gradient, work);
            ID_limits(x, k_numbers, g, rows, work);
            continue;
        }
        clock_gettime(CLOCK, &begin);
        status = (int)ID_solve(&problem, &result, work, iwork);
        clock_gettime(CLOCK, &end);
        printf("%d %d %.0f\\n", status, result.iterations,
               (double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec));
    }
    return 0;
}
"""


class Build(NamedTuple):
    """A case's C of one version, compiled: flash by compiler, workspaces in bytes, bound of the stack, and stack."""

    name: str
    version: str
    folder: Path
    flash: int
    flash_m7: int | None
    workspace: int
    bound: int | None
    painted: int


def compiled(name: str, version: str, checkout: Path | None, root: Path) -> Build:
    """Generate and compile the C of a case."""
    folder = root / version / name
    folder.mkdir(parents=True)
    environment = dict(os.environ)
    if checkout is not None:
        package = root / version / "import" / "screwsynth"
        package.mkdir(parents=True, exist_ok=True)
        for room in ("models", "nlp", "cases"):
            if not (package / room).exists():
                (package / room).symlink_to(checkout.resolve() / room)
        environment["PYTHONPATH"] = str(package.parent)
    case = Path(shutil.copy(find_case(name), root / version / f"{name}.toml"))
    words = [sys.executable, "-P", "-c", GENERATE, str(case), str(folder)]
    subprocess.run(words, env=environment, check=True)
    build = built(name, version, folder)
    # The pointers of a version before are others: its stack is painted only.
    return build if checkout is None else build._replace(bound=None)


def built(name: str, version: str, folder: Path) -> Build:
    """Compile the C of a case in a folder."""
    prefix = identifier(name)
    text = DRIVER.replace("BIG", prefix.upper()).replace("ID", prefix).replace("CLOCK", "CLOCK_PROCESS_CPUTIME_ID")
    (folder / "driver.c").write_text(text, encoding="utf-8")
    sources = sorted(path.name for path in folder.glob(f"{prefix}*.c"))
    subprocess.run(["gcc", *FLAGS, "-fcallgraph-info=su", "-c", *sources], cwd=folder, check=True)
    objects = [f"{source[:-2]}.o" for source in sources]
    flash = size("size", folder, objects)
    for program in ("driver", "bench"):
        words = ["gcc", *FLAGS, "-DRUNS=10000", f"{program}.c", *objects, "-Wl,-z,now", "-lm", "-o", program]
        subprocess.run(words, cwd=folder, check=True)
    flash_m7 = None
    if shutil.which(CORTEX_M7.compilers[0]):
        (folder / "m7").mkdir()
        words = [CORTEX_M7.compilers[0], *CORTEX_M7.flags, *FLAGS, "-I..", "-c", *(f"../{each}" for each in sources)]
        subprocess.run(words, cwd=folder / "m7", check=True)
        flash_m7 = size(CORTEX_M7.size, folder / "m7", objects)
    header = (folder / f"{prefix}.h").read_text(encoding="utf-8")
    doubles, ints = (int(re.findall(rf"_SOLVER{part} (\d+)", header)[0]) for part in ("WORK", "IWORK"))
    bound = stack_bound({path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.ci")}, prefix)
    painted = int(output(folder, "./driver", "stack", "0", "0"))
    return Build(name, version, folder, flash, flash_m7, 8 * doubles + 4 * ints, bound, painted)


def size(program: str, folder: Path, objects: list[str]) -> int:
    """Return the bytes of code and constants of object files."""
    lines = subprocess.run([program, *objects], cwd=folder, capture_output=True, text=True, check=True).stdout
    return sum(int(text) + int(data) for text, data in (line.split()[:2] for line in lines.splitlines()[1:]))


def output(folder: Path, *words: str) -> str:
    """Run a program in a folder and return what it prints."""
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout


def instructions(build: Build, function: str, kind: str, count: int) -> float:
    """Return the mean number of instructions of a function in one kind of calls, by valgrind."""
    tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--log-fd=2", "--collect-atstart=no"]
    words = [f"--toggle-collect={identifier(build.name)}_{function}", "./driver", kind, "0", str(count)]
    done = subprocess.run([*tool, *words], cwd=build.folder, capture_output=True, text=True, check=True)
    return int(re.findall(r"Collected : (\d+)", done.stderr)[0]) / count


def times(builds: list[Build], kind: str, solves: int) -> list[str]:
    """Return a row of each build: the solves of one kind, in turns."""
    name, count = builds[0].name, solves // ROUNDS
    found: dict[str, list[list[float]]] = {each.version: [] for each in builds}
    for turn in range(ROUNDS):
        for build in builds if turn % 2 else builds[::-1]:
            lines = output(build.folder, "./driver", kind, str(turn * count), str(count)).splitlines()
            found[build.version] += [[float(part) for part in line.split()] for line in lines]
    rows = []
    for build in builds:
        status, iterations, took = zip(*found[build.version], strict=True)
        ordered = sorted(took)
        ok = sum(each == 0 for each in status)
        ends = (ordered[int(0.999 * len(took))], ordered[-1])
        cells = [f"{median(took) / 1e3:.1f}", *(f"{each / 1e3:.0f}" for each in ends)]
        cells += [f"{sum(iterations) / len(took):.1f}, {max(iterations):.0f}", f"{ok} of {len(took)}"]
        rows.append(f"| `{name}` | {build.version} | {kind} | {' | '.join(cells)} |")
    return rows


class Tables:
    """Lines of the tables, printed as they come."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, *lines: str) -> None:
        """Add lines."""
        self.lines.extend(lines)
        print("\n".join(lines), flush=True)

    def begin(self, columns: str) -> None:
        """Begin a table."""
        self.add(f"| {columns} |", f"|{'---|' * (columns.count('|') + 1)}")

    def write(self, page: Path) -> None:
        """Put the tables into their place in a page."""
        before, _, rest = page.read_text(encoding="utf-8").partition(OPENING)
        after = rest.partition(CLOSING)[2]
        page.write_text("\n".join([before + OPENING, "", *self.lines, "", CLOSING + after]), encoding="utf-8")


def say(began: float, words: str) -> None:
    """Say the progress, with the seconds so far."""
    print(f"{time.perf_counter() - began:5.0f} s  {words}", file=sys.stderr, flush=True)


def versions() -> str:
    """Return the compilers and the machine in words."""
    found = [name for name in ("gcc", CORTEX_M7.compilers[0]) if shutil.which(name)]
    lines = [output(Path(), name, "--version").splitlines()[0] for name in found]
    cores, load = os.cpu_count(), os.getloadavg()[0]
    return f"{', '.join(lines)}; {' '.join(FLAGS)}; {cores} cores, load {load:.1f} at the beginning."


def counts_of(builds: list[Build]) -> list[str]:
    """Return a row of thousands of instructions of each build, and of the change in percent."""
    rows = [
        [instructions(build, function, "functions", COUNTED) for function in FUNCTIONS]
        + [instructions(build, "solve", kind, 1 if kind == "seeds" else COUNTED) for kind in ("seeds", *KINDS)]
        for build in builds
    ]
    cells = [(build.version, [f"{each / 1e3:.1f}" for each in row]) for build, row in zip(builds, rows, strict=True)]
    if len(rows) > 1:
        cells.append(("change", [f"{100 * (new / old - 1):+.1f} %" for old, new in zip(*rows, strict=True)]))
    return [f"| `{builds[0].name}` | {version} | {' | '.join(row)} |" for version, row in cells]


def worst_of(build: Build) -> str:
    """Return a row of the worst case of a build, as its own program measures it."""
    lines = output(build.folder, "./bench")
    slowest = re.findall(r"at worst ([\d.]+) us", lines)
    iteration = re.findall(r"at ([\d.]+) us for an iteration, .* and ([\d.]+) us", lines)[0]
    bounds = re.findall(r"by the counts +([\d.]+) ms from one point, ([\d.]+) ms", lines)[0]
    return f"| `{build.name}` | {' | '.join([*iteration, *bounds, *slowest])} |"


def sizes_of(build: Build) -> str:
    """Return a row of sizes of a build."""
    cells = ["-" if each is None else f"{each / 1e3:.0f}" for each in (build.flash, build.flash_m7)]
    cells += [f"{build.workspace / 1e3:.1f}", str(build.bound or "-"), str(build.painted)]
    return f"| `{build.name}` | {build.version} | {' | '.join(cells)} |"


def main() -> None:
    """Measure, print, and write the tables where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--old", type=Path, help="a checkout of the version before")
    parser.add_argument("--write", action="store_true", help=f"put the tables into {PAGE.name}")
    parser.add_argument("--solves", type=int, default=10_000, help="solves of each kind whose times are measured")
    parser.add_argument("cases", nargs="*", default=CASES)
    given = parser.parse_args()
    began, tables, made = time.perf_counter(), Tables(), dict[tuple[str, str], Build]()
    jobs = [(name, "after") for name in given.cases]
    jobs += [(name, "before") for name in given.cases if given.old]
    # What takes longest comes first.
    jobs.sort(key=lambda job: (job[0] != LARGE, job[1] != "before"))
    tables.add(versions(), "")
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        checkouts = {"before": given.old, "after": None}
        waiting = {pool.submit(compiled, *job, checkouts[job[1]], Path(folder)): job for job in jobs}
        for done in as_completed(waiting):
            made[waiting[done]] = done.result()
            say(began, f"{len(made)} of {len(jobs)}: compiled {' '.join(waiting[done])}")
        order = [(name, version) for name in given.cases for version in VERSIONS if (name, version) in made]
        tables.begin("case | version | flash kB | on a Cortex-M7 | workspace kB | stack bound | stack")
        for job in order:
            tables.add(sizes_of(made[job]))
        tables.add("", "Thousands of instructions of one call; the last four columns are solves.", "")
        tables.begin("case | version | F | F and gradient | limits | seeds | cold | task | warm")
        for name in given.cases:
            tables.add(*counts_of([made[job] for job in order if job[0] == name]))
            say(began, f"{name}, instructions")
        tables.add("", "Times of solves in microseconds.", "")
        tables.begin("case | version | solves | median | 99.9 % | largest | iterations, mean and largest | OK")
        for name in given.cases:
            for kind in KINDS:
                tables.add(*times([made[job] for job in order if job[0] == name], kind, given.solves))
                say(began, f"{name}, {kind}")
        tables.add("", "The worst case by the counts of the header, in this version.", "")
        tables.begin("case | us an iteration | us second derivatives | ms, one point | ms, all | us, slowest of 2,000")
        for name in given.cases:
            tables.add(worst_of(made[name, "after"]))
            say(began, f"{name}, worst case")
    if given.write:
        tables.write(PAGE)
        say(began, f"written to {PAGE}")


if __name__ == "__main__":
    main()
