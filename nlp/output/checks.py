"""Checks as Markdown and JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from ..errors import one_line
from ..results.checks import CaseCheck
from ..words.checks import published_words, reproduction_table
from .tables import markdown


def checks_as_junit(checks: Sequence[CaseCheck]) -> str:
    """Return the checks as JUnit XML: a suite for each case, a test for each expected or published value."""
    root = ElementTree.Element("testsuites", name="screwsynth check")
    for check in checks:
        suite = ElementTree.SubElement(root, "testsuite", name=one_line(check.name), time=f"{check.seconds:.3f}")
        failures = 0
        for row in check.expected:
            fault = "" if row.passed else f"computed {row.computed}, expected {row.expected} within {row.tolerance}"
            failures += _add_test(suite, check.name, f"expected {row.quantity}", fault)
        for published in check.published:
            fault = "" if published.passed else f"changed since the last check: {published_words(published)}"
            failures += _add_test(suite, check.name, f"published {published.quantity}", fault)
        suite.set("tests", str(len(check.expected) + len(check.published)))
        suite.set("failures", str(failures))
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_test(suite: ElementTree.Element, case: str, name: str, fault: str) -> int:
    """Add a test to a suite, failed if ``fault`` is not empty; return the number of failures, 0 or 1."""
    test = ElementTree.SubElement(suite, "testcase", classname=one_line(case), name=one_line(name))
    if fault:
        ElementTree.SubElement(test, "failure", message=one_line(fault))
    return 1 if fault else 0


def checks_as_markdown(checks: Sequence[CaseCheck]) -> str:
    """Return the published values as a Markdown table: published, computed, verdict and reason."""
    return markdown(reproduction_table(checks))
