"""What all tests share: children that can be interrupted, and searches whose time is counted in looks at the clock."""

import os
import signal
import threading
from collections.abc import Callable
from importlib import import_module
from types import SimpleNamespace

import pytest

# Before NumPy is imported: the tests' processes take all cores, and threads of linear algebra that wait for each other
# take six times the time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

#: Modules of searches with a limit on their time; each looks at the clock once a step.
SEARCHES = ("boxes.search",)
#: Seconds from one look at the clock to the next: about those of a step on a quiet machine.
STEP = 0.01


def let_children_be_interrupted() -> None:
    """Let children start with the default action at SIGINT, also where the tests run without interrupts.

    A shell's background job, ``nohup`` and some runners ignore the signal, which children inherit; a handler they do
    not. This process goes on without interrupts: its handler does nothing.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)


def pytest_configure() -> None:
    let_children_be_interrupted()


@pytest.fixture
def children_can_be_interrupted() -> Callable[[], None]:
    return let_children_be_interrupted


@pytest.fixture(scope="session", autouse=True)
def clock_of_steps() -> None:
    """Let a search of so many seconds take a number of steps: no test depends on how fast or busy the machine is.

    A search's own looks at the clock move it; those at the time that is left, also of a solve, do not.
    """
    looks = [0]

    def step() -> float:
        looks[0] += 1
        return STEP * looks[0]

    for name in SEARCHES:
        module = import_module(f"screwsynth.nlp.proof.{name}")
        assert module.time.perf_counter
        module.time = SimpleNamespace(perf_counter=step)  # type: ignore[attr-defined]
    import_module("screwsynth.nlp.interruption").time = SimpleNamespace(  # type: ignore[attr-defined]
        perf_counter=lambda: STEP * looks[0]
    )
