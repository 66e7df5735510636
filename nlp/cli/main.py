"""The command ``screwsynth``: from the process's arguments to its exit status.

Exit status: 0 done; 1 no answer, no proof, a violated limit, or a failed check; 2 the input is wrong; 130 interrupted.
"""

from __future__ import annotations

import gc
import io
import os
import sys

import typer

#: Objects allocated between two garbage collections. Imports allocate 90,000 objects and leave no garbage: with
#: Python's own threshold of 700 they cause 120 collections, which take 60 ms of a solve's 700.
_GARBAGE_AFTER = 200_000


def main() -> None:
    """Run the command line, and end the process without finalising the interpreter.

    Every file is closed before the end. Finalising the numerical libraries takes 110 ms, of a solve's 700.
    """
    status = run()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # the reader has closed the pipe
        status = status or 1
    os._exit(status)


def run() -> int:
    """Run the command line on ``sys.argv``; errors become one sentence on standard error.

    Returns:
        Exit status.
    """
    from ..errors import ScrewsynthError
    from .app import app

    # pydantic would look for plugins in every installed distribution: 6 ms where there are 70.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The matrices here are a dozen wide: BLAS threads would only cost 40 ms or more of processor time beside the
    # solver's own.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    thresholds = gc.get_threshold()
    gc.set_threshold(_GARBAGE_AFTER, *thresholds[1:])
    for stream in (sys.stdout, sys.stderr):
        # A terminal that cannot show a letter of a title shows its escape instead.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    except ScrewsynthError as error:
        typer.echo(f"screwsynth: {error}", err=True)
        return 2
    except KeyboardInterrupt:
        typer.echo("screwsynth: interrupted", err=True)
        return 130
    finally:
        gc.set_threshold(*thresholds)
    return 0
