"""What can go wrong.

The tree::

    ScrewsynthError
    ├── InputError          what the user gave is wrong; the command line exits with status 2
    │   └── CaseError       ... in a case: carries the file, the dotted key, the value and what is allowed
    ├── EvaluationError     the robot does not exist at a point: a limb of zero length, a joint out of reach
    └── UncoveredError      a proof would need bounds of an operation that there is no rule for

A search that fails is no exception: its outcome is the status of the solution.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ScrewsynthError(Exception):
    """Base class of the errors that this package raises on purpose. The message is one sentence, on one line."""

    def __str__(self) -> str:
        return one_line(super().__str__())


class InputError(ScrewsynthError):
    """What the user gave is wrong."""


class EvaluationError(ScrewsynthError):
    """The robot's equations give no finite number at a point."""


class UncoveredError(ScrewsynthError):
    """The expression graph holds something that a proof has no rule for; it is named."""

    def __init__(self, what: str) -> None:
        super().__init__(f"no bound can be proved: the robot's expressions hold {what}, which has no rule")


class CaseError(InputError):
    """A case says something that is not allowed.

    Attributes:
        key: dotted key of the fault, in the words of a case file.
        fault: what is wrong with it, and what is allowed.
        value: the value as the user wrote it, where it helps.
        source: name of the file, once known.
    """

    def __init__(self, key: str, fault: str, value: object = None, source: str | None = None) -> None:
        self.key, self.fault, self.value, self.source = key, fault, value, source
        super().__init__(key, fault, value, source)

    def __str__(self) -> str:
        where = f"{self.source}: " if self.source else ""
        return one_line(f"{where}{self.key}{'' if self.value is None else f' = {_shown(self.value)}'}: {self.fault}")

    def within(self, source: str) -> CaseError:
        """The same fault, found in a named file."""
        return CaseError(self.key, self.fault, self.value, source)


def one_line(text: str) -> str:
    """The text with line breaks and other control characters written as escapes."""
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)


def listing(names: Iterable[str]) -> str:
    """Names for a sentence, in the order given."""
    return ", ".join(names) or "none"


def nearest(name: str, allowed: Iterable[str]) -> str:
    """A hint at the allowed name that a misspelt one probably means, then all that is allowed."""
    names = list(allowed)
    close = difflib.get_close_matches(name, names, n=1)
    return f"{f'did you mean {close[0]!r}? ' if close else ''}allowed: {listing(names)}"


def _shown(value: object) -> str:
    text = f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else f"{value}"
    return text if len(text) <= 60 else f"{text[:57]}..."
