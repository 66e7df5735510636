"""Checks of cases as a result: the types and their construction."""

from collections.abc import Sequence

from .jsondata import JsonObject, Vector
from .parts import SCHEMA
from .regression import CaseCheck, PublishedCheck


class ExpectedData(JsonObject):
    """A computed number beside the one that the case expects.

    Attributes:
        quantity: dotted path in the case's result.
        expected: by the case.
        computed: as the result has it; null where it has none.
        tolerance: allowed difference.
        passed: whether the expectation holds.
    """

    quantity: str
    expected: float | bool | str
    computed: object
    tolerance: float
    passed: bool


class PublishedData(JsonObject):
    """A published number beside the computed one.

    Attributes:
        quantity: dotted path in the case's result, or gain.
        value: as printed.
        source: place in the literature.
        reproduced: whether the case says that the number is reproduced.
        because: the reason, where it is not.
        decimals: printed digits behind the point, where the value does not show them.
        over: name of the case that a gain is over.
        computed: the computed number; empty where there is none.
        verdict: of the check.
        rule: that decided, with its figures.
        passed: whether the check confirms the case.
    """

    quantity: str
    value: Vector
    source: str
    reproduced: bool
    because: str
    decimals: int | None
    over: str | None
    computed: Vector
    verdict: str
    rule: str
    passed: bool


class CaseCheckData(JsonObject):
    """Checks of one case.

    Attributes:
        case: name of the case.
        title: title of the case.
        passed: whether everything holds.
        seconds: wall time.
        expected: numbers that the case expects.
        published: numbers that the literature prints.
    """

    case: str
    title: str
    passed: bool
    seconds: float
    expected: tuple[ExpectedData, ...]
    published: tuple[PublishedData, ...]


class ChecksResult(JsonObject):
    """Result of checking cases.

    Attributes:
        schema: version of the format.
        passed: whether everything holds.
        cases: checks of each case.
    """

    schema: int
    passed: bool
    cases: tuple[CaseCheckData, ...]


def checks_of(checks: Sequence[CaseCheck]) -> ChecksResult:
    """Return the checks of several cases."""
    return ChecksResult(
        schema=SCHEMA,
        passed=all(check.passed for check in checks),
        cases=tuple(
            CaseCheckData.of(
                check,
                case=check.name,
                expected=tuple(ExpectedData.of(row) for row in check.expected),
                published=tuple(_published_data(row) for row in check.published),
            )
            for check in checks
        ),
    )


def _published_data(row: PublishedCheck) -> PublishedData:
    """Return the check of a published number as data."""
    return PublishedData.of(row.published, computed=row.computed, verdict=row.verdict, rule=row.rule, passed=row.passed)
