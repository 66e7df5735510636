"""Generated C on an emulated Cortex-M7: the self-test, and the instructions of a solve.

It takes Debian's gcc-arm-none-eabi, libnewlib-arm-none-eabi and qemu-system-arm. With ``-icount shift=0`` an
instruction takes a nanosecond of the machine's time, and SysTick counts that time.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from screwsynth.nlp import generate_c, load_case
from screwsynth.nlp.embedding.ctext import identifier

pytestmark = pytest.mark.slow

COMPILER, EMULATOR = "arm-none-eabi-gcc", "qemu-system-arm"
FLAGS = (
    *("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"),
    *("-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"),
)
#: Code and data are in one memory, the stack in another.
LINKER = """MEMORY { CODE (rwx) : ORIGIN = 0x00000000, LENGTH = 4M STACK (rw) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
    .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } > CODE
    .ARM.exidx : { *(.ARM.exidx*) } > CODE
    .data : { *(.data*) } > CODE
    .bss : { *(.bss*) *(COMMON) } > CODE
    end = .;
    stack_top = ORIGIN(STACK) + LENGTH(STACK);
}
"""
START = """#include <stdint.h>
#include <stdlib.h>
extern uint32_t stack_top;
extern void initialise_monitor_handles(void);
extern int main(void);
void _init(void);
void _fini(void);
void _init(void) {}
void _fini(void) {}
static void reset(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xF << 20; /* switches the floating-point unit on */
    initialise_monitor_handles();
    exit(main());
}
static void fault(void) { exit(99); }
typedef void (*handler)(void);
__attribute__((section(".vectors"), used)) static const handler vectors[16] = {
    (handler)&stack_top, reset, fault, fault, fault, fault, fault};
"""
#: SysTick's clock has 25 MHz on this machine: one tick is 40 nanoseconds, and so 40 instructions.
MAIN = """#include "PREFIX.h"
#include <stdint.h>
#include <stdio.h>
#define SYSTICK ((volatile uint32_t *)0xE000E010)
extern int selftest(void);
static double work[BIG_SOLVERWORK], x[BIG_N + 1];
static int iwork[BIG_SOLVERIWORK];
static PREFIX_problem problem;
static PREFIX_result result;
static void timed(const char *name) {
    uint32_t begin = SYSTICK[2], took;
    screwsynth_status status = PREFIX_solve(&problem, &result, work, iwork);
    took = (begin - SYSTICK[2]) & 0xFFFFFF;
    printf("%s: %lu instructions, %d iterations, status %d\\n", name, 40ul * (unsigned long)took, result.iterations,
           (int)status);
}
int main(void) {
    int i;
    SYSTICK[1] = 0xFFFFFF;
    SYSTICK[0] = 5;
    if (selftest()) return 1;
    PREFIX_defaults(&problem);
    timed("all seeds");
    for (i = 0; i < BIG_N; ++i) x[i] = result.x[i];
    problem.x0 = x;
    problem.seeds = 0;
    timed("warm");
    for (i = 0; i < BIG_N; ++i)
        x[i] = 0.5 * (problem.lower[i] + problem.upper[i]) +
               0.5 * PREFIX_seeds[1][i] * (problem.upper[i] - problem.lower[i]);
    timed("cold");
    return 0;
}
"""


def image(case: str, folder: Path) -> Path:
    """The self-test and the timed solves of a case, compiled for the machine."""
    prefix = identifier(case)
    files = generate_c(load_case(case), "")
    main = MAIN.replace("PREFIX", prefix).replace("BIG", prefix.upper())
    for name, text in {**files, "main.c": main, "start.c": START, "machine.ld": LINKER}.items():
        (folder / name).write_text(text, encoding="utf-8")
    library = [name for name in files if name.startswith(prefix) and name.endswith(".c") and "casadi" not in name]
    generated = [name for name in files if name.startswith(prefix) and name.endswith("-casadi.c")]

    def compiler(*words: str) -> None:
        done = subprocess.run([COMPILER, *FLAGS, *words], cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    compiler("-c", *library)
    compiler("-Wno-unused-parameter", "-c", *generated)
    compiler("-Dmain=selftest", "-c", "selftest.c")
    # The address of the stack stands among functions in the table of vectors, which ISO C does not allow.
    compiler("-Wno-pedantic", "-c", "start.c", "main.c")
    objects = [path.name for path in sorted(folder.glob("*.o"))]
    compiler("-nostartfiles", "-T", "machine.ld", "--specs=rdimon.specs", *objects, "-lm", "-o", "image.elf")
    return folder / "image.elf"


@pytest.mark.parametrize("case", ["paper-4.1-helical", "paper-4.2-rotation", "paper-4.4-max"])
def test_the_self_test_passes_and_solves_are_counted(
    case: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    for program in (COMPILER, EMULATOR):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed")
    specs = subprocess.run(
        [COMPILER, "-print-file-name=rdimon.specs"], capture_output=True, text=True, check=True
    ).stdout
    if not Path(specs.strip()).is_absolute():
        pytest.skip("the C library newlib for arm-none-eabi is not installed")
    options = ["-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "none", "-icount", "shift=0"]
    semihosting = ["-semihosting-config", "enable=on,target=native", "-kernel", str(image(case, tmp_path))]
    done = subprocess.run([EMULATOR, *options, *semihosting], capture_output=True, text=True, check=False)
    printed = done.stdout + done.stderr
    assert done.returncode == 0, printed
    (passed,) = re.findall(r"(\d+) passed, 0 failed", printed)
    assert int(passed) >= 100
    counts = re.findall(r"(all seeds|warm|cold): (\d+) instructions, (\d+) iterations, status 0", printed)
    instructions = {name: int(count) for name, count, _ in counts}
    assert instructions.keys() == {"all seeds", "warm", "cold"}
    # Counts are whole ticks. A search from the optimum only confirms it.
    assert all(count > 0 and count % 40 == 0 for count in instructions.values())
    assert 2 * instructions["warm"] < instructions["cold"] < instructions["all seeds"]
    # For docs/embedding.md: `--junit-xml FILE -o junit_family=xunit1` shows them.
    for name, count in instructions.items():
        record_property(name, count)
