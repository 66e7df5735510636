"""Layout of help: a usage line, paragraphs, and tables of two columns."""

from __future__ import annotations

import shutil
import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

#: Smallest and largest width of help in columns, and columns that stay free at the right edge of the terminal.
_NARROWEST, _WIDEST, _EDGE = 50, 98, 2
#: Largest width of the first column of a table; a longer entry has a line of its own.
_FIRST = 30
_INDENT = "  "


def columns() -> int:
    """Return the width of help on this terminal."""
    return max(min(shutil.get_terminal_size().columns - _EDGE, _WIDEST), _NARROWEST)


def usage(command: str, words: Iterable[str]) -> str:
    """Return the usage line of a command with placeholders for its options and arguments."""
    begin = f"Usage: {command} "
    return textwrap.fill(" ".join(words), columns(), initial_indent=begin, subsequent_indent=" " * len(begin))


def paragraphs(text: str) -> str:
    """Return the paragraphs of a docstring, wrapped and indented."""
    head, _, tail = text.partition("\n")
    parts = f"{head}\n{textwrap.dedent(tail)}".strip().split("\n\n")
    wrapped = (textwrap.fill(part, columns(), initial_indent=_INDENT, subsequent_indent=_INDENT) for part in parts)
    return "\n\n".join(wrapped)


def example(command: str) -> str:
    """Return the block with the example of a command."""
    return textwrap.indent(f"Example:\n  {command}", _INDENT)


def table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Return a table of names and sentences, with a title."""
    first = min(max(len(name) for name, _ in rows), _FIRST)
    margin = " " * (len(_INDENT) + first + 2)
    lines = [f"{title}:"]
    for name, words in rows:
        begin = f"{_INDENT}{name}"
        if len(name) > first:
            lines.append(begin)
            begin = ""
        wrapped = textwrap.wrap(words, columns() - len(margin)) or [""]
        lines.append(f"{begin:{len(margin)}}{wrapped[0]}")
        lines += [margin + line for line in wrapped[1:]]
    return "\n".join(lines)
