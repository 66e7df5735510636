"""Names of a module that are imported at first use, so that the command line starts at once.

The names are in the module's stub, in lines ``from .module import name as name``, which type checkers read too. The
stub is read line by line: parsing it as Python, as ``lazy_loader.attach_stub`` does, takes longer than importing the
rest of a small package.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def lazy_names(module: str, package: str, file: str) -> tuple[list[str], Callable[[str], object]]:
    """Return the names in a module's stub, sorted, and the module's ``__getattr__``.

    Args:
        module: full name of the module.
        package: full name of the package to which the modules in the stub are relative.
        file: file of the module, next to its stub.
    """
    with open(f"{file.removesuffix('.py')}.pyi", encoding="utf-8") as stub:
        lines = [line.split() for line in stub if line.startswith("from .")]
    places = {name: place for _, place, _, _, _, name in lines}

    def value_of(name: str) -> object:
        if name not in places:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        value = getattr(import_module(places[name], package), name)
        # Later look-ups find the name without this function.
        setattr(sys.modules[module], name, value)
        return value

    return sorted(places), value_of
