"""Live views in reports and in pages of tool paths, and the motion of tasks, in a real browser."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, assert_words, saved
from measures import exponential

from screwsynth.nlp import load_case, report, solve
from screwsynth.nlp.case.pose import Rotation
from screwsynth.nlp.evidence.evaluation import starting_point
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.view.wasm import find_compiler

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(find_compiler() is None, reason="no compiler for WebAssembly is installed"),
]
#: Runs a statement, and ends two frames later.
ACT = """
const done = arguments[arguments.length - 1];
{};
requestAnimationFrame(() => requestAnimationFrame(() => done(true)));"""
IN_VIEW = "const root = (document.getElementById('live') ?? { shadowRoot: document }).shadowRoot;"
READY = """
const done = arguments[0];
const isReady = () => (document.getElementById("live") ?? document.documentElement).dataset.ready === "yes";
const look = () => (isReady() ? done(true) : setTimeout(look, 20));
look();"""
#: Moves the slider of the path to a value, and the first slider of the view.
TRAVEL = """
const slider = document.getElementById("travel");
slider.value = arguments[0];
slider.dispatchEvent(new Event("input"));"""
MOVE = """
const range = root.getElementById("slider-0");
range.value = arguments[0];
range.dispatchEvent(new Event("input"));"""
#: Waits until the platform has left a position.
MOVED = """
const [from, done] = arguments;
const look = () => {
  const { blocks } = screwsynth.state.data, { view } = screwsynth.state.module.arrays;
  return from.some((each, k) => view[blocks.position[0] + k] !== each) ? done(true) : setTimeout(look, 20);
};
look();"""
#: Position and rotation of the platform, and F.
POSE = """
const { state, player } = screwsynth, { blocks } = state.data, { view, F } = state.module.arrays;
const part = (name) => [...view.slice(blocks[name][0], blocks[name][0] + blocks[name][1])];
return [part("position"), part("rotation"), F[0], part("points")];"""


@pytest.fixture
def opened(browser: Any) -> Iterator[Callable[..., Any]]:  # noqa: ANN401 - the driver may be missing
    """A page with a live view, opened from disk."""

    def open_page(page: Path, width: int = 1000) -> Any:  # noqa: ANN401
        browser.get("about:blank")
        browser.get_log("browser")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.get(page.as_uri())
        browser.execute_async_script(READY)
        return browser

    yield open_page
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def faults(chrome: Any) -> list[Any]:  # noqa: ANN401
    return [each for each in chrome.get_log("browser") if each["level"] == "SEVERE"]


def act(chrome: Any, statement: str, *values: object) -> None:  # noqa: ANN401
    chrome.execute_async_script(ACT.replace("{}", IN_VIEW + statement), *values)


def words(chrome: Any, key: str) -> str:  # noqa: ANN401
    return str(chrome.execute_script(f"{IN_VIEW} return root.getElementById(arguments[0]).textContent", key))


def fits(chrome: Any, width: int) -> bool:  # noqa: ANN401
    return bool(chrome.execute_script("return document.documentElement.scrollWidth <= arguments[0]", width))


def test_the_first_screen_of_a_report_is_live(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    assert cli("report", "paper-4.1-helical", "--out", str(page), "--starts", "4")[0] == 0
    answer = solve(load_case("paper-4.1-helical")).outcomes[0]
    for width in (420, 1000, 1400):
        chrome = opened(page, width)
        assert fits(chrome, width)
        top, tall = chrome.execute_script(
            f"{IN_VIEW} const box = root.getElementById('robot').getBoundingClientRect(); return [box.top, box.height]"
        )
        assert top + tall / 2 < 900
        assert_words(words(chrome, "F"), f"F = {answer.F:.7g}")
        assert words(chrome, "word") == "optimal"
        assert chrome.execute_script("return document.querySelectorAll('#view').length") == 0
        assert faults(chrome) == []
    # A moved slider is solved in the page: the value is that of the program with the same value held.
    name, low, high = chrome.execute_script(
        "const { state } = screwsynth; return [state.sliders[0].name, ...state.ends(state.sliders[0])]"
    )
    value = 0.4 * low + 0.6 * high
    act(chrome, MOVE, str(value))
    shown = chrome.execute_script("return screwsynth.state.read(screwsynth.state.sliders[0])")
    own = solve(load_case("paper-4.1-helical", {name: shown})).outcomes[0]
    assert chrome.execute_script(POSE)[2] == pytest.approx(own.F, rel=1e-6)
    assert words(chrome, "word") == "local optimum"
    # Evaluation agrees with that of the program at the same point.
    act(chrome, "root.getElementById('mode-evaluate').click();")
    act(chrome, "root.getElementById('copy-set').click();")
    text = chrome.execute_script(f"{IN_VIEW} return root.getElementById('copied-text').value")
    settings = dict(each.split("=") for each in re.findall(r"--set '?([^' ]+)'?", text))
    numbers = {key: [*map(float, each.split(","))] for key, each in settings.items()}
    nlp = formulate(load_case("paper-4.1-helical", {k: v[0] if len(v) == 1 else v for k, v in numbers.items()}))
    assert chrome.execute_script(POSE)[2] == pytest.approx(evaluate(nlp, starting_point(nlp)).F, rel=1e-9)
    assert faults(chrome) == []


@pytest.fixture(scope="module")
def live_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report whose first screen is the live view."""
    page = tmp_path_factory.mktemp("report") / "report.html"
    page.write_text(report(solve(load_case("paper-4.1-helical"), starts=2)), encoding="utf-8")
    return page


@pytest.mark.parametrize("width", [420, 1400])
def test_a_picture_and_the_dimensions_stand_there_without_a_script(
    browser: Any,  # noqa: ANN401
    live_report: Path,
    width: int,
) -> None:
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        browser.get("about:blank")
        browser.get(live_report.as_uri())
        # The driver's own scripts are not those of the page, and run.
        image = browser.find_element("css selector", "#live img")
        assert image.is_displayed()
        assert image.rect["y"] + image.rect["height"] / 2 < 900
        assert image.rect["width"] > 0.9 * min(width, 700) - 40
        rows = browser.find_elements("css selector", "#live tbody tr")
        assert {"x1", "x2", "p_z"} <= {each.text.split()[0] for each in rows}
        (note,) = browser.find_elements("css selector", "#live noscript p")
        assert "need JavaScript" in note.text
        assert browser.find_element("id", "answer").is_displayed()
        assert fits(browser, width)
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_started_view_replaces_the_picture_and_follows_the_colour_scheme(
    opened: Callable[..., Any], live_report: Path
) -> None:
    chrome = opened(live_report)
    assert not chrome.find_element("css selector", "#live img").is_displayed()
    assert not chrome.find_element("id", "answer").is_displayed()
    # Robot, headline and the first slider are on the first screen.
    places = chrome.execute_script(
        f"{IN_VIEW} return ['robot', 'answer', 'slider-0']"
        ".map((id) => root.getElementById(id).getBoundingClientRect().top)"
    )
    assert max(places) < 900
    back = "return getComputedStyle(document.getElementById('live')).getPropertyValue('--back').trim()"
    shades = {}
    for scheme in ("light", "dark"):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        chrome.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        shades[scheme] = chrome.execute_script(back)
        # The canvas is drawn again in the colours of the scheme: its corner has no robot.
        corner = chrome.execute_script(
            f"{IN_VIEW} const canvas = root.getElementById('robot'); return getComputedStyle(canvas).backgroundColor"
        )
        assert (sum(map(int, re.findall(r"\d+", corner)[:3])) < 200) is (scheme == "dark")
    chrome.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert shades["light"] == "#ffffff"
    assert shades["dark"] != shades["light"]
    assert faults(chrome) == []


PROGRAM = "G21 G90\nG0 X0 Y0 Z20\nG0 X1\nG1 X2 Y1 F600\nG1 X0 Y1\nM2\n"


def test_bars_of_lengths_begin_at_their_range_and_rapid_moves_have_no_time(
    opened: Callable[..., Any], cli: Run, tmp_path: Path
) -> None:
    case = Path(__file__).parents[2] / "cases" / "hexapod-pocket.toml"
    own = saved(tmp_path / "milling.toml", case.read_text(encoding="utf-8").split("[path]")[0])
    part, page = saved(tmp_path / "part.ngc", PROGRAM), tmp_path / "path.html"
    code, _, errors = cli("path", str(own), "--along", str(part), "--html", str(page), "--time", "1")
    assert (code in (0, 1), errors) == (True, "")
    chrome = opened(page)
    data = chrome.execute_script("return screwsynth.track.data")
    panels = {each["title"]: each for each in data["panels"]}
    lengths, speeds = panels["leg lengths"], panels["speeds along the path"]
    values = [value for each in lengths["curves"] for value in each["values"]]
    assert lengths["base"] == lengths["low"] < min([*values, *lengths["limits"]])
    assert lengths["high"] > max([*values, *lengths["limits"]])
    assert (speeds["base"], speeds["low"]) == (0, -speeds["high"])
    read = (
        f"{IN_VIEW} return [...root.querySelectorAll('#track .panel')].map((panel) => ["
        "panel.querySelector('h2').textContent,"
        " [...panel.querySelectorAll('.drive')].map((each) => [each.querySelector('output').textContent,"
        " parseFloat(each.querySelector('i').style.left), parseFloat(each.querySelector('i').style.width),"
        " [...each.querySelectorAll('b')].map((mark) => parseFloat(mark.style.left))])])"
    )
    timed = {frame["has_time"] for frame in data["frames"]}
    assert timed == {True, False}
    for index in (0, len(data["frames"]) - 1):
        chrome.execute_script(TRAVEL, index)
        act(chrome, "")
        shown = {title.split(",")[0]: rows for title, rows in chrome.execute_script(read)}
        for row, curve in zip(shown["leg lengths"], lengths["curves"], strict=True):
            _, left, width, marks = row
            part_of = (curve["values"][index] - lengths["low"]) / (lengths["high"] - lengths["low"])
            assert (left, width) == (0, pytest.approx(100 * part_of, abs=0.02))
            # Both limits are within the bar's track.
            assert len(marks) == len(lengths["limits"])
            assert all(0 < mark < 100 for mark in marks)
        texts = {text for text, *_ in shown["speeds along the path"]}
        assert (texts == {"no time"}) is (not data["frames"][index]["has_time"])
    assert faults(chrome) == []


def test_a_report_without_maps_has_no_plotly(cli: Run, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    assert cli("report", "reachy-mini", "--out", str(page), "--starts", "4")[0] in (0, 1)
    text = page.read_text(encoding="utf-8")
    # The library of maps is larger than the whole page.
    assert len(text) < 1_900_000
    assert '<script type="text/plain" id="plotly"></script>' in text


@pytest.mark.parametrize("command", ["view", pytest.param("report", marks=pytest.mark.soak)])
def test_the_motion_of_a_task_is_its_screw_motion(
    opened: Callable[..., Any], cli: Run, tmp_path: Path, command: str
) -> None:
    page, case = tmp_path / "page.html", "hexapod-machining"
    more = ["--no-open"] if command == "view" else []
    assert cli(command, case, "--out", str(page), "--starts", "4", *more)[0] == 0
    chrome = opened(page)
    position, rotation, F, _ = chrome.execute_script(POSE)
    twist = chrome.execute_script("return screwsynth.player.twist(0)")
    assert np.allclose(twist, load_case(case).tasks[0].twist, rtol=1e-12)
    assert (
        chrome.execute_script(f"{IN_VIEW} return root.querySelector('.play').getAttribute('aria-pressed')") == "false"
    )
    chrome.execute_script("screwsynth.player.task = 0; screwsynth.player.measure()")
    back, forth = chrome.execute_script("return screwsynth.player.ends")
    assert back < 0 < forth
    for t in (back, 0.37 * forth, forth):
        assert chrome.execute_script("return screwsynth.player.place(arguments[0])", t)
        now, turned, *_ = chrome.execute_script(POSE)
        E = exponential(np.array(twist), t)
        assert np.allclose(now, E[:3, :3] @ position + E[:3, 3], rtol=1e-11, atol=1e-11)
        assert np.allclose(np.reshape(turned, (3, 3)), E[:3, :3] @ np.reshape(rotation, (3, 3)), atol=1e-11)
    chrome.execute_script("screwsynth.player.stop(); screwsynth.show()")
    # By hand: the robot moves, and a second press returns it.
    act(chrome, "root.querySelector('.play').click();")
    chrome.execute_async_script(MOVED, position)
    act(chrome, "root.querySelector('.play').click();")
    assert chrome.execute_script(POSE)[:3] == [position, rotation, F]
    assert words(chrome, "word") == "optimal"
    assert faults(chrome) == []


def test_recorded_positions_follow_the_motion(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert cli("view", "paper-4.2-rotation", "--out", str(page), "--no-open", "--starts", "4")[0] == 0
    chrome = opened(page)
    if chrome.execute_script("return screwsynth.player.canFollow(0)"):
        pytest.skip("the module follows")
    *_, points = chrome.execute_script(POSE)
    chrome.execute_script("screwsynth.player.task = 0; screwsynth.player.show(1)")
    data = chrome.execute_script("return [screwsynth.state.data.blocks, screwsynth.player.view]")
    first, size = data[0]["points"]
    moved = np.reshape(data[1][first : first + size], (-1, 3))
    before = np.reshape(points, (-1, 3))
    changed = ~np.isclose(moved, before, atol=1e-5).all(axis=1)
    assert changed.any()
    # The points of the platform keep their distances.
    apart = [np.linalg.norm(each[changed][:, None] - each[changed][None], axis=2) for each in (before, moved)]
    assert np.allclose(*apart, atol=1e-5)


def test_a_slider_runs_along_a_path(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    part = saved(tmp_path / "part.csv", "t,x,y,z,roll,pitch,yaw\n0,0,0,20,0,0,0\n2,2,0,20.5,4,0,0\n3,2,1,21,-5,0,0\n")
    page = tmp_path / "path.html"
    case = Path(__file__).parents[2] / "cases" / "hexapod-pocket.toml"
    text = case.read_text(encoding="utf-8").split("[path]")[0]
    own = saved(tmp_path / "milling.toml", text)
    code, _, errors = cli("path", str(own), "--along", str(part), "--html", str(page), "--time", "1")
    assert (code in (0, 1), errors) == (True, "")
    assert len(page.read_bytes()) < 1_500_000
    for width in (420, 1000, 1400):
        chrome = opened(page, width)
        assert fits(chrome, width)
        assert faults(chrome) == []
    data = chrome.execute_script("return screwsynth.track.data")
    for index in (0, len(data["frames"]) // 2, len(data["frames"]) - 1):
        frame = data["frames"][index]
        chrome.execute_script(TRAVEL, index)
        act(chrome, "")
        position, rotation, *_ = chrome.execute_script(POSE)
        t = frame["at"]
        x, y, z, roll = (np.interp(t, [0, 2, 3], each) for each in ([0, 2, 2], [0, 0, 1], [20, 20.5, 21], [0, 4, -5]))
        assert np.allclose(position, [x, y, z], rtol=1e-9, atol=1e-9)
        E = exponential(np.array([1.0, 0, 0, 0, 0, 0]), np.radians(roll))
        assert np.allclose(np.reshape(rotation, (3, 3)), E[:3, :3], atol=1e-9)
        # The module's forces are those of the program's curves.
        panel = next(each for each in data["panels"] if each["title"].startswith("forces"))
        largest, smallest = chrome.execute_script(
            "const { state } = screwsynth, { view } = state.module.arrays;"
            " return ['largest', 'smallest'].map((name) => {"
            " const [first] = state.data.blocks[name];"
            " const k = state.data.loads.findIndex((each) => arguments[0].includes(each));"
            " return [...view.slice(first + 6 * k, first + 6 * k + 6)]; })",
            panel["title"],
        )
        values = [each["values"][index] for each in panel["curves"]]
        assert np.allclose(values, [*largest, *smallest][: len(values)], rtol=1e-9)
        assert chrome.find_element("id", "travelled").text == frame["words"]
        moved, ends = chrome.execute_script(
            "const at = document.querySelector('.cursor'); return [at.getAttribute('transform'), {...at.dataset}]"
        )
        share = (t - float(ends["low"])) / (float(ends["high"]) - float(ends["low"]))
        expected = float(ends["left"]) + share * float(ends["width"])
        assert float(re.findall(r"translate\(([\d.]+) 0\)", moved)[0]) == pytest.approx(expected, abs=0.01)
    # A changed dimension is evaluated at the pose of the path, and the recorded bars are hidden.
    act(chrome, MOVE, 30)
    last = data["frames"][-1]
    posed = replace(
        load_case(str(own), {"x1": 30.0}),
        position=last["values"][:3],
        rotation=Rotation.from_rpy(np.radians(-5), 0, 0),
    )
    nlp = formulate(posed)
    position, _, F, _ = chrome.execute_script(POSE)
    assert position == pytest.approx(last["values"][:3], rel=1e-12)
    assert pytest.approx(evaluate(nlp, starting_point(nlp)).F, rel=1e-9) == F
    assert chrome.execute_script(f"{IN_VIEW} return root.querySelector('#track .panel').hidden") is True
    act(chrome, "root.getElementById('case-dimensions').click();")
    assert chrome.execute_script(f"{IN_VIEW} return root.querySelector('#track .panel').hidden") is False
    # The robot runs from the beginning, until the button is pressed again.
    chrome.execute_script(TRAVEL, 0)
    act(chrome, "")
    act(chrome, "document.getElementById('play').click();")
    chrome.execute_script("return new Promise((done) => setTimeout(() => done(true), 1200))")
    assert chrome.execute_script("return screwsynth.track.index") > 0
    act(chrome, "document.getElementById('play').click();")
    assert chrome.find_element("id", "play").text == "Play"
    assert faults(chrome) == []


HOSTILE = "</script><img src=x onerror=alert(1)>\\u2028'\\\"`${1}"


@pytest.mark.parametrize("command", ["report", "path"])
def test_texts_of_a_case_stay_texts(opened: Callable[..., Any], cli: Run, tmp_path: Path, command: str) -> None:
    source = Path(__file__).parents[2] / "cases" / "hexapod-pocket.toml"
    text = source.read_text(encoding="utf-8").split("[path]")[0]
    text = re.sub(r"^title = .*$", lambda _: f'title = "{HOSTILE}"', text, flags=re.MULTILINE)
    text = text.replace('name = "plunge"', f'name = "{HOSTILE}"').replace('name = "cutting"', f'name = "{HOSTILE}2"')
    case, page = saved(tmp_path / "hostile.toml", text), tmp_path / "page.html"
    part = saved(tmp_path / "part.csv", "t,x,y,z\n0,0,0,20\n2,1,0,20.5\n")
    options = (
        ["--out", str(page)] if command == "report" else ["--along", str(part), "--html", str(page), "--time", "1"]
    )
    code, _, errors = cli(command, str(case), *options)
    assert (code in (0, 1), errors) == (True, "")
    chrome = opened(page)
    assert chrome.execute_script("return document.querySelectorAll('img[src=x]').length") == 0
    assert chrome.execute_script(f"{IN_VIEW} return root.querySelectorAll('img[src=x]').length") == 0
    assert chrome.title.startswith("</script><img src=x onerror=alert(1)>")
    assert_words(chrome.execute_script(f"{IN_VIEW} return root.getElementById('colour').textContent"), "</script>")
    assert json.loads(chrome.execute_script("return JSON.stringify(screwsynth.state.data.tasks[0].name)")).startswith(
        "</script>"
    )
    assert faults(chrome) == []
