"""Interrupts such as Ctrl-C and time limits, with partial results.

:func:`within` states the time of a command or call once; every search in its block uses a part of the remaining time.

An interrupt ends the process, unless work with partial results has begun, which checks regularly for requests to stop.
The command line handles interrupts with :func:`listen`; a program that imports this package gets Python's
``KeyboardInterrupt``. A search instead ends after its current step, and returns the state after its last complete step;
further searches of the same call (:func:`one_call`) end at once. Other work, and a second interrupt in one step, ends
the call.
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
#: Exit status of an interrupted command, by the convention of shells: 128 plus the number of the signal.
INTERRUPTED = 130
#: Seconds for interrupted work to show partial results, and for a file to become complete.
_TO_SHOW = 5.0
_TO_WRITE = 0.5
#: Control sequence that ends the line of progress and shows the cursor, which the line hides.
_CLEAR = "\r\x1b[K\x1b[?25h"
#: Reason of an interrupted search.
STOPPED = "interrupted"


class Milestone(enum.Enum):
    """Progress from which on the work has partial results."""

    START = "a start of a search is done"
    BOUND = "the search of the whole box has begun"
    VALUE = "a value of a trade-off is solved"
    POINT = "the ends of a front are found"
    ROBOT = "a robot of a comparison is done"
    CASE = "a case is checked"


#: Lock during the writing of a file, so that no file stays half written.
WRITING = Lock()
#: Temporary files that are being written, and names of written files.
_unfinished: set[Path] = set()
_written: list[str] = []
_awaited: set[Milestone] = set()
_answers = Event()
_requested = Event()
#: Set after Python interrupted a search of the current call.
_call: ContextVar[Event | None] = ContextVar("call", default=None)


class _StoppedError(Exception):
    """End of a search during its set-up."""


#: True during a search, which handles a request to stop.
_in_search: ContextVar[bool] = ContextVar("in_search", default=False)


class _End(NamedTuple):
    """End of the work of a block, by the clock, and fraction of the remaining time for one search."""

    at: float = math.inf
    part: float = 1.0


_FOREVER = _End()
_end: ContextVar[_End] = ContextVar("end", default=_FOREVER)
#: Process with a sentence for its end, and function that returns the sentence.
_parting: list[tuple[int, Callable[[], str]]] = []


def answer_after(milestone: Milestone) -> None:
    """Declare that after a milestone the work handles requests to stop, and shows partial results."""
    _awaited.add(milestone)


def reached(milestone: Milestone) -> None:
    """Declare that a milestone is reached."""
    if milestone in _awaited:
        _answers.set()


def say_on_leaving(sentence: Callable[[], str]) -> None:
    """Register a function that returns the sentence about kept results.

    It is printed at the end of this process, not of a child process.
    """
    _parting[:] = [(os.getpid(), sentence)]


@contextmanager
def unfinished(path: Path) -> Iterator[None]:
    """Declare a file that is removed if a request ends the process in this block."""
    _unfinished.add(path)
    try:
        yield
    finally:
        _unfinished.discard(path)


def wrote(name: str) -> None:
    """Declare that a file is written."""
    _written.append(name)


def kept() -> str:
    """Return a sentence on the kept results of interrupted work."""
    for process, sentence in _parting:
        if process == os.getpid():
            return sentence()
    return f"written: {', '.join(ascii(each)[1:-1] for each in _written)}" if _written else "no file is written"


def is_requested() -> bool:
    """Return whether the work must stop, because it is interrupted or its time is over."""
    return is_interrupted() or seconds_left() <= 0


def is_interrupted() -> bool:
    """Return whether the work is interrupted."""
    call = _call.get()
    return _requested.is_set() or (call is not None and call.is_set())


def why_stopped() -> str:
    """Return the reason of a request to stop."""
    return STOPPED if is_interrupted() else "the time is over"


def seconds_left() -> float:
    """Return the remaining seconds of this block; infinite without a limit."""
    end = _end.get().at
    return end if end == math.inf else max(end - time.perf_counter(), 0.0)


@contextmanager
def within(seconds: float | None, part: float = 1.0) -> Iterator[None]:
    """Limit the time of the work in this block, also by the time of the enclosing block.

    A generator must not yield in such a block, because its reader would be within the block too.

    Args:
        seconds: time limit; None for the time limit of the enclosing block.
        part: largest fraction of the remaining time for one search, so that later searches have time too.
    """
    left = seconds_left()
    limit = left if seconds is None else min(seconds, left)
    # Read the clock only if there is a limit.
    token = _end.set(_End(limit if limit == math.inf else time.perf_counter() + limit, part))
    try:
        yield
    finally:
        _end.reset(token)


def one_search(seconds: float | None = None) -> AbstractContextManager[None]:
    """Limit the time of a block that is one search.

    The limit is the fraction of the remaining time that the enclosing block allows one search, and ``seconds``.
    """
    left, part = seconds_left(), _end.get().part
    return within(left * part if seconds is None else min(seconds, left * part))


def one_call(function: Callable[Inputs, Result]) -> Callable[Inputs, Result]:
    """Decorate a function so that an interrupt of one of its searches ends all its other searches at once.

    Of nested calls the outermost counts. It runs in a copy of its context: after an interrupt, no time limit and no
    request remain in the program.
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
    """Run a search; return its reason for an early stop, such as an interrupt by Python.

    The set-up may stop it too, with :func:`stop_if_requested`. Only a search with an empty reason is complete. Partial
    results must be valid in the middle of a step too: a step changes them by one assignment, its last.
    """
    before, call = _in_search.get(), _call.get()
    noted = Event() if call is None else call
    # CasADi loses exceptions that a signal raises in its functions.
    listens = current_thread() is main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def note(number: int, frame: FrameType | None) -> None:
        """Register an interrupt; Python handles a second one."""
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
    """End the current search during its set-up if it must stop; do nothing in other work."""
    if _in_search.get() and is_requested():
        raise _StoppedError


def reason_to_stop(seconds: float, boxes: int = 0, most_boxes: int | None = None) -> str:
    """Return the reason for an early stop of a search after some seconds and boxes; empty for none."""
    if is_interrupted():
        return STOPPED
    if seconds_left() <= 0:
        return f"stopped after {seconds:.3g} s"
    if most_boxes is not None and boxes >= most_boxes:
        return f"stopped after {boxes:,} boxes"
    return ""


def listen() -> None:
    """Handle interrupts from now on; a process that ignores interrupts, as in the background, still ignores them."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _on_interrupt)


def _on_interrupt(_number: int, _frame: FrameType | None) -> None:
    """Request the work to stop if it can; otherwise, and at a second request, end the process."""
    if not _answers.is_set() or _requested.is_set():
        leave()
    _requested.set()
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda *_: leave())
        signal.setitimer(signal.ITIMER_REAL, _TO_SHOW)


def leave() -> None:
    """End the process after the current file is complete, and report the kept results on stderr."""
    WRITING.acquire(timeout=_TO_WRITE)
    try:
        # Only a bar of progress hides the cursor.
        is_shown = "rich.progress" in sys.modules and os.isatty(2)
        os.write(2, f"{_CLEAR if is_shown else ''}\nscrewsynth: interrupted: {kept()}\n".encode())
    except OSError:  # stderr is closed
        pass
    for path in list(_unfinished):
        with suppress(OSError):
            path.unlink()
    os._exit(INTERRUPTED)
