"""The C that a case becomes: it compiles cleanly, agrees with CasADi, and needs nothing else."""

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from screwsynth.nlp import case_from_tables, evaluate, formulate, load_case, shipped_cases
from screwsynth.nlp.casefile import find_case
from screwsynth.nlp.codegen import generate_c, identifier
from screwsynth.nlp.sampling import starting_points

Run = Callable[..., tuple[int, str, str]]

STRICT = "-std=c99 -Wall -Wextra -Wpedantic -Werror -O2"
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
@pytest.mark.parametrize("name", shipped_cases())
def test_every_shipped_case_compiles_without_a_warning_and_passes_its_test(
    name: str, compiler: str, tmp_path: Path
) -> None:
    printed = made(folder(name, tmp_path), f"CC={compiler}", f"CFLAGS={STRICT}", "test")
    (counts,) = re.findall(r"^(\d+) passed, 0 failed$", printed, flags=re.MULTILINE)
    assert int(counts) >= 14


@needs_compiler
def test_compiled_values_are_those_of_the_program_at_random_points(tmp_path: Path) -> None:
    name = "paper-4.3"
    where, prefix = folder(name, tmp_path), identifier(name)
    library = tmp_path / "all.so"
    sources = [str(where / f"{prefix}{end}") for end in (".c", "_casadi.c")]
    subprocess.run([COMPILERS[0], "-std=c99", "-O2", "-shared", "-fPIC", *sources, "-lm", "-o", library], check=True)
    compiled = ctypes.CDLL(str(library))
    nlp = formulate(load_case(name))
    n, m = nlp.n, 6
    p = np.ascontiguousarray(nlp.arguments)
    work, F, gradient, hessian = np.zeros(64), np.zeros(1), np.zeros(n), np.zeros((n, n))
    J, rates, g, dg = np.zeros((m, 6)), np.zeros(m), np.zeros(1), np.zeros((1, n))

    def call(function: str, x: np.ndarray, *outputs: np.ndarray) -> int:
        pointers = [ctypes.c_void_p(each.ctypes.data) for each in (x, p, *outputs, work)]
        return int(getattr(compiled, f"{prefix}_{function}")(*pointers))

    for point in starting_points(nlp, 1001, 7)[1:]:
        x = np.ascontiguousarray(point)
        assert call("F_hessian", x, F, gradient, hessian) == 0
        assert call("jacobian", x, J) == call("rates", x, rates) == call("limits", x, g, dg) == 0
        state = evaluate(nlp, x)
        value, slope, constraint, constraint_slope = nlp.program.kernels.derivatives(x, p)
        (second,) = nlp.program.kernels.hessian(x, p, 1.0, np.zeros(1))
        # The same operations in the same order: a compiler may still contract or reorder the last digit.
        for got, wanted in (
            (F, value.ravel()),
            (gradient, slope.ravel()),
            (hessian, second),
            (J, state.jacobian),
            (rates, state.rates),
            (g, constraint.ravel()),
            (dg, constraint_slope),
        ):
            assert np.max(np.abs(got - wanted)) <= 1e-14 * max(1.0, float(np.max(np.abs(wanted))))


@needs_compiler
def test_only_the_mathematics_library_is_needed(tmp_path: Path) -> None:
    where, prefix = folder("paper-4.1-helical", tmp_path), identifier("paper-4.1-helical")
    made(where, "selftest")
    objects = [str(where / f"{prefix}{end}.o") for end in ("", "_casadi")]
    lines = subprocess.run(["nm", *objects], capture_output=True, text=True, check=True).stdout.splitlines()
    wanted = {line.split()[-1] for line in lines if " U " in line}
    assert {symbol for symbol in wanted if not symbol.startswith(prefix)} <= {
        "sin", "sincos", "cos", "sqrt", "atan2", "memcpy", "memset", "__stack_chk_fail",
    }  # fmt: skip
    assert not [line for line in lines if line.split()[-2:-1] in (["D"], ["B"], ["d"], ["b"])]


@needs_compiler
def test_the_header_serves_cpp(tmp_path: Path) -> None:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no C++ compiler is installed")
    where, prefix = folder("paper-4.3", tmp_path), identifier("paper-4.3")
    made(where, "selftest")
    (where / "use.cpp").write_text(
        f"""#include "{prefix}.h"
int main() {{
    double work[{prefix.upper()}_WORK], F;
    return {prefix}_F({prefix}_variable_starts, {prefix}_parameter_defaults, &F, work);
}}
""",
        encoding="utf-8",
    )
    objects = [f"{prefix}.o", f"{prefix}_casadi.o"]
    flags = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused-variable"]
    subprocess.run([compiler, *flags, "use.cpp", *objects, "-lm", "-o", "use"], cwd=where, check=True)
    assert subprocess.run([str(where / "use")], check=False).returncode == 0


@needs_compiler
def test_a_limb_of_zero_length_is_told(tmp_path: Path) -> None:
    where, prefix = folder("paper-4.2-translation", tmp_path), identifier("paper-4.2-translation")
    made(where, "selftest")
    z = [each.name for each in formulate(load_case("paper-4.2-translation")).program.arguments].index("p_z")
    (where / "zero.c").write_text(
        f"""#include "{prefix}.h"
int main(void) {{
    double work[{prefix.upper()}_WORK], F, x[4] = {{4, 4, 0.2, 0.2}}, p[{prefix.upper()}_P];
    int i;
    for (i = 0; i < {prefix.upper()}_P; ++i) p[i] = {prefix}_parameter_defaults[i];
    if ({prefix}_F(x, p, &F, work) != 0) return 2;
    p[{z}] = 0;
    return {prefix}_F(x, p, &F, work) == 1 ? 0 : 3;
}}
""",
        encoding="utf-8",
    )
    objects = [f"{prefix}.o", f"{prefix}_casadi.o"]
    subprocess.run([COMPILERS[0], "-std=c99", "zero.c", *objects, "-lm", "-o", "zero"], cwd=where, check=True)
    assert subprocess.run([str(where / "zero")], check=False).returncode == 0


def test_the_same_case_gives_the_same_bytes() -> None:
    case = load_case("paper-4.3")
    assert generate_c(case, "text") == generate_c(load_case("paper-4.3"), "text")


@pytest.mark.parametrize("name", ["paper-4.1-helical", "3 legs!", "größe", "a__b", "", "*/", "int"])
def test_names_are_identifiers(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier(name))


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


@pytest.mark.parametrize("option", [("--language", "rust"), ("--precision", "single")])
def test_other_languages_and_precisions_are_refused(tmp_path: Path, cli: Run, option: tuple[str, str]) -> None:
    code, _, err = cli("codegen", "paper-4.1-helical", "--out", str(tmp_path / "made"), *option)
    assert code == 2
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "made").exists()
