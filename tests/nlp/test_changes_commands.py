"""Commands on cases whose dimensions or pose change from task to task: closed forms, and agreement with solve."""

import csv
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, output_of
from generated import needs_compiler
from jsonschema import Draft202012Validator
from test_changes import BEST_PUSH, BEST_TURN, PINS, SECTION_4_3, pins, pushed, read, turned

from screwsynth.nlp import Case, compare, pareto, solve, tradeoff
from screwsynth.nlp.case.pose import Free
from screwsynth.nlp.case.toml import toml_text
from screwsynth.nlp.embedding.subject import find_subject
from screwsynth.nlp.evidence.evaluation import evaluate
from screwsynth.nlp.output.live.casefile import case_parts, stated_tasks
from screwsynth.nlp.results.evaluation import evaluation_at
from screwsynth.nlp.results.schema import result_schema

Embedded = Any


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "pins.toml").write_text(PINS)
    return str(tmp_path / "pins.toml")


def checked(path: Path) -> dict[str, Any]:
    """The result in a file, which keeps to the schema."""
    result: dict[str, Any] = json.loads(path.read_text())
    Draft202012Validator(json.loads(json.dumps(result_schema()))).validate(result)
    return result


def test_every_task_is_evaluated_at_its_settings(file: str, tmp_path: Path, cli: Run) -> None:
    data = tmp_path / "evaluated.json"
    words = output_of(cli("evaluate", file, "--set", "x1.task1=6.5", "--set", "x1.task2=11", "--json", str(data)))
    assert "x1.task2   11" in words
    result = checked(data)
    wanted = [float(pushed(6.5)), float(turned(11.0))]
    assert [task["F"] for task in result["tasks"]] == pytest.approx(wanted, rel=1e-12)
    assert [robot["parameters"]["x1"] for robot in result["settings"]] == pytest.approx([6.5, 11])
    tables = output_of(cli("evaluate", file, "--set", "x1.task1=6.5", "--csv", "-"))
    assert "jacobian.task2" in tables
    assert pytest.approx(wanted[0], rel=1e-12) == evaluate(read(PINS, **{"x1.task1": 6.5})).F


def test_a_violated_limit_of_one_task_fails_the_evaluation(tmp_path: Path, cli: Run) -> None:
    limited = tmp_path / "limited.toml"
    limited.write_text(f"{PINS}\n[limits]\nleg_length = {{ max = 40.5 }}\n")
    status, words, _ = cli("evaluate", str(limited), "--set", "x1.task1=6", "--set", "x1.task2=12")
    assert status == 1
    assert "leg_length" in words
    assert cli("evaluate", str(limited), "--set", "x1=6")[0] == 0


@pytest.mark.parametrize("text", [PINS, SECTION_4_3])
def test_the_solved_point_is_evaluated_as_it_was_solved(text: str, tmp_path: Path, cli: Run) -> None:
    case, solved, evaluated = tmp_path / "case.toml", tmp_path / "solved.json", tmp_path / "evaluated.json"
    case.write_text(text)
    output_of(cli("solve", str(case), "--json", str(solved)))
    for of in (solved, evaluated):
        output_of(cli("evaluate", str(case), "--of", str(of), "--json", str(evaluated)))
        wanted, found = json.loads(solved.read_text()), checked(evaluated)
        assert [task["F"] for task in found["tasks"]] == pytest.approx(
            [task["F"] for task in wanted["combined"]["tasks"]], rel=1e-9
        )


def test_results_with_settings_need_the_tasks_of_the_case(file: str, tmp_path: Path, cli: Run) -> None:
    shared, solved = tmp_path / "shared.toml", tmp_path / "solved.json"
    shared.write_text(PINS.replace(', per = "task"', "").replace('title = "', 'title = "shared: '))
    output_of(cli("solve", file, "--json", str(solved)))
    status, _, fault = cli("evaluate", str(shared), "--of", str(solved))
    assert status == 2
    assert "has a robot for each of 2 tasks, but 'shared' has one robot for all tasks; set the values" in fault
    # A result with one robot gives every task this robot.
    output_of(cli("evaluate", str(shared), "--set", "x1=9", "--json", str(solved)))
    status, words, notice = cli("evaluate", file, "--of", str(solved))
    assert (status, "gives the dimensions of the case 'shared'" in notice) == (0, True)
    assert "x1.task1   9" in words
    assert "x1.task2   9" in words


def test_a_row_of_a_sweep_is_a_solve_at_its_point(file: str, tmp_path: Path, cli: Run) -> None:
    out = tmp_path / "rows.csv"
    assert cli("sweep", file, "--over", "x1.task2.max=8,9", "--out", str(out))[0] == 0
    with out.open() as lines:
        rows = list(csv.DictReader(lines))
    for row, most in zip(rows, (8.0, 9.0), strict=True):
        solution = solve(read(PINS, **{"x1.task2.max": most}))
        assert solution.combination is not None
        assert float(row["F"]) == pytest.approx(solution.combination.value, rel=1e-9)
        for name in ("x1.task1", "x1.task2"):
            assert float(row[name]) == pytest.approx(solution[name], abs=1e-6)


def test_a_trade_off_has_the_settings_of_every_task(file: str, tmp_path: Path, cli: Run) -> None:
    found = tradeoff(pins(), {"x1.task2.max": [8.0, 12.0]})
    for point, most in zip(found.points, (8.0, 12.0), strict=True):
        F = [outcome.F for outcome in point.solution.outcomes]
        assert pytest.approx([BEST_PUSH, float(turned(most))], rel=1e-7) == F
    data = tmp_path / "curve.json"
    output_of(cli("tradeoff", file, "--over", "x1.task2.max=8,9", "--json", str(data)))
    assert [point["parameters"]["x1.task2"] for point in checked(data)["points"]] == pytest.approx([8, 9])
    output_of(cli("tradeoff", file, "--over", "x1.task2.max=8,9", "--html", str(tmp_path / "curve.html")))


def test_each_pose_of_a_trade_off_is_shown(tmp_path: Path, cli: Run) -> None:
    case, data = tmp_path / "case.toml", tmp_path / "curve.json"
    case.write_text(SECTION_4_3)
    output_of(cli("tradeoff", str(case), "--over", "x4.max=10,30", "--json", str(data)))
    first, last = ([pose["position"] for pose in point["poses"]] for point in checked(data)["points"])
    assert len(first) == 2
    assert last == [[pytest.approx(v) for v in (-10, -10, 50)], [pytest.approx(v) for v in (-10, 10, 20)]]


def test_goals_of_tasks_with_their_own_dimensions_do_not_compete() -> None:
    # Only x2 is shared; for fixed x2 the front is one point, the best of every task.
    front = pareto(pins(), ["max F:push", "max F:turn"], points=3)
    assert len(front.points) == 1
    assert front.points[0].values == pytest.approx([BEST_PUSH, BEST_TURN], rel=1e-7)
    case = replace(pins(), parameters={**pins().parameters, "x2": Free(5, 7)})
    points = pareto(case, ["max F:push", "max F:turn"], points=3).points
    x2 = np.linspace(5, 7, 2001)
    ends = [float(pushed(5.0 + 0 * x2, x2).max()), float(turned(12.0 + 0 * x2, x2).max())]
    assert max(point.values[1] for point in points) == pytest.approx(ends[1], rel=1e-6)
    assert max(point.values[0] for point in points) >= ends[0] * (1 - 1e-9)


def test_the_robot_of_the_case_is_compared_with_its_settings(tmp_path: Path, file: str, cli: Run) -> None:
    found = compare(pins(), ["case", "hexapod"], part=0.0)
    own = next(each for each in found.entries if each.contender.is_of_case)
    assert own.solution is not None
    assert own.value == pytest.approx((BEST_PUSH + BEST_TURN) / 2, rel=1e-8)
    assert pytest.approx(BEST_TURN, rel=1e-8) == own.tasks[1].F
    data = tmp_path / "compared.json"
    words = output_of(
        cli("compare", file, "case", "hexapod", "--certify", "--part", "0", "--starts", "2", "--json", str(data))
    )
    assert "Only the robot of the case changes x1 from task to task" in " ".join(words.split())
    robots = {robot["name"]: robot for robot in checked(data)["robots"]}
    names = [each["name"] for each in robots["case"]["dimensions"]]
    assert names == ["x1.task1", "x1.task2", "x2", "x3", "x4"]


def test_rounding_keeps_limits_and_finds_the_best_multiples(tmp_path: Path, cli: Run) -> None:
    case, data = tmp_path / "case.toml", tmp_path / "rounded.json"
    case.write_text(f"{PINS}\n[limits]\nleg_length = {{ max = 40.4 }}\n")
    output_of(cli("solve", str(case), "--round", "0.5", "--json", str(data)))
    combined = checked(data)["combined"]
    radii = [robot["parameters"]["x1"] for robot in combined["settings"]]
    lengths = [max(robot["quantities"]["leg_length"].values()) for robot in combined["settings"]]
    assert max(lengths) <= 40.4
    # F of the push is 6 (z / length)^2, so it gives the length.
    allowed = [x for x in np.arange(5, 12.1, 0.5) if np.sqrt(6 * 40.0**2 / pushed(x)) <= 40.4]
    level = max(min(float(pushed(one)), float(turned(other))) for one in allowed for other in allowed)
    assert min(float(pushed(radii[0])), float(turned(radii[1]))) == pytest.approx(level, rel=1e-9)
    assert all(min(abs(radius - each) for each in allowed) <= 1e-9 for radius in radii)


@needs_compiler
@pytest.mark.parametrize("method", ["worst-case", "weighted-sum"])
@pytest.mark.parametrize("text", [PINS, SECTION_4_3])
def test_the_c_has_the_values_of_the_program(text: str, method: str, embed: Callable[..., Embedded]) -> None:
    case: Case = read(text.replace("worst-case", method))
    subject, c = find_subject(case), embed(case, "-O0")
    c.compare(subject.nlp, 20, 1e-12)
    assert c.macro("POSETASKS") == 1
    solved = c.solve()
    assert solved.status == 0
    if subject.optimum is not None:
        assert pytest.approx(subject.optimum, rel=1e-7) == solved.F


def test_an_average_has_no_c(tmp_path: Path, cli: Run) -> None:
    case = tmp_path / "case.toml"
    case.write_text(PINS.replace("worst-case", "average"))
    status, _, fault = cli("codegen", str(case), "--out", str(tmp_path / "c"))
    assert (status, "must be 'weighted-sum' or 'worst-case' for C" in fault) == (2, True)


def test_a_live_page_has_a_slider_for_every_setting(tmp_path: Path, cli: Run) -> None:
    """An average has no solver in the page, so this page needs no compiler."""
    case, page = tmp_path / "case.toml", tmp_path / "page.html"
    case.write_text(PINS.replace("worst-case", "average"))
    words = output_of(cli("view", str(case), "--out", str(page), "--no-open"))
    assert "does not combine tasks by the average" in words
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.read_text(), re.DOTALL)
    assert found is not None
    data = json.loads(found[1])
    assert [each["name"] for each in data["sliders"]][:3] == ["x1.task1", "x1.task2", "x2"]
    assert [data["pose_tasks"], data["stated_poses"]] == [[0, 1], [0, 0]]
    assert data["answer"]["x"] == pytest.approx([6 * 3**0.5 / 2, 12], rel=1e-6)
    assert ">turn</option>" in page.read_text()


@pytest.mark.parametrize("text", [PINS, SECTION_4_3], ids=["dimension", "pose"])
def test_a_copied_case_file_states_the_setting_of_every_task(text: str) -> None:
    case = read(text)
    values = {name: f"{1 + k / 8:g}" for k, name in enumerate(case.scalars)}
    values |= {f"{prefix}axis": "[0, 0, 1]" for prefix in case.pose_prefixes}
    values |= {f"{prefix}angle": "0.5" for prefix in case.pose_prefixes}
    for k, task in enumerate(stated_tasks(case)):
        values |= {f"task[{k}].{key}": toml_text(value) for key, value in task.items()}
    parts = case_parts(case, ())
    again = read("".join(each if isinstance(each, str) else values[each["set"]] for each in parts))
    shown = [again.of_task(k) for k in range(2)]
    for k, own in enumerate(shown):
        for item in case.model.parameters:
            name = f"{item.name}.task{k + 1}"
            stated = float(values[name if name in values else item.name])
            assert case.units.shown(float(own.components(item.name)[0]), item.dimension) == pytest.approx(stated)
        prefix = case.pose_prefixes[k % len(case.pose_prefixes)]
        assert own.position == pytest.approx([float(values[f"{prefix}p_{letter}"]) for letter in "xyz"])


def test_an_evaluation_starts_in_the_middle_of_every_range() -> None:
    result = evaluation_at(read(PINS, **{"x1.task2": 10.0}))
    assert [task.F for task in result.tasks] == pytest.approx([float(pushed(8.5)), float(turned(10.0))], rel=1e-12)
