"""Trade-off curves: each point is the optimum of the edited case, and the slope is the curve's own."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from builders import Run, output_of, refusal_of, saved

from screwsynth.models import stewart_gough
from screwsynth.nlp import (
    Case,
    CaseError,
    Free,
    InputError,
    Rotation,
    Status,
    Task,
    json_data,
    load_case,
    load_result,
    result_of,
    solve,
    tradeoff,
    tradeoff_result,
)
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.results.tradeoff import TradeoffResult

SMALL = """\
title = "A platform on a column"
[units]
length = "cm"
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 8, x3 = 20, x4 = 8 }
[pose]
position = [0, { min = -5, max = 5 }, { min = 20, max = 50 }]
rotation = { axis = [0, 0, 1], angle = { min = -25, max = 25 } }
[[task]]
name = "drive"
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
[solve]
starts = 4
"""
PUSH = '[[task]]\nname = "push"\nsense = "min"\naxis = [1, 0, 3]\npoint = [0, 1, 9]\npitch = 2\n'
LIMIT = "limits.leg_length.max"


@pytest.fixture
def small(tmp_path: Path) -> str:
    return str(saved(tmp_path / "small.toml", SMALL))


def curve(cli: Run, case: str, over: str, *more: str, status: int = 0) -> dict[str, Any]:
    code, out, err = cli("tradeoff", case, "--over", over, *more, "--json", "-")
    assert (code, err) == (status, "")
    found: dict[str, Any] = json.loads(out)
    return found


def test_each_point_is_the_optimum_of_the_case_with_that_value(small: str, cli: Run, tmp_path: Path) -> None:
    found = curve(cli, small, f"{LIMIT}=26:42:5")
    assert [point["value"] for point in found["points"]] == [26, 30, 34, 38, 42]
    assert (found["over"], found["unit"], found["senses"], found["tasks"]) == (LIMIT, "cm", ["max"], ["drive"])
    for point in found["points"]:
        path = saved(tmp_path / "edited.toml", f"{SMALL}[limits]\nleg_length = {{ max = {point['value']} }}\n")
        solution = solve(load_case(str(path)))
        assert point["F"] == pytest.approx(solution.F, rel=1e-9)
        assert point["tasks"] == [point["F"]]
        assert solution.state is not None
        assert point["pose"]["position"] == pytest.approx(solution.state.position, abs=1e-4)
    F = [point["F"] for point in found["points"]]
    assert sorted(F) == F, "a wider limit loses nothing"
    assert F[-1] > F[0]


@pytest.mark.parametrize(
    ("over", "unit"),
    [
        (f"{LIMIT}=30:30.02:3", "cm"),
        ("x2=7.99:8.01:3", "cm"),
        ("x3=19.99:20.01:3", "deg"),
        ("p_z.max=29.99:30.01:3", "cm"),
    ],
)
def test_the_slope_is_that_of_the_curve(over: str, unit: str, small: str, cli: Run) -> None:
    found = curve(cli, small, over)
    first, middle, last = found["points"]
    difference = (last["F"] - first["F"]) / (last["value"] - first["value"])
    assert abs(difference) > 1e-3
    assert middle["slope"] == pytest.approx(difference, rel=1e-4)
    assert found["unit"] == unit


def test_the_slope_of_a_smallest_value_that_is_minimised(small: str, cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "min.toml", SMALL.replace('"max"', '"min"'))
    for over in ("p_y.min=-4.99:-5.01:3", "p_z.min=30.01:29.99:3", "limits.leg_length.min=30.02:30:3"):
        first, middle, last = curve(cli, str(path), over)["points"]
        difference = (last["F"] - first["F"]) / (last["value"] - first["value"])
        if middle["slope"] is None:
            assert abs(difference) < 1e-6, "a bound that is not active has no slope"
        else:
            assert middle["slope"] == pytest.approx(difference, rel=1e-4, abs=1e-7)
    assert small


def test_values_without_an_answer(small: str, cli: Run) -> None:
    found = curve(cli, small, f"{LIMIT}=12:32:3", "--starts", "2")
    assert [point["status"] for point in found["points"]] == ["infeasible", "optimal", "optimal"]
    empty = found["points"][0]
    assert (empty["F"], empty["slope"], empty["tasks"], empty["parameters"]) == (None, None, [None], None)
    assert found["points"][1]["active"][-1] == LIMIT
    # Where no value has an answer, the status of the command says so.
    curve(cli, small, f"{LIMIT}=10:12:2", "--starts", "2", status=1)
    code, out, _ = cli("tradeoff", small, "--over", f"{LIMIT}=12:32:3", "--starts", "2")
    assert code == 0
    assert "infeasible at 12 cm" in out
    assert "active throughout  leg_length.max" in out


def test_several_tasks(cli: Run, tmp_path: Path) -> None:
    path = tmp_path / "several.toml"
    for method, has_value in (("average", False), ("weighted-sum", True)):
        text = SMALL.replace("[solve]", f'{PUSH}[combine]\nmethod = "{method}"\n[solve]')
        path.write_text(text, encoding="utf-8")
        found = curve(cli, str(path), "x1=11:12:2")
        assert (found["tasks"], found["senses"]) == (["drive", "push"], ["max", "min"])
        for point in found["points"]:
            solution = solve(load_case(str(path), {"x1": point["value"]}))
            assert point["tasks"] == pytest.approx([outcome.F for outcome in solution.outcomes], rel=1e-7)
            assert (point["F"] is not None) == has_value


def test_the_result_is_of_its_schema(small: str, cli: Run) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(curve(cli, small, f"{LIMIT}=12:32:3", "--starts", "2"), json.loads(json.dumps(result_schema())))


def test_csv_picture_and_page(small: str, cli: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    files = {kind: tmp_path / f"curve.{kind}" for kind in ("csv", "png", "svg", "html", "json")}
    arguments = ["--csv", str(files["csv"]), "--page", str(files["html"]), "--json", str(files["json"])]
    for kind in ("png", "svg"):
        output_of(cli("tradeoff", small, "--over", f"{LIMIT}=12:40:5", "--plot", str(files[kind]), *arguments))
    result = json.loads(files["json"].read_text(encoding="utf-8"))
    again = load_result(files["json"])
    assert isinstance(again, TradeoffResult)
    assert json.loads(json.dumps(json_data(again))) == result
    rows = list(csv.DictReader(io.StringIO(files["csv"].read_text(encoding="utf-8"))))
    assert len(rows) == 5
    for row, point in zip(rows, result["points"], strict=True):
        assert (float(row[LIMIT]), row["status"]) == (point["value"], point["status"])
        assert row["F"] == ("" if point["F"] is None else repr(point["F"]))
        assert row["p_z"] == ("" if point["pose"] is None else repr(point["pose"]["position"][2]))
        assert row["x1"] == ("" if point["parameters"] is None else repr(point["parameters"]["x1"]))
    assert files["png"].read_bytes()[:4] == b"\x89PNG"
    drawing = files["svg"].read_text(encoding="utf-8")
    assert drawing.count('id="F drive"') == 1
    assert drawing.count('id="no answer"') == sum(point["F"] is None for point in result["points"]) > 0
    page = files["html"].read_text(encoding="utf-8")
    assert page.count("<circle") == sum(point["F"] is not None for point in result["points"])
    assert "infeasible at" in page
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ("x1", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3:4", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3:4:5:6", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=a:4:5", "must be NAME=FIRST:LAST:COUNT"),
        ("=3:4:5", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3:3:5", "must be finite and differ"),
        ("x1=3:inf:5", "must be finite and differ"),
        ("x1=3:4:1", "COUNT must be between 2 and 200"),
        ("x1=3:4:-2", "COUNT must be between 2 and 200"),
        ("x1=3:4:201", "COUNT must be between 2 and 200"),
        ("y1=3:4:5", "y1: cannot be set"),
        ("x1=3:-4:5", "robot.parameters.x1 = "),
        ("limits.leg_lenght.max=3:4:5", "leg_lenght"),
    ],
)
def test_ranges_that_are_refused(over: str, words: str, small: str, cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    refusal_of(cli("tradeoff", small, "--over", over, "--csv", str(target)), words)
    assert not target.exists()


def platform(radius: float, start: float) -> Case:
    """A case with two local optima, to either side of no rotation; one start finds the one on its side."""
    task = Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=4)
    dimensions = {"x1": radius, "x2": 8, "x3": 0.4, "x4": 0.2}
    return Case(stewart_gough(), dimensions, (0, 0, 20), [task], Rotation((0, 0, 1), Free(-2.5, 2.5, start)))


def test_neighbours_lead_each_other_to_better_optima() -> None:
    radii = [10.0, 11.0, 12.0]
    worse, better = ([solve(platform(radius, start), starts=1).F for radius in radii] for start in (-2.3, 1.4))
    assert all(one < 0.9 * other for one, other in zip(worse, better, strict=True)), "two optima"
    # Only the middle value's own start leads to the better optimum.
    starts = {10.0: -2.3, 11.0: 1.4, 12.0: -2.3}
    found = tradeoff(lambda radius: platform(radius, starts[radius]), radii, starts=1)
    assert [point.solution.F for point in found.points] == pytest.approx(better, rel=1e-9)


def test_in_python() -> None:
    def at(value: float) -> Case:
        return platform(value, 1.4)

    found = tradeoff(at, [10, 11], name="x1", starts=3)
    assert [point.solution.status for point in found.points] == [Status.OPTIMAL, Status.OPTIMAL]
    data = json_data(tradeoff_result(found))
    assert data["over"] == "x1"
    one = result_of(solve(at(11), starts=3))
    assert json_data(tradeoff_result(found).points[1])["F"] == pytest.approx(json_data(one)["F"])
    with pytest.raises(InputError, match="at least one value"):
        tradeoff(at, [])
    with pytest.raises(CaseError, match="x1"):
        tradeoff(at, [10, -1])
