"""Cases, nonlinear programs, solutions, evidence, proofs and output for the robots of :mod:`screwsynth.models`."""

from .system.lazynames import lazy_names

__version__ = "0.1.0"

# ``__init__.pyi`` lists the public names.
__all__, __getattr__ = lazy_names(__name__, __name__, __file__)


def __dir__() -> list[str]:
    return list(__all__)
