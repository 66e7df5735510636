"""What the tests of the command line share."""

import sys
from collections.abc import Callable

import pytest

from screwsynth.nlp.cli import run as command_line

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """The command line in this process: exit status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["screwsynth", *arguments])
        capfd.readouterr()
        code = command_line()
        out, err = capfd.readouterr()
        return code, out, err

    return run
