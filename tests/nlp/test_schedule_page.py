"""The page of a schedule: the robot along its path with its settings, against own kinematics and ``evaluate``."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, assert_words, output_of, saved
from test_live_pages import IN_VIEW, POSE, READY, act, faults, fits, words
from test_schedule_measures import _ANY_FORCE, _NO_TASK, _RADIUS, _forces, _jacobian, _minimised
from test_schedules import _DEGREE, _circle, _objective, _struts, _written

from screwsynth.models import FloatArray
from screwsynth.nlp import load_case, solve
from screwsynth.nlp.output import live
from screwsynth.nlp.path.path import Poses
from screwsynth.nlp.view import wasm
from screwsynth.nlp.view.wasm import find_compiler

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no compiler for WebAssembly is installed")
#: Moves the slider of the path to a point.
TRAVEL = """
const slider = root.getElementById("travel");
slider.value = arguments[0];
slider.dispatchEvent(new Event("input"));"""
#: Moves the slider of a setting to a value.
SET = """
const setting = root.getElementById(`setting-${arguments[0]}`);
setting.value = arguments[1];
setting.dispatchEvent(new Event("input"));"""
CLICK = "root.getElementById(arguments[0]).click();"


@pytest.fixture
def opened(browser: Any) -> Iterator[Callable[..., Any]]:  # noqa: ANN401 - the driver may be missing
    """A page with a live view, opened from disk."""

    def open_page(page: Path, width: int = 1000, fragment: str = "") -> Any:  # noqa: ANN401
        browser.get("about:blank")
        browser.get_log("browser")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.get(page.as_uri() + fragment)
        browser.execute_async_script(READY)
        return browser

    yield open_page
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def _value(chrome: Any) -> float:  # noqa: ANN401
    """Return the objective at the shown point, as the page computes it."""
    return float(chrome.execute_script("return screwsynth.track.schedule.value()"))


def _data(chrome: Any) -> dict[str, Any]:  # noqa: ANN401
    return dict(chrome.execute_script("return screwsynth.track.schedule.data"))


def _copied(chrome: Any, key: str) -> str:  # noqa: ANN401
    act(chrome, CLICK, key)
    look = (
        f"{IN_VIEW} const done = arguments[0], area = root.getElementById('copied-text');"
        " const look = () => (area.value ? done(area.value) : setTimeout(look, 20)); look();"
    )
    text = str(chrome.execute_async_script(look))
    chrome.execute_script(f"{IN_VIEW} root.getElementById('copied-text').value = ''")
    return text


def _check_point(chrome: Any, angle: float, position: FloatArray, turn: float) -> None:  # noqa: ANN401
    """Check the shown robot of the shipped case with own kinematics; angle and turn in radians."""
    shown, rotation, *_ = chrome.execute_script(POSE)
    np.testing.assert_allclose(shown, position, rtol=1e-12)
    # The platform joints of both kinematics agree, so rotation and turn do too.
    struts = _struts(angle, position, turn)
    lengths = chrome.execute_script(
        "const { blocks } = screwsynth.state.data, { view } = screwsynth.state.module.arrays;"
        " return [...view.slice(blocks.quantities[0], blocks.quantities[0] + 6)]"
    )
    np.testing.assert_allclose(sorted(lengths), sorted(np.linalg.norm(struts, axis=1)), rtol=1e-9)
    axis = np.reshape(rotation, (3, 3)) @ [0, 0, 1]
    np.testing.assert_allclose(axis, [0.5 * np.cos(angle), 0.5 * np.sin(angle), np.sqrt(0.75)], atol=1e-9)
    assert _value(chrome) == pytest.approx(_objective(angle, position, turn), rel=1e-9)


@needs_compiler
@pytest.mark.browser
def test_the_robot_follows_the_schedule(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    page = tmp_path / "yaw.html"
    output_of(cli("view", "hexapod-yaw", "--no-open", "--out", str(page)))
    assert len(page.read_bytes()) < 1_000_000
    for width in (420, 1400, 1000):
        chrome = opened(page, width)
        assert fits(chrome, width)
        assert faults(chrome) == []
    schedule = solve(load_case("hexapod-yaw")).schedule
    assert schedule is not None
    assert schedule.constant is not None
    assert (words(chrome, "F"), words(chrome, "word")) == ("mean F = 1.69133 (in/in)²", "locally optimal")
    assert_words(words(chrome, "words"), "+2.02 % compared with the best constant turn", "by the program")
    angles, positions = _circle(200)
    held = float(schedule.constant.values[0])
    for index in (0, 57, 131, 199):
        act(chrome, TRAVEL, index)
        _check_point(chrome, angles[index], positions[index], schedule.values[index, 0] * _DEGREE)
        assert _value(chrome) == pytest.approx(schedule.F[index], rel=1e-9)
        assert words(chrome, "word") == "locally optimal"
        # Beside it, the best constant turn, to which a button moves the robot.
        own = _objective(angles[index], positions[index], held * _DEGREE)
        assert _data(chrome)["constant"]["F"][index] == pytest.approx(own, rel=1e-9)
        act(chrome, CLICK, "show-constant")
        _check_point(chrome, angles[index], positions[index], held * _DEGREE)
        assert (words(chrome, "F"), words(chrome, "word")) == ("mean F = 1.657882 (in/in)²", "best constant")
        act(chrome, CLICK, "show-schedule")
    # A moved turn is computed in the page, which says whether the rate of the turn reaches it.
    act(chrome, TRAVEL, 145)
    turns, dt = schedule.values[:, 0], schedule.times[1]
    low, high = max(turns[144], turns[146]) - 5 * dt, min(turns[144], turns[146]) + 5 * dt
    assert low < high - 0.01
    for turn, is_near in ((0.5 * (low + high), True), (high + 1.0, False), (low - 1.0, False)):
        act(chrome, SET, 0, turn)
        _check_point(chrome, angles[145], positions[145], turn * _DEGREE)
        assert words(chrome, "word") == "point"
        assert_words(words(chrome, "words"), "computed in this page", "other turn than the schedule")
        assert ("does not reach" in words(chrome, "words")) is not is_near
        note = chrome.execute_script(f"{IN_VIEW} return root.querySelector('.reach').textContent")
        assert_words(note, "within" if is_near else "outside", "at most 5 deg/s")
    # A violated limit is named, and the next point has the schedule again.
    act(chrome, TRAVEL, 57)
    act(chrome, SET, 0, 60.0)
    assert np.linalg.norm(_struts(angles[57], positions[57], 60 * _DEGREE), axis=1).max() > 43
    assert_words(words(chrome, "words"), "violated")
    act(chrome, TRAVEL, 58)
    assert words(chrome, "word") == "locally optimal"
    assert faults(chrome) == []


@needs_compiler
@pytest.mark.browser
def test_a_point_of_a_schedule_goes_out_and_comes_back(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    page = tmp_path / "yaw.html"
    output_of(cli("view", "hexapod-yaw", "--no-open", "--out", str(page)))
    chrome = opened(page)
    schedule = solve(load_case("hexapod-yaw")).schedule
    assert schedule is not None
    assert _copied(chrome, "copy-schedule") == schedule.to_csv()
    act(chrome, TRAVEL, 90)
    act(chrome, SET, 0, -20.5)
    value, link = _value(chrome), _copied(chrome, "copy-link")
    # ``evaluate`` of the copied case file has F of the page, and the motion of the point.
    case, found = saved(tmp_path / "point.toml", _copied(chrome, "copy-case")), tmp_path / "point.json"
    output_of(cli("evaluate", str(case), "--json", str(found)))
    assert json.loads(found.read_text())["F"] == pytest.approx(value, rel=1e-9)
    angles, positions = _circle(200)
    assert value == pytest.approx(_objective(angles[90], positions[90], -20.5 * _DEGREE), rel=1e-9)
    chrome = opened(page, fragment=f"#{link.split('#')[1]}")
    assert (_value(chrome), words(chrome, "word")) == (pytest.approx(value, rel=1e-12), "point")
    # A map moves the robot to a point and a turn.
    act(chrome, CLICK, "show-schedule")
    click = """
    const map = root.querySelector(".schedule-map"), box = map.getBoundingClientRect();
    const at = { clientX: box.left + 0.25 * box.width, clientY: box.top + 0.4 * box.height };
    map.dispatchEvent(new MouseEvent("click", at));"""
    act(chrome, click)
    index = chrome.execute_script("return screwsynth.track.index")
    turn = chrome.execute_script("return screwsynth.track.schedule.values()[0]") / _DEGREE
    assert abs(index - 0.25 * 199) <= 1.5
    assert turn == pytest.approx(-75 + 0.6 * 150, abs=1.5)
    _check_point(chrome, angles[index], positions[index], turn * _DEGREE)
    # The robot runs in the time of the path.
    act(chrome, TRAVEL, 0)
    act(chrome, CLICK, "play")
    wait = "return new Promise((done) => setTimeout(() => done(screwsynth.track.index), 1500))"
    assert chrome.execute_script(wait) > 0
    act(chrome, CLICK, "play")
    assert words(chrome, "play") == "Play"
    assert faults(chrome) == []


_HELD = ("{ min = -75, max = 75, rate = 5 }", "20")
_FREE = [("x2 = 11.543", "x2 = { min = 10, max = 12 }"), ("[objective]", "[solve]\nstarts = 2\n\n[objective]")]


@needs_compiler
@pytest.mark.browser
@pytest.mark.parametrize(
    "changes", [[_HELD], pytest.param(_FREE, marks=pytest.mark.soak)], ids=["one setting", "two settings and a design"]
)
def test_a_dimension_moves_along_the_path(
    opened: Callable[..., Any], cli: Run, tmp_path: Path, changes: list[tuple[str, str]]
) -> None:
    case = _written(tmp_path, ("x1 = 26.5", _RADIUS), *changes, count=12)
    page = tmp_path / "page.html"
    output_of(cli("report", str(case), "--out", str(page)))
    schedule = solve(load_case(str(case))).schedule
    assert schedule is not None
    assert schedule.constant is not None
    for width in (420, 1000):
        chrome = opened(page, width)
        assert fits(chrome, width)
        assert faults(chrome) == []
    assert words(chrome, "word") == "locally optimal"
    data, last = _data(chrome), len(schedule.values) - 1
    for index in (0, last // 3, last):
        act(chrome, TRAVEL, index)
        assert _value(chrome) == pytest.approx(schedule.F[index], rel=1e-9)
        points = np.reshape(chrome.execute_script(POSE)[3], (-1, 3))
        # The base joints are on a circle with the radius of the schedule, the platform joints on one of the design.
        position = schedule.poses.positions[index]
        base = np.hypot(points[:, 0], points[:, 1])[np.abs(points[:, 2]) < 1e-12]
        assert np.isclose(base, schedule.values[index, 0], rtol=1e-9).sum() >= 6
        near = np.linalg.norm(points - position, axis=1)
        assert np.isclose(near, schedule.design.get("x2", 11.543), rtol=1e-9).sum() >= 6
    # The best constant has a design of its own, and so has the robot.
    act(chrome, CLICK, "show-constant")
    points = np.reshape(chrome.execute_script(POSE)[3], (-1, 3))
    near = np.linalg.norm(points - schedule.poses.positions[last], axis=1)
    assert np.isclose(near, schedule.constant.design.get("x2", 11.543), rtol=1e-9).sum() >= 6
    assert _value(chrome) == pytest.approx(data["constant"]["F"][-1], rel=1e-9)
    assert words(chrome, "word") == "best constant"
    assert faults(chrome) == []


@needs_compiler
@pytest.mark.browser
@pytest.mark.soak
def test_a_smallest_force_has_its_value_and_its_table(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    case = _written(tmp_path, *_minimised("actuator_force", "worst", _ANY_FORCE), count=12)
    page = tmp_path / "page.html"
    output_of(cli("view", str(case), "--no-open", "--out", str(page)))
    schedule = solve(load_case(str(case))).schedule
    assert schedule is not None
    chrome = opened(page)
    assert_words(words(chrome, "F"), "largest actuator force =", "lbf")
    index = 71
    act(chrome, TRAVEL, index)
    act(chrome, SET, 0, 7.5)
    poses = Poses(schedule.poses.positions[[index]], schedule.poses.rotations[[index]])
    assert _value(chrome) == pytest.approx(_forces(poses, np.array([7.5]))[0], rel=1e-9)
    rows = chrome.execute_script("return document.querySelectorAll('#actuators tr').length")
    assert rows == 6
    assert faults(chrome) == []


@needs_compiler
@pytest.mark.browser
@pytest.mark.soak
def test_a_smallest_singular_value_is_that_of_the_moved_robot(
    opened: Callable[..., Any], cli: Run, tmp_path: Path
) -> None:
    objective = ('as = "mean"', 'as = "mean"\nmaximise = "smallest_singular_value"\nlength = 11')
    case = _written(tmp_path, _NO_TASK, objective, count=12)
    page = tmp_path / "page.html"
    output_of(cli("view", str(case), "--no-open", "--out", str(page)))
    schedule = solve(load_case(str(case))).schedule
    assert schedule is not None
    chrome = opened(page)
    before = words(chrome, "singular")
    act(chrome, SET, 0, 7.5)
    J = _jacobian(schedule.poses.positions[0], schedule.poses.rotations[0], 7.5 * _DEGREE)
    expected = np.linalg.svd(J / np.repeat([11.0, 1.0], 3), compute_uv=False)[-1]
    assert _value(chrome) == pytest.approx(expected, rel=1e-9)
    # The singular value of the table has the length of the robot.
    assert words(chrome, "singular") not in (before, f"{expected:.5g}")
    assert_words(words(chrome, "F"), "smallest singular value = ")
    assert faults(chrome) == []


@needs_compiler
@pytest.mark.browser
@pytest.mark.soak
def test_loops_follow_the_path(opened: Callable[..., Any], cli: Run, tmp_path: Path) -> None:
    """Joints of closed loops follow the path and the turn, in the assembly mode of home."""
    table = "".join(f"{0.5 * k},{0.02 * k - 0.1:.3f},{0.03 * (k % 3):.3f},1.2\n" for k in range(11))
    saved(tmp_path / "own.csv", "t,x,y,z\n" + table)
    case = saved(tmp_path / "case.toml", _LOOPS)
    page = tmp_path / "page.html"
    output_of(cli("view", str(case), "--no-open", "--out", str(page)))
    schedule = solve(load_case(str(case))).schedule
    assert schedule is not None
    chrome = opened(page)
    last = len(schedule.values) - 1
    for index in (0, last, last // 2, 3):
        act(chrome, TRAVEL, index)
        assert _value(chrome) == pytest.approx(schedule.F[index], rel=1e-8)
    assert words(chrome, "word") == "locally optimal"
    assert faults(chrome) == []


_LOOPS = """
units = { length = "m" }
task = [{ sense = "max", follows = "thrust" }]
objective = { over = "path", as = "mean" }
path = { file = "own.csv", tool = { axis = [0, 0, 1], turn = { min = -20, max = 20, rate = 4 } } }
[robot]
model = "6-pus"
parameters = { rb = 1, rp = 0.6, base_half = 20, platform_half = 43, h = 1.2 }
[pose]
position = [0, 0, 1.2]
"""


def test_a_search_without_an_answer_has_a_page_that_says_so(
    cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wasm, "find_compiler", lambda: None)
    case = _written(tmp_path, ("min = 17, max = 43", "min = 17, max = 20"), count=12)
    page = tmp_path / "page.html"
    out = output_of(cli("view", str(case), "--no-open", "--out", str(page)))
    for text in (out, page.read_text()):
        assert_words(text, "no schedule found", "this is no proof")


@pytest.mark.browser
def test_without_a_compiler_the_page_has_the_answer(
    opened: Callable[..., Any], cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wasm, "find_compiler", lambda: None)
    page = tmp_path / "page.html"
    assert cli("view", str(_written(tmp_path, count=12)), "--no-open", "--out", str(page))[0] == 0
    chrome = opened(page)
    assert_words(words(chrome, "F"), "mean F = ", "(in/in)²")
    assert_words(chrome.find_element("id", "controls").text, "do not work", "screwsynth[view]")
    assert faults(chrome) == []


def test_a_turn_in_the_page_is_that_of_rotation_matrices(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    rng = np.random.default_rng(3)

    def matrix(w: float, v: FloatArray) -> FloatArray:
        K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        return np.asarray(np.eye(3) + 2 * w * K + 2 * K @ K)

    given = []
    for angle in (*rng.uniform(-np.pi, np.pi, 20), 0.0, np.pi, -np.pi):
        q, axis = rng.normal(size=4), rng.normal(size=3)
        q, axis = q / np.linalg.norm(q), axis / np.linalg.norm(axis)
        given.append({"q": (q if q[0] > 0 else -q).tolist(), "axis": axis.tolist(), "angle": float(angle)})
    # Node takes the files as modules only in a folder that says so.
    folder = tmp_path / "page"
    shutil.copytree(Path(live.__file__).parent / "page", folder)
    saved(folder / "package.json", '{"type": "module"}')
    words = [node, str(Path(__file__).parent / "turned_about.mjs"), str(folder / "schedule.js"), json.dumps(given)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for each, v in zip(given, json.loads(done.stdout), strict=True):
        w = np.sqrt(max(0.0, 1 - np.dot(v, v)))
        a, t = np.array(each["axis"]), each["angle"] / 2
        expected = matrix(each["q"][0], np.array(each["q"][1:])) @ matrix(np.cos(t), np.sin(t) * a)
        np.testing.assert_allclose(matrix(w, np.array(v)), expected, atol=1e-7)


def test_solve_names_the_motion_and_the_unit(cli: Run, tmp_path: Path) -> None:
    drill = ('follows = "feed"                     # the direction of the feed at each point', 'follows = "tool"')
    out = " ".join(output_of(cli("solve", str(_written(tmp_path, drill, count=12)))).split())
    assert_words(out, "max F: rotation about the tool's axis at each point", "(in/rad)² along")
