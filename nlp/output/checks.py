"""Checks as Markdown, JSON and JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any
from xml.etree import ElementTree

from ..results.regression import CaseCheck, PublishedCheck, decimals_of


def checks_as_data(checks: Sequence[CaseCheck]) -> dict[str, Any]:
    """The checks as plain data, ready for JSON."""
    return {
        "schema": 1,
        "passed": all(check.passed for check in checks),
        "cases": [
            {
                "case": check.name,
                "title": check.title,
                "passed": check.passed,
                "seconds": check.seconds,
                "expected": [asdict(row) for row in check.expected],
                "published": [
                    {
                        **asdict(row.published),
                        "computed": list(row.computed),
                        "verdict": row.verdict,
                        "rule": row.rule,
                        "passed": row.passed,
                    }
                    for row in check.published
                ],
            }
            for check in checks
        ],
    }


def checks_as_junit(checks: Sequence[CaseCheck]) -> str:
    """The checks as JUnit XML: a suite for each case, a test for each number."""
    root = ElementTree.Element("testsuites", name="screwsynth check")
    for check in checks:
        suite = ElementTree.SubElement(root, "testsuite", name=check.name, time=f"{check.seconds:.3f}")
        failures = 0
        for row in check.expected:
            fault = "" if row.passed else f"computed {row.computed}, expected {row.expected} within {row.tolerance}"
            failures += _add_test(suite, check.name, f"expected {row.quantity}", fault)
        for published in check.published:
            fault = "" if published.passed else f"newly changed: {describe(published)}"
            failures += _add_test(suite, check.name, f"published {published.published.quantity}", fault)
        suite.set("tests", str(len(check.expected) + len(check.published)))
        suite.set("failures", str(failures))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_test(suite: ElementTree.Element, case: str, name: str, fault: str) -> int:
    test = ElementTree.SubElement(suite, "testcase", classname=case, name=name)
    if fault:
        ElementTree.SubElement(test, "failure", message=fault)
    return 1 if fault else 0


def checks_as_markdown(checks: Sequence[CaseCheck]) -> str:
    """The published numbers as a Markdown table: printed, computed, verdict and reason."""
    lines = [
        "| case | where | quantity | printed | computed | verdict | rule or reason |",
        "|---|---|---|---|---|---|---|",
    ]
    for check in checks:
        for row in check.published:
            said = row.published
            reason = said.because if not row.reproduced else row.rule.partition(":")[0]
            cells = [check.name, said.source, quantity_of(row), printed(row), computed(row), row.verdict, reason]
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def quantity_of(row: PublishedCheck) -> str:
    """Name of a published quantity."""
    said = row.published
    return said.quantity if said.over is None else f"gain over {said.over}, %"


def printed(row: PublishedCheck) -> str:
    """A published number with the digits that were printed."""
    return _listed(f"{value:.{_decimals(row, value)}f}" for value in row.published.value)


def computed(row: PublishedCheck) -> str:
    """The computed number with two digits more than were printed."""
    if not row.computed:
        return "none"
    shown = zip(row.computed, row.published.value, strict=True)
    return _listed(f"{value + 0.0:.{_decimals(row, said) + 2}f}" for value, said in shown)


def describe(row: PublishedCheck) -> str:
    """A published number, the computed one and the rule, in one line."""
    return f"{quantity_of(row)}: printed {printed(row)}, computed {computed(row)} ({row.rule})"


def _decimals(row: PublishedCheck, value: float) -> int:
    return decimals_of(value) if row.published.decimals is None else row.published.decimals


def _listed(texts: Any) -> str:  # noqa: ANN401 - any iterable of text
    parts = list(texts)
    return parts[0] if len(parts) == 1 else f"({', '.join(parts)})"
