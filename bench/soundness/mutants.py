"""Random mutants of the checker, the rules of searches and the evidence: which of them no test notices.

    python bench/soundness/mutants.py --record [TESTS ...]        # which functions each test calls, and its time
    python bench/soundness/mutants.py COUNT FIRST [JOURNAL]

Mutants are made in a copy of the project below ``build/mutants``. A mutant is tried by the tests that call the function
it is in, the fastest first, until one fails or ``SECONDS`` have passed; C by the tests that call the bindings of the
kernel. Survivors are printed with their difference.
"""

from __future__ import annotations

import ast
import difflib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from campaign import Row, campaign

ROOT = Path(__file__).parents[2]
COPY, MAP = ROOT / "build" / "mutants", ROOT / "build" / "mutants.json"
#: Seconds for the tests of a mutant, and seconds after which a test hangs.
SECONDS, HANGS = 150.0, 60
FOLDERS = ("nlp/proof/checker", "nlp/proof/boxes", "nlp/proof/workspace", "nlp/evidence", "nlp/proof/enclosure/kernel")
KERNEL, BINDINGS = "nlp/proof/enclosure/_bounds", "nlp/proof/enclosure/engine.py"
RECORDER = """
import json, os, sys, threading, time
import pytest
top, seen, known, found = os.environ["MUTANTS_TOP"], set(), {}, {}
def call(frame, event, argument):
    if event == "call":
        code = frame.f_code
        if code not in known:
            name = os.path.realpath(code.co_filename)
            known[code] = f"{os.path.relpath(name, top)}:{code.co_firstlineno}" if name.startswith(top) else ""
        if known[code]:
            seen.add(known[code])
sys.setprofile(call)
threading.setprofile(call)
@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item, nextitem):
    seen.clear()
    began = time.perf_counter()
    try:
        return (yield)
    finally:
        found[item.nodeid] = {"seconds": time.perf_counter() - began, "calls": sorted(seen)}
def pytest_unconfigure():
    sys.setprofile(None)
    with open(os.environ["MUTANTS_SEEN"], "w") as file:
        json.dump(found, file)
"""


class Change(NamedTuple):
    """A change of a text: from, to, and what is put there."""

    start: int
    end: int
    text: str


COMPARED = {
    "<": ["<=", ">"],
    "<=": ["<", ">"],
    ">": [">=", "<"],
    ">=": [">", "<"],
    "==": ["!="],
    "!=": ["=="],
    "is not": ["is"],
    "is": ["is not"],
    "in": ["not in"],
    "not in": ["in"],
}


def other_number(text: str, rng: random.Random) -> str:
    """Return another number of the same type."""
    value = float(text)
    if re.fullmatch(r"\d+", text):
        return str(int(text) + rng.choice([-1, 1]))
    return repr(rng.choice([0.5 * value, 2 * value, -value, 0.0, value * 1e6]))


def python_changes(source: str, rng: random.Random) -> Iterator[Change]:
    """Yield changes of a Python file, one for each place that has any."""
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    data = source.encode()

    def at(line: int, column: int) -> int:
        return len(data[: starts[line - 1] + column].decode())

    def span(node: ast.AST) -> tuple[int, int]:
        return at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset)

    tree = ast.parse(source)
    annotations = {
        id(inner)
        for node in ast.walk(tree)
        for name in ("annotation", "returns")
        if getattr(node, name, None) is not None
        for inner in ast.walk(getattr(node, name))
    }
    for node in ast.walk(tree):
        if id(node) in annotations:
            continue
        if isinstance(node, ast.Compare):
            left, right = span(node.left)[1], span(node.comparators[0])[0]
            word = source[left:right].strip("() \n")
            if word in COMPARED:
                place = left + source[left:right].index(word)
                yield Change(place, place + len(word), rng.choice(COMPARED[word]))
        elif isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div)):
            left, right = span(node.left)[1], span(node.right)[0]
            word = source[left:right].strip("() \n")
            swapped = {"+": "-", "-": "+", "*": "/", "/": "*"}.get(word)
            if swapped:
                place = left + source[left:right].index(word)
                yield Change(place, place + 1, swapped)
        elif isinstance(node, ast.BoolOp):
            left, right = span(node.values[0])[1], span(node.values[1])[0]
            for word, swapped in (("and", "or"), ("or", "and")):
                if source[left:right].strip("() \n") == word:
                    place = left + source[left:right].index(word)
                    yield Change(place, place + len(word), swapped)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub, ast.Invert)):
            yield Change(span(node)[0], span(node.operand)[0], "")
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
        ):
            start, end = span(node)
            if re.fullmatch(r"[\d.e-]+", source[start:end]):
                yield Change(start, end, other_number(source[start:end], rng))
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield Change(*span(node), str(not node.value))
        elif isinstance(node, (ast.Name, ast.Attribute)):
            name = node.id if isinstance(node, ast.Name) else node.attr
            pairs = {
                "min": "max",
                "minimum": "maximum",
                "floor": "ceil",
                "all": "any",
                "nanmin": "nanmax",
                "argmin": "argmax",
                "lower": "upper",
            }
            other = (pairs | {value: key for key, value in pairs.items()}).get(name)
            end = span(node)[1]
            if other:
                yield Change(end - len(name), end, other)
        elif isinstance(node, (ast.AugAssign, ast.Raise)) or (
            isinstance(node, ast.Expr) and not isinstance(node.value, (ast.Constant, ast.Yield))
        ):
            yield Change(*span(node), "pass")
        elif isinstance(node, ast.If):
            yield Change(*span(node.test), "False")


def c_changes(source: str, rng: random.Random) -> Iterator[Change]:
    """Yield changes of a C header, outside of comments, includes and for loops' heads."""
    code = re.sub(
        r"/\*.*?\*/|//[^\n]*|^\s*#[^\n]*|for \([^)]*\)",
        lambda found: " " * len(found[0]),
        source,
        flags=re.DOTALL | re.MULTILINE,
    )
    for found in re.finditer(r" (<=|>=|<|>|==|!=|&&|\|\||[-+]) ", code):
        swapped = {"&&": ["||"], "||": ["&&"], "+": ["-"], "-": ["+"]} | {
            key: COMPARED[key] for key in ("<", "<=", ">", ">=", "==", "!=")
        }
        yield Change(found.start(1), found.end(1), rng.choice(swapped[found[1]]))
    for found in re.finditer(r"(?<![\w.])(\d+\.\d+(?:e-?\d+)?|\d+)(?![\w.])", code):
        yield Change(found.start(1), found.end(1), other_number(found[1], rng))
    for found in re.finditer(r"\bf(min|max)\b", code):
        yield Change(found.start(1), found.end(1), "max" if found[1] == "min" else "min")
    for found in re.finditer(r"\n\s*(\w[^;{}=\n]*[+*-]?=[^;{}\n]*;)", code):
        if not re.match(r"(const|double|int|size_t|static|typedef)\b", found[1]):
            yield Change(found.start(1), found.end(1), ";")


def environment() -> dict[str, str]:
    """Return the environment in which the copy is the package."""
    return os.environ | {"PYTHONPATH": str(COPY / "path"), "PYTHONDONTWRITEBYTECODE": "1"}


def copied() -> None:
    """Make the copy of the project."""
    for name in ("nlp", "models", "cases", "tests", "docs", "bench"):
        shutil.rmtree(COPY / name, ignore_errors=True)
        shutil.copytree(ROOT / name, COPY / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "CHANGELOG.md"):
        shutil.copy(ROOT / name, COPY / name)
    package = COPY / "path" / "screwsynth"
    package.mkdir(parents=True, exist_ok=True)
    for name in ("nlp", "models", "cases"):
        if not (package / name).exists():
            (package / name).symlink_to(COPY / name)


def tested(tests: Sequence[str], limit: float, *options: str, **more: str) -> tuple[str, float]:
    """Return how tests ended, ``passed``, ``failed`` or ``time``, and their seconds."""
    began = time.perf_counter()
    words = [sys.executable, "-P", "-m", "pytest", "-q", "-x", "-m", "not slow and not browser"]
    words += ["-p", "no:cacheprovider", "-o", f"faulthandler_timeout={HANGS}"]
    words += ["-o", "faulthandler_exit_on_timeout=true", *options, *tests]
    try:
        done = subprocess.run(
            words, cwd=COPY, env=environment() | more, capture_output=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        return "time", limit
    # No test is selected: 5.
    return ("passed" if done.returncode in (0, 5) else "failed"), time.perf_counter() - began


def record(tests: list[str]) -> None:
    """Record which functions each test calls."""
    copied()
    (COPY / "path" / "mutants_recorder.py").write_text(RECORDER, encoding="utf-8")
    known = json.loads(MAP.read_text(encoding="utf-8")) if MAP.exists() else {}
    every = sorted(str(each.relative_to(ROOT)) for each in (ROOT / "tests").rglob("test_*.py"))
    seen = COPY / "seen.json"
    for test in tests or [each for each in every if each not in known]:
        seen.unlink(missing_ok=True)
        more = {"MUTANTS_SEEN": str(seen), "MUTANTS_TOP": f"{COPY}/"}
        outcome, seconds = tested([test], 1800, "-p", "mutants_recorder", **more)
        rows = json.loads(seen.read_text(encoding="utf-8")) if seen.exists() else {}
        for row in rows.values():
            row["calls"] = [each for each in row["calls"] if each.startswith((*FOLDERS, BINDINGS))]
        known[test] = {"outcome": outcome, "seconds": seconds, "tests": rows}
        MAP.write_text(json.dumps(known), encoding="utf-8")
        print(f"{test}: {outcome}, {seconds:.0f} s, {len(rows)} tests", flush=True)


def reached(name: str, source: str, at: int) -> list[str]:
    """Return the tests that call the function at a place of a file, the fastest first.

    Where no function is at the place, or no test calls it, any test that calls a function of the file counts.
    """
    known = {
        test: each for test, each in json.loads(MAP.read_text(encoding="utf-8")).items() if each["outcome"] == "passed"
    }
    lines = set()
    if name.endswith(".py"):
        line = source.count("\n", 0, at) + 1
        around = [
            (min([each.lineno, *(above.lineno for above in each.decorator_list)]), each.end_lineno or 0)
            for each in ast.walk(ast.parse(source))
            if isinstance(each, ast.FunctionDef)
        ]
        inner = [first for first, last in around if first <= line <= last]
        lines = {f"{name}:{max(inner)}"} if inner else set()
    name = name if name.endswith(".py") else BINDINGS
    for wanted in (lambda call: call in lines, lambda call: call.startswith(f"{name}:")):
        found = sorted(
            (row["seconds"], test)
            for each in known.values()
            for test, row in each["tests"].items()
            if any(map(wanted, row["calls"]))
        )
        if found:
            break
    return [test for _, test in found]


def compiled() -> bool:
    """Compile the kernel of the copy; return whether it compiles."""
    flags = [
        "-O3",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fno-trapping-math",
        "-fPIC",
        "-shared",
        f"-I{sysconfig.get_paths()['include']}",
    ]
    done = subprocess.run(
        ["gcc", *flags, f"{KERNEL}.c", "-o", f"{KERNEL}.abi3.so"], cwd=COPY, capture_output=True, check=False
    )
    return done.returncode == 0


def examine(seed: int) -> Row:
    """Try a random mutant."""
    rng = random.Random(seed)  # noqa: S311 - no secret
    files = sorted(
        each
        for folder in FOLDERS
        for each in (ROOT / folder).rglob("*")
        if each.suffix in (".py", ".h") and each.name != "__init__.py"
    )
    # As many mutants of a file as it has lines, about.
    target = rng.choices(files, [each.stat().st_size for each in files])[0]
    name, source = str(target.relative_to(ROOT)), target.read_text(encoding="utf-8")
    is_c = target.suffix == ".h"
    change = rng.choice(list((c_changes if is_c else python_changes)(source, rng)))
    mutant = source[: change.start] + change.text + source[change.end :]
    difference = "".join(difflib.unified_diff(source.splitlines(True), mutant.splitlines(True), name, name, n=1))
    room = f"{'C' if is_c else 'Python'}, {next(each for each in FOLDERS if name.startswith(each))}"
    tests = reached(name, source, change.start)
    outcome = "no test calls it"
    (COPY / name).write_text(mutant, encoding="utf-8")
    try:
        if is_c and not compiled():
            return {"counts": {f"{room}: does not compile": 1}, "faults": []}
        if tests:
            ended, _ = tested(tests, SECONDS)
            outcome = {"failed": "noticed", "passed": "survived", "time": "no time left"}[ended]
    finally:
        (COPY / name).write_text(source, encoding="utf-8")
        if is_c:
            compiled()
    faults = [] if outcome == "noticed" else [f"{outcome}; {len(tests)} tests:\n{difference}"]
    return {"counts": {f"{room}: {outcome}": 1}, "faults": faults}


if __name__ == "__main__":
    if sys.argv[1:2] == ["--record"]:
        record(sys.argv[2:])
    else:
        copied()
        campaign(examine)
