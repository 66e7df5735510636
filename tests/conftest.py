"""Signals of the tests' children."""

import signal
import time
from collections.abc import Callable

import pytest


def let_children_be_interrupted() -> None:
    """Let children start with the default action at SIGINT, also where the tests run without interrupts.

    A shell's background job, ``nohup`` and some runners ignore the signal, which children inherit; a handler they do
    not. This process goes on without interrupts: its handler does nothing.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)


def pytest_configure() -> None:
    let_children_be_interrupted()


@pytest.fixture
def children_can_be_interrupted() -> Callable[[], None]:
    return let_children_be_interrupted


@pytest.fixture(autouse=True)
def time_of_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let limits on the time of a search count what this process uses: no other process can end a search then."""
    monkeypatch.setattr(time, "perf_counter", time.process_time)
