"""Exceptions of the package, and texts for messages.

The tree::

    ScrewsynthError
    ├── InputError          wrong input by the user; the command line exits with status 2
    │   └── CaseError       wrong input in a case, with file, dotted key, value and allowed values
    │       └── NoRobotError    dimensions for which the robot does not exist
    ├── EvaluationError     no robot at a point: a limb of zero length, a joint out of reach
    └── UncoveredError      a proof needs bounds of an operation without a rule

A failed search raises no exception: the solution has its outcome as status.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

#: Name of a load without a name in the case file.
_UNNAMED_LOAD = re.compile(r"load \d+\b")


class ScrewsynthError(Exception):
    """Base class of the exceptions of this package, with a message of one line."""

    def __str__(self) -> str:
        return one_line(_shortened(super().__str__()))


class InputError(ScrewsynthError):
    """Error in the user's input."""


class EvaluationError(ScrewsynthError):
    """Error at a point where the robot's equations have no finite value."""


class UncoveredError(ScrewsynthError):
    """Error of a proof about expressions with an operation that has no rule.

    Args:
        operation: description of the operation.
        limit: dotted key of the limit with the operation; None for expressions of the robot, or if unknown.
    """

    def __init__(self, operation: str, limit: str | None = None) -> None:
        self.operation, self.limit = operation, limit
        where = "the robot's expressions" if limit is None else f"the expressions of the limit {limit}"
        super().__init__(f"no bound can be proved: {where} contain {operation}, which has no rule")


class CaseError(InputError):
    """Error in a case.

    Attributes:
        key: dotted key of the wrong value in the case file.
        fault: description of the error, with the allowed values.
        value: value as written by the user; None if the message does not show it.
        source: name of the file; None if unknown.
    """

    def __init__(self, key: str, fault: str, value: object = None, source: str | None = None) -> None:
        self.key, self.fault, self.value, self.source = key, fault, value, source
        super().__init__(key, fault, value, source)

    def __str__(self) -> str:
        where = f"{self.source}: " if self.source else ""
        value = "" if self.value is None else f" = {_text_of(self.value)}"
        return one_line(_shortened(f"{where}{self.key}{value}: {self.fault}"))

    def within(self, source: str) -> CaseError:
        """Return the same error with the name of its file."""
        return type(self)(self.key, self.fault, self.value, source)


class NoRobotError(CaseError):
    """Error of allowed dimensions for which a case's robot does not exist."""


#: Typographic spaces that Python does not consider printable: no-break, thin, and ideographic.
_SPACES = "\u00a0\u2009\u202f\u3000"


#: Largest number of characters of a message, above which its middle is omitted; and of a compared name.
_LONGEST, _LONGEST_NAME = 4_000, 200


def _shortened(text: str) -> str:
    """Return a message, without its middle if it is too long."""
    half = _LONGEST // 2
    return text if len(text) <= _LONGEST else f"{text[:half]} ... {text[-half:]}"


def check_seconds(seconds: float | None) -> None:
    """Refuse a time that is not positive.

    Raises:
        InputError: the time is not positive.
    """
    if seconds is not None and not seconds > 0:
        raise InputError(f"--time {seconds:g}: must be positive")


def one_line(text: str) -> str:
    """Return a text with line breaks, control characters and direction marks as escape sequences."""
    return "".join(
        char if char.isprintable() or char in _SPACES else char.encode("unicode_escape").decode() for char in text
    )


def listing(names: Iterable[str]) -> str:
    """Return names as a list for a sentence, in the given order; ``none`` without names."""
    return ", ".join(names) or "none"


def nearest(name: str, allowed: Iterable[str], others: Iterable[str] = ()) -> str:
    """Return a hint for an unknown name: the most similar allowed name, if any, then all allowed names.

    Args:
        name: unknown name.
        allowed: allowed names that are listed.
        others: further allowed names, too many for a list.
    """
    names = list(allowed)
    return f"{did_you_mean(name, [*names, *others])}allowed: {listing(names)}"


def did_you_mean(name: str, allowed: Iterable[str], likeness: float = 0.6) -> str:
    """Return a question with the most similar allowed name and a space; empty without a similar name.

    Args:
        name: unknown name.
        allowed: allowed names.
        likeness: least similarity, 1 for equal names.
    """
    import difflib  # noqa: PLC0415 - only messages need it

    close = difflib.get_close_matches(name[:_LONGEST_NAME], list(allowed), n=1, cutoff=likeness)
    return f"did you mean {close[0]!r}? " if close else ""


def _text_of(value: object) -> str:
    """Return a value as in a case file, with at most 60 characters."""
    text = f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else f"{value}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def load_words(name: str) -> str:
    """Return a load in words: ``load "cutting"``, or the name itself for a load without a name, such as ``load 1``."""
    return name if _UNNAMED_LOAD.match(name) else f'load "{name}"'
