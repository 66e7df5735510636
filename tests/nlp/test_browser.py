"""Pages in a real browser: they load clean, move, and fit a narrow screen."""

import json
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, assert_words, saved, soaked
from pages import Page, displaced, number, posed, rates_of_lines


@pytest.fixture
def opened(browser: Any, page_file: Callable[..., Path]) -> Iterator[Callable[..., Any]]:
    """A page opened from disk in the window's own width or another one, its picture drawn."""

    def open_page(page: str | Path, width: int | None = None) -> Any:
        browser.get("about:blank")
        for log in ("browser", "performance"):
            browser.get_log(log)
        if width is not None:
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size_of_window(width))
        browser.get((page_file(page) if isinstance(page, str) else page).as_uri())
        until(lambda: browser.execute_script("return document.documentElement.dataset.drawn === 'yes'"))
        return browser

    yield open_page
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def size_of_window(width: int) -> dict[str, Any]:
    return {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}


def until(done: Callable[[], Any]) -> Any:
    """What is asked for again and again, for as long as no machine takes that works."""
    seconds = 600
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if value := done():
            return value
        time.sleep(0.05)
    pytest.fail(f"not within {seconds} s")


LIMBS = """
return document.getElementById("view").data.filter((each) => each.name.startsWith("limb "))
  .map((each) => ({ name: each.name, x: each.x, y: each.y, z: each.z, text: each.hovertext[0] }))"""


ROWS = """
return [...document.querySelectorAll("#rates tbody tr")].map((row) => [row.querySelector("th").textContent,
  ...["length", "rate", "share"].map((name) => row.querySelector("." + name).textContent)])"""


#: Ends when what was asked for before is drawn.
FRAMES = "requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(arguments[0])))"


MOVE = """
const slider = document.getElementById("travel");
slider.value = arguments[0];
slider.dispatchEvent(new Event("input"));"""


CHOOSE = """
const list = document.getElementById(arguments[0]);
list.value = arguments[1];
list.dispatchEvent(new Event("change"));"""


def check_clean(chrome: Any) -> None:
    """Check that a page that was just opened has no fault, asks no network, paints, and fits a telephone."""
    painted = "const paint = performance.getEntriesByName('first-contentful-paint'); return paint.length && paint[0]"
    assert until(lambda: chrome.execute_script(f"{painted}.startTime")) > 0
    chrome.execute_async_script(FRAMES)
    assert [entry for entry in chrome.get_log("browser") if entry["level"] == "SEVERE"] == []
    events = [json.loads(entry["message"])["message"] for entry in chrome.get_log("performance")]
    asked = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
    assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [chrome.current_url]
    assert chrome.execute_script("return document.querySelectorAll('#view canvas').length") > 0
    # Nothing is wider than the page, also on a telephone.
    chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size_of_window(400))
    assert until(lambda: chrome.execute_script("return innerWidth === 400"))
    assert until(lambda: chrome.execute_script("return document.documentElement.scrollWidth <= 400"))
    chrome.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.browser
def test_page_of_another_robot_loads_clean(opened: Callable[..., Any]) -> None:
    check_clean(opened("paper-4.4-max"))


@pytest.mark.browser
@pytest.mark.parametrize("case", soaked(["paper-4.1-helical", "hexapod-machining"], ["hexapod-machining"]))
def test_a_page_loads_clean_and_moves(opened: Callable[..., Any], page: Callable[..., Page], case: str) -> None:
    chrome, data = opened(case), page(case).data
    check_clean(chrome)
    check_view(chrome)
    (view,) = data["views"]
    twist = np.array(data["result"]["task"]["twist"])
    at_rest = np.array(view["frames"][view["zero"]]["points"])
    moving = np.array([point["body"] == "platform" for point in view["points"]])
    start = chrome.execute_script(LIMBS)
    assert [number(row[2]) for row in chrome.execute_script(ROWS)] == pytest.approx(data["result"]["rates"], rel=1e-5)
    for index in (0, 33):
        points = np.where(moving[:, None], displaced(at_rest, twist, view["frames"][index]["t"]), at_rest)
        lengths, rates = rates_of_lines(view, points, twist)
        before = chrome.execute_script(LIMBS)
        chrome.execute_script(MOVE, index)
        limbs = until(lambda before=before: (now := chrome.execute_script(LIMBS)) != before and now)
        assert limbs != start
        for limb in limbs:
            ends = next(link["ends"] for link in view["links"] if f"limb {link['limb']}" == limb["name"])
            drawn = np.array([limb["x"][:13], limb["y"][:13], limb["z"][:13]]).T
            np.testing.assert_allclose(drawn[[0, 12]], points[ends], atol=1e-9 * view["size"])
        rows = chrome.execute_script(ROWS)
        assert [row[0] for row in rows] == [row["limb"] for row in view["rows"]]
        # Lengths have the five digits of the table.
        assert [number(row[1]) for row in rows] == [float(f"{length:.5g}") for length in lengths]
        np.testing.assert_allclose([number(row[2]) for row in rows], rates, rtol=1e-5)
        np.testing.assert_allclose([number(row[3]) for row in rows], 100 * rates**2 / (rates @ rates), atol=0.051)
        for limb, rate, length in zip(limbs, rates, lengths, strict=True):
            found = re.findall(r"length (\S+) .*rate (\S+) ", limb["text"].replace("\N{MINUS SIGN}", "-"))
            assert [float(each) for each in found[0]] == pytest.approx([float(f"{length:.5g}"), rate], rel=1e-5)


def check_hints(chrome: Any) -> None:
    """Check that the tables that are wider than a narrow window say that they scroll, and no others."""
    hint = (
        "return [...document.querySelectorAll('.scroll')].filter((each) => each.checkVisibility()).map((each) =>"
        " [each.scrollWidth > each.clientWidth + 1, getComputedStyle(each, '::before').content.includes('Scroll')])"
    )
    rows = until(lambda: (all_ := chrome.execute_script(hint)) and all(a == b for a, b in all_) and all_)
    assert any(wide for wide, _ in rows)


FRAME = """
const view = document.getElementById("view"), box = view.getBoundingClientRect(), scene = view._fullLayout.scene._scene;
const annotations = view.layout.scene.annotations.map((each) => each.text);
const params = scene.glplot.cameraParams;
const multiply = (m, v) => [0, 1, 2, 3].map((r) => v.reduce((sum, each, k) => sum + m[r + 4 * k] * each, 0));
const sides = ["xaxis", "yaxis", "zaxis"].map((name) => view._fullLayout.scene[name].range), scale = scene.dataScale;
const places = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => {
  const corner = [...sides.map((side, k) => side[(n >> k) & 1] * scale[k]), 1];
  const clip = multiply(params.projection, multiply(params.view, multiply(params.model, corner)));
  return [clip[0] / clip[3], clip[1] / clip[3]];
});
return { annotations, places, width: box.width, height: box.height };"""


def check_view(chrome: Any) -> None:
    """Check that the view fills its frame and names its limbs."""

    def filled() -> Any:
        """The frame, once the box of its axes has room for ticks and titles, and is as large as that allows."""
        found = chrome.execute_script(FRAME)
        half = np.array([found["width"] / 2, found["height"] / 2])
        room = half - np.abs(np.array(found["places"]) * half).max(axis=0)
        return found if 0 <= (room - [60, 30]).min() <= 15 else None

    found = until(filled)
    limbs = [row["limb"] for row in data_of(chrome)["views"][0]["rows"]]
    assert sorted(text.removeprefix("limb ") for text in found["annotations"]) == sorted(limbs)


@pytest.mark.browser
@pytest.mark.parametrize("case", soaked(["paper-4.1-helical", "hexapod-machining"], ["paper-4.1-helical"]))
def test_a_narrow_view_fills_its_frame_and_names_its_limbs(opened: Callable[..., Any], case: str) -> None:
    chrome = opened(case, 420)
    check_view(chrome)
    check_hints(chrome)


def data_of(chrome: Any) -> dict[str, Any]:
    return dict(json.loads(chrome.execute_script("return document.getElementById('data').textContent")))


WITHOUT_WEBGL = """
const asked = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind.includes("webgl") ? null : asked.call(this, kind, ...more);
};"""


@pytest.mark.browser
def test_without_webgl_the_drawing_stands_there(browser: Any, opened: Callable[..., Any]) -> None:
    done = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WITHOUT_WEBGL})
    try:
        chrome = opened("paper-4.1-helical")
        shown = [each for each in chrome.find_elements("css selector", "img.still") if each.is_displayed()]
        assert len(shown) == 1
        assert chrome.execute_script("return arguments[0].naturalWidth", shown[0]) > 300
        assert "No WebGL" in chrome.find_element("class name", "flat-words").text
        assert not chrome.find_element("id", "view").is_displayed()
        before = chrome.execute_script(ROWS)
        chrome.execute_script(MOVE, 0)
        assert chrome.execute_script(ROWS) != before
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", done)


@pytest.mark.browser
def test_slider_shows_each_pose(opened: Callable[..., Any], tmp_path: Path, three_poses: Callable[[str], str]) -> None:
    browser = opened(saved(tmp_path / "page.html", posed(three_poses("max"))[1]))
    views = data_of(browser)["views"]
    for k in (2, 1, 0):
        browser.execute_script(MOVE.replace("travel", "pose"), k + 1)
        rates = views[k]["frames"][views[k]["zero"]]["rates"]
        np.testing.assert_allclose([number(row[2]) for row in browser.execute_script(ROWS)], rates, rtol=1e-5)
        assert f"pose {k + 1} of 3" in browser.find_element("id", "posed").text
    browser.find_element("id", "worst").click()
    assert browser.find_element("id", "posed").text.endswith("worst pose")


PATH_LIMBS = """
return document.getElementById("view").data.filter((each) => each.name.startsWith("limb "))
  .map((each) => [each.x, each.y, each.z].map((values) => values.slice(0, 2)))"""


@pytest.mark.browser
def test_the_robot_runs_along_its_path(
    opened: Callable[..., Any], tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Without a compiler, the page has the 3-D view of recorded postures.
    monkeypatch.setattr("screwsynth.nlp.view.wasm.find_compiler", lambda: None)
    part, target = saved(tmp_path / "part.csv", "t,x,y,z\n0,0,0,20\n2,18,0,22\n3,4,3,21\n"), tmp_path / "path.html"
    assert cli("path", "hexapod-linuxcnc", "--along", str(part), "--html", str(target))[0] == 1
    chrome = opened(target, 420)
    view = data_of(chrome)["view"]
    assert chrome.execute_script("return document.documentElement.scrollWidth") <= 420
    # Charts stand below each other.
    places = "return [...document.querySelectorAll('.chart')].map((each) => each.getBoundingClientRect().left)"
    assert len(set(chrome.execute_script(places))) == 1
    check_clean(chrome)
    assert chrome.find_element("id", "travelled").text == view["frames"][view["first"]]["words"]
    names = "return document.getElementById('view').layout.scene.annotations.map((each) => each.text)"
    assert chrome.execute_script(names)[-1] == "line 3"
    slider = chrome.find_element("id", "travel")
    for index in (0, len(view["frames"]) - 1):
        chrome.execute_script(MOVE, index)
        frame = view["frames"][index]
        shown = [[[frame["points"][end][k] for end in link["ends"]] for k in range(3)] for link in limb_lines(view)]
        assert until(lambda shown=shown: sorted(chrome.execute_script(PATH_LIMBS)) == sorted(shown))
        assert chrome.find_element("id", "travelled").text == frame["words"]
        # The cursor of each chart is at its end.
        cursor = "const at = document.querySelector('.cursor'); return [at.getAttribute('transform'), at.dataset]"
        moved, ends = chrome.execute_script(cursor)
        part_of_way = (frame["at"] - float(ends["low"])) / (float(ends["high"]) - float(ends["low"]))
        expected = float(ends["left"]) + part_of_way * float(ends["width"])
        assert float(re.findall(r"translate\(([\d.]+) 0\)", moved)[0]) == pytest.approx(expected, abs=0.01)
    # The robot runs from the beginning; the slider goes on by keyboard where it was stopped.
    chrome.execute_script(MOVE, 0)
    press = "const button = document.getElementById('play'); button.click(); return button.textContent"
    assert chrome.execute_script(press) == "Pause"
    assert until(lambda: int(slider.get_property("value")) > 0)
    stop = "const button = document.getElementById('play'); if (button.textContent === 'Pause') button.click()"
    chrome.execute_script(stop)
    assert chrome.find_element("id", "play").text == "Play"
    slider.send_keys("\ue012")  # the left arrow
    reached = int(slider.get_property("value"))
    chrome.execute_async_script(FRAMES)
    assert int(slider.get_property("value")) == reached < len(view["frames"]) - 1
    assert slider.get_attribute("aria-valuetext") == view["frames"][reached]["words"]
    chrome.execute_script(CHOOSE, "colour", "margin")
    names = "return document.getElementById('view').data.map((each) => each.name)"
    assert until(lambda: "path margin" in chrome.execute_script(names))


def limb_lines(view: dict[str, Any]) -> list[dict[str, Any]]:
    return [link for link in view["links"] if link["limb"] is not None]


@pytest.mark.browser
def test_wide_tables_of_a_curve_say_that_they_scroll(browser: Any, tmp_path: Path, cli: Run) -> None:
    curve = tmp_path / "curve.html"
    over = ("--over", "limits.leg_length.max=60:70:2", "--starts", "1")
    assert cli("tradeoff", "paper-4.1-helical", *over, "--html", str(curve))[0] == 0
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size_of_window(420))
    browser.get(curve.as_uri())
    check_hints(browser)
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.browser
def test_hover_over_a_limb_and_slider_by_keyboard(opened: Callable[..., Any], page: Callable[..., Page]) -> None:
    from selenium.webdriver.common.action_chains import ActionChains  # noqa: PLC0415 - not installed everywhere

    chrome = opened("paper-4.1-helical")
    result = page("paper-4.1-helical").data["result"]
    chrome.execute_script("document.getElementById('view').scrollIntoView()")
    chrome.execute_script(
        "window.found = null; document.getElementById('view').on('plotly_hover', (event) => {"
        " const at = event.points[0];"
        " window.found = [at.data.name, at.hovertext || at.data.hovertext[at.pointNumber]]; })"
    )
    view = chrome.find_element("id", "view")
    places = [(x, y) for y in range(-60, 70, 20) for x in range(-150, 120, 14)]
    for x, y in places:
        with suppress(Exception):
            ActionChains(chrome, duration=0).move_to_element_with_offset(view, x, y).perform()
        # The point under the pointer is looked for when the next picture is drawn.
        chrome.execute_async_script(FRAMES)
        if chrome.execute_script("return window.found"):
            break
    name, text = chrome.execute_script("return window.found")
    row = result["limbs"].index(name.removeprefix("limb "))
    text = text.replace("\N{MINUS SIGN}", "-")
    assert f"<b>{name}</b>" in text
    (rate, share) = re.findall(r"rate (\S+) \S+, (\S+) % of F", text)[0]
    assert float(rate) == pytest.approx(result["rates"][row], rel=1e-5)
    assert float(share) == pytest.approx(100 * result["rates"][row] ** 2 / result["F"], abs=0.051)
    length = result["quantities"]["leg_length"][result["limbs"][row]]
    assert float(re.findall(r"length (\S+)", text)[0]) == float(f"{length:.5g}")
    wrench = [float(each) for each in re.findall(r"wrench \((.*)\)", text)[0].replace(";", ",").split(",")]
    np.testing.assert_allclose(wrench, result["jacobian"][row], rtol=1e-3, atol=1e-3)
    (view_data,) = page("paper-4.1-helical").data["views"]
    slider = chrome.find_element("id", "travel")
    slider.send_keys("\ue014")  # the right arrow
    words = view_data["frames"][view_data["zero"] + 1]["words"]
    assert chrome.find_element("id", "travelled").text == words
    assert slider.get_attribute("aria-valuetext") == words
    assert chrome.find_element("css selector", "label[for=travel]").text


@pytest.mark.browser
def test_several_tasks_maps_and_the_copied_text(opened: Callable[..., Any], page: Callable[..., Page]) -> None:
    chrome, data = opened("paper-4.2"), page("paper-4.2").data
    check_clean(chrome)
    for k, outcome in enumerate(data["result"]["combined"]["tasks"]):
        chrome.execute_script(CHOOSE, "task", k)
        rates = [number(row[2]) for row in chrome.execute_script(ROWS)]
        np.testing.assert_allclose(rates, outcome["rates"], atol=1e-9)
    chosen = data["planes"][1][2]
    chrome.execute_script(CHOOSE, "pair", "1 2")
    assert chrome.find_element("id", "map-words").text == chosen["words"]
    last = chrome.execute_script("return document.getElementById('map').data.filter((d) => d.type === 'contour').pop()")
    assert last["x"] == chosen["first"]
    chrome.execute_script("document.documentElement.style.scrollBehavior = 'auto'")
    chrome.find_element("id", "copy").click()
    assert until(lambda: chrome.find_element("id", "copied").text)
    shown = chrome.execute_script("return document.getElementById('case-text').textContent")
    assert shown == (Path(__file__).parents[2] / "cases" / "paper-4.2.toml").read_text(encoding="utf-8")


def test_browser_is_where_ci_installs_it() -> None:
    """The table of `.ci/run` has what the tests marked ``browser`` start."""
    text = (Path(__file__).parents[2] / ".ci" / "run").read_text(encoding="utf-8")
    assert_words(text, "[chromium]=chromium", "[chromedriver]=chromium-driver")
    assert shutil.which("bash")


CASE = """
units = { length = "cm", force = "N" }
pose = { position = [0, 0, 20] }
task = [{ name = "up", sense = "max", axis = [0, 0, 1], pitch = inf }]
limits = { leg_length = { min = 2, max = 60 } }
solve = { starts = 2 }
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = { min = 10, max = 13 }, x2 = { min = 3, max = 5 }, x3 = 30, x4 = 20 }
"""
WORKSPACE = "[workspace]\nposition = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = 19, max = 21 }]\n"
FIXED = ("--set", "x1=12", "--set", "x2=4")
PATH = "x,y,z\n0,0,20\n1,0,20\n1,1,21\n"
#: Number of a page's pictures, those of them that stand side by side, the window's width, and the page's.
LAYOUT = """
const isPart = (each) => each.closest(".main-svg") || each.parentElement.closest(".view, .map");
const shown = [...document.querySelectorAll("figure, img, svg, .view, .map")].filter(
  (each) => !isPart(each) && each.checkVisibility() && each.getBoundingClientRect().width > 0);
const beside = [];
shown.forEach((one, k) => shown.slice(k + 1).forEach((other) => {
  const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
  const isInside = one.contains(other) || other.contains(one);
  // Drawings of designs have no text.
  const isDesign = one.closest(".designs") && other.closest(".designs");
  const overlap = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
  if (!isInside && !isDesign && overlap > 2) beside.push(one.outerHTML.slice(0, 60));
}));
return [shown.length, beside, innerWidth, document.documentElement.scrollWidth];"""


@pytest.mark.browser
@pytest.mark.slow  # seven commands, and a browser
def test_panels_stand_below_each_other_on_a_narrow_screen(browser: Any, cli: Run, tmp_path: Path) -> None:
    case = str(saved(tmp_path / "case.toml", CASE))
    judged = str(saved(tmp_path / "judged.toml", CASE + WORKSPACE))
    along = str(saved(tmp_path / "path.csv", PATH))
    # Without a C compiler, a sweep whose engine is not stated says that it takes this one.
    points = ("--over", "x3=20:30:3", "--engine", "ipopt")
    commands = {
        "report": ("report", case, "--out"),
        "workspace": ("workspace", judged, *FIXED, "--html"),
        "path": ("path", judged, *FIXED, "--along", along, "--html"),
        "sweep": ("sweep", case, *points, "--out", str(tmp_path / "sweep.csv"), "--html"),
        "tradeoff": ("tradeoff", case, "--over", "limits.leg_length.max=30:34:3", "--html"),
        "pareto": ("pareto", case, "--goal", "max F", "--goal", "min limits.leg_length.max", "--points", "3", "--html"),
        "compare": ("compare", case, "case", "6-ups", "--html"),
    }
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size_of_window(420))
    try:
        for name, command in commands.items():
            page = tmp_path / f"{name}.html"
            # A robot of a comparison without an answer gives another status.
            assert cli(*command, str(page))[2] == ""
            browser.get(page.as_uri())
            shown, beside, window, width = browser.execute_script(LAYOUT)
            assert window == 420, name
            assert width <= 420, name
            assert shown, name
            assert beside == [], name
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


#: Heights of the page, of its highest row of a table, and of its highest box of a table; the page's width.
HEIGHTS = """
const highest = (found) => Math.max(...[...document.querySelectorAll(found)].map((each) => each.offsetHeight));
return [document.documentElement.scrollHeight, highest("#swept tbody tr"), highest(".scroll.tall"),
  document.documentElement.scrollWidth];"""
#: Offset of the point of each number of a column from the left edge of its cell.
POINTS = """
return [...document.querySelectorAll("#swept tbody tr")].map((row) => {
  const cell = row.children[arguments[0]], range = document.createRange();
  const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
  for (let text = texts.nextNode(); text; text = texts.nextNode()) {
    const at = text.data.indexOf(".");
    if (at >= 0) {
      range.setStart(text, at); range.setEnd(text, at + 1);
      return range.getBoundingClientRect().left - cell.getBoundingClientRect().left;
    }
  }
  return null;
}).filter((each) => each !== null);"""


@pytest.mark.browser
@pytest.mark.slow  # 81 solves, and a browser
@pytest.mark.parametrize("width", [1400, 420])
def test_a_sweep_of_many_points_is_a_short_page(browser: Any, cli: Run, tmp_path: Path, width: int) -> None:
    case, page = str(saved(tmp_path / "case.toml", CASE)), tmp_path / "sweep.html"
    points = ("--over", "limits.leg_length.max=18:34:81", "--starts", "1", "--engine", "ipopt")
    assert cli("sweep", case, *points, "--out", str(tmp_path / "sweep.csv"), "--html", str(page))[2] == ""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size_of_window(width))
    try:
        browser.get(page.as_uri())
        whole, row, box, across = browser.execute_script(HEIGHTS)
        assert across <= width
        assert whole < 3000
        assert row < 40
        assert box <= 480
        # Numbers of a column with one and two digits before the point, such as p_x, have their points in one line.
        heads = browser.execute_script(
            "return [...document.querySelectorAll('#swept thead tr > *')].map(e => e.innerText)"
        )
        places = [browser.execute_script(POINTS, k) for k in range(1, len(heads))]
        assert any(len(each) > 10 for each in places)
        assert all(max(each) - min(each) < 1 for each in places if each)
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
