"""The C that a case becomes: it compiles cleanly, agrees with CasADi, and needs nothing else."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import FEW_CASES, soaked
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

from screwsynth.nlp import formulate, generate_c, load_case, shipped_cases
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.subject import find_subject

Embedded = Any

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
def test_shipped_cases_compile_without_a_warning_and_pass_their_tests(
    name: str, tmp_path: Path, embedded: Callable[[str], Embedded]
) -> None:
    # The first compiler has made the library with the strict flags. The others need not compile to warn.
    where, level = Path(shutil.copytree(embedded(name).folder, tmp_path / "c")), "-O2" if name in OPTIMISED else "-O1"
    sources = {path.name for path in where.glob("*.c")} - {"sfunction.c", "realtime.c"}  # of other systems
    for compiler in COMPILERS[1:]:
        run(compiler, *STRICT.split(), "-fsyntax-only", *sources, where=where)
    printed = made(where, f"CFLAGS={STRICT} {level} -fPIC", "all", "stack", "test")
    assert f"{identifier(name)}-casadi.o" not in printed
    (counts,) = re.findall(r"^(\d+) passed, 0 failed$", printed, flags=re.MULTILINE)
    assert int(counts) >= 14


@pytest.mark.slow
@pytest.mark.skipif("clang" not in COMPILERS, reason="clang is not installed")
@pytest.mark.parametrize("name", OPTIMISED)
def test_what_clang_optimises_passes_the_test_too(
    name: str, tmp_path: Path, embedded: Callable[[str], Embedded]
) -> None:
    for path in embedded(name).folder.iterdir():
        if path.suffix not in {".o", ".a", ".so"}:
            shutil.copy(path, tmp_path)
    printed = made(tmp_path, "CC=clang", f"CFLAGS={STRICT} -O2", "all", "stack", "test")
    assert f"{identifier(name)}-casadi.o" in printed
    assert " passed, 0 failed" in printed


@needs_compiler
@pytest.mark.parametrize("name", CASES)
def test_compiled_values_are_those_of_the_program_at_random_points(
    name: str, embedded: Callable[[str], Embedded]
) -> None:
    embedded(name).compare(find_subject(load_case(name)).nlp, 300)


@needs_compiler
def test_only_the_mathematics_library_is_needed(embedded: Callable[[str], Embedded]) -> None:
    c = embedded("paper-4.1-helical")
    assert_only_mathematics_is_needed(c.folder, c.prefix)


@needs_compiler
def test_a_parent_project_may_forbid_warnings_and_headers_are_read_line_by_line(
    embedded: Callable[[str], Embedded],
) -> None:
    c = embedded("paper-4.1-helical")
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
    assert '_F_unit = "(in/rad)\\302\\262";' in header
    assert "_limit_multiplier_units[" in header
    constraints = {each["name"]: each["multiplier_unit"] for each in data["constraints"]}
    leg = next(name for name in constraints if "leg_length" in name)
    assert constraints[leg] == f"{data['F_unit']}/in\N{SUPERSCRIPT TWO}"
    # A translation has no angle to be measured by.
    drill = json.loads(generate_c(load_case("drilling-spindle"), "")["manifest.json"])
    assert (drill["F_unit"], drill["tasks"][0]["rate_unit"]) == ("(mm/mm)\N{SUPERSCRIPT TWO}", "mm/mm")


@needs_compiler
def test_a_limb_of_zero_length_is_told(embedded: Callable[[str], Embedded]) -> None:
    c, nlp = embedded("paper-4.2-translation"), formulate(load_case("paper-4.2-translation"))
    p, x, F = np.array(nlp.arguments), np.array([4, 4, 0.2, 0.2]), np.zeros(1)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    assert c.call("prepare", p, k, work) == c.call("F", x, k, F, work) == 0
    p[[each.name for each in nlp.program.arguments].index("p_z")] = 0
    assert c.call("prepare", p, k, work) == 0
    assert c.call("F", x, k, F, work) == 1


def test_the_same_case_gives_the_same_bytes() -> None:
    case = load_case("paper-4.3")
    assert generate_c(case, "text") == generate_c(load_case("paper-4.3"), "text")


@needs_compiler
def test_cmake_builds_it_too(tmp_path: Path) -> None:
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("cmake is not installed")
    where, build = written("paper-4.2-translation", tmp_path / "c"), tmp_path / "build"
    for words in (["-S", str(where), "-B", str(build)], ["--build", str(build)]):
        done = subprocess.run([cmake, *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert subprocess.run([str(build / "selftest")], check=False, capture_output=True).returncode == 0


@pytest.mark.parametrize(
    ("version", "accepted"),
    [("0.4.2", {"0.4", "0.4.1"}), ("1.3.0", {"1.0", "1.3"}), ("2.0.1", {"2.0", "2"})],
)
def test_versions_are_compatible_as_semantic_versioning_says(
    version: str, accepted: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cmake = shutil.which("cmake")
    if cmake is None or not COMPILERS:
        pytest.skip("cmake or a C compiler is not installed")
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
