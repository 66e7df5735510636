"""Order, captions, columns and colours of pages, in HTML and in a real browser."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import Run, assert_words, saved
from pages import Page

from screwsynth.nlp.output.report.stills import compact
from screwsynth.nlp.words.numbers import key_words, side_words, spaced

#: Key of a limit as a case file has it, such as ``limits.leg_length.max`` or ``leg_length.max``.
KEY = re.compile(r"\blimits\.[a-z]|\b[a-z]\w*\.(?:min|max)\b")
#: Elements that name a part of a page: their texts have no keys.
NAMES = r"<(h[1-3]|caption|figcaption|thead)\b[^>]*>(.*?)</\1>"


def names_in(text: str) -> list[str]:
    """Texts of headings, captions, headers of tables and labels of axes."""
    body = text.partition("<body>")[2]
    found = [each for _, each in re.findall(NAMES, body, re.DOTALL)]
    found += re.findall(r'<text[^>]*class="label[^"]*">(.*?)</text>', body)
    return [re.sub("<[^>]*>", " ", each) for each in found]


def check_names(text: str) -> None:
    """Check the form of the names of a page: no keys of limits, first letters, and names of all figures."""
    names = names_in(text)
    assert names
    assert [each for each in names if KEY.search(each)] == []
    captions = re.findall(r"<caption>(.*?)</caption>", text, re.DOTALL)
    assert [each for each in captions if each[:1] != each[:1].upper() or each.endswith(".")] == []
    figures = re.findall(r"<figcaption[^>]*>(.*?)</figcaption>", text, re.DOTALL)
    # The caption of the map is written by its script.
    assert [each for each in figures if each and not re.match(r"<b>[^<]+:?</b>", each)] == []
    shown = re.sub(r"<(script|style|pre|code)\b.*?</\1>", "", text.partition("<body>")[2], flags=re.DOTALL)
    assert "&lt;= " not in shown
    assert "&gt;= " not in shown


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("limits.leg_length.max", "maximum leg length"),
        ("p_y.min", "minimum p_y"),
        ("pose1_p_x.max", "maximum pose1_p_x"),
        ("limits.actuator.stroke_max", "actuator stroke max"),
        ("smallest leg_length.max, F", "smallest maximum leg length, F"),
        ("x1", "x1"),
    ],
)
def test_a_key_in_words(key: str, words: str) -> None:
    assert key_words(key) == words


def test_a_quantity_with_spaces() -> None:
    assert spaced("base_joint_angle") == "base joint angle"
    assert spaced("p_z") == "p_z"


@pytest.mark.parametrize("case", ["paper-4.1-helical", "paper-4.2", "hexapod-machining"])
def test_without_a_live_view_the_robot_comes_before_the_case_in_words(page: Callable[..., Page], case: str) -> None:
    found = page(case)
    sections = [a["id"] for tag, a in found.elements if tag == "section"]
    assert sections[:3] == ["robot", "result", "case"]
    assert "This page has no sliders: " in found.words
    check_names(found.text)
    # Every section is in the contents, which come before the robot.
    contents = found.text[found.text.index("<nav") : found.text.index("</nav>")]
    assert re.findall(r'href="#([^"]+)"', contents) == sections
    assert found.text.index("</nav>") < found.text.index("This page has no sliders")
    # A picture for both widths is in the frame of the view.
    stage = found.text[found.text.index('<div class="stage">') :]
    assert stage.index('id="view"') < stage.index('<source media="(max-width: 34rem)"') < stage.index("</figure>")


def test_pages_of_designs_name_limits_in_words(cli: Run, tmp_path: Path) -> None:
    case = "hexapod-machining"
    commands = {
        "Trade-off": ("tradeoff", case, "--over", "limits.leg_length.max=30:38:3", "--starts", "2"),
        "Pareto front": ("pareto", case, "--goal", "max F", "--goal", "min limits.leg_length.max", "--points", "3"),
    }
    for name, command in commands.items():
        page = tmp_path / f"{name}.html"
        assert cli(*command, "--html", str(page))[0] in (0, 1)
        text = page.read_text(encoding="utf-8")
        assert "maximum leg length" in text
        assert f'<p class="subtitle">{name}: {case}, robot stewart-gough' in text
        assert '<nav aria-label="Contents">' in text
        check_names(text)


@pytest.fixture
def sized(browser: Any, page_file: Callable[..., Path]) -> Iterator[Callable[..., Any]]:
    """The page of a case, or a file, in a window of a width, with a colour scheme."""

    def open_page(page: str | Path, width: int, scheme: str = "light") -> Any:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        browser.get((page_file(page) if isinstance(page, str) else page).as_uri())
        return browser

    yield open_page
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


#: Left, top, right and bottom of the first element of a selector.
BOX = "const {left, top, right, bottom} = document.querySelector(arguments[0]).getBoundingClientRect();"
BOX += " return [left, top, right, bottom];"


@pytest.mark.browser
def test_a_wide_window_has_two_columns_and_a_telephone_one(sized: Callable[..., Any]) -> None:
    for width, is_beside in ((1400, True), (420, False)):
        chrome = sized("paper-4.1-helical", width)
        assert chrome.execute_script("return document.documentElement.scrollWidth") <= width
        picture, rates = (chrome.execute_script(BOX, each) for each in (".stage", "#rates"))
        assert (rates[0] >= picture[2]) is is_beside
        assert (rates[1] >= picture[3]) is not is_beside
        if is_beside:
            assert rates[1] < picture[3]
            # Prose is not wider than a page of a book.
            prose = "[...document.querySelectorAll('main p:not(.controls)')].map((each) => each.clientWidth)"
            assert max(chrome.execute_script(f"return {prose}")) <= 46 * 16
        else:
            # The contents are one line, which scrolls.
            links = chrome.execute_script(BOX, "nav")
            assert links[3] - links[1] < 60


@pytest.mark.browser
def test_the_picture_stands_in_the_frame_until_the_view_is_drawn(browser: Any, sized: Callable[..., Any]) -> None:
    # A library that never ends leaves the page as it is before the view is drawn.
    hold = "globalThis.DecompressionStream = class { constructor() { this.readable = new ReadableStream();"
    hold += " this.writable = new WritableStream({ write: () => new Promise(() => {}) }); } };"
    done = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": hold})
    try:
        chrome = sized("paper-4.1-helical", 420)
        image = chrome.find_element("css selector", "img.still.chosen")
        assert chrome.execute_script("return document.documentElement.classList.contains('scripted')")
        assert image.is_displayed()
        (frame, still) = (chrome.execute_script(BOX, each) for each in (".stage", "img.still.chosen"))
        assert still[3] <= frame[3] + 1
        assert still[3] - still[1] > 200
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", done)


#: Right ends of the digits before the decimal point in a column of the rates, and their texts.
POINTS = """
return [...document.querySelectorAll(`#rates tbody .${arguments[0]}`)].map((cell) => {
  const head = cell.querySelector(".w") ?? cell;
  const range = document.createRange();
  range.selectNodeContents(head.firstChild ?? head);
  return [range.getBoundingClientRect().right, head.textContent, cell.querySelector(".w") !== null];
});"""
MOVE = """
const slider = document.getElementById("travel");
slider.value = arguments[0];
slider.dispatchEvent(new Event("input"));"""


@pytest.mark.browser
def test_rates_are_aligned_at_the_decimal_point_at_every_posture(sized: Callable[..., Any]) -> None:
    chrome = sized("hexapod-machining", 1000)
    for index in (None, 0, 33):
        if index is not None:
            chrome.execute_script(MOVE, index)
        rows = chrome.execute_script(POINTS, "rate")
        assert {len(text.lstrip("+\N{MINUS SIGN}")) for _, text, _ in rows} == {1, 2}
        assert all(is_aligned for *_, is_aligned in rows)
        assert max(right for right, *_ in rows) - min(right for right, *_ in rows) < 0.6
        assert not any("-" in text for _, text, _ in rows)


def light(colour: str) -> float:
    """Relative luminance of a colour such as ``rgb(18, 24, 30)``."""
    parts = [int(each) / 255 for each in re.findall(r"\d+", colour)[:3]]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_follows_the_colour_scheme(sized: Callable[..., Any], scheme: str) -> None:
    chrome = sized("hexapod-machining", 1000, scheme)
    ground = chrome.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (light(ground) < 0.1) is (scheme == "dark")
    for element in ("body", ".subtitle", "caption", "nav a", "#answer p", "thead th", "figcaption", ".chart text"):
        name = "fill" if element == ".chart text" else "color"
        colour = chrome.execute_script(
            "return getComputedStyle(document.querySelector(arguments[0])).getPropertyValue(arguments[1])",
            element,
            name,
        )
        contrast = sorted([light(colour) + 0.05, light(ground) + 0.05])
        assert contrast[1] / contrast[0] >= 4.5, element
    # Pictures are drawn on white, and inverted on a dark page.
    image = "return getComputedStyle(document.querySelector('main img.still')).filter"
    assert ("invert" in chrome.execute_script(image)) is (scheme == "dark")


def test_a_path_page_without_a_live_view_says_why(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("screwsynth.nlp.view.wasm.find_compiler", lambda: None)
    part, page = saved(tmp_path / "part.csv", "t,x,y,z\n0,0,0,20\n2,1,0,20.5\n"), tmp_path / "path.html"
    assert cli("path", "hexapod-linuxcnc", "--along", str(part), "--html", str(page), "--time", "1")[0] in (0, 1)
    found = Page(page.read_text(encoding="utf-8"))
    (note,) = re.findall(r"This page has no sliders: ([^<]*)\.<", found.text)
    assert_words(note, "WebAssembly")
    assert next(a["id"] for tag, a in found.elements if tag == "section") == "robot"
    assert [row[0] for row in found.tables["dimensions"][1:]] == ["x1", "x2", "x3", "x4"]
    check_names(found.text)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("footprint.base", "footprint base"),
        ("leg_length.max", "maximum leg length"),
        ("p_y.min", "minimum p_y"),
        ("leg_length limb 1- max", "leg length limb 1- max"),
        ("p_z max", "p_z max"),
    ],
)
def test_active_limits_in_words(name: str, words: str) -> None:
    assert side_words(name) == words


def test_a_picture_of_a_page_has_the_outlines_of_the_file_with_fewer_bytes() -> None:
    text = b'<path d="M 1.2345 20.00 \nL 3.0 -4.506  Q 10 0.5 7 8 z" style="fill: none"/>'
    assert compact(text) == b'<path d="M1.23 20L3 -4.5Q10 0.5 7 8z" style="fill: none"/>'
    outline = '<path d="M 1 2 \nL 3 4" style="fill: #17212b'
    edge, fill = f'{outline}; stroke: #ffffff"/>', f'{outline}"/>'
    merged = '<path d="M1 2L3 4" style="fill: #17212b; stroke: #ffffff; paint-order: stroke"/>'
    assert compact(f"{edge}\n{fill}".encode()) == merged.encode()
    assert compact(f"{fill}\n{edge}".encode()).count(b"<path") == 2
