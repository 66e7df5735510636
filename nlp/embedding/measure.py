"""Flash and stack of generated C, measured by the installed compilers and written into its files.

Compilers run in a temporary folder with relative file names, so that the same files and compiler give the same figures.
The stack bound of a solve follows from the call graphs that gcc writes with ``-fcallgraph-info=su``, with the frames of
this compiler. It excludes functions of the C library, which have no frame there.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

from ..errors import one_line
from ..system.programs import RunError, first_program, run_program
from .ctext import comment_text
from .manifest import MANIFEST, json_text, solver_files

#: Flags of every compiler.
_FLAGS = ("-std=c99", "-O2")
#: Flag for the call graph with the size of each frame, which only gcc has.
_GRAPH = "-fcallgraph-info=su"
#: Factor on the stack bound for other compilers and flags. clang needed 1.36.
_ROOM = 1.5
#: Flag to resolve functions of the mathematics library at the start, because the linker would use stack in the solve.
_LINK = ("-Wl,-z,now", "-lm")
_PAINTED = re.compile(r"stack below a solve +(\d+) bytes")


class Target(NamedTuple):
    """Target for which C is measured.

    Attributes:
        name: name for people.
        macro: suffix of the macro names of the target.
        compilers: names of compilers; the first installed one is used.
        size: program that returns the sizes of an object file.
        flags: compiler flags that select the target.
        machine: start of the output of ``-dumpmachine`` for the target.
    """

    name: str
    macro: str
    compilers: tuple[str, ...]
    size: str
    flags: tuple[str, ...]
    machine: str


class Figures(NamedTuple):
    """Measured sizes for one target, or the reason why nothing was measured.

    Attributes:
        target: measured target.
        compiler: first line of the compiler's version, and the flags.
        flash: bytes of code and constants of the library; None if not measured.
        stack: bound on the stack of a solve in bytes, without the mathematics library; None without a bound.
        painted: measured bytes of stack of a solve from all starting points, with the mathematics library; None if not
            run.
        fault: reason for missing sizes; empty if all sizes are measured.
    """

    target: Target
    compiler: str = ""
    flash: int | None = None
    stack: int | None = None
    painted: int | None = None
    fault: str = ""

    @property
    def with_room(self) -> int | None:
        """Stack bound with a margin for other compilers: a multiple of 16."""
        return None if self.stack is None else 16 * math.ceil(_ROOM * self.stack / 16)

    @property
    def numbers(self) -> tuple[int | None, ...]:
        """Flash, stack, stack with margin, and measured stack."""
        return self.flash, self.stack, self.with_room, self.painted


CORTEX_M7 = Target(
    "Cortex-M7",
    "CORTEX_M7",
    ("arm-none-eabi-gcc",),
    "arm-none-eabi-size",
    ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"),
    "arm",
)
X86_64 = Target("x86-64", "X86_64", ("gcc", "cc", "clang"), "size", (), "x86_64")
TARGETS = (X86_64, CORTEX_M7)


def measure(files: Mapping[str, str], prefix: str) -> tuple[Figures, ...]:
    """Compile generated C for all targets in parallel, and return the measured sizes.

    The environment variable ``CC`` may name another compiler for x86-64.

    Args:
        files: text by file name, from :func:`~screwsynth.nlp.generate_c`.
        prefix: prefix of the case's names in C.
    """
    sources = solver_files(files, prefix, ".c")
    with tempfile.TemporaryDirectory(prefix="screwsynth.") as root:
        running = [_begin(target, files, sources, Path(root) / target.macro) for target in TARGETS]
        try:
            return tuple(_end(each, sources, prefix) for each in running)
        finally:
            for each in running:
                if each.process is not None and each.process.poll() is None:
                    each.process.kill()
                    each.process.wait()


class _Running(NamedTuple):
    """Running compiler in a folder; without a process, the reason why nothing is measured."""

    figures: Figures
    words: tuple[str, ...]
    folder: Path
    process: subprocess.Popen[bytes] | None


def _begin(target: Target, files: Mapping[str, str], sources: list[str], folder: Path) -> _Running:
    """Start the compiler of a target."""
    own = os.environ.get("CC")
    names = (own,) if own and target is X86_64 else target.compilers
    found = first_program(names)
    if found is None:
        fault = f"no compiler for this target is installed: {' or '.join(names)}"
        return _Running(Figures(target, fault=fault), (), folder, None)
    words = (found, *target.flags, *_FLAGS)
    try:
        version = run_program([found, "--version"]).splitlines()[0]
        machine = run_program([found, "-dumpmachine"]).strip()
        figures = Figures(target, " ".join([version, *target.flags, *_FLAGS]))
        if not machine.startswith(target.machine):
            fault = f"{Path(found).name} compiles for {machine}"
            return _Running(figures._replace(fault=fault), words, folder, None)
        folder.mkdir()
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        extra = [_GRAPH] if _writes_graphs(words, folder) else []
        with (folder / "errors").open("wb") as errors:
            process = subprocess.Popen([*words, *extra, "-c", *sources], cwd=folder, stdout=errors, stderr=errors)  # noqa: S603 - the user's own compiler
    except (OSError, IndexError, RunError) as error:
        return _Running(Figures(target, fault=f"{Path(found).name}: {error}"), words, folder, None)
    return _Running(figures, words, folder, process)


def _end(running: _Running, sources: list[str], prefix: str) -> Figures:
    """Wait for a compiler, and return the measured sizes."""
    figures, words, folder, process = running
    if process is None:
        return figures
    if process.wait():
        said = (folder / "errors").read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return figures._replace(fault=f"the compiler failed: {said[0] if said else process.returncode}")
    objects = [f"{name[:-2]}.o" for name in sources]
    try:
        sizes = run_program([figures.target.size, *objects], folder).splitlines()[1:]
        flash = sum(int(text) + int(data) for text, data in (line.split()[:2] for line in sizes))
        figures = figures._replace(flash=flash)
        if figures.target is X86_64:
            run_program([*words, "stack.c", *objects, *_LINK, "-o", "stack"], folder)
            figures = figures._replace(painted=int(_PAINTED.findall(run_program([str(folder / "stack")], folder))[0]))
    except (OSError, ValueError, IndexError, RunError) as error:
        figures = figures._replace(fault=f"{error}")
    graphs = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob(f"{prefix}*.ci")}
    stack = stack_bound(graphs, prefix)
    if stack is None and not figures.fault:
        return figures._replace(fault="this compiler writes no call graph, so there is no stack bound")
    return figures._replace(stack=stack)


def _writes_graphs(words: tuple[str, ...], folder: Path) -> bool:
    """Return True if a compiler writes call graphs."""
    (folder / "probe.c").write_text("int probe(void);\nint probe(void) { return 0; }\n", encoding="utf-8")
    try:
        run_program([*words, _GRAPH, "-c", "probe.c"], folder)
    except RunError:
        return False
    return (folder / "probe.ci").exists()


#: Bytes added for each call: the return address, if a compiler does not count it in the frame.
_RETURN = 8
_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?\\n(\d+) bytes \(([a-z,]+)\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
_INDIRECT = "__indirect_call"


def stack_bound(graphs: Mapping[str, str], prefix: str, function: str = "") -> int | None:
    """Return the stack bytes of the deepest call path from a function.

    Args:
        graphs: call graph of each source, by its name without suffix.
        prefix: prefix of the case's names in C.
        function: name of the function in C; the solver if left out.

    Returns:
        Stack bound; None if a frame has no constant size, a function may be recursive, or the solver is missing.
    """
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for unit, text in graphs.items():
        for title, size, kind in _NODE.findall(text):
            if kind not in ("static", "dynamic,bounded"):
                return None
            frames[_name(title, unit)] = int(size)
        for source, target in _EDGE.findall(text):
            calls.setdefault(_name(source, unit), set()).add(_name(target, unit))
    for each, targets in [*calls.items()]:
        if _INDIRECT in targets:
            calls[each] = (targets - {_INDIRECT}) | _called_by_pointer(each, frames, prefix)
    first = function or f"{prefix}_solve"
    return _deepest(first, frames, calls) if first in frames else None


def _name(title: str, unit: str) -> str:
    """Return the name of a function in the call graph; names of static functions begin with the source file."""
    own = title.rpartition(":")[2]
    return f"{unit}:{own}" if ":" in title else own


def _called_by_pointer(function: str, frames: Mapping[str, int], prefix: str) -> set[str]:
    """Return the functions that a function may call by a pointer.

    A search calls its program by pointers: the scaled program, or the program of the search for a feasible point, which
    calls the scaled program. The scaled program calls only the caller's deadline, which is unknown here.
    """
    if function.startswith((f"{prefix}_SCALED_", f"{prefix}-scaled:")):
        return set()
    program = {each for each in frames if re.search(r"_SCALED_(values|hessian|visit)$", each)}
    if function.startswith(f"{prefix}-restore:"):
        return program
    return program | {each for each in frames if re.search(r"-restore:(values|hessian|visit)(\.|$)", each)}


def _deepest(function: str, frames: Mapping[str, int], calls: Mapping[str, set[str]]) -> int | None:
    """Return the largest sum of frames from a function; None for possible recursion."""
    below: dict[str, set[str]] = {}
    waiting = [function]
    while waiting:
        name = waiting.pop()
        if name not in below:
            below[name] = calls.get(name, set())
            waiting += below[name]
    depths: dict[str, int] = {}
    try:
        for name in TopologicalSorter(below).static_order():
            depths[name] = frames.get(name, 0) + _RETURN + max((depths[each] for each in below[name]), default=0)
    except CycleError:
        return None
    return depths[function]


#: Text instead of measured sizes if no compiler was run.
NOT_MEASURED = "Flash and stack were not measured when this folder was generated."


def with_figures(files: Mapping[str, str], prefix: str, figures: Sequence[Figures]) -> dict[str, str]:
    """Return the files of a folder with the measured sizes in the header, the README and the manifest."""
    manifest = json.loads(files[MANIFEST])
    manifest["measured"] = [
        {
            "target": each.target.name,
            "compiler": each.compiler,
            "flash_bytes": each.flash,
            "stack_bytes": each.stack,
            "stack_bytes_with_room": each.with_room,
            "painted_stack_bytes": each.painted,
            "fault": each.fault,
        }
        for each in figures
    ]
    header = f"{prefix}.h"
    return {
        **files,
        header: files[header].replace(f"/* {NOT_MEASURED} */", _macros(prefix.upper(), figures)),
        "README.md": files["README.md"].replace(NOT_MEASURED, _rows(figures)),
        MANIFEST: json_text(manifest),
    }


def figure_words(figures: Figures) -> str:
    """Return the measured sizes for a target in one line."""
    parts = [
        "" if figures.flash is None else f"flash {figures.flash / 1000:.1f} kB",
        "" if figures.stack is None else f"stack at most {figures.stack} bytes",
        f"not measured: {one_line(figures.fault)}" if figures.fault else "",
    ]
    return f"{figures.target.name}: {', '.join(part for part in parts if part)}"


def _macros(prefix: str, figures: Sequence[Figures]) -> str:
    """Return macros of the header, with a comment for missing sizes."""
    lines = []
    for each in figures:
        name = each.target.macro
        if each.compiler:
            lines.append(f"/* {each.target.name}: {comment_text(each.compiler)} */")
        if each.flash is not None:
            lines.append(f"#define {prefix}_FLASH_BYTES_{name} {each.flash} /* code and constants of the library */")
        if each.stack is not None:
            painted = "" if each.painted is None else f"; measured with them, from all seeds: {each.painted}"
            said = f"bound of a solve with this compiler, without functions of math.h{painted}"
            room = "with a margin for other compilers and functions of math.h"
            lines.append(f"#define {prefix}_STACK_BYTES_{name}_GCC {each.stack} /* {said} */")
            lines.append(f"#define {prefix}_STACK_BYTES_{name} {each.with_room} /* {room} */")
        if each.fault:
            lines.append(f"/* {each.target.name}: not measured: {comment_text(each.fault)} */")
    return "\n".join(lines)


def _rows(figures: Sequence[Figures]) -> str:
    """Return a table for the README, with a line for missing sizes."""
    heads = ("flash, bytes", "stack bound, bytes", "with margin, bytes", "stack measured, bytes")
    lines = [f"| target | {' | '.join(heads)} | compiler and flags |", "|---|---|---|---|---|---|"]
    for each in figures:
        numbers = " | ".join("-" if own is None else str(own) for own in each.numbers)
        lines.append(f"| {each.target.name} | {numbers} | {comment_text(each.compiler) or '-'} |")
    for each in figures:
        lines += ["", f"{each.target.name}: not measured: {comment_text(each.fault)}."] if each.fault else []
    return "\n".join(lines)
