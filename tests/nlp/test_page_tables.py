"""Tables of pages: aligned numbers, units, texts of all rows, minus signs; rounding noise of variables."""

import re

import numpy as np
import pytest
from builders import case_from

from screwsynth.nlp import solve
from screwsynth.nlp.output.report.markup import tag, with_signs
from screwsynth.nlp.output.report.tables import html_table
from screwsynth.nlp.results.rounding import FLAT
from screwsynth.nlp.words.designs import design_values
from screwsynth.nlp.words.text import TextTable


def rows_in(html: str) -> list[list[str]]:
    """Texts of the cells of the body of a table."""
    body = html.partition("<tbody>")[2]
    cells = (re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in body.split("</tr>")[:-1])
    return [[re.sub("<[^>]*>", "", cell) for cell in row] for row in cells]


def test_digits_before_the_point_have_one_width() -> None:
    table = TextTable(("", "x"), (("a", "-12.5"), ("b", "3"), ("c", "+100.25"), ("d", "none")))
    html = html_table(table, "numbers")
    widths = re.findall(r'<span class="w" style="--w:([\d.]+)">([^<]*)</span>', html)
    assert [text for _, text in widths] == ["\N{MINUS SIGN}12", "3", "+100"]
    (width,) = {float(each) for each, _ in widths}
    # Three digits and a sign, which is wider than a digit in some fonts.
    assert 4 <= width < 5
    assert [row[1] for row in rows_in(html)] == ["\N{MINUS SIGN}12.5", "3", "+100.25", "none"]
    # Names that begin with digits are no numbers.
    assert 'class="w"' not in html_table(TextTable(("", "limb"), (("a", "1-"), ("b", "10-"))), "names")


def test_units_stand_at_their_numbers_and_are_never_lost() -> None:
    table = TextTable(("", "value", "unit"), (("a", "2", "cm"), ("b", "30", "deg")), with_unit=(1,))
    assert rows_in(html_table(table, "units")) == [["a", "2 cm"], ["b", "30 deg"]]
    table = TextTable(("", "value", "unit"), (("a", "none", "cm"),), with_unit=(1,))
    assert rows_in(html_table(table, "units")) == [["a", "none", "cm"]]


def test_a_text_of_all_rows_of_a_long_table_is_said_once() -> None:
    def shown(count: int) -> str:
        rows = tuple((str(k), "12.5", "optimal", f"{k}", "") for k in range(count))
        return html_table(TextTable(("point", "x2\nin", "status", "F", "note"), rows), "points")

    assert "In all rows: x2 = 12.5 in, status: optimal." in shown(8)
    assert rows_in(shown(8)) == [[str(k), str(k)] for k in range(8)]
    assert len(rows_in(shown(7))[0]) == 5


def test_a_long_text_is_one_line_that_opens() -> None:
    text = ", ".join(f"leg_length limb {k} max" for k in range(20))
    html = html_table(TextTable(("point", "active"), tuple((str(k), f"{text} {k}") for k in range(20))), "points")
    assert html.count('<details class="cell">') == 20
    assert rows_in(html)[3][1] == f"{text} 3"
    assert '<div class="scroll tall"' in html


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-5 to -.5", "\N{MINUS SIGN}5 to \N{MINUS SIGN}.5"),
        ("(1, -2)", "(1, \N{MINUS SIGN}2)"),
        ("below 1e-12", "below 1e\N{MINUS SIGN}12"),
        ("limb 1-, 6-PUS, paper-4.1", "limb 1-, 6-PUS, paper-4.1"),
    ],
)
def test_negative_numbers_have_a_minus_sign_and_names_keep_their_hyphens(text: str, shown: str) -> None:
    assert with_signs(text) == shown
    assert tag("p", text) == f"<p>{shown}</p>"
    # A command is copied as it is.
    assert tag("code", text) == f"<code>{text}</code>"


CASE = """
units = {{ length = "{unit}" }}
pose = {{ position = [{{ min = -{p}, max = {p} }}, 0, {z}] }}
task = [{{ name = "up", sense = "max", axis = [0, 0, 1], pitch = inf }}]
solve = {{ starts = 2 }}
[robot]
model = "stewart-gough"
parameters = {{ x1 = {x1}, x2 = {x2}, x3 = 30, x4 = 20 }}
"""


@pytest.mark.parametrize(("unit", "per_m"), [("mm", 1000.0), ("cm", 100.0), ("m", 1.0)])
def test_noise_is_0_in_every_unit_and_a_small_value_is_not(unit: str, per_m: float) -> None:
    sizes = {"p": 0.02, "z": 0.2, "x1": 0.12, "x2": 0.05}
    case = case_from(CASE.format(unit=unit, **{name: size * per_m for name, size in sizes.items()}), "robot")
    outcome = solve(case, starts=2).outcomes[0]
    nlp, x = outcome.own.nlp, np.array(outcome.x)
    k = next(k for k, each in enumerate(nlp.program.variables) if each.name == "p_x")
    for part, is_noise in ((0.3 * FLAT, True), (30 * FLAT, False)):
        x[k] = part * nlp.scale[k]
        (text,) = [each for each in design_values(nlp, x) if each.startswith("p_x = ")]
        assert (text == f"p_x = 0 {unit}") == is_noise
