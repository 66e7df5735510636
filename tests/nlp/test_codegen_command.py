"""The command ``codegen``, its options, and names that no case can break."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from builders import Run, case_from, output_of, refusal_of
from generated import STRICT, made, needs_compiler, written

from screwsynth.nlp import load_case, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.embedding.codegen import generate_c, size_words
from screwsynth.nlp.embedding.ctext import identifier


def test_size_is_said_before_the_folder_is_written(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    out = output_of(cli("codegen", "paper-4.1-helical", "--no-measure", "--out", str(tmp_path / "made")))
    size, words = out.splitlines()[0].split(" ", 1)
    files = [path for path in (tmp_path / "made").iterdir() if path.suffix in {".c", ".h"}]
    assert int(size) == pytest.approx(sum(path.stat().st_size for path in files) / 1000, abs=1)
    assert words == "kB of C"
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


def test_the_command_line_writes_the_folder(tmp_path: Path, cli: Run) -> None:
    out = output_of(cli("codegen", "paper-4.1-helical", "--no-measure", "--out", str(tmp_path / "made")))
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
