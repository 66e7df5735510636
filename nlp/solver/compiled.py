"""C compiled into shared libraries, cached by content hash.

A library is compiled once for its text, compiler and flags, and stored in the user's cache folder (``XDG_CACHE_HOME``,
or ``~/.cache``).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import InputError
from ..system.programs import RunError, first_program, run_program

_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared")


def shared_library(files: Mapping[str, str]) -> Path:
    """Compile C texts into a shared library, or return the cached one.

    Args:
        files: texts by file name; those whose names end in ``.c`` are compiled, the others are there to be included.

    Raises:
        InputError: there is no C compiler, or it fails.
    """
    import hashlib
    import tempfile

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
        # A rename leaves a whole library or none, also when two processes compile it at the same time.
        compiled.replace(library)
    return library


def _compiler() -> str:
    """Find a C compiler.

    Raises:
        InputError: there is none.
    """
    wanted = [os.environ["CC"]] if os.environ.get("CC") else ["cc", "gcc", "clang"]
    found = first_program(wanted)
    if found:
        return found
    raise InputError(f"compiling needs a C compiler, and none was found: {' or '.join(wanted)}; CC names another one")


def _run(words: list[str]) -> str:
    """Run the compiler and return its standard output.

    Raises:
        InputError: it cannot be run, or fails.
    """
    try:
        return run_program(words)
    except RunError as error:
        fault = "the C compiler failed" if error.is_started else "cannot be run"
        raise InputError(f"{words[0]}: {fault}: {error.said}") from None


def _folder() -> Path:
    """Return the user's cache folder; a new temporary folder where it cannot be written."""
    import tempfile

    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    try:
        folder = Path(base).expanduser() / "screwsynth"
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except (OSError, RuntimeError):
        return Path(tempfile.mkdtemp(prefix="screwsynth."))
    return folder if os.access(folder, os.W_OK) else Path(tempfile.mkdtemp(prefix="screwsynth."))
