"""Running of other programs, such as compilers; shared libraries of C, cached by content hash.

A library is compiled once for its text, compiler and flags, and stored in the user's cache folder (``XDG_CACHE_HOME``,
or ``~/.cache``).
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from ..errors import InputError


class RunError(Exception):
    """Error of a program that cannot be run or fails.

    Attributes:
        said: reason in one line.
        is_started: True if the program was started, and failed.
    """

    def __init__(self, program: str, said: str, *, is_started: bool) -> None:
        super().__init__(f"{Path(program).name} {'failed' if is_started else 'cannot be run'}: {said}")
        self.said, self.is_started = said, is_started


def first_program(names: Iterable[str]) -> str | None:
    """Return the path of the first installed program; None if there is none."""
    import shutil  # noqa: PLC0415 - programs are seldom run

    return next((found for found in map(shutil.which, names) if found), None)


def run_program(words: list[str], folder: Path | None = None) -> str:
    """Run a program and return its standard output.

    Args:
        words: program and its arguments.
        folder: working folder; None for the current one.

    Raises:
        RunError: the program cannot be run, or fails.
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


_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared")


def shared_library(files: Mapping[str, str]) -> Path:
    """Compile C texts into a shared library, or return the cached one.

    Args:
        files: texts by file name; files ``*.c`` are compiled, the others are included.

    Raises:
        InputError: no C compiler is installed, or it fails.
    """
    import hashlib  # noqa: PLC0415 - few solves are compiled
    import tempfile  # noqa: PLC0415 - few solves are compiled

    compiler = _compiler()
    version = _run([compiler, "--version"])
    key = hashlib.sha256(
        "\0".join([*(part for item in sorted(files.items()) for part in item), compiler, version, *_FLAGS]).encode()
    ).hexdigest()
    folder = _folder()
    library = folder / f"{key[:32]}.so"
    if library.exists():
        return library
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        compiled = Path(temporary) / "compiled.so"
        for name, text in files.items():
            (Path(temporary) / name).write_text(text, encoding="utf-8")
        sources = [str(Path(temporary) / name) for name in sorted(files) if name.endswith(".c")]
        _run([compiler, *_FLAGS, *sources, "-lm", "-o", str(compiled)])
        # A rename leaves a whole library or none, also if two processes compile it at the same time.
        compiled.replace(library)
    return library


def _compiler() -> str:
    """Return the path of a C compiler.

    Raises:
        InputError: no C compiler is installed.
    """
    wanted = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    found = first_program(wanted)
    if found:
        return found
    if os.environ.get("CC"):
        raise InputError(
            f"the environment variable CC names {wanted[0]}, which is not installed; "
            "correct CC, or unset it to use cc, gcc or clang"
        )
    raise InputError("no C compiler is installed: install cc, gcc or clang, or name another one in the variable CC")


def _run(words: list[str]) -> str:
    """Run the compiler and return its standard output.

    Raises:
        InputError: the compiler cannot be run, or fails.
    """
    try:
        return run_program(words)
    except RunError as error:
        fault = "the C compiler failed" if error.is_started else "cannot be run"
        raise InputError(f"{words[0]}: {fault}: {error.said}") from None


def _folder() -> Path:
    """Return the user's cache folder; a new temporary folder if it cannot be written."""
    import tempfile  # noqa: PLC0415 - few solves are compiled

    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    try:
        folder = Path(base).expanduser() / "screwsynth"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except (OSError, RuntimeError):
        return Path(tempfile.mkdtemp(prefix="screwsynth."))
    return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="screwsynth."))
