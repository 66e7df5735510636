"""Live pages in a real browser: what they compute, what they say about it, and what they give out again."""

import json
import math
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import Run, assert_words, saved, soaked
from pages import Page
from test_changes import SECTION_4_3, read

from screwsynth.nlp import load_case, shipped_cases, solve
from screwsynth.nlp.evidence.evaluation import starting_point
from screwsynth.nlp.evidence.loads import loads_at
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.output.live import page as live_page
from screwsynth.nlp.output.live.page import SCRIPTS, script_text
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.view import wasm
from screwsynth.nlp.view.wasm import find_compiler

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no compiler for WebAssembly is installed")
#: Sets a slider as a hand does, and ends when the page shows it.
MOVE = """
const [name, value, done] = arguments, { state } = screwsynth;
const k = state.sliders.findIndex((each) => each.name === name), range = document.getElementById(`slider-${k}`);
range.value = String(value);
range.dispatchEvent(new Event("input"));
requestAnimationFrame(() => requestAnimationFrame(() => done(true)));"""
CLICK = """
const [id, done] = arguments;
document.getElementById(id).click();
requestAnimationFrame(() => requestAnimationFrame(() => done(true)));"""
SHOWN = "return [...arguments].map((id) => document.getElementById(id).textContent)"
STATE = "const { state } = screwsynth; return [state.module.arrays.F[0], state.kind, state.status]"


class Live:
    """A live page in the browser."""

    def __init__(self, chrome: Any) -> None:  # noqa: ANN401 - the driver may be missing
        self.chrome = chrome

    def move(self, name: str, value: float) -> None:
        self.chrome.execute_async_script(MOVE, name, value)

    def click(self, key: str) -> None:
        self.chrome.execute_async_script(CLICK, key)

    def shown(self, *keys: str) -> list[str]:
        return list(self.chrome.execute_script(SHOWN, *keys))

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        return float(self.chrome.execute_script(STATE)[0])

    def copied(self, key: str) -> str:
        self.click(key)
        return str(self.chrome.execute_script("return document.getElementById('copied-text').value"))

    @property
    def faults(self) -> list[Any]:
        return [each for each in self.chrome.get_log("browser") if each["level"] == "SEVERE"]


def until_ready(chrome: Any) -> None:  # noqa: ANN401 - the driver may be missing
    chrome.execute_async_script(
        "const done = arguments[0], look = () => document.documentElement.dataset.ready === 'yes' ? done(true)"
        " : setTimeout(look, 20); look();"
    )


@pytest.fixture
def live(browser: Any, cli: Run, tmp_path: Path) -> Iterator[Callable[..., Live]]:  # noqa: ANN401
    """A live page of a case, opened from disk."""

    def open_page(case: str, *options: str, width: int = 1000, fragment: str = "") -> Live:
        page = tmp_path / f"{Path(case).stem}.html"
        code, _, errors = cli("view", case, "--out", str(page), "--no-open", *options)
        assert (code, errors) == (0, "")
        return opened(page, width, fragment)

    def opened(page: Path, width: int = 1000, fragment: str = "") -> Live:
        browser.get("about:blank")
        browser.get_log("browser")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.get(page.as_uri() + fragment)
        until_ready(browser)
        return Live(browser)

    yield open_page
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@needs_compiler
@pytest.mark.browser
def test_the_optimum_follows_a_slider(live: Callable[..., Live]) -> None:
    page = live("hexapod-machining")
    answer = solve(load_case("hexapod-machining")).outcomes[0]
    assert page.shown("F", "word") == [f"largest F = {answer.F:.7g} (in/rad)²", "optimal"]
    assert_words(*page.shown("words"), "found and checked by the program")
    page.move("p_z", 19.0)
    words = " ".join(page.shown("F", "word", "words"))
    assert not re.search(r"\boptimal\b|largest|checked by the program", words)
    assert_words(words, "local optimum", "p_z held", "not proved")
    own = solve(load_case("hexapod-machining", {"p_z": 19.0})).outcomes[0]
    assert pytest.approx(page.F, rel=1e-6) == own.F
    page.click("to-answer")
    assert page.shown("word") == ["optimal"]
    # Released again, the search returns to the program's point, and the words with it.
    page.move("p_z", 20.0)
    page.click("free-all")
    assert pytest.approx(answer.F, rel=1e-9) == page.F
    assert page.shown("word") == ["optimal"]
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_evaluation_shows_violated_limits(live: Callable[..., Live]) -> None:
    page = live("hexapod-machining")
    page.click("mode-evaluate")
    page.move("p_z", 24.5)
    page.move("x1", 30.0)
    name, values = "hexapod-machining", page.copied("copy-set")
    settings = dict(each.split("=") for each in shlex.split(values)[4::2])
    numbers = {key: [*map(float, text.split(","))] for key, text in settings.items()}
    nlp = formulate(load_case(name, {key: own[0] if len(own) == 1 else own for key, own in numbers.items()}))
    assert pytest.approx(evaluate(nlp, starting_point(nlp)).F, rel=1e-9) == page.F
    violated = page.chrome.execute_script(
        "return [...document.querySelectorAll('.limit.violated')].map((each) => each.textContent)"
    )
    assert any("base joints, radius" in each and "violated" in each for each in violated)
    assert_words(*page.shown("words"), "nothing is optimised", "violated")


@needs_compiler
@pytest.mark.browser
@pytest.mark.parametrize("case", soaked([*shipped_cases()], ["fixture-pins", "paper-4.1-helical", "reachy-mini"]))
def test_a_state_goes_out_and_comes_back(live: Callable[..., Live], cli: Run, tmp_path: Path, case: str) -> None:
    page = live(case)
    if not page.chrome.execute_script("return document.documentElement.classList.contains('live')"):
        pytest.skip("no solver in the page")
    name, low, high, now = page.chrome.execute_script(
        "const { state } = screwsynth, slider = state.sliders[0];"
        " return [slider.name, ...state.ends(slider), state.read(slider)]"
    )
    page.click("mode-evaluate")
    page.move(
        name, now + 0.04 * (low + high - 2 * now if abs(low + high - 2 * now) > 0.1 * (high - low) else high - low)
    )
    F, link = page.F, page.copied("copy-link")
    command = shlex.split(page.copied("copy-set"))
    target = tmp_path / "evaluated.json"
    assert cli(*command[1:], "--json", str(target))[0] in (0, 1)
    found = json.loads(target.read_text())
    values = [each["F"] for each in found["tasks"]] if "tasks" in found else [found["F"]]
    assert any(value == pytest.approx(F, rel=1e-7) for value in values) or len(values) > 1
    text = page.copied("copy-case")
    if text:
        again = saved(tmp_path / f"{case}.toml", text)
        second = tmp_path / "again.json"
        assert cli("evaluate", str(again), "--json", str(second))[2] == ""
        assert json.loads(second.read_text()).get("F") == pytest.approx(found.get("F"), rel=1e-9)
    page.chrome.get("about:blank")
    page.chrome.get(link)
    until_ready(page.chrome)
    assert pytest.approx(F, rel=1e-9) == page.F
    assert page.shown("word") != ["optimal"]
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_loops_stay_closed_while_a_slider_moves(live: Callable[..., Live]) -> None:
    page = live("delta")
    page.click("mode-evaluate")
    page.move("p_x", 0.11)
    page.move("rb", 0.17)
    settings = dict(each.split("=") for each in shlex.split(page.copied("copy-set"))[4::2])
    from screwsynth.nlp.cli.viewed import read_viewed  # noqa: PLC0415 - only here

    nlp = formulate(read_viewed("delta", {key: float(text) for key, text in settings.items()}).file.case)
    assert pytest.approx(evaluate(nlp, starting_point(nlp)).F, rel=1e-9) == page.F


HOSTILE = """
title = "a</script><script>window.hacked=1</script>\\u2028'\\"<img src=x onerror=window.hacked=2>"
units = { length = "cm" }
pose = { position = [0, 0, { min = 15, max = 30 }] }
task = [
  { name = "</script><b>&amp;'\\u2028", sense = "max", axis = [0, 0, 1], pitch = inf },
  { name = "<!-- ${x} \\\\ $title WWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWWW", sense = "max", axis = [1, 0, 0], pitch = inf },
]
combine = { method = "worst-case" }
limits = { leg_length = { min = 2, max = 60 } }
solve = { starts = 2 }
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = 20 }
"""


@needs_compiler
@pytest.mark.browser
def test_texts_of_a_case_stay_texts(live: Callable[..., Live], tmp_path: Path) -> None:
    case = saved(tmp_path / "a 'b' ${x} <!-- $title.toml", HOSTILE)
    page = live(str(case), width=420, fragment="#p_z=<img src=x>&x1=NaN&p_x=1e999&held=__proto__&mode=</script>")
    assert page.chrome.execute_script("return [window.hacked, document.images.length]") == [None, 0]
    assert "</script><script>window.hacked=1</script>" in page.shown("answer")[0] + str(
        page.chrome.execute_script("return document.querySelector('h1').textContent")
    )
    assert page.shown("word") == ["optimal"]
    assert page.faults == []
    assert page.chrome.execute_script("return document.documentElement.scrollWidth") <= 420
    assert [each[1][:12] for each in task_values(page)] == ["</script><b>", "<!-- ${x} \\ "]
    assert shlex.split(page.copied("copy-set"))[2] == str(case)
    html = Page(case.with_suffix(".html").read_text(encoding="utf-8"))
    assert len(html.scripts) == 3


#: Roles of elements that people operate or that stand for a picture.
CONTROLS = ("button", "slider", "textbox", "combobox", "image", "img", "application", "link", "DisclosureTriangle")


def unnamed_controls(page: Live) -> list[dict[str, Any]]:
    """Controls without a name in the tree that Chromium gives to screen readers."""
    nodes = page.chrome.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    shown = [each for each in nodes if not each["ignored"] and each["role"]["value"] in CONTROLS]
    assert len(shown) > 10
    return [each for each in shown if not str(each["name"]["value"]).strip()]


@needs_compiler
@pytest.mark.browser
def test_a_narrow_page_by_keyboard(live: Callable[..., Live]) -> None:
    page = live("paper-4.1-helical", width=420)
    assert page.chrome.execute_script("return document.documentElement.scrollWidth") <= 420
    entry = page.chrome.execute_script("return document.querySelector('.slider:not([hidden]) .entry')")
    entry.clear()
    entry.send_keys("12.25\ue007")
    page.chrome.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert_words(*page.shown("words"), "x1", "changed")
    before = page.F
    slider = page.chrome.find_element("id", "slider-0")
    slider.send_keys("\ue012\ue012")
    page.chrome.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert before != page.F
    assert unnamed_controls(page) == []
    entry.clear()
    entry.send_keys("many\ue007")
    assert entry.get_attribute("aria-invalid") == "true"


@pytest.mark.browser
def test_without_a_compiler_the_page_says_how_to_get_one(
    live: Callable[..., Live], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wasm, "find_compiler", lambda: None)
    page = live("paper-4.1-helical")
    assert_words(page.chrome.find_element("id", "controls").text, "do not work", "screwsynth[view]")
    assert_words(*page.shown("F"), "407.2", "optimal")
    painted = (
        "const { data } = c.getContext('2d').getImageData(0, 0, c.width, c.height); return data.some((each) => each)"
    )
    painted = f"const c = document.getElementById('robot'); {painted}"
    assert page.chrome.execute_script(painted)
    assert page.faults == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["paper-4.1-helical", "--no-open"], ["--no-open", "--out"]),
        (["no-such-case", "--out", "page.html", "--no-open"], ["no-such-case"]),
        (["paper-4.1-helical", "--out", "page.html", "--no-open", "--set", "y1=2"], ["y1"]),
        (["paper-4.1-helical", "--out", "none/page.html", "--no-open"], ["none/page.html"]),
    ],
)
def test_a_fault_is_one_sentence(
    cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, errors = cli("view", *arguments)
    assert (code, out) == (2, "")
    assert_words(errors, *words)
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_scripts_are_modules_for_node_and_one_script_for_the_page(tmp_path: Path) -> None:
    text = script_text()
    assert not re.search(r"^(import|export) ", text, re.MULTILINE)
    assert len(SCRIPTS) == len(set(SCRIPTS))
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    whole = saved(tmp_path / "page.mjs", text)
    subprocess.run([node, "--check", str(whole)], check=True)


@needs_compiler
@pytest.mark.browser
def test_a_hand_moves_and_turns_the_platform(live: Callable[..., Live]) -> None:
    page = live("hexapod-machining")
    page.click("mode-evaluate")
    pull = """
    const [turns, done] = arguments, canvas = document.getElementById("robot"), { state } = screwsynth;
    const box = canvas.getBoundingClientRect(), robot = screwsynth.place();
    const at = (type, x, y) => canvas.dispatchEvent(new PointerEvent(type, {
      pointerId: 1, clientX: box.left + x, clientY: box.top + y, shiftKey: turns, bubbles: true }));
    canvas.setPointerCapture = () => {};
    at("pointerdown", ...robot);
    at("pointermove", robot[0] + 12, robot[1] - 20);
    at("pointerup", robot[0] + 12, robot[1] - 20);
    requestAnimationFrame(() => requestAnimationFrame(() => done([...state.module.arrays.x])));"""
    before = page.chrome.execute_script("return [...screwsynth.state.module.arrays.x]")
    moved = page.chrome.execute_async_script(pull, False)
    assert moved[:4] == before[:4]
    assert moved[6] > before[6]
    assert moved[7:] == before[7:]
    turned = page.chrome.execute_async_script(pull, True)
    assert turned[:7] == moved[:7]
    assert turned[7:] != moved[7:]
    assert_words(*page.shown("words"), "nothing is optimised")


@needs_compiler
@pytest.mark.browser
def test_a_map_has_the_values_of_evaluate_and_moves_the_robot(live: Callable[..., Live]) -> None:
    page = live("paper-4.1-helical")
    page.chrome.execute_script("document.getElementById('map-group').open = true")
    drawn = "const words = () => document.getElementById('map-words').textContent;"
    drawn += " const look = () => words() ? arguments[0](words()) : setTimeout(look, 20); look();"
    assert_words(page.chrome.execute_async_script(drawn), "limit is violated", "ms")
    # The map leaves the point, and what is said about it, as they were.
    assert page.shown("word") == ["optimal"]
    click = """
    const done = arguments[0], { state } = screwsynth, map = document.getElementById("map");
    const chosen = ["map-x", "map-y"].map((id) => state.sliders[Number(document.getElementById(id).value)]);
    document.getElementById("mode-evaluate").click();
    requestAnimationFrame(() => {
      const { left, top, width, height } = map.getBoundingClientRect();
      map.dispatchEvent(new MouseEvent("click", { clientX: left + 0.25 * width, clientY: top + 0.4 * height }));
      requestAnimationFrame(() => requestAnimationFrame(() => done(chosen.map((each) => [
        each.set, (state.read(each) - state.ends(each)[0]) / (state.ends(each)[1] - state.ends(each)[0])]))));
    });"""
    (_, across), (_, up) = page.chrome.execute_async_script(click)
    assert (across, up) == pytest.approx((0.25, 0.6), abs=0.02)


@needs_compiler
@pytest.mark.browser
def test_two_fingers_on_the_platform_turn_it(live: Callable[..., Live]) -> None:
    page = live("hexapod-machining", width=420)
    page.click("mode-evaluate")
    pull = """
    const done = arguments[0], canvas = document.getElementById("robot"), { state } = screwsynth;
    const box = canvas.getBoundingClientRect(), [x, y] = screwsynth.place();
    const at = (type, pointerId, dx, dy) => canvas.dispatchEvent(new PointerEvent(type, {
      pointerId, clientX: box.left + x + dx, clientY: box.top + y + dy, bubbles: true }));
    canvas.setPointerCapture = () => {};
    at("pointerdown", 1, 0, 0);
    at("pointerdown", 2, 60, 0);
    at("pointermove", 1, 0, 6);
    at("pointermove", 2, 60, -6);
    at("pointerup", 1, 0, 6);
    at("pointerup", 2, 60, -6);
    requestAnimationFrame(() => requestAnimationFrame(() => done([...state.module.arrays.x])));"""
    before = page.chrome.execute_script("return [...screwsynth.state.module.arrays.x]")
    turned = page.chrome.execute_async_script(pull)
    assert turned[:7] == before[:7]
    # About the direction to the viewer, by the angle between both lines of the fingers.
    change = math.dist(turned[7:], before[7:])
    assert 0.5 * math.atan2(12, 60) * 0.5 < change < 0.5 * math.atan2(12, 60) * 1.5
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_a_cursor_on_the_map_moves_the_robot(live: Callable[..., Live]) -> None:
    page = live("hexapod-spindle")
    page.click("mode-evaluate")
    page.chrome.execute_script("document.getElementById('map-group').open = true")
    page.chrome.execute_async_script(
        "const look = () => document.getElementById('map-words').textContent"
        " ? arguments[0](true) : setTimeout(look, 20); look();"
    )
    assert_words(*page.shown("map-words"), "dashed: the workspace")
    names = page.chrome.execute_script(
        "return [...document.getElementById('map-what').options].map((each) => each.textContent)"
    )
    assert_words(" ".join(names), "singular", "nearest limit", "actuator force", "actuator speed")
    page.chrome.find_element("id", "map").send_keys("\ue014\ue014\ue013")  # right, right, up
    assert_words(*page.shown("map-cursor"), "Cursor at p_x", "Enter moves")
    before = page.chrome.execute_script("return [...screwsynth.state.module.arrays.p]")
    page.chrome.find_element("id", "map").send_keys("\ue007")
    page.chrome.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    after = page.chrome.execute_script("return [...screwsynth.state.module.arrays.p]")
    moved = [k for k, each in enumerate(before) if after[k] != each]
    assert len(moved) == 2
    assert all(after[k] > before[k] for k in moved)
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_the_worst_pose_of_a_workspace_is_sampled_and_says_so(live: Callable[..., Live]) -> None:
    page = live("hexapod-spindle")
    home = page.chrome.execute_script("return screwsynth.state.leastMargin()")
    page.click("to-worst")
    assert_words(*page.shown("words"), "worst of", "poses of the workspace", "sampled", "not proved")
    least, sliders = page.chrome.execute_script(
        "const { state } = screwsynth; return [state.leastMargin(), state.sliders.map((e) => [e.name, state.read(e)])]"
    )
    position = {name: value for name, value in sliders if name.startswith("p_")}
    assert least < home
    assert abs(position["p_x"]) <= 3
    assert abs(position["p_y"]) <= 3
    assert 17 <= position["p_z"] <= 23
    # The nearest limit is that of the program at the same pose: the speed of an actuator, at most 10 in/s.
    settings = dict(each.split("=") for each in shlex.split(page.copied("copy-set"))[4::2])
    nlp = formulate(load_case("hexapod-spindle", {key: float(text) for key, text in settings.items()}))
    x = starting_point(nlp)
    speeds = [abs(each.value) for each in loads_at(nlp, x, evaluate(nlp, x)).speeds]
    margin = (10 - max(speeds)) / max(10, *speeds)
    assert least <= margin + 1e-9


@needs_compiler
@pytest.mark.browser
def test_weights_of_tasks_have_sliders(live: Callable[..., Live], cli: Run, tmp_path: Path) -> None:
    page = live("peg-in-hole")
    page.click("mode-evaluate")
    page.chrome.execute_script("document.getElementById('tasks-group').open = true")
    ranges = [
        each
        for each in page.chrome.find_elements("css selector", "#tasks input[type=range]")
        if str(each.get_attribute("aria-label")).endswith("weight")
    ]
    assert len(ranges) == 2
    before = page.F
    # Until a change, the copied file has the weights of the case.
    assert [each.weight for each in load_case(copied_case(page, tmp_path)).tasks] == [
        each.weight for each in load_case("peg-in-hole").tasks
    ]
    page.chrome.execute_async_script(
        "const [range, done] = arguments; range.value = '1.5'; range.dispatchEvent(new Event('input'));"
        "requestAnimationFrame(() => requestAnimationFrame(done));",
        ranges[0],
    )
    assert before != page.F
    command = shlex.split(page.copied("copy-set"))
    assert any(each.startswith("task[0].weight=") for each in command)
    target = tmp_path / "evaluated.json"
    assert cli(*command[1:], "--json", str(target))[0] in (0, 1)
    found = json.loads(target.read_text())
    weights = [float(each.split("=")[1]) for each in command if ".weight=" in each]
    signs = page.chrome.execute_script("return screwsynth.state.data.tasks.map((each) => each.sense)")
    values = [each["F"] for each in found["tasks"]]
    size = 2 / sum(weights)
    mixed = len(set(signs)) > 1
    total = sum(
        size * weight * value * (-1 if mixed and sign == "min" else 1)
        for weight, value, sign in zip(weights, values, signs, strict=True)
    )
    assert pytest.approx(total, rel=1e-9) == page.F
    file = copied_case(page, tmp_path)
    assert [each.weight for each in load_case(file).tasks] == pytest.approx(weights, rel=1e-15)
    assert cli("evaluate", file, "--json", str(target))[0] in (0, 1)
    again = [each["F"] for each in json.loads(target.read_text())["tasks"]]
    assert again == pytest.approx(values, rel=1e-9)


#: Two tasks at two poses; F of a task is the mean over both.
TWO_BY_TWO = """
title = "two tasks, two poses"
units = { length = "cm" }
pose = [{ position = [0, 0, { min = 15, max = 30 }] }, { position = [3, 1, 22] }]
combine = { method = "worst-case", over_poses = "mean" }
solve = { starts = 4 }
[[task]]
name = "lift"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[task]]
name = "turn"
sense = "max"
axis = [0, 0, 1]
point = [0, 0, 0]
pitch = 0
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = { min = 5, max = 28 } }
"""
#: F of a task, and its separate optimum if it is known.
TASK_VALUE = re.compile(r"^(.+): F = (\S+) \S+?(?:, (\S+)\xa0% of the separate (maximum|minimum) (\S+))?$")


def task_values(page: Live) -> list[re.Match[str]]:
    """Values of the tasks in the headline."""
    rows = page.chrome.execute_script(
        "return [...document.querySelectorAll('#task-values li')].map((e) => e.textContent)"
    )
    found = [TASK_VALUE.match(row) for row in rows]
    assert all(found), rows
    return [each for each in found if each is not None]


@needs_compiler
@pytest.mark.browser
@pytest.mark.parametrize("name", ["peg-in-hole", "two tasks at two poses"])
def test_the_headline_has_each_task_as_a_part_of_its_own_optimum(
    live: Callable[..., Live], cli: Run, tmp_path: Path, name: str
) -> None:
    source = name if name == "peg-in-hole" else str(saved(tmp_path / "two.toml", TWO_BY_TWO))
    page = live(source)
    solution = solve(load_case(source))
    for row, outcome in zip(task_values(page), solution.outcomes, strict=True):
        task, F, part, word, best = row.groups()
        assert (task, word) == (outcome.task.name, f"{outcome.task.sense.value}imum")
        assert float(F) == pytest.approx(outcome.F, rel=1e-6)
        assert float(best) == pytest.approx(outcome.own.F, rel=1e-6)
        assert float(part) == pytest.approx(100 * outcome.F / outcome.own.F, rel=1e-3)
    # A moved value changes F, and no separate optimum.
    page.click("mode-evaluate")
    page.move("x2" if name == "peg-in-hole" else "pose1_p_z", 23.0)
    target = tmp_path / "evaluated.json"
    assert cli(*shlex.split(page.copied("copy-set"))[1:], "--json", str(target))[0] in (0, 1)
    expected = [each["F"] for each in json.loads(target.read_text())["tasks"]]
    moved = task_values(page)
    assert [float(each[2]) for each in moved] == pytest.approx(expected, rel=1e-6)
    assert all(each[5] for each in moved)
    # The separate optima of another robot are not known.
    page.move("x1" if name != "peg-in-hole" else "p_y", 11.0)
    fixed = page.chrome.execute_script("return screwsynth.state.isStatedCase()")
    assert [bool(each[5]) for each in task_values(page)] == [fixed, fixed]
    assert fixed is False
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_a_page_goes_on_where_the_robot_cannot_close(live: Callable[..., Live]) -> None:
    page = live("five-bar")
    page.click("mode-evaluate")
    before = page.F
    page.move("forearm", 0.125)
    assert_words(" ".join(page.shown("F", "word", "words")), "no robot", "no configuration")
    page.click("to-start")
    assert pytest.approx(before, rel=1e-12) == page.F
    assert page.faults == []


@pytest.mark.browser
def test_a_page_without_a_solver_and_an_answer_has_the_value_of_its_point(live: Callable[..., Live]) -> None:
    page = live("differential-waist")
    assert_words(" ".join(page.shown("F", "word", "words")), "F = ", "point", "nothing is optimised")
    assert page.shown("task-values") == [""]
    assert page.faults == []


def copied_case(page: Live, folder: Path) -> str:
    """Write the case file that the page copies, and return its path."""
    file = folder / "copied.toml"
    file.write_text(page.copied("copy-case"), encoding="utf-8")
    return str(file)


@needs_compiler
@pytest.mark.browser
def test_a_chosen_task_shows_its_robot(live: Callable[..., Live], tmp_path: Path) -> None:
    page = live(str(saved(tmp_path / "settings.toml", SECTION_4_3)))
    best = solve(read(SECTION_4_3)).combination
    assert best is not None
    assert pytest.approx(best.value, rel=1e-6) == page.F
    assert_words(*page.shown("F"), "worst-case")
    rates = "const { state } = screwsynth, [first, size] = state.data.blocks.rates;"
    rates += " return [...state.module.arrays.view.slice(first, first + size)]"
    shown = "return [...document.querySelectorAll('.slider')].filter((each) => !each.hidden)"
    shown += ".map((each) => each.querySelector('label').textContent)"
    before = page.chrome.execute_script(rates)
    assert "pose1_p_x" in page.chrome.execute_script(shown)
    page.chrome.execute_async_script(
        "const done = arguments[0], choice = document.getElementById('pose'); choice.value = '1';"
        "choice.dispatchEvent(new Event('change'));"
        "requestAnimationFrame(() => requestAnimationFrame(() => done(true)));"
    )
    after = page.chrome.execute_script(rates)
    assert (len(before), len(after)) == (6, 6)
    assert before != after
    names = page.chrome.execute_script(shown)
    assert "pose2_p_x" in names
    assert "pose1_p_x" not in names
    # The squared rates of a task are its F, at the optimum the worst case times the weight.
    weights = read(SECTION_4_3).tasks
    total = sum(task.weight for task in weights)
    scaled = [
        sum(rate**2 for rate in each) * total / 2 / task.weight
        for each, task in zip((before, after), weights, strict=True)
    ]
    assert min(scaled) == pytest.approx(page.F, rel=1e-6)
    assert page.faults == []


@needs_compiler
@pytest.mark.browser
def test_refused_cases_and_rounding_errors_have_plain_words(live: Callable[..., Live]) -> None:
    page = live("agile-eye")
    words = page.chrome.find_element("id", "controls").text
    assert_words(words, "optimises F only", "actuator speed")
    assert not re.search(r"\.toml|objective|[\"_]", words)
    page = live("paper-4.4-snu")
    page.click("mode-evaluate")
    assert_words(*page.shown("F"), "= 0 ")


def test_types_of_scripts(tmp_path: Path) -> None:
    checker = shutil.which("tsc")
    if checker is None:
        pytest.skip("tsc is not installed")
    folder = Path(live_page.__file__).parent / "page"
    for name in SCRIPTS:
        shutil.copy(folder / name, tmp_path)
    options = "--noEmit --allowJs --checkJs --strict --target es2022 --module es2022 --moduleResolution bundler"
    words = [checker, *options.split(), "--lib", "es2022,dom,dom.iterable", *SCRIPTS]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == ""
