"""Requests to stop: at once, such as by Ctrl-C, or at the end of a time; and the work that answers them itself.

The time of a command, or of a call, is stated once, with :func:`within`; every search of its block takes from what is
left of it, and ends by itself.

A request ends the process, unless work with partial results has begun: such work checks regularly whether it is
requested to stop. The command line listens, with :func:`listen`; a program that imports this package gets Python's own
``KeyboardInterrupt``. A search takes note of it instead, ends after the present step, and returns the state that its
last complete step left; the searches that follow in the same call (:func:`one_call`) end at once. Elsewhere, and at a
second interrupt in one step, it ends the call.
"""

from __future__ import annotations

import enum
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from contextvars import ContextVar, copy_context
from functools import wraps
from pathlib import Path
from threading import Event, Lock, current_thread, main_thread
from types import FrameType
from typing import NamedTuple, ParamSpec, TypeVar

Inputs = ParamSpec("Inputs")
Result = TypeVar("Result")
#: Exit status of an interrupted command, by the convention of shells: 128 and the number of the signal.
INTERRUPTED = 130
#: Seconds that interrupted work may take to show what it has, and that a file may take to be complete.
_TO_SHOW = 5.0
_TO_WRITE = 0.5
#: Ends the line of progress and shows the cursor, which that line hides.
_CLEAR = "\r\x1b[K\x1b[?25h"
#: Reason for which an interrupted search stops.
STOPPED = "interrupted"


class Milestone(enum.Enum):
    """Progress of the work from which on there is something to show."""

    START = "a start of a search is done"
    BOUND = "the search of the whole box has begun"
    VALUE = "a value of a trade-off is solved"
    POINT = "the ends of a front are found"
    ROBOT = "a robot of a comparison is done"
    CASE = "a case is checked"


#: Held while a file is written, so that none is left half written.
WRITING = Lock()
#: Files that are being written under names that are not theirs, and names of those that are written.
_unfinished: set[Path] = set()
_written: list[str] = []
_awaited: set[Milestone] = set()
_answers = Event()
_requested = Event()
#: Set once a search of the present call was interrupted by Python.
_call: ContextVar[Event | None] = ContextVar("call", default=None)


class _StoppedError(Exception):
    """End of a search in the middle of its set-up."""


#: Whether the work is that of a search, which answers a stop.
_in_search: ContextVar[bool] = ContextVar("in_search", default=False)


class _End(NamedTuple):
    """When the work of a block ends, by the clock, and the part of the time left that one search of it may take."""

    at: float = math.inf
    part: float = 1.0


_FOREVER = _End()
_end: ContextVar[_End] = ContextVar("end", default=_FOREVER)
#: Process that has something to say where it is ended, and the function that returns its sentence.
_parting: list[tuple[int, Callable[[], str]]] = []


def answer_after(milestone: Milestone) -> None:
    """Declare that requests after a milestone are answered by the work, which shows what it has."""
    _awaited.add(milestone)


def reached(milestone: Milestone) -> None:
    """Declare that a milestone is reached."""
    if milestone in _awaited:
        _answers.set()


def say_on_leaving(sentence: Callable[[], str]) -> None:
    """Declare a function that says what is kept where a request ends this process, but none that it starts."""
    _parting[:] = [(os.getpid(), sentence)]


@contextmanager
def unfinished(path: Path) -> Iterator[None]:
    """Declare a file that is removed where a request ends the process in this block."""
    _unfinished.add(path)
    try:
        yield
    finally:
        _unfinished.discard(path)


def wrote(name: str) -> None:
    """Declare that a file is written."""
    _written.append(name)


def kept() -> str:
    """Return what is kept of the work that a request ended."""
    for process, sentence in _parting:
        if process == os.getpid():
            return sentence()
    return f"written: {', '.join(ascii(each)[1:-1] for each in _written)}" if _written else "no file is written"


def is_requested() -> bool:
    """Return whether the work is to stop: it is interrupted, or its time is over."""
    return is_interrupted() or seconds_left() <= 0


def is_interrupted() -> bool:
    """Return whether the work is interrupted."""
    call = _call.get()
    return _requested.is_set() or (call is not None and call.is_set())


def why_stopped() -> str:
    """Return why work that is requested to stop does so."""
    return STOPPED if is_interrupted() else "the time is over"


def seconds_left() -> float:
    """Return the seconds until the time of this block is over; infinite without a limit."""
    end = _end.get().at
    return end if end == math.inf else max(end - time.perf_counter(), 0.0)


@contextmanager
def within(seconds: float | None, part: float = 1.0) -> Iterator[None]:
    """Let the work of this block end after so many seconds, and no later than that of the block around it.

    No block yields values of a generator, whose reader would be within the block too.

    Args:
        seconds: the time; None for that of the block around it.
        part: of the time left that one search takes at most, so that those after it have some too.
    """
    left = seconds_left()
    limit = left if seconds is None else min(seconds, left)
    # The clock is asked only where there is a limit.
    token = _end.set(_End(limit if limit == math.inf else time.perf_counter() + limit, part))
    try:
        yield
    finally:
        _end.reset(token)


def one_search(seconds: float | None = None) -> AbstractContextManager[None]:
    """Let the work of a block be one search: it takes its part of the time left, and so many seconds at most."""
    left, part = seconds_left(), _end.get().part
    return within(left * part if seconds is None else min(seconds, left * part))


def one_call(function: Callable[Inputs, Result]) -> Callable[Inputs, Result]:
    """Let an interrupt that ends a search of a function, or of the outermost one, end all its others at once too.

    The outermost call runs in a copy of its context: an interrupt at any moment of it leaves no time limit and no
    request behind in a program that goes on.
    """

    @wraps(function)
    def call(*args: Inputs.args, **kwargs: Inputs.kwargs) -> Result:
        if _call.get() is not None:
            return function(*args, **kwargs)
        context = copy_context()
        context.run(_call.set, Event())
        return context.run(function, *args, **kwargs)

    return call


def reason_of(search: Callable[[], str]) -> str:
    """Run a search; return its reason for stopping before its end, or that Python interrupted it.

    Its set-up may stop it too, with :func:`stop_if_requested`. Only a search that has returned an empty text is
    complete. What it claims otherwise must hold in the middle of a step too: a step changes what is claimed by one
    assignment, its last.
    """
    before, call = _in_search.get(), _call.get()
    noted = Event() if call is None else call
    # CasADi loses an exception that a signal raises in one of its functions.
    listens = current_thread() is main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def note(number: int, frame: FrameType | None) -> None:
        """Take note of an interrupt; a second one is Python's."""
        if noted.is_set():
            signal.default_int_handler(number, frame)
        noted.set()

    try:
        _in_search.set(True)
        _call.set(noted)
        if listens:
            signal.signal(signal.SIGINT, note)
        return search() or (STOPPED if noted.is_set() else "")
    except KeyboardInterrupt:
        noted.set()
        return STOPPED
    except _StoppedError:
        return why_stopped()
    finally:
        if listens:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        _in_search.set(before)
        _call.set(call)


def stop_if_requested() -> None:
    """End the search around this call, in the middle of its set-up, where it is to stop; do nothing in other work."""
    if _in_search.get() and is_requested():
        raise _StoppedError


def reason_to_stop(seconds: float, boxes: int = 0, most_boxes: int | None = None) -> str:
    """Return the reason for stopping a search that began some seconds ago before its end; empty for none."""
    if is_interrupted():
        return STOPPED
    if seconds_left() <= 0:
        return f"stopped after {seconds:.3g} s"
    if most_boxes is not None and boxes >= most_boxes:
        return f"stopped after {boxes:,} boxes"
    return ""


def listen() -> None:
    """Listen to interrupts from now on; a process that was started without them, as in the background, stays so."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _on_interrupt)


def _on_interrupt(_number: int, _frame: FrameType | None) -> None:
    """Request the work to stop, where it can answer; end the process otherwise, and at a second request."""
    if not _answers.is_set() or _requested.is_set():
        leave()
    _requested.set()
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda *_: leave())
        signal.setitimer(signal.ITIMER_REAL, _TO_SHOW)


def leave() -> None:
    """End the process once a file that is being written is complete, and say on stderr what is kept."""
    WRITING.acquire(timeout=_TO_WRITE)
    try:
        # Only a bar of progress hides the cursor.
        is_shown = "rich.progress" in sys.modules and os.isatty(2)
        os.write(2, f"{_CLEAR if is_shown else ''}\nscrewsynth: interrupted: {kept()}\n".encode())
    except OSError:  # nobody reads any more
        pass
    for path in list(_unfinished):
        with suppress(OSError):
            path.unlink()
    os._exit(INTERRUPTED)
