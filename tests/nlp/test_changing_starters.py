"""Starters whose robot changes from task to task or along a path: they solve at once, and refusals name the way out."""

import csv
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, output_of, refusal_of, soaked
from measures import circle_joints

import screwsynth.models
from screwsynth.models import model_names, robot_function
from screwsynth.nlp import load_case, solve
from screwsynth.nlp.errors import InputError
from screwsynth.nlp.starter.changing import task_starter

#: Robots with two motions at all poses around home, and a dimension that changes F.
WITH_TASKS = ("stewart-gough", "6-ups", "delta", "exechon")
#: Robots with six degrees of freedom and joints in closed form.
WITH_TURN = ("stewart-gough", "hexapod", "6-ups")


@pytest.mark.parametrize("model", soaked([*model_names()], WITH_TASKS))
def test_a_starter_of_tasks_solves_and_its_dimension_changes(model: str) -> None:
    if model not in WITH_TASKS:
        try:
            task_starter(robot_function(model)())
        except InputError:
            return
    text = task_starter(robot_function(model)())
    assert text.count('per = "task" }') == 2
    case = case_from(text, model)
    solution = solve(case, starts=8)
    combination = solution.combination
    assert combination is not None
    assert combination.combined is not None
    # The weights are 1 / F at home, rounded, and home is within the limits: the optimum is no worse.
    parts = np.array([task.weight * outcome.F for task, outcome in zip(case.tasks, solution.outcomes, strict=True)])
    scale = 2 / sum(task.weight for task in case.tasks)
    assert combination.value == pytest.approx(scale * parts.sum(), rel=1e-9)
    assert parts.sum() >= 2 * (1 - 1e-3)


def test_the_settings_of_a_starter_have_the_f_of_hand(tmp_path: Path, cli: Run) -> None:
    case, result = tmp_path / "pins.toml", tmp_path / "result.json"
    words = output_of(cli("new", "stewart-gough", "--per", "task", "--out", str(case)))
    assert words == f"{case}: written; next: screwsynth solve {case}\n"
    shown = " ".join(output_of(cli("solve", str(case), "--json", str(result))).split())
    assert "x1 per task +" in shown
    combined = json.loads(result.read_text())["combined"]
    radii = [robot["parameters"]["x1"] for robot in combined["settings"]]
    assert abs(radii[0] - radii[1]) > 1
    for robot, task in zip(combined["settings"], combined["tasks"], strict=True):
        numbers = robot["parameters"] | {name: np.radians(robot["parameters"][name]) for name in ("x3", "x4")}

        def of_hand(radius: float, name: str = task["name"], numbers: dict[str, float] = numbers) -> tuple[float, bool]:
            """F at a base radius, and whether legs and their angles to the z axis are within the limits."""
            base, platform = circle_joints(numbers | {"x1": radius}, "aligned")
            ends = platform + np.array([0.0, 0.0, 35.0])
            lengths = np.linalg.norm(ends - base, axis=1)
            units = (ends - base) / lengths[:, None]
            moved = np.tile([0.0, 0.0, 1.0], (6, 1)) if name == "push z" else np.cross([0.0, 0.0, 1.0], ends)
            kept = lengths.min() >= 28 and lengths.max() <= 42 and np.degrees(np.arccos(units[:, 2].min())) <= 30
            return float((np.sum(units * moved, axis=1) ** 2).sum()), bool(kept)

        assert task["F"] == pytest.approx(of_hand(numbers["x1"])[0], rel=1e-9)
        # Nothing else changes, so each task has its own best radius.
        grid = [of_hand(float(each)) for each in np.linspace(9, 15, 601)]
        assert task["F"] == pytest.approx(max(F for F, kept in grid if kept), rel=1e-6)


@pytest.mark.parametrize("model", soaked([*model_names()], ["6-ups"]))
def test_a_starter_of_a_path_solves_and_keeps_its_rate(model: str, tmp_path: Path, cli: Run) -> None:
    case, table, result = (tmp_path / name for name in ("turn.toml", "schedule.csv", "result.json"))
    status, _, fault = cli("new", model, "--per", "path", "--out", str(case))
    if status:
        assert model not in WITH_TURN
        assert (status, "--per path: " in fault, [*tmp_path.iterdir()]) == (2, True, [])
        return
    assert {each.name for each in tmp_path.iterdir()} == {"turn.toml", "turn.csv"}
    output_of(cli("solve", str(case), "--schedule", str(table), "--json", str(result)))
    with table.open() as lines:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(lines)]
    for one, other in itertools.pairwise(rows):
        assert abs(other["turn"] - one["turn"]) <= 5 * (other["t"] - one["t"]) * (1 + 1e-9)
    schedule = json.loads(result.read_text())["schedule"]
    constant = schedule["constant"]  # null if no constant turn keeps the limits
    assert constant is None or schedule["value"] >= constant["value"] * (1 - 1e-9)
    assert rows[-1]["t"] == pytest.approx(30, rel=0.05)
    lean = np.radians(15 if robot_function(model)().legs else 10)
    # The tool leans outwards by nearly the same angle everywhere: rows of the table are interpolated.
    for row in rows:
        w, x, y, z = (row[key] for key in ("qw", "qx", "qy", "qz"))
        axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        outwards = np.array([row["x"], row["y"], 0.0]) / np.hypot(row["x"], row["y"])
        assert axis[2] == pytest.approx(np.cos(lean), abs=1e-3)
        assert axis @ outwards == pytest.approx(np.sin(lean), abs=1e-3)


def test_a_starter_of_a_robot_file_names_the_file(tmp_path: Path, cli: Run) -> None:
    definition = Path(screwsynth.models.__file__).parent / "robots" / "6-ups.toml"
    robot, case = tmp_path / "mine.toml", tmp_path / "case.toml"
    robot.write_bytes(definition.read_bytes())
    output_of(cli("new", str(robot), "--per", "path", "--out", str(case)))
    assert 'file = "mine.toml"' in case.read_text()
    assert load_case(str(case)).over_path is not None
    # The robot file is not overwritten.
    refusal_of(cli("new", str(robot), "--per", "path", "--out", str(robot), "--force"), "the robot file")
    assert robot.read_bytes() == definition.read_bytes()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("stewart-gough --per paths", "--per paths: no such change; did you mean 'path'? allowed: task, path"),
        ("stewart-gough --per path", "--out: is missing: name a .toml file; --per path writes the path beside it"),
        ("stewart-gough --per path --out -", "--out -: must name a .toml file; --per path writes the path beside it"),
        ("stewart-gough --per path --out a.csv", "--out a.csv: must name a .toml file"),
        (
            "delta --per path --out a.toml",
            "'delta' has 3 of the six degrees of freedom that a turn about the tool needs",
        ),
        ("3-rps --per task", "--per task: needs two motions, but '3-rps' can make fewer at all poses around home"),
        ("orthoglide --per task", "'orthoglide' has no dimension that changes F; use its plain starter"),
        ("stewart-gough --out no/a.toml", "no/a.toml: cannot be written"),
        ("stewart-gough --per path --out old.toml", "old.csv: exists: choose another name, or --force"),
    ],
)
def test_what_a_starter_cannot_be_is_refused(
    words: str, fault: str, tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.csv").write_text("mine")
    refusal_of(cli("new", *words.split()), fault)
    assert [each.name for each in tmp_path.iterdir()] == ["old.csv"]
    assert (tmp_path / "old.csv").read_text() == "mine"


def test_force_overwrites_a_starter(tmp_path: Path, cli: Run) -> None:
    case = tmp_path / "case.toml"
    output_of(cli("new", "stewart-gough", "--out", str(case)))
    plain = case.read_text()
    assert plain == output_of(cli("new", "stewart-gough"))
    refusal_of(cli("new", "stewart-gough", "--per", "task", "--out", str(case)), "exists")
    assert case.read_text() == plain
    output_of(cli("new", "stewart-gough", "--per", "task", "--out", str(case), "--force"))
    assert 'per = "task"' in case.read_text()


def test_a_worst_case_takes_a_dimension_on_which_no_task_depends() -> None:
    """The free dimension of this robot changes limits only, and F of neither task."""
    text = task_starter(robot_function("exechon")()).replace('"weighted-sum"', '"worst-case"', 1)
    case = case_from(text)
    solution = solve(case, starts=4)
    assert solution.combination is not None
    scale = 2 / sum(task.weight for task in case.tasks)
    levels = [each.F / (scale * task.weight) for each, task in zip(solution.outcomes, case.tasks, strict=True)]
    assert min(levels) == pytest.approx(solution.combination.value, rel=1e-6)
