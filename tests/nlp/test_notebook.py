"""Answers that show themselves: in a line, as HTML, text, picture, page and plain data."""

import base64
import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from builders import EACH_CASE, Run, soaked

import screwsynth.nlp as sn
from screwsynth.models import hexapod, shown, stewart_gough, three_upu
from screwsynth.nlp.output.pictures import requirements


@pytest.fixture(scope="module")
def solution() -> sn.Solution:
    return sn.solve(sn.load_case("paper-4.1-helical"), starts=3)


@pytest.fixture(scope="module")
def certified() -> sn.Certified:
    return sn.certify(sn.load_case("paper-4.2-rotation"), starts=2, gap=1e-2)


def image(html: str) -> ElementTree.Element:
    """The drawing of a value that a notebook shows."""
    (data,) = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', html)
    return ElementTree.fromstring(base64.b64decode(data))


def cells(html: str) -> list[str]:
    return re.findall(r"<t[dh][^>]*>([^<]*)</t[dh]>", html)


def test_values_show_in_a_line(solution: sn.Solution, certified: sn.Certified) -> None:
    values = [sn.load_case(name) for name in sn.shipped_cases()]
    models = [stewart_gough(), hexapod(), three_upu()]
    program = sn.formulate(solution.case)
    searched = sn.solve_program(program, solution.case.search.but(2, 0))
    for value in (*values, *models, solution, certified, certified.certificate, program, program.program, searched):
        text = repr(value)
        assert len(text) <= 240
        assert "\n" not in text
        assert str(value) == text
    assert repr(solution.case) == "<Case 'paper-4.1-helical': robot 'stewart-gough', 4 variables, 1 task, 1 pose>"
    assert repr(hexapod()) == "<Model 'hexapod': 12 parameters, 6 limbs, 6 rows>"
    assert repr(solution) == "<Solution of 'paper-4.1-helical': optimal, F = 407.2107>"
    failed = sn.solve(replace(solution.case, search=sn.Search(starts=1, max_iterations=1)))
    assert "F =" not in repr(failed)
    assert failed.status.value in repr(failed)
    averaged = repr(sn.solve(sn.load_case("paper-4.2"), starts=2))
    assert "tasks by average" in averaged
    assert len(averaged) <= 240


def turning(task: str = "task", **rest: Any) -> sn.Case:  # noqa: ANN401 - parts of a case
    """A case of which nothing is free."""
    dimensions = {"x1": 2, "x2": 1, "x3": 0, "x4": 0.2}
    return sn.Case(stewart_gough(), dimensions, [0, 0, 3], [sn.Task([0, 0, 1, 0, 0, 0], name=task)], **rest)


def test_a_notebook_shows_table_and_drawing(solution: sn.Solution, certified: sn.Certified) -> None:
    for value, words in (
        (stewart_gough(), ["x1", "x2"]),
        (solution.case, ["x1", "p_x", "\N{MINUS SIGN}10 .. 10", "\N{MINUS SIGN}30 .. 30"]),
        (solution, ["p_x", "2+", "\N{MINUS SIGN}10 .. 10"]),
        (certified, ["p_z"]),
    ):
        html = value._repr_html_() or ""
        assert set(words) <= set(cells(html)), value
        assert image(html).tag.endswith("svg"), value
    html = certified.certificate._repr_html_() or ""
    assert "no point of the box" in html
    assert image(html).tag.endswith("svg")
    assert sn.html_of(stewart_gough()) == stewart_gough()._repr_html_()
    assert sn.html_of(3) is None


@pytest.mark.parametrize("name", soaked(EACH_CASE, ("reachy-mini", "paper-4.4-max")))
def test_cases_and_their_robots_are_drawn(name: str) -> None:
    case = sn.load_case(name)
    for value in (case, case.model):
        assert image(value._repr_html_() or "").tag.endswith("svg")


def test_text_of_a_case_is_escaped() -> None:
    case = turning("<script>alert(1)</script>", title="<b>bold</b>", limits=sn.Limits(sn.RateShare(0.9)))
    for value in (case, sn.solve(case)):
        html = value._repr_html_() or ""
        assert "<script>" not in html
        assert "<b>" not in html
        assert "&lt;b&gt;" in html
    assert repr(turning(name="a\nb\x1b")).startswith(r"<Case 'a\nb\x1b'")


def test_without_matplotlib_a_sentence_is_shown(solution: sn.Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requirements, "find_spec", lambda _: None)
    html = solution._repr_html_() or ""
    assert "pictures need matplotlib" in html
    assert "p_x" in cells(html)
    with pytest.raises(sn.InputError, match="pictures need matplotlib"):
        solution.plot()


def test_without_the_package_that_draws_a_notebook_shows_the_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "GROUP", "screwsynth.no-such-group")
    shown._view.cache_clear()
    try:
        assert stewart_gough()._repr_html_() is None
    finally:
        shown._view.cache_clear()


def test_the_table_is_what_the_command_prints(cli: Run) -> None:
    for name in ("paper-4.1-helical", "paper-4.2"):
        _, out, _ = cli("solve", name, "--starts", "2", "--all")
        printed = [line.rstrip() for line in out.splitlines()]
        assert sn.solve(sn.load_case(name), starts=2).table().splitlines() == printed
    narrow = sn.solve(sn.load_case("paper-4.1-helical"), starts=2).table(width=70)
    assert max(map(len, narrow.splitlines())) <= 70


def test_the_dictionary_is_the_result(solution: sn.Solution, certified: sn.Certified) -> None:
    for found in (solution, certified):
        assert found.to_dict() == sn.json_data(sn.result_of(found))
        json.dumps(found.to_dict(), allow_nan=False)
    assert certified.to_dict()["certificate"]


def test_a_solution_draws_itself(solution: sn.Solution, certified: sn.Certified, tmp_path: Path) -> None:
    picture = solution.plot()
    assert picture._repr_svg_() == picture.svg
    assert ElementTree.fromstring(picture.svg).tag.endswith("svg")
    assert len(repr(picture)) < 80
    assert solution.plot(tmp_path / "robot.svg").svg == (tmp_path / "robot.svg").read_text(encoding="utf-8")
    solution.plot(tmp_path / "robot.png")
    assert (tmp_path / "robot.png").read_bytes()[1:4] == b"PNG"
    assert certified.plot().svg
    with pytest.raises(sn.InputError, match="ends in"):
        solution.plot(tmp_path / "robot.txt")
    assert not (tmp_path / "robot.txt").exists()


def test_a_solution_writes_its_page_with_its_case(solution: sn.Solution, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    page = solution.report(file)
    assert page == file.read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert "starts = 32" not in solution.case.to_toml()
    assert "[robot.parameters]" in page
    with pytest.raises(sn.InputError, match="cannot be written"):
        solution.report(tmp_path / "no-folder" / "page.html")


def test_a_solve_loads_nothing_that_shows() -> None:
    code = (
        "import sys; from screwsynth.nlp import load_case, solve; s = solve(load_case('paper-4.2-rotation'), starts=1);"
        "repr(s); print(*(n for n in sys.modules if n.startswith('screwsynth.nlp.output') or n == 'rich'))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


# A font that stands in for letters of other scripts, and has no bold letters, as those of some systems.
DRAWING = """
import sys
from fontTools.ttLib import TTFont
from matplotlib import get_data_path
from matplotlib.font_manager import fontManager
font = TTFont(f"{get_data_path()}/fonts/ttf/DejaVuSans.ttf")
for record in font["name"].names:
    if record.nameID in (1, 4, 16):
        record.string = "Droid Sans Fallback"
font.save(sys.argv[1])
fontManager.addfont(sys.argv[1])
from screwsynth.models import stewart_gough
from screwsynth.nlp.output.pictures.fonts import families
assert "Droid Sans Fallback" in families()
assert "svg" in stewart_gough()._repr_html_()
"""


@pytest.mark.parametrize("folder", ["", "/dev/null/none"])
def test_advice_of_matplotlib_on_fonts_and_folders_is_not_on_stderr(folder: str, tmp_path: Path) -> None:
    command, env = ["-c", DRAWING, str(tmp_path / "font.ttf")], dict(os.environ)
    if folder:  # one that cannot be made, of which Matplotlib has much to say as it is imported
        command = ["-m", "screwsynth.nlp", "models", "6-rus", "--plot", str(tmp_path / "robot.svg")]
        env["MPLCONFIGDIR"] = folder
    ended = subprocess.run([sys.executable, "-P", *command], env=env, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
