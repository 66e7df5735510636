"""Page of a case: contents, data, pictures and structure, read without a browser."""

import json
import re
from base64 import b64decode
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Run, assert_words, edited, refusal_of, saved
from casadi import SX
from matplotlib.colors import to_hex
from pages import FEW, Page, displaced, made, number, posed, rates_of_lines

from screwsynth.models import (
    Body,
    Closure,
    Dimension,
    Displacement,
    Link,
    Model,
    Point,
    PoseSymbols,
    Scene,
    Unknown,
    force_along,
)
from screwsynth.nlp import Case, Task, evaluate, formulate, load_case, result_of, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.output.pictures.painting import rate_colour_map
from screwsynth.nlp.output.pictures.style import RATE_COLOURS
from screwsynth.nlp.output.report import sections
from screwsynth.nlp.output.report.charts import Curve, Spot, line_chart
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.slices import planes_of, slices_of
from screwsynth.nlp.output.report.webpage import page_of
from screwsynth.nlp.solver import solve as solve_module

MEGABYTE = 1_000_000


CASES = ("paper-4.1-helical", "paper-4.2", "paper-4.4-max", "hexapod-machining")


IMPOSSIBLE = """\
title = "Legs of half a metre on a small robot"
units = { length = "cm" }
robot = { model = "stewart-gough", layout = "aligned", parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = 8 } }
pose = { position = [0, 0, { min = 20, max = 50 }], rotation = { axis = [0, 0, 1], angle = 0 } }
limits = { leg_length = { min = 500 } }
solve = { starts = 2 }
[[task]]
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
"""


@pytest.mark.parametrize("case", CASES)
def test_size_and_no_network(page_file: Callable[..., Path], page: Callable[..., Page], case: str) -> None:
    assert page_file(case).stat().st_size <= 6 * MEGABYTE
    found = page(case)
    fetched = [
        value
        for tag, attributes in found.elements
        for name, value in attributes.items()
        if name in {"src", "srcset", "action", "data", "poster"} or (name == "href" and tag in {"link", "a", "base"})
    ]
    assert fetched
    assert all(value is not None and value.startswith(("#", "data:")) for value in fetched)
    policies = [a["content"] for tag, a in found.elements if tag == "meta" and "http-equiv" in a]
    assert len(policies) == 1
    assert policies[0].startswith("default-src 'none';")
    assert "http" not in policies[0]
    own = found.text.replace(found.script("plotly"), "")
    assert not re.search(r"url\(|@import|sourceMappingURL|fetch\(|XMLHttpRequest", own)


@pytest.mark.parametrize("case", ["paper-4.1-helical", "paper-4.2"])
def test_data_is_the_json_result(page: Callable[..., Page], cli: Run, case: str) -> None:
    _, out, _ = cli("solve", case, *FEW, "--json", "-")

    def timeless(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: timeless(each) for key, each in value.items() if key != "seconds"}
        return [timeless(each) for each in value] if isinstance(value, list) else value

    assert timeless(page(case).data["result"]) == timeless(json.loads(out))


@pytest.mark.parametrize("case", ["paper-4.1-helical", "hexapod-machining"])
def test_tables_are_the_json_result(page: Callable[..., Page], case: str) -> None:
    found = page(case)
    result = found.data["result"]
    design = {row[0]: row[1] for row in found.tables["design"]}
    numbers = {name: number(design[name].split()[0]) for name in (*result["parameters"], "p_x", "p_y", "p_z", "angle")}
    expected = {**result["parameters"], "angle": result["pose"]["angle"]}
    expected |= dict(zip(("p_x", "p_y", "p_z"), result["pose"]["position"], strict=True))
    assert numbers == pytest.approx(expected, rel=1e-6, abs=1e-9)
    limbs = found.tables["design-limbs"][1:]
    assert [row[0] for row in limbs] == result["limbs"]
    assert [number(row[1]) for row in limbs] == pytest.approx(result["rates"], rel=1e-5)
    assert f"{result['F']:.7g}" in found.words
    active = [row["key"] for row in result["limits"] if row["active"]]
    shown = [row[0] for row in found.tables.get("limit", []) if row[4] == "active"]
    assert shown == active
    for name, version in result["versions"].items():
        assert [name, version] in found.tables["versions"]
    # The lengths beside the view have the digits of the table, and every F on an axis has its unit.
    at = [header.split(",")[0] for header in found.tables["design-limbs"][0]].index("leg length")
    assert [row[1] for row in found.tables["rates"][1:]] == [row[at] for row in limbs]
    labels = {text for text in re.findall(r"<text[^>]*>([^<]*)</text>", found.text) if text.split(",")[0] == "F"}
    labels |= {plane["label"] for planes in found.data["planes"] for plane in planes}
    assert labels == {f"F, ({result['units']['length']}/rad)²"}
    (sides,) = [rows for rows in found.tables.values() if rows[0][-1:] == ["multiplier"]]
    side = dict(zip(*sides[:2], strict=True))
    unit = side["value"].partition(" ")[2]
    assert unit
    # A status of all rows is said once above the table.
    assert side.get("status", "active") == "active"
    assert "status" in side or "In all rows: status: active" in found.words
    assert re.fullmatch(rf"F better by \S+ per {re.escape(unit)} relaxed", side["multiplier"])


def test_rounding_is_no_rate_and_published_numbers_stand_beside_computed_ones(page: Callable[..., Page]) -> None:
    found = page("paper-4.4-snu")
    assert 0 < found.data["result"]["F"] < 1e-20
    assert "F = 0 (mm/rad)², platform" in found.words
    assert [(number(row[3]), row[5]) for row in found.tables["rates"][1:]] == [(0, "none")] * 6
    case = load_case("paper-4.1-helical")
    rows = page("paper-4.1-helical").tables["compared"][1:]
    assert [row[0] for row in rows] == [each.quantity for each in case.published]
    assert [row[3] == "reproduced" for row in rows] == [each.reproduced for each in case.published]
    assert "compared" not in page("hexapod-machining").tables


@pytest.mark.parametrize("case", ["paper-4.1-helical", "hexapod-machining"])
def test_frames_are_the_motion(page: Callable[..., Page], case: str) -> None:
    data = page(case).data
    (view,) = data["views"]
    twist = np.array(data["result"]["task"]["twist"])
    frames = view["frames"]
    assert len(frames) == 41
    assert frames[view["zero"]]["t"] == 0
    assert frames[view["zero"]]["rates"] == data["result"]["rates"]
    at_rest = np.array(frames[view["zero"]]["points"])
    moving = np.array([point["body"] == "platform" for point in view["points"]])
    for frame in frames:
        expected = np.where(moving[:, None], displaced(at_rest, twist, frame["t"]), at_rest)
        np.testing.assert_allclose(frame["points"], expected, atol=1e-9 * view["size"])
        lengths, rates = rates_of_lines(view, expected, twist)
        np.testing.assert_allclose(frame["lengths"], lengths, rtol=1e-9)
        np.testing.assert_allclose(frame["rates"], rates, rtol=1e-8, atol=1e-9)
        assert frame["F"] == pytest.approx(rates @ rates, rel=1e-8)
    # The rate is what the length does: its slope over the slider agrees.
    t = np.array([frame["t"] for frame in frames])
    lengths = np.array([frame["lengths"] for frame in frames])
    slope = (lengths[2:] - lengths[:-2]) / (t[2:] - t[:-2])[:, None]
    inner = [frame["rates"] for frame in frames[1:-1]]
    np.testing.assert_allclose(slope, inner, atol=2e-2 * np.abs(slope).max())


def test_slices_are_f() -> None:
    solution = solve(load_case("hexapod-machining"), starts=4)
    nlp, x = solution.nlp, solution.x
    for each in slices_of(nlp, x):
        assert each.values.min() == nlp.lower[each.variable]
        assert each.values.max() == nlp.upper[each.variable]
        for k in range(0, len(each.values), 17):
            point = np.array(x)
            point[each.variable] = each.values[k]
            F, g = nlp.evaluate(point)
            assert each.F[k] == pytest.approx(F, rel=1e-12)
            size = np.maximum(1, np.abs(np.where(np.isfinite(nlp.g_lower), nlp.g_lower, nlp.g_upper)))
            outside = np.maximum(nlp.g_lower - g, g - nlp.g_upper)
            assert bool(each.inside[k]) == bool(np.all(outside <= 1e-9 * size))
        (here,) = np.nonzero(each.values == x[each.variable])[0]
        assert each.inside[here], "the optimum itself keeps every limit"


def test_slices_keep_unit_vectors() -> None:
    solution = solve(load_case("paper-4.4-max"), starts=4)
    nlp, x = solution.nlp, solution.x
    for each in slices_of(nlp, x)[:3]:
        others = [k for k in range(3) if k != each.variable]
        for k in range(0, len(each.values), 29):
            point = np.array(x)
            point[each.variable] = each.values[k]
            point[others] *= np.sqrt(max(0, 1 - each.values[k] ** 2)) / np.linalg.norm(x[others])
            assert each.F[k] == pytest.approx(nlp.evaluate(point)[0], rel=1e-9)


def test_a_page_shows_curves_where_slices_would_show_little(page: Callable[..., Page]) -> None:
    text = page("hexapod-machining").text
    for key in ("footprint platform", "footprint base", "minimum leg length"):
        assert f"<caption>Values: {key} from " in text
    assert "no point of it keeps every limit" not in text
    assert "the only one of its points within them" not in text
    # Around this point there is room.
    assert "<caption>Values: " not in page("paper-4.1-helical").text


def test_planes_are_f() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    planes = planes_of(nlp, nlp.start, 5)
    assert [plane.variables for plane in planes] == [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5)]
    plane = planes[1]
    for row, column in ((0, 0), (7, 30), (40, 3)):
        point = np.array(nlp.start)
        point[[0, 2]] = plane.first[column], plane.second[row]
        assert plane.F[row, column] == pytest.approx(nlp.evaluate(point)[0], rel=1e-12)


def test_whatever_a_case_says_stays_text(tmp_path: Path) -> None:
    title, task = "<script>alert(1)</script>&amp;", "</script><img src=x onerror=alert(2)>$title"
    text = edited(
        IMPOSSIBLE,
        ('"Legs of half a metre on a small robot"', f'"{title}" # --> <b>]]>'),
        ("sense =", f'name = "{task}"\nsense ='),
        ("min = 500", "min = 5"),
        ('"cm"', '"<i>cm"'),
    )
    case = saved(tmp_path / "evil.toml", text)
    assert made(str(case), tmp_path / "evil.html") == (0, "")
    found = Page((tmp_path / "evil.html").read_text(encoding="utf-8"))
    assert [attributes.get("id") for attributes, _ in found.scripts] == ["data", "plotly", None]
    assert [a["id"] for tag, a in found.elements if tag in {"img", "b", "i"} and "id" in a] == ["view-copy"]
    assert len([a for tag, a in found.elements if tag in {"img", "b", "i"} and a]) == 2
    assert "<" not in found.script("data")
    assert found.data["result"]["title"] == title
    assert found.data["result"]["task"]["name"] == task
    assert found.titles == f"{title} - screwsynth"
    assert task in found.words
    assert text in found.words


def test_what_failed_is_no_answer(tmp_path: Path) -> None:
    case = saved(tmp_path / "impossible.toml", IMPOSSIBLE)
    assert made(str(case), tmp_path / "page.html") == (1, "")
    found = Page((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert found.data["result"]["F"] is None
    assert_words(found.words, "infeasible: this is not an optimum", "would be feasible with")
    assert "largest F =" not in found.words
    assert found.tables["design"][0][1] == "reached"
    # What a solver leaves as multipliers of a failed search is no cost.
    assert ["", "bound", "value", "status"] in [rows[0] for rows in found.tables.values()]
    assert "multiplier" not in found.words
    assert {"class": "answer none", "id": "answer"} in [a for _, a in found.elements]


def sliding(*shifts: float) -> Case:
    """A vertical leg whose foot slides on x, where a loop keeps it below the platform."""
    q, pose = SX.sym("q"), PoseSymbols()
    foot, head = ca.vertcat(q, 0, 0), pose.position
    points = Point("F", foot, Body.LIMB), Point("H", head, Body.PLATFORM)
    wrenches, loop = (force_along("1", foot, head - foot),), (Closure("loop", q - head[0]),)
    unknowns = (Unknown("q", q, Dimension.LENGTH, "place of the foot", -10.0, 10.0),)
    scene = Scene(points, (Link("F", "H", Body.LIMB, limb="1"),))
    given = {"unknowns": unknowns, "closure": loop, "scene": scene}
    model = Model("sliding", "one leg and a loop", (), pose, (0.0, 0.0, 1.0), wrenches, **given)
    task = Task([0, 0, 0, 0.6, 0, 0.8])
    steps = tuple(Displacement.by(np.eye(3), np.array([shift, 0.0, 0.0])) for shift in shifts)
    return Case(model=model, parameters={}, position=[1, 0, 2], tasks=[task], displacements=steps)


def test_robots_with_loops_follow() -> None:
    for shifts in ((0.0,), (0.0, 1.0)):
        solution = solve(sliding(*shifts), starts=2)
        report = report_of("", solution, result_of(solution))
        for frame in report.parts[0].views[0]["frames"]:
            foot, head = np.array(frame["points"])
            np.testing.assert_allclose(head, [1 + 0.6 * frame["t"], 0, 2 + 0.8 * frame["t"]], atol=1e-9)
            np.testing.assert_allclose(foot, [head[0], 0, 0], atol=1e-9)
            assert frame["rates"] == pytest.approx([0.8])
        text = page_of(report)
        assert "without opening the loops of the robot" in text
        Page(text)


def test_certificate_and_a_drawing_without_a_script(page: Callable[..., Page]) -> None:
    found = page("paper-4.1-rotation", "--certify")
    certificate = found.data["result"]["certificate"]
    assert certificate["status"] == "proved"
    assert certificate["statement"] in found.words
    assert f"{certificate['bound']:.7g}" in found.words
    stills = [a for tag, a in page("paper-4.1-helical").elements if tag == "img" and "still" in str(a.get("class"))]
    assert [a["class"] for a in stills] == ["still chosen"]
    drawn = b64decode(str(stills[0]["src"]).removeprefix("data:image/svg+xml;base64,")).decode("utf-8")
    assert drawn.startswith("<?xml")
    assert "limb 1-" in drawn


def points_of(path: str) -> list[list[tuple[float, float]]]:
    """The pieces of a path of lines."""
    pieces = [re.findall(r"(-?[\d.]+) (-?[\d.]+)", piece) for piece in path.split("M")[1:]]
    return [[(float(x), float(y)) for x, y in piece] for piece in pieces]


def test_charts_put_points_where_they_belong() -> None:
    x, y = [0.0, 1.0, 2.0, 3.0, 4.0], [5.0, 7.0, float("nan"), 1.0, 3.0]
    drawn = str(line_chart([Curve(x, y, "curve")], [Spot(1, 7, "spot", "it")], words="w", labels=("a<b", "F")))
    assert "a&lt;b" in drawn
    (path,) = re.findall(r'd="([^"]*)" class="curve"', drawn)
    first, second = points_of(path)
    assert (len(first), len(second)) == (2, 2)
    places = np.array([*first, *second])
    values = np.array([[a, b] for a, b in zip(x, y, strict=True) if np.isfinite(b)])
    for k, sign in ((0, 1), (1, -1)):
        slope, offset = np.polyfit(values[:, k], places[:, k], 1)
        assert sign * slope > 0
        np.testing.assert_allclose(slope * values[:, k] + offset, places[:, k], atol=0.1)
    (spot,) = re.findall(r'class="spot" cx="([\d.]+)" cy="([\d.]+)"', drawn)
    assert tuple(map(float, spot)) == first[1]


def test_bound_against_time() -> None:
    history = [[0.5, 12.0, 9.0], [1.0, 11.0, 10.0], [2.0, 10.1, 10.0]]
    chart, words = (str(part) for part in sections.bound_chart(history)[0].split("<figcaption>"))
    bound, best = (points_of(path)[0] for path in re.findall(r'd="([^"]*)" class="curve(?: best)?"', chart))
    # Level up to each point, then down: a bound holds until a better one is there.
    assert [x for x, _ in bound] == [x for x, _ in best]
    assert [y for _, y in bound] == sorted(y for _, y in bound)
    assert bound[0][1] == bound[1][1] < bound[2][1] == bound[3][1]
    assert bound[-1][1] < best[-1][1], "the bound stays above the best point"
    assert "Bound: 12 after 0.5 s, 10.1 after 2 s." in words


def test_structure_is_accessible(page: Callable[..., Page]) -> None:
    for case in CASES:
        found = page(case)
        tags = [tag for tag, _ in found.elements]
        assert [tags.count(name) for name in ("html", "header", "nav", "main", "footer", "h1")] == [1] * 6
        levels = [int(tag[1]) for tag in tags if re.fullmatch(r"h\d", tag)]
        assert levels[0] == 1
        assert all(after <= before + 1 for before, after in pairwise(levels))
        ids = [a["id"] for _, a in found.elements if "id" in a]
        assert len(ids) == len(set(ids))
        for tag, attributes in found.elements:
            for name in ("for", "aria-labelledby"):
                assert attributes.get(name) is None or attributes[name] in ids
            if tag == "a":
                assert (attributes["href"] or "")[1:] in ids
            if attributes.get("role") == "img":
                assert attributes["aria-label"]
            if tag in {"select", "input"}:
                assert attributes["id"] in [a.get("for") for t, a in found.elements if t == "label"]
        assert tags.count("figure") == tags.count("figcaption")
        first = next(a for tag, a in found.elements if tag == "a")
        assert (first["class"], first["href"]) == ("skip", "#main")


def test_contrast() -> None:
    style = (Path(__file__).parents[2] / "nlp" / "output" / "report" / "page" / "style.css").read_text(encoding="utf-8")
    light_scheme, dark_scheme = style.split("@media screen and (prefers-color-scheme: dark)")[:2]

    def light(colour: str) -> float:
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return float(np.dot([0.2126, 0.7152, 0.0722], linear))

    for scheme in (light_scheme, dark_scheme.split("}")[0]):
        colours = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", scheme))
        for name in ("ink", "muted", "blue", "bad", "edge", "good"):
            for ground in ("back", "pale"):
                pair = sorted([light(colours[name]) + 0.05, light(colours[ground]) + 0.05])
                assert pair[1] / pair[0] >= 4.5, (name, ground)


def test_colours_are_those_of_picture_files() -> None:
    drawn = rate_colour_map().resampled(len(RATE_COLOURS))
    assert [to_hex(drawn(k)) for k in range(len(RATE_COLOURS))] == list(RATE_COLOURS)


def test_plotly_and_the_output_are_checked_first(cli: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("screwsynth.nlp.output.pictures.requirements.find_spec", lambda _: None)
    refusal_of(cli("report", "paper-4.2", "--out", str(tmp_path / "page.html")), "reports need plotly")
    assert not list(tmp_path.iterdir())
    monkeypatch.undo()
    monkeypatch.setattr(solve_module, "solve", lambda *_, **__: pytest.fail("it was solved"))
    refusal_of(cli("report", "paper-4.1-helical", "--out", str(tmp_path / "none" / "page.html")), "none")


@pytest.mark.parametrize("sense", ["max", "min"])
def test_page_has_every_pose_and_marks_the_worst(sense: str, three_poses: Callable[[str], str]) -> None:
    solution, text = posed(three_poses(sense))
    values, found = [evaluate(solution.nlp, solution.x, k).F for k in range(3)], Page(text)
    views = found.data["views"]
    worst = values.index(min(values) if sense == "max" else max(values))
    assert [view["pose"] for view in views] == [0, 1, 2]
    assert [view["is_worst"] for view in views] == [k == worst for k in range(3)]
    for view, value, at in zip(views, values, [[0, 0, 30], [6, 0, 33], [0, 5, 24]], strict=True):
        frame = view["frames"][view["zero"]]
        np.testing.assert_allclose(frame["position"], at, atol=1e-12)
        assert frame["F"] == pytest.approx(value, rel=1e-9)
    unit = f"({found.data['result']['units']['length']}/rad)²"
    assert f"Worst pose: pose {worst + 1} of 3, F = {values[worst]:.7g} {unit}." in found.words
    (slider,) = [a for tag, a in found.elements if tag == "input" and a.get("id") == "pose"]
    assert (slider["min"], slider["max"], slider["value"]) == ("1", "3", "1")


def test_a_page_with_a_refused_certificate(tmp_path: Path, cli: Run, page: Callable[..., Page]) -> None:
    refused = tmp_path / "page.html"
    # A power that no rule covers stands in for any limit that a proof cannot treat.
    text = find_case("paper-4.1-helical").read_text(encoding="utf-8")
    path = saved(tmp_path / "case.toml", edited(text, ("[[task]]", '[limits]\ncustom = ["p_z^0.3 >= 1"]\n[[task]]')))
    code, out, err = cli("report", str(path), "--certify", "--starts", "2", "--out", str(refused))
    assert (code, err) == (1, "")
    assert "limits.custom[0]" in out
    shown = refused.read_text(encoding="utf-8")
    assert re.search(r"No certificate: no bound can be proved: [^<]*limits\.custom\[0\]", shown)
    assert "407.2107" in shown
    assert "Refused" not in page("paper-4.1-helical").text, "who asks for no proof is refused none"
