"""Folders of generated C for tests: the compilers of this machine, strict flags, writing, and make."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from screwsynth.nlp import Case, generate_c, load_case
from screwsynth.nlp.case.source import find_case

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler is installed")
#: Shipped cases with few constraints, with many, and with a level of several values: compiled as the Makefile does it.
OPTIMISED = ("paper-4.1-helical", "hexapod-machining", "camera-mount")
#: Statuses of the solver in C, in its order.
OK, NOT_CONVERGED, INFEASIBLE, BAD_INPUT, BUDGET, OTHER_ASSEMBLY, RANGE_END = range(7)
#: Flags by which generated C compiles without a warning, as C and as C++.
WARNINGS = "-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
STRICT = f"-std=c99 {WARNINGS}"
#: What generated C may take from outside: functions of the mathematics library, and what compilers write themselves.
ALLOWED = {
    "sin", "sincos", "cos", "sqrt", "atan", "atan2", "acos", "asin", "floor", "fmin", "fmax", "memcpy", "memset",
    "__stack_chk_fail",
    "_GLOBAL_OFFSET_TABLE_",  # of -fPIC, and no function
}  # fmt: skip


def written(case: Case | str, folder: Path) -> Path:
    """Write the C of a case, or of a shipped one with its file, into a folder, and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    text = find_case(case).read_text(encoding="utf-8") if isinstance(case, str) else ""
    for name, content in generate_c(load_case(case) if isinstance(case, str) else case, text).items():
        (folder / name).write_text(content, encoding="utf-8")
    return folder


def run(*words: str, where: Path) -> str:
    """Run a program in a folder, which has to succeed, and return its output."""
    done = subprocess.run(words, cwd=where, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout


def made(where: Path, *words: str) -> str:
    """Run make in a folder, with the first compiler there is unless the words name another one."""
    return run("make", f"CC={COMPILERS[0]}", *words, where=where)


def assert_only_mathematics_is_needed(where: Path, prefix: str) -> None:
    """Assert that the objects of a folder take nothing from outside but mathematics, and have no data that change.

    So they call no function that could take memory.
    """
    objects = [str(path) for path in sorted(where.glob(f"{prefix}*.o"))]
    assert len(objects) >= 8
    lines = run("nm", *objects, where=where).splitlines()
    wanted = {line.split()[-1] for line in lines if " U " in line}
    own = (prefix, prefix.replace("screwsynth_", "kinematics_", 1))
    assert {symbol for symbol in wanted if not symbol.startswith(own)} <= ALLOWED
    assert not [line for line in lines if line.split()[-2:-1] in (["D"], ["B"], ["d"], ["b"])]
