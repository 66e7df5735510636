"""Cases with settings as values: written as case files, against the schema of cases, and results against theirs."""

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, case_from
from jsonschema import Draft202012Validator
from test_changes import PINS, SECTION_4_3
from test_to_toml import differences

from screwsynth.nlp import load_case
from screwsynth.nlp.case.schema import Document
from screwsynth.nlp.results.schema import result_schema

#: A hexapod with times along a path of six points.
ALONG = """
title = "along"
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = 26.5
x2 = 11.543
x3 = 0
x4 = 5
[pose]
position = [0, 0, 20]
[[task]]
name = "feed"
sense = "max"
follows = "feed"
[objective]
over = "path"
as = "mean"
[limits]
leg_length = { min = 15, max = 45 }
[path]
file = "path.csv"
tool = { axis = [0, 0, 1], turn = { min = -20, max = 20, rate = 5 } }
"""
TASK = '[[task]]\nname = "feed"\nsense = "max"\nfollows = "feed"\n'
TURN = "tool = { axis = [0, 0, 1], turn = { min = -20, max = 20, rate = 5 } }"
TABLE = "t,x,y,z,roll,pitch,yaw\n" + "".join(f"{2 * k},{k},{k * (5 - k) / 4},20,{3 * k},{-2 * k},0\n" for k in range(6))
SLIDES = Path(__file__).resolve().parents[2] / "cases" / "hexapod-base-slides.toml"


def changed(text: str, *changes: tuple[str, str]) -> str:
    """The text with parts of it replaced."""
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


#: What changes from task to task.
TASKS = {
    "a range": PINS,
    "ranges of tasks": changed(PINS, ('{ min = 5, max = 12, per = "task" }', "{ tasks = [7, { min = 8, max = 9 }] }")),
    "values": changed(PINS, ('{ min = 5, max = 12, per = "task" }', '{ values = [5, 7, 9, 12], per = "task" }')),
    "a pose": SECTION_4_3,
}
#: What changes along the path.
PATHS = {
    "turn": ALONG,
    "turn without a limit of its rate": changed(ALONG, ("rate = 5", "rate = inf")),
    "dimension": changed(ALONG, ("x3 = 0", 'x3 = { min = 0, max = 9, per = "path", rate = 2 }'), (TURN, "")),
    "dimension without a limit of its rate": changed(
        ALONG, ("x1 = 26.5", 'x1 = { min = 25, max = 28, per = "path", rate = inf }'), (TURN, "")
    ),
    "periodic": changed(ALONG, (TURN, f"periodic = true\n{TURN}")),
    "tool": changed(ALONG, ('follows = "feed"', 'follows = "tool"')),
    "thrust": changed(ALONG, ('follows = "feed"', 'follows = "thrust"'), ('as = "mean"', 'as = "worst"')),
    "leg length": changed(ALONG, (TASK, ""), ('as = "mean"', 'as = "worst"\nminimise = "leg_length"')),
    "force": changed(
        ALONG, (TASK, "[[load]]\nforce = [0, 0, -20]\n"), ('as = "mean"', 'as = "mean"\nminimise = "actuator_force"')
    ),
    "limits between points": changed(ALONG, ("leg_length =", 'over = "path"\nleg_length =')),
}
#: What changes from pose to pose.
POSES = {
    "affine": SLIDES.read_text(),
    "stated": changed(
        SLIDES.read_text(),
        ("slope = [0, 0, { min = -1.4, max = 1.4 }]", "at = 25.2, slope = [0, 0, -0.85]"),
        ("min = -4.2, max = 4.2", "min = -1, max = 1"),
        ("min = 15.8, max = 24.2", "min = 19, max = 21"),
    ),
    "any": changed(
        SLIDES.read_text(),
        (", slope = [0, 0, { min = -1.4, max = 1.4 }]", ""),
        ('settings = "affine"', 'settings = "any"'),
        ("min = -4.2, max = 4.2", "min = -1, max = 1"),
        ("min = 15.8, max = 24.2", "min = 19, max = 21"),
        ('over = "workspace"\n', ""),
    ),
}
EVERY = TASKS | PATHS | POSES


@pytest.fixture(scope="module")
def of_results() -> Draft202012Validator:
    return Draft202012Validator(json.loads(json.dumps(result_schema())))


@pytest.mark.parametrize("kind", EVERY)
def test_a_case_with_settings_is_the_same_from_its_text(kind: str) -> None:
    schema = Draft202012Validator(json.loads(json.dumps(Document.file_schema())))
    schema.validate(tomllib.loads(EVERY[kind]))
    case = case_from(EVERY[kind])
    text = case.to_toml()
    schema.validate(tomllib.loads(text))
    again = case_from(text, case.name)
    assert differences(case, again, 0.0) == []
    assert again.to_toml() == text


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("kind", ["a range", "dimension", "turn", "affine"])
def test_numbers_of_settings_keep_all_their_digits(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = sorted(float(each) for each in rng.uniform(20, 40, 2))
    rate = math.inf if seed % 4 == 3 else float(10 ** rng.uniform(-9, 9))
    stated = {
        "a range": ("min = 5, max = 12", f"min = {low!r}, max = {high!r}"),
        "dimension": ("min = 0, max = 9", f"min = {low / 4!r}, max = {high / 4!r}"),
        "turn": ("min = -20, max = 20", f"min = {-high!r}, max = {low!r}"),
        "affine": ("min = 20, max = 32", f"min = {low!r}, max = {high!r}"),
    }
    text = changed(EVERY[kind], stated[kind])
    text = text.replace("rate = 2 }", f"rate = {rate!r} }}").replace("rate = 5 }", f"rate = {rate!r} }}")
    case = case_from(text)
    again = case_from(case.to_toml(), case.name)
    assert differences(case, again, 0.0) == []


def answered(cli: Run, folder: Path, text: str, command: str, *words: str) -> dict[str, Any]:
    """The result of a command on a case."""
    case, out = folder / "case.toml", folder / "out.json"
    case.write_text(text)
    (folder / "path.csv").write_text(TABLE)
    status, shown, fault = cli(command, str(case), "--json", str(out), *words)
    assert (status, fault) == (0, ""), shown + fault
    found: dict[str, Any] = json.loads(out.read_text())
    return found


@pytest.mark.parametrize("kind", PATHS)
def test_a_result_along_a_path_keeps_to_the_schema(
    kind: str, tmp_path: Path, cli: Run, of_results: Draft202012Validator
) -> None:
    found = answered(cli, tmp_path, PATHS[kind], "solve")
    of_results.validate(found)
    schedule = found["schedule"]
    rates = [math.inf if each["max"] is None else each["max"] for each in schedule["rates"]]
    times = np.array(schedule["times"])
    for k, name in enumerate(schedule["names"]):
        values = np.array([row[k] for row in schedule["rows"]])
        used = np.abs(np.diff(values)) / np.diff(times)
        assert used.max() <= rates[k] * (1 + 1e-9), name
        if kind == "periodic":
            assert values[0] == pytest.approx(values[-1], abs=1e-9)
    # A result that is read again evaluates nothing along a path: its case has no single robot.
    assert load_case(str(tmp_path / "case.toml")).settings
    assert len(schedule["rows"]) == len(schedule["times"]) == len(schedule["F"])


@pytest.mark.parametrize("kind", ["stated", "any"])
def test_a_result_of_every_pose_keeps_to_the_schema(
    kind: str, tmp_path: Path, cli: Run, of_results: Draft202012Validator
) -> None:
    found = answered(cli, tmp_path, POSES[kind], "workspace")
    of_results.validate(found)
