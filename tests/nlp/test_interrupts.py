"""Ctrl-C in a pseudo-terminal, at any moment and at the first time, of work that would not end for minutes.

At any call of any command it is pressed in test_interrupted_commands.py.
"""

import csv
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
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from screwsynth.nlp import Status, load_result
from screwsynth.nlp.results.tradeoff import TradeoffResult

# Eight poses of a hexapod with twelve free numbers and an actuator: long set-up, long starts.
_ANGLES = [-35, 25, 85, 95, 155, 215]
CASE = "\n".join(
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
pytestmark = pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="watches the threads of a process")

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
    path = tmp_path / "eight.toml"
    path.write_text(CASE, encoding="utf-8")
    return str(path)


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
    assert "Traceback" not in ended.shown
    assert "Exception" not in ended.shown
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
def test_at_any_moment(command: str, after: float, case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(Path(case).parent)
    check_interrupted(interrupted(after, command, case, *OPTIONS[command]), Path(case).parent)


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


def test_an_interrupted_sweep_says_how_many_points_are_kept(case: str, tmp_path: Path) -> None:
    out = tmp_path / "sweep.csv"
    grid = ("--over", "limits.leg_length.max=400:500:200", "--engine", "ipopt", "--starts", "1", "--jobs", "1")
    ended = interrupted(" of 200 points,", "sweep", case, *grid, "--out", str(out))
    assert ended.status == 130
    rows = len(out.with_name("sweep.csv.journal").read_text(encoding="utf-8").splitlines()) - 1
    assert 0 < rows < 200
    words = "".join(plain(ended.shown).split())
    assert f"{rows} of 200 points are in {out}.journal: the same command goes on from there".replace(" ", "") in words


def test_an_interrupted_solve_shows_its_best_answer(case: str, tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    ended = interrupted(", best ", "solve", case, "--json", str(result))
    assert ended.status == 130
    words = plain(ended.shown)
    for word in ("stopped before the end: best F so far = ", "verdict", "evidence", "base_1_x"):
        assert word in words
    text = result.read_text(encoding="utf-8")
    assert '"status": "interrupted"' in text


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
    rest = points[len(solved) :]
    assert {(point.status, point.F, point.tasks, point.parameters) for point in rest} == {
        (Status.INTERRUPTED, None, (None,), None)
    }
    words = f"stopped before the end: {len(solved)} of 200 values are solved"
    assert words in plain(ended.shown)
    assert words in files["page"].read_text(encoding="utf-8")
    rows = list(csv.DictReader(files["csv"].read_text(encoding="utf-8").splitlines()))
    assert [row["status"] for row in rows] == [point.status.value for point in points]
