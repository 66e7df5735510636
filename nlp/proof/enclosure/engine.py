"""Access to the C kernel. Only searches for proofs need this kernel."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from ...errors import InputError

#: Name of the kernel in results.
ENGINE = "c"


def kernel() -> ModuleType:
    """Return the C kernel.

    Raises:
        InputError: the kernel was not built.
    """
    try:
        return import_module("screwsynth.nlp.proof.enclosure._bounds")
    except ImportError:
        raise InputError(
            "proofs are not available: the C kernel was not built when the package was installed; "
            "install a C compiler, then the package again (pip install --force-reinstall --no-deps .)"
        ) from None
