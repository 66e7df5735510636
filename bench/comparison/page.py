"""The page of results: generated tables between hand-written text."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .racetables import race_tables
from .tables import certificate_tables, evaluation_tables, growth_tables, machine_lines

_TABLES: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "race": race_tables,
    "evaluation": evaluation_tables,
    "certificates": certificate_tables,
    "growth": growth_tables,
}
_NOT_MEASURED = "Not measured in this run.\n"


def rendered(text: str, data: Mapping[str, Any]) -> str:
    """Return a page with the tables of a run in their places; a section that was not measured says so."""
    parts = {"machine": machine_lines(data)}
    for name, tables in _TABLES.items():
        section = data["sections"].get(name)
        parts[name] = _NOT_MEASURED if section is None else tables(section)
    for name, part in parts.items():
        opening, closing = f"<!-- begin: bench/benchmark.py {name} -->\n", "<!-- end -->"
        pattern = f"({re.escape(opening)}).*?({re.escape(closing)})"
        text, count = re.subn(pattern, lambda m, part=part: f"{m[1]}\n{part}\n{m[2]}", text, flags=re.DOTALL)
        if count != 1:
            raise ValueError(f"the page has {count} places for {name}, not one")
    return text


def write(data: Mapping[str, Any], template: Path, target: Path) -> None:
    """Write a page from the hand-written text of another, or of itself."""
    text = rendered(template.read_text(encoding="utf-8"), data)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")
