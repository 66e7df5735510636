"""Generated C in other programs: C++, a real-time loop, Simulink, CMake projects, and an emulated Cortex-M7."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from builders import soaked
from generated import COMPILERS, STRICT, WARNINGS, needs_compiler, run, written

from screwsynth.nlp import generate_c, load_case
from screwsynth.nlp.embedding.ctext import identifier

STRICT_CPP = f"-std=c++17 {WARNINGS} -O1"


def put(folder: Path, files: Mapping[str, str]) -> None:
    """Write files into a folder, which is made where it does not exist."""
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C of a case and its library, compiled."""
    if not COMPILERS:
        pytest.skip("no C compiler is installed")
    where = written("paper-4.1-helical", tmp_path_factory.mktemp("helical"))
    run("make", f"CC={COMPILERS[0]}", f"CFLAGS={STRICT} -O1", "library", where=where)
    return where


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_the_cpp_header_and_its_example_compile_and_run(compiler: str, folder: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    (folder / "example-cpp").unlink(missing_ok=True)
    run("make", f"CXX={compiler}", f"CXXFLAGS={STRICT_CPP}", "example-cpp", where=folder)
    printed = run("./example-cpp", where=folder)
    assert "the case: F = 407.2107, status 0" in printed
    assert re.search(r"a vertical axis: F = [\d.]+, status 0", printed)
    assert "angle.max: 0.523599 rad" in printed
    put(folder, {"throws.cpp": THROWS})
    run(compiler, *STRICT_CPP.split(), "throws.cpp", "-L.",
        f"-l{identifier('paper-4.1-helical')}", "-lm", "-o", "throws", where=folder)  # fmt: skip
    run("./throws", where=folder)
    # Another version's folder in the same program.
    other = [compiler, "-fsyntax-only", "-DSCREWSYNTH_VERSION=1", "example.cpp"]
    done = subprocess.run(other, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "have different versions of screwsynth" in done.stderr


THROWS = """#include <cmath>
#include <stdexcept>
#include "screwsynth_paper_4_1_helical.hpp"
namespace robot = screwsynth_paper_4_1_helical;
template <typename Error, typename Call> bool throws(Call call) {
    try { call(); } catch (const Error &) { return true; }
    return false;
}
int main() {
    robot::Solver solver;
    const auto limit = SCREWSYNTH_PAPER_4_1_HELICAL_LIMIT_ANGLE_MAX;
    if (!throws<std::out_of_range>([&] { solver.set_limit(limit, std::nan("")); })) return 1;
    if (!throws<std::out_of_range>([&] { solver.set_bounds(6, 0.0, 1.0); })) return 2;
    if (!throws<std::out_of_range>([&] { solver.set_bounds(0, 1.0, 0.0); })) return 3;
    if (!throws<std::invalid_argument>([&] { robot::twist_from_axis({}, {}, 0.0); })) return 4;
    solver.set_limit(limit, 0.1);
    if (!(std::fabs(solver.limit(limit) - 0.1) < 1e-15)) return 5;
    robot::Solver copy = solver; /* has its own memory */
    solver.set_limit(limit, 0.3);
    const robot::Result small = copy.solve(), large = solver.solve();
    if (!small || !large || !(small.angle <= 0.1 + 1e-7) || !(large.angle > 0.29)) return 6;
    copy.start_at(small.point());
    copy.set_seeds(0);
    const robot::Result last = copy.solve();
    copy.p()[SCREWSYNTH_PAPER_4_1_HELICAL_p_x1] = std::nan("");
    const robot::Result refused = copy.solve(); /* the last answer, and the status */
    if (refused.status != SCREWSYNTH_BAD_INPUT || refused || !last) return 7;
    return refused.F == last.F && refused.point() == last.point() ? 0 : 8;
}
"""


@needs_compiler
@pytest.mark.skipif(sys.platform != "linux", reason="clock_nanosleep is Linux's")
def test_the_real_time_loop_compiles_and_keeps_within_its_steps(folder: Path) -> None:
    source = (folder / "realtime.c").read_text(encoding="utf-8")
    # The same loop, which checks each step.
    hook = "/* Send x to the robot here. */"
    assert source.count(hook) == 1
    check = """
        {
            static double before[SCREWSYNTH_PAPER_4_1_HELICAL_N];
            static int has_before = 0;
            int j;
            for (j = 0; j < SCREWSYNTH_PAPER_4_1_HELICAL_N && has_before; ++j)
                if (fabs(x[j] - before[j]) > 1.000001 * STEP * (screwsynth_paper_4_1_helical_variable_upper[j] -
                                                         screwsynth_paper_4_1_helical_variable_lower[j]))
                    return 2;
            memcpy(before, x, sizeof before);
            has_before = 1;
        }"""
    (folder / "realtime.c").write_text(source.replace(hook, check), encoding="utf-8")
    run("make", f"CC={COMPILERS[0]}", f"CFLAGS={STRICT} -O1", "realtime", where=folder)
    printed = run("./realtime", "200", where=folder)
    cycles, held = (int(each) for each in re.findall(r"^(\d+) cycles .* us; (\d+) held", printed)[0])
    assert cycles == 200
    # On a busy machine cycles are missed.
    assert held <= cycles


@needs_compiler
def test_the_s_function_compiles_and_solves_in_a_stub_of_simulink(folder: Path) -> None:
    put(folder, {"simstruc.h": SIMSTRUC, "simulink.c": SIMULINK})
    prefix = identifier("paper-4.1-helical")
    words = ["-DMATLAB_MEX_FILE", "sfunction.c", "-L.", f"-l{prefix}", "-lm", "-o", "sfunction"]
    run(COMPILERS[0], *STRICT.split(), *words, where=folder)
    printed = run("./sfunction", where=folder)
    assert printed == "4 ports, 6 1 1 9 wide: status 0, F 407.2107; again 0, 407.2107; none 3\n"


#: As much of simstruc.h as the S-function calls.
SIMSTRUC = """#include <stdlib.h>
typedef double real_T;
typedef int int_T;
typedef struct { double number; } mxArray;
typedef struct {
    int parameters, outputs, widths[8], iwidth, rwidth;
    real_T twist[64], *out[8], *rwork, time;
    int_T *iwork;
    mxArray given[3];
} SimStruct;
#define SS_OPTION_EXCEPTION_FREE_CODE 1
#define START(S) ((S).given[0].number = 1e-3, (S).given[1].number = 16, (S).given[2].number = -1, \\
                  mdlInitializeSizes(&(S)), mdlInitializeSampleTimes(&(S)), mdlStart(&(S)))
#define mxGetScalar(a) ((a)->number)
#define ssSetNumSFcnParams(S, n) ((S)->parameters = (n))
#define ssGetNumSFcnParams(S) ((S)->parameters)
#define ssGetSFcnParamsCount(S) 3
#define ssGetSFcnParam(S, i) (&(S)->given[i])
#define ssSetSFcnParamTunable(S, i, yes) ((void)(S), (void)(i))
#define ssSetNumContStates(S, n) ((void)(S))
#define ssSetNumDiscStates(S, n) ((void)(S))
#define ssSetNumInputPorts(S, n) ((n) == 1)
#define ssSetInputPortWidth(S, i, n) ((S)->iwidth = (n))
#define ssSetInputPortRequiredContiguous(S, i, yes) ((void)(S))
#define ssSetInputPortDirectFeedThrough(S, i, yes) ((void)(S))
#define ssSetNumOutputPorts(S, n) ((S)->outputs = (n))
#define ssSetOutputPortWidth(S, i, n) ((S)->widths[i] = (n), (S)->out[i] = calloc((size_t)(n), sizeof(real_T)))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetNumRWork(S, n) ((S)->rwork = calloc((size_t)(n), sizeof(real_T)))
#define ssSetNumIWork(S, n) ((S)->iwork = calloc((size_t)(n), sizeof(int_T)))
#define ssSetOptions(S, o) ((void)(S))
#define ssSetSampleTime(S, i, t) ((S)->time = (t))
#define ssSetOffsetTime(S, i, t) ((void)(S))
#define ssGetRWork(S) ((S)->rwork)
#define ssGetIWork(S) ((S)->iwork)
#define ssGetInputPortSignal(S, i) ((const void *)(S)->twist)
#define ssGetOutputPortRealSignal(S, i) ((S)->out[i])
"""
SIMULINK = """#include <math.h>
#include <stdio.h>
int main(void) {
    static SimStruct S;
    double x;
    int k;
    START(S);
    for (k = 0; k < 6; ++k)
        S.twist[k] = screwsynth_paper_4_1_helical_parameter_defaults[SCREWSYNTH_PAPER_4_1_HELICAL_TWIST + k];
    mdlOutputs(&S, 0);
    printf("%d ports, %d %d %d %d wide: ", S.outputs, S.widths[0], S.widths[1], S.widths[2], S.widths[3]);
    printf("status %g, F %.7g; ", *S.out[2], *S.out[1]);
    mdlOutputs(&S, 0);
    printf("again %g, %.7g; ", *S.out[2], *S.out[1]);
    S.twist[0] = NAN;
    x = S.out[0][2];
    mdlOutputs(&S, 0);
    printf("none %g\\n", *S.out[2]);
    if (S.out[0][2] != x || x < 1.0) return 2; /* x is held */
    mdlTerminate(&S);
    return S.iwidth == 6 && S.time == 1e-3 ? 0 : 1;
}
"""

PROGRAM = """add_executable(both both.c)
target_link_libraries(both screwsynth_paper_4_2_rotation::screwsynth_paper_4_2_rotation
  screwsynth_paper_4_2_translation::screwsynth_paper_4_2_translation)
"""
PROJECT = f"""cmake_minimum_required(VERSION 3.13)
project(both C)
add_compile_options(-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror)
add_subdirectory(one)
add_subdirectory(two)
{PROGRAM}"""
FOUND = f"""cmake_minimum_required(VERSION 3.13)
project(found C)
find_package(screwsynth_paper_4_2_rotation 0.1 REQUIRED)
find_package(screwsynth_paper_4_2_translation REQUIRED)
{PROGRAM}"""
BOTH = """#include "screwsynth_paper_4_2_rotation.h"
#include "screwsynth_paper_4_2_translation.h"
#include <stdio.h>
int main(void) {
    static double work[SCREWSYNTH_PAPER_4_2_ROTATION_SOLVERWORK + SCREWSYNTH_PAPER_4_2_TRANSLATION_SOLVERWORK];
    static int iwork[SCREWSYNTH_PAPER_4_2_ROTATION_SOLVERIWORK + SCREWSYNTH_PAPER_4_2_TRANSLATION_SOLVERIWORK];
    screwsynth_paper_4_2_rotation_problem one;
    screwsynth_paper_4_2_translation_problem two;
    screwsynth_paper_4_2_rotation_result first;
    screwsynth_paper_4_2_translation_result second;
    screwsynth_status a, b;
    screwsynth_paper_4_2_rotation_defaults(&one);
    screwsynth_paper_4_2_translation_defaults(&two);
    a = screwsynth_paper_4_2_rotation_solve(&one, &first, work, iwork);
    b = screwsynth_paper_4_2_translation_solve(&two, &second, work, iwork);
    printf("%d %d %d\\n", (int)a, (int)b, first.F != second.F);
    return a != SCREWSYNTH_OK || b != SCREWSYNTH_OK;
}
"""


@pytest.fixture
def cmake() -> Callable[..., str]:
    found = shutil.which("cmake")
    if found is None or not COMPILERS:
        pytest.skip("cmake or a C compiler is not installed")
    return lambda *words, where: run(found, *words, where=where)


@pytest.mark.slow
def test_two_folders_are_one_project_are_installed_and_found(tmp_path: Path, cmake: Callable[..., str]) -> None:
    written("paper-4.2-rotation", tmp_path / "one")
    written("paper-4.2-translation", tmp_path / "two")
    flags = f"-DCMAKE_C_COMPILER={COMPILERS[0]}"
    put(tmp_path, {"CMakeLists.txt": PROJECT, "both.c": BOTH})
    cmake("-S", ".", "-B", "build", flags, f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'installed'}", where=tmp_path)
    cmake("--build", "build", where=tmp_path)
    assert run("build/both", where=tmp_path) == "0 0 1\n"
    # Inside of a project there are no programs.
    assert not list(tmp_path.glob("build/*/selftest"))
    cmake("--install", "build", where=tmp_path)
    user = tmp_path / "user"
    put(user, {"CMakeLists.txt": FOUND, "both.c": BOTH})
    cmake("-S", ".", "-B", "build", flags, f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}", where=user)
    cmake("--build", "build", where=user)
    assert run("build/both", where=user) == "0 0 1\n"
    # A bare machine gets the library alone.
    bare = ("-DCMAKE_SYSTEM_NAME=Generic", "-DCMAKE_C_COMPILER_WORKS=1")
    cmake("-S", "one", "-B", "bare", flags, *bare, where=tmp_path)
    targets = cmake("--build", "bare", "--target", "help", where=tmp_path)
    assert "screwsynth_paper_4_2_rotation" in targets
    assert "selftest" not in targets


#: The second task gets the twist, the weight and the sense of the first one, and the other way round.
EXCHANGED = """#include <cstdio>
#include "screwsynth_peg_in_hole.hpp"
namespace robot = screwsynth_peg_in_hole;
int main() {
    robot::Solver solver;
    robot::Twist twists[2];
    const double weights[2] = {solver.weight(0), solver.weight(1)};
    for (std::size_t task = 0; task < 2; ++task)
        for (std::size_t i = 0; i < 6; ++i) twists[task][i] = screwsynth_peg_in_hole_task_twists[6 * task + i];
    const robot::Result before = solver.solve();
    for (std::size_t task = 0; task < 2; ++task) {
        solver.set_twist(task, twists[1 - task]);
        solver.set_weight(task, weights[1 - task]);
    }
    const robot::Result exchanged = solver.solve();
    solver.set_weight(1, -weights[0]);
    const robot::Result other = solver.solve();
    std::printf("%d %.9g %d %.9g %d %d\\n", before.status, before.F, exchanged.status, exchanged.F, other.status,
                other.F > before.F + 1e-6 || other.F < before.F - 1e-6);
    try { solver.set_weight(2, 1.0); return 1; } catch (const std::out_of_range &) {}
    try { solver.set_twist(2, twists[0]); return 1; } catch (const std::out_of_range &) {}
    return 0;
}
"""
#: Simulink's solver with the tasks exchanged in its input.
SAMPLES = """#include <stdio.h>
int main(void) {
    static SimStruct S;
    const double *p = screwsynth_peg_in_hole_parameter_defaults;
    int task, i;
    START(S);
    for (task = 0; task < 2; ++task) {
        for (i = 0; i < 6; ++i) S.twist[6 * task + i] = p[SCREWSYNTH_PEG_IN_HOLE_TWIST_OF(1 - task) + i];
        S.twist[12 + task] = p[screwsynth_peg_in_hole_weights[1 - task]];
    }
    mdlOutputs(&S, 0);
    printf("%d wide: status %g, F %.9g\\n", S.iwidth, *S.out[2], *S.out[1]);
    mdlTerminate(&S);
    return 0;
}
"""


@needs_compiler
@pytest.mark.skipif(not shutil.which("g++"), reason="g++ is not installed")
def test_several_tasks_are_reached_from_cpp_and_simulink(tmp_path: Path) -> None:
    where, prefix = written("peg-in-hole", tmp_path), identifier("peg-in-hole")
    run("make", f"CC={COMPILERS[0]}", f"CFLAGS={STRICT} -O1", "library", "realtime.o", where=where)
    put(where, {"e.cpp": EXCHANGED, "simstruc.h": SIMSTRUC, "simulink.c": SAMPLES})
    run("g++", *STRICT_CPP.split(), "e.cpp", "-L.", f"-l{prefix}", "-lm", "-o", "e", where=where)
    status, before, again, exchanged, third, differs = run("./e", where=where).split()
    assert (status, again, third, differs) == ("0", "0", "0", "1")
    assert float(exchanged) == pytest.approx(float(before), rel=1e-7)
    words = ["-DMATLAB_MEX_FILE", "sfunction.c", "-L.", f"-l{prefix}", "-lm", "-o", "s"]
    run(COMPILERS[0], *STRICT.split(), *words, where=where)
    wide, F = re.findall(r"^(\d+) wide: status 0, F (\S+)$", run("./s", where=where))[0]
    assert int(wide) == 14
    assert float(F) == pytest.approx(float(before), rel=1e-7)


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
    put(folder, files | {"main.c": main, "start.c": START, "machine.ld": LINKER})
    library = [name for name in files if name.startswith(prefix) and name.endswith(".c") and "casadi" not in name]
    generated = [name for name in files if name.startswith(prefix) and name.endswith("-casadi.c")]

    # The address of the stack stands among functions in the table of vectors, which ISO C does not allow.
    for flag, sources in (
        ("-O2", library),
        ("-Wno-unused-parameter", generated),
        ("-Dmain=selftest", ["selftest.c"]),
        ("-Wno-pedantic", ["start.c", "main.c"]),
    ):
        run(COMPILER, *FLAGS, flag, "-c", *sources, where=folder)
    objects = [path.name for path in sorted(folder.glob("*.o"))]
    link = ("-nostartfiles", "-T", "machine.ld", "--specs=rdimon.specs", *objects, "-lm", "-o", "image.elf")
    run(COMPILER, *FLAGS, *link, where=folder)
    return folder / "image.elf"


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", soaked(["paper-4.1-helical", "paper-4.2-rotation", "paper-4.4-max"], ["paper-4.1-helical"])
)
def test_self_test_and_counted_solves(
    case: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    for program in (COMPILER, EMULATOR):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed")
    if not Path(run(COMPILER, "-print-file-name=rdimon.specs", where=tmp_path).strip()).is_absolute():
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
