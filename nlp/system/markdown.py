"""Names as plain text in Markdown, without tags, links, code or table cells."""

from __future__ import annotations

import re

from ..errors import one_line

#: Characters of HTML, and of addresses that some viewers show as links, as entities.
_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "@": "&#64;"})
#: Marks of Markdown: an underscore only at the end of a word, and a sign only before a link's address.
_MARKS = re.compile(r"[\\`*\[\]|~]|(?<!\w)_|_(?!\w)|(?<=\w):(?=//)|(?<=\bwww)\.", re.IGNORECASE)


def markdown_text(name: str) -> str:
    """Return a name in one line that a viewer of Markdown shows as it is written."""

    def marked(found: re.Match[str]) -> str:
        mark = found.group()
        return f"&#{ord(mark)};" if mark in ":." else f"\\{mark}"

    # Entities contain no marks.
    return _MARKS.sub(marked, one_line(name).translate(_ENTITIES))
