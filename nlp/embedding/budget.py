"""C that gives each of many problems its own budget, for the library that Python loads."""

from __future__ import annotations

from pathlib import Path
from string import Template

_TEMPLATE = Path(__file__).parent / "c" / "deadline.c.in"


def budget_files(prefix: str) -> dict[str, str]:
    """Return the source by its file name.

    Args:
        prefix: of the case's names in C.
    """
    return {f"{prefix}-deadline.c": Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(id=prefix)}
