"""Values that a notebook shows as a table and a drawing.

Modules of robots do not import drawings, nor those of solutions tables. The function that makes HTML of a value is
therefore found by the entry point ``html`` of the group ``screwsynth.views``, as robots of other packages are by
theirs, and loaded when a notebook first shows a value.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

#: Returns a value as HTML; None where it has no such form.
View = Callable[[object], str | None]

GROUP = "screwsynth.views"


class Shown:
    """A value with a table and a drawing in a notebook."""

    def _repr_html_(self) -> str | None:
        """Return the value as HTML; None without the package that draws, so that a notebook shows its ``repr``."""
        view = _view()
        return None if view is None else view(self)


@cache
def _view() -> View | None:
    """Return the function that makes HTML of a value; None where no installed package offers one."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and only notebooks need it

    for point in entry_points(group=GROUP, name="html"):
        function: View = point.load()
        return function
    return None
