"""Programs over the robots of :mod:`screwsynth.models`: cases, formulation, solution, evidence and output."""

from .system.lazynames import lazy_names

__version__ = "0.1.0"

# The public names stand in ``__init__.pyi``.
__all__, __getattr__ = lazy_names(__name__, __name__, __file__)


def __dir__() -> list[str]:
    return list(__all__)
