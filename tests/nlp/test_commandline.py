"""How the words of a command line become the values of a command's function."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import pytest

from screwsynth.nlp import InputError
from screwsynth.nlp.cli.commandline import Argument, Command, Option

begun: list[object] = []


@contextmanager
def limited(seconds: float | None) -> Iterator[None]:
    begun.append(seconds)
    yield
    begun.append("ended")


def measure(
    case: Annotated[str, Argument("CASE", "A case.")],
    robots: Annotated[list[str] | None, Argument("[ROBOT]...", "Robots.")] = None,
    axis: Annotated[list[str] | None, Option("--axis", "X,Y,Z", "Axes.")] = None,
    count: Annotated[int, Option("--count", "N", "Number of measurements.", int)] = 0,
    seconds: Annotated[float | None, Option("--time", "SECONDS", "Time.", float, limited)] = None,
    whole: Annotated[bool, Option("--all", "", "Everything.")] = False,
) -> None:
    """Measure.

    Everything is measured.
    """
    begun.append((case, robots, axis, count, seconds, whole))


MEASURE = Command("measure", measure, "screwsynth measure case")


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("case", {}),
        ("case --axis -1,0,0 --axis=0,0,-1", {"axis": ["-1,0,0", "0,0,-1"]}),
        ("--count 3 case --count -4", {"count": -4}),
        ("case one --all two", {"robots": ["one", "two"], "whole": True}),
        ("case -- --all -x", {"robots": ["--all", "-x"]}),
        ("- --axis --all", {"case": "-", "axis": ["--all"]}),
        ("case --axis= --axis a=b=c", {"axis": ["", "a=b=c"]}),
    ],
)
def test_words_become_values(words: str, values: dict[str, Any]) -> None:
    defaults = {"case": "case", "robots": None, "axis": None, "count": 0, "seconds": None, "whole": False}
    assert MEASURE.read(words.split()) == defaults | values


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("", "CASE: is missing: a case"),
        ("case --al", "--al: no such option of measure; did you mean '--all'? "),
        ("case -5", "-5: no such option of measure; allowed: --axis, --count, --time, --all, --help"),
        ("case --all=1", "--all: takes no value"),
        ("--help=1", "--help: takes no value"),
        ("case --axis", "--axis: needs a value, X,Y,Z"),
    ],
)
def test_faults_are_told_in_a_sentence(words: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        MEASURE.read(words.split())
    assert str(refused.value).startswith(sentence)


def test_help_precedes_what_is_missing(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["-h"], ["--help"], ["case", "--count", "no number", "-h"]):
        assert MEASURE.read(words) is None
        MEASURE.run(words)
        shown = capsys.readouterr().out
        assert shown.startswith("Usage: screwsynth measure [OPTIONS] CASE [ROBOT]...\n\n  Measure.\n\n  Everything is ")
        assert "  --count N       Number of measurements.  [default: 0]\n" in shown
        assert "  CASE        A case.  [required]\n" in shown
        assert shown.endswith("\n\n  Example:\n    screwsynth measure case\n")


def test_a_command_runs_within_the_contexts_of_its_options() -> None:
    begun.clear()
    MEASURE.run(["case", "--time", "3", "--all"])
    MEASURE.run(["case"])
    first, second = ("case", None, None, 0, 3.0, True), ("case", None, None, 0, None, False)
    assert begun == [3.0, first, "ended", None, second, "ended"]
