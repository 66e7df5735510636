"""Measure generated C: machine code, workspace, stack and compile time of shipped cases, as a table in Markdown.

The stack is bounded from the compiler's own call graph (``gcc -fcallgraph-info=su``): the deepest sum of frames from
``..._solve``, with the functions of the program behind the pointers of a search. ``stack.c`` of the folder measures it
too.

    python bench/memory.py CASE ...
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
import time
from functools import cache
from pathlib import Path

from screwsynth.nlp import load_case
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.embedding.ctext import identifier

FLAGS = ["-std=c99", "-O2"]


def stack_bound(folder: Path, prefix: str) -> int:
    """Return the bytes of the deepest path of calls from the solver, by the call graphs in a folder."""
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for graph in folder.glob("*.ci"):
        text = graph.read_text(encoding="utf-8")
        unit = graph.stem

        def name(title: str, unit: str = unit) -> str:
            # A static function has the file before its name.
            own = title.rpartition(":")[2]
            return f"{unit}:{own}" if ":" in title else own

        for title, size in re.findall(r'node: \{ title: "([^"]+)" label: "[^"]*?\\n(\d+) bytes', text):
            frames[name(title)] = int(size)
        for source, target in re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', text):
            calls.setdefault(name(source), set()).add(name(target))
    program = {each for each in frames if re.search(r"_SCALED_(values|hessian|visit)$", each)}
    inner = {each for each in frames if each.startswith(f"{prefix}-restore:")}
    restoration = {each for each in inner if re.search(r":(values|hessian|visit)(\.|$)", each)}

    @cache
    def depth(function: str) -> int:
        targets = calls.get(function, set())
        below = set(targets)
        # A search calls its program by pointers: the scaled one, or that of the search for a feasible point, which
        # itself calls the scaled one. The scaled one calls the caller's deadline, which is not counted.
        if "__indirect_call" in targets and function not in program:
            below |= program if function in inner else program | restoration
        return frames.get(function, 0) + 8 + max((depth(each) for each in below), default=0)

    return depth(f"{prefix}_solve")


def measure(name: str, folder: Path) -> str:
    """Return a row of the table."""
    files, prefix = generate_c(load_case(name)), identifier(name)
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    sources = [file for file in files if file.startswith(prefix) and file.endswith(".c")]
    began = time.perf_counter()
    for file in sources:
        subprocess.run(["gcc", *FLAGS, "-fcallgraph-info=su", "-c", file], cwd=folder, check=True)
    seconds = time.perf_counter() - began
    objects = [file[:-1] + "o" for file in sources]
    sizes = subprocess.run(["size", *objects], cwd=folder, capture_output=True, text=True, check=True).stdout
    flash = sum(int(line.split()[0]) for line in sizes.splitlines()[1:])
    for program in ("stack", "bench"):
        # Functions of the mathematics library are found at the start: the linker would need stack in the solve.
        words = ["gcc", *FLAGS, f"{program}.c", *objects, "-Wl,-z,now", "-lm", "-o", program]
        subprocess.run(words, cwd=folder, check=True)
    run = {
        program: subprocess.run([folder / program], capture_output=True, text=True, check=True).stdout
        for program in ("stack", "bench")
    }
    painted = re.findall(r"(\d+) bytes", run["stack"])[0]
    times = re.findall(r"^(?:F|F and|F, gradient)[ a-zH]* +([\d.]+) ns", run["bench"], re.MULTILINE)
    work = int(re.findall(r"_SOLVERWORK (\d+)", files[f"{prefix}.h"])[0])
    solve = re.findall(r"solve from one point +([\d.]+) us", run["bench"])[0]
    bound = stack_bound(folder, prefix)
    sizes_in_kb = [f"{flash / 1000:.0f}", f"{work * 8 / 1000:.1f}"]
    cells = [f"`{name}`", *sizes_in_kb, f"{bound}", painted, f"{seconds:.1f}", *times, solve]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="+")
    given = parser.parse_args()
    columns = [
        "case",
        "code kB",
        "workspace kB",
        "stack bound",
        "stack",
        "compile s",
        "F ns",
        "gradient ns",
        "Hessian ns",
        "solve us",
    ]
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for name in given.cases:
        with tempfile.TemporaryDirectory() as folder:
            print(measure(name, Path(folder)), flush=True)


if __name__ == "__main__":
    main()
