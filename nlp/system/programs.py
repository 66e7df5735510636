"""Running of programs of this machine, such as compilers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


class RunError(Exception):
    """A program that cannot be run or fails.

    Attributes:
        said: why, in one line.
        is_started: whether it was run, and failed.
    """

    def __init__(self, program: str, said: str, *, is_started: bool) -> None:
        super().__init__(f"{Path(program).name} {'failed' if is_started else 'cannot be run'}: {said}")
        self.said, self.is_started = said, is_started


def first_program(names: Iterable[str]) -> str | None:
    """Return the path of the first program that is installed; None where there is none."""
    import shutil  # noqa: PLC0415 - programs are seldom run

    return next((found for found in map(shutil.which, names) if found), None)


def run_program(words: list[str], folder: Path | None = None) -> str:
    """Run a program and return its standard output.

    Args:
        words: the program and its arguments.
        folder: in which it runs; the current one if left out.

    Raises:
        RunError: it cannot be run, or fails.
    """
    import subprocess  # noqa: PLC0415 - programs are seldom run

    try:
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603 - the user's own compiler
    except OSError as error:
        raise RunError(words[0], error.strerror or str(error), is_started=False) from None
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or [f"exit status {done.returncode}"]
        raise RunError(words[0], said[0], is_started=True)
    return done.stdout
