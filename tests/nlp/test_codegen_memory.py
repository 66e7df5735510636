"""Generated C reads and writes only its own memory, and takes none."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builders import saved
from generated import COMPILERS, made, needs_compiler, written

from screwsynth.nlp.embedding.ctext import identifier

Embedded = Any


def run(where: Path, flags: str, *runner: str) -> subprocess.CompletedProcess[str]:
    """The self-test and a twentieth of the example's ticks, built with the flags and run."""
    made(where, "clean")
    example = where / "example.c"
    example.write_text(example.read_text(encoding="utf-8").replace("TICKS 10000", "TICKS 500"), encoding="utf-8")
    made(where, f"CC={COMPILERS[0]}", f"CFLAGS=-std=c99 -g {flags}", "selftest", "example")
    for program in ("selftest", "example"):
        done = subprocess.run([*runner, str(where / program)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    return done


@needs_compiler
@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.4-snu", "camera-mount"])
def test_sanitizers_find_nothing(name: str, tmp_path: Path) -> None:
    probe = saved(tmp_path / "probe.c", "int main(void) { return 0; }")
    flags = "-fsanitize=address,undefined -fno-sanitize-recover=all"
    built = [COMPILERS[0], *flags.split(), str(probe), "-o", str(tmp_path / "probe")]
    if subprocess.run(built, check=False, capture_output=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    run(written(name, tmp_path / "c"), f"-O0 {flags}")


@needs_compiler
@pytest.mark.slow
def test_valgrind_finds_nothing_and_no_heap(tmp_path: Path) -> None:
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("valgrind is not installed")
    where = written("paper-4.1-rotation", tmp_path)
    done = run(where, "-O1", valgrind, "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all")
    # What printf takes is one buffer; the library takes nothing.
    assert re.search(r"total heap usage: 1 allocs", done.stderr), done.stderr


@needs_compiler
def test_ten_million_calls_take_no_memory(tmp_path: Path, embedded: Callable[[str], Embedded]) -> None:
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("the system has no /proc/self/statm to read the size of a process from")
    where, prefix = embedded("paper-4.1-helical").folder, identifier("paper-4.1-helical")
    (tmp_path / "many.c").write_text(
        f"""#include "{prefix}.h"
#include <stdio.h>
static long pages(void) {{
    long size = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld", &size) != 1) size = -1;
    if (file) fclose(file);
    return size;
}}
int main(void) {{
    static double work[{prefix.upper()}_WORK], k[{prefix.upper()}_K], F, sum;
    long before, call;
    if ({prefix}_prepare({prefix}_parameter_defaults, k, work)) return 2;
    pages();
    before = pages();
    for (call = 0; call < 10000000; ++call) {{
        if ({prefix}_F({prefix}_variable_starts, k, &F, work)) return 3;
        sum += F;
    }}
    printf("%ld %ld %g\\n", before, pages(), sum);
    return pages() == before && before > 0 ? 0 : 1;
}}
""",
        encoding="utf-8",
    )
    objects = [str(where / f"{prefix}{end}.o") for end in ("", "-casadi")]
    command = [COMPILERS[0], "-std=c99", "-O2", f"-I{where}", "many.c", *objects, "-lm", "-o", "many"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert subprocess.run([str(tmp_path / "many")], check=False).returncode == 0
