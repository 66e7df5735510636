"""One time for a whole command or call: every search takes from what is left of it, and nothing more is claimed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from builders import Run, saved
from hexapods import SMALL

from screwsynth.nlp import InputError, certify, interruption, load_case, solve
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
from screwsynth.nlp.solver.status import Status

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
    path = saved(tmp_path / "case.toml", SMALL)
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


@pytest.mark.parametrize(
    "command", ["solve", "tradeoff", "pareto", "compare", "certify", "workspace", "sweep", "report"]
)
def test_a_time_that_is_not_positive_is_refused(command: str, cli: Run) -> None:
    more = {
        "tradeoff": ("--over", "x1=10:14:3"),
        "pareto": ("--goal", "max F:x"),
        "compare": ("6-ups",),
        "sweep": ("--over", "x1=10:14:3", "--out", "table.csv"),
        "report": ("--out", "page.html"),
    }
    for text in ("0", "-1", "nan"):
        status, _, err = cli(command, CASE, *more.get(command, ()), "--time", text)
        assert (status, err) == (2, f"screwsynth: --time {text}: must be positive\n")


def test_a_sweep_whose_time_is_over_goes_on_later(clock: Clock, tmp_path: Path) -> None:
    case, over, out = load_case(CASE), {"x1": (10.0, 11.0, 12.0)}, tmp_path / "table.csv"

    def end(_before: int, _done: int, _total: int, _seconds: float) -> None:
        clock.now += 100.0

    options: dict[str, Any] = {"over": over, "starts": 1, "jobs": 1, "engine": "ipopt"}
    with pytest.raises(InputError, match=r"is over; 1 of 3 points are in .*: the same command goes on"):
        sweep(case, out=out, time_limit=50.0, progress=end, **options)
    assert not out.exists()
    later = sweep(case, out=out, time_limit=50.0, **options)
    np.testing.assert_array_equal(later.F, sweep(case, **options).F)
