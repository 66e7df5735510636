"""Programs over the robots of :mod:`screwsynth.models`: cases, formulation, solution, evidence and output."""

from importlib import import_module

__version__ = "0.1.0"

# The public names stand in ``__init__.pyi``, in lines ``from .module import name as name``. Each is imported when it is
# first used, so that the command line starts at once. The stub is read here line by line: parsing it as Python, as
# ``lazy_loader.attach_stub`` does, takes longer than importing the rest of this package.
with open(f"{__file__.removesuffix('.py')}.pyi", encoding="utf-8") as _stub:
    _lines = [line.split() for line in _stub if line.startswith("from .")]
_modules = {name: module for _, module, _, _, _, name in _lines}
__all__ = sorted(_modules)  # noqa: PLE0605 - the stub lists the names


def __getattr__(name: str) -> object:
    if name not in _modules:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_modules[name], __name__), name)
    # The next look-up finds the name without this function.
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)
