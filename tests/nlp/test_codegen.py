"""Generated C: it compiles cleanly, agrees with CasADi, needs nothing else, and the command that writes it."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import FEW_CASES, Patch, Run, assert_words, case_from, output_of, refusal_of, saved, soaked
from generated import (
    COMPILERS,
    OPTIMISED,
    STRICT,
    assert_only_mathematics_is_needed,
    made,
    needs_compiler,
    run,
    written,
)

from screwsynth.nlp import formulate, generate_c, load_case, shipped_cases, solve
from screwsynth.nlp.embedding.codegen import size_words
from screwsynth.nlp.embedding.ctext import Macros, identifier
from screwsynth.nlp.embedding.measure import CORTEX_M7, NOT_MEASURED, X86_64, measure, stack_bound, with_figures
from screwsynth.nlp.embedding.subject import find_subject

#: The C of a case by its name.
OfCase = Callable[[str], Any]

#: Cases whose C is another's but for numbers, robots or sizes; an average optimises nothing, and has no C, nor has an
#: objective other than F.
LIKE_OTHERS = {
    "agile-eye", "drilling-spindle", "handling-3-upu", "hexapod-pocket", "hexapod-workspace", "machine-tool",
    "motion-base", "paper-4.1-rotation", "paper-4.1-rotation-axis-z", "paper-4.2", "paper-4.2-rotation",
    "paper-4.3-axis-x", "paper-4.4-min", "pick-and-place", "reachy-mini",
}  # fmt: skip
CASES = [name for name in shipped_cases() if name not in LIKE_OTHERS]


@needs_compiler
@pytest.mark.parametrize("name", soaked(CASES, FEW_CASES))
def test_shipped_cases_compile_without_warnings_and_pass_tests(name: str, tmp_path: Path, embedded: OfCase) -> None:
    # The first compiler has made the library with the strict flags. The others need not compile to warn.
    where, level = Path(shutil.copytree(embedded(name).folder, tmp_path / "c")), "-O2" if name in OPTIMISED else "-O1"
    sources = {path.name for path in where.glob("*.c")} - {"sfunction.c", "realtime.c"}  # of other systems
    for compiler in COMPILERS[1:]:
        run(compiler, *STRICT.split(), "-fsyntax-only", *sources, where=where)
    printed = made(where, f"CFLAGS={STRICT} {level} -fPIC", "all", "stack", "test")
    assert f"{identifier(name)}-casadi.o" not in printed
    (counts,) = re.findall(r"^(\d+) passed, 0 failed$", printed, flags=re.MULTILINE)
    assert int(counts) >= 14


@needs_compiler
@pytest.mark.parametrize("name", ["hexapod-machining", "flight-simulator"])
def test_workspaces_are_those_that_the_compiler_counts(name: str, tmp_path: Path, embedded: OfCase) -> None:
    where, parts = Path(shutil.copytree(embedded(name).folder, tmp_path / "c")), ("solver.c", "loops.c")
    for source in [where / f"{identifier(name)}-{part}" for part in parts]:
        text, pattern = source.read_text(encoding="utf-8"), r"^(typedef char enough_\w+\[\w+ )>="
        source.write_text(re.sub(pattern, r"\1==", text, flags=re.MULTILINE), encoding="utf-8")
        assert text != source.read_text(encoding="utf-8")
        run(COMPILERS[0], *STRICT.split(), "-fsyntax-only", source.name, where=where)


def test_macros_are_read_as_the_preprocessor_reads_them() -> None:
    text = "#define A(n, c) (2 * (n) * (n) + (c)) /* doubles */\n#define B (A(3, 4) + (2 > 1) * 5)\n#define C 7\n"
    macros = Macros(text, "#define PARTS(part) \\\n    part(x, B) \\\n    part(y, C * 2) part(z, 0)\n#define C 10\n")
    assert (macros.value("A", 1, 2), macros.value("B"), macros.value("C")) == (4, 27, 10)
    assert macros.sum_of_parts("PARTS") == 47


@pytest.mark.slow
@pytest.mark.skipif("clang" not in COMPILERS, reason="clang is not installed")
@pytest.mark.parametrize("name", soaked(OPTIMISED, ("paper-4.1-helical", "camera-mount")))
def test_what_clang_optimises_passes_the_test_too(name: str, tmp_path: Path, embedded: OfCase) -> None:
    for path in embedded(name).folder.iterdir():
        if path.suffix not in {".o", ".a", ".so"}:
            shutil.copy(path, tmp_path)
    printed = made(tmp_path, "CC=clang", f"CFLAGS={STRICT} -O2", "all", "stack", "test")
    assert_words(printed, f"{identifier(name)}-casadi.o", " passed, 0 failed")


@needs_compiler
@pytest.mark.parametrize(
    "name", soaked(CASES, (*FEW_CASES, *OPTIMISED, "reachy-mini-envelope", "peg-in-hole", "paper-4.3"))
)
def test_compiled_values_are_those_of_the_program_at_random_points(name: str, embedded: OfCase) -> None:
    embedded(name).compare(find_subject(load_case(name)).nlp, 300)


@needs_compiler
def test_only_mathematics_is_needed_and_a_parent_project_may_forbid_warnings(embedded: OfCase) -> None:
    c = embedded("paper-4.1-helical")
    assert_only_mathematics_is_needed(c.folder, c.prefix)
    # Headers are read line by line.
    command = [COMPILERS[0], "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"{c.prefix}-casadi.c"]
    done = subprocess.run(command, cwd=c.folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    tables = re.findall(rf"{c.prefix}_\w+\[\w+ \+ 1\] = \{{([^}}]*)\}}", c.header)
    assert len(tables) > 20
    for table in tables:
        for line in table.strip().splitlines():
            assert line.strip().rstrip(",").count(",") == 0 or '"' in line


def test_units_of_f_twists_rates_and_multipliers_are_data() -> None:
    files = generate_c(load_case("hexapod-machining"), "")
    data = json.loads(files["manifest.json"])
    units = {each["name"]: each["unit"] for each in data["parameters"]}
    assert data["F_unit"] == "(in/rad)\N{SUPERSCRIPT TWO}"
    assert (units["twist_0"], units["twist_5"], data["tasks"][0]["rate_unit"]) == ("rad/rad", "in/rad", "in/rad")
    of_limits = {each["key"]: each["multiplier_unit"] for each in data["limits"]}
    assert of_limits["leg_length.max"] == f"{data['F_unit']}/in"
    assert of_limits["base_joint_angle.max"] == f"{data['F_unit']}/rad"
    assert of_limits["rate_share.max"] == data["F_unit"]
    header = next(text for name, text in files.items() if name.endswith(".h") and "_F_unit" in text)
    assert_words(header, '_F_unit = "(in/rad)\\302\\262";', "_limit_multiplier_units[")
    constraints = {each["name"]: each["multiplier_unit"] for each in data["constraints"]}
    leg = next(name for name in constraints if "leg_length" in name)
    assert constraints[leg] == f"{data['F_unit']}/in\N{SUPERSCRIPT TWO}"
    assert generate_c(load_case("hexapod-machining"), "") == files
    # A translation has no angle to be measured by.
    drill = json.loads(generate_c(load_case("drilling-spindle"), "")["manifest.json"])
    assert (drill["F_unit"], drill["tasks"][0]["rate_unit"]) == ("(mm/mm)\N{SUPERSCRIPT TWO}", "mm/mm")


@needs_compiler
def test_a_limb_of_zero_length_is_told(embedded: OfCase) -> None:
    c, nlp = embedded("paper-4.2-translation"), formulate(load_case("paper-4.2-translation"))
    p, x, F = np.array(nlp.arguments), np.array([4, 4, 0.2, 0.2]), np.zeros(1)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    assert c.call("prepare", p, k, work) == c.call("F", x, k, F, work) == 0
    p[[each.name for each in nlp.program.arguments].index("p_z")] = 0
    assert c.call("prepare", p, k, work) == 0
    assert c.call("F", x, k, F, work) == 1


@needs_compiler
def test_cmake_builds_it_too(tmp_path: Path) -> None:
    cmake = shutil.which("cmake") or pytest.skip("cmake is not installed")
    where, build = written("paper-4.2-translation", tmp_path / "c"), tmp_path / "build"
    for words in (["-S", str(where), "-B", str(build)], ["--build", str(build)]):
        done = subprocess.run([cmake, *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert subprocess.run([str(build / "selftest")], check=False, capture_output=True).returncode == 0


@needs_compiler
@pytest.mark.parametrize(
    ("version", "accepted"), [("0.4.2", {"0.4", "0.4.1"}), ("1.3.0", {"1.0", "1.3"}), ("2.0.1", {"2.0", "2"})]
)
def test_versions_are_semantic(version: str, accepted: set[str], tmp_path: Path, monkeypatch: Patch) -> None:
    cmake = shutil.which("cmake") or pytest.skip("cmake is not installed")
    monkeypatch.setattr("screwsynth.nlp.embedding.codegen.__version__", version)
    where, name = written("paper-4.2-translation", tmp_path / "c"), identifier("paper-4.2-translation")
    words = [cmake, "-S", str(where), "-B", "build", "-DCMAKE_C_COMPILER_WORKS=1"]
    subprocess.run(words, cwd=tmp_path, capture_output=True, check=True)
    asked = ["0.3", "0.4", "0.4.1", "0.5", "1.0", "1.3", "1.4", "2", "2.0", "2.1", "3.0"]
    lines = []
    for each in asked:
        major, minor = [*each.split("."), "0"][:2]
        lines += [f"set(PACKAGE_FIND_VERSION {each})", f"set(PACKAGE_FIND_VERSION_MAJOR {major})"]
        lines += [f"set(PACKAGE_FIND_VERSION_MINOR {minor})", f"include(build/{name}-config-version.cmake)"]
        lines += [f'if(PACKAGE_VERSION_COMPATIBLE)\n  message(STATUS "accepts {each} ")\nendif()']
    (tmp_path / "ask.cmake").write_text("set(CMAKE_SIZEOF_VOID_P 8)\n" + "\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run([cmake, "-P", "ask.cmake"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert set(re.findall(r"accepts (\S+)", done.stdout)) == accepted


def test_the_command_writes_the_folder_and_offers_one_for_a_shell(tmp_path: Path, cli: Run, monkeypatch: Patch) -> None:
    folder = tmp_path / "it's a folder; touch x"
    out = output_of(cli("codegen", "paper-4.1-helical", "--no-measure", "--out", str(folder)))
    size, words = out.splitlines()[0].split(" ", 1)
    files = {path.name: path.stat().st_size for path in folder.iterdir()}
    written = sum(count for name, count in files.items() if name.endswith((".c", ".h")))
    assert (int(size), words) == (pytest.approx(written / 1000, abs=1), "kB of C")
    assert {"case.toml", "Makefile", "CMakeLists.txt", "README.md", "selftest.c", "bench.c"} <= set(files)
    assert not [name for name in files if name.startswith(".")]
    (command,) = re.findall(r"; (make -C .* test) compiles and tests them$", out, re.MULTILINE)
    assert shlex.split(command) == ["make", "-C", str(folder), "test"]
    # The folder's own rules take its name, too.
    dry = subprocess.run(["sh", "-c", f"{command} --dry-run"], cwd=tmp_path, capture_output=True, check=False)
    assert (dry.returncode, dry.stderr) == (0, b"")
    monkeypatch.setattr("screwsynth.nlp.embedding.codegen._LARGE", 100_000)
    case = load_case("hexapod-machining")
    assert "most of it for joint_spacing" in size_words(case, {"a.c": " " * 200_000})


@pytest.mark.parametrize("name", ["paper-4.1-helical", "3 legs!", "größe", "a__b", "", "*/", "int", "日本"])
def test_names_are_identifiers(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))
    assert f"{identifier(name)}.h" in generate_c(replace(load_case("paper-4.2-translation"), name=name), "")


def test_names_of_two_cases_do_not_meet() -> None:
    declared: dict[str, set[str]] = {}
    for name in ("x", "x solver", "x-sqp", "x qp", "x casadi", "x-f", "x variable"):
        files = generate_c(replace(load_case("paper-4.2-translation"), name=name), "")
        own = {file for file in files if file.startswith("screwsynth")}
        text = "\n".join(files[file] for file in own)
        own |= set(re.findall(r"#define (SCREWSYNTH_\w+)", text)) - {"SCREWSYNTH_STATUS", "SCREWSYNTH_VERSION"}
        own |= set(re.findall(r"^[\w *]*?\b(screwsynth_[A-Za-z0-9_]+)\(", text, flags=re.MULTILINE))
        for other, theirs in declared.items():
            assert not own & theirs - {"screwsynth_status"}, (name, other, own & theirs)
        declared[name] = own


@needs_compiler
def test_what_a_case_says_cannot_break_the_c(tmp_path: Path) -> None:
    robot = {"model": "stewart-gough", "parameters": {"x1": 12, "x2": 8, "x3": 30, "x4": {"min": 0, "max": 30}}}
    task = {"name": '??/"\n*/', "sense": "max", "axis": [0, 0, 1], "pitch": float("inf")}
    tables = {"robot": robot, "units": {"length": '"\\%d'}, "pose": {"position": [0, 0, 40]}, "task": [task]}
    where = written(case_from(tables | {"title": "*/ int main; /* \\"}, "3 legs!"), tmp_path)
    assert "0 failed" in made(where, f"CFLAGS={STRICT} -O2 -Wno-trigraphs", "test")


@needs_compiler
def test_a_compiled_solve_is_the_same_and_compiles_once(tmp_path: Path, monkeypatch: Patch, cli: Run) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    interpreted, compiled = (solve(load_case("paper-4.3"), starts=6, compiled=choice) for choice in (False, True))
    assert abs(interpreted.F - compiled.F) <= 1e-12 * interpreted.F
    (library,) = (tmp_path / "screwsynth").iterdir()
    made_at = library.stat().st_mtime_ns
    out = output_of(cli("solve", "paper-4.3", "--starts", "2", "--compiled"))
    assert "408.803" in out
    assert [path.stat().st_mtime_ns for path in (tmp_path / "screwsynth").iterdir()] == [made_at]


@pytest.mark.parametrize("compiler", ["no-such-compiler", "false"])
def test_compiling_without_a_compiler_is_told(compiler: str, tmp_path: Path, monkeypatch: Patch, cli: Run) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", compiler)
    refusal_of(cli("solve", "paper-4.1-helical", "--compiled"), "compiler")


# Generated C reads and writes only its own memory, and takes none.


def checked(where: Path, flags: str, *runner: str) -> subprocess.CompletedProcess[str]:
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
@pytest.mark.parametrize("name", ["paper-4.4-snu", "camera-mount"])
def test_sanitizers_find_nothing(name: str, tmp_path: Path) -> None:
    probe = saved(tmp_path / "probe.c", "int main(void) { return 0; }")
    flags = "-fsanitize=address,undefined -fno-sanitize-recover=all"
    built = [COMPILERS[0], *flags.split(), str(probe), "-o", str(tmp_path / "probe")]
    if subprocess.run(built, check=False, capture_output=True).returncode:
        pytest.skip("the compiler has no sanitizers")
    checked(written(name, tmp_path / "c"), f"-O0 {flags}")


@needs_compiler
@pytest.mark.slow
def test_valgrind_finds_nothing_and_no_heap(tmp_path: Path) -> None:
    valgrind = shutil.which("valgrind") or pytest.skip("valgrind is not installed")
    where = written("paper-4.1-rotation", tmp_path)
    done = checked(where, "-O1", valgrind, "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all")
    # What printf takes is one buffer; the library takes nothing.
    assert re.search(r"total heap usage: 1 allocs", done.stderr), done.stderr


# Flash and stack that ``codegen`` writes: from compilers, the same each time, and a clear line without one.

NAME = "paper-4.2-rotation"
PREFIX = identifier(NAME)


def macros(header: str) -> dict[str, int]:
    found = re.findall(r"#define \w+?_((?:FLASH|STACK)_BYTES_\w+) (\d+)", header)
    return {name: int(value) for name, value in found}


@pytest.mark.slow
def test_the_command_writes_what_the_compilers_say(tmp_path: Path, cli: Run) -> None:
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed")
    out = output_of(cli("codegen", NAME, "--out", str(tmp_path)))
    plain = generate_c(load_case(NAME), (tmp_path / "case.toml").read_text(encoding="utf-8"))
    figures = measure(plain, PREFIX)
    # The same files and compilers give the same bytes.
    for name, text in with_figures(plain, PREFIX, figures).items():
        assert (tmp_path / name).read_text(encoding="utf-8") == text, name
    header = (tmp_path / f"{PREFIX}.h").read_text(encoding="utf-8")
    readme = (tmp_path / "README.md").read_text(encoding="utf-8")
    version = subprocess.run(["gcc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    for text in (header, readme):
        assert version in text
        assert NOT_MEASURED not in text
    own = figures[0]
    assert own.target is X86_64
    if own.fault:
        pytest.skip(own.fault)
    # Only functions of math.h may be deeper than the bound, which does not have them.
    assert own.painted is not None
    assert own.stack is not None
    assert 0.5 * own.stack < own.painted < own.stack + 1000
    named = {"FLASH_BYTES_X86_64": own.flash, "STACK_BYTES_X86_64_GCC": own.stack}
    assert 1.5 * own.stack <= macros(header)["STACK_BYTES_X86_64"] < 1.5 * own.stack + 16
    assert named.items() <= macros(header).items()
    assert f"stack at most {own.stack} bytes" in out
    data = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["measured"]
    assert [each["target"] for each in data] == [X86_64.name, CORTEX_M7.name]
    assert data[0]["stack_bytes"] == own.stack


@pytest.mark.slow
@pytest.mark.skipif(set(COMPILERS) != {"gcc", "clang"}, reason="gcc and clang are not both installed")
@pytest.mark.parametrize("name", soaked(["hexapod-workspace", "paper-4.4-max"], ["paper-4.4-max"]))
def test_another_compiler_stays_within_the_room_for_others(name: str, tmp_path: Path) -> None:
    where = written(name, tmp_path)
    own = measure(generate_c(load_case(name), ""), identifier(name))[0]
    if own.with_room is None:
        pytest.skip(own.fault)
    for level in ("-O0", "-O3"):
        made(where, "clean")
        made(where, "CC=clang", f"CFLAGS=-std=c99 {level}", "stack")
        (depth,) = re.findall(r"(\d+) bytes", run("./stack", where=where))
        assert 1000 < int(depth) <= own.with_room, level


@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        ("exit 3", "cc1: failed: exit status 3"),
        ("case $1 in --version) echo one;; -dumpmachine) echo mips;; esac", "cc1 compiles for mips"),
        ("case $1 in --version) echo one;; -dumpmachine) echo x86_64;; *) echo bad >&2; exit 1;; esac", "bad"),
    ],
)
def test_a_compiler_that_fails_is_told(script: str, sentence: str, tmp_path: Path, monkeypatch: Patch) -> None:
    compiler = saved(tmp_path / "cc1", f"#!/bin/sh\n{script}\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    files = {f"{PREFIX}.c": "int a(void);", "manifest.json": "{}"}
    own = measure(files, PREFIX)[0]
    assert sentence.replace("cc1: failed", "cc1 failed") in own.fault
    assert (own.flash, own.stack) == (None, None)


def test_python_and_no_measure_run_no_compiler(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cli("codegen", NAME, "--no-measure", "--out", str(tmp_path))[0] == 0
    files = generate_c(load_case(NAME), (tmp_path / "case.toml").read_text(encoding="utf-8"))
    assert all((tmp_path / name).read_text(encoding="utf-8") == text for name, text in files.items())
    assert f"/* {NOT_MEASURED} */" in files[f"{PREFIX}.h"]
    assert NOT_MEASURED in files["README.md"]
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.delenv("CC", raising=False)
    out = output_of(cli("codegen", NAME, "--out", str(tmp_path / "c")))
    header, page = ((tmp_path / "c" / each).read_text(encoding="utf-8") for each in (f"{PREFIX}.h", "README.md"))
    assert not macros(header)
    for target, compiler in (("x86-64", "gcc or cc or clang"), ("Cortex-M7", "arm-none-eabi-gcc")):
        sentence = f"{target}: not measured: no compiler for this target is installed: {compiler}"
        assert sentence in out.splitlines()
        assert f"/* {sentence} */" in header
        assert f"{sentence}." in page.splitlines()


def graph(frames: dict[str, str], edges: list[tuple[str, str]]) -> str:
    """A call graph as gcc writes it."""
    nodes = [f'node: {{ title: "{name}" label: "{name}\\nx.c:1:1\\n{size}\\n" }}' for name, size in frames.items()]
    return "\n".join([*nodes, *(f'edge: {{ sourcename: "{a}" targetname: "{b}" label: "x" }}' for a, b in edges)])


def test_the_bound_is_the_deepest_path_and_none_where_there_is_no_bound() -> None:
    frames = {"p_solve": "100 bytes (static)", "p-x.c:a": "40 bytes (static)", "b": "60 bytes (static)"}
    edges = [("p_solve", "p-x.c:a"), ("p_solve", "b"), ("p-x.c:a", "sin"), ("b", "sin")]
    # A return address of 8 bytes for each of the three calls and for the solver.
    assert stack_bound({"p-x": graph(frames, edges)}, "p") == 100 + 60 + 3 * 8
    assert stack_bound({"p-x": graph(frames, [*edges, ("b", "p_solve")])}, "p") is None
    assert stack_bound({"p-x": graph(frames | {"b": "60 bytes (dynamic)"}, edges)}, "p") is None
    assert stack_bound({}, "p") is None
    # A search calls the program by pointers, and that calls the caller's deadline.
    frames = {"p_solve": "1 bytes (static)", "p_SCALED_values": "200 bytes (static)"}
    edges = [("p_solve", "__indirect_call"), ("p_SCALED_values", "__indirect_call")]
    assert stack_bound({"p-x": graph(frames, edges)}, "p") == 201 + 2 * 8
