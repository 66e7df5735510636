"""Optional libraries of the extra ``robots``, for some formats only."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ..errors import InputError


def required(library: str, purpose: str, package: str = "") -> Any:  # noqa: ANN401 - a module
    """Return a library of the extra ``robots``.

    Args:
        library: import name of the library.
        purpose: files that need the library, in the plural, for the message.
        package: package name of the library; empty for the import name.

    Raises:
        InputError: the library is not installed.
    """
    try:
        return import_module(library)
    except ImportError:
        needed = package or library
        fault = f"{purpose} need {needed}, which is not installed: pip install 'screwsynth[robots]'"
        raise InputError(fault) from None
