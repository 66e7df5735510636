"""Ctrl-C in every command, at any call of its functions: a sentence, status 130, and no file that is not whole."""

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event
from types import FrameType, SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
import reachy
from builders import case_from

import screwsynth.nlp
from screwsynth.nlp import interruption, pareto
from screwsynth.nlp.cli.app import SUMMARIES

Run = Callable[..., tuple[int, str, str]]
ROOT = str(Path(screwsynth.nlp.__file__).parent)

SMALL = """
[robot]
model = "stewart-gough"
[robot.parameters]
x1 = { min = 10, max = 14 }
x2 = 8
x3 = 30
x4 = { min = 5, max = 20 }
[pose]
position = [0, 0, 30]
[[task]]
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
[limits]
leg_length = { min = 20, max = 50 }
[solve]
starts = 2
"""
FIXED = SMALL.replace("{ min = 10, max = 14 }", "12").replace("{ min = 5, max = 20 }", "11") + (
    "[workspace]\nposition = [{ min = -0.5, max = 0.5 }, 0, { min = 29, max = 31 }]\n"
)
#: Arguments of each command; names of files stand for files in the folder of the test.
COMMANDS: dict[str, tuple[str, ...]] = {
    "solve": ("small.toml", "--json", "out.json", "--csv", "out.csv"),
    "report": ("small.toml", "--out", "out.html"),
    "tradeoff": ("small.toml", "--over", "x2=7:9:3", "--starts", "1", "--json", "out.json", "--csv", "out.csv"),
    "sweep": (
        "small.toml",
        "--over",
        "x2=7,8",
        "--engine",
        "ipopt",
        "--starts",
        "1",
        "--jobs",
        "1",
        "--out",
        "out.csv",
    ),
    "pareto": (
        *("small.toml", "--goal", "max F", "--goal", "min limits.leg_length.max", "--points", "4", "--starts", "1"),
        *("--json", "out.json", "--csv", "out.csv"),
    ),
    "compare": ("small.toml", "case", "delta", "--starts", "1", "--json", "out.json", "--csv", "out.csv"),
    "certify": ("small.toml", "--gap", "0.2", "--starts", "1", "--json", "out.json", "--proof", "out.proof"),
    "verify-proof": ("given.proof",),
    "workspace": ("fixed.toml", "--gap", "0.2", "--json", "out.json", "--proof", "out.proof"),
    "path": (
        *("fixed.toml", "--along", "path.csv", "--json", "out.json", "--csv", "out.csv"),
        *("--plot", "out.svg", "--html", "out.html"),
    ),
    "check": ("small.toml", "fixed.toml", "--json", "out.json", "--junit", "out.xml"),
    "evaluate": ("fixed.toml", "--json", "out.json"),
    "inverse": ("fixed.toml", "--poses", "given.csv", "--csv", "out.csv"),
    "codegen": ("small.toml", "--no-measure", "--out", "folder"),
    "export": ("small.toml", "--format", "csv", "--out", "folder"),
    "models": (),
    "schema": (),
    "new": ("delta",),
    "import": ("model.xml", "--platform", "head", "--out", "out.toml"),
}


#: Number of calls of a quick command.
_FEW = 20_000

# Left, raised while a generator is closed, is lost, as the end of a process would not be.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


class Left(BaseException):
    """Stands for the end of the process."""


@contextmanager
def key_at_call(n: int) -> Iterator[list[int]]:
    """Press Ctrl-C at the n-th call of a function of the package, not while a file is written; counts the calls."""
    count = [0]

    def at_call(frame: FrameType, _: str, __: object) -> None:
        if frame.f_code.co_filename.startswith(ROOT) and frame.f_globals.get("__name__") != interruption.__name__:
            count[0] += 1
            if 0 < n <= count[0] and not interruption.WRITING.locked():
                sys.settrace(None)
                interruption._on_interrupt(2, None)

    before = sys.gettrace()
    sys.settrace(at_call)
    try:
        yield count
    finally:
        sys.settrace(before)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    along = "x,y,z\n0,0,29.5\n0.4,0,30\n0,0.1,30.5\n"
    texts = {
        "small.toml": SMALL,
        "fixed.toml": FIXED,
        "model.xml": reachy.mjcf(),
        "path.csv": along,
        "given.csv": "x,y,z\n0,0,30\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


class Ended(NamedTuple):
    """Exit status, standard error, files with their texts, and number of calls."""

    status: int
    err: str
    files: dict[str, str]
    calls: int


Press = Callable[..., Ended]


def files_of(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text("utf-8") for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def press(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Press:
    """A command in which Ctrl-C is pressed at a call."""

    def run(n: int, *arguments: str) -> Ended:
        left: list[tuple[str, dict[str, str]]] = []

        def leave(status: int) -> None:
            assert status == interruption.INTERRUPTED
            left.append((capfd.readouterr().err, files_of(folder)))
            # What catches every error goes on, as no process does that has ended: it must not wait for the lock.
            interruption.WRITING.release()
            raise Left

        with monkeypatch.context() as patch:
            for name in ("_awaited", "_parting", "_written", "_unfinished", "_answers", "_requested"):
                patch.setattr(interruption, name, type(getattr(interruption, name))())
            patch.setattr(
                interruption, "signal", SimpleNamespace(SIGINT=2, getsignal=lambda _: None, default_int_handler=0)
            )
            patch.setattr(interruption.os, "_exit", leave)
            status, err = interruption.INTERRUPTED, ""
            with key_at_call(n) as count, suppress(Left):
                status, _, err = cli(*arguments)
        if left:
            return Ended(interruption.INTERRUPTED, *left[0], count[0])
        return Ended(status, err, files_of(folder), count[0])

    return run


def check_file(name: str, text: str) -> None:
    """Refuse a file that is not whole."""
    assert not Path(name).name.startswith("."), name
    assert text.endswith("\n"), name
    if name.endswith(".json"):
        json.loads(text)
    if name.endswith(".html"):
        assert text.rstrip().endswith("</html>")


def press_at_moments(name: str, press: Press, folder: Path, moments: int) -> None:
    """Press at the first call, and at random others; ``bench/soundness`` does so at many more."""
    if name == "verify-proof":
        assert press(-1, "certify", "small.toml", "--gap", "0.5", "--starts", "1", "--proof", "given.proof").status == 0
    before = files_of(folder)
    whole = press(-1, name, *COMMANDS[name])
    assert whole.status in (0, 1), whole.err
    if whole.calls < _FEW:  # a first run of few calls has many of modules that are loaded
        whole = press(-1, name, *COMMANDS[name])
    rng = np.random.default_rng(len(name))
    for n in [1, *(1 + rng.random(moments) * whole.calls * 0.95).astype(int).tolist()]:
        for path in files_of(folder).keys() - before.keys():
            (folder / path).unlink()
        ended = press(n, name, *COMMANDS[name])
        assert ended.status == interruption.INTERRUPTED, (n, ended.err)
        assert "screwsynth: interrupted: " in ended.err, (n, ended.err)
        assert "Traceback" not in ended.err
        assert "Exception" not in ended.err
        for path, text in ended.files.items():
            assert text == before[path] if path in before else check_file(path, text) is None


def test_the_commands_are_those_of_help() -> None:
    assert set(SUMMARIES) == set(COMMANDS)


def test_an_interrupted_front_has_no_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    requested = Event()
    monkeypatch.setattr(interruption, "_requested", requested)
    case = case_from(SMALL, "small")
    found = pareto(case, ["max F", "min limits.leg_length.max"], points=6, progress=lambda *_: requested.set())
    assert len(found.points) == 2
    assert found.gaps == ()


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_says_that_it_is_interrupted(name: str, press: Press, folder: Path) -> None:
    press_at_moments(name, press, folder, 2 if name in ("report", "path") else 4)  # a page takes seconds
