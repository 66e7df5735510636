"""Drawings of robots as SVG pictures of a page, for wide and narrow windows, in half of the bytes of picture files."""

from __future__ import annotations

import re

from ..pictures.drawing import Drawing
from ..pictures.figures import narrow_picture, page_pictures
from .markup import Markup, image_source, picture_element, tag

_OUTLINE = re.compile(r' d="([^"]*)"')
#: Digits beyond two decimal places, which are not visible in units of 1/72 in; zeros at the end; room between numbers.
_DIGITS, _ZEROS, _ROOM = re.compile(r"(\.\d\d)\d+"), re.compile(r"\.0+(?!\d)|(\.\d*[1-9])0+(?!\d)"), re.compile(r"\s+")
_COMMAND = re.compile(r" ?([A-Za-z]) ?")
#: Text with an edge, which Matplotlib draws as two equal outlines.
_EDGED = re.compile(
    r'<path d="([^"]*)" style="(fill: [^;"]+; stroke: #ffffff[^"]*)"/>\s*<path d="\1" style="fill: [^"]*"/>'
)


def compact(content: bytes) -> bytes:
    """Return an SVG picture with two decimal places in its outlines, and with one outline for each text."""
    text = _OUTLINE.sub(lambda found: f' d="{_fewer(found[1])}"', content.decode("utf-8"))
    return _EDGED.sub(r'<path d="\1" style="\2; paint-order: stroke"/>', text).encode("utf-8")


def _fewer(outline: str) -> str:
    """Return the data of an outline without invisible digits, and without unnecessary zeros and spaces."""
    rounded = _ZEROS.sub(r"\1", _DIGITS.sub(r"\1", outline))
    return _COMMAND.sub(r"\1", _ROOM.sub(" ", rounded)).strip()


def still_element(drawing: Drawing, **attributes: object) -> Markup:
    """Return a drawing as a picture for wide and narrow windows; the attributes are those of the image."""
    wide, narrow = map(compact, page_pictures(drawing))
    return picture_element(wide, narrow, **attributes)


def narrow_image(drawing: Drawing, **attributes: object) -> Markup:
    """Return a drawing as an image with labels that a telephone shows large enough."""
    return tag("img", src=image_source(compact(narrow_picture(drawing))), **attributes)
