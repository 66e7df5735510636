"""Names of a module that are imported at first use, so that the command line starts at once.

The names are in the module's stub, in lines ``from .module import name as name``, which type checkers read too. The
stub is read line by line: parsing it as Python, as ``lazy_loader.attach_stub`` does, takes longer than importing the
rest of a small package. ``from .package import *`` stands for all names of a package, which is imported at once.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


def lazy_names(module: str, package: str, file: str) -> tuple[list[str], Callable[[str], object]]:
    """Return the names in a module's stub, sorted, and the module's ``__getattr__``.

    The module itself must define names that begin with an underscore.

    Args:
        module: full name of the module.
        package: full name of the package to which the modules in the stub are relative.
        file: file of the module, next to its stub.
    """
    with open(f"{file.removesuffix('.py')}.pyi", encoding="utf-8") as stub:
        lines = [line.split() for line in stub if line.startswith("from .")]
    places: dict[str, str] = {}
    for _, place, _, name, *_ in lines:
        if name == "*":
            places |= dict.fromkeys(import_module(place, package).__all__, place)
        elif not name.startswith("_"):
            places[name] = place

    def value_of(name: str) -> object:
        if name not in places:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        if places[name] == ".":  # a package of this one
            return import_module(f".{name}", package)
        value = getattr(import_module(places[name], package), name)
        # Later look-ups find the name without this function.
        setattr(sys.modules[module], name, value)
        return value

    return sorted(places), value_of
