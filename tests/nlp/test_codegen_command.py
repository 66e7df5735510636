"""The command ``codegen``: its options, names that no case can break, memory, flash and stack."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
from builders import Run, case_from, output_of, refusal_of, saved
from generated import COMPILERS, STRICT, made, needs_compiler, run, written

from screwsynth.nlp import load_case, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.embedding.codegen import generate_c, size_words
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.measure import CORTEX_M7, NOT_MEASURED, X86_64, measure, stack_bound, with_figures


def test_the_command_that_is_offered_is_one_for_a_shell(tmp_path: Path, cli: Run) -> None:
    folder = tmp_path / "it's a folder; touch x"
    out = output_of(cli("codegen", "paper-4.1-helical", "--no-measure", "--out", str(folder)))
    (command,) = re.findall(r"; (make -C .* test) compiles and tests them$", out, re.MULTILINE)
    assert shlex.split(command) == ["make", "-C", str(folder), "test"]
    # The folder's own rules take its name, too.
    ended = subprocess.run(
        ["sh", "-c", f"{command} --dry-run"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_command_line_writes_the_folder_and_its_size(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = output_of(cli("codegen", "paper-4.1-helical", "--no-measure", "--out", str(tmp_path / "made")))
    size, words = out.splitlines()[0].split(" ", 1)
    files = [path for path in (tmp_path / "made").iterdir() if path.suffix in {".c", ".h"}]
    assert int(size) == pytest.approx(sum(path.stat().st_size for path in files) / 1000, abs=1)
    assert words == "kB of C"
    assert f"make -C {tmp_path / 'made'} test" in out
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert {"case.toml", "Makefile", "CMakeLists.txt", "README.md", "selftest.c", "bench.c"} <= names
    assert not [name for name in names if name.startswith(".")]
    monkeypatch.setattr("screwsynth.nlp.embedding.codegen._LARGE", 100_000)
    case = load_case("hexapod-machining")
    assert "most of it for joint_spacing" in size_words(case, {"a.c": " " * 200_000})


@pytest.mark.parametrize("name", ["paper-4.1-helical", "3 legs!", "größe", "a__b", "", "*/", "int", "日本"])
def test_names_are_identifiers(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))
    tables = tomllib.loads(find_case("paper-4.2-translation").read_text(encoding="utf-8"))
    assert f"{identifier(name)}.h" in generate_c(case_from(tables, name), "")


def test_names_of_two_cases_do_not_meet() -> None:
    tables = tomllib.loads(find_case("paper-4.2-translation").read_text(encoding="utf-8"))
    declared: dict[str, set[str]] = {}
    for name in ("x", "x solver", "x-sqp", "x qp", "x casadi", "x-f", "x variable"):
        files = generate_c(case_from(tables, name), "")
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
    where = written(case_from(tables, "3 legs!"), tmp_path)
    assert "0 failed" in made(where, f"CFLAGS={STRICT} -O2 -Wno-trigraphs", "test")


@needs_compiler
def test_a_compiled_solve_is_the_same_and_compiles_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Run
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    interpreted, compiled = (solve(load_case("paper-4.3"), starts=6, compiled=choice) for choice in (False, True))
    assert abs(interpreted.F - compiled.F) <= 1e-12 * interpreted.F
    (library,) = (tmp_path / "screwsynth").iterdir()
    made_at = library.stat().st_mtime_ns
    out = output_of(cli("solve", "paper-4.3", "--starts", "2", "--compiled"))
    assert "408.803" in out
    assert [path.stat().st_mtime_ns for path in (tmp_path / "screwsynth").iterdir()] == [made_at]


@pytest.mark.parametrize("compiler", ["no-such-compiler", "false"])
def test_compiling_without_a_compiler_is_told_in_a_sentence(
    compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Run
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", compiler)
    refusal_of(cli("solve", "paper-4.1-helical", "--compiled"), "compiler")


# Generated C reads and writes only its own memory, and takes none.

Embedded = Any


def checked(where: Path, flags: str, *runner: str) -> subprocess.CompletedProcess[str]:
    """The self-test and a twentieth of the example's ticks, built with the flags and run."""
    made(where, "clean")
    example = where / "example.c"
    example.write_text(example.read_text(encoding="utf-8").replace("TICKS 10000", "TICKS 500"), encoding="utf-8")
    made(where, f"CFLAGS=-std=c99 -g {flags}", "selftest", "example")
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
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("valgrind is not installed")
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
@pytest.mark.parametrize("name", ["hexapod-workspace"])
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


def test_without_a_compiler_one_line_says_so(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.delenv("CC", raising=False)
    out = output_of(cli("codegen", NAME, "--out", str(tmp_path / "c")))
    header = (tmp_path / "c" / f"{PREFIX}.h").read_text(encoding="utf-8")
    assert not macros(header)
    for sentence in (
        "x86-64: not measured: no compiler for it was found: gcc or cc or clang",
        "Cortex-M7: not measured: no compiler for it was found: arm-none-eabi-gcc",
    ):
        assert sentence in out.splitlines()
        assert f"/* {sentence} */" in header
        assert f"{sentence}." in (tmp_path / "c" / "README.md").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        ("exit 3", "cc1: failed: exit status 3"),
        ("case $1 in --version) echo one;; -dumpmachine) echo mips;; esac", "cc1 compiles for mips"),
        ("case $1 in --version) echo one;; -dumpmachine) echo x86_64;; *) echo bad >&2; exit 1;; esac", "bad"),
    ],
)
def test_a_compiler_that_fails_is_no_failure_of_the_command(
    script: str, sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = saved(tmp_path / "cc1", f"#!/bin/sh\n{script}\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    files = {f"{PREFIX}.c": "int a(void);", "manifest.json": "{}"}
    own = measure(files, PREFIX)[0]
    assert sentence.replace("cc1: failed", "cc1 failed") in own.fault
    assert (own.flash, own.stack) == (None, None)


def test_python_and_no_measure_run_no_compiler(tmp_path: Path, cli: Run) -> None:
    assert cli("codegen", NAME, "--no-measure", "--out", str(tmp_path))[0] == 0
    files = generate_c(load_case(NAME), (tmp_path / "case.toml").read_text(encoding="utf-8"))
    assert all((tmp_path / name).read_text(encoding="utf-8") == text for name, text in files.items())
    assert f"/* {NOT_MEASURED} */" in files[f"{PREFIX}.h"]
    assert NOT_MEASURED in files["README.md"]


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
