"""Ctrl-C in every command, and limits of time: a sentence, a status, and no file that is not whole."""

from __future__ import annotations

import json
import math
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event
from types import FrameType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
import reachy
from builders import Run, assert_words, case_from, rows_of, saved
from hexapods import SMALL as SMALL_WORKSPACE

import screwsynth.nlp
from screwsynth.nlp import InputError, Status, certify, interruption, load_case, load_result, pareto, solve
from screwsynth.nlp.cli.app import SUMMARIES
from screwsynth.nlp.interruption import (
    is_requested,
    one_call,
    one_search,
    reason_of,
    seconds_left,
    stop_if_requested,
    within,
)
from screwsynth.nlp.output.sweeptable import sweep
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.enclosure import tape
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.results.tradeoff import TradeoffResult

# Eight poses of a hexapod with twelve free numbers and an actuator: long set-up, long starts.
_ANGLES = [-35, 25, 85, 95, 155, 215]
EIGHT = "\n".join(
    [
        '[units]\nlength = "mm"\n[robot]\nmodel = "hexapod"\n[robot.parameters]',
        *(f"base_{k + 1} = [{{ min = {90 + k}, max = {110 + k} }}, {(-1) ** k * 40 + k}, 0]" for k in range(6)),
        *(f"platform_{k + 1} = [{{ min = {40 + k}, max = {60 + k} }}, {(-1) ** k * 50 - k}, 0]" for k in range(6)),
        *(f"[[pose]]\nposition = [{10 * k}, {-5 * k}, {300 + 6 * k}]" for k in range(8)),
        "[limits]\nleg_length = { min = 100, max = 500 }",
        '[[task]]\nsense = "max"\naxis = [0, 1, 2]\npoint = [0, 0, 300]\npitch = 2',
        "[solve]\nstarts = 60000",
    ]
)
OVER = ("--over", "limits.leg_length.max=400:500:200")
watches_threads = pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="watches the threads of a process")

#: Seconds after which a command hangs, on any machine.
_HANGS = 600.0
SENTENCE = "screwsynth: interrupted: "


class Ended(NamedTuple):
    """The exit status, and what the terminal showed."""

    status: int
    shown: str


def interrupted(after: float | str, *arguments: str) -> Ended:
    """Run a command in a pseudo-terminal and press Ctrl-C after so many seconds, or once a text is shown.

    Seconds count from where the command's own thread works: before, the interpreter itself is starting.
    """
    child, terminal = pty.fork()
    if child == 0:
        os.environ["COLUMNS"] = "100"
        os.execv(sys.executable, [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments])  # noqa: S606
    shown, pressed, began, works_since = b"", 0.0, time.monotonic(), 0.0
    while True:
        ready, _, _ = select.select([terminal], [], [], 0.01)
        now = time.monotonic()
        if ready:
            try:
                part = os.read(terminal, 65536)
            except OSError:
                part = b""
            if not part:
                break
            shown += part
        if not works_since and len(os.listdir(f"/proc/{child}/task")) > 1:
            works_since = now
        elapsed = now - works_since if works_since else -1.0
        is_time = after.encode() in shown if isinstance(after, str) else elapsed >= after
        if not pressed and is_time:
            os.write(terminal, b"\x03")
            pressed = now
        if now - began > _HANGS:
            os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    assert pressed, f"the command ended before the key was pressed: {shown!r}"
    return Ended(os.waitstatus_to_exitcode(status), shown.decode())


def plain(shown: str) -> str:
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown).replace("^C", "")


@pytest.fixture
def case(tmp_path: Path) -> str:
    return str(saved(tmp_path / "eight.toml", EIGHT))


#: Seconds: imports, set-up, starts. The commands share the set-up, so each has every second moment, in turns.
MOMENTS = (0.0, 0.1, 0.3, 0.6, 1.0, 1.8)
OPTIONS = {
    "report": ("--out", "page.html"),
    "solve": (),
    "certify": (),
    "check": (),
    "tradeoff": (*OVER, "--html", "page.html"),
    "sweep": (*OVER, "--engine", "ipopt", "--jobs", "2", "--out", "out.csv"),
}


def check_interrupted(ended: Ended, folder: Path) -> None:
    """Refuse an end without its sentence, and files that are not whole."""
    assert ended.status == 130, ended
    assert SENTENCE in plain(ended.shown)
    assert not re.search("Traceback|Exception", ended.shown)
    left = {each.name: each for each in folder.iterdir()}
    assert set(left) <= {"eight.toml", "page.html", "out.csv.journal"}
    if "page.html" in left:
        assert left["page.html"].read_text(encoding="utf-8").rstrip().endswith("</html>")


@pytest.mark.parametrize(
    ("command", "after"),
    [
        pytest.param(each, t, marks=[pytest.mark.soak] if t > 0.1 or each != "solve" else [])
        for k, each in enumerate(OPTIONS)
        for t in (MOMENTS if each == "solve" else MOMENTS[k % 2 :: 2])
    ],
)
@watches_threads
def test_at_any_moment(command: str, after: float, case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(Path(case).parent)
    check_interrupted(interrupted(after, command, case, *OPTIONS[command]), Path(case).parent)


@watches_threads
def test_children_of_these_tests_can_be_interrupted(children_can_be_interrupted: Callable[[], None]) -> None:
    """Where the tests run without interrupts, as in a shell's background job."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        children_can_be_interrupted()
        assert callable(signal.getsignal(signal.SIGINT))
        words = subprocess.run(["cat", "/proc/self/status"], capture_output=True, text=True, check=True).stdout
    finally:
        signal.signal(signal.SIGINT, before)
    ignored = next(int(line.split()[1], 16) for line in words.splitlines() if line.startswith("SigIgn:"))
    assert not ignored >> (signal.SIGINT - 1) & 1


@watches_threads
def test_a_command_that_is_started_without_interrupts_stays_so(tmp_path: Path) -> None:
    """As a shell's background job, which Ctrl-C for the one before it does not end."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        command = [sys.executable, "-P", "-m", "screwsynth.nlp", "solve", "paper-4.3", "--starts", "1", "--json", "-"]
        running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    finally:
        signal.signal(signal.SIGINT, before)
    while running.poll() is None and len(os.listdir(f"/proc/{running.pid}/task")) < 2:
        time.sleep(0.001)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate()
    assert (running.returncode, err) == (0, b"")
    assert json.loads(out)["status"] == "optimal"


@watches_threads
def test_an_interrupted_sweep_says_how_many_points_are_kept(case: str, tmp_path: Path) -> None:
    out = tmp_path / "sweep.csv"
    grid = ("--over", "limits.leg_length.max=400:500:200", "--engine", "ipopt", "--starts", "1", "--jobs", "1")
    ended = interrupted(" of 200 points,", "sweep", case, *grid, "--out", str(out))
    assert ended.status == 130
    rows = len(out.with_name("sweep.csv.journal").read_text(encoding="utf-8").splitlines()) - 1
    assert 0 < rows < 200
    words = "".join(plain(ended.shown).split())
    assert f"{rows} of 200 points are in {out}.journal: the same command continues from there".replace(" ", "") in words


@watches_threads
def test_an_interrupted_solve_shows_its_best_answer(case: str, tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    ended = interrupted(", best ", "solve", case, "--json", str(result))
    assert ended.status == 130
    words = plain(ended.shown)
    assert_words(words, "stopped before the end: best F so far = ", "optimality", "evidence", "base_1_x")
    assert '"status": "interrupted"' in result.read_text(encoding="utf-8")


@watches_threads
def test_an_interrupted_tradeoff_keeps_what_is_solved(case: str, tmp_path: Path) -> None:
    files = {option: tmp_path / f"curve.{option}" for option in ("json", "csv", "page")}
    outputs = [word for option, path in files.items() for word in (f"--{option}", str(path))]
    ended = interrupted("2 of 200 values solved", "tradeoff", case, *OVER, "--starts", "2", *outputs)
    assert ended.status == 130
    result = load_result(files["json"])
    assert isinstance(result, TradeoffResult)
    points = result.points
    solved = [point for point in points if point.status is Status.OPTIMAL]
    assert 2 <= len(solved) < len(points) == 200
    assert list(points[: len(solved)]) == solved
    assert all(point.F is not None and math.isfinite(point.F) and point.parameters for point in solved)
    rest = {(point.status, point.F, point.tasks, point.parameters) for point in points[len(solved) :]}
    assert rest == {(Status.INTERRUPTED, None, (None,), None)}
    words = f"stopped before the end: {len(solved)} of 200 values are solved"
    assert words in plain(ended.shown)
    assert f"{words[0].upper()}{words[1:]}." in files["page"].read_text(encoding="utf-8")
    rows = rows_of(files["csv"].read_text(encoding="utf-8"))
    assert [row["status"] for row in rows] == [point.status.value for point in points]


ROOT = str(Path(screwsynth.nlp.__file__).parent)

SMALL = """
pose = { position = [0, 0, 30] }
task = [{ sense = "max", axis = [2, 2, 1], point = [2, 3, 6], pitch = 1 }]
limits = { leg_length = { min = 20, max = 50 } }
solve = { starts = 2 }
[robot]
model = "stewart-gough"
parameters = { x1 = { min = 10, max = 14 }, x2 = 8, x3 = 30, x4 = { min = 5, max = 20 } }
"""
FIXED = SMALL.replace("{ min = 10, max = 14 }", "12").replace("{ min = 5, max = 20 }", "11") + (
    "[workspace]\nposition = [{ min = -0.5, max = 0.5 }, 0, { min = 29, max = 31 }]\n"
)
#: Arguments of each command; names of files stand for files in the folder of the test.
COMMANDS: dict[str, tuple[str, ...]] = {
    "solve": ("small.toml", "--json", "out.json", "--csv", "out.csv"),
    "report": ("small.toml", "--out", "out.html"),
    "view": ("small.toml", "--out", "out.html", "--no-open"),
    "tradeoff": ("small.toml", "--over", "x2=7:9:3", "--starts", "1", "--json", "out.json", "--csv", "out.csv"),
    "sweep": (
        *("small.toml", "--over", "x2=7,8", "--engine", "ipopt", "--starts", "1", "--jobs", "1", "--out", "out.csv"),
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
    texts = {"small.toml": SMALL, "fixed.toml": FIXED, "path.csv": along, "given.csv": "x,y,z\n0,0,30\n"}
    for name, text in (texts | {"model.xml": reachy.mjcf()}).items():
        saved(tmp_path / name, text)
    return tmp_path


class Stopped(NamedTuple):
    """Exit status, standard error, files with their texts, and number of calls."""

    status: int
    err: str
    files: dict[str, str]
    calls: int


Press = Callable[..., Stopped]


def files_of(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text("utf-8") for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def press(cli: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Press:
    """A command in which Ctrl-C is pressed at a call."""

    def run(n: int, *arguments: str) -> Stopped:
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
            signals = SimpleNamespace(SIGINT=2, getsignal=lambda _: None, default_int_handler=0)
            patch.setattr(interruption, "signal", signals)
            patch.setattr(interruption.os, "_exit", leave)
            status, err = interruption.INTERRUPTED, ""
            with key_at_call(n) as count, suppress(Left):
                status, _, err = cli(*arguments)
        if left:
            return Stopped(interruption.INTERRUPTED, *left[0], count[0])
        return Stopped(status, err, files_of(folder), count[0])

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
        assert SENTENCE in ended.err, (n, ended.err)
        assert not re.search("Traceback|Exception", ended.err)
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


# Left, raised while a generator is closed, is lost, as the end of a process would not be.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_says_that_it_is_interrupted(name: str, press: Press, folder: Path) -> None:
    press_at_moments(name, press, folder, 1 if name in ("report", "path", "view") else 2)  # a page takes seconds


CASE = "paper-4.3"
MEASURES = ("smallest_singular_value", "condition_number")
#: Seconds from one look of a search at the clock to the next.
STEP = 0.01


class Clock:
    """A clock that moves only where a test says so; `jump` is what it moves by after its first look."""

    def __init__(self) -> None:
        self.now, self.jump = 0.0, 0.0

    def perf_counter(self) -> float:
        now = self.now
        self.now, self.jump = self.now + self.jump, 0.0
        return now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[Clock]:
    clock = Clock()
    monkeypatch.setattr(interruption, "time", SimpleNamespace(perf_counter=clock.perf_counter))
    yield clock
    assert seconds_left() == math.inf


def test_blocks_take_from_the_time_that_is_left(clock: Clock) -> None:
    with within(None):
        assert seconds_left() == math.inf
    with within(8.0, 0.5):
        with within(100.0):  # no later than the block around it
            assert seconds_left() == 8.0
        with one_search():
            assert seconds_left() == 4.0
            with one_search(3.0):  # a search within a search has all of its time
                assert seconds_left() == 3.0
        clock.now = 4.0
        with one_search():
            assert seconds_left() == 2.0
            clock.now = 6.0
            assert is_requested()
        assert not is_requested()
        clock.now = 9.0
        assert (seconds_left(), is_requested()) == (0.0, True)
    assert not is_requested()


def test_an_interrupt_between_two_instructions_leaves_no_time_limit() -> None:
    @one_call
    def work() -> None:
        interruption._end.set(interruption._End(at=0.0))  # as in ``within``, before its block begins
        assert seconds_left() == 0
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert seconds_left() == np.inf


def test_only_a_search_is_stopped_in_its_set_up(clock: Clock) -> None:
    def search() -> str:
        stop_if_requested()
        clock.now = 1.0
        stop_if_requested()
        raise AssertionError

    with within(0.5):
        assert reason_of(search) == "the time is over"
        stop_if_requested()


def test_set_up_of_the_whole_box_ends_with_the_time(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    nlp = formulate(load_case(CASE))
    compiled: list[str] = []
    real = tape._TapeWriter.put_formula

    def counted(*arguments: Any) -> None:  # noqa: ANN401
        compiled.append("operation")
        clock.now = 10.0
        real(*arguments)

    monkeypatch.setattr(tape._TapeWriter, "put_formula", counted)
    monkeypatch.setattr(tape, "_LOOK", 8)
    found = certify_program(nlp, nlp.start, time_limit=5.0)
    assert (found.status, found.boxes, found.open) == (CertificateStatus.INCOMPLETE, 0, 1)
    assert found.bound == math.inf
    assert 0 < len(compiled) <= 8
    clock.now = 0.0
    with within(1.0):
        clock.now = 2.0
        over = certify_program(nlp, nlp.start)
    assert (over.status, over.bound, over.open) == (CertificateStatus.INCOMPLETE, math.inf, 1)
    assert over.reason.startswith("stopped after")


def test_all_searches_of_a_workspace_share_one_time(tmp_path: Path) -> None:
    """The clock counts steps of searches: together they take no more than the whole time, and a few steps."""
    path = saved(tmp_path / "case.toml", SMALL_WORKSPACE)
    case = load_case(str(path))
    found = judge_workspace(case, time_limit=0.4, gap=1e-9, quantities=MEASURES, jobs=1)
    stopped = [each for each in found.extremes if "stopped after" in each.reason or each.reason == "the time is over"]
    assert len(stopped) >= 2
    assert all(each.outcome is Outcome.OPEN for each in stopped)
    seconds = [each.seconds for each in (*found.ranks, *found.extremes)]
    assert max(seconds) <= 0.2 + 3 * STEP
    assert sum(seconds) <= 0.4 + 3 * STEP * len(seconds)


def test_a_solve_shows_what_it_has_when_the_time_is_over(clock: Clock, cli: Run) -> None:
    clock.jump = 1e9
    status, out, err = cli("solve", CASE, "--time", "5", "--jobs", "1")
    assert (status, "stopped before the end" in out, err) == (1, True, "")
    for arguments, words in (
        (("tradeoff", CASE, "--over", "x1=10:14:3"), "before the first value is solved"),
        (("certify", CASE), "nothing is proved"),
        (("compare", CASE, "6-ups", "6-rus"), "the time is over: 0 of 2 robots"),
    ):
        clock.jump = 1e9
        status, out, err = cli(*arguments, "--time", "5", "--jobs", "1")
        assert status in (1, 2), err
        assert words in out + err
    with within(1.0):
        clock.now += 2.0
        assert solve(load_case(CASE)).status is Status.INTERRUPTED
        assert not certify(load_case(CASE)).is_proved


def test_a_time_that_is_not_positive_is_refused(cli: Run) -> None:
    for command, *more in (
        *(("solve",), ("certify",), ("workspace",), ("compare", "6-ups"), ("tradeoff", "--over", "x1=10:14:3")),
        *(("pareto", "--goal", "max F:x"), ("sweep", "--over", "x1=10:14:3", "--out", "table.csv")),
        ("report", "--out", "page.html"),
    ):
        for text in ("0", "-1", "nan"):
            ended = cli(command, CASE, *more, "--time", text)
            assert ended == (2, "", f"screwsynth: --time {text}: must be positive\n")


def test_a_sweep_whose_time_is_over_goes_on_later(clock: Clock, tmp_path: Path) -> None:
    case, over, out = load_case(CASE), {"x1": (10.0, 11.0, 12.0)}, tmp_path / "table.csv"

    def end(_before: int, _done: int, _total: int, _seconds: float) -> None:
        clock.now += 100.0

    options: dict[str, Any] = {"over": over, "starts": 1, "jobs": 1, "engine": "ipopt"}
    with pytest.raises(InputError, match=r"is over; 1 of 3 points are in .*: the same command continues"):
        sweep(case, out=out, time_limit=50.0, progress=end, **options)
    assert not out.exists()
    later = sweep(case, out=out, time_limit=50.0, **options)
    np.testing.assert_array_equal(later.F, sweep(case, **options).F)
