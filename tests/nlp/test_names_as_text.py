"""Names that a spreadsheet would compute, or a viewer of Markdown would show as a page, are text in files."""

import csv
import html
import io
import re
from pathlib import Path

import pytest
from builders import Run, edited, saved, saved_with_robot

from screwsynth.nlp import generate_c, load_case
from screwsynth.nlp.output.sweeptable import table_points
from screwsynth.nlp.system.csvtext import csv_row, csv_text, text_of_cell
from screwsynth.nlp.system.markdown import markdown_text

FORMULAS = ["=1+1", "+1+cmd|' /C calc'!A0", "-2+3+cmd|' /C calc'!A0", "@SUM(1)", '=HYPERLINK("http://x")', "-a", "\t=1"]
#: What the program writes itself, beginning with a sign.
NUMBERS = [
    "-1",
    "+0.25",
    "-1e-300",
    "-.5",
    "-inf",
    "+1 mm/mm",
    "+737.3 F per 1",
    "-0.2907 F/(mm N)",
    "-90 .. 90",
    "-0.1, 0.2, -3",
    "-1.5; 2",
    "-5 to 5 deg",
    "-",
    "+",
]
ROBOT = """
name = "<script>alert(1)</script> | [a](http://b) `c` _d_ *e* & www.f.g @h"
home = [0, 0, "h"]
[dimensions]
rb = { typical = 1.0 }
rp = { typical = 0.6 }
h = { typical = 1.1 }
[[limb]]
repeat = { count = 3 }
points = { B = ["rb", 0, 0], A = ["rp", 0, "h"] }
joints = [
  { type = "R", at = "B", axis = "y" },
  { type = "P", at = "B", axis = "A - B", actuated = true },
  { type = "S", at = "A" },
]
"""
CASE = """
title = "<img src=x onerror=alert(1)>"
[robot]
file = "robot.toml"
parameters = { rb = 1, rp = 0.6, h = { min = 1, max = 1.2 } }
[pose]
position = [0, 0, 1.1]
[[task]]
name = "=1+1*cmd"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[task]]
name = "@b"
sense = "max"
axis = [1, 0, 0]
point = [0, 0, 1.1]
pitch = 0
"""


@pytest.mark.parametrize("text", FORMULAS)
def test_cells_that_are_formulas_are_quoted(text: str) -> None:
    (cell,) = csv_row([text])
    assert cell == f"'{text}"
    assert text_of_cell(cell) == text
    ((read, _),) = list(csv.reader(io.StringIO(csv_text([text, "x"], []))))
    assert read == f"'{text}"


@pytest.mark.parametrize("text", [*NUMBERS, "a=b", "x -1", "", "'quoted", "M3"])
def test_numbers_and_other_texts_stay_as_they_are(text: str) -> None:
    assert csv_row([text, -1.5, None]) == [text, -1.5, None]
    assert text_of_cell(text) == text


def test_no_table_of_a_case_begins_a_cell_with_a_formula(tmp_path: Path, cli: Run) -> None:
    path, out = saved_with_robot(tmp_path, ROBOT, CASE), tmp_path / "out.csv"
    assert cli("solve", path, "--starts", "4", "--csv", str(out))[0] == 0
    cells = [cell for row in csv.reader(io.StringIO(out.read_text(encoding="utf-8"))) for cell in row]
    assert {"'=1+1*cmd", "'@b"} <= set(cells)
    assert all(csv_row([each]) == [each] for each in cells if each[:1] in ("=", "+", "-", "@"))
    # Numbers stay numbers.
    cli("evaluate", "paper-4.1-helical", "--csv", str(out))
    signed = [each for each in re.split(r"[,\n]", out.read_text(encoding="utf-8")) if re.match(r"-\d\S*$", each)]
    assert len(signed) > 10
    assert all(float(each) <= 0 for each in signed)


def test_a_sweep_of_numbers_is_read_again(tmp_path: Path, cli: Run) -> None:
    single = CASE[: CASE.rindex("[[task]]")]
    path, out = saved_with_robot(tmp_path, ROBOT, single), tmp_path / "out.csv"
    assert cli("sweep", path, "--over", "rp=0.5:0.6:2", "--starts", "2", "--jobs", "1", "--out", str(out))[0] == 0
    points = table_points(str(out))
    assert len(points) == 2
    assert all(each.F > 0 and not each.active.startswith("'") for each in points)


@pytest.mark.parametrize(
    ("name", "page"),
    [
        ("<script>a</script>", "&lt;script&gt;a&lt;/script&gt;"),
        ("a|b `c` [d](e)", "a\\|b \\`c\\` \\[d\\](e)"),
        ("*a* _b_ c_d ~~e~~", "\\*a\\* \\_b\\_ c_d \\~\\~e\\~\\~"),
        ("http://a www.b x@y", "http&#58;//a www&#46;b x&#64;y"),
        ("a & b; &lt;", "a &amp; b; &amp;lt;"),
        ("back\\slash\nline", "back\\\\slash\\\\nline"),
        ("paper-4.1-helical", "paper-4.1-helical"),
    ],
)
def test_names_in_markdown_are_shown_as_they_are_written(name: str, page: str) -> None:
    assert markdown_text(name) == page
    # A viewer takes entities and marks away again.
    shown = html.unescape(re.sub(r"\\([\\`*\[\]|~_])", r"\1", page))
    assert shown == name.replace("\n", "\\n")


def test_pages_of_exports_have_names_as_text(tmp_path: Path, cli: Run) -> None:
    fixed = edited(CASE, ("h = { min = 1, max = 1.2 }", "h = 1.1"))
    path, folder = saved_with_robot(tmp_path, ROBOT, fixed), tmp_path / "out"
    status, _, err = cli("export", path, "--out", str(folder), "--format", "csv")
    assert (status, err) == (0, "")
    page = (folder / "README.md").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    outside = re.sub(r"`[^`\n]*`", "", page.replace("\\`", ""))
    assert not re.search(r"<[a-z/!]|(?<!\\)\[a\]|http://|www\.", outside)
    single = edited(CASE[: CASE.rindex("[[task]]")], ('"robot.toml"', f'"{tmp_path}/robot.toml"'))
    files = generate_c(load_case(str(saved(tmp_path / "c.toml", single))))
    assert files["README.md"].startswith("# &lt;img src=x onerror=alert(1)&gt;\n")
