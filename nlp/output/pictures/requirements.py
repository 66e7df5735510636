"""Requirements of pictures and pages, checked before the computation: file extensions, installed libraries."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import PurePath

from ...errors import InputError

#: Extensions of picture files.
PICTURES = (".png", ".svg", ".pdf")


def ending_of(target: str) -> str:
    """Return the extension of a file name, in lower case."""
    return PurePath(target).suffix.lower()


def check_picture(target: str) -> None:
    """Check that a picture has a known extension, and that Matplotlib is installed.

    Raises:
        InputError: the extension is unknown, or Matplotlib is not installed.
    """
    if ending_of(target) not in PICTURES:
        raise InputError(f"{target}: cannot be drawn: a picture's name ends in .png, .svg or .pdf")
    check_library("matplotlib", "pictures")


def check_library(name: str, purpose: str) -> None:
    """Check that a library of the extra ``plots`` is installed.

    Args:
        name: name of the library.
        purpose: outputs that need the library, a plural for the message.

    Raises:
        InputError: the library is not installed.
    """
    if find_spec(name) is None:
        raise InputError(f"{purpose} need {name}, which is not installed: pip install 'screwsynth[plots]'")
