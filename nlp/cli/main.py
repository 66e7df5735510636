"""The command ``screwsynth``: from the process's arguments to its exit status.

Exit status: 0 done; 1 the answer is not what was asked for; 2 the input is wrong; 130 interrupted.
"""

from __future__ import annotations

import gc
import io
import os
import sys

import typer

#: Objects that are made before garbage is looked for. Modules while they are imported make many and no garbage: the
#: usual 700 cost a twentieth of a short command's time.
_GARBAGE_AFTER = 50_000


def main() -> None:
    """Run the command line, and leave without taking the interpreter down.

    Every file is closed by then, and taking the numerical libraries down takes a fifth of a short command's time.
    """
    status = run()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # nobody reads any more
        status = status or 1
    os._exit(status)


def run() -> int:
    """Run the command line on ``sys.argv``; errors become one sentence on standard error.

    Returns:
        Exit status.
    """
    from ..errors import ScrewsynthError
    from .app import app

    # pydantic would look for plugins in every installed distribution: a tenth of a short command's time.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The matrices here are a dozen wide: BLAS threads would only cost their start and spin beside the solver's own.
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
