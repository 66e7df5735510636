"""Conditions for pictures and pages, checked before the computation begins: kinds of files, installed libraries."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import PurePath

from ...errors import InputError

#: Kinds of picture files, by their ending.
PICTURES = (".png", ".svg", ".pdf")


def ending_of(target: str) -> str:
    """Return the ending of a file's name, in small letters."""
    return PurePath(target).suffix.lower()


def check_picture(target: str) -> None:
    """Check that the name of a picture says its kind, and that Matplotlib is installed.

    Raises:
        InputError: the ending is another one, or Matplotlib is not installed.
    """
    if ending_of(target) not in PICTURES:
        raise InputError(f"{target}: cannot be drawn: a picture's name ends in .png, .svg or .pdf")
    check_library("matplotlib", "pictures")


def check_library(name: str, purpose: str) -> None:
    """Check that a library of the extra ``plots`` is installed.

    Args:
        name: of the library.
        purpose: the outputs that need it, a plural for the message.

    Raises:
        InputError: the library is not installed.
    """
    if find_spec(name) is None:
        raise InputError(f"{purpose} need {name}, which is not installed: pip install 'screwsynth[plots]'")
