"""Tables of a robot file as its text, laid out as people write it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...case.toml import toml_key, toml_lines, toml_text
from ...errors import one_line

#: Longest line of a list that is written on one line.
_LONGEST = 110


def robot_file_text(tables: Mapping[str, Any], remarks: Sequence[str] = ()) -> str:
    """Return the text of a robot file.

    Args:
        tables: of the robot file.
        remarks: sentences for the comment at its head.
    """
    lines = [f"# {one_line(each)}" for each in remarks]
    lines += toml_lines({key: value for key, value in tables.items() if _is_plain(key)})
    for key in ("dimensions", "derived"):
        if tables.get(key):
            lines += ["", f"[{key}]", *toml_lines(tables[key])]
    for limb in tables.get("limb", ()):
        lines += ["", "[[limb]]", *_limb_lines(limb)]
    for key in ("joint", "coupling"):
        for each in tables.get(key, ()):
            lines += ["", f"[[{key}]]", *toml_lines(each)]
    return "\n".join(lines) + "\n"


def _is_plain(key: str) -> bool:
    """Return whether a key of the document is no table."""
    return key not in ("dimensions", "derived", "limb", "joint", "coupling")


def _limb_lines(limb: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a limb."""
    for key, value in limb.items():
        if key in ("joints", "branch"):
            yield from _list_lines(key, value)
        else:
            yield f"{toml_key(key)} = {toml_text(value)}"


def _list_lines(key: str, values: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a list of tables, each on a line of its own where one line is too short."""
    whole = f"{key} = {toml_text(values)}"
    if len(whole) <= _LONGEST:
        yield whole
        return
    yield f"{key} = ["
    for value in values:
        # TOML wants a table within a list on one line; only lists within it may be broken.
        if "joints" in value:
            yield "    { joints = ["
            yield from (f"        {toml_text(joint)}," for joint in value["joints"])
            yield "    ] },"
        else:
            yield f"    {toml_text(value)},"
    yield "]"
