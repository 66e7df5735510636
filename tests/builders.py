"""What all tests build their cases with: case files, cases of texts and of tables, starters of robots, rotations."""

from __future__ import annotations

import copy
import csv
import importlib.util
import io
import math
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from screwsynth.models import Dimension, Model, robot_function
from screwsynth.nlp import Case, case_from_tables, shipped_cases
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.toml import toml_document
from screwsynth.nlp.cli.main import run as command_line
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofClaim
from screwsynth.nlp.starter.text import starter_case

DOCS = Path(__file__).parents[1] / "docs"
Array = NDArray[np.float64]
#: Shipped cases that another one is like, with the same robot and another task, sense or axis; and the others.
LIKE_ANOTHER = {
    "drilling-spindle", "hexapod-pocket", "machine-tool", "motion-base", "paper-4.1-helical-axis-z",
    "paper-4.1-rotation", "paper-4.1-rotation-axis-z", "paper-4.3-axis-x", "paper-4.4-min", "pick-and-place",
}  # fmt: skip
EACH_CASE = [name for name in shipped_cases() if name not in LIKE_ANOTHER]
#: A robot of the gallery of each kind: cranks, slides, struts, members, parasitic motions, parallel rods and
#: parallelograms, limbs of two kinds, and platforms that turn only, do not turn, or stay in a plane. What treats all
#: robots given joint by joint alike is tested with these.
EACH_KIND = (
    "3-puu", "3-rps", "3-upu", "6-pus", "6-rus", "delta", "delta-parallelogram", "exechon", "five-bar", "planar-3-rrr",
    "spherical-3-rrr", "tricept",
)  # fmt: skip
#: Four robots of EACH_KIND: limbs with constraint wrenches, cranks, parallelograms, planar.
FEW_KINDS = ("3-rps", "6-rus", "delta-parallelogram", "five-bar")
#: Six shipped cases of different kinds: leg layouts, limits, several tasks, several poses, closed loops.
FEW_CASES = ("camera-mount", "flight-simulator", "haptic-device", "paper-4.1-helical", "paper-4.4-max", "reachy-mini")
#: The task of cases of which no other motion matters: a push upwards.
PUSH_UP = {"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}
#: The command line in this process: exit status, standard output, standard error.
Run = Callable[..., tuple[int, str, str]]
Patch = pytest.MonkeyPatch
# Six legs with one free height. Of unit forces along z, x and y the sums of squares are F of the translations along
# these axes, so that F up + F side + F of the third axis = 6, and the last two are equal by the symmetry of the robot.
TWO_GOALS = """
task = [
    { name = "up", sense = "max", axis = [0, 0, 1], pitch = inf },
    { name = "side", sense = "max", axis = [1, 0, 0], pitch = inf },
]
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = 20 }
[pose]
position = [0, 0, { min = 5, max = 40 }]
[limits]
leg_length = { min = 2, max = 60 }
[solve]
starts = 2
"""


def soaked(values: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """Parameter values of a test. Values that are not in ``kept`` run in ``make soak`` only."""
    return [each if each in kept else pytest.param(each, marks=pytest.mark.soak) for each in values]


def ends(half: float, middle: float = 0.0) -> dict[str, float]:
    """A range of a case about a middle."""
    return {"min": middle - half, "max": middle + half}


def case_from(given: str | Mapping[str, Any], name: str = "case") -> Case:
    """The case of a case file's text, or of its tables, which stay as they are."""
    tables = tomllib.loads(given) if isinstance(given, str) else copy.deepcopy(dict(given))
    return case_from_tables(tables, name=name, source=f"{name}.toml")


@cache
def starter_text(name: str) -> str:
    """The starter of a robot by its name, which is computed once in a process."""
    return starter_case(robot_function(name)())


def starter_tables(robot: str | Model) -> dict[str, Any]:
    """The tables that tests begin with: a starter with its whole pose free, a motion of any kind, and no limits.

    Numbers are free within a quarter of their size, and couples count by unit lengths. The starter itself is in
    test_starters.py.
    """
    model = robot_function(robot)() if isinstance(robot, str) else robot
    tables = tomllib.loads(starter_text(robot) if isinstance(robot, str) else starter_case(model))
    del tables["limits"]
    if "characteristic_length" in tables["robot"]:
        tables["robot"]["characteristic_length"] = 1.0
    own = tables["robot"]["parameters"]
    for k, item in enumerate(model.parameters):
        scale = math.degrees(1) if item.dimension is Dimension.ANGLE else 1.0
        values = [scale * value for value in item.starter or item.typical]
        width = 0.25 * max(map(abs, values)) if k == 0 else 0.0
        ends = [(max(v - width, scale * item.lower), min(v + width, scale * item.upper)) for v in values]
        found = [{"min": low, "max": high} if width else v for v, (low, high) in zip(values, ends, strict=True)]
        own[item.name] = found if len(found) > 1 else found[0]
    lengths = [abs(v) for item in model.parameters if item.dimension is Dimension.LENGTH for v in item.typical]
    reach = 0.25 * (math.hypot(*model.home) or max(lengths))
    tables["pose"] = {
        "position": [{"min": v - reach, "max": v + reach} for v in model.home],
        "rotation": {"angle": {"min": -20, "max": 20}},
    }
    motion = {"axis": [0, 1, 2], "point": [0, 0, model.home[2]], "pitch": 2}
    tables["task"] = [{"name": "my task", "sense": "max", **motion}]
    return tables


def starter(name: str) -> Case:
    """The case that tests begin with, of a robot by its name."""
    return case_from(starter_tables(name), name)


def shipped_tables(name: str) -> dict[str, Any]:
    """The tables of a shipped case, without what its results are expected to be."""
    tables = tomllib.loads(find_case(name).read_text(encoding="utf-8"))
    return {key: value for key, value in tables.items() if key not in ("expect", "published")}


def case_tables(robot: str | Mapping[str, Any], /, **tables: Any) -> dict[str, Any]:  # noqa: ANN401 - tables of a case
    """The tables of a shipped case, of a robot's starter, or of a ``[robot]`` table, with some of them replaced.

    A table that is None is left out.
    """
    if isinstance(robot, str):
        found = shipped_tables(robot) if robot in shipped_cases() else starter_tables(robot)
    else:
        found = {"robot": dict(robot)}
    return {key: value for key, value in (found | tables).items() if value is not None}


def case_of(robot: str | Mapping[str, Any], /, **tables: Any) -> Case:  # noqa: ANN401 - tables of a case
    """The case of :func:`case_tables`."""
    return case_from(case_tables(robot, **tables), robot if isinstance(robot, str) else "case")


def case_file(folder: Path, tables: Mapping[str, Any], name: str = "case.toml") -> Path:
    """Write the tables of a case into a folder, and return the file's path."""
    return saved(folder / name, toml_document(tables))


def saved(path: Path, text: str) -> Path:
    """Write a file, and return its path."""
    path.write_text(text, encoding="utf-8")
    return path


def saved_with_robot(folder: Path, robot: str | bytes, case: str) -> str:
    """Write a robot file and a case that names it into a folder, and return the path of the case."""
    (folder / "robot.toml").write_bytes(robot if isinstance(robot, bytes) else robot.encode())
    return str(saved(folder / "case.toml", case))


def edited(text: str, *edits: tuple[str, str]) -> str:
    """A text with words replaced once, each of which it must have."""
    for old, new in edits:
        assert old in text, f"{old!r} is not in the text"
        text = text.replace(old, new, 1)
    return text


def docs_script(name: str) -> ModuleType:
    """A script of the documentation as a module."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def printed(*arguments: str) -> str:
    """What the command line prints in a process of its own, where it has to succeed."""
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def rows_of(text: str) -> list[dict[str, str]]:
    """Rows of a table as CSV."""
    return list(csv.DictReader(text.splitlines()))


def turn_about(axis: ArrayLike, angle: float) -> Array:
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = np.array(axis, dtype=float) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K))


class Ended(NamedTuple):
    """A command that has ended: exit status, standard output, standard error."""

    code: int
    out: str
    err: str

    @property
    def output(self) -> str:
        """Everything that it printed."""
        return self.out + self.err


def ran(*words: str) -> Ended:
    """A command of the command line, run in this process; for fixtures, which cannot take that of a test."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", ["screwsynth", *words])
        code = command_line()
    return Ended(code, out.getvalue(), err.getvalue())


def output_of(ended: tuple[int, str, str]) -> str:
    """What a command printed, which has to have succeeded without a word of error."""
    code, out, err = ended
    assert (code, err) == (0, "")
    return out


def commands_in(text: str, label: str) -> list[list[str]]:
    """The arguments of the commands that stand behind a label in an output, as a shell reads them."""
    found = re.findall(rf"^{label}  screwsynth ((?:.*\\\n)*.*)$", text, re.MULTILINE)
    return [shlex.split(each.replace("\\\n", " ")) for each in found]


def unbroken(text: str) -> str:
    """An output without the breaks of its lines."""
    return re.sub(r"\n  +(?=\S)", " ", text)


def unpacked(proof: Proof) -> Proof:
    """A proof that was read, with its trees as bytes."""

    def plain(claims: tuple[ProofClaim, ...]) -> tuple[ProofClaim, ...]:
        return tuple(replace(each, tree=each.unpacked(), packed=None) for each in claims)

    return replace(proof, claims=plain(proof.claims), lemmas=plain(proof.lemmas))


def assert_words(text: str, *words: str) -> None:
    """Assert that a text has each of some words."""
    for word in words:
        assert word in text


def refusal_of(ended: tuple[int, str, str], *words: str) -> str:
    """The one sentence, with some words, by which a command refused, having printed nothing else."""
    code, out, err = ended
    assert (code, out) == (2, "")
    assert err.startswith("screwsynth: ")
    assert err.endswith("\n")
    assert len(err.splitlines()) == 1
    assert_words(err, *words)
    return err
