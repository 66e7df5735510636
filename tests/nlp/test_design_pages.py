"""Pages of trade-offs and of fronts: the designs that they draw, and where other limits become active."""

import base64
import itertools
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from builders import TWO_GOALS, Run, output_of, saved

LIMIT = "limits.leg_length.max"


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
        assert f"{LIMIT} = {point['value']:.5g} in" in words
        assert f"F = {point['F']:.6g}" in words
        assert f"x2 = {point['parameters']['x2']:.5g}" in words
        # The robot has six limbs in each picture, which has no words.
        names = [each.get("id", "") for each in picture.iter()]
        assert {f"limb {k}{side}" for k in (1, 2, 3) for side in "+-"} <= set(names)
        assert not [name for name in names if name.startswith("text_")]
    lines = re.findall("<li>(.*?)</li>", text[text.index('id="bends"') :].split("</ul>")[0])
    changed = [(a["value"], b["value"]) for a, b in itertools.pairwise(points) if set(a["active"]) != set(b["active"])]
    assert changed
    assert len(lines) == len(changed) == text.count('class="bound"')
    for line, (before, after) in zip(lines, changed, strict=True):
        assert line.startswith(f"Between {LIMIT} = {before:.5g} in and {LIMIT} = {after:.5g} in: ")


def test_all_designs_have_one_scale(tmp_path: Path, cli: Run) -> None:
    page = tmp_path / "page.html"
    case = str(saved(tmp_path / "case.toml", TWO_GOALS))
    goals = ("--goal", "max F:up", "--goal", "max F:side")
    output_of(cli("pareto", case, *goals, "--points", "3", "--html", str(page)))
    figures = figures_of(page.read_text())
    assert len(figures) == 3
    # The base is the same in all designs, so it has the same place and size in all pictures.
    bases = [
        ElementTree.tostring(next(each for each in svg.iter() if each.get("id") == "plate base")) for _, svg in figures
    ]
    assert len(set(bases)) == 1
    # The platform is higher or lower.
    assert (
        len(
            {ElementTree.tostring(next(e for e in svg.iter() if e.get("id") == "plate platform")) for _, svg in figures}
        )
        == 3
    )


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (["a"], ["a", "b"], "b becomes active"),
        (["a", "b"], ["c", "d"], "c, d become active; a, b no longer are"),
        (["a"], [], "a no longer is"),
    ],
)
def test_changes_of_the_active_set_in_words(before: list[str], after: list[str], words: str) -> None:
    from screwsynth.nlp.output.report.designs import changed_words  # noqa: PLC0415

    assert changed_words(before, after) == words
