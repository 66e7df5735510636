"""Command ``screwsynth``: from the arguments of the process to its exit status.

Exit status: 0 done; 1 no answer, no proof, a violated limit, or a failed check; 2 wrong input; 130 interrupted.
"""

from __future__ import annotations

import gc
import io
import os
import sys
from threading import Thread, stack_size
from typing import TYPE_CHECKING

from ..interruption import INTERRUPTED, is_requested, kept, listen

if TYPE_CHECKING:
    from typing_extensions import Buffer

#: Objects allocated between two garbage collections. Imports allocate 90,000 objects and leave no garbage: with
#: Python's own threshold of 700 they cause 120 collections, which take 60 ms of a solve's 700.
_GARBAGE_AFTER = 200_000
#: Stack of the working thread, bytes: the size of a main thread's stack, as some systems give other threads less.
_STACK = 16 * 2**20
#: Seconds between two checks of the working thread, on systems where a signal does not end the wait.
_LOOK = 0.25


def main() -> None:
    """Run the command line, and end the process without finalising the interpreter.

    The work runs in a separate thread, so that the main thread answers an interrupt at once, even during a long call of
    a numerical library. All files are closed by the end. Finalising the libraries takes 110 ms of a solve's 700.
    """
    listen()
    _open_standard_streams()
    ended: list[int] = []
    stack_size(_STACK)
    work = Thread(target=lambda: ended.append(run()), name="work", daemon=True)
    work.start()
    stack_size(0)
    while work.is_alive():
        work.join(_LOOK)
    # Without a status, the thread ended with an error, which Python has shown.
    os._exit(ended[0] if ended else 1)


def run() -> int:
    """Run the command line on ``sys.argv``; an error becomes one sentence on standard error.

    Returns:
        Exit status.
    """
    from ..errors import ScrewsynthError

    # pydantic would look for plugins in every installed distribution: 6 ms where there are 70.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The matrices have about a dozen rows: BLAS threads would only cost 40 ms or more of processor time.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    thresholds = gc.get_threshold()
    gc.set_threshold(_GARBAGE_AFTER, *thresholds[1:])
    for stream in (sys.stdout, sys.stderr):
        # A terminal shows an escape for a letter that it cannot show.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        status = _status_of(sys.argv[1:])
        sys.stdout.flush()
    except ScrewsynthError as error:
        _say(str(error))
        status = 2
    except KeyboardInterrupt:
        status = INTERRUPTED
    except OSError as error:
        _say(f"standard output: cannot be written: {error.strerror or error}")
        status = 2
    finally:
        gc.set_threshold(*thresholds)
    if not is_requested() and status != INTERRUPTED:
        return status
    _say(
        f"interrupted: the result shows the state at that time; {kept()}"
        if is_requested()
        else f"interrupted: {kept()}"
    )
    return INTERRUPTED


def _status_of(words: list[str]) -> int:
    """Run a command and return its exit status."""
    from .app import run_command

    try:
        run_command(words)
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    return 0


def _say(sentence: str) -> None:
    """Write a sentence to standard error; errors of standard error are ignored, as the exit status remains."""
    try:
        sys.stderr.write(f"screwsynth: {sentence}\n")
        sys.stderr.flush()
    except OSError:
        pass


class _Lenient(io.FileIO):
    """File that drops bytes that cannot be written."""

    lost: type[OSError] = OSError

    def write(self, content: Buffer) -> int:
        """Write bytes, or drop them."""
        try:
            return super().write(content)
        except self.lost:
            return memoryview(content).nbytes


class _Unread(_Lenient):
    """File that drops bytes after its reader has ended, as in a pipe to ``head``."""

    lost = BrokenPipeError


def _open_standard_streams() -> None:
    """Open closed standard streams, and make standard error a stream that never fails.

    A file that is opened later would otherwise become a standard stream. Writing to a closed or full standard output is
    an error; text for a closed standard error is lost. A standard output whose reader has ended is no error: the
    command writes its files, and ends with its own status.
    """
    for descriptor, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, flags)
    output = sys.stdout  # None if it was closed
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(_Unread(1, "w", closefd=False)),
        encoding="utf-8" if output is None else output.encoding,
        line_buffering=output is not None and bool(output.line_buffering),
    )
    encoding = "utf-8" if sys.stderr is None else sys.stderr.encoding
    raw = io.BufferedWriter(_Lenient(2, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(raw, encoding=encoding, errors="backslashreplace", line_buffering=True)
