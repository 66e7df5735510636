"""Values that a notebook shows as a table and a drawing.

The modules of robots and solutions do not import drawings and tables. A notebook finds the function that makes the HTML
by the entry point ``html`` of the group ``screwsynth.views``, when it first shows a value.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

#: Function that returns a value as HTML; None for a value without such a form.
View = Callable[[object], str | None]

GROUP = "screwsynth.views"


class Shown:
    """A value with a table and a drawing in a notebook."""

    def _repr_html_(self) -> str | None:
        """Return the value as HTML; None if no drawing package is installed, so that a notebook shows its ``repr``."""
        view = _view()
        return None if view is None else view(self)


@cache
def _view() -> View | None:
    """Return the function that makes HTML of a value; None if no installed package offers one."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow to import, and only notebooks need it

    for point in entry_points(group=GROUP, name="html"):
        function: View = point.load()
        return function
    return None
