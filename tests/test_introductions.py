"""The worked introductions: their commands print what the pages show, and their pieces are those of the case files."""

import re
import tomllib
from pathlib import Path

import pytest
from builders import DOCS, docs_script, soaked

import screwsynth.cases
import screwsynth.nlp

SCRIPT = docs_script("introductions")
CASES = Path(screwsynth.cases.__file__).parent


def text_of(page: str) -> str:
    return (DOCS / f"{page}.md").read_text(encoding="utf-8")


def likeness(text: str) -> tuple[list[str], list[float]]:
    """The words of a text and its numbers, which differ between machines in their last digits."""
    number = r"[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?"
    words = [re.sub(number, "0", line).split() for line in text.splitlines()]
    return [" ".join(each) for each in words], [float(each) for each in re.findall(number, text)]


@pytest.mark.parametrize("page", soaked(SCRIPT.PAGES, [page for page in SCRIPT.PAGES if page != "intro-wrist"]))
def test_the_commands_of_a_page_print_what_it_shows(page: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("ezdxf")
    count = 0
    for command, shown, printed in SCRIPT.runs(text_of(page), tmp_path, slowly=False):
        (words, numbers), (new_words, new_numbers) = likeness(shown), likeness(printed)
        assert new_words == words, command
        assert new_numbers == pytest.approx(numbers, rel=1e-3, abs=1e-6), command
        count += 1
    assert count


@pytest.mark.parametrize("page", SCRIPT.INTRODUCTIONS)
def test_an_introduction_shows_its_case_file(page: str) -> None:
    text = text_of(page)
    (name,) = set(re.findall(r"\(\.\./cases/(.*?)\.toml\)", text))
    case = (CASES / f"{name}.toml").read_text(encoding="utf-8")
    pieces = re.findall(r"^```toml\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    own = re.findall(r"^<!-- file: .*? -->\n```toml\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    assert len(pieces) > 3
    assert [each for each in pieces if each not in case and each not in own] == []
    # The optimum that the page shows is the one that `screwsynth check` holds the case to.
    answer = rf"^\$ screwsynth solve {name} .*?\n(?:.*\n)??(?:largest|smallest) F = (\S+)"
    (shown,) = re.findall(answer, text, flags=re.MULTILINE)
    assert float(shown) == pytest.approx(tomllib.loads(case)["expect"]["F"], rel=1e-5)


def test_lines_of_an_output_are_chosen_by_their_beginnings() -> None:
    chosen = SCRIPT.chosen
    lines = ["head  1", "limb   a", "1  2", "1  3", "end"]
    assert chosen(lines, "") == lines
    assert chosen(lines, "none") == []
    assert chosen(lines, "1 | head") == ["1  2", "1  3", "head  1"]
    assert chosen(lines, "1! | limb a .. 1 3") == ["1  2", "limb   a", "1  2"]
    with pytest.raises(ValueError, match="no line begins with 'tail'"):
        chosen(lines, "tail")
