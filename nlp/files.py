"""Output files, written whole or not at all."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from screwsynth.nlp.errors import InputError


def write_text(target: str, text: str) -> None:
    """Write a text to a file, or to standard output for ``-``.

    The file appears under its name only when it is complete.

    Raises:
        InputError: it cannot be written.
    """
    if target == "-":
        sys.stdout.write(text)
        return
    path = Path(target)
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            # A temporary file is for its owner only; the result gets what any new file gets.
            mask = os.umask(0)
            os.umask(mask)
            Path(temporary).chmod(0o666 & ~mask)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
