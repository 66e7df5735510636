"""Control characters, marks of direction and newlines from a case reach terminals and comments of C only escaped."""

import unicodedata
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from builders import Run, saved

from screwsynth.nlp import generate_c, load_case
from screwsynth.nlp.case.source import find_case

# Colour, title of the window, bell, carriage return, newline, marks of direction, a space without width.
EVIL = "\\u001b[31mred \\u001b]0;owned\\u0007 \\r\\nnew \\u202eright \\u2066 \\u200b \\u0085 \\u2028 \\u007f"
UNIT = "\\u001b[7m\\u202e\\r\\nnew"
SIGNS = ["\x1b", "\x07", "\r", "\u202e", "\u2066", "\u200b", "\x85", "\u2028", "\x7f"]


@pytest.fixture
def case(tmp_path: Path) -> str:
    text = find_case("paper-4.1-helical").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("title", "name =", "length ="))]
    text = "\n".join(lines).replace("[units]", f'[units]\nlength = "{UNIT}"', 1)
    text = text.replace("[[task]]", f'[[task]]\nname = "{EVIL}"', 1)
    return str(saved(tmp_path / "case.toml", f'title = "{EVIL} 日本\u3000語"\n{text}\n[solve]\nstarts = 2\n'))


def controls(text: str) -> list[str]:
    return [char for char in text if char != "\n" and unicodedata.category(char) in ("Cc", "Cf", "Zl", "Zp")]


@pytest.mark.parametrize("command", ["solve", "evaluate", "certify", "check"])
def test_on_the_terminal(command: str, case: str, cli: Run) -> None:
    _, out, err = cli(command, case)
    assert not controls(out + err)
    assert "\nnew" not in out
    assert command == "check" or "日本\u3000語" in out
    assert command == "check" or "\\x1b[31mred" in out.replace("\n", "")


def test_as_markdown_and_junit(case: str, cli: Run) -> None:
    with open(case, "a", encoding="utf-8") as file:
        file.write(
            f'[[published]]\nquantity = "F"\nvalue = 1\nsource = "{EVIL}"\nreproduced = false\nbecause = "{EVIL}"\n'
        )
    _, out, _ = cli("check", case, "--markdown")
    assert "red" in out
    assert not controls(out)
    _, out, _ = cli("check", case, "--junit", "-")
    assert not controls(out)
    ET.fromstring(out)


def test_in_comments_of_c(case: str) -> None:
    files = generate_c(load_case(case), "")
    assert any("[31mred" in text for text in files.values())
    for name, text in files.items():
        assert not [char for char in controls(text) if char != "\t"], name
        assert not any(sign in text for sign in SIGNS), name
