"""Words of a G-code line: letters with numbers, as in LinuxCNC; each unsupported word has one sentence.

Case and spaces have no meaning outside comments. A letter may occur once on a line, except G and M, with one code of
each modal group.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

#: Letters of the axes, in the order of a point's coordinates.
AXES = {"X": 0, "Y": 1, "Z": 2, "A": 3, "B": 4, "C": 5}
#: Modal group of each supported G code; codes of one group exclude each other on a line.
_GROUPS: Mapping[float, str] = {
    **dict.fromkeys((0, 1, 2, 3, 80), "motion"),
    **dict.fromkeys((4, 10, 53, 92), "once"),
    92.1: "cancel",
    **dict.fromkeys((17, 18, 19), "plane"),
    **dict.fromkeys((20, 21), "unit"),
    40: "cutter",
    49: "tool length",
    **dict.fromkeys((54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3), "system"),
    **dict.fromkeys((61, 61.1, 64), "control"),
    **dict.fromkeys((90, 91), "distance"),
    **dict.fromkeys((90.1, 91.1), "centre"),
    **dict.fromkeys((93, 94), "feed"),
    97: "spindle",
    **dict.fromkeys((98, 99), "retract"),
}
#: Modal group of each supported M code.
_STOPS: Mapping[float, str] = {
    **dict.fromkeys((0, 1, 2, 30, 60), "stop"),
    **dict.fromkeys((3, 4, 5), "spindle"),
    6: "tool change",
    **dict.fromkeys((7, 8, 9), "coolant"),
    **dict.fromkeys((48, 49), "overrides"),
}
_CYCLES = "canned cycles are not supported; program their motions"
_CUTTER = "cutter compensation is not supported; program the path of the tool centre"
_TOOL = "tool length offsets are not supported; program the path of the platform"
_SUBROUTINE = "subroutines and branches are not supported; expand the program"
_VARIABLE = "variables are not supported; write the number"
#: Faults of LinuxCNC codes that are not supported here.
_REFUSED: Mapping[str, str] = {
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G5.3", "G6", "G6.1", "G6.2", "G6.3"), "splines are not supported"),
    **dict.fromkeys(("G7", "G8"), "lathe modes are not supported"),
    **dict.fromkeys(("G28", "G28.1", "G30", "G30.1"), "stored positions are not known; program the point with G53"),
    **dict.fromkeys(("G33", "G33.1", "G76"), "spindle-synchronised motions are not supported"),
    **dict.fromkeys(("G38.2", "G38.3", "G38.4", "G38.5"), "probing ends at a point that the program does not state"),
    **dict.fromkeys(("G41", "G41.1", "G42", "G42.1"), _CUTTER),
    **dict.fromkeys(("G43", "G43.1", "G43.2"), _TOOL),
    **dict.fromkeys(("G52", "G92.2", "G92.3"), "only G92 and G92.1 are supported for axis offsets"),
    **dict.fromkeys(("G70", "G71", "G71.1", "G71.2", "G72", "G72.1", "G72.2", "G73", "G74"), _CYCLES),
    **dict.fromkeys([f"G{code}" for code in range(81, 90)], _CYCLES),
    "G95": "a feed per turn needs the spindle speed, which is unknown; use G94 or G93",
    "G96": "constant cutting speed needs a lathe; use G97",
    **dict.fromkeys(("G17.1", "G18.1", "G19.1"), "axes U, V and W are not supported"),
    **dict.fromkeys(("M98", "M99"), _SUBROUTINE),
    **dict.fromkeys([f"M{code}" for code in range(100, 200)], "user-defined programs are not supported"),
}
#: Faults by the first character of a text that is not a word.
_SIGNS: Mapping[str, str] = {
    "[": "expressions are not supported; write the number",
    "#": _VARIABLE,
    "O": _SUBROUTINE,
    "(": "a comment has no end, or contains another one",
    ")": "a comment end has no beginning",
    "%": "% is only allowed alone on a line, at the beginning and the end of a program",
    "/": "a slash is only allowed at the beginning of a line",
    **dict.fromkeys("@^", "polar coordinates are not supported"),
}
#: Faults of LinuxCNC letters that are not supported here.
_LETTERS: Mapping[str, str] = {
    **dict.fromkeys("UVW", "axes U, V and W are not supported: a platform moves along X, Y, Z and rotates by A, B, C"),
    "D": _CUTTER,
    "H": _TOOL,
    "O": _SUBROUTINE,
    "E": "outputs are not supported, and numbers must not have exponents",
}
_WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_COMMENT = re.compile(r"\([^()]*\)|;.*")
#: Letters of words that are allowed in addition to codes.
_READ = frozenset("XYZABCFGIJKLMNPQRST")


class WordError(Exception):
    """Error in a line of a program.

    Attributes:
        word: faulty word; empty for the whole line.
        fault: description of the fault.
    """

    def __init__(self, word: str, fault: str) -> None:
        self.word, self.fault = word, fault
        super().__init__(word, fault)


class Block(NamedTuple):
    """Words of a program line.

    Attributes:
        codes: G codes, by the names of their modal groups.
        stops: M codes, by the names of their modal groups.
        words: values of the other letters, except N.
    """

    codes: dict[str, float]
    stops: dict[str, float]
    words: dict[str, float]


def block_of(line: str) -> Block:
    """Return the words of a line, with or without a slash at its beginning.

    Raises:
        WordError: the line contains an unsupported word.
    """
    text = line.upper().replace(" ", "").replace("\t", "")
    parts = _WORD.split(text)
    if any(parts[::3]):
        parts = _WORD.split(_COMMENT.sub("", text.removeprefix("/")))
        if any(parts[::3]):
            raise _unread(parts)
    codes: dict[str, float] = {}
    stops: dict[str, float] = {}
    words: dict[str, float] = {}
    for letter, number in zip(parts[1::3], parts[2::3], strict=True):
        if letter == "G":
            _put(letter, number, codes, _GROUPS)
        elif letter == "M":
            _put(letter, number, stops, _STOPS)
        elif letter in words:
            raise WordError(letter + number, f"{letter} occurs twice on the line")
        else:
            words[letter] = float(number)
    if not _READ.issuperset(words):
        letter = next(letter for letter in words if letter not in _READ)
        raise WordError(f"{letter}{words[letter]:g}", _LETTERS.get(letter, "no such word"))
    if "N" in words and (parts[1] != "N" or words.pop("N") < 0):
        raise WordError("N", "a line number must be positive and at the beginning of its line")
    return Block(codes, stops, words)


def _put(letter: str, number: str, codes: dict[str, float], groups: Mapping[float, str]) -> None:
    """Add a code to the codes of a line.

    Raises:
        WordError: the code is not supported, or conflicts with another code of the line.
    """
    code = float(number)
    group, name = groups.get(code), f"{letter}{code:.6g}"
    if group is None:
        raise WordError(name, _REFUSED.get(name, "this code is not supported"))
    if code == 80 and group in codes:
        return  # a motion on the same line comes before the end of the program
    if codes.get(group, 80) != 80:
        raise WordError(name, f"conflicts with {letter}{codes[group]:g}; they exclude each other")
    codes[group] = code


def shortened(text: str) -> str:
    """Return a text of a program with at most 40 characters, for messages."""
    return text if len(text) <= 40 else f"{text[:37]}..."


def _unread(parts: list[str]) -> WordError:
    """Return the error of a line that does not consist of words only.

    Args:
        parts: text before the first word, then letter, number and following text of each word.
    """
    at = next(k for k in range(0, len(parts), 3) if parts[k])
    text = shortened(parts[at])
    sign, rest = text[0], text[1:]
    if "O" in parts[1:at:3]:
        return WordError("O", _SUBROUTINE)
    if at and sign in ".+-0123456789":
        return WordError(f"{parts[at - 2]}{parts[at - 1]}{text}", "is not a number")
    fault = next((_SIGNS[each] for each in text if each in "[#"), _SIGNS.get(sign))
    if fault is None and "A" <= sign <= "Z":
        fault = "is not a number" if rest and not rest[0].isalpha() else "has no number"
    return WordError(text, fault or "is not a word of G-code")
