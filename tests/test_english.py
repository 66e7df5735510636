"""The check of the project's English refuses what its rules name, and nothing else."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))
import english

ROOT = Path(__file__).parents[1]

MODULE = '''
def f(name):
    """Do something.

    Args:
        name: {description}

    Raises:
        ValueError: of any kind.
    """
    raise ValueError("{message}")
'''


def faults(path: Path, text: str, rules: english.Rules | None = None) -> list[str]:
    path.write_text(text, encoding="utf-8")
    return list(english.faults(path, rules or english.rules(ROOT / "bench" / "english.toml")))


@pytest.mark.parametrize("first", ["of", "as", "that", "Whose", "what"])
def test_descriptions_that_do_not_stand_alone_are_refused_with_their_line(tmp_path: Path, first: str) -> None:
    (line,) = faults(tmp_path / "a.py", MODULE.format(description=f"{first} the joint.", message="name: empty"))
    assert line.startswith(f"{tmp_path.as_posix()}/a.py:6: name: begins with '{first.lower()}'")
    assert not faults(tmp_path / "a.py", MODULE.format(description="name of the joint.", message="name: empty"))


def test_words_with_a_replacement_are_refused_in_messages_comments_and_documents(tmp_path: Path) -> None:
    message = MODULE.format(description="name of the joint.", message="a cannot stand beside b")
    assert "write 'conflicts with'" in faults(tmp_path / "a.py", message)[0]
    assert "write 'provably'" in faults(tmp_path / "a.py", "x = 1  # surely\n")[0]
    assert "write 'provably'" in faults(tmp_path / "a.md", "It surely holds.\n")[0]
    assert "write 'conflicts with'" in faults(tmp_path / "a.md", "It cannot\nstand beside b.\n")[0]
    assert not faults(tmp_path / "a.py", 'x = {"surely": 1}\n'), "keys are no sentences"
    assert not faults(tmp_path / "a.md", "```\nsurely\n```\n"), "blocks of code are no sentences"


def test_sentences_of_documents_have_at_most_35_words(tmp_path: Path) -> None:
    assert not faults(tmp_path / "a.md", "word " * 34 + "end. Next one.\n")
    (line,) = faults(tmp_path / "a.md", "First.\n\n" + "word\n" * 35 + "end.\n")
    assert "a.md:3: a sentence of 36 words" in line
    assert not faults(tmp_path / "a.md", "| " + "word " * 50 + "|\n"), "rows of tables are no sentences"


def test_an_exception_names_file_text_and_reason(tmp_path: Path) -> None:
    list_of_words = tmp_path / "rules.toml"
    exception = (
        '[[words]]\npattern = "surely"\ninstead = "provably"\n[[exceptions]]\nfile = "FILE"\ntext = "surely, he"\n'
    )
    list_of_words.write_text(exception.replace("FILE", (tmp_path / "a.md").as_posix()))
    with pytest.raises(SystemExit, match="reason: missing for 'surely, he'"):
        english.rules(list_of_words)
    list_of_words.write_text(list_of_words.read_text() + 'reason = "a quotation"\n')
    known = english.rules(list_of_words)
    assert not faults(tmp_path / "a.md", '"It is surely, he said."\n', known)
    assert faults(tmp_path / "b.md", '"It is surely, he said."\n', known)


def test_each_exception_is_used() -> None:
    """An exception whose text is gone goes too."""
    for file, text in english.rules(ROOT / "bench" / "english.toml").exceptions:
        read = " ".join((ROOT / file).read_text(encoding="utf-8").split())
        assert text in read, (file, text)
