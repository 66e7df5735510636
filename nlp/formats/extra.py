"""Libraries of the extra ``robots``, which only some formats need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..errors import InputError


def required(library: str, purpose: str, package: str = "") -> Any:  # noqa: ANN401 - a module
    """Return a library of the extra ``robots``.

    Args:
        library: name by which it is imported.
        purpose: what needs it, a plural for the message.
        package: name by which it is installed, where it is another.

    Raises:
        InputError: it is not installed.
    """
    try:
        return import_module(library)
    except ImportError:
        needed = package or library
        fault = f"{purpose} need {needed}, which is not installed: pip install 'screwsynth[robots]'"
        raise InputError(fault) from None
