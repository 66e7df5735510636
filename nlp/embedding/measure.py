"""Flash and stack of generated C, measured by the compilers of this machine.

Compilers run in a temporary folder and by the names of the files alone, so that the same files and the same compiler
give the same figures.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..system.programs import RunError, first_program, run_program
from .callgraph import stack_bound

#: Flags of every compiler.
_FLAGS = ("-std=c99", "-O2")
#: Writes the call graph with the size of each frame. Only gcc has it.
_GRAPH = "-fcallgraph-info=su"
#: The stack that other compilers and flags may take, in parts of the bound of the one measured. clang took 1.36.
_ROOM = 1.5
#: Functions of the mathematics library are found at the start: the linker would need stack in the solve.
_LINK = ("-Wl,-z,now", "-lm")
_PAINTED = re.compile(r"stack below a solve +(\d+) bytes")


class Target(NamedTuple):
    """A machine for which C is measured.

    Attributes:
        name: for people.
        macro: end of the names of its macros.
        compilers: names of compilers; the first one found is taken.
        size: program that gives the sizes of an object file.
        flags: that choose the machine.
        machine: beginning of the machine's name as ``-dumpmachine`` gives it.
    """

    name: str
    macro: str
    compilers: tuple[str, ...]
    size: str
    flags: tuple[str, ...]
    machine: str


class Figures(NamedTuple):
    """Figures of one target, or the reason why there are none.

    Attributes:
        target: the machine.
        compiler: first line of its version, and the flags.
        flash: bytes of code and constants of the library; None where they are not measured.
        stack: bound of a solve's stack in bytes, without the mathematics library; None where there is none.
        painted: bytes of stack that a solve from all starting points took, with that library; None where not run.
        fault: why something is not measured; empty where all is.
    """

    target: Target
    compiler: str = ""
    flash: int | None = None
    stack: int | None = None
    painted: int | None = None
    fault: str = ""

    @property
    def with_room(self) -> int | None:
        """The stack that other compilers may need: a multiple of 16."""
        return None if self.stack is None else 16 * math.ceil(_ROOM * self.stack / 16)

    @property
    def numbers(self) -> tuple[int | None, ...]:
        """Flash, stack, stack with room, and the measured stack."""
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
    """Compile generated C for every target, all at the same time, and return the figures.

    The environment variable ``CC`` names another compiler for x86-64, as elsewhere.

    Args:
        files: text by file name, as :func:`~screwsynth.nlp.generate_c` returns it.
        prefix: of the case's names in C.
    """
    sources = sorted(name for name in files if name.startswith(prefix) and name.endswith(".c"))
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
    """A compiler at work in a folder; without a process, figures that say why."""

    figures: Figures
    words: tuple[str, ...]
    folder: Path
    process: subprocess.Popen[bytes] | None


def _begin(target: Target, files: Mapping[str, str], sources: list[str], folder: Path) -> _Running:
    """Start a target's compiler."""
    own = os.environ.get("CC")
    names = (own,) if own and target is X86_64 else target.compilers
    found = first_program(names)
    if found is None:
        fault = f"no compiler for it was found: {' or '.join(names)}"
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
    """Wait for a compiler, and return the figures."""
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
        return figures._replace(fault="this compiler writes no call graph, so the stack has no bound here")
    return figures._replace(stack=stack)


def _writes_graphs(words: tuple[str, ...], folder: Path) -> bool:
    """Return whether a compiler writes call graphs."""
    (folder / "probe.c").write_text("int probe(void);\nint probe(void) { return 0; }\n", encoding="utf-8")
    try:
        run_program([*words, _GRAPH, "-c", "probe.c"], folder)
    except RunError:
        return False
    return (folder / "probe.ci").exists()
