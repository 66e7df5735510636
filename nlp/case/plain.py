"""Options of a robot as plain values of TOML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import CaseError, one_line
from .toml import TomlValue


def plain_value(value: object) -> TomlValue:
    """Return the value of a robot's option as TOML has it; a tuple is a list.

    Raises:
        CaseError: TOML has no such value.
    """
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain_value(part) for key, part in value.items()}
    if isinstance(value, Sequence):
        return [plain_value(part) for part in value]
    raise CaseError("robot", f"has an option that cannot be written to a case file: {one_line(repr(value))[:60]}")
