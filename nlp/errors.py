"""Errors of the package.

The tree::

    ScrewsynthError
    ├── InputError          wrong input by the user; the command line exits with status 2
    │   └── CaseError       wrong input in a case, with the file, the dotted key, the value and the allowed values
    │       └── NoRobotError    dimensions with which the robot does not exist
    ├── EvaluationError     the robot does not exist at a point: a limb of zero length, a joint out of reach
    └── UncoveredError      a proof needs bounds of an operation that has no rule

A search that fails raises no exception: its outcome is the status of the solution.
"""

from __future__ import annotations

from collections.abc import Iterable


class ScrewsynthError(Exception):
    """Base class of the errors that this package raises on purpose, with a message of one sentence on one line."""

    def __str__(self) -> str:
        return one_line(_shortened(super().__str__()))


class InputError(ScrewsynthError):
    """Error in the user's input."""


class EvaluationError(ScrewsynthError):
    """Error of a point at which the robot's equations have no finite value."""


class UncoveredError(ScrewsynthError):
    """Error of an expression graph with an operation that has no rule in a proof.

    Args:
        operation: the operation, in words for people.
        limit: dotted key of the case's limit whose expressions hold it; None where it is the robot's, or not known.
    """

    def __init__(self, operation: str, limit: str | None = None) -> None:
        self.operation, self.limit = operation, limit
        where = "the robot's expressions" if limit is None else f"the expressions of the limit {limit}"
        super().__init__(f"no bound can be proved: {where} hold {operation}, which has no rule")


class CaseError(InputError):
    """Error in a case.

    Attributes:
        key: dotted key of the fault, in the words of a case file.
        fault: the fault, and the allowed values.
        value: the value as the user wrote it; None where the message does not show it.
        source: name of the file; None where it is not known.
    """

    def __init__(self, key: str, fault: str, value: object = None, source: str | None = None) -> None:
        self.key, self.fault, self.value, self.source = key, fault, value, source
        super().__init__(key, fault, value, source)

    def __str__(self) -> str:
        where = f"{self.source}: " if self.source else ""
        value = "" if self.value is None else f" = {_text_of(self.value)}"
        return one_line(_shortened(f"{where}{self.key}{value}: {self.fault}"))

    def within(self, source: str) -> CaseError:
        """Return the same error with the name of the file in which it is."""
        return type(self)(self.key, self.fault, self.value, source)


class NoRobotError(CaseError):
    """Error of dimensions, each of which is allowed, with which a case's robot does not exist."""


#: Spaces of typography that Python does not call printable: without a break, thin, and as wide as a character.
_SPACES = "\u00a0\u2009\u202f\u3000"


#: Largest number of characters of a message, beyond which its middle is left out; and of a name that is compared.
_LONGEST, _LONGEST_NAME = 4_000, 200


def _shortened(text: str) -> str:
    """Return a message without its middle where that is long, as the names of a file may be."""
    half = _LONGEST // 2
    return text if len(text) <= _LONGEST else f"{text[:half]} ... {text[-half:]}"


def check_seconds(seconds: float | None) -> None:
    """Refuse a time that is not positive.

    Raises:
        InputError: it is not.
    """
    if seconds is not None and not seconds > 0:
        raise InputError(f"--time {seconds:g}: must be positive")


def one_line(text: str) -> str:
    """Return a text with line breaks, control characters and marks of direction as escape sequences."""
    return "".join(
        char if char.isprintable() or char in _SPACES else char.encode("unicode_escape").decode() for char in text
    )


def listing(names: Iterable[str]) -> str:
    """Return names as a list for a sentence, in the order given; ``none`` where there is none."""
    return ", ".join(names) or "none"


def nearest(name: str, allowed: Iterable[str], others: Iterable[str] = ()) -> str:
    """Return a hint for a name that is not allowed: the most similar allowed name, if any, then all allowed names.

    Args:
        name: that is not allowed.
        allowed: names that are listed.
        others: allowed names that are too many to be listed.
    """
    names = list(allowed)
    return f"{did_you_mean(name, [*names, *others])}allowed: {listing(names)}"


def did_you_mean(name: str, allowed: Iterable[str], likeness: float = 0.6) -> str:
    """Return a question with the most similar allowed name, and a space; empty where none is so similar.

    Args:
        name: that is not allowed.
        allowed: allowed names.
        likeness: least likeness, 1 for equal names.
    """
    import difflib  # noqa: PLC0415 - only messages need it

    close = difflib.get_close_matches(name[:_LONGEST_NAME], list(allowed), n=1, cutoff=likeness)
    return f"did you mean {close[0]!r}? " if close else ""


def _text_of(value: object) -> str:
    """Return a value as a case file writes it, at most 60 characters long."""
    text = f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else f"{value}"
    return text if len(text) <= 60 else f"{text[:57]}..."
