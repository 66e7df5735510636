"""Choice of the engine: the C kernel where it was built, and NumPy, which is always there."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType


def kernel() -> ModuleType | None:
    """Return the C kernel, or None where it was not built."""
    try:
        return import_module("screwsynth.nlp.proof.enclosure._bounds")
    except ImportError:
        return None


def engine_name(name: str | None) -> str:
    """Return the name of the engine that a search takes."""
    return name or ("numpy" if kernel() is None else "c")


def chosen_kernel(name: str | None, built: Callable[[], ModuleType | None]) -> ModuleType | None:
    """Return the C kernel that an engine's name asks for; None for NumPy.

    Args:
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        built: gives the kernel, or None where it was not built.

    Raises:
        ValueError: there is no engine of that name here.
    """
    if name not in (None, "c", "numpy"):
        raise ValueError(f"there is no engine {name!r}: c or numpy")
    module = None if name == "numpy" else built()
    if module is None and name == "c":
        raise ValueError("the C kernel was not built: numpy is there")
    return module
