"""Installed fonts of pictures, and replacement texts for letters that they lack."""

from __future__ import annotations

import unicodedata
from functools import cache
from itertools import groupby

from matplotlib.font_manager import fontManager, get_font

#: Font of all pictures, included in Matplotlib.
FONT = "DejaVu Sans"
#: Fonts with Chinese, Japanese or Korean letters; installed ones are used for letters that the first font lacks.
_OTHERS = (
    "Noto Sans CJK JP",
    "Noto Sans CJK SC",
    "Noto Sans JP",
    "Noto Sans SC",
    "Noto Sans KR",
    "Source Han Sans",
    "WenQuanYi Micro Hei",
    "WenQuanYi Zen Hei",
    "IPAGothic",
    "IPAexGothic",
    "Droid Sans Fallback",
    "NanumGothic",
    "Hiragino Sans",
    "PingFang SC",
    "Apple SD Gothic Neo",
    "Yu Gothic",
    "Meiryo",
    "MS Gothic",
    "Microsoft YaHei",
    "SimHei",
    "Malgun Gothic",
    "Arial Unicode MS",
    "Unifont",
)


@cache
def families() -> tuple[str, ...]:
    """Return the names of the fonts of pictures, in order of preference."""
    installed = {entry.name for entry in fontManager.ttflist}
    return (FONT, *(name for name in _OTHERS if name in installed))


def needs_other_font(text: str) -> bool:
    """Return whether a text has a letter that the first font lacks and another font has."""
    return any(not _has(FONT, letter) and _is_known(letter) for letter in text)


def legible(text: str) -> str:
    """Return a text in which letters without a font are replaced by number and script, such as [3 letters, CJK]."""
    parts = []
    for known, run in groupby(text, _is_known):
        letters = list(run)
        parts.append("".join(letters) if known else _in_words(letters))
    return "".join(parts)


def _in_words(letters: list[str]) -> str:
    """Return the replacement text of letters without a font."""
    scripts = dict.fromkeys(unicodedata.name(letter, "unknown").split()[0] for letter in letters)
    kinds = ", ".join(script if script == "CJK" else script.capitalize() for script in scripts)
    return f"[{len(letters)} {'letter' if len(letters) == 1 else 'letters'}, {kinds}]"


def _is_known(letter: str) -> bool:
    return letter in " \n" or any(_has(family, letter) for family in families())


@cache
def _has(family: str, letter: str) -> bool:
    """Return whether a font has a letter."""
    font = get_font(fontManager.findfont(family, fallback_to_default=False))
    return bool(font.get_char_index(ord(letter)))
