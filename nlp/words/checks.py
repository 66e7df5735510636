"""Checks of cases: lines and tables."""

from collections.abc import Iterable, Iterator, Sequence

from ..results.checks import CaseCheck, PublishedCheck, decimals_of
from .lines import counted
from .text import Line, TextTable, Tone, in_part

#: Number of failed values that a short view shows in full.
_FAULTS = 8


def checks_summary(checks: Sequence[CaseCheck]) -> Iterator[Line | TextTable]:
    """Yield the number of values that agree, by case, and every value that does not agree."""
    faults = [fault for check in checks for fault in _faults(check)]
    yield (
        Line(f"{counted(len(faults), 'value')} not as expected", tone=Tone.NO_ANSWER)
        if faults
        else Line("all values as expected", tone=Tone.HOLDS)
    )
    published = [row for check in checks for row in check.published]
    held = sum(row.passed for check in checks for row in check.expected)
    count = f"{held} of {sum(len(check.expected) for check in checks)} expected values agree"
    reproduced = sum(row.is_reproduced for row in published)
    words = f"; {reproduced} of {len(published)} published values are reproduced" if published else ""
    yield Line(f"{counted(len(checks), 'case')}: {count}{words}")
    for k, fault in enumerate(faults):
        yield Line(fault, tone=Tone.FAULT, part="values not as expected" if k >= _FAULTS else "")
    rows = tuple(_summary_row(check) for check in checks)
    yield from in_part("cases", [TextTable(("case", "expected", "published", "seconds"), rows)])


def _summary_row(check: CaseCheck) -> tuple[str | Line, ...]:
    """Return a case's row: its name, counts and seconds."""
    reproduced = sum(row.is_reproduced for row in check.published)
    held = sum(row.passed for row in check.expected)
    published = f"{reproduced} reproduced, {len(check.published) - reproduced} not" if check.published else ""
    name = Line(check.name, tone=Tone.PLAIN if check.passed else Tone.NO_ANSWER)
    return name, f"{held} of {len(check.expected)} agree", published, f"{check.seconds:.1f}"


def _faults(check: CaseCheck) -> Iterator[str]:
    """Yield a sentence for each value of a case that is not as expected."""
    for row in check.expected:
        if not row.passed:
            yield f"{check.name}: {row.quantity} is {row.computed}, expected {row.expected} within {row.tolerance:g}"
    for published in check.published:
        if not published.passed:
            yield f"{check.name}: newly changed: {published_words(published)}"


def reproduction_table(checks: Iterable[CaseCheck]) -> TextTable:
    """Return the published values of cases: printed, computed, verdict and reason."""
    rows = []
    for check in checks:
        for row in check.published:
            reason = row.because if not row.is_reproduced else row.rule.partition(":")[0]
            rows.append((check.name, row.source, _quantity(row), _printed(row), _computed(row), row.verdict, reason))
    return TextTable(("case", "where", "quantity", "printed", "computed", "verdict", "rule or reason"), tuple(rows))


def published_table(check: CaseCheck) -> TextTable:
    """Return the published values of one case with the computed ones."""
    rows = [
        (
            row.quantity,
            ", ".join(f"{value:g}" for value in row.value),
            ", ".join(f"{value:.7g}" for value in row.computed) or "none",
            row.verdict,
            row.source,
            row.because or row.rule,
        )
        for row in check.published
    ]
    return TextTable(("quantity", "published", "computed", "verdict", "where", "rule or reason"), tuple(rows))


def published_words(row: PublishedCheck) -> str:
    """Return a published value, the computed value and the rule, in one line."""
    return f"{_quantity(row)}: printed {_printed(row)}, computed {_computed(row)} ({row.rule})"


def _quantity(row: PublishedCheck) -> str:
    """Return the name of a published quantity."""
    return row.quantity if row.over is None else f"gain over {row.over}, %"


def _printed(row: PublishedCheck) -> str:
    """Return a published value with the printed digits."""
    return _tuple(f"{value:.{_decimals(row, value)}f}" for value in row.value)


def _computed(row: PublishedCheck) -> str:
    """Return the computed value with two digits more than the printed one."""
    if not row.computed:
        return "none"
    shown = zip(row.computed, row.value, strict=True)
    return _tuple(f"{value + 0.0:.{_decimals(row, said) + 2}f}" for value, said in shown)


def _decimals(row: PublishedCheck, value: float) -> int:
    return decimals_of(value) if row.decimals is None else row.decimals


def _tuple(texts: Iterable[str]) -> str:
    parts = list(texts)
    return parts[0] if len(parts) == 1 else f"({', '.join(parts)})"
