"""Libraries that only pictures need: whether they are there is found out before the work begins."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import PurePath

from ...errors import InputError

#: Kinds of picture files, by their ending.
PICTURES = (".png", ".svg", ".pdf")


def check_picture(target: str) -> None:
    """See that a picture can be drawn and that its name says which kind it is.

    Raises:
        InputError: the ending is another one, or Matplotlib is not installed.
    """
    if PurePath(target).suffix.lower() not in PICTURES:
        raise InputError(f"{target}: cannot be drawn: a picture's name ends in .png, .svg or .pdf")
    check_library("matplotlib", "pictures")


def check_library(name: str, purpose: str) -> None:
    """See that a library of the extra ``plots`` is installed.

    Raises:
        InputError: it is not.
    """
    if find_spec(name) is None:
        raise InputError(f"{purpose} need {name}, which is not installed: pip install 'screwsynth[plots]'")
