"""The two engines that examine boxes: the C kernel where it was built, and NumPy, which is always there."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Protocol

from screwsynth.nlp.bounding import Examined, NumpyEngine
from screwsynth.nlp.standardform import StandardForm

if TYPE_CHECKING:
    from screwsynth.models import FloatArray


class Engine(Protocol):
    """Examines blocks of boxes."""

    @property
    def name(self) -> str:
        """``c`` or ``numpy``."""

    @property
    def block(self) -> int:
        """How many boxes it takes at once."""

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examined:
        """As :meth:`screwsynth.nlp.bounding.NumpyEngine.examine`."""

    def close(self) -> None:
        """Let its threads go."""


def kernel() -> ModuleType | None:
    """The C kernel, or None where it was not built."""
    try:
        return import_module("screwsynth.nlp._bounds")
    except ImportError:
        return None


def engine_for(form: StandardForm, name: str | None = None, jobs: int | None = None) -> Engine:
    """An engine for a form.

    Args:
        form: what is searched.
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        jobs: threads of the C kernel.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: there is no engine of that name here.
    """
    if name not in (None, "c", "numpy"):
        raise ValueError(f"there is no engine {name!r}: c or numpy")
    return NumpyEngine(form)
