"""The C that a case becomes: it compiles cleanly, agrees with CasADi, and needs nothing else."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from screwsynth.nlp import Nlp, case_from_tables, formulate, load_case, shipped_cases, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.task import Method
from screwsynth.nlp.embedding.codegen import generate_c, size_words
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.subject import find_subject
from screwsynth.nlp.program.sampling import starting_points

Run = Callable[..., tuple[int, str, str]]
Embedded = Any

STRICT = "-std=c99 -Wall -Wextra -Wpedantic -Werror -O2"
#: An average optimises nothing: C is not generated for it.
CASES = [
    name
    for name, case in ((name, load_case(name)) for name in shipped_cases())
    if len(case.tasks) == 1 or case.method is not Method.AVERAGE
]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler is installed")


def folder(name: str, target: Path) -> Path:
    target.mkdir(parents=True, exist_ok=True)
    for file, text in generate_c(load_case(name), find_case(name).read_text(encoding="utf-8")).items():
        (target / file).write_text(text, encoding="utf-8")
    return target


def made(where: Path, *words: str) -> str:
    done = subprocess.run(["make", "-C", str(where), *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@needs_compiler
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", CASES)
def test_every_shipped_case_compiles_without_a_warning_and_passes_its_test(
    name: str, compiler: str, tmp_path: Path, embedded: Callable[[str], Embedded]
) -> None:
    # The first compiler has made the library with the strict flags and -O2. Those of clang warn at any level.
    shared = embedded(name).folder
    if compiler == COMPILERS[0]:
        where, flags = Path(shutil.copytree(shared, tmp_path / "c")), f"{STRICT} -fPIC"
    else:
        where, flags = tmp_path, STRICT.replace("-O2", "-O0")
        for path in shared.iterdir():
            if path.suffix not in {".o", ".a", ".so"}:
                shutil.copy(path, where)
    printed = made(where, f"CC={compiler}", f"CFLAGS={flags}", "all", "stack", "test")
    assert (f"{identifier(name)}-casadi.o" in printed) == (compiler != COMPILERS[0])
    (counts,) = re.findall(r"^(\d+) passed, 0 failed$", printed, flags=re.MULTILINE)
    assert int(counts) >= 14


@needs_compiler
@pytest.mark.parametrize("name", CASES)
def test_compiled_values_are_those_of_the_program_at_a_thousand_points(
    name: str, embedded: Callable[[str], Embedded]
) -> None:
    embedded(name).compare(find_subject(load_case(name)).nlp, 1000)


@needs_compiler
def test_only_the_mathematics_library_is_needed(embedded: Callable[[str], Embedded]) -> None:
    where, prefix = embedded("paper-4.1-helical").folder, identifier("paper-4.1-helical")
    objects = [str(path) for path in sorted(where.glob(f"{prefix}*.o"))]
    assert len(objects) >= 8
    lines = subprocess.run(["nm", *objects], capture_output=True, text=True, check=True).stdout.splitlines()
    wanted = {line.split()[-1] for line in lines if " U " in line}
    assert {symbol for symbol in wanted if not symbol.startswith(prefix)} <= {
        "sin", "sincos", "cos", "sqrt", "atan2", "fmin", "fmax", "memcpy", "memset", "__stack_chk_fail",
        "_GLOBAL_OFFSET_TABLE_",  # of -fPIC, and no function
    }  # fmt: skip
    assert not [line for line in lines if line.split()[-2:-1] in (["D"], ["B"], ["d"], ["b"])]


@needs_compiler
def test_the_header_serves_cpp(tmp_path: Path, embedded: Callable[[str], Embedded]) -> None:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no C++ compiler is installed")
    where, prefix = embedded("paper-4.3").folder, identifier("paper-4.3")
    (tmp_path / "use.cpp").write_text(
        f"""#include "{prefix}.h"
int main() {{
    double work[{prefix.upper()}_WORK], k[{prefix.upper()}_K], F;
    if ({prefix}_prepare({prefix}_parameter_defaults, k, work)) return 2;
    return {prefix}_F({prefix}_variable_starts, k, &F, work);
}}
""",
        encoding="utf-8",
    )
    objects = [str(path) for path in where.glob(f"{prefix}*.o")]
    flags = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused-variable", f"-I{where}"]
    subprocess.run([compiler, *flags, "use.cpp", *objects, "-lm", "-o", "use"], cwd=tmp_path, check=True)
    assert subprocess.run([str(tmp_path / "use")], check=False).returncode == 0


@needs_compiler
def test_a_limb_of_zero_length_is_told(tmp_path: Path, embedded: Callable[[str], Embedded]) -> None:
    where, prefix = embedded("paper-4.2-translation").folder, identifier("paper-4.2-translation")
    z = [each.name for each in formulate(load_case("paper-4.2-translation")).program.arguments].index("p_z")
    (tmp_path / "zero.c").write_text(
        f"""#include "{prefix}.h"
int main(void) {{
    double work[{prefix.upper()}_WORK], k[{prefix.upper()}_K], F, x[4] = {{4, 4, 0.2, 0.2}}, p[{prefix.upper()}_P];
    int i;
    for (i = 0; i < {prefix.upper()}_P; ++i) p[i] = {prefix}_parameter_defaults[i];
    if ({prefix}_prepare(p, k, work) != 0 || {prefix}_F(x, k, &F, work) != 0) return 2;
    p[{z}] = 0;
    if ({prefix}_prepare(p, k, work) != 0) return 4;
    return {prefix}_F(x, k, &F, work) == 1 ? 0 : 3;
}}
""",
        encoding="utf-8",
    )
    objects = [str(path) for path in where.glob(f"{prefix}*.o")]
    command = [COMPILERS[0], "-std=c99", f"-I{where}", "zero.c", *objects, "-lm", "-o", "zero"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert subprocess.run([str(tmp_path / "zero")], check=False).returncode == 0


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
    probe = tmp_path / "probe.c"
    probe.write_text("int main(void) { return 0; }", encoding="utf-8")
    flags = "-fsanitize=address,undefined -fno-sanitize-recover=all"
    built = [COMPILERS[0], *flags.split(), str(probe), "-o", str(tmp_path / "probe")]
    if subprocess.run(built, check=False, capture_output=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    run(folder(name, tmp_path / "c"), f"-O1 {flags}")


@needs_compiler
@pytest.mark.slow
def test_valgrind_finds_nothing_and_no_heap(tmp_path: Path) -> None:
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("valgrind is not installed")
    where = folder("paper-4.1-rotation", tmp_path)
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


SPECTRA = """
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = { min = 20, max = 32 }
x2 = { min = 8, max = 15 }
x3 = { min = 0, max = 20 }
x4 = { min = 0, max = 25 }
[pose]
position = [{ min = -6, max = 6 }, { min = -6, max = 6 }, { min = 16, max = 26 }]
rotation = { angle = { min = -15, max = 15 } }
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
leg_length = { min = 24, max = 34 }
condition_number = { max = 6, length = 10 }
smallest_singular_value = { min = 0.2, length = 7 }
[solve]
starts = 4
"""


def spectral(target: Path) -> tuple[Path, Nlp]:
    """The folder of a case with limits on singular values, and its program."""
    case = case_from_tables(tomllib.loads(SPECTRA), name="spectra", source="spectra.toml")
    for file, text in generate_c(case, SPECTRA).items():
        (target / file).write_text(text, encoding="utf-8")
    return target, formulate(case)


@needs_compiler
def test_singular_values_without_a_loop_over_legs_compile_without_warnings(tmp_path: Path) -> None:
    tables = tomllib.loads(find_case("paper-4.1-helical").read_text(encoding="utf-8")) | {
        "limits": {"condition_number": {"max": 300, "length": 10}}
    }
    for file, text in generate_c(case_from_tables(tables, name="alone", source="alone"), "").items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    for compiler in COMPILERS:
        command = [compiler, *STRICT.split(), "-fsyntax-only", str(tmp_path / "screwsynth_alone-loops.c")]
        assert subprocess.run(command, capture_output=True, text=True, check=True).stderr == ""


@needs_compiler
def test_limits_on_singular_values_are_small_and_exact(tmp_path: Path) -> None:
    where, nlp = spectral(tmp_path)
    assert sum(path.stat().st_size for path in where.glob("screwsynth_spectra*")) <= 400_000
    began = time.monotonic()
    assert "0 failed" in made(where, f"CC={COMPILERS[0]}", f"CFLAGS={STRICT} -fPIC", "test")
    assert time.monotonic() - began < 60
    objects = sorted(str(path) for path in where.glob("screwsynth_spectra*.o"))
    lines = subprocess.run(["nm", *objects], capture_output=True, text=True, check=True).stdout.splitlines()
    wanted = {line.split()[-1] for line in lines if " U " in line}
    assert {symbol for symbol in wanted if not symbol.startswith("screwsynth_spectra")} <= {
        "sin", "sincos", "cos", "sqrt", "atan2", "fmin", "fmax", "memcpy", "memset", "__stack_chk_fail",
        "_GLOBAL_OFFSET_TABLE_",  # of -fPIC, and no function
    }  # fmt: skip
    assert not [line for line in lines if line.split()[-2:-1] in (["D"], ["B"], ["d"], ["b"])]
    library = str(where / "all.so")
    subprocess.run([COMPILERS[0], "-shared", *objects, "-lm", "-o", library], check=True)
    c, prefix = ctypes.CDLL(library), "screwsynth_spectra"
    header = (where / f"{prefix}.h").read_text(encoding="utf-8")
    sizes = {name: int(value) for name, value in re.findall(r"#define SCREWSYNTH_SPECTRA_(\w+) (\d+)", header)}
    n, limits, p = nlp.n, len(nlp.program.constraints), np.ascontiguousarray(nlp.arguments)
    k, work = np.zeros(sizes["K"] + 1), np.zeros(sizes["WORK"])
    address = ctypes.POINTER(ctypes.c_double)

    def at(array: np.ndarray) -> ctypes._Pointer[ctypes.c_double]:
        return array.ctypes.data_as(address)

    assert c[f"{prefix}_prepare"](at(p), at(k), at(work)) == 0
    generator = np.random.default_rng(5)
    singular = [j for j, each in enumerate(nlp.program.constraints) if each.spectral is not None]
    assert len(singular) == 2
    for x in starting_points(nlp, 101, 7)[1:]:
        g, dg, H, weight = np.zeros(limits), np.zeros((limits, n)), np.zeros((n, n)), np.array([0.7])
        assert c[f"{prefix}_limits"](at(x), at(k), at(g), at(dg), at(work)) == 0
        _, _, constraint, slopes = nlp.program.kernels.derivatives(x, p)
        np.testing.assert_allclose(g, constraint.ravel(), rtol=1e-10, atol=1e-12)
        for j in range(limits):
            np.testing.assert_allclose(dg[j], slopes[j], rtol=0, atol=1e-10 * max(1e-3, np.abs(slopes[j]).max()))
        multipliers = generator.normal(size=limits) * (np.arange(limits) >= min(singular))
        inputs, outputs = (address * 8)(at(x), at(k), at(weight), at(multipliers)), (address * 8)(at(H))
        assert c[f"{prefix}_SQP_curvature"](inputs, outputs, at(work)) == 0
        second = nlp.program.kernels.hessian(x, p, 0.7, multipliers)
        np.testing.assert_allclose(H, second, rtol=0, atol=1e-10 * np.abs(second).max())


@needs_compiler
def test_limits_on_singular_values_hold_where_the_solver_ends(embed: Callable[..., Embedded]) -> None:
    case = case_from_tables(tomllib.loads(SPECTRA), name="spectra", source="spectra.toml")
    solved, wanted = embed(case).solve(), solve(case)
    assert solved.status == 0
    assert abs(solved.F - wanted.F) <= 1e-6 * wanted.F


def test_size_is_said_before_the_folder_is_written(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, err = cli("codegen", "paper-4.1-helical", "--out", str(tmp_path / "made"))
    assert (code, err) == (0, "")
    size, words = out.splitlines()[0].split(" ", 1)
    files = [path for path in (tmp_path / "made").iterdir() if path.suffix in {".c", ".h"}]
    assert int(size) == pytest.approx(sum(path.stat().st_size for path in files) / 1000, abs=1)
    assert words == "kB of C"
    monkeypatch.setattr("screwsynth.nlp.embedding.codegen._LARGE", 100_000)
    case = load_case("hexapod-machining")
    assert "most of it for joint_spacing" in size_words(case, {"a.c": " " * 200_000})


def test_the_same_case_gives_the_same_bytes() -> None:
    case = load_case("paper-4.3")
    assert generate_c(case, "text") == generate_c(load_case("paper-4.3"), "text")


@pytest.mark.parametrize("name", ["paper-4.1-helical", "3 legs!", "größe", "a__b", "", "*/", "int", "日本"])
def test_names_are_identifiers(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))
    tables = tomllib.loads(find_case("paper-4.2-translation").read_text(encoding="utf-8"))
    assert f"{identifier(name)}.h" in generate_c(case_from_tables(tables, name=name, source="x.toml"), "")


def test_names_of_two_cases_do_not_meet() -> None:
    tables = tomllib.loads(find_case("paper-4.2-translation").read_text(encoding="utf-8"))
    declared: dict[str, set[str]] = {}
    for name in ("x", "x solver", "x-sqp", "x qp", "x casadi", "x-f", "x variable"):
        files = generate_c(case_from_tables(tables, name=name, source="x.toml"), "")
        own = {file for file in files if file.startswith("screwsynth")}
        text = "\n".join(files[file] for file in own)
        own |= set(re.findall(r"#define (SCREWSYNTH_\w+)", text)) - {"SCREWSYNTH_STATUS", "SCREWSYNTH_VERSION"}
        own |= set(re.findall(r"^[\w *]*?\b(screwsynth_[A-Za-z0-9_]+)\(", text, flags=re.MULTILINE))
        for other, theirs in declared.items():
            assert not own & theirs - {"screwsynth_status"}, (name, other, own & theirs)
        declared[name] = own


@needs_compiler
def test_what_a_case_says_cannot_break_the_c(tmp_path: Path) -> None:
    tables = {
        "title": "*/ int main; /* \\",
        "units": {"length": '"\\%d'},
        "robot": {"model": "stewart-gough", "parameters": {"x1": 12, "x2": 8, "x3": 30, "x4": {"min": 0, "max": 30}}},
        "pose": {"position": [0, 0, 40]},
        "task": [{"name": '??/"\n*/', "sense": "max", "axis": [0, 0, 1], "pitch": float("inf")}],
    }
    for file, text in generate_c(case_from_tables(tables, name="3 legs!", source="bad.toml"), "").items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert "0 failed" in made(tmp_path, f"CFLAGS={STRICT} -Wno-trigraphs", "test")


def test_the_command_line_writes_the_folder(tmp_path: Path, cli: Run) -> None:
    code, out, err = cli("codegen", "paper-4.1-helical", "--out", str(tmp_path / "made"))
    assert (code, err) == (0, "")
    assert "make -C" in out
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert {"case.toml", "Makefile", "CMakeLists.txt", "README.md", "selftest.c", "bench.c"} <= names
    assert not [name for name in names if name.startswith(".")]


@pytest.mark.parametrize("option", [("--language", "c"), ("--precision", "double")])
def test_options_with_one_value_are_gone(tmp_path: Path, cli: Run, option: tuple[str, str]) -> None:
    code, _, err = cli("codegen", "paper-4.1-helical", "--out", str(tmp_path / "made"), *option)
    assert code == 2
    assert option[0] in err
    assert not (tmp_path / "made").exists()
    _, out, _ = cli("codegen", "--help")
    assert option[0] not in out


@needs_compiler
def test_a_compiled_solve_is_the_same_and_compiles_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Run
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    interpreted, compiled = (solve(load_case("paper-4.3"), starts=6, compiled=choice) for choice in (False, True))
    assert abs(interpreted.F - compiled.F) <= 1e-12 * interpreted.F
    (library,) = (tmp_path / "screwsynth").iterdir()
    made_at = library.stat().st_mtime_ns
    code, out, err = cli("solve", "paper-4.3", "--starts", "2", "--compiled")
    assert (code, err) == (0, "")
    assert "408.803" in out
    assert [path.stat().st_mtime_ns for path in (tmp_path / "screwsynth").iterdir()] == [made_at]


@pytest.mark.parametrize("compiler", ["no-such-compiler", "false"])
def test_compiling_without_a_compiler_is_told_in_a_sentence(
    compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Run
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", compiler)
    code, out, err = cli("solve", "paper-4.1-helical", "--compiled")
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert "compiler" in err


@needs_compiler
def test_cmake_builds_it_too(tmp_path: Path) -> None:
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("cmake is not installed")
    where, build = folder("paper-4.2-translation", tmp_path / "c"), tmp_path / "build"
    for words in (["-S", str(where), "-B", str(build)], ["--build", str(build)]):
        done = subprocess.run([cmake, *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert subprocess.run([str(build / "selftest")], check=False, capture_output=True).returncode == 0
