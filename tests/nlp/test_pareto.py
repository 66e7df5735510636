"""Trade-off curves and fronts: each point is an optimum, slopes are those of the curve; and their pages."""

import base64
import itertools
import json
import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
from builders import TWO_GOALS, Run, assert_words, edited, output_of, refusal_of, rows_of, saved

import screwsynth.nlp as sn
from screwsynth.models import stewart_gough
from screwsynth.nlp.output.report.designs import changed_words
from screwsynth.nlp.results.explorations import FrontResult
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.results.tradeoff import TradeoffResult

#: Rounding of a corrected point: bounds hold to 1e-9 of half a range.
EXACT = 1e-8


@pytest.fixture
def case(tmp_path: Path) -> str:
    return str(saved(tmp_path / "case.toml", TWO_GOALS))


def test_two_objectives_on_a_line(case: str, tmp_path: Path, cli: Run) -> None:
    out, picture = tmp_path / "front.csv", tmp_path / "front.svg"
    goals = ("--goal", "max F:up", "--goal", "max F:side")
    said = output_of(cli("pareto", case, *goals, "--points", "9", "--csv", str(out), "--plot", str(picture)))
    assert said.startswith("Pareto front of 9 points: largest F of up and largest F of side\n")
    rows = rows_of(out.read_text())
    # The terminal has the same points.
    shown = [line.split()[:2] for line in said.splitlines()[-9:]]
    assert shown == [[f"{float(row[name]):.7g}" for name in ("F:up", "F:side")] for row in rows]
    up, side = (np.array([float(row[name]) for row in rows]) for name in ("F:up", "F:side"))
    assert up + 2 * side == pytest.approx(np.full(9, 6.0), abs=EXACT)
    heights = [float(row["p_z"]) for row in (rows[0], rows[-1])]
    assert heights == pytest.approx([5, 40], abs=1e-9)
    # Bisecting the widest gap of a line eight times gives equal steps.
    assert np.diff(up) == pytest.approx(np.full(8, (up[-1] - up[0]) / 8), rel=1e-6)
    assert {row["verdict"] for row in rows} == {"strict local maximum"}
    for row in rows[1:-1]:
        # The multiplier of the bounded goal is the slope of the front.
        expected = 2.0 if row["optimised"] == "F:up" else 0.5
        assert row["active"].startswith("F of")
        assert float(row["multipliers"]) == pytest.approx(expected, rel=1e-6)
    assert b"front" in picture.read_bytes()


def test_a_limit_as_a_goal_with_proofs(case: str, cli: Run) -> None:
    goals = ("--goal", "max F:up", "--goal", "min limits.leg_length.max")
    code, out, _ = cli("pareto", case, *goals, "--points", "5", "--certify", "--csv", "-")
    rows = rows_of(out)
    assert (code, len(rows)) == (0, 5)
    length, up = (np.array([float(row[name]) for row in rows]) for name in ("limits.leg_length.max", "F:up"))
    # Each leg has the length L and the horizontal part d: F = 6 (L^2 - d^2) / L^2, and L^2 = h^2 + d^2.
    squared = length[0] ** 2 - 5**2
    assert up == pytest.approx(6 * (1 - squared / length**2), abs=EXACT)
    assert length[-1] == pytest.approx(math.sqrt(40**2 + squared), rel=1e-9)
    assert {row["certificate"] for row in rows} == {"proved"}
    for row in rows:
        value, bound = float(row[row["optimised"]]), float(row["proven_bound"])
        assert abs(bound - value) <= 1e-4 * value


def test_goals_without_conflict_have_one_point(case: str, cli: Run) -> None:
    code, said, _ = cli("pareto", case, "--goal", "max F:up", "--goal", "min F:side")
    assert (code, said.splitlines()[0]) == (0, "Pareto front of 1 point: largest F of up and smallest F of side")


# Six parallel legs along the platform's position p: F of the translation along an axis is 6 p_i^2 / |p|^2, and each leg
# has the length |p|. Of the points with given F x and F y, the shortest legs are those with the smallest height, so
# that F x + F y = 6 - 6 * 10^2 / L^2 on the front, and above it is dominated.
PARALLEL = edited(
    TWO_GOALS,
    ('name = "up", sense = "max", axis = [0, 0, 1]', 'name = "x", sense = "max", axis = [1, 0, 0]'),
    ('name = "side", sense = "max", axis = [1, 0, 0]', 'name = "y", sense = "max", axis = [0, 1, 0]'),
    ("x2 = 4, x3 = 30", "x2 = 12, x3 = 20"),
    ("[0, 0, { min = 5, max = 40 }]", "[{ min = 0, max = 20 }, { min = 0, max = 20 }, { min = 10, max = 15 }]"),
    ("max = 60", "max = 30"),
    ("starts = 2", "starts = 1"),
)
#: The widest hole may be so many times that of points which are chosen with the exact front known, farthest ones first:
#: that choice is itself within a factor of two of the best.
HOLE = 2


def widest_hole(exact: np.ndarray, found: np.ndarray) -> float:
    """The largest distance of a point (k,) of a front to the nearest of those found."""
    return float(np.linalg.norm(exact[:, np.newaxis] - found, axis=2).min(axis=1).max())


def farthest_first(exact: np.ndarray, count: int) -> np.ndarray:
    """Points of a front, each the farthest from those before."""
    chosen = [0]
    for _ in range(count - 1):
        chosen.append(int(np.linalg.norm(exact[:, np.newaxis] - exact[chosen], axis=2).min(axis=1).argmax()))
    return exact[chosen]


def test_three_goals_on_an_exact_front(tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / "parallel.toml", PARALLEL)
    files = [tmp_path / f"front.{end}" for end in ("csv", "json", "html")]
    goals = ("--goal", "max F:x", "--goal", "min limits.leg_length.max", "--goal", "max F:y")
    options = [word for file in files for word in (f"--{file.suffix[1:]}", str(file))]
    code, said, err = cli("pareto", str(path), *goals, "--points", "12", *options)
    assert (code, err, said.partition(" points")[0]) == (0, "", "Pareto front of 12")
    rows = rows_of(files[0].read_text())
    x, y, length = (np.array([float(row[name]) for row in rows]) for name in ("F:x", "F:y", "limits.leg_length.max"))
    assert x + y == pytest.approx(6 - 600 / length**2, abs=1e-7)
    found = np.stack([x, y, length], axis=1)
    costs = found * [-1, -1, 1]
    dominated = [(np.delete(costs, k, 0) <= cost - 1e-7).all(axis=1).any() for k, cost in enumerate(costs)]
    assert not any(dominated)
    # The exact front: all positions at the smallest height within the largest length.
    sides = np.stack(np.meshgrid(*[np.linspace(0, 20, 30)] * 2), axis=-1).reshape(-1, 2)
    squared = 100 + np.sum(sides**2, axis=1)
    exact = np.column_stack([6 * sides**2 / squared[:, np.newaxis], np.sqrt(squared)])[squared <= 900]
    scale = np.ptp(exact, axis=0)
    best = widest_hole(exact / scale, farthest_first(exact / scale, 12))
    assert widest_hole(exact / scale, found / scale) < HOLE * best
    result = sn.load_result(files[1])
    assert isinstance(result, FrontResult)
    assert [each.goals["F:x"] for each in result.points] == x.tolist()
    assert set(result.points[0].design) == {"p_x", "p_y", "p_z"}
    page = files[2].read_text()
    assert page.count("<tr>") == 13
    # The panels of the three pairs of goals are below each other in a narrow window.
    pictures = re.search(r'<picture><source media="[^"]*" srcset="([^"]*)"><img src="([^"]*)"', page)
    assert pictures is not None
    narrow, wide = (ElementTree.fromstring(base64.b64decode(each.split(",")[1])) for each in pictures.groups())
    narrow_size, wide_size = ([float(each.attrib[key][:-2]) for key in ("width", "height")] for each in (narrow, wide))
    assert narrow_size[0] < narrow_size[1]
    assert wide_size[0] > wide_size[1]


def test_two_limits_as_goals(tmp_path: Path) -> None:
    edits = ("x1 = 12", "x1 = { min = 8, max = 20 }"), ("[solve]", "radius_ratio = { max = 0.5 }\n[solve]")
    path = saved(tmp_path / "limits.toml", edited(TWO_GOALS, *edits))
    goals = ["min limits.leg_length.max", "min limits.radius_ratio.max"]
    front = sn.pareto(sn.load_case(str(path)), goals, points=5, starts=1)
    length, ratio = np.array([each.values for each in front.points]).T
    # A small ratio needs a large base, and so long legs; the lowest height is the best, at the ends too.
    base = 4 / ratio
    assert length**2 == pytest.approx(25 + base**2 + 16 - 8 * base * math.cos(math.radians(10)), rel=1e-7)
    assert (len(ratio), ratio[0], ratio[-1]) == (5, pytest.approx(0.2), pytest.approx(0.5))


@pytest.mark.parametrize(
    ("goals", "words"),
    [
        (("max F:up",), "a front has 2 to 6 goals, and 1 is given"),
        (("max F:up", "max F:up"), "F:up is given twice"),
        (("max F:upp", "max F:side"), "the case has no such task; did you mean 'up'?"),
        (("up", "max F:side"), "must be 'max F:TASK', 'min F:TASK', 'min limits.KEY' or 'max limits.KEY'"),
        (("max F", "max F:side"), "the case has no such task"),
        (("max F:up", "max F:side", "min F:up"), "F:up is given twice"),
        (("max F:up", "min limits.x"), "the case has no such limit that can be minimised; allowed: leg_length.max"),
        (("max F:up", "max limits.leg_length.max"), "allowed: leg_length.min"),
    ],
)  # fmt: skip
def test_bad_goals_are_one_sentence(goals: tuple[str, ...], words: str, case: str, cli: Run) -> None:
    refusal_of(cli("pareto", case, *(word for goal in goals for word in ("--goal", goal))), words)


# Trade-off curves: each point is the optimum of the edited case, and the slope is the curve's own.

SMALL = """\
title = "A platform on a column"
units = { length = "cm" }
solve = { starts = 4 }
robot = { model = "stewart-gough", parameters = { x1 = 12, x2 = 8, x3 = 20, x4 = 8 } }
[pose]
position = [0, { min = -5, max = 5 }, { min = 20, max = 50 }]
rotation = { axis = [0, 0, 1], angle = { min = -25, max = 25 } }
[[task]]
name = "drive"
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
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
        solution = sn.solve(sn.load_case(str(path)))
        assert point["F"] == pytest.approx(solution.F, rel=1e-9)
        assert point["tasks"] == [point["F"]]
        assert point["pose"]["position"] == pytest.approx(solution.state.position, abs=1e-4)
    F = [point["F"] for point in found["points"]]
    assert sorted(F) == F, "a wider limit loses nothing"
    assert F[-1] > F[0]


def test_the_slope_is_that_of_the_curve(small: str, cli: Run, tmp_path: Path) -> None:
    for over in (f"{LIMIT}=30:30.02:3", "x2=7.99:8.01:3", "x3=19.99:20.01:3", "p_z.max=29.99:30.01:3"):
        found = curve(cli, small, over)
        first, middle, last = found["points"]
        difference = (last["F"] - first["F"]) / (last["value"] - first["value"])
        assert abs(difference) > 1e-3
        assert middle["slope"] == pytest.approx(difference, rel=1e-4)
        assert found["unit"] == ("deg" if over.startswith("x3") else "cm")
    # Of a smallest value that is minimised.
    path = saved(tmp_path / "min.toml", SMALL.replace('"max"', '"min"'))
    for over in ("p_y.min=-4.99:-5.01:3", "p_z.min=30.01:29.99:3", "limits.leg_length.min=30.02:30:3"):
        first, middle, last = curve(cli, str(path), over)["points"]
        difference = (last["F"] - first["F"]) / (last["value"] - first["value"])
        if middle["slope"] is None:
            assert abs(difference) < 1e-6, "a bound that is not active has no slope"
        else:
            assert middle["slope"] == pytest.approx(difference, rel=1e-4, abs=1e-7)


def test_values_without_an_answer(small: str, cli: Run) -> None:
    found = curve(cli, small, f"{LIMIT}=12:32:3", "--starts", "2")
    jsonschema.validate(found, json.loads(json.dumps(result_schema())))
    assert [point["status"] for point in found["points"]] == ["infeasible", "optimal", "optimal"]
    empty = found["points"][0]
    assert (empty["F"], empty["slope"], empty["tasks"], empty["parameters"]) == (None, None, [None], None)
    assert found["points"][1]["active"][-1] == LIMIT
    # Where no value has an answer, the status of the command says so.
    curve(cli, small, f"{LIMIT}=10:12:2", "--starts", "2", status=1)
    out = output_of(cli("tradeoff", small, "--over", f"{LIMIT}=12:32:3", "--starts", "2"))
    assert_words(out, "infeasible at 12 cm", "active throughout  leg_length.max")


def test_several_tasks(cli: Run, tmp_path: Path) -> None:
    path = tmp_path / "several.toml"
    for method, has_value in (("average", False), ("weighted-sum", True)):
        saved(path, f'{SMALL}{PUSH}[combine]\nmethod = "{method}"\n')
        found = curve(cli, str(path), "x1=11:12:2")
        assert (found["tasks"], found["senses"]) == (["drive", "push"], ["max", "min"])
        for point in found["points"]:
            solution = sn.solve(sn.load_case(str(path), {"x1": point["value"]}))
            assert point["tasks"] == pytest.approx([outcome.F for outcome in solution.outcomes], rel=1e-7)
            assert (point["F"] is not None) == has_value


def test_csv_picture_and_page(small: str, cli: Run, tmp_path: Path) -> None:
    files = {kind: tmp_path / f"curve.{kind}" for kind in ("csv", "png", "svg", "html", "json")}
    arguments = ["--csv", str(files["csv"]), "--html", str(files["html"]), "--json", str(files["json"])]
    for kind in ("png", "svg"):
        output_of(cli("tradeoff", small, "--over", f"{LIMIT}=12:40:5", "--plot", str(files[kind]), *arguments))
    result = json.loads(files["json"].read_text(encoding="utf-8"))
    again = sn.load_result(files["json"])
    assert isinstance(again, TradeoffResult)
    assert json.loads(json.dumps(sn.json_data(again))) == result
    rows = rows_of(files["csv"].read_text(encoding="utf-8"))
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
    assert "Infeasible at" in page
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ("x1", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3", "must have from 2 to 200 values"),
        ("x1=3:4", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3:4:5:6", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=a:4:5", "FIRST = 'a': must be a finite number"),
        ("=3:4:5", "must be NAME=FIRST:LAST:COUNT"),
        ("x1=3:3:5", "FIRST and LAST must differ"),
        ("x1=3:inf:5", "LAST = 'inf': must be a finite number"),
        ("x1=3:4:1", "COUNT must be 2 or more"),
        ("x1=3:4:-2", "COUNT = -2 must be a whole number from 1"),
        ("x1=3:4:201", "must have from 2 to 200 values"),
        ("y1=3:4:5", "y1: cannot be set"),
        ("x1=3:-4:5", "robot.parameters.x1 = "),
        ("limits.leg_lenght.max=3:4:5", "leg_lenght"),
    ],
)
def test_ranges_that_are_refused(over: str, words: str, small: str, cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    refusal_of(cli("tradeoff", small, "--over", over, "--csv", str(target)), words)
    assert not target.exists()


def platform(radius: float, start: float) -> sn.Case:
    """A case with two local optima, to either side of no rotation; one start finds the one on its side."""
    task = sn.Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=4)
    dimensions = {"x1": radius, "x2": 8, "x3": 0.4, "x4": 0.2}
    return sn.Case(stewart_gough(), dimensions, (0, 0, 20), [task], sn.Rotation((0, 0, 1), sn.Free(-2.5, 2.5, start)))


def test_neighbours_lead_each_other_to_better_optima() -> None:
    radii = [10.0, 11.0, 12.0]
    worse, better = ([sn.solve(platform(radius, start), starts=1).F for radius in radii] for start in (-2.3, 1.4))
    assert all(one < 0.9 * other for one, other in zip(worse, better, strict=True)), "two optima"
    # Only the middle value's own start leads to the better optimum.
    starts = {10.0: -2.3, 11.0: 1.4, 12.0: -2.3}
    found = sn.tradeoff(lambda radius: platform(radius, starts[radius]), {"x1": radii}, starts=1)
    assert [point.solution.F for point in found.points] == pytest.approx(better, rel=1e-9)


def test_in_python() -> None:
    def at(value: float) -> sn.Case:
        return platform(value, 1.4)

    found = sn.tradeoff(at, {"x1": [10, 11]}, starts=3)
    assert [point.solution.status for point in found.points] == [sn.Status.OPTIMAL, sn.Status.OPTIMAL]
    assert sn.json_data(sn.tradeoff_result(found))["over"] == "x1"
    one = sn.result_of(sn.solve(at(11), starts=3))
    assert sn.json_data(sn.tradeoff_result(found).points[1])["F"] == pytest.approx(sn.json_data(one)["F"])
    with pytest.raises(sn.InputError, match="x1: has no values"):
        sn.tradeoff(at, {"x1": []})
    with pytest.raises(sn.CaseError, match="x1"):
        sn.tradeoff(at, {"x1": [10, -1]})


def figures_of(page: str) -> list[tuple[str, ElementTree.Element]]:
    """Return the words below each drawn design, and its picture."""
    part = page[page.index('class="designs"') :]
    found = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)".*?<figcaption>(.*?)</figcaption>', part, re.DOTALL)
    return [(re.sub("<[^>]+>", " ", words), ElementTree.fromstring(base64.b64decode(svg))) for svg, words in found]


def test_a_tradeoff_shows_each_design_and_where_the_curve_bends(tmp_path: Path, cli: Run) -> None:
    page, data = tmp_path / "page.html", tmp_path / "data.json"
    asked = ("hexapod-machining", "--over", f"{LIMIT}=30:38:3", "--starts", "2")
    output_of(cli("tradeoff", *asked, "--html", str(page), "--json", str(data)))
    points, text = json.loads(data.read_text())["points"], page.read_text()
    figures = figures_of(text)
    assert len(figures) == len(points) == 3
    for point, (words, picture) in zip(points, figures, strict=True):
        assert f"maximum leg length = {point['value']:.5g} in" in words
        assert f"F = {point['F']:.6g}" in words
        assert f"x2 = {point['parameters']['x2']:.5g}" in words
        # The robot has six limbs in each picture, which has no words.
        names = [each.get("id", "") for each in picture.iter()]
        assert {f"limb {k}{side}" for k in (1, 2, 3) for side in "+-"} <= set(names)
        assert not [name for name in names if name.startswith(("text_", "velocity", "frame", "path"))]
    lines = re.findall("<li>(.*?)</li>", text[text.index('id="bends"') :].split("</ul>")[0])
    changed = [(a["value"], b["value"]) for a, b in itertools.pairwise(points) if set(a["active"]) != set(b["active"])]
    assert changed
    assert len(lines) == len(changed) == text.count('class="bound"')
    for line, (before, after) in zip(lines, changed, strict=True):
        assert line.startswith(
            f"Between maximum leg length = {before:.5g} in and maximum leg length = {after:.5g} in: "
        )


def test_all_designs_have_one_scale(tmp_path: Path, cli: Run) -> None:
    page = tmp_path / "page.html"
    case = str(saved(tmp_path / "case.toml", TWO_GOALS))
    goals = ("--goal", "max F:up", "--goal", "max F:side")
    output_of(cli("pareto", case, *goals, "--points", "3", "--html", str(page)))
    figures = figures_of(page.read_text())
    assert len(figures) == 3
    # The base is the same in all designs, so it has the same place and size in all pictures.
    for plate, count in (("plate base", 1), ("plate platform", 3)):  # the platform is higher or lower
        drawn = [next(each for each in svg.iter() if each.get("id") == plate) for _, svg in figures]
        assert len(set(map(ElementTree.tostring, drawn))) == count
    assert changed_words(["a"], ["a", "b"]) == "b becomes active"
    assert changed_words(["a", "b"], ["c", "d"]) == "c, d become active; a, b become inactive"
    assert changed_words(["a"], []) == "a becomes inactive"
